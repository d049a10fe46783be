//! Tests of bakes on failing disks: at each operation, once or for good, with every kind of fault.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::*;
use crate::area::{Region, TileId};
use crate::bake::Shard;
use crate::export::{Export, Shards};
use crate::file::{Disk, Operation, double};
use crate::preset::Preset;
use crate::watch::Watch;
use crate::world::World;

/// A fault of a disk operation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum DiskFault {
    /// An error of the operating system, by its number.
    Refused(i32),
    /// A call that is interrupted before it has done anything.
    Interrupted,
    /// A short write: only half of the bytes are written.
    Short,
}

/// No space left, an error of the device, no permission, a read-only file system, too many open files; and interrupted
/// calls and short writes, which are no failures.
const FAULTS: [DiskFault; 7] = [
    DiskFault::Refused(28),
    DiskFault::Refused(5),
    DiskFault::Refused(13),
    DiskFault::Refused(30),
    DiskFault::Refused(24),
    DiskFault::Interrupted,
    DiskFault::Short,
];

/// The task that runs on a failing disk.
#[derive(Clone, Copy)]
enum Task {
    Bake,
    Shard,
    Merge,
}

/// A disk on which operation number `at` fails, and with `for_good` all later operations too.
struct Failing {
    at: u64,
    fault: DiskFault,
    for_good: bool,
    count: AtomicU64,
}

impl Failing {
    fn new(at: u64, fault: DiskFault, for_good: bool) -> Arc<Failing> {
        Arc::new(Failing { at, fault, for_good, count: AtomicU64::new(0) })
    }
}

impl Disk for Failing {
    fn allow(&self, operation: Operation, _path: &Path, bytes: usize) -> io::Result<usize> {
        let number = self.count.fetch_add(1, Ordering::Relaxed);
        // A write is repeated after an interrupt. If all were interrupted, the repeats would never end.
        let for_good = self.for_good && self.fault != DiskFault::Interrupted;
        if number < self.at || number > self.at && !for_good {
            return Ok(bytes);
        }
        match self.fault {
            DiskFault::Refused(number) => Err(io::Error::from_raw_os_error(number)),
            // Only writes are interrupted: the standard library itself repeats all other interrupted calls.
            DiskFault::Interrupted if operation == Operation::Write && bytes > 0 => {
                Err(io::ErrorKind::Interrupted.into())
            }
            DiskFault::Short if bytes > 1 => Ok(bytes / 2),
            DiskFault::Interrupted | DiskFault::Short => Ok(bytes),
        }
    }
}

fn files(folder: &Path, name: &str, found: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = format!("{name}/{}", entry.file_name().to_string_lossy());
        if entry.file_type().unwrap().is_dir() {
            files(&entry.path(), &name, found);
        } else if !name.ends_with(runs::PATH) {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
}

fn all_files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    files(folder, "", &mut found);
    found
}

/// Runs a bake, a shard or a merge on disks that fail at every `step`th operation, with the faults of `FAULTS` in turn,
/// or with `all` of them. Returns the numbers of runs that failed and that succeeded.
fn bakes_on_failing_disks(task: Task, step: usize, all: bool) -> [u64; 2] {
    let text = "tile_cells = 16\nnoise = [{ kind = \"fbm\", height_m = 60.0, wavelength_m = 300.0, octaves = 3 }]\n\
                rivers = { density = 0.6, width_m = [1.0, 4.0], bank_m = 3.0 }";
    let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
    let region = Region::new(TileId { x: 0, y: 0 }, 3, 3, 16).unwrap();
    let exports = Export::parse_list("height,exr,r16-tiles,map,gltf,obj,hashes,vector,geojson").unwrap();
    let plan = Plan::new(&world, "test", region, exports).unwrap();
    // One thread, so that the operations always come in the same order.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let shard = |number| plan.clone().with_shard(Shard::new(number, 2).unwrap()).unwrap();
    let source = tempfile::tempdir().unwrap();
    let folders = [1, 2].map(|number| source.path().join(number.to_string()));
    for (number, folder) in (1..).zip(&folders) {
        let shard = shard(number);
        let output = Output::prepare(folder, Mode::New, &shard, &shard.cost(1)).unwrap();
        pool.install(|| shard.run(&output, &Watch::default())).unwrap();
    }
    let shards = Shards::open(&folders).unwrap();
    let plan = match task {
        Task::Bake => plan,
        Task::Shard => shard(2),
        Task::Merge => shards.plan(&world).unwrap(),
    };
    let cost = plan.cost(1);
    let bake = |folder: &Path, mode: Mode| {
        pool.install(|| {
            Output::prepare(folder, mode, &plan, &cost).and_then(|output| plan.run(&output, &Watch::default()))
        })
    };
    let root = tempfile::tempdir().unwrap();
    let (undisturbed, counted) = (root.path().join("undisturbed"), Failing::new(u64::MAX, DiskFault::Short, false));
    double::with(&undisturbed, counted.clone(), || bake(&undisturbed, Mode::New).unwrap());
    let wanted = all_files(&undisturbed);
    let operations = counted.count.load(Ordering::Relaxed);
    assert!(operations > 100, "{operations} operations");
    let mut outcomes = [0; 2];
    for (turn, at) in (0..operations).step_by(step).enumerate() {
        let turns = if all { 0..2 * FAULTS.len() } else { turn..turn + 1 };
        for turn in turns {
            let (fault, for_good) = (FAULTS[turn % FAULTS.len()], turn / FAULTS.len() % 2 == 1);
            let about = format!("operation {at} of {operations}, {fault:?}, for good: {for_good}");
            let folder = root.path().join("bake");
            let disk = Failing::new(at, fault, for_good);
            let result = double::with(&folder, disk, || bake(&folder, Mode::New));
            outcomes[usize::from(result.is_ok())] += 1;
            match result {
                Ok(_) => assert!(all_files(&folder) == wanted, "a bake says that it is whole, and is not: {about}"),
                Err(error) => {
                    let is_harmless = [DiskFault::Interrupted, DiskFault::Short].contains(&fault);
                    assert!(!is_harmless, "{error}: {about}");
                    let said = error.to_string();
                    assert!(said.contains(&folder.display().to_string()), "{said} names no file: {about}");
                    assert!([1, 2].contains(&error.exit_code()), "{about}");
                    // A bake with a manifest must be whole.
                    if folder.join(manifest::PATH).exists() {
                        let mut there = all_files(&folder);
                        there.retain(|name, _| !name.starts_with("/.terrane-bake"));
                        assert!(there == wanted, "{about}");
                    }
                    bake(&folder, Mode::Resume).unwrap_or_else(|error| panic!("{error}: {about}"));
                    assert!(all_files(&folder) == wanted, "what went on is another bake: {about}");
                }
            }
            _ = fs::remove_dir_all(&folder);
        }
    }
    println!("{operations} operations; bakes that failed, and that did not: {outcomes:?}");
    outcomes
}

#[test]
fn a_disk_that_fails_leaves_nothing_that_looks_whole_and_what_is_left_goes_on() {
    for task in [Task::Bake, Task::Shard, Task::Merge] {
        let [failed, done] = bakes_on_failing_disks(task, 3, false);
        assert!(failed > 15 && done > 5);
    }
}

/// `cargo test --profile quick --lib -- --ignored every_fault`
#[test]
#[ignore = "slow for its own sake"]
fn every_fault_at_every_operation_is_survived() {
    let all = std::env::var_os("TERRANE_ALL_FAULTS").is_some();
    for task in [Task::Bake, Task::Shard, Task::Merge] {
        let [failed, done] = bakes_on_failing_disks(task, 1, all);
        assert!(failed > 50 && done > 20);
    }
}
