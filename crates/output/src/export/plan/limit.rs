//! Memory that this process may still take, according to the system.

use sysinfo::{Process, ProcessesToUpdate, System, get_current_pid};

use crate::error::Error;
use crate::export::Bytes;

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
        let mut system = System::new().ok()?;
        system.refresh_memory();
        let own = get_current_pid().ok();
        own.inspect(|own| _ = system.refresh_processes(ProcessesToUpdate::Some(&[*own]), false));
        let process = own.and_then(|own| system.process(own));
        // The group's `rss` leaves out memory that the kernel could drop, such as cached files.
        let of_group =
            process.and_then(Process::cgroup_limits).map(|group| group.total_memory.saturating_sub(group.rss));
        let of_process = process.zip(most_address_space()).map(|(own, most)| most.saturating_sub(own.virtual_memory()));
        // A system that does not know its available memory reports 0.
        let available = Some(system.available_memory()).filter(|bytes| *bytes > 0);
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
