//! What memory is told for whatever works on worlds: for bakes, maps, and searches.

/// The program itself and its libraries: a round number, above what one of this kind takes that does nothing.
const PROGRAM_BYTES: u64 = 24 << 20;

/// A thread: its stack, what it searches with while it plans, and what its arena of the allocator keeps.
const THREAD_BYTES: u64 = 4 << 20;

/// Told memory is a multiple of this: closer it is not known.
const STEP_BYTES: u64 = 8 << 20;

/// What is told of work on so many threads that takes so many bytes beside what worlds remember.
///
/// What is remembered comes and goes in pieces of all sizes, between which an allocator keeps half as much again.
pub fn told(threads: usize, working_bytes: u64, remembered_bytes: u64) -> u64 {
    let threads = (threads as u64).saturating_mul(THREAD_BYTES);
    let parts = [PROGRAM_BYTES, threads, working_bytes, remembered_bytes, remembered_bytes / 2];
    parts.into_iter().fold(0, u64::saturating_add).checked_next_multiple_of(STEP_BYTES).unwrap_or(u64::MAX)
}
