//! A bake that was cut off goes on, grows, and ends with the bytes that it would have had undisturbed.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use crate::desk::{Desk, Running, files_in};

/// Where bakes are made, and what tells of their runs.
const WORK: &str = ".terrane-bake";
const RUNS: &str = "runs.jsonl";

/// Formats of all kinds: of the region and of tiles, and such as only know their tiles at the end.
const BAKE: [&str; 8] = [
    "bake",
    "small.toml",
    "--size",
    "12x10",
    "--export",
    "height,exr,r16-tiles,normal-tiles,blend,map,gltf,obj-tiles,hashes,vector,geojson",
    "-q",
    "--out",
];

fn bake<'a>(folder: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&BAKE[..], &[folder], more].concat()
}

/// All files of a folder with their bytes.
fn files(desk: &Desk, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let names = files_in(&desk.path(folder)).into_iter();
    names.map(|name| (name.clone(), fs::read(desk.path(folder).join(&name)).unwrap())).collect()
}

/// Those that a bake under way has not made.
fn without_work(mut files: BTreeMap<String, Vec<u8>>) -> BTreeMap<String, Vec<u8>> {
    files.retain(|name, _| !name.starts_with(WORK) && name != ".terrane.lock");
    files
}

/// Says which files differ, and not all of their bytes.
fn assert_same(one: &BTreeMap<String, Vec<u8>>, other: &BTreeMap<String, Vec<u8>>, about: &str) {
    let only = |one: &BTreeMap<String, Vec<u8>>, other: &BTreeMap<String, Vec<u8>>| {
        one.keys().filter(|name| !other.contains_key(*name)).take(5).cloned().collect::<Vec<_>>()
    };
    assert_eq!((only(one, other), only(other, one)), (vec![], vec![]), "{about}");
    for (name, bytes) in one {
        assert!(&other[name] == bytes, "{about}: {name} has other bytes");
    }
}

/// How many tiles the last run of a bake has made, and how many it knew.
fn tiles_of_last_run(desk: &Desk, folder: &str) -> [u64; 2] {
    let log = fs::read_to_string(desk.path(folder).join(RUNS)).unwrap();
    let last: serde_json::Value = serde_json::from_str(log.lines().last().unwrap()).unwrap();
    ["tiles_made", "tiles_known"].map(|key| last[key].as_u64().unwrap())
}

/// Bytes that bakes have put aside in a folder until now.
fn put_aside(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let bytes = |entry: fs::DirEntry| {
        if entry.path().is_dir() { put_aside(&entry.path()) } else { entry.metadata().map_or(0, |file| file.len()) }
    };
    entries.map(bytes).sum()
}

/// Runs a bake, and returns the most bytes that it has put aside.
fn most_put_aside(desk: &Desk, arguments: &[&str], folder: &str) -> u64 {
    let mut running = Running(desk.command(arguments).spawn().unwrap());
    let mut most = 0;
    while running.0.try_wait().unwrap().is_none() {
        most = most.max(put_aside(&desk.path(folder).join(WORK)));
        thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(running.exit_code(), Some(0));
    most
}

/// Starts a bake and kills it when it has put aside a share of the bytes that are still missing of `whole`, unless it
/// has ended before.
fn cut_off(desk: &Desk, arguments: &[&str], folder: &str, share: f64, whole: u64, signal: &str) {
    let work = desk.path(folder).join(WORK);
    let before = put_aside(&work);
    let until = before + (share * whole.saturating_sub(before) as f64) as u64;
    let child = desk.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let mut running = Running(child);
    while put_aside(&work) < until && running.0.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(1));
    }
    running.signal(signal);
    running.exit_code();
}

fn kills(times: u32) {
    let desk = Desk::new();
    let whole = most_put_aside(&desk, &bake("undisturbed", &[]), "undisturbed");
    let wanted = files(&desk, "undisturbed");
    desk.done(&bake("other", &["--seed", "5"]));
    let other = files(&desk, "other");
    // The golden ratio spreads any number of moments over the bake, and a little beyond.
    let mut moments = (1..).map(|number: u32| f64::from(number) * 0.618_033_988_749_895 % 1.0 * 1.1);
    let mut known = 0;
    for time in 0..times {
        let mut share = || moments.next().expect("there is no end of them");
        let about = format!("kill {time}");
        // Into an empty folder, or over another bake, and now and then again while it goes on.
        let over = time % 2 == 1;
        _ = fs::remove_dir_all(desk.path("o"));
        if over {
            for (name, bytes) in &other {
                desk.write(&format!("o/{name}"), bytes);
            }
        }
        cut_off(&desk, &bake("o", if over { &["--overwrite"] } else { &[] }), "o", share(), whole, "KILL");
        if over
            && desk.path("o").join(WORK).join("plan.json").exists()
            && !desk.path("o").join(WORK).join("old.json").exists()
        {
            // The old bake is whole until the new one is.
            assert_same(&without_work(files(&desk, "o")), &other, &about);
        }
        let resume = bake("o", &["--resume"]);
        if time % 3 == 0 && !over {
            cut_off(&desk, &resume, "o", share(), whole, "KILL");
        }
        let outcome = desk.run(&resume);
        if outcome.code == Some(2) {
            // It was cut off before anything was changed.
            assert!(over, "{about}: {outcome}");
            assert_same(&without_work(files(&desk, "o")), &other, &about);
            continue;
        }
        assert_eq!(outcome.code, Some(0), "{about}: {outcome}");
        known += u64::from(tiles_of_last_run(&desk, "o")[1] > 0);
        assert_same(&files(&desk, "o"), &wanted, &about);
        if time % 100 == 99 {
            println!("{} kills, after {known} of which there were tiles to go on with", time + 1);
        }
    }
    println!("{known} of {times} went on with tiles that they knew");
    assert!(known > 0, "no bake had a tile to go on with");
}

#[cfg(unix)]
#[test]
fn a_bake_that_is_killed_goes_on_and_ends_as_if_it_had_not_been() {
    kills(25);
}

/// `cargo test --profile quick --test suite -- --ignored thousand`
#[cfg(unix)]
#[test]
#[ignore = "it takes half an hour"]
fn a_thousand_kills_change_nothing() {
    kills(1000);
}

#[test]
fn what_a_bake_has_left_that_was_killed_as_it_looked_is_removed() {
    let desk = Desk::new();
    desk.done(&bake("o", &[]));
    let before = files(&desk, "o");
    desk.write("o/.bake.json.oYF0mC.part", "");
    desk.done(&bake("o", &["--overwrite"]));
    assert_same(&files(&desk, "o"), &before, "overwritten");
}

#[cfg(unix)]
#[test]
fn a_bake_that_is_stopped_says_how_it_goes_on_whatever_the_threads() {
    let desk = Desk::new();
    let whole = most_put_aside(&desk, &bake("undisturbed", &["--threads", "1"]), "undisturbed");
    let wanted = files(&desk, "undisturbed");
    for threads in ["1", "2", "3", "8"] {
        cut_off(&desk, &bake(threads, &["--threads", threads]), threads, 0.5, whole, "INT");
        if !desk.path(threads).join(WORK).exists() {
            continue;
        }
        desk.refused(&bake(threads, &[]), &["cut off", "--resume"]);
        let verified = desk.run(&["verify", threads]);
        assert!(verified.code == Some(1) && verified.stderr.contains("--resume"), "{verified}");
        let told = desk.done(&["info", threads, "--json"]).object();
        assert!(told["state"] == "cut off" && told["tiles"].as_u64() <= Some(120), "{told}");
        desk.done(&["registry", threads]);
        desk.refused(&bake(threads, &["--seed", "9"]), &["cut off", "--overwrite"]);
        let others = if threads == "2" { "8" } else { "2" };
        desk.done(&bake(threads, &["--resume", "--threads", others]));
        assert_same(&files(&desk, threads), &wanted, threads);
    }
}

#[cfg(unix)]
#[test]
fn each_command_says_how_it_goes_on() {
    let desk = Desk::new();
    desk.write(
        "slow.toml",
        format!(
            "tile_cells = 32\n{}",
            "[[noise]]\nkind = \"fbm\"\nheight_m = 9.0\nwavelength_m = 900.0\noctaves = 8\n".repeat(16)
        ),
    );
    let of = |more: &[&'static str]| {
        let bake = ["bake", "slow.toml", "--size", "40x40", "--threads", "1", "--no-progress", "--out", "o"];
        [&bake[..], more].concat()
    };
    desk.done(&["bake", "slow.toml", "--size", "1x1", "-q", "--out", "o", "--export", "height"]);
    let extend = vec!["extend", "o", "--size", "40x40", "--threads", "1", "--no-progress"];
    for (arguments, words) in [
        (extend, "kept: the same command goes on"),
        (of(&["--overwrite"]), "kept: the same command with --resume in the place of --overwrite goes on"),
    ] {
        let mut running =
            Running(desk.command(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
        let begun = || fs::metadata(desk.path("o").join(WORK).join("pieces")).is_ok_and(|pieces| pieces.len() > 0);
        while !begun() && running.0.try_wait().unwrap().is_none() {
            thread::sleep(Duration::from_millis(5));
        }
        running.signal("INT");
        assert_eq!(running.exit_code(), Some(130));
        let said = std::io::read_to_string(running.0.stderr.take().unwrap()).unwrap();
        assert!(said.contains(words), "{said}");
        // What is there stays, and so it is not told to remove that.
        let other = desk.run(&["extend", "o", "--size", "3x3", "-q"]);
        assert!(other.code == Some(2) && !other.stderr.contains("clean"), "{other}");
        fs::remove_dir_all(desk.path("o").join(WORK)).unwrap();
        desk.done(&["verify", "o"]);
    }
}

#[cfg(unix)]
#[test]
fn what_a_bake_knows_is_trusted_by_its_hash_alone() {
    let desk = Desk::new();
    let whole = most_put_aside(&desk, &bake("undisturbed", &[]), "undisturbed");
    let wanted = files(&desk, "undisturbed");
    let mut tried = 0;
    for round in 0..12 {
        let folder = format!("o{round}");
        cut_off(&desk, &bake(&folder, &[]), &folder, 0.3 + 0.05 * f64::from(round), whole, "KILL");
        let work = desk.path(&folder).join(WORK);
        if !work.exists() {
            continue;
        }
        let made = files_in(&work);
        let Some(tile) = made.iter().find(|name| name.starts_with("files/normal/normal_x") && !name.contains("/."))
        else {
            continue;
        };
        tried += 1;
        // A file of a tile with a wrong bit, and pieces that end early or are not what was written.
        let mut bytes = fs::read(work.join(tile)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(work.join(tile), bytes).unwrap();
        let mut pieces = fs::read(work.join("pieces")).unwrap();
        let length = pieces.len();
        if round % 2 == 0 {
            pieces.truncate(length / 2);
        } else {
            pieces.iter_mut().step_by(4001).for_each(|byte| *byte ^= 4);
        }
        fs::write(work.join("pieces"), pieces).unwrap();
        // And what the registry says of the tiles.
        let database = rusqlite::Connection::open(work.join("registry.sqlite")).unwrap();
        database
            .execute("UPDATE tiles SET heights_hash = normals_hash, lines = '[\"x\"]' WHERE x % 3 = 0", ())
            .unwrap();
        drop(database);
        if round % 3 == 0 {
            // A journal that is no database, or a broken one.
            let mut bytes = fs::read(work.join("registry.sqlite")).unwrap();
            bytes.iter_mut().skip(if round % 2 == 0 { 0 } else { 4096 }).step_by(97).for_each(|byte| *byte ^= 0x55);
            fs::write(work.join("registry.sqlite"), bytes).unwrap();
        }
        desk.done(&bake(&folder, &["--resume"]));
        assert_same(&files(&desk, &folder), &wanted, &folder);
    }
    assert!(tried > 0, "no bake was cut off between two tiles");
}

#[test]
fn only_the_same_bake_goes_on_and_what_differs_is_said() {
    let desk = Desk::new();
    desk.done(&bake("o", &[]));
    let resume = bake("o", &["--resume"]);
    let told = desk.done(&[&resume[..resume.len() - 3], &["--out", "o", "--resume", "--json"]].concat());
    assert_eq!(told.stdout, "", "-q says nothing");
    let before = files(&desk, "o");
    for (more, word) in [
        (&["--seed", "2"][..], "seed: 1, not 2"),
        (&["--at", "1,0"], "region.at.x: 0, not 1"),
        (&["--scale", "1/2"], "stride: 1, not 2"),
        (&["--set", "noise[0].octaves=5"], "octaves"),
        (&["--profile", "blender"], "profile: null, not \"blender\""),
    ] {
        desk.refused(&[&resume[..], more].concat(), &["holds another bake", word]);
    }
    // What is damaged of it is baked again.
    desk.write("o/map/map.png", "not at all");
    fs::remove_file(desk.path("o/hashes.txt")).unwrap();
    desk.done(&resume);
    // Somebody may have wanted it so.
    assert_eq!(fs::read_to_string(desk.path("o/map/map.png.kept-1")).unwrap(), "not at all");
    fs::remove_file(desk.path("o/map/map.png.kept-1")).unwrap();
    assert_same(&files(&desk, "o"), &before, "damaged");
    desk.refused(&["bake", "small.toml", "--out", "o", "--generator", "0.0.7"], &["0.0.7", "--generator"]);
    desk.done(&bake("p", &["--generator", env!("CARGO_PKG_VERSION"), "--resume"]));
}

#[test]
fn exports_come_to_a_bake_and_leave_what_is_there_alone() {
    let desk = Desk::new();
    let size = ["--size", "3x3", "--out"];
    let some = |list| [&["bake", "small.toml", "-q", "--export", list], &size[..]].concat();
    desk.done(&[&some("height,height-tiles,gltf")[..], &["o", "--lod", "1"]].concat());
    let changed = |name: &str| fs::metadata(desk.path("o").join(name)).unwrap().modified().unwrap();
    let before: BTreeMap<String, _> =
        files(&desk, "o").into_keys().map(|name| (name.clone(), changed(&name))).collect();
    desk.refused(&[&some("height,gltf")[..], &["o", "--add"]].concat(), &["already"]);
    desk.refused(&[&some("map")[..], &["o", "--add", "--seed", "3"]].concat(), &["seed: 1, not 3"]);
    desk.refused(&[&some("map")[..], &["nothing", "--add"]].concat(), &["nothing"]);
    desk.done(&[&some("map,vector,normal-tiles")[..], &["o", "--add"]].concat());
    for (name, time) in &before {
        // These two tell of all.
        assert!(["bake.json", "registry.sqlite"].contains(&&name[..]) || changed(name) == *time, "{name} was touched");
    }
    desk.done(&[&some("height,height-tiles,gltf,map,vector,normal-tiles")[..], &["once", "--lod", "1"]].concat());
    assert_same(&files(&desk, "o"), &files(&desk, "once"), "in two steps and at once");
    desk.done(&["verify", "o", "--all"]);
    // A web map has files that the manifest does not list.
    desk.done(&[&some("web")[..], &["o", "--add"]].concat());
    let before = files(&desk, "o");
    assert!(before.keys().any(|name| name.starts_with("web/map/")));
    desk.done(&[&some("hashes")[..], &["o", "--add"]].concat());
    assert!(before.keys().all(|name| desk.path("o").join(name).exists()));
    desk.done(&["verify", "o"]);
    // A bake that is not whole gets nothing.
    fs::remove_file(desk.path("o/map/map.png")).unwrap();
    let outcome = desk.run(&[&some("blend")[..], &["o", "--add"]].concat());
    assert!(outcome.code == Some(1) && outcome.stderr.contains("terrane repair"), "{outcome}");
}

#[test]
fn a_bake_grows_and_its_tiles_stay_as_they_are() {
    let desk = Desk::new();
    let of =
        |list, at, size, out| ["bake", "small.toml", "-q", "--export", list, "--at", at, "--size", size, "--out", out];
    let tiles = "height-tiles,r16-tiles,blend-tiles";
    desk.done(&of(tiles, "-1,2", "3x2", "o"));
    let changed = |name: &str| fs::metadata(desk.path("o").join(name)).unwrap().modified().unwrap();
    let before = changed("height/height_x2_y1.png");
    desk.refused(&["extend", "o", "--size", "2x4"], &["not in that region"]);
    desk.refused(&["extend", "o"], &["--size"]);
    desk.done(&["extend", "o", "--size", "4x4"]);
    assert_eq!(tiles_of_last_run(&desk, "o"), [10, 6], "old tiles are not made again");
    assert_eq!(changed("height/height_x2_y1.png"), before);
    desk.done(&of(tiles, "-1,2", "4x4", "once"));
    assert_same(&files(&desk, "o"), &files(&desk, "once"), "to the south-east");
    // To the north-west, where tiles get other numbers.
    let old = fs::read(desk.path("o/height/height_x0_y0.png")).unwrap();
    desk.done(&["extend", "o", "--at", "-3,1"]);
    assert_eq!(tiles_of_last_run(&desk, "o"), [14, 16]);
    assert!(fs::read(desk.path("o/height/height_x2_y1.png")).unwrap() == old);
    desk.done(&of(tiles, "-3,1", "6x5", "twice"));
    assert_same(&files(&desk, "o"), &files(&desk, "twice"), "to the north-west");
    desk.done(&["verify", "o", "--all"]);
    // Files of the region are made anew, and those of tiles are the same.
    let all = "height,height-tiles,gltf,hashes,map,vector";
    desk.done(&of(all, "0,0", "2x2", "p"));
    desk.done(&["extend", "p", "--at", "-1,0", "--size", "3x3"]);
    desk.done(&of(all, "-1,0", "3x3", "thrice"));
    assert_same(&files(&desk, "p"), &files(&desk, "thrice"), "of all kinds");
}

#[test]
fn a_bake_grows_over_what_was_changed_and_sets_it_aside() {
    let desk = Desk::new();
    let of =
        |size, out| ["bake", "small.toml", "-q", "--export", "height-tiles,blend-tiles", "--size", size, "--out", out];
    desk.done(&of("2x2", "o"));
    desk.write("o/height/height_x1_y1.png", "mine");
    fs::remove_file(desk.path("o/height/height_x0_y1.png")).unwrap();
    let told = desk.done(&["extend", "o", "--size", "3x3", "-q"]).stderr;
    let [before, after] =
        ["gets another name when the bake is whole", "height_x1_y1.png.kept-1"].map(|it| told.find(it));
    assert!(before.is_some() && before < after, "{told}");
    assert_eq!(tiles_of_last_run(&desk, "o"), [7, 2], "what was changed is made again");
    assert_eq!(fs::read_to_string(desk.path("o/height/height_x1_y1.png.kept-1")).unwrap(), "mine");
    fs::remove_file(desk.path("o/height/height_x1_y1.png.kept-1")).unwrap();
    desk.done(&of("3x3", "once"));
    assert_same(&files(&desk, "o"), &files(&desk, "once"), "grown");
    // Files of the region too.
    let of = |size, out| ["bake", "small.toml", "-q", "--export", "height,vector,web", "--size", size, "--out", out];
    desk.done(&of("2x2", "p"));
    let database = rusqlite::Connection::open(desk.path("p/vector/vector.gpkg")).unwrap();
    database.execute_batch("UPDATE gpkg_contents SET description = 'mine'").unwrap();
    drop(database);
    let told = desk.done(&["extend", "p", "--size", "3x2", "-q"]).stderr;
    assert!(told.contains("vector.gpkg.kept-1"), "{told}");
    let kept = rusqlite::Connection::open(desk.path("p/vector/vector.gpkg.kept-1")).unwrap();
    let said: String = kept.query_row("SELECT min(description) FROM gpkg_contents", (), |row| row.get(0)).unwrap();
    assert_eq!(said, "mine");
    desk.done(&["verify", "p", "--all"]);
    // Without the registry nobody knows what the tiles were: nothing is made before that is said.
    desk.write("p/registry.sqlite", "mine");
    let outcome = desk.run(&["extend", "p", "--size", "4x2", "-q"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("terrane repair p"), "{outcome}");
    assert!(!desk.path("p/.terrane-bake").exists(), "{outcome}");
}

#[test]
fn the_order_in_which_tiles_are_made_shows_in_no_file() {
    let desk = Desk::new();
    let exports = "height-tiles,normal-tiles,blend-tiles,map-tiles,r16-tiles";
    let of =
        |at, size, out| ["bake", "small.toml", "-q", "--export", exports, "--at", at, "--size", size, "--out", out];
    desk.done(&of("-1,-1", "3x3", "once"));
    let once = files(&desk, "once");
    // From each corner or the middle outwards, a row and a column at a time or all at once, on any number of threads.
    let ways: [(&str, &str, &[[&str; 4]]); 3] = [
        ("south-east", "1,1", &[["--at", "0,0", "--size", "2x2"], ["--at", "-1,-1", "--size", "3x3"]]),
        ("middle", "0,0", &[["--at", "-1,-1", "--size", "3x3"]]),
        ("north-west", "-1,-1", &[["--at", "-1,-1", "--size", "1x3"], ["--at", "-1,-1", "--size", "3x3"]]),
    ];
    for (number, (way, first, steps)) in ways.into_iter().enumerate() {
        desk.done(&of(first, "1x1", way));
        for step in steps {
            let threads = (number + 1).to_string();
            desk.done(&[&["extend", way, "-q", "--threads", &threads], &step[..]].concat());
        }
        assert_same(&files(&desk, way), &once, way);
    }
}

#[test]
fn what_lies_in_a_folder_is_told() {
    let desk = Desk::new();
    desk.refused(&["info", "."], &["no finished bake"]);
    desk.done(&[
        "bake",
        "small.toml",
        "-q",
        "--at",
        "-2,3",
        "--size",
        "3x2",
        "--export",
        "height,vector",
        "--out",
        "o",
    ]);
    let told = desk.done(&["info", "o", "--json"]).object();
    assert_eq!((&told["state"], &told["tiles"], &told["tiles_of"]), (&"whole".into(), &6.into(), &6.into()));
    assert_eq!(told["exports"], serde_json::json!(["height", "vector"]));
    assert_eq!((&told["at"], &told["missing"]), (&serde_json::json!([-2, 3]), &serde_json::json!([])));
    let runs = told["runs"].as_array().unwrap();
    assert_eq!((&runs[0]["event"], &runs[1]["outcome"]), (&"begun".into(), &"whole".into()));
    fs::remove_file(desk.path("o/vector/vector.gpkg")).unwrap();
    let text = desk.done(&["info", "o"]).stdout;
    assert!(text.contains("missing  vector/vector.gpkg") && text.contains("whole, 6 of 6 tiles"), "{text}");
}
