//! Stopping: a request that ends all work of the process, wherever it is.
//!
//! Whoever stops does not know what runs, and a signal means the whole process: so there is one request for all threads. Loops
//! that may run long look at it at each turn ([`check`]), and unwind when it is there, through locks, pools of threads and files
//! under way, whose destructors leave nothing behind. No function says in its type that it can be stopped, and none forgets to
//! hand it on. Where a command or a bake begins, [`catch`] makes an error of it.
//!
//! What is not wanted any more while the process goes on, such as a picture that somebody has scrolled away from, ends in the same
//! way: it runs [within](Stopper::run) a [`Stopper`] of its own, on one thread.
//!
//! The alternative is to return [`Error::Interrupted`] from all that takes time, down to the search of a road: most of what
//! computes here has no other way to fail.
//!
//! ```standalone_crate
//! use std::{thread, time::Duration};
//! # use terrane_engine as terrane;
//! use terrane::{area::TileId, error::Error, preset::Preset, stop, tile::Tile, world::World};
//!
//! let world = World::new(Preset::load("alps")?.1, None)?;
//! thread::scope(|scope| {
//!     let baker = scope.spawn(|| {
//!         stop::catch(|| {
//!             (0..).for_each(|x| drop(Tile::new(&world, TileId { x, y: 0 })));
//!             Ok(())
//!         })
//!     });
//!     thread::sleep(Duration::from_millis(100));
//!     stop::request();
//!     assert!(matches!(baker.join().unwrap(), Err(Error::Interrupted)));
//! });
//! // The world is as good as before.
//! stop::withdraw();
//! let tile = Tile::new(&world, TileId { x: 0, y: 0 });
//! let another = World::new(Preset::load("alps")?.1, None)?;
//! assert!(tile.heights().values() == Tile::new(&another, tile.id()).heights().values());
//! # Ok::<(), Error>(())
//! ```

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use crate::error::Error;

/// Whether all work is to end.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// How many requests there are: that one, and those of stoppers. While there are none, to look costs a load and a branch.
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// What stops this thread beside the request for all.
    static STOPPER: RefCell<Option<Stopper>> = const { RefCell::new(None) };
}

/// Between two looks at the request while something is waited for.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// What a stop unwinds with.
struct Stopped;

/// Asks all work of the process to end: it does within a fraction of a second, and what is begun after that ends at once.
pub fn request() {
    if !REQUESTED.swap(true, Ordering::Relaxed) {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
    }
}

/// Lets work begin again, when all that was to end has ended.
pub fn withdraw() {
    if REQUESTED.swap(false, Ordering::Relaxed) {
        REQUESTS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Whether all work is to end.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Unwinds when all work, or that of this thread's [`Stopper`], is to end: a load and a branch when not. While a thread unwinds
/// already it does nothing, so that destructors can work. A lock that is held is poisoned: whoever finds it so checks as well, before
/// it takes that for a panic.
#[inline]
pub fn check() {
    if REQUESTS.load(Ordering::Relaxed) > 0 {
        check_whose();
    }
}

#[cold]
fn check_whose() {
    if is_requested() || STOPPER.with_borrow(|stopper| stopper.as_ref().is_some_and(Stopper::is_requested)) {
        unwind();
    }
}

/// Ends some work of the process, and no other: what is not wanted any more.
///
/// What stopped work was making, and others wait for, they make themselves.
#[derive(Clone, Debug, Default)]
pub struct Stopper(Arc<Asked>);

#[derive(Debug, Default)]
struct Asked(AtomicBool);

impl Drop for Asked {
    fn drop(&mut self) {
        if *self.0.get_mut() {
            REQUESTS.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

impl Stopper {
    /// Asks the work to end.
    pub fn request(&self) {
        if !self.0.0.swap(true, Ordering::Relaxed) {
            REQUESTS.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Whether the work is to end.
    pub fn is_requested(&self) -> bool {
        self.0.0.load(Ordering::Relaxed)
    }

    /// What `work` returns, which is done on this thread alone: other threads do not know of this stopper.
    ///
    /// # Errors
    /// Those of `work`, and [`Error::Interrupted`] when it was stopped.
    pub fn run<T>(&self, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        let outer = STOPPER.replace(Some(self.clone()));
        let done = catch_unwind(AssertUnwindSafe(|| catch(work)));
        STOPPER.set(outer);
        done.unwrap_or_else(|payload| resume_unwind(payload))
    }
}

#[cold]
fn unwind() {
    if !thread::panicking() {
        // Not a panic: nothing is wrong, so nothing is said.
        resume_unwind(Box::new(Stopped));
    }
}

/// What `work` returns, which cannot look at the request itself, such as an encoder that takes a whole picture at once: it has a
/// thread of its own, which is left alone with it when all is to end.
pub fn wait_for<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, result) = sync_channel(1);
    let work = Arc::new(Mutex::new(Some(work)));
    let take = |work: &Mutex<Option<_>>| work.lock().ok().and_then(|mut work| work.take());
    let theirs = work.clone();
    let begin = move || _ = take(&theirs).map(|work| done.send(work()));
    // Where no more threads can be started it is done here, and cannot be left alone.
    let Ok(thread) = thread::Builder::new().spawn(begin) else {
        return take(&work).expect("nobody else has begun it")();
    };
    loop {
        match result.recv_timeout(LOOK_INTERVAL) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Timeout) => check(),
            Err(RecvTimeoutError::Disconnected) => {
                resume_unwind(thread.join().expect_err("it ends without a result by a panic alone"))
            }
        }
    }
}

/// What `work` returns. Any panic but a stop goes on.
///
/// # Errors
/// Those of `work`, and [`Error::Interrupted`] when it was stopped.
pub fn catch<T>(work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    // What a stop leaves half-made is owned by what unwinds, or is a cache whose values are whole or not there.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result,
        Err(payload) if payload.is::<Stopped>() => Err(Error::Interrupted),
        Err(payload) => resume_unwind(payload),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_an_error_through_threads_and_a_panic_is_none() {
        let stopped = || -> Result<(), Error> { resume_unwind(Box::new(Stopped)) };
        assert!(matches!(catch(stopped), Err(Error::Interrupted)));
        let beside = || -> Result<(), Error> { rayon::join(stopped, || ()).0 };
        assert!(matches!(catch(beside), Err(Error::Interrupted)));
        assert!(matches!(catch(|| Ok(1)), Ok(1)));
        let panic = catch_unwind(|| catch::<()>(|| resume_unwind(Box::new("a bug"))));
        assert_eq!(panic.unwrap_err().downcast_ref(), Some(&"a bug"));
    }

    #[test]
    fn a_stopper_ends_its_own_work_and_no_other() {
        let [one, other] = [Stopper::default(), Stopper::default()];
        let looks = |stopper: &Stopper, by: &Stopper| {
            stopper.run(|| {
                check();
                by.request();
                check();
                Ok(())
            })
        };
        assert!(matches!(looks(&one, &one), Err(Error::Interrupted)));
        assert!(matches!(looks(&one, &one), Err(Error::Interrupted)), "it begins no work either");
        assert!(matches!(looks(&other, &one), Ok(())));
        // Who stands outside does not unwind, and one within another ends alone.
        check();
        let outer = Stopper::default();
        let both = outer.run(|| {
            let inner = one.run(|| {
                check();
                Ok(())
            });
            assert!(matches!(inner, Err(Error::Interrupted)));
            check();
            Ok(())
        });
        assert!(matches!(both, Ok(())));
    }

    #[test]
    fn what_is_waited_for_comes_back_or_panics_here() {
        assert_eq!(wait_for(|| 7), 7);
        let panic = catch_unwind(|| wait_for(|| resume_unwind(Box::new("a bug"))));
        assert_eq!(panic.unwrap_err().downcast_ref(), Some(&"a bug"));
    }
}
