//! The folder of a bake: one bake at a time, nothing of others' is lost, and what is damaged is found.

use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use terrane::export::Manifest;

use crate::desk::{Desk, files_in};

const BAKE: [&str; 7] = ["bake", "small.toml", "--size", "3x2", "--out", "o", "-q"];

/// Formats of all kinds.
const EXPORTS: [&str; 2] = ["--export", "height,exr,r16-tiles,height-tiles,normal-tiles,blend,map,gltf,hashes,vector"];

fn baked() -> Desk {
    let desk = Desk::new();
    desk.done(&[&BAKE[..], &EXPORTS].concat());
    desk
}

/// What is wrong with a bake, as `verify` says it: a path and a message a line.
fn faults(desk: &Desk, options: &[&str]) -> Vec<String> {
    let outcome = desk.run(&[&["verify", "o", "--json"], options].concat());
    let objects = outcome.objects();
    let faults = objects.iter().filter(|object| object["type"] == "fault");
    let text = |object: &serde_json::Value, key: &str| object[key].as_str().unwrap().to_owned();
    let faults: Vec<String> = faults.map(|it| text(it, "path") + ": " + &text(it, "message")).collect();
    assert_eq!(outcome.code, Some(i32::from(!faults.is_empty())), "{outcome}");
    faults
}

#[test]
fn a_whole_bake_is_found_whole() {
    let desk = baked();
    assert_eq!(faults(&desk, &["--all"]), [""; 0]);
    let told = desk.done(&["verify", "o", "--all", "--json"]).last_object();
    // Two exports have files of tiles that can be compared: 3 x 2 tiles have 7 borders.
    assert_eq!((&told["tiles"], &told["seams"]), (&6.into(), &(3 * 7).into()));
    assert_eq!(told["files"], desk.manifest("o").files.len());
    assert_eq!(desk.done(&["verify", "o", "--files", "--json"]).last_object()["tiles"], 0);
    assert_eq!(desk.done(&["verify", "o", "--sample", "40%", "--json"]).last_object()["tiles"], 3);
}

#[test]
fn every_file_that_is_damaged_is_named() {
    let desk = baked();
    let names = files_in(&desk.path("o"));
    assert!(names.len() > 20);
    for (number, name) in names.iter().enumerate() {
        let whole = fs::read(desk.path("o").join(name)).unwrap();
        let mut bad = whole.clone();
        match number % 3 {
            // A bit, wherever it is.
            0 => {
                let at = (number * 7919) % bad.len();
                bad[at] ^= 1 << (number % 8);
            }
            1 => bad.truncate(whole.len() - 1),
            _ => bad.push(0),
        }
        desk.write(&format!("o/{name}"), &bad);
        let outcome = desk.run(&["verify", "o", "--files", "--json"]);
        assert_eq!(outcome.code, Some(1), "{name}\n{outcome}");
        assert!((outcome.stdout.clone() + &outcome.stderr).contains(name.as_str()), "{name}\n{outcome}");
        desk.write(&format!("o/{name}"), &whole);
    }
    fs::remove_file(desk.path("o/map/map.png")).unwrap();
    assert_eq!(faults(&desk, &["--files"]), ["map/map.png: is missing"]);
    desk.write("o/bake.json", b"\xff");
    assert_eq!(faults(&desk, &["--files"]).len(), 2, "the registry lists the files too");
    fs::remove_file(desk.path("o/registry.sqlite")).unwrap();
    desk.refused(&["verify", "o"], &["bake.json", "cannot be read"]);
}

/// Damages a file of a bake again and again, each time another one in another way: it is found, and repaired.
fn damages(times: usize) {
    let desk = Desk::new();
    let exports = "height,exr,r16-tiles,normal-tiles,blend,map,gltf,obj,hashes,vector,geojson,web";
    desk.done(&["bake", "small.toml", "--size", "2x2", "--out", "o", "-q", "--export", exports]);
    let names: Vec<String> = files_in(&desk.path("o")).into_iter().collect();
    let read = |name: &String| fs::read(desk.path("o").join(name)).unwrap();
    let whole: Vec<Vec<u8>> = names.iter().map(read).collect();
    for time in 0..times {
        // Steps that have no divisor in common with what they are steps of come to all of it.
        let number = time * 7919 % names.len();
        let (name, bytes) = (&names[number], &whole[number]);
        let mut bad = bytes.clone();
        match time % 3 {
            0 => {
                let at = time.wrapping_mul(2_654_435_761) % bad.len();
                bad[at] ^= 1 << (time % 8);
            }
            1 => bad.truncate(time.wrapping_mul(40_503) % bytes.len()),
            // That of another file.
            _ => {
                let mut others = (1..whole.len()).map(|step| &whole[(number + step) % whole.len()]);
                bad.clone_from(others.find(|it| *it != bytes).unwrap());
            }
        }
        desk.write(&format!("o/{name}"), &bad);
        let outcome = desk.run(&["verify", "o", "--files", "--json"]);
        assert_eq!(outcome.code, Some(1), "{time} {name}\n{outcome}");
        assert!(outcome.stdout.contains(name.as_str()), "{time} {name}\n{outcome}");
        desk.done(&["repair", "o"]);
        for (name, whole) in names.iter().zip(&whole) {
            assert!(&read(name) == whole, "{time}: {name} has other bytes");
        }
        // What was there is still there, but for the manifest.
        let kept = desk.path("o").join(format!("{name}.kept-1"));
        assert_eq!(kept.exists(), name != "bake.json", "{time}: {name}");
        if kept.exists() {
            assert!(fs::read(&kept).unwrap() == bad, "{time}: {name} is kept with other bytes");
            fs::remove_file(kept).unwrap();
        }
    }
    assert_eq!(files_in(&desk.path("o")).into_iter().collect::<Vec<_>>(), names);
}

#[test]
fn damage_is_found_and_repaired_whatever_it_is() {
    damages(24);
}

/// `cargo test --profile quick --test suite -- --ignored thousand`
#[test]
#[ignore = "it takes a quarter of an hour"]
fn a_thousand_damages_are_found_and_repaired() {
    damages(1000);
}

#[test]
fn repair_gives_each_file_its_bytes_again() {
    let desk = Desk::new();
    // Options and a profile, for all of these are in the manifest.
    let options =
        ["--profile", "godot-terrain3d", "--export", "gltf,height-tiles,blend,vector", "--lod", "0..1", "--quantize"];
    desk.done(
        &[&["bake", "small.toml", "--set", "tile_cells=64", "--size", "4x4", "--out", "o", "-q"], &options[..]]
            .concat(),
    );
    let names = files_in(&desk.path("o"));
    let read = |name: &String| fs::read(desk.path("o").join(name)).unwrap();
    let whole: Vec<Vec<u8>> = names.iter().map(read).collect();
    assert_eq!(desk.done(&["repair", "o", "--json"]).last_object()["files"], serde_json::json!([]));
    let tile = names.iter().find(|name| name.ends_with("x1_y0.png")).unwrap();
    let mut damaged = vec!["registry.sqlite", "bake.json", tile];
    desk.write("o/registry.sqlite", "not at all");
    desk.write(
        "o/bake.json",
        String::from_utf8(read(&"bake.json".into())).unwrap().replace("from north", "from South"),
    );
    fs::remove_file(desk.path("o").join(tile)).unwrap();
    desk.write("o/notes.txt", "mine");
    let told = desk.done(&["repair", "o", "--json"]).last_object();
    assert_eq!(told["kept"], serde_json::json!(["o/registry.sqlite.kept-1"]));
    fs::remove_file(desk.path("o/registry.sqlite.kept-1")).unwrap();
    let mut repaired: Vec<String> = serde_json::from_value(told["files"].clone()).unwrap();
    repaired.sort();
    damaged.sort_unstable();
    assert_eq!(repaired, damaged);
    for (name, whole) in names.iter().zip(&whole) {
        assert!(&read(name) == whole, "{name}");
    }
    // No more and no less than before.
    fs::remove_file(desk.path("o/notes.txt")).unwrap();
    assert_eq!(files_in(&desk.path("o")), names);
    assert_eq!(faults(&desk, &["--all"]), [""; 0]);
    // A world that this program cannot make is not repaired, nor one of which the manifest says what it was not.
    let text = String::from_utf8(read(&"bake.json".into())).unwrap();
    let other_seed = text.replace("\"seed\": 1,", "\"seed\": 2,");
    // The registry tells what was baked too.
    for damaged in [&other_seed[..], "{", "\u{ff}not at all"] {
        desk.write("o/bake.json", damaged);
        desk.done(&["repair", "o"]);
        assert!(names.iter().zip(&whole).all(|(name, whole)| &read(name) == whole));
    }
    desk.write("o/bake.json", &other_seed);
    desk.write("o/registry.sqlite", "not at all");
    let outcome = desk.run(&["repair", "o"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("bake.json"), "{outcome}");
    assert_eq!(files_in(&desk.path("o")), names);
    let told = ["bake.json", "registry.sqlite"];
    let untouched = |(name, whole): (&String, &Vec<u8>)| told.contains(&&name[..]) || &read(name) == whole;
    assert!(names.iter().zip(&whole).all(untouched));
    let noise = format!("\"noise\": {}", terrane::generator::layers()["noise"]);
    desk.write("o/bake.json", text.replace(&noise, "\"noise\": 999"));
    desk.refused(&["repair", "o"], &["noise"]);
}

#[test]
fn repair_keeps_what_somebody_has_changed() {
    let desk = baked();
    let database = rusqlite::Connection::open(desk.path("o/vector/vector.gpkg")).unwrap();
    database.execute_batch("UPDATE gpkg_contents SET description = 'mine'").unwrap();
    drop(database);
    let changed = fs::read(desk.path("o/vector/vector.gpkg")).unwrap();
    let told = desk.done(&["repair", "o"]);
    assert!(told.stderr.contains("vector.gpkg.kept-1"), "{told}");
    assert!(fs::read(desk.path("o/vector/vector.gpkg.kept-1")).unwrap() == changed);
    assert_eq!(faults(&desk, &["--all"]), [""; 0]);
    // A second one has a name of its own.
    desk.write("o/vector/vector.gpkg", "mine");
    desk.done(&["repair", "o"]);
    assert_eq!(fs::read_to_string(desk.path("o/vector/vector.gpkg.kept-2")).unwrap(), "mine");
}

/// The paths of all numbers in a value, as JSON pointers.
fn numbers(value: &serde_json::Value, path: &str, found: &mut Vec<String>) {
    match value {
        serde_json::Value::Number(_) => found.push(path.to_owned()),
        serde_json::Value::Object(all) => {
            all.iter().for_each(|(key, value)| numbers(value, &format!("{path}/{key}"), found));
        }
        serde_json::Value::Array(all) => {
            (0..).zip(all).for_each(|(number, value)| numbers(value, &format!("{path}/{number}"), found));
        }
        _ => {}
    }
}

/// A manifest with the hash that it has to have.
fn sealed(value: &serde_json::Value) -> Option<String> {
    let text = |manifest: &Manifest| serde_json::to_string_pretty(manifest).unwrap() + "\n";
    let mut manifest: Manifest = serde_json::from_value(value.clone()).ok()?;
    manifest.blake3.clear();
    manifest.blake3 = blake3::hash(text(&manifest).as_bytes()).to_hex().to_string();
    Some(text(&manifest))
}

#[test]
fn no_number_of_a_manifest_is_used_that_no_bake_has() {
    let desk = Desk::new();
    let exports =
        ["--export", "height-tiles,gltf,vector", "--lod", "1", "--contours", "5", "--height-range", "-200,900"];
    let preset = "tile_cells = 16\nsea_level_m = 3.0\nnoise = [{ kind = \"ridged\", height_m = 200.0, wavelength_m = 300.0, octaves = 4 }]\n\
                  warp = { wavelength_m = 900.0, distance_m = 4.0 }\nrivers = { width_m = [1.0, 3.0], bank_m = 3.0 }\n\
                  roads = { width_m = 3.0, step_cells = 4 }\n";
    desk.write("small.toml", preset);
    desk.done(&[&["bake", "small.toml", "--size", "2x1", "--shard", "1/2", "--out", "o", "-q"][..], &exports].concat());
    let folder = desk.path("o");
    let whole: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("bake.json")).unwrap()).unwrap();
    // It would tell what was baked.
    fs::remove_file(folder.join("registry.sqlite")).unwrap();
    let mut pointers = Vec::new();
    numbers(&whole, "", &mut pointers);
    assert!(pointers.len() > 70, "{pointers:?}");
    let least = i64::MIN;
    let others = serde_json::json!([0, -1, 0.5, 1e300, -1e300, least, i64::MAX, u64::MAX, 4_294_967_295_u32]);
    let watch = terrane::watch::Watch::default();
    for pointer in &pointers {
        for other in others.as_array().unwrap() {
            let mut changed = whole.clone();
            *changed.pointer_mut(pointer).unwrap() = other.clone();
            let texts = [Some(serde_json::to_string_pretty(&changed).unwrap()), sealed(&changed)];
            for text in texts.into_iter().flatten() {
                desk.write("o/bake.json", text);
                let read = Manifest::read(&folder);
                // Whatever they find, they find it.
                _ = terrane::export::look(&folder);
                _ = terrane::export::check(&folder, terrane::export::Rebake::Share(1.0), &watch);
                let Ok(manifest) = read else { continue };
                let derived = ["/region", "/stride", "/spacing_m", "/height_range", "/shard", "/sea_level_m"];
                let number = |value: &serde_json::Value| value.pointer(pointer).and_then(serde_json::Value::as_f64);
                let is_same = number(&changed) == number(&whole);
                let is_free = derived.iter().all(|key| !pointer.starts_with(key));
                assert!(is_same || is_free, "{pointer} may be {other}");
                if let Ok(world) = manifest.world() {
                    _ = terrane::export::Plan::of(&manifest, &world).map(|plan| plan.cost(2));
                }
            }
        }
    }
}

#[test]
fn a_manifest_of_no_bake_is_refused_by_all_commands() {
    let desk = baked();
    let mut whole: serde_json::Value = serde_json::from_slice(&fs::read(desk.path("o/bake.json")).unwrap()).unwrap();
    fs::remove_file(desk.path("o/registry.sqlite")).unwrap();
    let commands = [
        &["verify", "o"][..],
        &["repair", "o"],
        &["extend", "o", "--size", "4x4"],
        &["info", "o"],
        &["map", "o"],
        &["merge", "o", "--out", "m"],
        &["bake", "small.toml", "--add", "--out", "o"],
    ];
    let name = whole["preset_name"].take();
    for (name, cells, word) in [
        (name.clone(), 0, "tile_cells"),
        ("x".repeat(3 << 20).into(), 16, "3145728 bytes"),
        ("a\nb".into(), 16, "control character"),
    ] {
        whole["preset_name"] = name;
        whole["region"]["tile_cells"] = cells.into();
        for text in [serde_json::to_string_pretty(&whole).unwrap(), sealed(&whole).unwrap()] {
            desk.write("o/bake.json", text);
            for command in commands {
                let start = Instant::now();
                let told = desk.refused(command, &["bake.json", word]);
                assert!(told.stderr.len() < 2000, "{told}");
                assert!(start.elapsed() < Duration::from_secs(20), "{command:?}");
            }
        }
    }
}

#[test]
fn tiles_that_do_not_meet_and_tiles_of_another_world_are_found() {
    let desk = baked();
    // Files of another world with the hashes that they have: only their edges and the registry can tell.
    let other = Desk::new();
    other.done(&[&BAKE[..], &EXPORTS, &["--seed", "5"]].concat());
    let mut manifest = desk.manifest("o");
    for path in ["height/height_x1_y0.png", "registry.sqlite"] {
        let path = manifest.files.iter().map(|file| file.path.clone()).find(|known| known.ends_with(path)).unwrap();
        let bytes = fs::read(other.path("o").join(&path)).unwrap();
        let record = manifest.files.iter_mut().find(|file| file.path == path).unwrap();
        (record.bytes, record.blake3) = (bytes.len() as u64, blake3::hash(&bytes).to_hex().to_string());
        desk.write(&format!("o/{path}"), bytes);
    }
    desk.write("o/bake.json", serde_json::to_string_pretty(&manifest).unwrap());
    let faults = faults(&desk, &["--all"]);
    let count = |words: &str| faults.iter().filter(|fault| fault.contains(words)).count();
    assert_eq!(count("bake.json: is not as it was written"), 1, "{faults:?}");
    assert!(count("does not meet its neighbour") >= 2, "{faults:?}");
    assert_eq!(count("than is baked now: heights"), 6, "{faults:?}");
}

#[test]
fn what_a_manifest_says_of_other_folders_is_refused() {
    let desk = baked();
    desk.write("victim.txt", "precious");
    let mut manifest = desk.manifest("o");
    manifest.files[0].path = "../victim.txt".into();
    desk.write("o/bake.json", serde_json::to_string_pretty(&manifest).unwrap());
    assert!(faults(&desk, &["--files"]).contains(&"../victim.txt: leads out of the folder, or over a link".into()));
    desk.done(&["clean", "o"]);
    assert_eq!(fs::read_to_string(desk.path("victim.txt")).unwrap(), "precious");
}

#[test]
fn clean_removes_what_terrane_wrote_and_nothing_else() {
    let desk = Desk::new();
    desk.refused(&["clean", "small.toml"], &["bake.json"]);
    desk.refused(&["verify", "."], &["bake.json", "no finished bake"]);
    desk.done(&[&BAKE[..], &["--export", "height,map,web"]].concat());
    desk.write("o/map/notes.txt", "mine");
    desk.write("o/height/height.png", "edited");
    desk.write("o/.terrane-bake/files/height/.height.png.a1b2c3.part", "half");
    let before = files_in(&desk.path("o"));
    let dry = desk.done(&["clean", "o", "--dry-run", "--json"]).object();
    assert_eq!(files_in(&desk.path("o")), before);
    let told = desk.done(&["clean", "o", "--json"]).object();
    assert_eq!((&told["files"], &told["bytes"]), (&dry["files"], &dry["bytes"]));
    assert_eq!(told["kept"], serde_json::json!(["height/height.png"]));
    assert_eq!(files_in(&desk.path("o")), ["height/height.png", "map/notes.txt"].map(String::from).into());
    // Nothing of a bake that nobody has touched stays, nor of one that was cut off.
    desk.done(&["bake", "small.toml", "--out", "p", "-q", "--export", "height,web-png,gltf"]);
    desk.write("p/.terrane.lock", "process 1\n");
    desk.done(&["clean", "p"]);
    assert!(!desk.path("p").exists());
}

#[test]
fn overwrite_touches_only_bakes_and_keeps_what_was_changed() {
    let desk = Desk::new();
    desk.write("mine/notes.txt", "mine");
    let into = |folder| [&BAKE[..4], &["--out", folder, "-q", "--overwrite", "--export", "height,map"]].concat();
    desk.refused(&into("mine"), &["mine", "no bake"]);
    desk.done(&into("o"));
    desk.write("o/map/map.png", "painted over");
    desk.write("o/normal/normal.png", "never terrane's");
    let told = desk.done(&[&into("o")[..], &["--seed", "4"]].concat());
    assert!(told.stderr.contains("map.png.kept-1"), "{told}");
    assert_eq!(fs::read_to_string(desk.path("o/map/map.png.kept-1")).unwrap(), "painted over");
    // It is in nobody's way.
    assert_eq!(fs::read_to_string(desk.path("o/normal/normal.png")).unwrap(), "never terrane's");
    assert_eq!(faults(&desk, &["--all"]), [""; 0]);
    // A link would lead what is written elsewhere.
    #[cfg(unix)]
    {
        fs::remove_dir_all(desk.path("o/height")).unwrap();
        std::os::unix::fs::symlink(desk.path("mine"), desk.path("o/height")).unwrap();
        desk.refused(&into("o"), &["height", "is a link"]);
    }
}

#[test]
fn one_bake_writes_to_a_folder_and_all_others_say_so() {
    let desk = Desk::new();
    let rounds = if crate::is_long() { 50 } else { 3 };
    for round in 0..rounds {
        let folder = format!("o{round}");
        let bake = ["bake", "small.toml", "--size", "64x64", "--out", &folder, "-q", "--threads", "1"];
        let start = || desk.command(&bake).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut running: Vec<_> = (0..8).map(|_| (start(), Instant::now())).collect();
        let mut refused = 0;
        let mut done = 0;
        while let Some((mut bake, since)) = running.pop() {
            match bake.try_wait().unwrap() {
                None => {
                    running.insert(0, (bake, since));
                    thread::sleep(Duration::from_millis(2));
                }
                Some(status) if status.success() => done += 1,
                Some(status) => {
                    let said = std::io::read_to_string(bake.stderr.take().unwrap()).unwrap();
                    assert_eq!(status.code(), Some(2), "{said}");
                    // One that starts when the first has ended finds its bake.
                    assert!(said.contains("another bake is writing") || said.contains("not empty"), "{said}");
                    refused += 1;
                }
            }
        }
        assert_eq!((done, refused), (1, 7));
        assert!(!desk.path(&folder).join(".terrane.lock").exists());
        desk.done(&["verify", &folder, "--files"]);
    }
}
