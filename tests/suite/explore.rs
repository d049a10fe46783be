//! The explorer's server, as a browser and as somebody with bad intentions would use it.
#![cfg(all(feature = "explore", unix))]

use std::fs;
use std::io::{BufRead, BufReader, Cursor, Read, Write};
use std::net::TcpStream;
use std::ops::RangeInclusive;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use terrane::area::Area;
use terrane::clock::Clock;
use terrane::map::Chart;
use terrane::map::scale::Scale;
use terrane::map::style::Style;
use terrane::preset::Preset;

use crate::desk::{Desk, PATIENCE, Running};

/// An explorer in a folder of its own.
struct Explorer {
    running: Running,
    folder: TempDir,
    host: String,
}

/// Hundredths of a second of the processor, of half a second, while something is drawn and while nothing is.
const BUSY: RangeInclusive<u64> = 10..=u64::MAX;
const AT_REST: RangeInclusive<u64> = 0..=7;

struct Answer {
    status: u16,
    headers: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&self.body)))
    }
}

/// An order with one key more, or another value.
fn with(order: &Value, key: &str, value: &str) -> Value {
    let mut order = order.clone();
    order[key] = json!(value);
    order
}

impl Explorer {
    fn start(preset: &str, arguments: &[&str]) -> Explorer {
        Explorer::start_in(tempfile::tempdir().unwrap(), preset, arguments)
    }

    fn start_in(folder: TempDir, preset: &str, arguments: &[&str]) -> Explorer {
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        command.args(["explore", preset, "--json", "--cache", "cache", "--threads", "2"]).args(arguments);
        command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut running = Running(command.spawn().unwrap());
        let mut line = String::new();
        BufReader::new(running.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let message: Value = serde_json::from_str(&line).unwrap();
        let url = message["url"].as_str().unwrap();
        let host = url.strip_prefix("http://").unwrap().trim_end_matches('/').to_owned();
        Explorer { running, folder, host }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_mins(2))).unwrap();
        stream
    }

    /// Sends a request as it is, and reads what comes until the server closes.
    fn send(&self, request: &str) -> Answer {
        let mut stream = self.connect();
        stream.write_all(request.as_bytes()).unwrap();
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let headers = String::from_utf8(bytes[..end].to_vec()).unwrap().to_lowercase();
        let status = headers.split(' ').nth(1).unwrap().parse().unwrap();
        Answer { status, headers, body: bytes[end..].to_vec() }
    }

    fn get(&self, path: &str) -> Answer {
        self.send(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.host))
    }

    fn post(&self, path: &str, body: &Value) -> Answer {
        self.with_body("POST", path, "application/json", &body.to_string())
    }

    fn with_body(&self, method: &str, path: &str, kind: &str, body: &str) -> Answer {
        let (host, length) = (&self.host, body.len());
        self.send(&format!(
            "{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n\r\n{body}"
        ))
    }

    /// The identity of the world that it was started with.
    fn world(&self) -> String {
        self.get("/api/start").json()["world"]["id"].as_str().unwrap().to_owned()
    }

    /// Bakes what is ordered; its number, and how it ends.
    fn baked(&self, order: &Value) -> (u64, Value) {
        let number = self.post("/api/bakes", order).json()["bake"].as_u64().unwrap();
        (number, self.ended(number))
    }

    /// How the bake of a number ends.
    fn ended(&self, number: u64) -> Value {
        let since = Instant::now();
        loop {
            let progress = self.get(&format!("/api/bakes/{number}")).json();
            if !["running", "stopping"].contains(&progress["state"].as_str().unwrap()) {
                return progress;
            }
            assert!(since.elapsed() < Duration::from_mins(2), "{progress}");
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Kilobytes of memory at most until now.
    fn peak_kb(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.running.0.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
        line.split_whitespace().next().unwrap().parse().unwrap()
    }

    /// Ticks of the processor until now.
    fn ticks(&self) -> u64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.running.0.id())).unwrap();
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
    }

    /// Waits until it is busy or at rest: until half a second has ticks of the processor within these limits.
    fn until_ticks(&self, limits: RangeInclusive<u64>) {
        let since = Instant::now();
        loop {
            let before = self.ticks();
            thread::sleep(Duration::from_millis(500));
            let spent = self.ticks() - before;
            if limits.contains(&spent) {
                return;
            }
            assert!(since.elapsed() < PATIENCE, "{spent} hundredths of a second in half a second");
        }
    }
}

fn decoded(webp: &[u8]) -> (u32, Vec<u8>) {
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(webp)).unwrap();
    let mut rgb = vec![0; decoder.output_buffer_size().unwrap()];
    decoder.read_image(&mut rgb).unwrap();
    assert_eq!(decoder.dimensions().0, decoder.dimensions().1);
    (decoder.dimensions().0, rgb)
}

#[test]
fn a_tile_is_the_same_part_of_the_map() {
    let explorer = Explorer::start("hills", &["--seed", "5"]);
    let world = explorer.world();
    let (_, preset) = Preset::load("hills").unwrap();
    for (zoom, x, y, is_dense) in [(7, -3, 5, false), (7, 2, -1, false), (2, 7, 7, true)] {
        let mark = if is_dense { "@2x" } else { "" };
        let path = format!("/w/{world}/atlas/full/{zoom}/{x}/{y}{mark}.webp");
        let answer = explorer.get(&path);
        assert_eq!(answer.status, 200, "{path}");
        assert!(answer.headers.contains("content-type: image/webp") && answer.headers.contains("nosniff"));
        let (side, rgb) = decoded(&answer.body);
        let dense = if is_dense { 2.0 } else { 1.0 };
        let metres_per_pixel = preset.spacing_m * f64::from(2_u32.pow(9 - zoom)) / 4.0 / dense;
        let scale = Scale { metres_per_pixel, pixels_per_mm: 96.0 / 25.4 * dense };
        let chart = Chart::new(&preset, Some(5), Style::load("atlas").unwrap(), scale).unwrap();
        let area = Area::new(x * i64::from(side), y * i64::from(side), side as usize, side as usize);
        assert!(
            rgb == chart.picture(area, &Clock::default()).unwrap().pixels(area, &Clock::default()).unwrap(),
            "{path}"
        );
        // It comes from the disk the second time, and is the same.
        assert!(explorer.get(&path).body == answer.body);
        for sketch in ["draft", "glance"] {
            let sketch = explorer.get(&path.replace("full", sketch));
            assert_eq!(decoded(&sketch.body).0, side);
        }
    }
    let heights = explorer.get(&format!("/w/{world}/heights/draft/7/-3/5.js"));
    assert!(
        heights.body.starts_with(b"terrane.heights(\"7/-3/5\",\""),
        "{}",
        String::from_utf8_lossy(&heights.body[..40])
    );
    assert_eq!(explorer.get(&format!("/w/{world}/names/atlas/7/-3/5.json")).json(), json!([]));
    // The coarsest, the finest and the furthest.
    for place in ["0/0/0", "9/-1/-1", "9/70368744177663/-70368744177664"] {
        let answer = explorer.get(&format!("/w/{world}/satellite/draft/{place}.webp"));
        assert_eq!(answer.status, 200, "{place}");
        assert_eq!(decoded(&answer.body).0, 256);
    }
}

#[test]
fn names_that_are_drawn_are_told() {
    let explorer = Explorer::start("alps", &[]);
    let world = explorer.world();
    let names: Vec<Value> = [[0, 0], [1, 0], [0, 1], [1, 1]]
        .iter()
        .flat_map(|[x, y]| {
            let names = explorer.get(&format!("/w/{world}/names/topographic/7/{x}/{y}.json")).json();
            names.as_array().unwrap().clone()
        })
        .collect();
    assert!(!names.is_empty());
    for name in names {
        let [east, north] = [0, 1].map(|axis| name["at"][axis].as_f64().unwrap());
        let side_m = 2.0 * 256.0 * Preset::load("alps").unwrap().1.spacing_m;
        assert!((0.0..=side_m).contains(&east) && (-side_m..=0.0).contains(&north), "{name}");
        assert!(!name["name"].as_str().unwrap().is_empty() && name["kind"].is_string());
    }
}

#[test]
fn what_makes_no_sense_or_comes_from_elsewhere_is_refused() {
    let explorer = Explorer::start("thesis", &[]);
    fs::write(explorer.folder.path().join("secret.toml"), "extends = \"thesis\"\n").unwrap();
    let (world, host) = (explorer.world(), explorer.host.clone());
    let status = |path: &str| explorer.get(path).status;
    for tile in
        ["10/0/0", "9/99999999999999999999/0", "9/0/9223372036854775807", "9/-0/0", "9/a/0", "9/0.5/0", "9/%30/0"]
    {
        assert_eq!(status(&format!("/w/{world}/atlas/draft/{tile}.webp")), 400, "{tile}");
        assert_eq!(status(&format!("/w/{world}/heights/draft/{tile}.js")), 400, "{tile}");
    }
    for nothing in [
        "/secret.toml",
        "/../secret.toml",
        "/..%2fsecret.toml",
        "//etc/passwd",
        "/page/index.html",
        "/w/0123456789abcdef/atlas/draft/7/0/0.webp",
        &format!("/w/{world}/secret/draft/7/0/0.webp"),
        &format!("/w/{world}/secret.toml/draft/7/0/0.webp"),
        "/api/nothing",
        "/api/bakes/1",
        "/bakes/1/map.png",
    ] {
        assert_eq!(status(nothing), 404, "{nothing}");
    }
    for (wanted, request) in [
        // A port of another number that leads here.
        (200, "GET / HTTP/1.1\r\nHost: localhost:9000\r\nOrigin: http://localhost:9000\r\n".to_owned()),
        (403, "GET / HTTP/1.1\r\nHost: localhost:9000\r\nOrigin: http://localhost:9001\r\n".to_owned()),
        (403, "GET / HTTP/1.1\r\nHost: terrane.example\r\n".to_owned()),
        (403, format!("GET / HTTP/1.1\r\nHost: {host}\r\nOrigin: http://terrane.example\r\n")),
        (403, format!("GET / HTTP/1.1\r\nHost: {host}\r\nSec-Fetch-Site: cross-site\r\n")),
        (403, format!("POST /api/worlds HTTP/1.1\r\nHost: {host}\r\nOrigin: null\r\nContent-Length: 0\r\n")),
        (405, format!("PUT / HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n")),
        (415, format!("POST /api/bakes HTTP/1.1\r\nHost: {host}\r\nContent-Type: text/plain\r\nContent-Length: 0\r\n")),
        (415, format!("DELETE /api/bakes/1 HTTP/1.1\r\nHost: {host}\r\n")),
    ] {
        assert_eq!(explorer.send(&format!("{request}Connection: close\r\n\r\n")).status, wanted, "{request}");
    }
    let refused = |path: &str, body: Value| {
        let answer = explorer.post(path, &body);
        (answer.status, answer.json())
    };
    for preset in ["secret.toml", "./secret.toml", "/etc/passwd", "@", "-", "nothing"] {
        assert_eq!(refused("/api/worlds", json!({ "preset": preset })).0, 422, "{preset}");
    }
    let (status, faulty) = refused("/api/worlds", json!({ "preset": "thesis", "set": ["spacing_m=-4"] }));
    assert_eq!(status, 422);
    assert!(
        faulty["error"].as_str().unwrap().contains("spacing_m") && faulty["place"].as_str().unwrap().contains("-4"),
        "{faulty}"
    );
    let (status, _) = refused("/api/worlds", json!({ "preset": "thesis", "set": ["extends=\"secret.toml\""] }));
    assert_eq!(status, 422);
    assert_eq!(refused("/api/worlds", json!({ "preset": 7 })).0, 400);
    assert_eq!(refused("/api/worlds", json!({ "preset": "x".repeat(1 << 17) })).0, 413);
    let order = |at: [i64; 2], size: [u64; 2], exports: &str| json!({ "world": world, "at": at, "size": size, "exports": exports, "quick": true });
    assert_eq!(refused("/api/plan", order([0, 0], [0, 1], "height")).0, 400);
    assert_eq!(refused("/api/plan", order([0, 0], [1, 1], "--out=/tmp/x")).0, 422);
    assert_eq!(refused("/api/save", json!({ "name": "../up", "world": world })).0, 400);
    // It is well after all that.
    assert_eq!(explorer.get(&format!("/w/{world}/atlas/draft/7/0/0.webp")).status, 200);
    let page = explorer.get("/");
    assert!(page.headers.contains("content-security-policy: default-src 'self'") && page.status == 200);
}

#[test]
fn thousands_of_requests_at_once_are_answered_within_its_limits() {
    const AT_ONCE: usize = 500;
    const ROUNDS: usize = 20;
    let explorer = Explorer::start("hills", &[]);
    let world = explorer.world();
    explorer.get(&format!("/w/{world}/atlas/draft/7/0/0.webp"));
    let before_kb = explorer.peak_kb();
    for round in 0..ROUNDS {
        let mut open = Vec::new();
        for number in 0..AT_ONCE {
            let mut stream = explorer.connect();
            let path = match number % 4 {
                0 => format!("/w/{world}/atlas/draft/7/{}/{round}.webp", number % 8),
                1 => format!("/w/{world}/atlas/draft/7/{number}{number}{number}{number}{number}{number}/0.webp"),
                2 => "/api/schema".to_owned(),
                _ => "/nothing".to_owned(),
            };
            let request = format!("GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", explorer.host);
            stream.write_all(request.as_bytes()).unwrap();
            open.push(stream);
        }
        // Every third goes away without waiting.
        for (number, mut stream) in open.into_iter().enumerate().filter(|(number, _)| number % 3 != 0) {
            let mut head = [0; 12];
            stream.read_exact(&mut head).unwrap();
            let status = str::from_utf8(&head[9..]).unwrap();
            let wanted: &[&str] = [&["200", "503"][..], &["400", "200"], &["200"], &["404"]][number % 4];
            assert!(wanted.contains(&status), "{number}: {status}");
        }
    }
    let after_kb = explorer.peak_kb();
    assert!(after_kb < before_kb + 200_000, "{before_kb} kB before, {after_kb} after");
    assert_eq!(explorer.get("/").status, 200);
}

#[test]
fn what_nobody_waits_for_any_more_is_not_drawn() {
    let explorer = Explorer::start("alps", &[]);
    let world = explorer.world();
    let host = &explorer.host;
    // Continents of names, which take minutes.
    let open: Vec<TcpStream> = (0..6)
        .map(|x| {
            let mut stream = explorer.connect();
            let path = format!("/w/{world}/topographic/full/1/{}/0.webp", 2 * x);
            stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes()).unwrap();
            stream
        })
        .collect();
    explorer.until_ticks(BUSY);
    // Meanwhile a draft is drawn as if there were nothing else.
    assert_eq!(explorer.get(&format!("/w/{world}/topographic/draft/7/5/5.webp")).status, 200);
    drop(open);
    explorer.until_ticks(AT_REST);
    assert_eq!(explorer.get(&format!("/w/{world}/topographic/full/7/5/5.webp")).status, 200);
}

#[test]
fn what_is_pointed_at_does_not_wait_for_what_is_drawn() {
    let explorer = Explorer::start("alps", &[]);
    let world = explorer.world();
    let open = |path: String| {
        let mut stream = explorer.connect();
        let request = format!("GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", explorer.host);
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    // Many drafts far from one another for two threads, and full maps beside them.
    let drawn: Vec<TcpStream> = (0..24)
        .flat_map(|x| {
            [("draft", 3), ("full", 1)]
                .map(|(stage, zoom)| format!("/w/{world}/atlas/{stage}/{zoom}/{}/0.webp", 60 * x))
        })
        .map(open)
        .collect();
    explorer.until_ticks(BUSY);
    for stage in ["glance", "draft"] {
        let heights = explorer.get(&format!("/w/{world}/heights/{stage}/6/7/5.js"));
        assert_eq!(heights.status, 200);
        assert!(heights.body.starts_with(b"terrane.heights(\"6/7/5\",\""));
    }
    // The last of the drafts is not there yet.
    let last = &drawn[drawn.len() - 2];
    last.set_nonblocking(true).unwrap();
    assert!(last.peek(&mut [0]).is_err(), "all was drawn before the heights came");
}

#[test]
fn all_worlds_at_all_scales_share_the_memory_that_there_is() {
    const MOST: u64 = 20_000_000;
    let explorer = Explorer::start("archipelago", &["--memory-limit", "20MB"]);
    let memory = || {
        let memory = explorer.get("/api/memory").json();
        [&memory["held_bytes"], &memory["most_bytes"]].map(|bytes| bytes.as_u64().unwrap())
    };
    let mut tiles = Vec::new();
    for seed in 1..=2 {
        let opened = explorer.post("/api/worlds", &json!({ "preset": "archipelago", "seed": seed })).json();
        for zoom in [9, 6, 3] {
            let path = format!("/w/{}/atlas/draft/{zoom}/3/-2.webp", opened["id"].as_str().unwrap());
            tiles.push((path.clone(), explorer.get(&path).body));
            let [held, most] = memory();
            // What is held for a moment more is given back at once.
            assert!(most == MOST && held <= MOST + MOST / 4, "{held} of {most} bytes");
        }
    }
    // More was made than there is room for.
    assert!(memory()[0] > MOST / 2, "{:?}", memory());
    // What was forgotten is made again, and is the same.
    fs::remove_dir_all(explorer.folder.path().join("cache")).unwrap();
    for (path, tile) in &tiles {
        assert!(explorer.get(path).body == *tile, "{path}");
    }
}

#[test]
fn memory_in_which_nothing_has_room_is_refused() {
    Desk::new().refused(&["explore", "hills", "--memory-limit", "1MB"], &["--memory-limit 1000000", "or more"]);
}

#[test]
fn a_preset_that_is_edited_is_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    fs::write(&file, "extends = \"thesis\"\nspacing_m = 0.5\n").unwrap();
    let explorer = Explorer::start_in(folder, "mine.toml", &[]);
    let about = explorer.get("/api/start").json()["world"].clone();
    assert_eq!(
        (&about["preset"], &about["file"], &about["spacing_m"]),
        (&json!("@"), &json!("mine.toml"), &json!(0.5))
    );
    let world = about["id"].as_str().unwrap();
    let mut stream = explorer.connect();
    stream.write_all(format!("GET /w/{world}/watch HTTP/1.1\r\nHost: {}\r\n\r\n", explorer.host).as_bytes()).unwrap();
    let mut lines = BufReader::new(stream).lines().map(Result::unwrap);
    let mut event = |kind: &str| -> Value {
        lines.by_ref().find(|line| *line == format!("event: {kind}")).unwrap();
        let data = lines.by_ref().find(|line| line.starts_with("data: ")).unwrap();
        serde_json::from_str(&data[6..]).unwrap()
    };
    fs::write(&file, "extends = \"thesis\"\nspacing_m = -3\n").unwrap();
    let faulty = event("faulty");
    assert!(faulty["place"].as_str().unwrap().starts_with("mine.toml:2:13"), "{faulty}");
    fs::write(&file, "extends = \"thesis\"\nspacing_m = 2\n").unwrap();
    let changed = event("changed");
    assert_eq!(changed["spacing_m"], 2.0);
    assert_ne!(changed["id"], about["id"]);
    let id = changed["id"].as_str().unwrap();
    assert_eq!(explorer.get(&format!("/w/{id}/plain/draft/6/0/0.webp")).status, 200);
}

#[test]
fn a_rectangle_is_baked_by_the_command_that_is_shown() {
    let explorer = Explorer::start("thesis", &["--set", "tile_cells=64"]);
    let world = explorer
        .post("/api/worlds", &json!({ "preset": "thesis", "seed": 8, "set": ["tile_cells=64", "spacing_m=2"] }));
    let world = world.json()["id"].as_str().unwrap().to_owned();
    let order = json!({ "world": world, "at": [-2, 3], "size": [3, 2], "exports": "height,map" });
    let plan = explorer.post("/api/plan", &order).json();
    let command =
        "terrane bake thesis --seed 8 --set tile_cells=64 --set spacing_m=2 --at=-2,3 --size 3x2 --export height,map";
    assert_eq!(plan["command"], command);
    assert_eq!((&plan["tiles"], &plan["width"], &plan["height"]), (&json!(6), &json!(193), &json!(129)));
    assert!(plan["disk_bytes"].as_u64().unwrap() > 0 && plan["seconds"].is_number());
    assert_eq!(plan["fault"], Value::Null);
    let (number, done) = explorer.baked(&order);
    assert_eq!((&done["state"], &done["out"]), (&json!("done"), &plan["out"]), "{done}");
    let own = explorer.folder.path().join("own");
    let mut by_hand = Command::new(env!("CARGO_BIN_EXE_terrane"));
    by_hand.args(command.split(' ').skip(1)).args(["--quiet", "--out"]).arg(&own);
    assert!(by_hand.status().unwrap().success());
    let out = explorer.folder.path().join(done["out"].as_str().unwrap());
    for file in ["height/height.png", "map/map.png"] {
        let name = |folder: &Path| fs::read(folder.join(file)).unwrap();
        assert!(name(&own) == name(&out), "{file}");
    }
    assert!(explorer.get(&format!("/bakes/{number}/map.png")).body == fs::read(out.join("map/map.png")).unwrap());
    // Once more it is in the way, and says so.
    let (again, failed) = explorer.baked(&order);
    assert_eq!(failed["state"], "failed");
    assert!(failed["error"]["hint"].as_str().unwrap().contains("--overwrite"), "{failed}");
    assert_eq!(explorer.get(&format!("/bakes/{again}/map.png")).status, 409);
    // What it takes is told all the same, and with the option it is replaced.
    let kept = explorer.post("/api/plan", &order).json();
    assert_eq!((&kept["disk_bytes"], &kept["fault"]), (&plan["disk_bytes"], &failed["error"]));
    assert_eq!(explorer.baked(&with(&order, "mode", "overwrite")).1["state"], "done");
    // A profile has files of its own, and others beside them.
    let plain = json!({ "world": world, "at": [-2, 3], "size": [3, 2], "profile": "blender", "quick": true });
    for (order, end) in
        [(plain.clone(), "--profile blender"), (with(&plain, "exports", "map"), "--profile blender --export map")]
    {
        let command = explorer.post("/api/plan", &order).json();
        assert!(command["command"].as_str().unwrap().ends_with(&format!("--size 3x2 {end}")), "{command}");
    }
    assert_eq!(explorer.post("/api/plan", &with(&plain, "profile", "--out=x")).status, 422);
    let saved = explorer.post("/api/save", &json!({ "name": "mine", "world": world }));
    assert_eq!(saved.json()["path"], "mine.toml");
    assert_eq!(explorer.post("/api/save", &json!({ "name": "mine", "world": world })).status, 409);
    let (_, preset) = Preset::load(explorer.folder.path().join("mine.toml").to_str().unwrap()).unwrap();
    assert_eq!((preset.seed, preset.spacing_m, preset.tile_cells), (8, 2.0, 64));
}

#[test]
fn a_bake_that_is_cancelled_can_go_on() {
    let explorer = Explorer::start("thesis", &[]);
    // So large that no machine is done with it before it is told to stop.
    let order = json!({ "world": explorer.world(), "at": [0, 0], "size": [400, 400], "exports": "hashes" });
    for mode in ["new", "resume"] {
        let number = explorer.post("/api/bakes", &with(&order, "mode", mode)).json()["bake"].as_u64().unwrap();
        let path = format!("/api/bakes/{number}");
        let since = Instant::now();
        while explorer.get(&path).json()["done"] == 0 {
            assert!(since.elapsed() < Duration::from_mins(1), "{mode}: {}", explorer.get(&path).json());
            thread::sleep(Duration::from_millis(20));
        }
        let stopping = explorer.with_body("DELETE", &path, "application/json", "").json();
        assert_eq!(stopping["state"], "stopping", "{mode}: {stopping}");
        assert_eq!(explorer.ended(number)["state"], "cancelled");
        let fault = explorer.post("/api/plan", &order).json()["fault"].clone();
        assert!(fault["hint"].as_str().unwrap().contains("--resume"), "{mode}: {fault}");
    }
}

#[test]
fn an_interrupt_ends_it_well() {
    let mut explorer = Explorer::start("alps", &[]);
    let world = explorer.world();
    let mut stream = explorer.connect();
    let request = format!("GET /w/{world}/topographic/full/1/0/0.webp HTTP/1.1\r\nHost: {}\r\n\r\n", explorer.host);
    stream.write_all(request.as_bytes()).unwrap();
    explorer.until_ticks(BUSY);
    let start = Instant::now();
    explorer.running.signal("INT");
    assert_eq!(explorer.running.exit_code(), Some(0));
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}
