//! The estimate of memory that is announced for work on worlds: for bakes, maps, and searches.

/// Bytes of the program itself and its libraries: a round number, above what an idle program of this kind takes.
const PROGRAM_BYTES: u64 = 24 << 20;

/// Bytes of a thread: its stack, its buffers for searches during planning, and the memory that its allocator arena
/// keeps.
const THREAD_BYTES: u64 = 4 << 20;

/// Announced memory is rounded up to a multiple of these bytes, since the estimate is no more precise.
const STEP_BYTES: u64 = 8 << 20;

/// Returns the bytes of memory to announce for work on so many threads. `working_bytes` are those besides what worlds
/// remember.
///
/// Remembered values come and go in pieces of all sizes, and the allocator keeps half as much again between them.
pub fn told(threads: usize, working_bytes: u64, remembered_bytes: u64) -> u64 {
    let threads = (threads as u64).saturating_mul(THREAD_BYTES);
    let parts = [PROGRAM_BYTES, threads, working_bytes, remembered_bytes, remembered_bytes / 2];
    parts.into_iter().fold(0, u64::saturating_add).checked_next_multiple_of(STEP_BYTES).unwrap_or(u64::MAX)
}
