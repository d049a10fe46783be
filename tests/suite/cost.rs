//! What a dry run tells is what the bake takes: never less, and at most 4 times as much. Memory is by the kernel's count
//! of a child process; what is told of it is one bound for all exports.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::is_long;
use terrane::export::Export;
use terrane::preset::Preset;
use terrane::world::World;

/// Bakes that are measured: preset, size, and exports one after the other; none are all.
const BAKES: &[(&str, &str, &[&str])] = &[
    ("thesis", "6x6", &["height,blend,normal,map", "water", "vector", "splines", "gltf-region", "web"]),
    ("archipelago", "6x6", &["vector,splines,water"]),
];

/// The bakes of the long form.
const LONG_BAKES: &[(&str, &str, &[&str])] = &[
    ("thesis", "8x8", &[]),
    // The exports whose files or work depend on rivers, roads or a sea: each takes a plan of roads twice.
    (
        "archipelago",
        "8x8",
        &[
            "exr",
            "map",
            "water",
            "depth-tiles",
            "flow-geotiff",
            "accumulation",
            "scatter-tiles",
            "instances",
            "splines",
            "vector",
            "geojson",
            "gltf",
            "gltf-region",
            "obj",
            "collision",
            "web",
        ],
    ),
    ("hills", "24x4", &["height,exr,map-tiles"]),
    ("alps", "1x1", &["hashes"]),
    ("plains", "12x12", &["height,geojson"]),
    ("canyon", "24x24", &["hashes"]),
];

fn terrane(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// The most bytes that a process has had in memory when it ends.
#[cfg(target_os = "linux")]
fn peak_bytes(mut command: Command) -> u64 {
    let mut child = command.spawn().unwrap();
    let mut peak = 0;
    loop {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        peak = kilobytes.map_or(peak, |kilobytes| kilobytes * 1024);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{command:?}: {status}");
            return peak;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

/// Bytes of all files in a folder.
fn bytes_in(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries
        .map(|entry| if entry.path().is_dir() { bytes_in(&entry.path()) } else { entry.metadata().unwrap().len() })
        .sum()
}

#[cfg(target_os = "linux")]
#[test]
fn a_dry_run_tells_the_memory_and_the_disk_that_a_bake_takes() {
    check_costs(if is_long() { LONG_BAKES } else { BAKES });
}

/// `cargo test --profile quick --test suite -- --ignored every_export`
#[cfg(target_os = "linux")]
#[test]
#[ignore = "it plans the same roads a hundred times"]
fn a_dry_run_tells_what_every_export_of_settled_land_takes() {
    check_costs(&[("archipelago", "8x8", &[])]);
}

/// Fails if a dry run tells less memory or disk than a bake takes, or more than 4 times as much. Of each preset, with a
/// size, the exports are baked one after the other; all of them if none are given.
#[cfg(target_os = "linux")]
fn check_costs(bakes: &[(&str, &str, &[&str])]) {
    let mut wrong = Vec::new();
    for &(preset, size, exports) in bakes {
        let world = World::new(Preset::load(preset).unwrap().1, None).unwrap();
        let all: Vec<&str> = Export::all().filter(|export| export.is_shown_by(&world)).map(Export::name).collect();
        for export in if exports.is_empty() { &all[..] } else { exports } {
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("out");
            let bake = ["bake", preset, "--size", size, "--tile-cells", "128", "--threads", "2", "--export", export];
            let bake = [&bake[..], &["--json", "--no-progress", "--out", out.to_str().unwrap()]].concat();
            let plan = terrane(&[&bake[..], &["--dry-run"]].concat()).output().unwrap();
            let plan: Value = serde_json::from_slice(&plan.stdout).unwrap();
            assert!(!out.exists(), "a dry run writes nothing");
            let mut command = terrane(&bake);
            command.stdout(Stdio::null());
            for (what, taken) in [("memory_bytes", peak_bytes(command)), ("disk_bytes", bytes_in(&out))] {
                let ratio = plan[what].as_f64().unwrap() / taken as f64;
                println!("{preset} {export}: {what} {} told, {taken} taken, {ratio:.2}", plan[what]);
                if !(1.0..=4.0).contains(&ratio) {
                    wrong.push(format!("{preset} {export}: {what} {} told, {taken} taken, {ratio:.2}", plan[what]));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[cfg(target_os = "linux")]
#[test]
fn what_may_take_more_than_the_limit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let limited = |kilobytes: u64, arguments: &str| {
        let line = format!("ulimit -v {kilobytes}; exec \"$0\" {arguments}");
        let mut command = Command::new("sh");
        command.args(["-c", &line, env!("CARGO_BIN_EXE_terrane")]).current_dir(folder.path()).output().unwrap()
    };
    for arguments in [
        "bake alps --size 40x40 --threads 1 --out o",
        "map alps --around 0,0,5 --width 64 --threads 1 --out o.png",
        "atlas alps --threads 1 --out o",
        "find alps lake --threads 1",
    ] {
        let refused = limited(400_000, arguments);
        let message = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(2), "{arguments}: {message}");
        assert!(message.contains("of memory") && message.contains("ulimit -v"), "{message}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{arguments}");
    }
    let done = limited(400_000, "bake mountains --size 1x1 --threads 1 --tile-cells 16 --out o");
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
}

#[test]
fn a_map_and_an_atlas_and_a_search_tell_their_memory() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["map", "thesis", "--around", "0,0,1", "--width", "64"][..],
        &["atlas", "thesis", "--paper", "a6", "--scale", "1:2000"],
        &["find", "alps", "lake"],
    ] {
        let arguments = [arguments, &["--threads", "1", "--dry-run", "--json"]].concat();
        let told = terrane(&arguments).current_dir(folder.path()).output().unwrap();
        let told: Value = serde_json::from_slice(&told.stdout).unwrap();
        assert!(told["memory_bytes"].as_u64().unwrap() > 24 << 20, "{arguments:?}: {told}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
