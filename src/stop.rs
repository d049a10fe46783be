//! Stopping: a request that ends all work of the process, wherever it is.
//!
//! Whoever stops does not know what runs, and a signal means the whole process: so there is one request for all threads. Loops
//! that may run long look at it at each turn ([`check`]), and unwind when it is there, through locks, pools of threads and files
//! under way, whose destructors leave nothing behind. No function says in its type that it can be stopped, and none forgets to
//! hand it on. Where a command or a bake begins, [`catch`] makes an error of it.
//!
//! The alternative is to return [`Error::Interrupted`] from all that takes time, down to the search of a road: most of what
//! computes here has no other way to fail.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crate::error::Error;

/// Whether all work is to end.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// What a stop unwinds with.
struct Stopped;

/// Asks all work of the process to end: it does within a fraction of a second, and what is begun after that ends at once.
pub fn request() {
    REQUESTED.store(true, Ordering::Relaxed);
}

/// Lets work begin again, when all that was to end has ended.
pub fn withdraw() {
    REQUESTED.store(false, Ordering::Relaxed);
}

/// Whether all work is to end.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Unwinds when all work is to end: a load and a branch when not. While a thread unwinds already it does nothing, so that
/// destructors can work. A lock that is held is poisoned: whoever finds it so checks as well, before it takes that for a panic.
#[inline]
pub fn check() {
    if is_requested() {
        unwind();
    }
}

#[cold]
fn unwind() {
    if !thread::panicking() {
        // Not a panic: nothing is wrong, so nothing is said.
        resume_unwind(Box::new(Stopped));
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
}
