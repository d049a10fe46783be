//! What a dry run tells is what the bake takes: its memory, by the kernel's count of a child process.

use std::fs;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::Value;

use crate::{BAKES, TIMES};

fn terrane(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// What a dry run tells of pages of the program's file, of which each kernel keeps another number.
const PROGRAM_BYTES: f64 = (24 << 20) as f64;

/// The most bytes that a process has had in memory when it ends, and the most of these that were pages of files.
#[cfg(target_os = "linux")]
fn peak_bytes(mut command: Command) -> (u64, u64) {
    let mut child = command.spawn().unwrap();
    let (mut peak, mut of_files) = (0, 0);
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let bytes = |key: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(key))?;
            Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
        };
        peak = bytes("VmHWM:").unwrap_or(peak);
        of_files = of_files.max(bytes("RssFile:").unwrap_or(0));
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{command:?}: {status}");
            return (peak, of_files);
        }
        thread::sleep(Duration::from_millis(2));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_dry_run_tells_the_memory_that_the_bake_takes() {
    for (preset, size, threads, exports) in BAKES {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let bake =
            ["bake", preset, "--size", size, "--threads", threads, "--export", exports, "--json", "--no-progress"];
        let bake = [&bake[..], &["--out", out.to_str().unwrap()]].concat();
        let plan = terrane(&[&bake[..], &["--dry-run"]].concat()).output().unwrap();
        let plan: Value = serde_json::from_slice(&plan.stdout).unwrap();
        // What threads hold together is chance: the middle one of some bakes.
        let mut peaks: Vec<_> = (0..TIMES)
            .map(|_| {
                let mut command = terrane(&[&bake[..], &["--overwrite"]].concat());
                command.stdout(Stdio::null());
                peak_bytes(command)
            })
            .collect();
        peaks.sort_unstable();
        let told = plan["memory_bytes"].as_u64().unwrap() as f64;
        let [(peak, _), (most, of_files)] = [peaks[TIMES / 2], peaks[TIMES - 1]].map(|(a, b)| (a as f64, b as f64));
        println!(
            "{preset} {size} {threads} {exports}: told {:.1} MB, taken {:.1} MB, {:.1} of them of files",
            told / 1e6,
            peak / 1e6,
            of_files / 1e6
        );
        assert!(told >= peak, "{preset} {size}: {told} bytes are told, and {peak} are taken");
        // As if just what this kernel keeps of the program's file had been told of it.
        let told = told - PROGRAM_BYTES + of_files;
        assert!(told <= 1.25 * most, "{preset} {size}: {told} bytes are told, and at most {most} are taken");
        assert!(plan["memory_bytes_at_most"].as_f64().unwrap() >= told);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_bake_that_may_take_more_than_the_limit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let bake = |kilobytes: u64, preset: &str| {
        let line =
            format!("ulimit -v {kilobytes}; exec \"$0\" bake {preset} --size 1x1 --threads 1 --tile-cells 16 --out o");
        let mut command = Command::new("sh");
        command.args(["-c", &line, env!("CARGO_BIN_EXE_terrane")]).current_dir(folder.path());
        command.output().unwrap()
    };
    let refused = bake(200_000, "alps");
    let message = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("of memory") && message.contains("ulimit -v"), "{message}");
    assert!(!folder.path().join("o").exists());
    let done = bake(200_000, "mountains");
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
}
