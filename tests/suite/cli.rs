//! The command as its users meet it: run in temporary folders, judged by exit code, messages and files.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::desk::{Desk, Outcome, PATIENCE, Running, SMALL, files_in};

const REGION_EXPORTS: &str = "height,exr,r16,blend,normal,map";
const TILE_EXPORTS: &str = "height-tiles,exr-tiles,r16-tiles,blend-tiles,normal-tiles,map-tiles";

/// The small world with some of its lines, counted from 1, replaced; each may become several.
pub fn small_with(replaced: &[(usize, &str)]) -> String {
    let line = |(number, line): (usize, &str)| {
        let new = replaced.iter().find(|(at, _)| *at == number).map_or(line, |(_, new)| new);
        format!("{new}\n")
    };
    (1..).zip(SMALL.lines()).map(line).collect()
}

// ---------------------------------------------------------------------------------------------------------------------
// Bad presets.

#[test]
fn files_that_are_no_preset_are_refused() {
    let desk = Desk::new();
    fs::create_dir(desk.path("folder")).unwrap();
    desk.refused(&["bake", "folder"], &["folder", "is a folder"]);
    desk.write("latin1.toml", [SMALL.as_bytes(), b"# H\xf6he\n"].concat());
    desk.refused(&["bake", "latin1.toml"], &["latin1.toml", "UTF-8", "line 9"]);
    desk.write("empty.toml", "");
    desk.refused(&["bake", "empty.toml"], &["empty.toml:1:1", "noise"]);
    // Two gigabytes that take no room: a file with a hole.
    fs::File::create(desk.path("long.toml")).unwrap().set_len(2 << 30).unwrap();
    desk.refused(&["bake", "long.toml"], &["long.toml", "1 MiB"]);
}

// ---------------------------------------------------------------------------------------------------------------------
// Bad regions, exports, options and folders.

#[test]
fn a_glb_that_may_be_too_long_is_told_of_before() {
    let desk = Desk::new();
    let size = ["--tile-cells", "512", "--size", "16x16"];
    let bake = [&["bake", "thesis", "--export", "gltf-region", "--dry-run"][..], &size].concat();
    let told = desk.run(&bake).stderr;
    assert!(told.contains("warning: the GLB of the region may come to more") && told.contains("--lod"), "{told}");
    // A shard has none, and a coarse one may be small.
    let told = desk.run(&[&bake[..], &["--shard", "1/2"]].concat()).stderr;
    assert!(!told.contains("GLB"), "{told}");
    let told = desk.run(&["bake", "thesis", "--export", "gltf-region", "--dry-run", "--size", "4x4"]).stderr;
    assert!(!told.contains("GLB"), "{told}");
}

#[test]
fn control_characters_are_refused_wherever_they_stand() {
    let desk = Desk::new();
    let out = "o\necho run as code\n#";
    for words in [
        &["shard-plan", "small.toml", "--engine", "slurm", "--shards", "2", "--out", out][..],
        &["bake", "small.toml", "--out", out],
        &["bake", "sm\tall.toml"],
        &["find", "small.toml", "peak\u{1b}[2J"],
        &["verify", "o\u{9b}31m"],
    ] {
        let told = desk.refused(words, &["control character"]);
        assert!(told.stderr.chars().all(|c| c == '\n' || !c.is_control()), "{told}");
    }
}

#[test]
fn what_no_machine_has_room_for_is_refused() {
    let desk = Desk::new();
    for (command, words) in [
        ("bake small.toml --size 100000000x100000000 --export height-tiles", &["EiB", "free", "--size"][..]),
        ("bake small.toml --size 500000000000000x1 --export r16-tiles", &["PiB of memory", "free", "--size"]),
        ("map small.toml --bounds=0,0,1000,1000 --metres-per-pixel 1 --furniture none", &["TiB", "disk"]),
    ] {
        desk.refused(&command.split(' ').collect::<Vec<_>>(), words);
    }
}

#[test]
fn a_region_whose_cost_is_beyond_64_bits_is_refused() {
    // As many of the largest tiles as a region may have: what one row of them would hold in memory overflows u64.
    let desk = Desk::new();
    desk.write("large.toml", small_with(&[(2, "tile_cells = 4096")]));
    desk.refused(&["bake", "large.toml", "--size", "540000000000x1", "--export", "r16,blend-tiles"], &["free"]);
}

#[test]
fn the_widest_region_that_a_png_holds_is_planned() {
    // The other side of the limit.
    let outcome = Desk::new().run(&["bake", "small.toml", "--size", "62499x1", "--export", "height", "--dry-run"]);
    assert!(outcome.stdout.contains("999985 x 17 vertices"), "{outcome}");
    assert!(!outcome.stderr.contains("exports that hold it"), "{outcome}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_region_of_a_billion_squared_tiles_is_refused_in_little_time_and_memory() {
    let desk = Desk::new();
    let mut command = Command::new("sh");
    // 64 MiB of addresses in all, so no more memory either.
    command.args(["-c", "ulimit -v 65536 && exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_terrane")]);
    command.args(["bake", "small.toml", "--size", "1000000000x1000000000"]).current_dir(desk.root());
    let start = Instant::now();
    desk.refuses(&mut command, &["1000000000 x 1000000000"]);
    // Coarse on purpose: a busy machine must not fail the test, a loop over the tiles must.
    assert!(start.elapsed() < Duration::from_secs(10), "took {:?}", start.elapsed());
}

#[test]
fn an_unknown_instruction_set_is_refused() {
    let desk = Desk::new();
    let mut command = desk.command(&["bake", "small.toml", "--size", "1x1"]);
    desk.refuses(command.env("TERRANE_SIMD", "mmx"), &["TERRANE_SIMD", "mmx", "scalar", "sse2", "avx2", "avx512"]);
}

#[test]
fn an_output_path_that_is_a_file_is_refused() {
    let desk = Desk::new();
    desk.refused(&["bake", "small.toml", "--out", "small.toml/below"], &["small.toml/below", "--out"]);
    desk.refused(&["map", "small.toml", "--out", "small.toml/map.png"], &["map.png", "--out"]);
}

#[test]
fn a_folder_that_is_not_empty_is_refused_without_overwrite() {
    let desk = Desk::new();
    desk.write("full/diary.txt", "mine");
    desk.refused(&["bake", "small.toml", "--out", "full"], &["full", "not empty", "--out"]);
    desk.refused(&["bake", "small.toml", "--out", "full", "--dry-run"], &["full", "not empty"]);
    // An empty one is as good as none.
    fs::create_dir(desk.path("empty")).unwrap();
    desk.done(&["bake", "small.toml", "--out", "empty", "--size", "1x1"]);
    assert!(desk.path("empty/bake.json").is_file());
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_to_is_refused() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;
    let desk = Desk::new();
    // Not even the superuser makes a folder here.
    desk.refused(
        &["bake", "small.toml", "--out", "/proc/terrane"],
        &["/proc/terrane", "cannot be written to", "--out"],
    );
    // Permissions do not bind the superuser, so the command runs as nobody, who must be able to reach it.
    let set_mode = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    fs::create_dir(desk.path("locked")).unwrap();
    set_mode(&desk.path("locked"), 0o555);
    let mut command = desk.command(&["bake", "small.toml", "--out", "locked"]);
    if fs::metadata(desk.root()).unwrap().uid() == 0 {
        const NOBODY: u32 = 65534;
        set_mode(desk.root(), 0o755);
        // Another program copies it: a file that we had open to write could not be run while another test forks.
        let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_terrane")).arg(desk.path("terrane")).status();
        assert!(copied.unwrap().success());
        command = Command::new(desk.path("terrane"));
        command.args(["bake", "small.toml", "--out", "locked"]).current_dir(desk.root()).uid(NOBODY);
    }
    desk.refuses(&mut command, &["locked", "cannot be written to", "--out"]);
}

// ---------------------------------------------------------------------------------------------------------------------
// What the command says.

#[test]
fn a_dry_run_says_what_the_bake_will_take_and_writes_nothing() {
    let desk = Desk::new();
    let arguments = ["bake", "small.toml", "--size", "2x2", "--out", "plan", "--json", "--export"];
    let exports = format!("{REGION_EXPORTS},{TILE_EXPORTS},hashes,vector,geojson");
    let arguments = [&arguments[..], &[&exports]].concat();
    let before = desk.everything();
    let text = desk.done(&["bake", "small.toml", "--size", "2x2", "--out", "plan", "--dry-run"]).stdout;
    for (line, word) in [("files", "KiB"), ("memory", "MiB"), ("time", " s "), ("region", "33 x 33")] {
        let found = text.lines().any(|found| found.starts_with(line) && found.contains(word));
        assert!(found, "no line of {line} with {word}:\n{text}");
    }
    let plan = desk.done(&[&arguments[..], &["--dry-run"]].concat()).objects();
    assert_eq!(desk.everything(), before, "a dry run has written something");
    // The bake itself keeps to the plan.
    let done = desk.done(&arguments).objects();
    let (plan, done) = (&plan[0], done.last().unwrap());
    assert_eq!((&plan["type"], &done["type"]), (&"plan".into(), &"done".into()));
    assert_eq!(plan["files"], done["files"]);
    assert_eq!(plan["files"], files_in(&desk.path("plan")).len());
    let size = |file: &String| fs::metadata(desk.path("plan").join(file)).unwrap().len();
    let on_disk: u64 = files_in(&desk.path("plan")).iter().map(size).sum();
    let promised = plan["disk_bytes"].as_u64().unwrap();
    assert!(on_disk <= promised, "{on_disk} bytes on the disk, up to {promised} announced");
    assert!(plan["memory_bytes"].as_u64().unwrap() > 0 && plan["seconds"].as_f64().unwrap() > 0.0, "{plan}");
}

#[cfg(unix)]
#[test]
fn a_folder_whose_name_is_not_utf_8_is_written_to_and_told() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let desk = Desk::new();
    let name = OsStr::from_bytes(b"caf\xe9");
    let told = |arguments: &[&str]| {
        let outcome = Outcome::from(desk.command(arguments).arg("--out").arg(name).output().unwrap());
        assert_eq!(outcome.code, Some(0), "{arguments:?}\n{outcome}");
        assert_eq!(outcome.objects().last().unwrap()["out"], "caf\u{fffd}", "{arguments:?}");
    };
    told(&["bake", "small.toml", "--json", "--dry-run"]);
    told(&["bake", "small.toml", "--json"]);
    assert!(desk.root().join(name).join("bake.json").exists());
    told(&[&SHORT_WALK[..], &["--json", "--overwrite"]].concat());
}

#[test]
fn json_lines_all_parse_and_the_last_says_done() {
    let desk = Desk::new();
    let objects = desk.done(&["bake", "small.toml", "--size", "2x1", "--out", "o", "--json", "-v"]).objects();
    assert!(objects.iter().any(|object| object["type"] == "stage" && object["stage"] == "relief"), "{objects:?}");
    let done = objects.last().unwrap();
    assert_eq!(done["type"], "done");
    assert_eq!(done["out"], "o");
    assert_eq!((done["tiles"].as_u64(), done["vertices"].as_u64()), (Some(2), Some(33 * 17)));
    let bytes: u64 = desk.manifest("o").files.iter().map(|file| file.bytes).sum();
    assert_eq!(done["bytes"].as_u64(), Some(bytes));
    // A refusal is an object too.
    let outcome = desk.refused(&["bake", "small.toml", "--out", "o", "--json"], &["not empty"]);
    let objects = outcome.objects();
    let error = objects.last().unwrap();
    assert_eq!((&error["type"], error["exit_code"].as_u64()), (&"error".into(), Some(2)));
    assert!(error["hint"].as_str().unwrap().contains("--overwrite"), "{error}");
}

#[test]
fn quiet_prints_nothing_and_the_default_says_what_there_is() {
    let desk = Desk::new();
    let quiet = desk.done(&["bake", "small.toml", "--size", "1x1", "--out", "quiet", "-q"]);
    assert_eq!((&quiet.stdout[..], &quiet.stderr[..]), ("", ""));
    assert!(desk.path("quiet/bake.json").is_file());
    let normal = desk.done(&["bake", "small.toml", "--size", "1x1"]);
    assert!(normal.stdout.contains("17 x 17 vertices") && normal.stdout.contains("7 files"), "{normal}");
    // Without --out the folder bears the names of preset, seed, place and size.
    assert!(desk.path("out/small-seed1-x0-y0-1x1/bake.json").is_file());
    let verbose = desk.done(&["bake", "small.toml", "--size", "1x1", "--out", "verbose", "-v"]);
    assert!(verbose.stdout.lines().any(|line| line.contains('%') && line.ends_with("relief")), "{verbose}");
    // Errors are said even then.
    desk.refused(&["bake", "small.toml", "--out", "quiet", "-q"], &["not empty"]);
}

#[test]
fn presets_are_listed_with_their_first_line_and_printed_whole() {
    let desk = Desk::new();
    let listed = desk.done(&["presets"]).stdout;
    let mut count = 0;
    // Every file of the folder is embedded.
    for entry in fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/presets")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let shows = text.lines().next().unwrap().trim_start_matches("# ");
        let line = listed.lines().find(|line| line.split(' ').next() == Some(name));
        assert!(line.is_some_and(|line| line.ends_with(shows)), "{name} is not listed as {shows:?}:\n{listed}");
        assert_eq!(desk.done(&["presets", name]).stdout, text);
        count += 1;
    }
    assert_eq!(listed.lines().count(), count);
    assert!(count >= 5, "there are {count} presets");
}

#[test]
fn the_registry_of_a_bake_is_listed_as_a_table_and_as_objects() {
    let desk = Desk::new();
    let exports = "height,height-tiles,r16-tiles,hashes";
    desk.done(&["bake", "small.toml", "--at", "-2,7", "--size", "3x2", "--out", "o", "--export", exports, "-q"]);
    let table = desk.done(&["registry", "o"]).stdout;
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines.len(), 1 + 6, "{table}");
    assert_eq!((&lines[1][..2], &lines[6][..2]), (&["-2", "7"][..], &["0", "8"][..]), "{table}");
    let objects = desk.done(&["registry", "o", "--json"]).objects();
    let tiles = |key| objects.iter().map(|object| object[key].as_i64().unwrap()).collect::<Vec<_>>();
    assert_eq!((tiles("x"), tiles("y")), (vec![-2, -1, 0, -2, -1, 0], vec![7, 7, 7, 8, 8, 8]));
    let files =
        ["height/height.png", "height/height_x1_y1.png", "height/height_x1_y1.r16", "height/height_x1_y1.r16.json"];
    assert_eq!(objects[4]["files"], Value::from(&files[..]));
    assert!(files.iter().all(|file| desk.path("o").join(file).is_file()));
    let hashes: BTreeSet<_> = objects.iter().map(|object| object["hashes"]["heights"].as_str().unwrap()).collect();
    assert_eq!(hashes.len(), 6, "tiles are not alike");
    assert!(objects.iter().all(|object| object["state"] == "baked" && object["stride"] == 1));
    // Some of it.
    let count = |options: &[&str]| desk.done(&[&["registry", "o", "--json"], options].concat()).objects().len();
    assert_eq!((count(&["--tile", "-1,8"]), count(&["--tile", "5,5"]), count(&["--start", "river"])), (1, 0, 0));
    let manifest = desk.manifest("o");
    assert_eq!(count(&["--files"]), manifest.files.len() - 1, "it cannot list itself");
    assert_eq!((count(&["--files", "--export", "r16-tiles"]), count(&["--files", "--tile", "0,7"])), (12, 3));
    let listed = desk.done(&["registry", "o", "--json", "--files", "--export", "hashes"]).object();
    let record = manifest.files.iter().find(|file| file.path == "hashes.txt").unwrap();
    assert_eq!((&listed["blake3"], &listed["bytes"]), (&record.blake3.clone().into(), &record.bytes.into()));
    // A small world has no rivers.
    assert!(objects.iter().all(|object| object["river"].is_null() && object["record_bytes"].is_null()));
}

#[test]
fn a_folder_without_a_registry_is_refused() {
    let desk = Desk::new();
    desk.refused(&["registry", "small.toml"], &["small.toml", "no tile registry"]);
    desk.write("text/registry.sqlite", "no database");
    desk.refused(&["registry", "text"], &["registry.sqlite", "no tile registry"]);
    desk.write("empty/registry.sqlite", "");
    desk.refused(&["registry", "empty", "--json"], &["registry.sqlite", "no tile registry"]);
}

#[test]
fn a_map_is_written_with_its_world_file_and_how_to_draw_it_again() {
    let desk = Desk::new();
    let options = ["--bounds=-0.2,-0.1,0.3,0.2", "--metres-per-pixel", "2", "--furniture", "none", "--out", "m.png"];
    let drawn = desk.done(&[&["map", "small.toml", "--json"][..], &options].concat()).last_object();
    assert_eq!((&drawn["width"], &drawn["height"]), (&250.into(), &150.into()));
    assert_eq!(fs::read_to_string(desk.path("m.pgw")).unwrap(), "2\n0\n0\n-2\n-199\n199\n");
    // The other file beside it says the same, and on which plane that is.
    let auxiliary = fs::read_to_string(desk.path("m.png.aux.xml")).unwrap();
    for words in ["<GeoTransform>-200, 2, 0, 200, 0, -2</GeoTransform>", "ENGCRS[&quot;terrane small, seed "] {
        assert!(auxiliary.contains(words), "{words}: {auxiliary}");
    }
    let decoder = png::Decoder::new(BufReader::new(fs::File::open(desk.path("m.png")).unwrap()));
    let reader = decoder.read_info().unwrap();
    let texts = &reader.info().utf8_text;
    let recipe = texts.iter().find(|text| text.keyword == "Description").unwrap().get_text().unwrap();
    // What it says draws the same.
    let again: Vec<&str> = recipe.split(' ').skip(1).chain(["--out", "again.png"]).collect();
    desk.done(&again);
    assert_eq!(fs::read(desk.path("m.png")).unwrap(), fs::read(desk.path("again.png")).unwrap());
    // Edges that halve a pixel add none.
    let odd = ["--bounds=-0.1,-0.1,0.1,0.1", "--width", "101", "--furniture", "none", "--out", "odd.png"];
    assert_eq!(desk.done(&[&["map", "small.toml", "--json"][..], &odd].concat()).last_object()["width"], 101);
    desk.refused(&[&["map", "small.toml"][..], &options].concat(), &["m.png", "already", "--overwrite"]);
    desk.done(&[&["map", "small.toml", "--overwrite", "--style", "night"][..], &options].concat());
    assert_ne!(fs::read(desk.path("m.png")).unwrap(), fs::read(desk.path("again.png")).unwrap());
    // A sheet is larger, and its world file says where the paper begins.
    desk.done(&["map", "small.toml", "--bounds=-0.2,-0.1,0.3,0.2", "--metres-per-pixel", "2", "--out", "sheet.webp"]);
    let corner = fs::read_to_string(desk.path("sheet.wpw")).unwrap();
    let west: f64 = corner.lines().nth(4).unwrap().parse().unwrap();
    assert!(west < -250.0, "{corner}");
    let auxiliary = fs::read_to_string(desk.path("sheet.webp.aux.xml")).unwrap();
    assert!(auxiliary.contains(&format!("<GeoTransform>{}, 2, ", west - 1.0)), "{auxiliary}");
}

#[test]
fn a_map_leaves_world_files_of_others_alone() {
    let desk = Desk::new();
    let map = |out| ["map", "small.toml", "--size", "1x1", "--width", "32", "--furniture", "none", "--out", out];
    desk.write("q.pgw", "mine");
    desk.refused(&map("q.png"), &["q.pgw", "already", "--overwrite"]);
    desk.done(&map("q.webp"));
    desk.done(&map("mm.png"));
    let place = fs::read_to_string(desk.path("mm.pgw")).unwrap();
    if desk.path("MM.PNG").exists() {
        println!("SKIPPED: names in capitals, which are the same here");
        return;
    }
    // Readers look for the world file of either in small letters, and then in capitals.
    desk.refused(&map("mm.PNG"), &["mm.png", "capitals"]);
    desk.refused(&[&map("mm.PNG")[..], &["--overwrite"]].concat(), &["mm.png", "capitals"]);
    desk.done(&map("n.PNG"));
    assert_eq!(fs::read_to_string(desk.path("n.PGW")).unwrap(), place);
    assert!(!desk.path("n.pgw").exists());
    desk.done(&[&map("n.PNG")[..], &["--overwrite"]].concat());
}

#[test]
fn a_recipe_has_no_more_digits_than_it_takes() {
    let desk = Desk::new();
    let map =
        ["map", "small.toml", "--around", "0.1,0.2,1.632", "--width", "100", "--furniture", "none", "--out", "m.png"];
    desk.done(&map);
    let decoder = png::Decoder::new(BufReader::new(fs::File::open(desk.path("m.png")).unwrap()));
    let reader = decoder.read_info().unwrap();
    let texts = &reader.info().utf8_text;
    let recipe = texts.iter().find(|text| text.keyword == "Description").unwrap().get_text().unwrap();
    let is_short = |word: &str| word.rsplit(['=', ',']).all(|part| part.len() <= 7 || part.parse::<f64>().is_err());
    assert!(recipe.split(' ').all(is_short), "{recipe}");
    let again: Vec<&str> = recipe.split(' ').skip(1).chain(["--out", "again.png"]).collect();
    desk.done(&again);
    assert_eq!(fs::read(desk.path("m.png")).unwrap(), fs::read(desk.path("again.png")).unwrap());
}

#[test]
fn a_map_of_a_bake_is_that_of_its_world_and_region() {
    let desk = Desk::new();
    desk.done(&["bake", "small.toml", "--size", "2x1", "--at", "-1,3", "--out", "o", "-q"]);
    let options = ["--width", "120", "--furniture", "none", "--out"];
    desk.done(&[&["map", "o"][..], &options, &["bake.webp"]].concat());
    desk.done(&[&["map", "small.toml", "--size", "2x1", "--at", "-1,3"][..], &options, &["world.webp"]].concat());
    assert_eq!(fs::read(desk.path("bake.webp")).unwrap(), fs::read(desk.path("world.webp")).unwrap());
    desk.refused(&["map", "o", "--set", "spacing_m=3"], &["o holds a bake", "--set"]);
    desk.write("empty/a.txt", "");
    desk.refused(&["map", "empty"], &["bake.json", "no finished bake"]);
    let manifest = fs::read_to_string(desk.path("o/bake.json")).unwrap();
    desk.write("o/bake.json", manifest.replace("\"format_version\": 1", "\"format_version\": 99"));
    desk.refused(&["map", "o"], &["the form 99", "newer terrane"]);
    desk.write("o/bake.json", "{}");
    desk.refused(&["map", "o"], &["not the manifest of a bake"]);
}

#[test]
fn documents_and_drawings_hold_lines_and_text() {
    let desk = Desk::new();
    let options = ["--bounds=-0.2,-0.1,0.3,0.2", "--scale", "1:5000", "--title", "A & B"];
    for name in ["a.pdf", "b.pdf", "a.svg", "b.svg"] {
        let map = ["map", "small.toml", "--out", name, "--overlay", "hexes:0.1", "--text", "text"];
        desk.done(&[&map[..], &options].concat());
    }
    let [pdf, svg] = ["pdf", "svg"].map(|ending| {
        let [a, b] = ["a", "b"].map(|name| fs::read(desk.path(&format!("{name}.{ending}"))).unwrap());
        assert!(a == b, "a {ending} is the same whenever it is drawn");
        a
    });
    assert!(pdf.starts_with(b"%PDF-1.7") && pdf.ends_with(b"%%EOF\n"));
    assert!(pdf.windows(9).any(|word| word == b"/ToUnicod") && pdf.windows(13).any(|word| word == b"/CIDFontType0"));
    let svg = String::from_utf8(svg).unwrap();
    for part in [
        "<title>A &amp; B</title>",
        ">A &amp; B</text>",
        ">0101</text>",
        "clip-path=",
        "data:image/png;base64,",
        "</svg>",
    ] {
        assert!(svg.contains(part), "{part}");
    }
}

#[test]
fn an_atlas_has_an_index_sheets_and_a_document() {
    let desk = Desk::new();
    let atlas =
        ["atlas", "small.toml", "--sheets", "2x1", "--paper", "a6", "--scale", "1:2000", "--dpi", "60", "--json"];
    let drawn = desk.done(&[&atlas[..], &["--out", "atlas"]].concat()).last_object();
    let files: Vec<&str> = drawn["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    assert_eq!(files, ["index.png", "A1.png", "A2.png", "atlas.pdf"].map(|name| format!("atlas/{name}")));
    assert!(files.iter().all(|file| desk.path(file).is_file()));
    // A place with a size takes as many sheets as cover it.
    let place = ["atlas", "small.toml", "--bounds=-0.1,-0.04,0.5,0.04", "--furniture", "none", "--format", "png"];
    let drawn = desk.done(&[&place[..], &atlas[4..], &["--out", "place"]].concat()).last_object();
    assert_eq!(drawn["files"].as_array().unwrap().len(), 1 + 3, "{drawn}");
    desk.refused(&[&atlas[..], &["--out", "atlas"]].concat(), &["A1.png", "already", "--overwrite"]);
    desk.done(&[&atlas[..], &["--out", "atlas", "--overwrite", "--format", "pdf"]].concat());
}

#[test]
fn a_bake_can_leave_a_web_map() {
    let desk = Desk::new();
    desk.done(&["bake", "small.toml", "--size", "2x2", "--export", "web", "--out", "o", "-q"]);
    let about = fs::read_to_string(desk.path("o/web/map.js")).unwrap();
    let about = about.strip_prefix("terrane.map(").and_then(|rest| rest.strip_suffix(");\n")).unwrap();
    let about: Value = serde_json::from_str(about).unwrap();
    let zoom = about["ground"]["min_zoom"].as_u64().unwrap();
    // The origin is the corner of four tiles.
    let tile = format!("map/{zoom}/{0}/{0}", 1 << (zoom - 1));
    let webp = format!("{tile}.webp");
    for file in ["index.html", "map.js", "names.js", "map.pmtiles", "map@2x.mbtiles", "terrain.pmtiles", &webp] {
        assert!(desk.path("o/web").join(file).is_file(), "{file}");
    }
    assert!(fs::read(desk.path("o/web/relief.pmtiles")).unwrap().starts_with(b"PMTiles"));
    let listed = desk.manifest("o").files;
    assert!(
        listed.iter().any(|file| file.path == "web/index.html") && listed.iter().any(|file| file.export == "geojson")
    );
    // The same in PNG, in a folder of its own.
    desk.done(&["bake", "small.toml", "--size", "2x2", "--export", "web-png", "--out", "p", "-q"]);
    let opened = |path: &str| BufReader::new(fs::File::open(desk.path(path)).unwrap());
    let mut webp = image_webp::WebPDecoder::new(opened(&format!("o/web/{tile}.webp"))).unwrap();
    let mut pixels = vec![0; webp.output_buffer_size().unwrap()];
    webp.read_image(&mut pixels).unwrap();
    let mut png = png::Decoder::new(opened(&format!("p/web-png/{tile}.png"))).read_info().unwrap();
    let mut others = vec![0; png.output_buffer_size().unwrap()];
    png.next_frame(&mut others).unwrap();
    assert_eq!(others, pixels);
    assert!(desk.manifest("p").files.iter().any(|file| file.export == "web-png" && file.path == "web-png/map.pmtiles"));
}

#[test]
fn web_tiles_lie_where_geojson_in_degrees_lies() {
    let desk = Desk::new();
    desk.done(&[
        "bake",
        "small.toml",
        "--at=-7,11",
        "--size",
        "5x3",
        "--export",
        "web",
        "--degrees",
        "--out",
        "o",
        "-q",
    ]);
    let text = fs::read(desk.path("o/vector/contours.geojson")).unwrap();
    let contours: Value = serde_json::from_slice(&text).unwrap();
    let lines = contours["features"].as_array().unwrap().iter().map(|it| &it["geometry"]["coordinates"]);
    let places: Vec<[f64; 2]> =
        lines.flat_map(|line| serde_json::from_value::<Vec<[f64; 2]>>(line.clone()).unwrap()).collect();
    // The bounds in the header of PMTiles, in steps of a ten-millionth of a degree.
    let archive = fs::read(desk.path("o/web/terrain.pmtiles")).unwrap();
    let edge = |at: usize| f64::from(i32::from_le_bytes(archive[at..at + 4].try_into().unwrap())) / 1e7;
    for (axis, [low, high]) in [[edge(102), edge(110)], [edge(106), edge(114)]].into_iter().enumerate() {
        let (least, most) =
            places.iter().map(|place| place[axis]).fold((90.0_f64, -90.0_f64), |(a, b), at| (a.min(at), b.max(at)));
        assert!(low - 1e-6 < least && most < high + 1e-6, "{least} to {most} in {low} to {high}");
        assert!(most - least > 0.5 * (high - low), "{least} to {most} in {low} to {high}");
    }
    // A tile has 16 m a side, and Web Mercator ends 20,037,508 m east of the origin.
    let edge = ["bake", "small.toml", "--at=1252344,0", "--size", "2x2", "--export", "web", "--out", "p"];
    desk.refused(&edge, &["20038 km east", "one side"]);
    assert!(!desk.path("p").exists());
}

#[test]
fn styles_are_listed_with_their_first_line_and_printed_whole() {
    let desk = Desk::new();
    let listed = desk.done(&["styles"]).stdout;
    assert!(listed.lines().count() == 9 && listed.contains("parchment    Ink on old paper"), "{listed}");
    assert!(desk.done(&["styles", "atlas"]).stdout.contains("extends = \"topographic\""));
    assert!(desk.done(&["schema", "style"]).object()["properties"]["relief"].is_object());
    // What is printed can be written, changed and drawn with.
    desk.write("own.toml", desk.done(&["styles", "atlas"]).stdout.replace("depth_steps = 7", "depth_steps = 3"));
    desk.done(&[
        "map",
        "small.toml",
        "--style",
        "own.toml",
        "--width",
        "64",
        "--furniture",
        "none",
        "--out",
        "own.png",
    ]);
    assert!(desk.path("own.png").is_file());
}

#[test]
fn schemas_describe_what_is_written() {
    let desk = Desk::new();
    desk.done(&["bake", "small.toml", "--size", "1x1", "--out", "o", "-q"]);
    let schema = |of| desk.done(&["schema", of]).object();
    let (bake, preset) = (schema("bake"), schema("preset"));
    assert_eq!(desk.done(&["schema"]).object(), bake, "the manifest's schema is the default");
    let manifest: Value = serde_json::from_slice(&fs::read(desk.path("o/bake.json")).unwrap()).unwrap();
    // A preset may leave out every key: either relief will do.
    assert!(bake["required"].as_array().is_some_and(|required| !required.is_empty()), "{bake}");
    for (schema, written) in [(&bake, &manifest), (&preset, &manifest["preset"])] {
        let mut described: BTreeSet<_> = schema["properties"].as_object().unwrap().keys().collect();
        // What a preset extends is part of it once it is read; and a bake does not say that it is no walk and no shard.
        described.retain(|key| !["extends", "shard", "walk"].contains(&key.as_str()));
        let written: BTreeSet<_> = written.as_object().unwrap().keys().collect();
        assert_eq!(described, written);
    }
    assert!(bake["properties"]["walk"].is_object() && bake["$defs"]["Tour"]["properties"]["layers"].is_object());
    assert!(bake["properties"]["shard"].is_object() && bake["$defs"]["ShardRecord"]["properties"]["of"].is_object());
    // Of each export by name, of those that a profile brings, and of what every bake or every shard has.
    let exports = bake["$defs"]["FileRecord"]["properties"]["export"]["enum"].as_array().unwrap();
    for export in ["height", "obj-tiles", "geojson", "unity", "blender", "registry", "shard"] {
        assert!(exports.contains(&export.into()), "{exports:?}");
    }
}

#[test]
fn a_preset_may_come_from_standard_input_and_options() {
    let desk = Desk::new();
    let bake = |text: &str, options: &[&str]| {
        let mut command =
            desk.command(&[&["bake", "-", "--size", "1x1", "--export", "hashes", "-q"], options].concat());
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        Outcome::from(child.wait_with_output().unwrap())
    };
    let outcome = bake(SMALL, &["--set", "noise[0].octaves=2", "--set", "seed=9", "--json"]);
    assert_eq!(outcome.code, Some(0), "{outcome}");
    let manifest = desk.manifest("out/stdin-seed9-x0-y0-1x1");
    assert_eq!((&manifest.preset_name[..], manifest.seed, manifest.preset.noise[0].octaves), ("stdin", 9, 2));
    let outcome = bake("spacing_m = 0", &[]);
    assert!(outcome.code == Some(2) && outcome.stderr.contains("stdin:1:13: spacing_m: expected"), "{outcome}");
}

#[test]
fn a_warning_is_told_and_stops_nothing() {
    let desk = Desk::new();
    let outcome = desk.done(&["bake", "small.toml", "--size", "1x1", "--set", "sea_level_m=-500", "--json"]);
    assert!(outcome.stderr.starts_with("warning: nothing is as low as the sea"), "{outcome}");
    let warning = &outcome.objects()[0];
    assert_eq!((&warning["type"], warning["message"].as_str().is_some()), (&"warning".into(), true), "{outcome}");
    // A finer spacing of fluvial land is other land.
    let finer = |spacing: &str| {
        desk.done(&["bake", "plains", "--size", "1x1", "--tile-cells", "16", "--dry-run", "--set", spacing]).stderr
    };
    assert!(finer("spacing_m=5").contains("warning: spacing_m = 5 makes other land"), "{}", finer("spacing_m=5"));
    assert!(!finer("spacing_m=10").contains("warning"), "{}", finer("spacing_m=10"));
}

#[test]
fn presets_are_listed_as_objects_too() {
    let objects = Desk::new().done(&["presets", "--json"]).objects();
    let alps = objects.iter().find(|object| object["name"] == "alps").expect("alps is listed");
    assert!(alps["about"].as_str().is_some_and(|about| about.len() > 20), "{alps}");
    assert_eq!(Desk::new().done(&["presets", "alps", "--json"]).object()["about"], alps["about"]);
}

#[test]
fn completions_and_the_manual_know_the_options() {
    let desk = Desk::new();
    for (shell, word) in [("bash", "complete -F"), ("zsh", "#compdef terrane"), ("fish", "complete -c terrane")] {
        let script = desk.done(&["completions", shell]).stdout;
        for word in [word, "overwrite", "dry-run", "presets", "archipelago", "exr-tiles", "unreal"] {
            assert!(script.contains(word), "the script for {shell} lacks {word:?}");
        }
    }
    let fish = desk.done(&["completions", "fish"]).stdout;
    for (command, name) in
        [("bake", "alps"), ("map", "alps"), ("find", "alps"), ("explore", "alps"), ("styles", "night")]
    {
        let names = |line: &&str| line.contains(&format!("_using_subcommand {command}\" -a")) && line.contains(name);
        assert!(fish.lines().any(|line| names(&line)), "fish knows no {name} for {command}\n{fish}");
    }
    let manual = desk.done(&["man"]).stdout;
    for word in [".TH terrane", ".SH", "\\-\\-overwrite", "\\-\\-dry\\-run", "COLSxROWS"] {
        assert!(manual.contains(word), "the manual lacks {word:?}");
    }
}

// ---------------------------------------------------------------------------------------------------------------------
// Streams that close, and interrupts.

#[test]
fn a_closed_standard_output_is_no_panic() {
    let desk = Desk::new();
    desk.done(&["bake", "small.toml", "--size", "2x2", "--export", "hashes", "--out", "listed", "-q"]);
    let commands: [&[&str]; 11] = [
        &["--help"],
        &["bake", "--help"],
        &["presets"],
        &["presets", "thesis"],
        &["schema"],
        &["completions", "zsh"],
        &["man"],
        &["registry", "listed"],
        &["registry", "listed", "--json"],
        &["bake", "small.toml", "--size", "1x1", "--dry-run"],
        &["bake", "small.toml", "--size", "1x1", "--out", "o", "--json", "-v"],
    ];
    for arguments in commands {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = desk.command(arguments).stdout(writer).stderr(Stdio::piped()).output().unwrap();
        let outcome = Outcome::from(output);
        assert_eq!((outcome.code, &outcome.stderr[..]), (Some(0), ""), "{arguments:?}\n{outcome}");
    }
    assert!(desk.path("o/bake.json").is_file(), "the bake goes on without its listener");
}

#[test]
fn a_closed_standard_error_is_no_panic() {
    let desk = Desk::new();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = desk.command(&["bake", "no-such-preset"]).stderr(writer).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let outcome = Outcome::from(Desk::new().command(&["presets"]).stdout(full).output().unwrap());
    assert_eq!(outcome.code, Some(1), "{outcome}");
    assert!(outcome.stderr.contains("standard output"), "{outcome}");
}

/// The small world with so many terms that a region of it takes minutes on one thread of any machine.
fn slow_world() -> String {
    let term = "[[noise]]\nkind = \"fbm\"\nheight_m = 10.0\nwavelength_m = 1000.0\noctaves = 16\nlacunarity = 1.5\n";
    format!("tile_cells = 32\n{}", term.repeat(16))
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_nothing_that_looks_whole() {
    let desk = Desk::new();
    desk.write("slow.toml", slow_world());
    let exports = "height,exr,r16,blend,normal,map,hashes,vector,geojson";
    let mut command = desk.command(&["bake", "slow.toml", "--size", "128x128", "--out", "o", "--threads", "1"]);
    command.args(["--export", exports]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().unwrap());
    // The bake is under way when it has kept something of its first tile.
    let start = Instant::now();
    let begun = || fs::metadata(desk.path("o/.terrane-bake/pieces")).is_ok_and(|pieces| pieces.len() > 0);
    while !begun() {
        assert!(start.elapsed() < PATIENCE, "the bake has not begun: {:?}", desk.everything());
        assert!(running.0.try_wait().unwrap().is_none(), "the bake has ended before it was interrupted");
        thread::sleep(Duration::from_millis(5));
    }
    running.signal("INT");
    let code = running.exit_code();
    let stderr = std::io::read_to_string(running.0.stderr.take().unwrap()).unwrap();
    assert_eq!(code, Some(130), "{stderr}");
    assert!(stderr.contains("interrupted") && stderr.contains("--resume"), "{stderr}");
    let left = files_in(&desk.path("o"));
    let kept = ["pieces", "plan.json", "registry.sqlite"].map(|name| format!(".terrane-bake/{name}"));
    assert_eq!(left, kept.into(), "what can be gone on with, and nothing else, is left");
}

/// Starts a bake that takes long and reads the first line that it writes to the stream that `pick` takes.
#[cfg(unix)]
fn first_line<R: std::io::Read>(desk: &Desk, options: &[&str], pick: impl Fn(&mut Child) -> R) -> (Running, String) {
    desk.write("slow.toml", slow_world());
    // Hashes alone: a long bake that asks for less than a gigabyte of the disk.
    let mut command = desk.command(&["bake", "slow.toml", "--size", "200x200", "--out", "o", "--threads", "1"]);
    command.args(["--export", "hashes"]).args(options).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().unwrap());
    let mut line = String::new();
    BufReader::new(pick(&mut running.0)).read_line(&mut line).unwrap();
    (running, line)
}

#[cfg(unix)]
#[test]
fn progress_is_plain_lines_where_there_is_no_terminal() {
    let desk = Desk::new();
    let (_running, line) = first_line(&desk, &[], |child| child.stderr.take().unwrap());
    let words = ["of 40000 tiles, ", " Mvertices/s", " s left\n"];
    assert!(words.iter().all(|word| line.contains(word)), "{line:?}");
    assert!(line.starts_with(|c: char| c.is_ascii_digit()), "a bar's control characters: {line:?}");
}

#[cfg(unix)]
#[test]
fn progress_is_objects_with_json() {
    let desk = Desk::new();
    let (mut running, line) = first_line(&desk, &["--json"], |child| child.stdout.take().unwrap());
    let progress: Value = serde_json::from_str(&line).unwrap();
    assert_eq!((&progress["type"], &progress["of_tiles"]), (&"progress".into(), &40_000.into()));
    for key in ["percent", "seconds_left", "mvertices_per_second"] {
        assert!(progress[key].as_f64().is_some_and(|number| number > 0.0), "{key} in {line}");
    }
    // The reader has gone: the interrupted command still ends as one.
    running.signal("INT");
    assert_eq!(running.exit_code(), Some(130));
}

/// The progress that a command tells until it tells what is wanted, all of it new each time.
#[cfg(unix)]
fn progress_until(desk: &Desk, arguments: &[&str], is_wanted: impl Fn(&Value) -> bool) -> Value {
    desk.write("slow.toml", slow_world());
    let mut command = desk.command(arguments);
    command.args(["--json", "--threads", "1"]).stdout(Stdio::piped());
    let mut running = Running(command.spawn().unwrap());
    let mut told = Vec::new();
    for line in BufReader::new(running.0.stdout.take().unwrap()).lines() {
        let object: Value = serde_json::from_str(&line.unwrap()).unwrap();
        assert_eq!(object["type"], "progress", "{arguments:?} ended before that: {object}");
        let news = (object["stage"].to_string(), object["done"].as_u64().unwrap());
        assert!(!told.contains(&news), "{object} is told again by {arguments:?}");
        told.push(news);
        if is_wanted(&object) {
            return object;
        }
    }
    panic!("{arguments:?} told only {told:?}");
}

#[cfg(unix)]
#[test]
fn progress_names_what_is_done_and_counts_what_is_made() {
    let desk = Desk::new();
    let is = |stage: &'static str| move |object: &Value| object["stage"] == stage;
    let goes_on =
        |stage: &'static str| move |object: &Value| object["stage"] == stage && object["seconds_left"] != Value::Null;
    // What a map shows is looked for square by square, and what is searched for block by block.
    let map = ["map", "alps", "--around=0,0,15", "--scale", "1:25000", "--out", "map.png"];
    let find = ["find", "alps", "lake > 1000 km2"];
    for (arguments, stage) in [(&map[..], "planning roads"), (&find, "searching")] {
        let told = progress_until(&desk, arguments, is(stage));
        assert!(told["of"].as_u64() > Some(9) && told["percent"].is_number() && told["tiles"].is_null(), "{told}");
    }
    // A map that is long from north to south, and an atlas of many small sheets.
    let map = ["map", "slow.toml", "--bounds=0,-1000,1,0", "--width", "256", "--out", "map.png", "--furniture", "none"];
    let atlas = ["atlas", "slow.toml", "--sheets", "36x25", "--paper", "100x100", "--out", "atlas", "--format", "png"];
    for (arguments, stage, of) in [(&map[..], "drawing", 256_000), (&atlas, "drawing sheets", 900)] {
        let drawing = progress_until(&desk, arguments, goes_on(stage));
        assert_eq!(drawing["of"], of);
        let percent = 100.0 * drawing["done"].as_f64().unwrap() / f64::from(of);
        assert!((drawing["percent"].as_f64().unwrap() - percent).abs() < 1e-6, "{drawing}");
        assert!(drawing["done"] != 0 && drawing["seconds_left"].as_f64() > Some(0.0), "{drawing}");
    }
    // Who waits a moment only is told nothing.
    let short = ["map", "small.toml", "--width", "64", "--out", "short.png"];
    assert_eq!(desk.done(&short).stderr, "");
    // A bake before its first tile and after its last.
    let bake = ["bake", "alps", "--tile-cells", "2048", "--size", "1x1", "--export", "hashes", "--out", "large"];
    let planning = progress_until(&desk, &bake, is("planning roads"));
    assert_eq!((&planning["tiles"], &planning["of_tiles"]), (&0.into(), &1.into()));
    let bake = ["bake", "alps", "--size", "1x1", "--export", "web", "--out", "web"];
    let web = progress_until(&desk, &bake, is("drawing the web map"));
    assert_eq!((&web["tiles"], &web["of_tiles"]), (&1.into(), &1.into()));
    assert!(web["of"].as_u64().is_some_and(|tiles| tiles > 1), "{web}");
}

// ---------------------------------------------------------------------------------------------------------------------
// What a bake leaves.

#[test]
fn the_manifest_names_every_file_with_its_size_and_hash() {
    let desk = Desk::new();
    let exports = format!("{REGION_EXPORTS},{TILE_EXPORTS},hashes,vector,geojson");
    desk.done(&["bake", "small.toml", "--at", "-2,7", "--size", "3x2", "--out", "o", "--export", &exports, "-q"]);
    let manifest = desk.manifest("o");
    // Region: height, exr, two of r16, two of blend, normal, map, as many a tile; beside those of the region but r16 what GIS
    // reads, two beside each PNG and one beside the EXR; then hashes, registry, five of vectors.
    assert_eq!(manifest.files.len(), 8 + 11 + 8 * 6 + 7);
    for file in &manifest.files {
        let content = fs::read(desk.path("o").join(&file.path)).unwrap();
        assert_eq!(file.bytes, content.len() as u64, "{}", file.path);
        assert_eq!(file.blake3, blake3::hash(&content).to_hex().as_str(), "{}", file.path);
        let is_tile = file.export.ends_with("-tiles");
        assert_eq!(file.tile.is_some(), is_tile, "{}", file.path);
        let size = if is_tile { (17, 17) } else { (49, 33) };
        let ending = Path::new(&file.path).extension().and_then(|ending| ending.to_str());
        let is_raster = matches!(ending, Some("png" | "exr" | "r16"));
        assert_eq!(file.width.zip(file.height), is_raster.then_some(size), "{}", file.path);
    }
    let mut named: BTreeSet<_> = manifest.files.iter().map(|file| file.path.clone()).collect();
    assert!(manifest.files.is_sorted_by(|a, b| a.path < b.path));
    named.insert("bake.json".into());
    assert_eq!(named, files_in(&desk.path("o")));
    // Tiles have their true numbers in the manifest and count from the corner in their names.
    let last = manifest.files.iter().find(|file| file.path == "height/height_x2_y1.png").unwrap();
    assert_eq!(last.tile.map(|tile| (tile.x, tile.y)), Some((0, 8)));
    assert_eq!((manifest.region.at.x, manifest.region.at.y), (-2, 7));
    assert_eq!((manifest.region.cols, manifest.region.rows), (3, 2));
    assert_eq!((manifest.region.width, manifest.region.height), (49, 33));
    assert_eq!(manifest.region.origin_m, [-32.0, 112.0]);
    assert_eq!((&manifest.preset_name[..], manifest.seed), ("small", 1));
    // The fields of the type are all that there is in the file.
    let text = fs::read_to_string(desk.path("o/bake.json")).unwrap();
    assert_eq!(serde_json::to_string_pretty(&manifest).unwrap() + "\n", text);
}

#[test]
fn a_tile_alone_has_the_same_bytes_as_in_a_region() {
    let desk = Desk::new();
    let exports = format!("{TILE_EXPORTS},hashes");
    let common = ["--export", &exports, "-q"];
    let region = ["bake", "small.toml", "--at", "-2,-1", "--size", "3x2", "--out", "region", "--threads", "3"];
    desk.done(&[&region[..], &common].concat());
    let whole = desk.manifest("region");
    let hashes = fs::read_to_string(desk.path("region/hashes.txt")).unwrap();
    for (x, y) in [(-2, -1), (-1, 0), (0, -1), (0, 0)] {
        let out = format!("tile_{x}_{y}");
        let tile = ["tile", "small.toml", &x.to_string(), &y.to_string(), "--out", &out, "--threads", "1"];
        desk.done(&[&tile[..], &common].concat());
        let alone = desk.manifest(&out);
        // Eight files, the list of hashes and the registry.
        assert_eq!(alone.files.len(), 10);
        for file in alone.files.iter().filter(|file| file.tile.is_some()) {
            assert_eq!(file.tile.map(|tile| (tile.x, tile.y)), Some((x, y)));
            let in_region = file.path.replace("_x0_y0", &format!("_x{}_y{}", x + 2, y + 1));
            assert!(whole.files.iter().any(|it| it.path == in_region && it.tile == file.tile), "{in_region}");
            let [a, b] = [(&out[..], &file.path), ("region", &in_region)]
                .map(|(folder, path)| fs::read(desk.path(folder).join(path)).unwrap());
            assert!(a == b, "{}/{} differs from region/{in_region}", out, file.path);
        }
        let own = fs::read_to_string(desk.path(&out).join("hashes.txt")).unwrap();
        let line = own.lines().last().unwrap();
        assert!(line.starts_with(&format!("{x} {y} ")), "{line}");
        assert!(hashes.lines().any(|it| it == line), "{line} is not in\n{hashes}");
    }
    // Were all tiles alike, they would agree for the wrong reason.
    let different: BTreeSet<_> = hashes.lines().skip(1).map(|line| line.split(' ').nth(2)).collect();
    assert_eq!(different.len(), 6);
}

#[test]
fn the_seed_is_the_presets_unless_another_is_given() {
    let desk = Desk::new();
    desk.write("seven.toml", small_with(&[(2, "tile_cells = 16\nseed = 7")]));
    for (out, arguments) in
        [("given", &["small.toml", "--seed", "7"][..]), ("written", &["seven.toml"]), ("one", &["small.toml"])]
    {
        desk.done(&[&["bake"], arguments, &["--size", "1x1", "--export", "hashes", "--out", out]].concat());
    }
    let hash = |out| fs::read_to_string(desk.path(out).join("hashes.txt")).unwrap();
    assert_eq!(hash("given"), hash("written"));
    assert_ne!(hash("given"), hash("one"));
    assert_eq!((desk.manifest("given").seed, desk.manifest("one").seed), (7, 1));
}

#[test]
fn overwrite_replaces_the_bake_and_keeps_what_is_not_its_own() {
    let desk = Desk::new();
    let common = ["bake", "small.toml", "--size", "2x1", "--out", "o", "-q"];
    desk.done(&[&common[..], &["--export", "height,height-tiles,map"]].concat());
    let first = fs::read(desk.path("o/height/height.png")).unwrap();
    desk.write("o/notes.txt", "mine");
    desk.write("o/map/sketch.png", "mine too");
    desk.refused(&common, &["--overwrite"]);
    desk.done(&[&common[..], &["--overwrite", "--seed", "2", "--export", "height,normal"]].concat());
    let made =
        ["height/height", "normal/normal"].map(|stem| ["pgw", "png", "png.aux.xml"].map(|it| format!("{stem}.{it}")));
    let made = [made.concat(), vec!["registry.sqlite".into()]].concat();
    let others = ["bake.json", "map/sketch.png", "notes.txt"].map(String::from);
    assert_eq!(files_in(&desk.path("o")), made.iter().cloned().chain(others).collect());
    assert_ne!(fs::read(desk.path("o/height/height.png")).unwrap(), first);
    assert_eq!(fs::read_to_string(desk.path("o/map/sketch.png")).unwrap(), "mine too");
    let listed: Vec<_> = desk.manifest("o").files.into_iter().map(|file| file.path).collect();
    assert_eq!(listed, made);
}

#[test]
fn overwrite_removes_nothing_outside_the_folder_whatever_the_manifest_says() {
    let desk = Desk::new();
    let common = ["bake", "small.toml", "--size", "1x1", "--out", "o", "-q"];
    desk.done(&[&common[..], &["--export", "height,map"]].concat());
    desk.write("victim.txt", "precious");
    let mut manifest = desk.manifest("o");
    let absolute = desk.path("victim.txt").to_str().unwrap().to_owned();
    for path in ["../victim.txt", "height/../../victim.txt", &absolute] {
        let mut record = manifest.files[0].clone();
        record.path = path.to_owned();
        manifest.files.push(record);
    }
    desk.write("o/bake.json", serde_json::to_string(&manifest).unwrap());
    desk.done(&[&common[..], &["--export", "height", "--overwrite"]].concat());
    assert!(desk.path("victim.txt").is_file());
    // The edited manifest was read: what it lists in the folder is gone.
    assert!(!desk.path("o/map/map.png").exists());
}

// ---------------------------------------------------------------------------------------------------------------------
// The experiment.

const SHORT_WALK: [&str; 5] = ["experiment", "--sizes", "16,32", "--minutes", "0.2"];

#[test]
fn an_experiment_leaves_its_tables_and_pictures() {
    let desk = Desk::new();
    let outcome = desk.done(&[&SHORT_WALK[..], &["--threads", "1"]].concat());
    let report = fs::read_to_string(desk.path("out/experiment/report.md")).unwrap();
    for size in ["16x16", "32x32"] {
        for method in ["agents", "no agents", "baseline"] {
            let named = |line: &str| line.contains(size) && line.contains(method);
            assert!(outcome.stdout.lines().any(named), "{size} {method}\n{outcome}");
            assert!(report.lines().any(named), "{size} {method}\n{report}");
        }
    }
    let files = ["chart.svg", "expansions.csv", "report.md", "summary.json", "walk.png"];
    assert_eq!(files_in(&desk.path("out/experiment")), files.map(str::to_owned).into());
    // Every expansion, in all configurations.
    let csv = fs::read_to_string(desk.path("out/experiment/expansions.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let count = |size: &str, method: &str| rows.iter().filter(|row| row[0] == size && row[1] == method).count();
    assert!(count("16", "agents") > 100, "{csv}");
    assert_eq!(count("16", "agents"), count("16", "no agents"));
    assert_eq!(count("16", "agents"), count("16", "baseline"));
    assert!(rows.iter().all(|row| row.len() == 6 && row[5].parse::<f64>().unwrap() > 0.0), "{csv}");
    let summary: Value = serde_json::from_slice(&fs::read(desk.path("out/experiment/summary.json")).unwrap()).unwrap();
    assert_eq!(summary["walks"][1]["methods"][2]["milliseconds"]["n"], count("32", "baseline"));
    let png = png::Decoder::new(BufReader::new(fs::File::open(desk.path("out/experiment/walk.png")).unwrap()));
    assert!(png.read_info().unwrap().info().width > 100);
    // Another one replaces it only when told so.
    let before = desk.everything();
    desk.refused(&SHORT_WALK, &["not empty", "--overwrite"]);
    assert_eq!(desk.everything(), before);
    let told = [&SHORT_WALK[..], &["--overwrite", "--json", "--agents", "on", "--baseline", "off"]].concat();
    let object = desk.done(&told).object();
    assert_eq!(object["report"]["walks"][0]["methods"].as_array().unwrap().len(), 1);
}

#[test]
fn an_experiment_measures_layers_steps_and_threads_side_by_side_and_says_on_what() {
    let desk = Desk::new();
    let varied = ["--agents", "on", "--layers", "1,2", "--step", "all,one", "--threads", "1,2,1"];
    let outcome = desk.done(&[&["experiment", "--sizes", "16", "--minutes", "0.1"], &varied[..]].concat());
    let summary: Value = serde_json::from_slice(&fs::read(desk.path("out/experiment/summary.json")).unwrap()).unwrap();
    let methods = summary["walks"][0]["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 2 * 2 * 2 + 1);
    let of = |layers: u64, step: &str, threads: &Value| {
        let is_it = |method: &&Value| {
            method["method"] == "agents"
                && method["layers"] == layers
                && method["step"] == step
                && &method["threads"] == threads
        };
        methods.iter().find(is_it).unwrap()["milliseconds"]["n"].as_u64().unwrap()
    };
    // The most threads are the report's own.
    assert_eq!(summary["threads"], 2);
    for (layers, step) in [(1, "all"), (1, "one"), (2, "all"), (2, "one")] {
        assert_eq!(of(layers, step, &1.into()), of(layers, step, &Value::Null));
    }
    assert!(of(1, "one", &Value::Null) > 2 * of(1, "all", &Value::Null));
    let report = fs::read_to_string(desk.path("out/experiment/report.md")).unwrap();
    for text in [&report, &outcome.stdout] {
        for name in
            ["agents 1 thread", "agents 2 layers", "agents tile by tile", "agents 2 layers tile by tile 1 thread"]
        {
            assert!(text.lines().any(|line| line.contains(name)), "{name}\n{text}");
        }
    }
    // What it has run on.
    assert!(summary["system"].as_str().unwrap().len() > 2, "{summary}");
    assert!(report.contains(summary["system"].as_str().unwrap()), "{report}");
    if cfg!(target_os = "linux") {
        let bytes = |key: &str| summary[key].as_u64().unwrap();
        assert!(bytes("memory_bytes") > bytes("peak_bytes") && bytes("peak_bytes") > 1 << 20, "{summary}");
        assert!(report.contains(" of memory, ") && report.contains(" of memory in use"), "{report}");
    }
}

#[test]
fn a_bake_at_a_scale_covers_the_same_ground_and_says_so() {
    let desk = Desk::new();
    desk.done(&["bake", "small.toml", "--at=-8,4", "--size", "8x4", "--export", "exr,map", "--out", "whole"]);
    desk.done(&[
        "bake",
        "small.toml",
        "--at=-8,4",
        "--size",
        "8x4",
        "--stride",
        "4",
        "--export",
        "exr,map",
        "--out",
        "part",
    ]);
    let [whole, part] = ["whole", "part"].map(|folder| desk.manifest(folder));
    assert_eq!((whole.stride, part.stride, part.spacing_m), (1, 4, 4.0 * whole.spacing_m));
    assert_eq!(whole.region.bounds_km, part.region.bounds_km);
    assert_eq!(
        [part.region.width, part.region.height].map(|side| 4 * (side - 1) + 1),
        [whole.region.width, whole.region.height]
    );
    // Heights mean the same at every scale.
    assert_eq!((whole.preset, whole.height_range), (part.preset, part.height_range));
}

#[test]
fn regions_are_asked_for_in_kilometres() {
    let desk = Desk::new();
    let plan = |arguments: &[&str]| {
        let all = [&["bake", "small.toml", "--dry-run", "--json"], arguments].concat();
        let line: Value = serde_json::from_str(desk.done(&all).stdout.lines().last().unwrap()).unwrap();
        line["bounds_km"].as_array().unwrap().iter().map(|km| km.as_f64().unwrap()).collect::<Vec<_>>()
    };
    // Tiles are 16 m wide, and the sea of tiles counts rows to the south.
    assert_eq!(plan(&["--bounds=-0.02,0.001,0.03,0.05"]), [-0.032, 0.0, 0.032, 0.064]);
    assert_eq!(plan(&["--around=1,-2,0.032"]), [0.976, -2.016, 1.024, -1.984]);
    assert_eq!(plan(&["--at=-1,2", "--size", "3x1"]), [-0.016, -0.048, 0.032, -0.032]);
}

#[test]
fn what_is_looked_for_is_found_nearest_first() {
    let desk = Desk::new();
    let find = |arguments: &[&str]| {
        let all = [&["find", "alps", "--seed", "5", "--json", "--set", "places.site_m=4000"], arguments].concat();
        // A slow machine tells how far it is before.
        desk.done(&all).objects().into_iter().filter(|object| object["type"] != "progress").collect::<Vec<_>>()
    };
    let found = find(&["--near=30,-20", "--radius", "25km", "--limit", "3", "peak > 2000 m", "river > 2 m3/s"]);
    for (query, unit, least) in [("peak > 2000 m", "m", 2000.0), ("river > 2 m3/s", "m3/s", 2.0)] {
        let own: Vec<&Value> = found.iter().filter(|found| found["query"] == query).collect();
        assert_eq!(own.len(), 3, "{query}: {found:?}");
        let distance = |found: &Value| found["distance_km"].as_f64().unwrap();
        assert!(own.windows(2).all(|pair| distance(pair[0]) <= distance(pair[1])), "{own:?}");
        for one in own {
            assert!(one["values"][unit].as_f64().unwrap() > least && distance(one) <= 25.0, "{one}");
            assert!(one["bake"].as_str().unwrap().starts_with("terrane bake alps --seed 5 "), "{one}");
        }
    }
    // The command is one for a shell, whatever the file is called.
    desk.write("my alps.toml", "extends = \"alps\"\n");
    let found = desk.done(&["find", "my alps.toml", "place", "--limit=1", "--json"]).last_object();
    assert!(found["bake"].as_str().unwrap().starts_with("terrane bake 'my alps.toml' --around="), "{found}");
    desk.refused(&["find", "alps", "peak > high"], &["expected a number"]);
}

#[test]
fn what_is_large_in_a_whole_world_is_found_with_a_bake_of_few_vertices() {
    let desk = Desk::new();
    let texts = ["desert > 10000 km2", "< 9000000 km2", "continent", "biome = Csb", "coast"];
    let found = desk.done(&[&["find", "world", "--near=500,-3000", "--limit=2", "--json"][..], &texts].concat());
    let found: Vec<Value> = found.objects().into_iter().filter(|object| object["type"] != "progress").collect();
    for (query, beginning) in
        [("desert > 10000 km2 < 9000000 km2", "desert:"), ("continent", "continent:"), ("biome = Csb coast", "Csb:")]
    {
        let own: Vec<&Value> = found.iter().filter(|found| found["query"] == query).collect();
        assert_eq!(own.len(), 2, "{query}: {found:?}");
        for one in own {
            assert!(one["id"].as_str().unwrap().starts_with(beginning), "{one}");
            let bake = one["bake"].as_str().unwrap();
            assert!(bake.contains(" --stride ") || query != "continent", "{one}");
            assert!(!bake.contains(" --stride ") || query != "biome = Csb coast", "{one}");
            // The command is a bake that fits the machine.
            let words: Vec<&str> = bake.split(' ').skip(1).chain(["--dry-run"]).collect();
            desk.done(&words);
        }
    }
    let text = desk.done(&["find", "world", "sea > 100000 km2", "--limit=1"]).stdout;
    assert!(text.starts_with("sea > 100000 km2:\n") && text.contains(" km2 ") && text.contains("--stride"), "{text}");
    desk.refused(&["find", "alps", "desert"], &["geography", "world"]);
}

#[test]
fn a_machine_without_a_screen_is_no_reason_to_complain() {
    let desk = Desk::new();
    let devices = desk.command(&["devices"]).env_remove("XDG_RUNTIME_DIR").output().unwrap();
    assert!(devices.status.success());
    assert_eq!(String::from_utf8(devices.stderr).unwrap(), "");
}
