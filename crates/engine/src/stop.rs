//! Stopping: a value that travels with the [clock](crate::clock) of work, and tells it to end.
//!
//! Work that may take long looks at its clock at each turn, and returns [`Stopped`] once it is told to end: so
//! everything half-made is dropped on the way out. As an error of a bake or a map it is
//! [`Error::Interrupted`](crate::error::Error::Interrupted).
//!
//! ```standalone_crate
//! use std::{thread, time::Duration};
//! # use terrane_engine as terrane;
//! use terrane::{area::TileId, clock::Clock, error::Error, preset::Preset, stop::Stop, tile::Tile, world::World};
//!
//! let world = World::new(Preset::load("alps")?.1, None)?;
//! let stop = Stop::default();
//! let clock = Clock::stopped_by(&stop);
//! thread::scope(|scope| {
//!     let baker = scope.spawn(|| {
//!         (0..).try_for_each(|x| Tile::timed(&world, TileId { x, y: 0 }, &clock).map(drop)).map_err(Error::from)
//!     });
//!     thread::sleep(Duration::from_millis(100));
//!     stop.request();
//!     assert!(matches!(baker.join().unwrap(), Err(Error::Interrupted)));
//! });
//! // The world can still be used, and makes the same tiles.
//! let tile = Tile::new(&world, TileId { x: 0, y: 0 });
//! let another = World::new(Preset::load("alps")?.1, None)?;
//! assert!(tile.heights().values() == Tile::new(&another, tile.id()).heights().values());
//! # Ok::<(), Error>(())
//! ```

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// Interval between two looks at the stop while waiting.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Tells work to end. Copies are one and the same stop.
///
/// If stopped work was computing a value for which other threads wait, they compute it themselves.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<StopState>);

#[derive(Debug, Default)]
struct StopState {
    is_requested: AtomicBool,
    parent: Option<Stop>,
}

/// The work was told to end before it was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Stopped;

impl Stop {
    /// Returns a stop for a part of the work, which ends with the whole, or alone.
    #[must_use]
    pub fn child(&self) -> Stop {
        Stop(Arc::new(StopState { is_requested: AtomicBool::new(false), parent: Some(self.clone()) }))
    }

    /// Asks the work to end. It ends within a fraction of a second, and work begun after that ends at once.
    pub fn request(&self) {
        self.0.is_requested.store(true, Ordering::Relaxed);
    }

    /// Tells whether the work is to end.
    #[inline]
    pub fn is_requested(&self) -> bool {
        self.0.is_requested.load(Ordering::Relaxed) || self.0.parent.as_ref().is_some_and(Stop::is_requested)
    }

    /// Looks at the stop.
    ///
    /// # Errors
    /// When the work is to end.
    #[inline]
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_requested() { Err(Stopped) } else { Ok(()) }
    }

    /// Runs work that cannot look at a stop itself, such as an encoder that takes a whole picture at once, and returns
    /// its result. The work gets a thread of its own.
    ///
    /// # Errors
    /// When the work is to end; then the thread is abandoned.
    pub fn wait_for<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Stopped> {
        let (done, result) = sync_channel(1);
        let work = Arc::new(Mutex::new(Some(work)));
        let take = |work: &Mutex<Option<_>>| work.lock().ok().and_then(|mut work| work.take());
        let theirs = work.clone();
        let begin = move || _ = take(&theirs).map(|work| done.send(work()));
        // If no more threads can be started, the work is done on this thread, and a stop has to wait for it.
        let Ok(thread) = thread::Builder::new().spawn(begin) else {
            return Ok(take(&work).expect("nobody else has begun it")());
        };
        loop {
            match result.recv_timeout(LOOK_INTERVAL) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) => self.check()?,
                Err(RecvTimeoutError::Disconnected) => {
                    resume_unwind(thread.join().expect_err("it ends without a result by a panic alone"))
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    #[test]
    fn a_part_ends_with_the_whole_or_alone() {
        let whole = Stop::default();
        let [one, other] = [whole.child(), whole.child()];
        one.clone().request();
        assert_eq!([&one, &other, &whole].map(Stop::check), [Err(Stopped), Ok(()), Ok(())]);
        whole.request();
        assert_eq!([&one, &other, &whole].map(Stop::check), [Err(Stopped); 3]);
    }

    #[test]
    fn what_is_waited_for_comes_back_or_panics_here_or_is_abandoned() {
        let stop = Stop::default();
        assert_eq!(stop.wait_for(|| 7), Ok(7));
        let panic = catch_unwind(AssertUnwindSafe(|| stop.wait_for(|| resume_unwind(Box::new("a bug")))));
        assert_eq!(panic.unwrap_err().downcast_ref(), Some(&"a bug"));
        stop.request();
        assert_eq!(stop.wait_for(|| thread::sleep(Duration::from_secs(1000))), Err(Stopped));
    }
}
