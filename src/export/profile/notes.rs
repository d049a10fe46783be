//! IMPORT.md: what to click, and the numbers to type.

use std::fmt::Write;

use super::{Profile, components};
use crate::area::Region;
use crate::export::raster::quantity::{hterrain_scale, whole_range_m};
use crate::tile::Material;
use crate::world::World;

/// The numbers that the texts need.
#[expect(clippy::struct_field_names, reason = "a unit is part of a name")]
struct Numbers {
    spacing_m: f64,
    min_m: f64,
    max_m: f64,
    step_m: f64,
    sea_m: Option<f64>,
}

/// A number as people type it: a millionth is finer than any engine keeps.
fn typed(number: f64) -> String {
    let text = format!("{number:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// A table of two columns.
fn table(heads: [&str; 2], rows: &[(&str, String)]) -> String {
    let [what, value] = heads;
    let mut text = format!("| {what} | {value} |\n|---|---|\n");
    for (what, value) in rows {
        writeln!(text, "| {what} | {value} |").expect("a String takes everything");
    }
    text
}

/// The text of IMPORT.md.
pub(super) fn notes(profile: Profile, world: &World, region: &Region, preset_name: &str) -> String {
    let (min_m, max_m) = world.height_range_m();
    let (min_m, max_m) = (f64::from(min_m), f64::from(max_m));
    let numbers = Numbers {
        spacing_m: world.spacing_m(),
        min_m,
        max_m,
        step_m: (max_m - min_m) / 65535.0,
        sea_m: world.preset().sea_level_m,
    };
    let (program, steps) = match profile {
        Profile::Blender => ("Blender", blender(region, &numbers)),
        Profile::GodotTerrain3d => ("Godot, Terrain3D", terrain3d(region, &numbers)),
        Profile::Unreal => ("Unreal Engine", unreal(region, &numbers, false)),
        Profile::UnrealTiled => ("Unreal Engine, in tiles", unreal(region, &numbers, true)),
        Profile::Unity => ("Unity", unity(region, &numbers)),
        Profile::Hterrain => ("Godot, HTerrain", hterrain(world, region, &numbers)),
    };
    let tiles = |count: u64| if count == 1 { "tile" } else { "tiles" };
    let about = table(
        ["World", preset_name],
        &[
            ("seed", world.seed().to_string()),
            ("north-western tile", format!("{}, {}", region.at().x, region.at().y)),
            ("region", format!("{} x {} {}", region.cols(), region.rows(), tiles(region.tiles()))),
            ("cells a tile side", region.tile_cells().to_string()),
            ("metres between vertices", typed(numbers.spacing_m)),
            ("heights", format!("{} to {} m", typed(min_m), typed(max_m))),
            ("sea level", numbers.sea_m.map_or("no sea".into(), |level| format!("{} m", typed(level)))),
        ],
    );
    format!(
        "# Import into {program}\n\n{about}\nThe files, their hashes and the true numbers of the tiles are in `bake.json`.\n\n{steps}"
    )
}

fn blender(region: &Region, numbers: &Numbers) -> String {
    let reach_m = region.width().max(region.height()) as f64 * numbers.spacing_m;
    format!(
        "Run the script: *Scripting* workspace, *Open*, `import_terrane.py`, *Run*; or\n\n\
         ```sh\n\
         blender --background --python import_terrane.py -- --render still.png --save scene.blend\n\
         ```\n\n\
         It makes a collection `terrane` with one collection a tile, materials in which the blend map mixes the grounds, \
         water, sun, sky and a camera, and sets clip ends. One unit is one metre, +X is east, +Y is north; \
         the origin is the region's middle at height 0.\n\n\
         By hand: *File*, *Import*, *glTF 2.0*, and all of `mesh/*.glb` of one level of detail. Then\n\n{}",
        table(
            ["Setting", "Value"],
            &[
                // Blender shows a kilometre unless told otherwise; this is room to see the region from outside.
                ("*View*, *Clip End*, and the camera's", format!("{} m", typed((4.0 * reach_m).ceil()))),
                ("colour space of images but `colour`", "Non-Color".into()),
                ("weights of the vertices", "float attributes `_GRASS`, `_DIRT`, `_ROCK`, `_SAND`, `_SNOW`".into()),
                ("sea", numbers.sea_m.map_or("none".into(), |level| format!("z = {} m", typed(level)))),
            ],
        )
    )
}

fn unreal(region: &Region, numbers: &Numbers, tiled: bool) -> String {
    // Tiles that share no vertex leave out the last column and row.
    let less = u64::from(tiled);
    let (width, height) = (region.width() - less, region.height() - less);
    let parts = components(width, height).expect("the plan has checked the size");
    let sections = format!("{0}x{0}", parts.sections);
    // A step of 16 bits is ScaleZ / 12800 m, and the value 32768 lies at the landscape's own height.
    let scale_z = numbers.step_m * 12_800.0;
    let location_z = (numbers.min_m + 32_768.0 * numbers.step_m) * 100.0;
    // Unreal counts in centimetres, and puts a landscape's first vertex at its location.
    let middle_cm = |vertices: u64| -((vertices - 1) as f64) * numbers.spacing_m * 50.0;
    let layers = Material::ALL.map(|material| format!("`{}`", material.name())).join(", ");
    let (heights, weights) = match tiled {
        true => ("any of `unreal/height_x*_y*.png`; the others are found by their names", "`unreal/NAME_x0_y0.png`"),
        false => ("`unreal/height.png`", "`unreal/NAME.png`"),
    };
    let tiles = match tiled {
        true => format!(
            "Tiles have {0} x {0} vertices and share none, so the landscape has {width} x {height}: {0} times {1} and {2}.\n\n",
            region.tile_cells(),
            region.cols(),
            region.rows()
        ),
        false => String::new(),
    };
    let scale_xy = typed(numbers.spacing_m * 100.0);
    let sea = numbers.sea_m.map_or("none".into(), |level| format!("{} cm", typed(level * 100.0)));
    format!(
        "*Landscape* mode, *Manage*, *New*, *Import from File*.\n\n{}\n{tiles}\
         Before the import, make a landscape material with the layers {layers} and a layer info (weight-blended) for each; then \
         give each layer its map {weights}. The weights of a vertex sum to 255.\n\n\
         A value v of the heights is {} + v * {} m: v = 32768 + h * 12800 / Scale Z, counted from Location Z.\n\
         +X is east and +Y is south, as in the files.\n",
        table(
            ["Setting", "Value"],
            &[
                ("Heightmap File", heights.into()),
                ("Location X", typed(middle_cm(width))),
                ("Location Y", typed(middle_cm(height))),
                ("Location Z", typed(location_z)),
                ("Scale X", scale_xy.clone()),
                ("Scale Y", scale_xy),
                ("Scale Z", typed(scale_z)),
                ("Section Size", format!("{0}x{0} Quads", parts.quads)),
                ("Sections Per Component", format!("{sections} Section{}", if parts.sections > 1 { "s" } else { "" })),
                ("Number of Components", format!("{} x {}", parts.cols, parts.rows)),
                ("Overall Resolution", format!("{width} x {height}")),
                ("Water level (Z)", sea),
            ],
        ),
        typed(numbers.min_m),
        numbers.step_m,
    )
}

fn unity(region: &Region, numbers: &Numbers) -> String {
    let cells = region.tile_cells();
    let side_m = f64::from(cells) * numbers.spacing_m;
    let last = format!("{}_{}", region.cols() - 1, region.rows() - 1);
    format!(
        "One terrain a tile. `unity/height_X_Z.raw`: X counts from the west, Z from the south, `0_0` to `{last}`, as the \
         Terrain Toolbox (package Terrain Tools) expects them in *Create New Terrain*, *Import Heightmap*, *Batch*. By hand, a \
         terrain each: *Terrain Settings*, *Import Raw...*\n\n{}\n\
         In the terrain's settings\n\n{}\n\
         `unity/splat_ground_X_Z.png` has grass, dirt, rock and sand in R, G, B and A, `unity/splat_cover_X_Z.png` has snow, \
         forest, scree and wetland: add terrain layers in this order, and give both to *Import Splatmaps* of the Terrain Toolbox (north is up, no flip). \
         Import them as textures with sRGB off, no compression and *Non-Power of 2* none. Texel (0, 0) is the \
         north-western vertex; the last row and column of vertices are those of the neighbours.\n",
        table(
            ["Import Heightmap", "Value"],
            &[
                ("Depth", "Bit 16".into()),
                ("Resolution", (cells + 1).to_string()),
                ("Byte Order", "Windows".into()),
                ("Flip Vertically", "off: the first row is the southern one".into()),
                ("Terrain Size X", typed(side_m)),
                ("Terrain Size Y", typed(numbers.max_m - numbers.min_m)),
                ("Terrain Size Z", typed(side_m)),
            ],
        ),
        table(
            ["Setting", "Value"],
            &[
                ("Heightmap Resolution", format!("{0} x {0}", cells + 1)),
                ("Control Texture Resolution", format!("{cells} x {cells}")),
                ("Position of terrain X_Z: x", format!("X * {}", typed(side_m))),
                ("Position of terrain X_Z: y", typed(numbers.min_m)),
                ("Position of terrain X_Z: z", format!("Z * {}", typed(side_m))),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
    )
}

fn terrain3d(region: &Region, numbers: &Numbers) -> String {
    let cells = u64::from(region.tile_cells());
    // A corner of a region of Terrain3D, about the middle.
    let corner = |count: u64| -((count / 2 * cells) as i64);
    let (width, height) = (region.width() - 1, region.height() - 1);
    format!(
        "Open `addons/terrain_3d/tools/importer.tscn` and select its node.\n\n{}\n\
         The vertices of the eastern and southern edge, which the next regions begin with, are not in the files: {width} x \
         {height} pixels are {} x {} regions.\n\n\
         Textures of the asset dock, in this order: 0 grass, 1 dirt, 2 rock, 3 sand, 4 snow, 5 forest, 6 scree, 7 wetland. The control map has the two \
         strongest of each vertex and no autoshader. Versions whose importer has *Import Splat Maps* can take all weights \
         instead: *Splat Map Paths* `terrain3d/splat_ground.png`, `terrain3d/splat_cover.png` and *Material Ids* 0, 1, 2, 3, 4, \
         5, 6, 7.\n",
        table(
            ["Setting", "Value"],
            &[
                ("Region Size", cells.to_string()),
                ("Vertex Spacing", typed(numbers.spacing_m)),
                ("Height File Name", "`terrain3d/height.exr`".into()),
                ("Control File Name", "`terrain3d/control.exr`".into()),
                ("Import Position", format!("{}, {}", corner(region.cols()), corner(region.rows()))),
                ("Import Scale", "1: the heights are metres".into()),
                ("Height Offset", "0".into()),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
        region.cols(),
        region.rows(),
    )
}

fn hterrain(world: &World, region: &Region, numbers: &Numbers) -> String {
    let range_m = world.height_range_m();
    let ((min_m, max_m), scale) = (whole_range_m(range_m), hterrain_scale(range_m));
    let spacing = typed(numbers.spacing_m);
    let stretched = match scale {
        1.0 => "",
        _ => {
            "The dialog takes no heights beyond 2000 m: the ones to type are smaller by the Map Scale's y, which brings them back.\n\n"
        }
    };
    format!(
        "Add an HTerrain node, give it a data folder, and choose *Terrain*, *Import...*\n\n{}\n{stretched}\
         Then set\n\n{}\n\
         `splat.png` has grass, dirt, rock and sand in R, G, B and A. Snow, forest, scree and wetland are those of `splat_1.png`: with the shader \
         MultiSplat16, put it into the data folder beside the `splat.png` that the import has made there, and give the texture \
         set its textures in the order grass, dirt, rock, sand, snow, forest, scree, wetland. Do not let an image editor save \
         either: it may drop the colours where A is 0.\n",
        table(
            ["Import maps", "Value"],
            &[
                ("Heightmap", "`hterrain/height.raw`".into()),
                ("Raw Endianess", "Little Endian".into()),
                ("Bit Depth", "16-bit".into()),
                ("Min Height", typed(f64::from(min_m / scale))),
                ("Max Height", typed(f64::from(max_m / scale))),
                ("Splatmap", "`hterrain/splat.png`".into()),
            ],
        ),
        table(
            ["Setting", "Value"],
            &[
                ("Resolution (set by the import)", region.width().to_string()),
                ("Map Scale", format!("x {spacing}, y {}, z {spacing}", typed(f64::from(scale)))),
                ("Centered", "on".into()),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
    )
}
