//! Bakes in shards: put together they are the bake of one machine, to the byte, or they are refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use terrane::area::{Place, Region, TileId};
use terrane::bake::Shard;
use terrane::export::{Export, Manifest, Profile};
use terrane::preset::Preset;
use terrane::world::World;

use crate::desk::{Desk, Running, files_in};

/// A world of noise with paths of agents, of tiles as small as they can be.
const NOISE: &str = "\
tile_cells = 16

[[noise]]
kind = \"ridged\"
height_m = 60.0
wavelength_m = 300.0
octaves = 4

[rivers]
density = 1.0
width_m = [1.0, 4.0]
bank_m = 3.0

[roads]
density = 1.0
width_m = 2.0
";

/// Formats of all kinds: of the region and of tiles, and such as only know their tiles at the end.
const EXPORTS: &str = "height,height-tiles,exr,r16-tiles,gltf,obj-tiles,hashes,vector";

/// All exports that a world shows, but web maps: these are drawn from the world at the end, which takes longer than all
/// others.
fn exports(preset: Preset) -> String {
    let world = World::new(preset, None).unwrap();
    let shown = Export::all().filter(|export| export.is_shown_by(&world)).map(Export::name);
    shown.filter(|name| !name.starts_with("web")).collect::<Vec<_>>().join(",")
}

fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("noise.toml", NOISE);
    desk
}

/// All files of a folder with their bytes.
fn files(desk: &Desk, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let names = files_in(&desk.path(folder)).into_iter();
    names.map(|name| (name.clone(), fs::read(desk.path(folder).join(&name)).unwrap())).collect()
}

/// Says which files differ, and not all of their bytes.
fn assert_same(desk: &Desk, one: &str, other: &str) {
    let (files, others) = (files(desk, one), files(desk, other));
    let names: Vec<_> = files.keys().filter(|name| !others.contains_key(*name)).collect();
    let more: Vec<_> = others.keys().filter(|name| !files.contains_key(*name)).collect();
    assert!(names.is_empty() && more.is_empty(), "{one} has {names:?} and {other} has {more:?}");
    for (name, bytes) in &files {
        assert!(*bytes == others[name], "{name} of {one} is another file in {other}");
    }
}

/// Bakes shards into folders with their numbers, and returns these.
fn bake_shards(desk: &Desk, bake: &[&str], of: u64) -> Vec<String> {
    let folder = |number| format!("{number}of{of}");
    for number in 1..=of {
        desk.done(&[bake, &["--shard", &format!("{number}/{of}"), "-q", "--out", &folder(number)]].concat());
    }
    (1..=of).map(folder).collect()
}

fn merge<'a>(shards: &'a [String], out: &'a str) -> Vec<&'a str> {
    let shards = shards.iter().map(String::as_str);
    ["merge"].into_iter().chain(shards).chain(["-q", "--out", out]).collect()
}

fn merges_to_one_bake(bake: &[&str], numbers: &[u64]) {
    let desk = desk();
    desk.done(&[bake, &["-q", "--out", "whole"]].concat());
    for of in numbers {
        let mut shards = bake_shards(&desk, bake, *of);
        // In any order.
        shards.rotate_left((of / 2) as usize);
        let out = format!("merged{of}");
        desk.done(&merge(&shards, &out));
        assert_same(&desk, "whole", &out);
        if *of == numbers[0] {
            desk.done(&["verify", &shards[0], "--all"]);
        }
    }
    desk.done(&["verify", &format!("merged{}", numbers[0]), "--all"]);
}

#[test]
fn every_export_of_rivers_is_merged_to_the_bytes_of_one_bake() {
    let exports = exports(Preset::load("alps").unwrap().1);
    let bake =
        ["bake", "alps", "--tile-cells", "16", "--at=-2,3", "--size", "4x3", "--lod", "0..1", "--export", &exports];
    merges_to_one_bake(&bake, &[3, 1, 4]);
}

#[test]
fn every_export_of_noise_is_merged_to_the_bytes_of_one_bake() {
    let exports = exports(Preset::parse("noise.toml", NOISE).unwrap());
    let bake = ["bake", "noise.toml", "--size", "3x3", "--names", "world", "--export", &exports, "--clip"];
    merges_to_one_bake(&bake, &[4, 1, 3]);
}

#[test]
fn the_climates_of_a_world_are_merged_to_the_bytes_of_one_bake() {
    let exports = "climate,climate-tiles,climate-geotiff,rock,rock-tiles,rock-geotiff,uplift";
    let bake = ["bake", "world", "--tile-cells", "16", "--size", "3x2", "--export", exports];
    merges_to_one_bake(&bake, &[2]);
}

#[test]
fn a_web_map_is_merged_to_the_bytes_of_one_bake() {
    merges_to_one_bake(&["bake", "small.toml", "--size", "3x5", "--export", "web,web-png"], &[2]);
}

#[test]
fn every_profile_is_merged_to_the_bytes_of_one_bake() {
    for profile in Profile::ALL.map(Profile::name) {
        let cells = match profile {
            "unreal" => "126",
            "unreal-tiled" => "128",
            _ => "64",
        };
        let size = if profile == "unreal" { "1x1" } else { "2x2" };
        let numbers: &[u64] = if size == "1x1" { &[1] } else { &[2] };
        merges_to_one_bake(&["bake", "hills", "--size", size, "--tile-cells", cells, "--profile", profile], numbers);
    }
}

#[test]
fn a_shard_is_the_same_on_any_machine() {
    let desk = desk();
    let bake =
        ["bake", "alps", "--tile-cells", "32", "--size", "6x4", "--export", EXPORTS, "--shard", "2/2", "-q", "--out"];
    desk.done(&[&bake[..], &["one", "--threads", "1"]].concat());
    desk.done(&[&bake[..], &["many", "--threads", "7"]].concat());
    let mut scalar = desk.command(&[&bake[..], &["scalar"]].concat());
    assert!(scalar.env("TERRANE_SIMD", "scalar").status().unwrap().success());
    assert_same(&desk, "one", "many");
    assert_same(&desk, "one", "scalar");
    // One that a GPU has made goes with others.
    if desk.done(&["devices", "--json"]).stdout.contains("\"driver\"") {
        desk.done(&[&BAKE[..], &["-q", "--out", "whole"]].concat());
        let shards = bake_shards(&desk, &BAKE, 2);
        desk.done(&[&BAKE[..], &["--shard", "2/2", "--device", "gpu", "-q", "--out", "gpu"]].concat());
        assert_same(&desk, &shards[1], "gpu");
        desk.done(&merge(&[shards[0].clone(), "gpu".into(), shards[1].clone()], "o"));
        assert_same(&desk, "whole", "o");
    } else {
        println!("SKIPPED: there is no GPU, and no program that does as if it were one");
    }
}

/// The bake of most tests, of twelve tiles.
const BAKE: [&str; 6] = ["bake", "noise.toml", "--size", "4x3", "--export", EXPORTS];

#[test]
fn a_gap_is_refused_and_named() {
    let desk = desk();
    let shards = bake_shards(&desk, &BAKE, 4);
    for missing in 0..4 {
        let mut others = shards.clone();
        others.remove(missing);
        let region = Region::new(TileId { x: 0, y: 0 }, 4, 3, 16).unwrap();
        let tiles = Shard::new(missing as u64 + 1, 4).unwrap().region(&region).unwrap();
        let first = tiles.tile(Place { row: 0, col: 0 }).to_string();
        desk.refused(&merge(&others, "o"), &[&first, "in no shard", &format!("{}/4 is missing", missing + 1)]);
    }
    desk.refused(&merge(&shards[..1], "o"), &["2/4, 3/4, 4/4 is missing"]);
}

#[test]
fn what_is_no_shard_of_the_same_bake_is_refused() {
    let desk = desk();
    let mut shards = bake_shards(&desk, &BAKE, 2);
    let others: [(&[&str], &str); 6] = [
        (&["--seed", "5"], "seed"),
        (&["--at", "1,0"], "region.at.x"),
        (&["--set", "noise[0].height_m=61"], "noise"),
        (&["--scale", "1/2"], "region"),
        (&["--height-range", "0,90"], "height_range"),
        (&["--lod", "1"], "meshes.lods"),
    ];
    for (options, word) in others {
        _ = fs::remove_dir_all(desk.path("other"));
        desk.done(&[&BAKE[..], options, &["--shard", "2/2", "-q", "--out", "other"]].concat());
        let others = [shards[0].clone(), "other".into()];
        desk.refused(&merge(&others, "o"), &["other", "no shard of the bake", "1of2", word]);
    }
    // Of other programs, and of GPUs whose tiles meet no others.
    for (key, value, words) in [
        ("generator", "terrane 0.0.7".into(), ["1of2", "0.0.7", "merge with the program"]),
        ("layers", serde_json::json!({ "noise": 0 }), ["noise", "not the same", "another"]),
    ] {
        let whole = fs::read(desk.path("1of2/bake.json")).unwrap();
        reseal(&desk.path("1of2"), |manifest| manifest[key] = value);
        let outcome = desk.refused(&merge(&shards, "o"), &[]);
        assert!(words[..2].iter().all(|word| outcome.stderr.contains(word)), "{outcome}");
        fs::write(desk.path("1of2/bake.json"), whole).unwrap();
    }
    desk.done(&[&BAKE[..], &["-q", "--out", "whole"]].concat());
    shards.push("whole".into());
    desk.refused(&merge(&shards, "o"), &["whole", "no shard", "--shard"]);
    shards[2] = "nowhere".into();
    desk.refused(&merge(&shards, "o"), &["nowhere", "is not there"]);
    desk.refused(&["merge"], &["DIR"]);
}

/// Writes a manifest with something else in it, as if it had been written so.
fn reseal(folder: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let path = folder.join("bake.json");
    let mut value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut value);
    let mut manifest: Manifest = serde_json::from_value(value).unwrap();
    let text = |manifest: &Manifest| serde_json::to_string_pretty(manifest).unwrap() + "\n";
    manifest.blake3 = String::new();
    manifest.blake3 = blake3::hash(text(&manifest).as_bytes()).to_hex().to_string();
    fs::write(&path, text(&manifest)).unwrap();
}

#[test]
fn a_damaged_shard_is_refused_and_named_and_can_be_mended() {
    let desk = desk();
    let shards = bake_shards(&desk, &BAKE, 2);
    let names = files_in(&desk.path("2of2"));
    assert!(names.len() > 20 && names.contains("shard.tiles") && !names.contains("hashes.txt"), "{names:?}");
    for (number, name) in names.iter().enumerate() {
        let path = desk.path("2of2").join(name);
        let whole = fs::read(&path).unwrap();
        let mut bad = whole.clone();
        match number % 3 {
            0 => bad[(number * 7919) % whole.len()] ^= 1 << (number % 8),
            1 => bad.truncate(whole.len() - 1),
            _ => bad.clear(),
        }
        fs::write(&path, &bad).unwrap();
        desk.refused(&merge(&shards, "o"), &["2of2", name]);
        fs::write(&path, whole).unwrap();
    }
    // As the hint says.
    fs::remove_file(desk.path("2of2/shard.tiles")).unwrap();
    desk.refused(&merge(&shards, "o"), &["2of2/shard.tiles", "is missing", "shard 2/2", "--resume"]);
    assert_eq!(desk.run(&["verify", "2of2"]).code, Some(1));
    desk.done(&["repair", "2of2"]);
    fs::remove_file(desk.path("2of2/height/height_x2_y1.png")).unwrap();
    desk.done(&[&BAKE[..], &["--shard", "2/2", "--resume", "-q", "--out", "2of2"]].concat());
    let dry = desk.done(&["merge", "1of2", "2of2", "--dry-run", "--json", "--out", "o"]).object();
    assert_eq!((&dry["tiles"], &dry["seconds"]), (&12.into(), &serde_json::Value::Null));
    assert!(!desk.path("o").exists());
    desk.done(&merge(&shards, "o"));
    desk.done(&["verify", "o", "--all"]);
    // What is there is not merged again, and nothing but with leave.
    desk.refused(&merge(&shards, "o"), &["o", "this very bake"]);
    let before = desk.everything();
    desk.done(&[&merge(&shards, "o")[..], &["--resume"]].concat());
    assert!(desk.everything() == before, "a merge that is there was made again");
    fs::remove_file(desk.path("o/hashes.txt")).unwrap();
    desk.done(&[&merge(&shards, "o")[..], &["--resume"]].concat());
    desk.done(&["verify", "o"]);
}

#[test]
fn tiles_that_several_shards_have_are_the_same_or_refused() {
    let desk = desk();
    desk.done(&[&BAKE[..], &["-q", "--out", "whole"]].concat());
    let (halves, thirds) = (bake_shards(&desk, &BAKE, 2), bake_shards(&desk, &BAKE, 3));
    // One that was baked twice, and shards of several sizes.
    for (number, shards) in [
        [&halves[..], &halves[..1]].concat(),
        [&halves[..], &thirds[1..]].concat(),
        [&thirds[..], &halves[..1]].concat(),
        [&halves[..1], &thirds[1..]].concat(),
    ]
    .iter()
    .enumerate()
    {
        let out = format!("o{number}");
        desk.done(&merge(shards, &out));
        assert_same(&desk, "whole", &out);
    }
    // A file of a tile that is another one, though whole as its manifest says.
    desk.done(&[&BAKE[..], &["--shard", "1/2", "-q", "--out", "twin"]].concat());
    let name = "height/height_x0_y0.png";
    fs::write(desk.path("twin").join(name), "other").unwrap();
    reseal(&desk.path("twin"), |manifest| {
        let files = manifest["files"].as_array_mut().unwrap();
        let file = files.iter_mut().find(|file| file["path"] == name).unwrap();
        file["bytes"] = 5.into();
        file["blake3"] = blake3::hash(b"other").to_hex().to_string().into();
    });
    for others in [&halves, &thirds] {
        let shards = [&others[..], &["twin".to_owned()]].concat();
        let outcome = desk.refused(&merge(&shards, "o"), &[name, "has the same tiles"]);
        assert!(outcome.stderr.contains("twin") && outcome.stderr.contains(&others[0]), "{outcome}");
    }
    // And a tile of which the registry says another thing.
    fs::remove_dir_all(desk.path("twin")).unwrap();
    desk.done(&[&BAKE[..], &["--shard", "1/2", "-q", "--out", "twin"]].concat());
    let registry = desk.path("twin/registry.sqlite");
    let database = rusqlite::Connection::open(&registry).unwrap();
    database.execute("UPDATE tiles SET heights_hash = normals_hash WHERE x = 0 AND y = 1", ()).unwrap();
    database.close().unwrap();
    reseal(&desk.path("twin"), |manifest| {
        let bytes = fs::read(&registry).unwrap();
        let files = manifest["files"].as_array_mut().unwrap();
        let file = files.iter_mut().find(|file| file["path"] == "registry.sqlite").unwrap();
        file["bytes"] = bytes.len().into();
        file["blake3"] = blake3::hash(&bytes).to_hex().to_string().into();
    });
    desk.refused(&merge(&[&thirds[..], &["twin".to_owned()]].concat(), "o"), &["another tile (0, 1)", "twin", "1of3"]);
    desk.refused(&merge(&[&halves[..], &["twin".to_owned()]].concat(), "o"), &["registry.sqlite", "twin", "1of2"]);
}

#[cfg(unix)]
#[test]
fn a_shard_that_is_killed_goes_on_and_so_does_a_merge() {
    let desk = desk();
    let bake = ["bake", "noise.toml", "--size", "12x8", "--export", EXPORTS];
    desk.done(&[&bake[..], &["-q", "--out", "whole"]].concat());
    let shards = bake_shards(&desk, &bake, 2);
    let is_begun = |folder: &str| {
        let pieces = desk.path(folder).join(".terrane-bake/pieces");
        fs::metadata(pieces).is_ok_and(|pieces| pieces.len() > 0)
    };
    let kill = |arguments: &[&str], folder: &str, wait: Duration| {
        let mut running = Running(desk.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
        while !is_begun(folder) && running.0.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(1));
        }
        thread::sleep(wait);
        running.signal("KILL");
        running.exit_code();
    };
    let shard = [&bake[..], &["--shard", "2/2", "--resume", "-q", "--out", "killed"]].concat();
    for wait in [0, 20, 50] {
        kill(&shard, "killed", Duration::from_millis(wait));
        if desk.path("killed/.terrane-bake").exists() {
            desk.refused(&merge(&[shards[0].clone(), "killed".into()], "o"), &["killed", "cut off", "--resume"]);
        }
    }
    desk.refused(
        &[&bake[..], &["--shard", "1/2", "--resume", "--out", "killed"]].concat(),
        &["shard.number: 2, not 1"],
    );
    desk.done(&shard);
    assert_same(&desk, &shards[1], "killed");
    let again = [&merge(&shards, "o")[..], &["--resume"]].concat();
    for wait in [0, 10, 40] {
        kill(&again, "o", Duration::from_millis(wait));
    }
    desk.done(&again);
    assert_same(&desk, "whole", "o");
}

#[test]
fn a_shard_that_cannot_be_is_refused() {
    let desk = desk();
    let bake = |more: &[&'static str]| [&BAKE[..], more].concat();
    desk.refused(&bake(&["--shard", "1/13"]), &["13 shards", "12 tiles", "--shard 1/12"]);
    for shard in ["0/4", "5/4", "4", "a/b", "1/0"] {
        desk.refused(&[&BAKE[..], &["--shard", shard]].concat(), &[shard, "3/16"]);
    }
    desk.refused(&bake(&["--shard", "1/2", "--add", "--out", "o"]), &["--shard", "--add"]);
    let shards = bake_shards(&desk, &BAKE, 2);
    desk.refused(&["extend", &shards[0], "--size", "8x8"], &["shard 1/2", "terrane merge"]);
    let add = ["bake", "noise.toml", "--size", "4x3", "--export", "map", "--add", "--out", "1of2"];
    desk.refused(&add, &["holds another bake: shard"]);
    let told = desk.done(&["info", &shards[0], "--json"]).object();
    assert_eq!((&told["tiles"], &told["tiles_of"], &told["shard"]["of"]), (&6.into(), &6.into(), &2.into()));
    let dry = desk.done(&bake(&["--shard", "2/2", "--dry-run", "--json", "--out", "o"])).last_object();
    assert_eq!(dry["tiles"], 6);
    desk.done(&["clean", &shards[0]]);
    assert!(!desk.path(&shards[0]).exists());
}

// ---------------------------------------------------------------------------------------------------------------------
// Jobs.

/// The bake whose jobs are tried; with words that a shell would take for something else.
const JOB: [&str; 9] = [
    "noise.toml",
    "--size",
    "4x3",
    "--set",
    "noise=[{kind='fbm', height_m=9.0, wavelength_m=90.0, octaves=2}]",
    "--export",
    EXPORTS,
    "--out",
    "whole of $it",
];

fn job(desk: &Desk, engine: &str) -> String {
    desk.done(&[&["shard-plan"], &JOB[..], &["--engine", engine, "--shards=3"]].concat()).stdout
}

/// Runs a program in a desk, with the command and programs of the desk's own found first. False if it is not there.
fn runs(desk: &Desk, program: &str, arguments: &[&str]) -> bool {
    let own = Path::new(env!("CARGO_BIN_EXE_terrane")).parent().unwrap();
    let path = std::env::join_paths(
        [&desk.path("bin"), own]
            .into_iter()
            .map(Into::into)
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    )
    .unwrap();
    let output = Command::new(program)
        .args(arguments)
        .env("PATH", path)
        .env("HOME", desk.root())
        .current_dir(desk.root())
        .output();
    let Ok(output) = output else {
        println!("SKIPPED: there is no {program} here");
        return false;
    };
    let [said, errors] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{program} {arguments:?}: {}\n{said}\n{errors}", output.status);
    true
}

/// Whether a job has left the bake of one machine. It may be run again, and changes nothing.
fn assert_baked(desk: &Desk, run: impl Fn() -> bool) {
    let alone = [&["bake"], &JOB[..7], &["-q", "--out", "alone"]].concat();
    desk.done(&alone);
    if run() {
        assert_same(desk, "alone", "whole of $it");
        assert!(run());
        assert_same(desk, "alone", "whole of $it");
    }
}

#[cfg(unix)]
fn write_program(desk: &Desk, name: &str, text: &str) {
    use std::os::unix::fs::PermissionsExt;
    desk.write(name, text);
    fs::set_permissions(desk.path(name), fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(unix)]
#[test]
fn the_commands_of_a_job_are_a_bake_in_any_order() {
    let desk = desk();
    let text = job(&desk, "commands");
    let mut commands: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(commands.len(), 4, "{text}");
    let merge = commands.pop().unwrap();
    commands.reverse();
    assert_baked(&desk, || commands.iter().chain([&merge]).all(|command| runs(&desk, "sh", &["-c", command])));
}

#[cfg(unix)]
#[test]
fn a_job_for_slurm_is_a_bake() {
    let desk = desk();
    desk.write("job", job(&desk, "slurm"));
    // Does what Slurm would, at once: each job of an array, with its number.
    let sbatch = "#!/bin/bash
set -e
script=$(mktemp)
cat >\"$script\"
for option; do
    case $option in
        --array=1-*) last=${option#--array=1-} ;;
        --export=ALL,*) export \"${option#--export=ALL,}\" ;;
    esac
done
for ((number = 1; number <= ${last:-1}; number++)); do
    SLURM_JOB_ID=7 SLURM_ARRAY_TASK_ID=$number bash \"$script\" >&2
done
echo 7
";
    write_program(&desk, "bin/sbatch", sbatch);
    assert_baked(&desk, || runs(&desk, "bash", &["job"]));
}

#[cfg(unix)]
#[test]
fn a_job_for_kubernetes_is_a_bake() {
    let desk = desk();
    let text = job(&desk, "kubernetes");
    // The commands, as a pod runs them.
    let commands: Vec<[String; 3]> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("command: "))
        .map(|list| serde_json::from_str(list).unwrap())
        .collect();
    let [[shell, option, shard], [.., merge]] = &commands[..] else { panic!("{text}") };
    assert_eq!((&shell[..], &option[..]), ("sh", "-c"));
    for line in ["kind: Job", "completionMode: Indexed", "completions: 3", "suspend: true", "backoffLimitPerIndex: 3"] {
        assert!(text.lines().any(|it| it.trim() == line), "{line}\n{text}");
    }
    assert_baked(&desk, || {
        (0..3).all(|index| runs(&desk, "sh", &["-c", &format!("JOB_COMPLETION_INDEX={index}; {shard}")]))
            && runs(&desk, "sh", &["-c", merge])
    });
}

#[test]
fn shards_are_as_many_as_the_time_of_each_asks_for() {
    let desk = desk();
    let plan = |minutes: &str| {
        let words = [
            "shard-plan",
            "thesis",
            "--size",
            "4096x4096",
            "--export",
            "r16",
            "--engine",
            "commands",
            "--json",
            "--minutes",
            minutes,
        ];
        desk.done(&words).object()
    };
    let (few, many) = (plan("60"), plan("1"));
    let number = |object: &serde_json::Value| object["shards"].as_u64().unwrap();
    // How much faster one was made than the other on a busy machine says nothing.
    assert!(1 < number(&few) && number(&few) < number(&many), "{few} {many}");
    assert!(few["seconds"].as_f64().unwrap() <= 3600.0, "{few}");
}
