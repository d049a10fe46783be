//! The machine that an experiment runs on: timings say little without it. Facts that the system does not tell are left
//! out.

use std::fs;

use serde::Serialize;

use crate::simd::Level;

/// The machine, as far as its system describes it.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// The processor's name.
    pub processor: Option<String>,
    /// The instruction set that the kernels use.
    pub simd: &'static str,
    /// Bytes of memory.
    pub memory_bytes: Option<u64>,
    /// The operating system and its version.
    pub system: String,
    /// Peak memory of the process in bytes.
    pub peak_bytes: Option<u64>,
}

impl Machine {
    /// Describes this machine at this time.
    pub fn here() -> Machine {
        let read = |path: &str| fs::read_to_string(path).ok();
        Machine {
            processor: read("/proc/cpuinfo").and_then(|text| processor(&text)),
            simd: Level::chosen().map_or("unknown", Level::name),
            memory_bytes: read("/proc/meminfo").and_then(|text| kilobytes(&text, "MemTotal:")),
            system: system(read("/etc/os-release").as_deref(), read("/proc/sys/kernel/osrelease").as_deref()),
            peak_bytes: read("/proc/self/status").and_then(|text| kilobytes(&text, "VmHWM:")),
        }
    }
}

/// Returns the number of kilobytes behind a name, in bytes.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Returns the processor's name as Linux lists it.
fn processor(text: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim().to_owned())
}

/// Returns the system's name from the texts about its release and its kernel. Without a release, the name is the kind
/// of system that the program was built for.
fn system(release: Option<&str>, kernel: Option<&str>) -> String {
    let named = |text: &str| {
        let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        Some(name.trim().trim_matches('"').to_owned())
    };
    let name = release.and_then(named).unwrap_or_else(|| std::env::consts::OS.to_owned());
    match kernel.map(str::trim).filter(|kernel| !kernel.is_empty()) {
        Some(kernel) => format!("{name}, kernel {kernel}"),
        None => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_named_as_far_as_it_tells() {
        let release = "ID=debian\nPRETTY_NAME=\"Debian GNU/Linux 12 (bookworm)\"\n";
        assert_eq!(system(Some(release), Some("6.1.0\n")), "Debian GNU/Linux 12 (bookworm), kernel 6.1.0");
        assert_eq!(system(None, None), std::env::consts::OS);
        assert_eq!(processor("model\t: 1\nmodel name\t: A CPU @ 3 GHz\n").as_deref(), Some("A CPU @ 3 GHz"));
        assert_eq!(processor("Hardware: none"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn linux_tells_its_memory_and_the_peak_of_a_process() {
        let machine = Machine::here();
        assert!(machine.peak_bytes.unwrap() > 1 << 20 && machine.memory_bytes > machine.peak_bytes, "{machine:?}");
    }
}
