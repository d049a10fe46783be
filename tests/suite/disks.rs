//! What the system itself refuses: files that may grow no more, a disk that is full, too many open files, names that it
//! does not take.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::desk::{Desk, Outcome, Running, files_in};

const BAKE: [&str; 8] = [
    "bake",
    "small.toml",
    "--size",
    "10x10",
    "--export",
    "height,exr,r16-tiles,map,gltf,hashes,vector,geojson",
    "-q",
    "--out",
];

fn same(desk: &Desk, one: &Path, other: &Path) {
    let names = files_in(one);
    assert_eq!(names, files_in(other), "{desk}", desk = desk.root().display());
    for name in names {
        assert!(fs::read(one.join(&name)).unwrap() == fs::read(other.join(&name)).unwrap(), "{name}");
    }
}

/// Runs a bake in a shell that has set a limit first.
fn limited(desk: &Desk, limit: &str, arguments: &[&str]) -> Outcome {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("{limit} && exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_terrane")]).args(arguments);
    shell.current_dir(desk.root()).stdin(Stdio::null()).output().unwrap().into()
}

#[test]
fn a_limit_of_the_system_is_an_error_and_the_bake_goes_on_without_it() {
    let desk = Desk::new();
    desk.done(&[&BAKE[..], &["whole"]].concat());
    // Blocks of 512 bytes that a file may have, and files that may be open.
    let limits =
        ["ulimit -f 1", "ulimit -f 20", "ulimit -f 100", "ulimit -n 7", "ulimit -n 12", "ulimit -n 18", "ulimit -n 24"];
    let mut failed = 0;
    for (number, limit) in limits.iter().enumerate() {
        let folder = format!("o{number}");
        let arguments = [&BAKE[..], &[&folder]].concat();
        let outcome = limited(&desk, limit, &arguments);
        if outcome.code != Some(0) {
            failed += 1;
            // Where not even the folder can be begun the user has to choose another.
            assert!([Some(1), Some(2)].contains(&outcome.code), "{limit}: {outcome}");
            assert!(outcome.stderr.starts_with("error: "), "{limit}: {outcome}");
            assert!(!outcome.stderr.contains("panicked"), "{limit}: {outcome}");
            assert!(!desk.path(&folder).join("bake.json").exists(), "{limit}");
        }
        desk.done(&[&arguments[..], &["--resume"]].concat());
        same(&desk, &desk.path(&folder), &desk.path("whole"));
    }
    assert!(failed >= 4, "{failed} of {} limits were in the way", limits.len());
}

/// A small disk of its own, unmounted when it is dropped; none where nobody may mount one.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(at: PathBuf, size: &str) -> Option<SmallDisk> {
        fs::create_dir(&at).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"]).arg(&at).stderr(Stdio::null());
        let is_mounted = mount.status().is_ok_and(|status| status.success());
        is_mounted.then_some(SmallDisk(at))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_disk_that_fills_up_breaks_nothing_and_the_bake_goes_on_when_there_is_room() {
    let desk = Desk::new();
    let Some(disk) = SmallDisk::mount(desk.path("disk"), "700m") else {
        println!("SKIPPED: a small disk, since nobody may mount one here");
        return;
    };
    let bake = [&BAKE[..2], &["--size", "24x24"], &BAKE[4..]].concat();
    desk.done(&[&bake[..], &["whole"]].concat());
    let mut failed = 0;
    for round in 0..6 {
        let folder = format!("disk/o{round}");
        let arguments = [&bake[..], &[&folder]].concat();
        let child = desk.command(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut running = Running(child);
        // Not before it has seen that there is room.
        while running.0.try_wait().unwrap().is_none() && !desk.path(&folder).join(".terrane-bake/plan.json").exists() {
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(Duration::from_millis(60 * round));
        // Whatever room there is goes to somebody else, down to the last byte.
        let balloons = disk.0.join("balloons");
        fs::create_dir(&balloons).unwrap();
        for (number, megabytes) in [256, 256, 128, 64, 32, 16, 8, 4, 2, 1].into_iter().enumerate() {
            let mut allocate = Command::new("fallocate");
            allocate.args(["-l", &format!("{megabytes}M")]).arg(balloons.join(number.to_string()));
            _ = allocate.stderr(Stdio::null()).status();
        }
        let mut file = fs::File::create(balloons.join("rest")).unwrap();
        while file.write_all(&[1; 512]).is_ok() {}
        while file.write_all(&[1]).is_ok() {}
        let code = running.exit_code();
        let said = std::io::read_to_string(running.0.stderr.take().unwrap()).unwrap();
        drop(file);
        fs::remove_dir_all(balloons).unwrap();
        assert!(!said.contains("panicked"), "{said}");
        if code != Some(0) {
            failed += 1;
            assert!([Some(1), Some(2)].contains(&code), "{said}");
            assert!(said.contains("disk/o"), "{said}");
            assert!(!desk.path(&folder).join("bake.json").exists(), "{said}");
        }
        desk.done(&[&arguments[..], &["--resume"]].concat());
        same(&desk, &desk.path(&folder), &desk.path("whole"));
        fs::remove_dir_all(desk.path(&folder)).unwrap();
    }
    assert!(failed > 0, "the disk was never full in time");
}

#[test]
fn a_bake_over_two_disks_is_the_same_bake() {
    let desk = Desk::new();
    desk.done(&[&BAKE[..], &["whole"]].concat());
    desk.done(&[&BAKE[..], &["o", "--seed", "3"]].concat());
    // What was in it is below what is mounted.
    fs::rename(desk.path("o/height"), desk.path("o/height-before")).unwrap();
    let Some(disk) = SmallDisk::mount(desk.path("o/height"), "64m") else {
        println!("SKIPPED: a small disk, since nobody may mount one here");
        return;
    };
    fs::remove_dir_all(desk.path("o/height-before")).unwrap();
    desk.done(&[&BAKE[..], &["o", "--overwrite"]].concat());
    same(&desk, &desk.path("o"), &desk.path("whole"));
    drop(disk);
}

/// What has a file system know no locks, as a library that is loaded before all others.
const NO_LOCKS: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/file.h>

static int refused(void) {
    errno = atoi(getenv("NO_LOCKS"));
    return -1;
}

static int is_lock(int command) {
    return command == F_SETLK || command == F_SETLKW || command == F_GETLK || command == F_OFD_SETLK
        || command == F_OFD_SETLKW;
}

int flock(int file, int operation) { return refused(); }

#define FCNTL(name) \
    int name(int file, int command, ...) { \
        va_list arguments; \
        va_start(arguments, command); \
        void *argument = va_arg(arguments, void *); \
        va_end(arguments); \
        if (is_lock(command)) return refused(); \
        int (*next)(int, int, ...) = (int (*)(int, int, ...))dlsym(RTLD_NEXT, #name); \
        return next(file, command, argument); \
    }
FCNTL(fcntl)
FCNTL(fcntl64)
"#;

#[test]
fn a_file_system_without_locks_takes_all_that_any_other_takes() {
    let desk = Desk::new();
    desk.write("no_locks.c", NO_LOCKS);
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-w", "-o", "no_locks.so", "no_locks.c", "-ldl"]).current_dir(desk.root());
    if !compiler.status().is_ok_and(|status| status.success()) {
        println!("SKIPPED: a file system without locks, since there is no C compiler");
        return;
    }
    // With a GeoPackage and MBTiles, which are databases too.
    fn bake(out: &str) -> [&str; 9] {
        ["bake", "small.toml", "--size", "16x16", "--export", "height,height-tiles,vector,web", "-q", "--out", out]
    }
    desk.done(&bake("whole"));
    // ENOLCK, EOPNOTSUPP and ENOSYS.
    for (number, errno) in [37, 95, 38].into_iter().enumerate() {
        let command = |words: &[&str]| {
            let mut command = desk.command(words);
            command.env("LD_PRELOAD", desk.path("no_locks.so")).env("NO_LOCKS", errno.to_string());
            command
        };
        let run = |words: &[&str]| {
            let outcome = Outcome::from(command(words).output().unwrap());
            assert_eq!(outcome.code, Some(0), "{errno}: {words:?}\n{outcome}");
            outcome
        };
        let out = format!("o{number}");
        // Killed when it has something to go on with, and looked at before and after that.
        let child = command(&bake(&out)).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let mut running = Running(child);
        let pieces = desk.path(&out).join(".terrane-bake/pieces");
        while !pieces.metadata().is_ok_and(|file| file.len() > 0) {
            assert!(running.0.try_wait().unwrap().is_none(), "{errno}: it has ended early");
            thread::sleep(Duration::from_millis(1));
        }
        run(&["info", &out]);
        thread::sleep(Duration::from_millis(30));
        running.signal("KILL");
        running.exit_code();
        run(&["info", &out]);
        run(&["registry", &out]);
        let told = run(&[&bake(&out)[..], &["--resume"]].concat());
        assert!(told.stderr.contains("has no locks"), "{told}");
        same(&desk, &desk.path(&out), &desk.path("whole"));
        run(&["verify", &out, "--all"]);
        run(&["registry", &out]);
        run(&["bake", "small.toml", "--size", "16x16", "--export", "hashes", "--add", "-q", "--out", &out]);
        fs::write(desk.path(&out).join("height/height.png"), "damaged").unwrap();
        run(&["repair", &out]);
        run(&["extend", &out, "--size", "17x16", "-q"]);
        run(&["verify", &out]);
        run(&["map", &out, "--width", "64", "--out", &format!("{out}.png")]);
        for shard in ["1/2", "2/2"] {
            run(&[&bake(&format!("{out}-{}", &shard[..1]))[..], &["--shard", shard]].concat());
        }
        run(&["merge", &format!("{out}-1"), &format!("{out}-2"), "-q", "--out", &format!("{out}-all")]);
        same(&desk, &desk.path(&format!("{out}-all")), &desk.path("whole"));
        run(&["walk", "small.toml", "--minutes", "0.2", "-q", "--out", &format!("{out}-walk")]);
        run(&["clean", &out]);
    }
}

#[test]
fn names_that_lead_elsewhere_or_that_no_system_takes_are_refused_or_contained() {
    let desk = Desk::new();
    let long = "x".repeat(300);
    for out in [long.as_str(), "a/../../../../../../../../proc/x", "small.toml/o", ""] {
        let outcome = desk.run(&["bake", "small.toml", "--size", "1x1", "-q", "--out", out]);
        assert_eq!(outcome.code, Some(2), "{out:?}: {outcome}");
        assert!(outcome.stderr.contains("--out") && !outcome.stderr.contains("panicked"), "{out:?}: {outcome}");
    }
    // A name that is no UTF-8 is a name here.
    let bytes = std::ffi::OsStr::from_bytes(b"o\xff\xfe");
    let mut command = desk.command(&["bake", "small.toml", "--size", "1x1", "-q", "--out"]);
    assert!(command.arg(bytes).status().unwrap().success());
    assert!(desk.root().join(bytes).join("bake.json").is_file());
    let verified = Outcome::from(desk.command(&["verify"]).arg(bytes).output().unwrap());
    assert_eq!(verified.code, Some(0), "{verified}");
    // Presets whose names would lead out of the default folder have their files' own names.
    desk.write("p/..toml", fs::read(desk.path("small.toml")).unwrap());
    desk.done(&["bake", "p/..toml", "--size", "1x1", "-q"]);
    assert!(files_in(&desk.path("out")).iter().any(|name| name.ends_with("bake.json")));
    // A bake whose manifest lists what is elsewhere, and a folder in it that leads elsewhere.
    desk.write("victim/precious.png", "precious");
    desk.done(&["bake", "small.toml", "--size", "1x1", "-q", "--out", "o", "--export", "height,map"]);
    let text = fs::read_to_string(desk.path("o/bake.json")).unwrap();
    let absolute = desk.path("victim/precious.png").display().to_string();
    for path in ["/etc/passwd", "../victim/precious.png", &absolute, "height/../../victim/precious.png"] {
        desk.write("o/bake.json", text.replace("height/height.png", path));
        for command in [&["verify", "o"][..], &["info", "o"], &["repair", "o"], &["clean", "o", "--dry-run"]] {
            let outcome = desk.run(command);
            assert!(outcome.code.is_some_and(|code| code <= 2), "{path}: {outcome}");
            assert!(!outcome.stderr.contains("panicked"), "{path}: {outcome}");
        }
        assert_eq!(fs::read_to_string(desk.path("victim/precious.png")).unwrap(), "precious");
    }
    desk.write("o/bake.json", &text);
    fs::remove_dir_all(desk.path("o/map")).unwrap();
    std::os::unix::fs::symlink(desk.path("victim"), desk.path("o/map")).unwrap();
    let overwrite =
        ["bake", "small.toml", "--size", "1x1", "-q", "--out", "o", "--export", "height,map", "--overwrite"];
    desk.refused(&overwrite, &["map", "is a link"]);
    desk.run(&["repair", "o"]);
    desk.run(&["clean", "o"]);
    assert_eq!(files_in(&desk.path("victim")).len(), 1);
    assert_eq!(fs::read_to_string(desk.path("victim/precious.png")).unwrap(), "precious");
}
