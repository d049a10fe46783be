//! How much memory this process may still take, as far as the system says.

use sysinfo::{Process, ProcessesToUpdate, System, get_current_pid};

use crate::error::Error;
use crate::export::Bytes;

/// A limit of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Bytes that may still be taken.
    pub left_bytes: u64,
    /// Who says so.
    pub source: &'static str,
}

impl Limit {
    /// The tightest limit of this process, if any is known.
    pub fn now() -> Option<Limit> {
        // Where a system is not known, none of its limits is.
        let mut system = System::new().ok()?;
        system.refresh_memory();
        let own = get_current_pid().ok();
        own.inspect(|own| _ = system.refresh_processes(ProcessesToUpdate::Some(&[*own]), false));
        let process = own.and_then(|own| system.process(own));
        // What the kernel could drop, such as files that it has cached, is not taken.
        let of_group =
            process.and_then(Process::cgroup_limits).map(|group| group.total_memory.saturating_sub(group.rss));
        let of_process = process.zip(most_address_space()).map(|(own, most)| most.saturating_sub(own.virtual_memory()));
        // A system that does not tell says that there is nothing.
        let available = Some(system.available_memory()).filter(|bytes| *bytes > 0);
        let limits = [
            (of_process, "the limit of the process (ulimit -v)"),
            (of_group, "the limit of the control group"),
            (available, "what the machine has free"),
        ];
        let known = limits.into_iter().filter_map(|(left, source)| Some(Limit { left_bytes: left?, source }));
        known.min_by_key(|limit| limit.left_bytes)
    }

    /// Whether what may take so much memory keeps to the limit that there is now.
    ///
    /// # Errors
    /// When it may take more; the hint says what takes less.
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

/// Bytes of address space that the process may have, if there is a limit.
fn most_address_space() -> Option<u64> {
    #[cfg(unix)]
    return rustix::process::getrlimit(rustix::process::Resource::As).current;
    #[cfg(not(unix))]
    None
}
