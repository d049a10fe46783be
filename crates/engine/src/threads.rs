//! Threads: their number, and thread pools.

use std::thread;

use crate::error::Error;

/// Returns the number of threads to use: as many as were asked for, or one a core.
pub fn thread_count(asked: Option<u32>) -> usize {
    asked.map_or_else(|| thread::available_parallelism().map_or(1, usize::from), |threads| threads as usize)
}

/// Starts a pool of so many threads.
///
/// # Errors
/// When the system refuses to start so many threads.
pub fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, Error> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| Error::Option {
        message: format!("{threads} threads cannot be started: {error}"),
        hint: "give fewer with --threads".into(),
    })
}
