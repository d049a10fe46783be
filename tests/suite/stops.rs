//! A signal ends the command soon, wherever it is: it says so, leaves nothing half-written, and what is left is whole.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::desk::Running;
use crate::is_long;

/// Commands that do different things for many seconds, and the seconds within which they are stopped here.
const COMMANDS: &[(&[&str], f64)] = &[
    // Roads are planned first, for longer than tiles take then.
    (&["bake", "alps", "--size", "8x8", "--out", "o"], 5.0),
    (&["bake", "archipelago", "--scale", "1/1024", "--size", "4x4", "--export", "height,vector", "--out", "o"], 8.0),
    (&["bake", "plains", "--size", "8x8", "--export", "exr,blend,vector,geojson,gltf,obj", "--out", "o"], 8.0),
    (&["bake", "alps", "--size", "3x3", "--export", "web", "--out", "o"], 16.0),
    (&["map", "alps", "--around=0,0,160", "--scale", "1:1000000", "--dpi", "60", "--out", "o/map.png"], 10.0),
    (&["map", "alps", "--around=0,0,12", "--scale", "1:25000", "--out", "o/map.pdf"], 10.0),
    (&["atlas", "alps", "--sheets", "2x2", "--scale", "1:100000", "--out", "o"], 16.0),
    (&["find", "alps", "peak > 3000 m", "lake > 2 km2", "town on river"], 8.0),
    (&["walk", "thesis", "--tile-cells", "64", "--minutes", "4", "--layers", "2", "--out", "o"], 6.0),
    (&["experiment", "--sizes", "64,512", "--minutes", "2", "--out", "o"], 8.0),
];

/// By then the command hears of signals, however busy the machine is.
const STARTED_S: f64 = 0.5;

/// Starts a command in a folder.
fn start(arguments: &[&str], folder: &Path) -> Running {
    let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
    command.args(arguments).current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    Running(command.spawn().unwrap())
}

/// Each file below a folder.
fn visit(folder: &Path, take: &mut dyn FnMut(&Path)) {
    for entry in fs::read_dir(folder).into_iter().flatten().map(Result::unwrap) {
        let path = entry.path();
        if path.is_dir() { visit(&path, take) } else { take(&path) }
    }
}

/// Whether a file ends as files of its kind do.
fn is_whole(path: &Path) -> bool {
    let bytes = fs::read(path).unwrap();
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => bytes.ends_with(b"IEND\xae\x42\x60\x82"),
        Some("pdf") => bytes.trim_ascii_end().ends_with(b"%%EOF"),
        Some("webp") => bytes.len() == 8 + u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize,
        Some("json" | "geojson" | "gltf") => serde_json::from_slice::<serde::de::IgnoredAny>(&bytes).is_ok(),
        _ => !bytes.is_empty(),
    }
}

#[test]
fn commands_stop_soon_wherever_they_are_and_leave_nothing_half_written() {
    let moments = if is_long() { 3 } else { 2 };
    for (arguments, span_s) in COMMANDS {
        let mut stopped = Vec::new();
        for moment in 0..moments {
            let folder = tempfile::tempdir().unwrap();
            let mut running = start(arguments, folder.path());
            // The golden ratio spreads any number of moments over the span.
            let share = f64::from(moment + 1) * 0.618_033_988_749_895 % 1.0;
            let at_s = STARTED_S + share * if is_long() { *span_s } else { span_s.min(3.0) };
            thread::sleep(Duration::from_secs_f64(at_s));
            if running.0.try_wait().unwrap().is_some() {
                continue;
            }
            let start = Instant::now();
            running.signal(if moment % 2 == 0 { "INT" } else { "TERM" });
            let code = running.exit_code();
            let took = start.elapsed();
            let mut said = String::new();
            running.0.stderr.take().unwrap().read_to_string(&mut said).unwrap();
            let about = format!("{arguments:?} after {at_s:.2} s, which took {took:?}: {said}");
            // It may have come to its end just then.
            if code != Some(0) {
                assert_eq!(code, Some(130), "{about}");
                stopped.push(took);
            }
            // By itself: had it not, it would have been ended without a word.
            let lines = said.lines().filter(|line| line.starts_with("stopping") || line.starts_with("error"));
            let last = "error: interrupted; what was half-written is gone";
            let told = &["stopping", last][..if code == Some(0) { 1 } else { 2 }];
            assert_eq!(lines.collect::<Vec<_>>(), told, "{about}");
            assert!(!said.contains("panicked"), "{about}");
            visit(folder.path(), &mut |path| {
                let name = path.file_name().unwrap().to_string_lossy();
                assert!(!name.starts_with('.'), "{name} is left by {about}");
                // What a bake can go on with.
                let is_aside = path.components().any(|part| part.as_os_str() == ".terrane-bake");
                let is_journal = is_aside && (name == "pieces" || name.starts_with("registry.sqlite"));
                assert!(is_journal || is_whole(path), "{name} is not whole after {about}");
                assert!(code == Some(0) || name != "bake.json", "a bake looks whole after {about}");
                let is_bake = ["bake", "walk"].contains(&arguments[0]);
                assert!(code == Some(0) || !is_bake || is_aside, "{name} is in the folder after {about}");
            });
        }
        let slowest = stopped.iter().max().expect("the command ran when it was to stop");
        println!("{:6.3} s at most of {} stops: {arguments:?}", slowest.as_secs_f64(), stopped.len());
    }
}

#[test]
fn a_second_signal_ends_what_does_not_stop_and_so_does_time() {
    for again in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        // It waits for a preset that never comes.
        let mut running = start(&["bake", "-"], folder.path());
        thread::sleep(Duration::from_secs_f64(STARTED_S));
        running.signal("INT");
        let mut stderr = BufReader::new(running.0.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert_eq!(line, "stopping\n");
        if again {
            assert_eq!(running.0.try_wait().unwrap(), None, "it cannot stop by itself");
            running.signal("INT");
        }
        assert_eq!(running.exit_code(), Some(130));
    }
}
