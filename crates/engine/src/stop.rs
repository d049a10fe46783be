//! Stopping: a request that ends all work of the process, whichever threads do it.
//!
//! Whoever asks for a stop does not know what runs, and a signal concerns the whole process: so one request serves all
//! threads. Loops that may run long look at the request at each turn ([`check`]), and unwind once there is one: through
//! locks, thread pools and half-written files, whose destructors leave nothing behind. So no function needs a return
//! type that says it can be stopped, and no caller can forget to pass the stop on. Where a command or a bake begins,
//! [`catch`] turns the unwinding into an error.
//!
//! Work that has lost its purpose while the process goes on, such as drawing a picture that somebody has scrolled away
//! from, ends in the same way: it runs [within](Stopper::run) a [`Stopper`] of its own, on one thread.
//!
//! The alternative would be to return [`Error::Interrupted`] from everything that takes time, down to the search of a
//! road; most of those functions have no other way to fail.
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
//! // The world can still be used, and makes the same tiles.
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

/// True if all work is to end.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Number of requests: the one for all work, and those of stoppers. While it is 0, a check costs a load and a branch.
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    /// The stopper that can stop this thread, beside the request for all work.
    static STOPPER: RefCell<Option<Stopper>> = const { RefCell::new(None) };
}

/// Interval between two looks at the request while waiting.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// The payload with which a stop unwinds.
struct Stopped;

/// Asks all work of the process to end. It ends within a fraction of a second, and work begun after that ends at once.
pub fn request() {
    if !REQUESTED.swap(true, Ordering::Relaxed) {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
    }
}

/// Lets work begin again, once all work that was to end has ended.
pub fn withdraw() {
    if REQUESTED.swap(false, Ordering::Relaxed) {
        REQUESTS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Tells whether all work is to end.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Unwinds if all work is to end, or that of this thread's [`Stopper`]; if not, it costs a load and a branch. It does
/// nothing while the thread unwinds already, so that destructors can work. Locks that are held are poisoned: a thread
/// that finds a poisoned lock has to call `check` too, before it takes the poison for a panic.
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

/// Ends one piece of work and leaves the rest of the process alone.
///
/// If stopped work was computing a value for which other threads wait, they compute it themselves.
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

    /// Tells whether the work is to end.
    pub fn is_requested(&self) -> bool {
        self.0.0.load(Ordering::Relaxed)
    }

    /// Runs `work` on this thread, where the stopper can stop it, and returns its result. Threads that `work` starts do
    /// not know of the stopper.
    ///
    /// # Errors
    /// The errors of `work`, and [`Error::Interrupted`] when it was stopped.
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
        // Unwinds without a panic: nothing is wrong, so no message is printed.
        resume_unwind(Box::new(Stopped));
    }
}

/// Runs work that cannot look at the request itself, such as an encoder that takes a whole picture at once, and returns
/// its result. The work gets a thread of its own; when all work is to end, the thread is abandoned.
pub fn wait_for<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, result) = sync_channel(1);
    let work = Arc::new(Mutex::new(Some(work)));
    let take = |work: &Mutex<Option<_>>| work.lock().ok().and_then(|mut work| work.take());
    let theirs = work.clone();
    let begin = move || _ = take(&theirs).map(|work| done.send(work()));
    // If no more threads can be started, the work is done on this thread, and a stop has to wait for it.
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

/// Runs `work` and returns its result, with a stop turned into an error. Any other panic goes on.
///
/// # Errors
/// The errors of `work`, and [`Error::Interrupted`] when it was stopped.
pub fn catch<T>(work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    // Unwind safe: all that a stop leaves half-made is dropped by the unwinding, or is in a cache whose values are
    // complete or missing.
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
        // Code outside the stopper does not unwind, and an inner stopper does not stop an outer one.
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
