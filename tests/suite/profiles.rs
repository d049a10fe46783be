//! Profiles: the files of each are what its engine takes, and IMPORT.md has the numbers that bring the metres back.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;
use std::process::Command;

use exr::prelude::{FlatSamples, read_first_flat_layer_from_file};
use tempfile::TempDir;
use terrane::area::{Region, TileId};
use terrane::export::{Export, Manifest, MeshOptions, Mode, Output, Plan, Profile};
use terrane::preset::{BUILT_IN, Preset};
use terrane::tile::{Material, Tile};
use terrane::watch::Watch;
use terrane::world::World;

use crate::worlds::lighten;

/// A world that bakes in milliseconds and has all materials.
const SMALL: &str = "\
spacing_m = 2.5
sea_level_m = 12.5
tile_cells = 16
noise = [{ kind = \"ridged\", height_m = 200.0, wavelength_m = 300.0, octaves = 4 }]
ground = { sand_m = [2.0, 9.0], snow_m = [90.0, 130.0], scree = [0.4, 0.6], forest_m = [60.0, 110.0] }
";

const AT: TileId = TileId { x: -2, y: 5 };

/// A bake of the small world for an engine.
struct Bake {
    folder: TempDir,
    world: World,
    region: Region,
    manifest: Manifest,
}

impl Bake {
    fn new(profile: Profile, cells: u32, cols: u64, rows: u64) -> Bake {
        Bake::at(AT, profile, cells, cols, rows)
    }

    fn at(at: TileId, profile: Profile, cells: u32, cols: u64, rows: u64) -> Bake {
        let mut preset = Preset::parse("small.toml", SMALL).unwrap();
        preset.tile_cells = cells;
        let world = World::new(preset, None).unwrap();
        let region = Region::new(at, cols, rows, cells).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let meshes = MeshOptions { lods: profile.lods(), origin: profile.origin(&region), ..MeshOptions::default() };
        let plan = Plan::new(&world, "small", region, Vec::new()).unwrap().with_meshes(meshes).unwrap();
        let plan = plan.with_profile(profile).unwrap();
        let cost = plan.cost(1);
        let output = Output::prepare(folder.path(), Mode::New, &plan, &cost).unwrap();
        let manifest = plan.run(&output, &Watch::default()).unwrap();
        assert_eq!(manifest.files.len() as u64 + 1, cost.files, "the plan counts all files");
        drop((output, plan));
        Bake { folder, world, region, manifest }
    }

    /// All files but the registry and the manifest.
    fn files(&self) -> BTreeSet<&str> {
        self.manifest.files.iter().map(|file| &file.path[..]).filter(|path| *path != "registry.sqlite").collect()
    }

    fn read(&self, path: &str) -> Vec<u8> {
        let bytes = fs::read(self.folder.path().join(path)).unwrap();
        let record = self.manifest.files.iter().find(|file| file.path == path).expect("the manifest has every file");
        assert_eq!((record.bytes, &record.blake3[..]), (bytes.len() as u64, &*blake3::hash(&bytes).to_hex()), "{path}");
        bytes
    }

    fn tile(&self, col: i64, row: i64) -> Tile {
        Tile::new(&self.world, TileId { x: AT.x + col, y: AT.y + row })
    }

    /// The tile and the vertex of the world at a place of the region, counted from its north-western vertex.
    fn vertices(&self, width: i64, height: i64) -> Vec<(i64, i64, f32, [u8; Material::ALL.len()])> {
        let cells = i64::from(self.region.tile_cells());
        let tiles: Vec<Vec<Tile>> = (0..self.region.rows() as i64)
            .map(|row| (0..self.region.cols() as i64).map(|col| self.tile(col, row)).collect())
            .collect();
        let mut vertices = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let tile = &tiles[(y / cells).min(tiles.len() as i64 - 1) as usize]
                    [(x / cells).min(tiles[0].len() as i64 - 1) as usize];
                let (at_x, at_y) = (AT.x * cells + x, AT.y * cells + y);
                let weights = Material::ALL.map(|material| tile.blend().weight(material, at_x, at_y));
                vertices.push((x, y, tile.heights().at(at_x, at_y), weights));
            }
        }
        vertices
    }

    /// The value beside a name in a table of IMPORT.md.
    fn typed(&self, name: &str) -> String {
        let notes = String::from_utf8(self.read("IMPORT.md")).unwrap();
        let line = notes.lines().find_map(|line| line.strip_prefix(&format!("| {name} | ")));
        line.unwrap_or_else(|| panic!("IMPORT.md does not say {name}:\n{notes}")).trim_end_matches(" |").to_owned()
    }

    fn number(&self, name: &str) -> f64 {
        let text = self.typed(name);
        text.trim_end_matches(" cm").parse().unwrap_or_else(|_| panic!("{name}: {text}"))
    }

    /// What a height may be off after it has been 16 bits.
    fn half_step_m(&self) -> f64 {
        f64::from(self.manifest.height_range.step_m) * 0.51
    }
}

/// Width, height and the bytes of a PNG.
fn png(path: &Path) -> (i64, i64, png::ColorType, png::BitDepth, Vec<u8>) {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    bytes.truncate(info.buffer_size());
    (info.width.into(), info.height.into(), info.color_type, info.bit_depth, bytes)
}

/// The channels of an EXR by name, each with its samples.
fn exr(path: &Path) -> (i64, i64, Vec<(String, Vec<f32>)>) {
    let image = read_first_flat_layer_from_file(path).unwrap();
    let size = image.layer_data.size;
    let channels = image.layer_data.channel_data.list.into_iter().map(|channel| match channel.sample_data {
        FlatSamples::F32(samples) => (channel.name.to_string(), samples),
        other => panic!("{other:?}"),
    });
    (size.width() as i64, size.height() as i64, channels.collect())
}

/// Unreal reads a tile's place from a mark before a number, wherever it stands in the name.
fn is_safe_for_unreal(path: &str) -> bool {
    let name = Path::new(path).file_stem().unwrap().to_str().unwrap().to_lowercase();
    let stem = name.split("_x").next().unwrap().as_bytes();
    !stem.windows(2).any(|pair| b"xyuv".contains(&pair[0]) && pair[1].is_ascii_digit()) && !name.contains([' ', '-'])
}

#[test]
fn an_unreal_landscape_is_one_of_its_sizes_and_its_numbers_bring_the_metres_back() {
    let bake = Bake::new(Profile::Unreal, 63, 2, 2);
    let maps = Material::ALL.map(|material| format!("unreal/{}.png", material.name()));
    let maps = maps.each_ref().map(String::as_str);
    assert_eq!(bake.files(), ["IMPORT.md", "unreal/height.png"].into_iter().chain(maps).collect());
    assert!(bake.files().into_iter().all(is_safe_for_unreal));
    let (width, height, colour, depth, bytes) = png(&bake.folder.path().join("unreal/height.png"));
    assert_eq!((width, height, colour, depth), (127, 127, png::ColorType::Grayscale, png::BitDepth::Sixteen));
    let weights = maps.map(|map| png(&bake.folder.path().join(map)));
    assert!(
        weights
            .iter()
            .all(|map| (map.0, map.1, map.2, map.3) == (127, 127, png::ColorType::Grayscale, png::BitDepth::Eight))
    );
    let (min_m, max_m) = bake.world.height_range_m();
    let (scale_z, location_z) = (bake.number("Scale Z"), bake.number("Location Z"));
    for ((number, (_, _, height_m, materials)), value) in
        bake.vertices(127, 127).iter().enumerate().zip(bytes.as_chunks().0)
    {
        let value = u16::from_be_bytes(*value);
        assert_eq!(value, ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16);
        let in_engine_m = (f64::from(value) - 32768.0) * scale_z / 12_800.0 + location_z / 100.0;
        assert!((in_engine_m - f64::from(*height_m)).abs() <= bake.half_step_m(), "{in_engine_m} m for {height_m} m");
        assert_eq!(weights.each_ref().map(|map| map.4[number]), *materials);
        assert_eq!(materials.iter().map(|weight| u32::from(*weight)).sum::<u32>(), 255);
    }
    assert_eq!((bake.number("Scale X"), bake.number("Scale Y")), (250.0, 250.0));
    assert_eq!((bake.number("Location X"), bake.number("Location Y")), (-126.0 * 250.0, 315.0 * 250.0));
    assert_eq!(bake.number("Water level (Z)"), 1250.0);
    assert_eq!(bake.typed("Section Size"), "63x63 Quads");
    assert_eq!(bake.typed("Number of Components"), "1 x 1");
}

#[test]
fn tiles_of_an_unreal_landscape_share_nothing() {
    let bake = Bake::new(Profile::UnrealTiled, 32, 2, 2);
    assert_eq!(bake.files().len(), 1 + 4 * (1 + Material::ALL.len()));
    assert!(bake.files().into_iter().all(is_safe_for_unreal));
    assert_eq!(bake.typed("Overall Resolution"), "64 x 64");
    let (min_m, max_m) = bake.world.height_range_m();
    let tiles: Vec<_> = (0..4)
        .map(|tile| png(&bake.folder.path().join(format!("unreal/height_x{}_y{}.png", tile % 2, tile / 2))))
        .collect();
    assert!(tiles.iter().all(|tile| (tile.0, tile.1) == (32, 32)));
    for (x, y, height_m, _) in bake.vertices(64, 64) {
        let (tile, at) = (&tiles[(x / 32 + y / 32 * 2) as usize], (x % 32 + y % 32 * 32) as usize);
        let value = u16::from_be_bytes(tile.4.as_chunks().0[at]);
        assert_eq!(value, ((height_m - min_m) / (max_m - min_m) * 65535.0 + 0.5) as u16, "{x}, {y}");
    }
    let record = bake.manifest.files.iter().find(|file| file.path == "unreal/snow_x1_y0.png").unwrap();
    assert_eq!(record.tile, Some(TileId { x: AT.x + 1, y: AT.y }), "the true number stays in the manifest");
}

#[test]
fn a_unity_terrain_begins_in_the_south_and_shares_its_edges() {
    let bake = Bake::new(Profile::Unity, 32, 2, 3);
    let names = |map: &str, ending: &str| -> Vec<String> {
        (0..6).map(|tile| format!("unity/{map}_{}_{}.{ending}", tile % 2, tile / 2)).collect()
    };
    let expected: Vec<_> =
        [names("height", "raw"), names("splat_ground", "png"), names("splat_cover", "png"), vec!["IMPORT.md".into()]]
            .concat();
    assert_eq!(bake.files(), expected.iter().map(|name| &name[..]).collect());
    let (low_m, size_y) = (bake.number("Position of terrain X_Z: y"), bake.number("Terrain Size Y"));
    for (x, z) in [(0, 0), (1, 0), (0, 2)] {
        let tile = bake.tile(x, 2 - z);
        let raw = bake.read(&format!("unity/height_{x}_{z}.raw"));
        assert_eq!(raw.len(), 33 * 33 * 2);
        for (number, value) in raw.as_chunks().0.iter().enumerate() {
            let (column, row) = (number as i64 % 33, number as i64 / 33);
            let height_m = tile.heights().at(tile.area().x0 + column, tile.area().y1 - 1 - row);
            let in_engine_m = low_m + f64::from(u16::from_le_bytes(*value)) / 65535.0 * size_y;
            assert!((in_engine_m - f64::from(height_m)).abs() <= bake.half_step_m());
        }
        let splat = png(&bake.folder.path().join(format!("unity/splat_ground_{x}_{z}.png")));
        assert_eq!((splat.0, splat.1, splat.2), (32, 32, png::ColorType::Rgba));
        let north_west = [Material::Grass, Material::Dirt, Material::Rock, Material::Sand]
            .map(|material| tile.blend().weight(material, tile.area().x0, tile.area().y0));
        assert_eq!(splat.4[..4], north_west, "pictures have north above");
    }
    let row_bytes = 33 * 2;
    let (south, north) = (bake.read("unity/height_0_0.raw"), bake.read("unity/height_0_1.raw"));
    assert_eq!(south[32 * row_bytes..], north[..row_bytes], "the last row in the south is the first one in the north");
    assert_eq!(bake.number("Terrain Size X"), 80.0);
    assert_eq!(bake.typed("Position of terrain X_Z: x"), "-160 + X * 80");
    assert_eq!(bake.typed("Position of terrain X_Z: z"), "-640 + Z * 80");
    assert!(bake.typed("Start Position (Terrain Toolbox)").starts_with("-160, ") && low_m < 0.0);
    assert_eq!(bake.typed("Byte Order"), "Windows");
    assert_eq!(bake.number("Water level (y)"), 12.5);
}

#[test]
fn terrain3d_gets_metres_and_the_two_strongest_materials() {
    let bake = Bake::new(Profile::GodotTerrain3d, 64, 2, 1);
    let expected =
        ["height.exr", "control.exr", "splat_ground.png", "splat_cover.png"].map(|name| format!("terrain3d/{name}"));
    assert_eq!(bake.files(), expected.iter().map(|name| &name[..]).chain(["IMPORT.md"]).collect());
    let (heights, control) =
        (exr(&bake.folder.path().join("terrain3d/height.exr")), exr(&bake.folder.path().join("terrain3d/control.exr")));
    for (width, height, channels) in [&heights, &control] {
        assert_eq!((*width, *height), (128, 64));
        assert_eq!(channels.iter().map(|(name, _)| &name[..]).collect::<Vec<_>>(), ["B", "G", "R"], "no alpha");
    }
    for (number, (_, _, height_m, weights)) in bake.vertices(128, 64).into_iter().enumerate() {
        assert!(heights.2.iter().all(|(_, samples)| samples[number].to_bits() == height_m.to_bits()));
        let bits = control.2[2].1[number].to_bits();
        let (base, overlay, blend) = (bits >> 27, bits >> 22 & 31, bits >> 14 & 255);
        assert_eq!(bits & 0x3fff, 0, "no hole, and not the autoshader");
        let [base, overlay] = [base, overlay].map(|texture| f64::from(weights[texture as usize]));
        let mut sorted = weights.map(f64::from);
        sorted.sort_by(|a, b| b.total_cmp(a));
        assert_eq!([base, overlay], [sorted[0], sorted[1]]);
        assert!((f64::from(blend) - overlay / (base + overlay) * 255.0).abs() <= 0.5);
    }
    assert_eq!(bake.number("Vertex Spacing"), 2.5);
    assert_eq!(bake.typed("Import Position"), "-128, 320");
    assert_eq!(bake.number("Region Size"), 64.0);
}

#[test]
fn hterrain_gets_a_square_over_whole_metres() {
    let bake = Bake::new(Profile::Hterrain, 16, 4, 4);
    assert_eq!(bake.files(), ["IMPORT.md", "hterrain/height.raw", "hterrain/splat.png", "hterrain/splat_1.png"].into());
    let (low, high) = (bake.number("Min Height"), bake.number("Max Height"));
    assert_eq!((low.fract(), high.fract()), (0.0, 0.0));
    let raw = bake.read("hterrain/height.raw");
    assert_eq!(raw.len(), 65 * 65 * 2);
    for ((_, _, height_m, _), value) in bake.vertices(65, 65).into_iter().zip(raw.as_chunks().0) {
        let in_engine_m = low + f64::from(u16::from_le_bytes(*value)) / 65535.0 * (high - low);
        assert!((in_engine_m - f64::from(height_m)).abs() <= (high - low) / 65535.0 * 0.51);
    }
    assert_eq!(bake.typed("Map Scale"), "x 2.5, y 1, z 2.5");
    let splat = png(&bake.folder.path().join("hterrain/splat.png"));
    assert_eq!((splat.0, splat.1, splat.2), (65, 65, png::ColorType::Rgba));
}

#[test]
fn blender_gets_meshes_and_a_script() {
    let bake = Bake::new(Profile::Blender, 16, 2, 1);
    let expected = [
        "IMPORT.md",
        "height/height.pgw",
        "height/height.png",
        "height/height.png.aux.xml",
        "import_terrane.py",
        "mesh/region_lod1.gltf",
        "mesh/tile_lod1_x0_y0.glb",
        "mesh/tile_lod1_x1_y0.glb",
    ];
    assert_eq!(bake.files(), expected.into());
    assert_eq!(
        bake.read("import_terrane.py"),
        include_bytes!("../../crates/output/src/export/formats/profile/import_terrane.py")
    );
    // The numbers that bring the heights of a displaced plane back, at the vertex that a texel is.
    let (strength, middle) = (bake.number("Strength"), bake.number("Midlevel"));
    let (width, height, colour, depth, bytes) = png(&bake.folder.path().join("height/height.png"));
    assert_eq!((width, height, colour, depth), (33, 17, png::ColorType::Grayscale, png::BitDepth::Sixteen));
    assert_eq!((bake.number("X Subdivisions"), bake.number("Y Subdivisions")), (32.0, 16.0));
    for ((_, _, height_m, _), value) in bake.vertices(33, 17).into_iter().zip(bytes.as_chunks().0) {
        let displaced_m = (f64::from(u16::from_be_bytes(*value)) / 65535.0 - middle) * strength;
        assert!((displaced_m - f64::from(height_m)).abs() <= bake.half_step_m(), "{displaced_m} m for {height_m} m");
    }
    let (scale, texels) = (bake.number("Scale X"), 33.0);
    assert!((scale - (texels - 1.0) / texels).abs() < 1e-8, "UV * (N - 1) / N, about the middle");
    // Twelve sides, and a ten-thousandth of one.
    assert_eq!(bake.typed("Camera, *Lens*, *Clip Start* and *End*"), "0.1 m and 960 m");
    let [east_m, south_m] = bake.manifest.region.mesh_origin_m;
    assert_eq!(bake.typed("origin in the world, X (east)"), format!("{east_m} m"));
    assert_eq!(bake.typed("origin in the world, Y (north)"), format!("{} m", 0.0 - south_m));
}

/// The numbers of a text, in their order.
fn numbers(text: &str) -> Vec<f64> {
    text.split(|letter: char| !letter.is_ascii_digit() && letter != '-' && letter != '.')
        .filter_map(|word| word.parse().ok())
        .collect()
}

#[test]
fn neighbours_lie_side_by_side_where_they_are_told_to() {
    // What places a bake, which of its numbers count to the east and to the south, and what a vertex is there.
    let places = [
        (Profile::Unreal, 63, ["Location X", "Location Y"], [0, 0], [250.0, 250.0]),
        (Profile::UnrealTiled, 32, ["Location X", "Location Y"], [0, 0], [250.0, 250.0]),
        (Profile::Unity, 32, ["Position of terrain X_Z: x", "Position of terrain X_Z: z"], [0, 0], [2.5, -2.5]),
        (Profile::GodotTerrain3d, 64, ["Import Position", "Import Position"], [0, 1], [1.0, 1.0]),
        (Profile::Hterrain, 32, ["Position", "Position"], [0, 2], [2.5, 2.5]),
    ];
    for (profile, cells, names, which, vertex) in places {
        let at = |x, y| Bake::at(TileId { x, y }, profile, cells, 2, 2);
        let place = |bake: &Bake| [0, 1].map(|axis| numbers(&bake.typed(names[axis]))[which[axis]]);
        let heights = |bake: &Bake| {
            let names =
                ["Scale Z", "Location Z", "Terrain Size Y", "Position of terrain X_Z: y", "Min Height", "Max Height"];
            let notes = String::from_utf8(bake.read("IMPORT.md")).unwrap();
            names.map(|name| notes.lines().find(|line| line.starts_with(&format!("| {name} |"))).map(str::to_owned))
        };
        let [first, east, south] = [at(28, 9), at(30, 9), at(28, 11)];
        let side = f64::from(2 * cells);
        let [x, y] = place(&first);
        assert_eq!(place(&east), [x + side * vertex[0], y], "{profile:?}");
        assert_eq!(place(&south), [x, y + side * vertex[1]], "{profile:?}");
        assert_eq!((heights(&east), heights(&south)), (heights(&first), heights(&first)), "{profile:?}");
    }
}

#[test]
fn a_place_that_is_too_far_for_an_engine_says_what_to_do() {
    let near = String::from_utf8(Bake::at(TileId { x: 3, y: 3 }, Profile::Unity, 32, 1, 1).read("IMPORT.md")).unwrap();
    assert!(near.contains("Beside other bakes") && near.contains("`--mesh-origin 0,0`"), "{near}");
    assert!(!near.contains("tremble"), "{near}");
    let far = String::from_utf8(Bake::at(TileId { x: 300, y: 3 }, Profile::Unity, 32, 1, 1).read("IMPORT.md")).unwrap();
    assert!(far.contains("reaches 24 km from there") && far.contains("`--mesh-origin 24040,-280`"), "{far}");
}

#[test]
fn a_terrain_of_terrain3d_refuses_an_origin_that_has_no_room() {
    let desk = tempfile::tempdir().unwrap();
    let bake = |origin: &str| {
        let place = "--at 28,9 --size 2x1 --tile-cells 64 --profile godot-terrain3d --out there --overwrite --quiet";
        terrane(desk.path(), &format!("bake hills {place} {origin}"))
    };
    for origin in ["--mesh-origin 0,0", "--mesh-origin 8004,0"] {
        let (code, said) = bake(origin);
        assert_eq!(code, 2, "{said}");
        assert!(
            said.contains("16 regions to each side") && said.contains("--mesh-origin 8192,0, and the same"),
            "{said}"
        );
        assert!(!desk.path().join("there").exists());
    }
    assert_eq!(bake("--mesh-origin=8192,0").0, 0);
    assert_eq!(bake("").0, 0);
}

/// Heights are proved in 32 bits, where whole metres come out beside themselves.
#[test]
fn no_number_that_people_type_has_the_noise_of_32_bits() {
    let desk = tempfile::tempdir().unwrap();
    for profile in Profile::ALL.map(Profile::name) {
        let cells = if profile == "unreal" { 126 } else { 64 };
        let cells = if profile == "unreal-tiled" { 128 } else { cells };
        let bake = format!("bake hills --size 1x1 --tile-cells {cells} --profile {profile} --out {profile} --quiet");
        let (code, said) = terrane(desk.path(), &bake);
        assert_eq!(code, 0, "{said}");
        let notes = fs::read_to_string(desk.path().join(profile).join("IMPORT.md")).unwrap();
        let (_, said) = terrane(desk.path(), &format!("info {profile}"));
        for line in notes.lines().chain(said.lines().filter(|line| line.starts_with("heights"))) {
            for number in line.split(|letter: char| !letter.is_ascii_digit() && letter != '.') {
                let decimals = number.split_once('.').map_or("", |(_, decimals)| decimals.trim_end_matches('.'));
                assert!(!decimals.contains("0000") && !decimals.contains("9999"), "{profile}: {line}");
            }
        }
    }
}

#[test]
fn the_default_bake_of_every_preset_works_for_every_profile() {
    for (preset, _) in BUILT_IN {
        for profile in Profile::ALL.map(Profile::name) {
            let ask = format!("bake {preset} --profile {profile}");
            let preset = Preset::load(preset).unwrap().1;
            let world = World::new(preset, None).unwrap();
            let region = Region::new(TileId { x: 0, y: 0 }, 8, 8, world.tile_cells()).unwrap();
            let fitted = profile.parse::<Profile>().unwrap().fitted(&world, &region).unwrap();
            assert_eq!(fitted.is_some(), profile.starts_with("unreal"), "{ask}: the preset's own tiles where they fit");
            let (region, _) = fitted.unwrap_or((region, String::new()));
            let mut preset = world.preset().clone();
            preset.tile_cells = region.tile_cells();
            let world = World::new(preset, None).unwrap();
            let plan = Plan::new(&world, "default", region, Vec::new()).unwrap();
            plan.with_profile(profile.parse().unwrap()).unwrap_or_else(|error| panic!("{ask}: {error}"));
            let side_m = |cells: u64| cells as f64 * world.spacing_m();
            let off = side_m(region.width() - 1) / side_m(2048);
            assert!((0.9..1.1).contains(&off) && region.cols() == region.rows(), "{ask}: {off} of what is asked for");
        }
    }
}

#[test]
fn who_asks_for_no_size_gets_one_that_fits_and_is_told() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("small.toml"), SMALL).unwrap();
    for (profile, options, added, vertices) in [
        ("unreal", "", "--tile-cells 18 --size 7x7", "127 x 127"),
        ("unreal", "--at -70,9", "--tile-cells 18 --size 7x7 --at -62,8", "127 x 127"),
        ("unreal", "--seed 7 --set sea_level_m=3", "--tile-cells 18 --size 7x7", "127 x 127"),
        ("unity", "", "--tile-cells 32 --size 4x4", "129 x 129"),
        ("godot-terrain3d", "", "--tile-cells 64 --size 2x2", "129 x 129"),
    ] {
        let ask = format!("bake small.toml --profile {profile} --out out --overwrite --no-progress {options}");
        let (code, said) = terrane(desk.path(), ask.trim_end());
        assert_eq!(code, 0, "{ask}\n{said}");
        assert!(said.contains(&format!("added: {added}\n")) && said.contains(vertices), "{ask}\n{said}");
        // The same as who has typed it.
        let text = |out: &str| fs::read_to_string(desk.path().join(out).join("bake.json")).unwrap();
        let place = if added.contains("--at") { "" } else { options };
        let (code, said) = terrane(
            desk.path(),
            &format!("bake small.toml --profile {profile} --out typed --overwrite --quiet {added} {place}")
                .trim_end()
                .replace("  ", " "),
        );
        assert_eq!((code, &said[..]), (0, ""), "{ask}");
        assert_eq!(text("out"), text("typed"), "{ask}");
        // More of the same bake, with its profile or without a word of it.
        let (code, said) = terrane(
            desk.path(),
            format!("bake small.toml --out out --add --export hashes --quiet {options}").trim_end(),
        );
        assert_eq!(code, 0, "{ask}\n{said}");
    }
    for options in [
        "--size 8x8",
        "--tile-cells 16",
        "--set tile_cells=16",
        "--bounds=0,0,0.3,0.3",
        "--around=0,0,0.3",
        "--scale 1/2",
    ] {
        let (code, said) = terrane(desk.path(), &format!("bake small.toml --profile unreal --out none {options}"));
        assert!(code == 2 && said.contains("hint: the nearest that fits: "), "{options}\n{said}");
    }
    let (code, said) = terrane(desk.path(), "bake small.toml --profile unreal --out other --json --quiet");
    assert_eq!((code, &said[..]), (0, ""), "quiet is quiet");
}

/// The editor of Unreal clamps a landscape at 32 components a side.
#[test]
fn no_landscape_has_more_components_than_the_editor_takes() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("small.toml"), SMALL).unwrap();
    // 1023 quads are 33 components of 31, and of no larger ones.
    let ask = "bake small.toml --out out --dry-run --profile unreal-tiled --tile-cells 256 --size 4x4";
    let (code, said) = terrane(desk.path(), ask);
    assert!(code == 2 && said.contains("at most 32 each way"), "{said}");
    let ask = "bake small.toml --out out --dry-run --profile unreal-tiled --tile-cells 4081 --size 1x1";
    let (code, said) = terrane(desk.path(), ask);
    assert_eq!(code, 0, "4080 = 16 x 255\n{said}");
}

/// Runs the command in a folder and gives exit code, and what it said.
fn terrane(folder: &Path, arguments: &str) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_terrane"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap(), String::from_utf8(said).unwrap())
}

#[test]
fn what_a_refusal_names_is_taken() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("small.toml"), SMALL).unwrap();
    let refused = [
        ("unreal", "--size 8x8"),
        ("unreal", "--size 3x70 --at -7,5 --tile-cells 48"),
        ("unreal", "--size 900x900"),
        ("unreal-tiled", "--size 8x8 --tile-cells 256"),
        ("unreal-tiled", "--size 3x5"),
        ("unity", "--size 3x2"),
        ("unity", "--size 1x1 --tile-cells 500 --at 100,100"),
        ("godot-terrain3d", "--size 40x2 --tile-cells 64"),
        ("godot-terrain3d", "--size 16x16"),
        ("hterrain", "--size 3x4 --tile-cells 64"),
        ("hterrain", "--size 9x9 --tile-cells 1000"),
    ];
    for (profile, options) in refused {
        let ask = format!("bake small.toml --out out --dry-run --profile {profile} {options}");
        let (code, said) = terrane(desk.path(), &ask);
        assert_eq!(code, 2, "{ask}\n{said}");
        let (_, named) = said.split_once("hint: the nearest that fits: ").unwrap_or_else(|| panic!("{ask}\n{said}"));
        // The options that it names replace those of the same name.
        let named: Vec<&str> = named.trim().split(' ').collect();
        let mut followed = format!("bake small.toml --out out --dry-run --profile {profile} {}", named.join(" "));
        for pair in options.split(' ').collect::<Vec<_>>().chunks(2).filter(|pair| !named.contains(&pair[0])) {
            followed = format!("{followed} {}", pair.join(" "));
        }
        let (code, said) = terrane(desk.path(), &followed);
        assert_eq!(code, 0, "{followed}\n{said}");
    }
    assert!(!desk.path().join("out").exists(), "nothing was written");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("small.toml"), SMALL).unwrap();
    fs::write(desk.path().join("dense.toml"), SMALL.replace("spacing_m = 2.5", "spacing_m = 0.125")).unwrap();
    for (arguments, words) in [
        ("bake small.toml --profile unrael", "did you mean unreal? profiles: blender, godot-terrain3d, unreal"),
        ("bake small.toml --tile-cells 9", "16"),
        ("bake small.toml --profile blender --meshopt", "leave out --meshopt"),
        ("bake dense.toml --profile godot-terrain3d --tile-cells 64", "set spacing_m of the preset to 0.25"),
    ] {
        let (code, said) = terrane(desk.path(), arguments);
        assert_eq!(code, 2, "{arguments}\n{said}");
        assert!(said.contains(words), "{arguments}\n{said}");
    }
}

#[test]
fn a_profile_adds_to_exports_and_the_next_bake_clears_it_away() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("small.toml"), SMALL).unwrap();
    let there = || -> BTreeSet<String> {
        let text = fs::read_to_string(desk.path().join("out/bake.json")).unwrap();
        let manifest: Manifest = serde_json::from_str(&text).unwrap();
        let mut found = BTreeSet::new();
        let mut folders = vec![desk.path().join("out")];
        while let Some(folder) = folders.pop() {
            for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let path = path.strip_prefix(desk.path().join("out")).unwrap().to_str().unwrap();
                    found.insert(path.replace('\\', "/"));
                    // The log of runs, which no two bakes have the same.
                    found.remove("runs.jsonl");
                }
            }
        }
        let named: BTreeSet<String> =
            manifest.files.into_iter().map(|file| file.path).chain(["bake.json".into()]).collect();
        assert_eq!(found, named, "the manifest names all that is there");
        found
    };
    let bake = |options: &str| {
        let (code, said) = terrane(desk.path(), &format!("bake small.toml --out out --quiet --overwrite {options}"));
        assert_eq!(code, 0, "{options}\n{said}");
        there()
    };
    let both = bake("--profile unity --export height,hashes --tile-cells 32 --size 2x1");
    assert!(both.is_superset(&["unity/height_1_0.raw", "height/height.png", "IMPORT.md"].map(String::from).into()));
    let script = bake("--profile blender --size 1x1");
    assert!(script.contains("import_terrane.py") && !script.iter().any(|path| path.starts_with("unity")));
    let plain = bake("--size 1x1");
    assert!(!plain.contains("import_terrane.py") && !plain.contains("IMPORT.md"));
}

/// A profile may ask for tiles of another size: of fluvial land that changes nothing.
#[test]
fn fluvial_land_does_not_depend_on_the_size_of_tiles() {
    let world = |cells| {
        let (_, mut preset) = Preset::load("alps").unwrap();
        lighten(&mut preset);
        preset.tile_cells = cells;
        preset.places = None;
        World::new(preset, None).unwrap()
    };
    let (fine, coarse) = (world(32), world(48));
    let whole = Tile::new(&coarse, TileId { x: 1, y: -1 });
    for (x, y) in [(1, -1), (2, -2)] {
        let tile = Tile::new(&fine, TileId { x, y });
        let common = tile.area().common(&whole.area()).expect("they overlap");
        for y in common.y0..common.y1 {
            let [a, b] = [&tile, &whole].map(|tile| tile.heights().row(y, common.x0, common.x1));
            assert_eq!(a, b);
            for x in common.x0..common.x1 {
                let weights = |tile: &Tile| Material::ALL.map(|material| tile.blend().weight(material, x, y));
                assert_eq!(weights(&tile), weights(&whole));
            }
        }
    }
}

#[test]
fn the_names_of_profiles_and_exports_are_known_apart() {
    for profile in Profile::ALL {
        assert_eq!(profile.name().parse::<Profile>().unwrap(), profile);
        assert!(profile.name().parse::<Export>().is_err(), "{} comes with its profile only", profile.name());
    }
}
