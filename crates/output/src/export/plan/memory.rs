//! Memory: the bound that is announced for bakes, maps and searches, and the limit that the system sets.

use sysinfo::{Process, ProcessesToUpdate, System, get_current_pid};

use crate::error::Error;
use crate::export::Bytes;

/// Bytes of a thread's stack.
const STACK_BYTES: u64 = 2 << 20;

/// The memory of the process is rounded up to a multiple of these bytes, so that the same work tells the same bound.
const STEP_BYTES: u64 = 8 << 20;

/// Returns an upper bound in bytes for the memory of this process after work on so many threads: the memory that it has
/// now, and all that the work adds. `working_bytes` are those besides what worlds remember.
///
/// Remembered values come and go in pieces of all sizes: an allocator may keep as much again between them.
pub fn told(threads: usize, working_bytes: u64, remembered_bytes: u64) -> u64 {
    let stacks = (threads as u64).saturating_mul(STACK_BYTES);
    let own_bytes = own_process(&mut System::new().ok()).map_or(0, Process::memory).next_multiple_of(STEP_BYTES);
    [stacks, working_bytes, remembered_bytes, remembered_bytes].into_iter().fold(own_bytes, u64::saturating_add)
}

/// Returns this process, as the system knows it.
fn own_process(system: &mut Option<System>) -> Option<&Process> {
    let (system, own) = (system.as_mut()?, get_current_pid().ok()?);
    system.refresh_processes(ProcessesToUpdate::Some(&[own]), false);
    system.process(own)
}

/// A limit of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Bytes that may still be taken.
    pub left_bytes: u64,
    /// The system's rule that sets the limit, in words of a message.
    pub source: &'static str,
}

impl Limit {
    /// Returns the tightest limit of this process, if any is known.
    pub fn now() -> Option<Limit> {
        // On an unsupported system no limit is known.
        let mut system = System::new().ok();
        system.as_mut()?.refresh_memory();
        // A system that does not know its available memory reports 0.
        let available = system.as_ref().map(System::available_memory).filter(|bytes| *bytes > 0);
        let process = own_process(&mut system);
        // The group's `rss` leaves out memory that the kernel could drop, such as cached files.
        let of_group =
            process.and_then(Process::cgroup_limits).map(|group| group.total_memory.saturating_sub(group.rss));
        let of_process = process.zip(most_address_space()).map(|(own, most)| most.saturating_sub(own.virtual_memory()));
        let limits = [
            (of_process, "the limit of the process (ulimit -v)"),
            (of_group, "the limit of the control group"),
            (available, "what the machine has free"),
        ];
        let known = limits.into_iter().filter_map(|(left, source)| Some(Limit { left_bytes: left?, source }));
        known.min_by_key(|limit| limit.left_bytes)
    }

    /// Checks that `bytes` of memory are within the current limit.
    ///
    /// # Errors
    /// When they are not; the hint says what takes less.
    pub fn check(what: &str, bytes: u64, hint: &str) -> Result<(), Error> {
        match Limit::now().filter(|limit| limit.left_bytes < bytes) {
            None => Ok(()),
            Some(Limit { left_bytes, source }) => Err(Error::Option {
                message: format!(
                    "{what} may take {} of memory, and {} are left by {source}",
                    Bytes(bytes),
                    Bytes(left_bytes)
                ),
                hint: format!("raise the limit, or {hint}"),
            }),
        }
    }
}

/// Returns the limit of the process's address space in bytes, if there is one.
fn most_address_space() -> Option<u64> {
    #[cfg(unix)]
    return rustix::process::getrlimit(rustix::process::Resource::As).current;
    #[cfg(not(unix))]
    None
}
