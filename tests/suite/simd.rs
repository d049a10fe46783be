//! The same bytes from every instruction set that this machine has, and from its GPU, through the whole command.

use std::fs;
use std::process::Command;

use terrane::preset::{BUILT_IN, Preset};
use terrane::simd::Level;

use crate::worlds::{is_tried, lighten_always};

/// What can make a bake: instruction sets of the CPU, the first of them the reference, and the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Backend {
    Cpu(Level),
    Gpu,
}

impl Backend {
    /// All that this machine has.
    fn available() -> Vec<Backend> {
        let mut all: Vec<Backend> = Level::available().into_iter().map(Backend::Cpu).collect();
        let devices = Command::new(env!("CARGO_BIN_EXE_terrane")).args(["devices", "--json"]).output().unwrap();
        match String::from_utf8(devices.stdout).unwrap().contains("\"driver\"") {
            true => all.push(Backend::Gpu),
            false => eprintln!("SKIPPED: no GPU, and no program that does as if it were one"),
        }
        all
    }

    fn name(self) -> &'static str {
        match self {
            Backend::Cpu(level) => level.name(),
            Backend::Gpu => "gpu",
        }
    }

    /// Lets a command compute on it.
    fn is_used_by(self, command: &mut Command) {
        match self {
            Backend::Cpu(level) => command.env(Level::VARIABLE, level.name()),
            Backend::Gpu => command.args(["--device", "gpu"]),
        };
    }
}

#[test]
fn every_backend_bakes_the_same_bytes() {
    let all = Backend::available();
    let folder = tempfile::tempdir().unwrap();
    // Roads have no kernels of their own.
    let presets = BUILT_IN.iter().filter(|(name, _)| is_tried(name));
    for (name, text) in presets {
        let preset = folder.path().join("small.toml");
        fs::write(&preset, small_tiles(text)).unwrap();
        let light = settings(text);
        let listed = |backend: Backend, scale: &str| {
            let out = folder.path().join(format!("{name}-{}-{}", backend.name(), scale.len()));
            let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
            command.args(["bake", preset.to_str().unwrap(), "--at", "-2,1000000000", "--size", "2x2", "--quiet"]);
            // Coarse meshes have normal maps of their own.
            command.args(["--scale", scale, "--lod", "0,1"]);
            // The hashes are those of all parts of a tile, water, beds and lines among them.
            let exports = "height,blend,normal,map,exr,hashes,vector,geojson,gltf";
            let exports = format!("{exports},curvature-geotiff,accumulation-geotiff,scatter,instances,splines");
            command.args(["--export", &exports, "--out", out.to_str().unwrap()]).args(&light);
            backend.is_used_by(&mut command);
            let done = command.output().unwrap();
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            fs::read_to_string(out.join("bake.json")).unwrap()
        };
        for scale in ["1", "1/16"] {
            let reference = listed(all[0], scale);
            for &backend in all[1..].iter().filter(|backend| **backend != Backend::Gpu || is_tried_on_gpu(name, scale))
            {
                let [one, other] = [backend, all[0]].map(Backend::name);
                assert_eq!(listed(backend, scale), reference, "{name} at {scale}: {one} differs from {other}");
            }
        }
    }
}

/// True if a GPU bakes a preset at a scale too: land of noise with agents, and without from afar. Few, since a program
/// that does as if it were a GPU compiles its kernels for seconds each time. The engine's own tests make land of all
/// presets of noise by one.
fn is_tried_on_gpu(preset: &str, scale: &str) -> bool {
    [("thesis", "1"), ("mountains", "1/16")].contains(&(preset, scale))
}

#[test]
fn a_gpu_leaves_land_with_rivers_to_the_cpu_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let (_, text) = BUILT_IN.iter().find(|(name, _)| *name == "plains").unwrap();
    fs::write(folder.path().join("small.toml"), small_tiles(text)).unwrap();
    let bake = |device: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        command.args(["bake", "small.toml", "--size", "1x1", "--export", "hashes", "--scale", "1/16", "--no-progress"]);
        command.args(["--device", device, "--out", device]).args(settings(text)).current_dir(folder.path());
        let done = command.output().unwrap();
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(done.status.success(), "{said}");
        (fs::read_to_string(folder.path().join(device).join("hashes.txt")).unwrap(), said)
    };
    let [(reference, silent), (made, said)] = ["cpu", "gpu"].map(bake);
    assert_eq!(made, reference);
    let reason = "the CPU makes the land: GPUs make land of noise alone, and this has rivers";
    assert_eq!(said.lines().filter(|line| line.contains(reason)).count(), 1, "{said}");
    assert!(!silent.contains(reason), "{silent}");
}

#[test]
fn maps_are_the_same_on_every_backend() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = |backend: Backend| {
        let out = folder.path().join(format!("{}.png", backend.name()));
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        command.args(["map", "mountains", "--around=40,-30,12", "--width", "180", "--out", out.to_str().unwrap()]);
        backend.is_used_by(&mut command);
        let done = command.output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        fs::read(out).unwrap()
    };
    let all = Backend::available();
    let reference = drawn(all[0]);
    for backend in &all[1..] {
        assert!(drawn(*backend) == reference, "{backend:?}");
    }
}

/// The same preset with tiles of 56 cells, a number that no lane count divides evenly into rows, and without places.
fn small_tiles(text: &str) -> String {
    let keep = |line: &&str| !line.trim_start().starts_with("tile_cells");
    let (text, _) = text.split_once("[places]").unwrap_or((text, ""));
    let lines: Vec<&str> = text.lines().filter(keep).collect();
    format!("tile_cells = 56\n{}\n", lines.join("\n"))
}

/// What makes the preset light, as arguments.
fn settings(text: &str) -> Vec<String> {
    let mut preset = Preset::parse("light", text).unwrap();
    // What is planned has no kernels either.
    lighten_always(&mut preset);
    let Some(fluvial) = preset.fluvial else { return Vec::new() };
    let lake = fluvial.lake_m.map(|lake_m| format!("--set=fluvial.lake_m={lake_m}"));
    let levels =
        [format!("--set=fluvial.levels={}", fluvial.levels), format!("--set=fluvial.trunk_m={}", fluvial.trunk_m)];
    levels.into_iter().chain(lake).collect()
}
