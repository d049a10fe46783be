//! How much memory this process may still take, as far as the system says. Linux only; elsewhere nothing is known.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::export::{Bytes, Cost};

/// A limit of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// Bytes that may still be taken.
    pub left_bytes: u64,
    /// Who says so.
    pub source: &'static str,
}

/// Bytes of address space that each thread reserves for its stack: the default of Rust's standard library.
const STACK_BYTES: u64 = 2 << 20;

impl Limit {
    /// The tightest limit of a process that will start so many threads, if any is known.
    pub fn now(threads: usize) -> Option<Limit> {
        let stacks = STACK_BYTES.saturating_mul(threads as u64);
        // Stacks are reserved when threads start, and this limit counts what is reserved.
        let address_space = address_space().map(|left| left.saturating_sub(stacks));
        let limits = [
            (address_space, "the limit of the process (ulimit -v)"),
            (control_group(), "the limit of the control group"),
            (available(), "what the machine has free"),
        ];
        let known = limits.into_iter().filter_map(|(left, source)| Some(Limit { left_bytes: left?, source }));
        known.min_by_key(|limit| limit.left_bytes)
    }

    /// Whether a bake of that cost keeps to the limit.
    ///
    /// # Errors
    /// When it may take more.
    pub fn check(&self, cost: &Cost) -> Result<(), Error> {
        if cost.memory_bytes <= self.left_bytes {
            return Ok(());
        }
        Err(Error::Option {
            message: format!(
                "the bake may take {} of memory, and {} are left by {}",
                Bytes(cost.memory_bytes),
                Bytes(self.left_bytes),
                self.source
            ),
            hint: "raise the limit, or give fewer --threads, a narrower --size or fewer exports".into(),
        })
    }
}

/// The number of kilobytes behind a name, in bytes.
pub fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

fn available() -> Option<u64> {
    kilobytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

fn address_space() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    // `unlimited` is no number, and then there is no limit here.
    let most: u64 = line.split_whitespace().next()?.parse().ok()?;
    let taken = kilobytes(&fs::read_to_string("/proc/self/status").ok()?, "VmSize:")?;
    Some(most.saturating_sub(taken))
}

/// What the groups of this process leave, that of version 2 or that of version 1 for memory.
fn control_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let left = |line: &str| {
        let (_, controllers_and_path) = line.split_once(':')?;
        let (controllers, path) = controllers_and_path.split_once(':')?;
        // What the kernel could drop, such as files that it has cached, is not taken.
        let (root, most, taken) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max", "anon "),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "total_rss "),
            _ => return None,
        };
        // A group is bound by those above it too. In a container the path may be that of the host, and only the root is there.
        let path = Path::new(path.trim_start_matches('/'));
        let left = |part: &Path| {
            let folder = Path::new(root).join(part);
            // A limit that is `max` is no number: such a group bounds nothing, and the ones above it may.
            let most: u64 = fs::read_to_string(folder.join(most)).ok()?.trim().parse().ok()?;
            let stat = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
            let taken = stat.lines().find_map(|line| line.strip_prefix(taken)?.parse().ok()).unwrap_or(0);
            Some(most.saturating_sub(taken))
        };
        path.ancestors().filter_map(left).min()
    };
    groups.lines().filter_map(left).min()
}
