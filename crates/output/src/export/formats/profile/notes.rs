//! IMPORT.md: instructions for the import, with the numbers to type.

use std::fmt::Write;

use super::{Profile, components};
use crate::area::Region;
use crate::export::formats::format::Request;
use crate::export::formats::raster::painter::{hterrain_scale, whole_range_m};
use crate::export::plan::digits::{noise_m, shortest};
use crate::export::plan::options::MeshOptions;
use crate::mesh::default_origin;
use crate::tile::Material;

/// The numbers that the texts need.
#[expect(clippy::struct_field_names, reason = "a unit is part of a name")]
struct Numbers {
    spacing_m: f64,
    min_m: f64,
    max_m: f64,
    step_m: f64,
    sea_m: Option<f64>,
}

impl Numbers {
    /// Formats a height, or a difference of two heights, for people to type.
    fn height(&self, height_m: f64) -> String {
        shortest(height_m, noise_m(self.min_m, self.max_m))
    }

    /// Formats a factor that takes 16-bit steps back to metres, or to another unit, with enough digits: over all steps,
    /// the error is less than the precision of a height.
    fn factor(number: f64) -> String {
        shortest(number, number * f64::from(f32::EPSILON))
    }
}

/// Formats a number for people to type, to a millionth, which is finer than any engine keeps.
pub(super) fn typed(number: f64) -> String {
    shortest(number, 1e-6)
}

/// The place of a region in an engine: its edges in metres east and south of the origin. Two bakes with the same origin
/// lie in the engine as they do in the world.
struct RegionPlacement {
    /// Metres east and north from the world's origin to the origin of the positions.
    origin_m: [f64; 2],
    /// The edges of the region: west, north, east and south.
    edges_m: [f64; 4],
}

impl RegionPlacement {
    fn new(region: &Region, origin: [i64; 2], spacing_m: f64) -> RegionPlacement {
        let corner = region.at().area(region.tile_cells());
        let metres = |vertices: i64| vertices as f64 * spacing_m;
        let [west, north] = [corner.x0 - origin[0], corner.y0 - origin[1]];
        let [width, height] = [region.width(), region.height()].map(|vertices| vertices as i64 - 1);
        RegionPlacement {
            origin_m: [metres(origin[0]), 0.0 - metres(origin[1])],
            edges_m: [west, north, west + width, north + height].map(metres),
        }
    }

    /// Returns the command's option for this origin.
    fn option(&self) -> String {
        let [east, north] = self.origin_m.map(typed);
        format!("--mesh-origin {east},{north}")
    }

    /// Returns the text on how other bakes come to lie beside this one, and on the precision of positions far from the
    /// origin.
    fn beside(&self) -> String {
        let [east, north] = self.origin_m.map(typed);
        let mut text = format!(
            "\n## Beside other bakes\n\n\
             Positions count from {} of the world. Another bake of this world lies beside this one as it does there when it is put \
             where its own IMPORT.md says, and when that counts from the same place: if it does not, bake it with `{}`. Heights \
             have the same numbers in all bakes of a world.\n",
            match self.origin_m {
                [0.0, 0.0] => "the origin".to_owned(),
                _ => format!("a place {east} m east and {north} m north of the origin"),
            },
            self.option(),
        );
        let furthest_m = self.edges_m.into_iter().fold(0.0, |most: f64, edge_m| most.max(edge_m.abs())) as f32;
        let step_m = f64::from(furthest_m.next_up() - furthest_m);
        if step_m > FINE_M {
            let [west, north, east, south] = self.edges_m;
            let middle = [west.midpoint(east), -north.midpoint(south)];
            let [east, north] = [0, 1].map(|axis| typed((self.origin_m[axis] + middle[axis]).round()));
            write!(
                text,
                "\nThis bake reaches {:.0} km from there, where numbers of 32 bits, in which Unity, Godot and Unreal 4 keep positions, \
                 are {} mm apart: things tremble. An origin nearer by, the same for all bakes of a scene, mends that: \
                 `--mesh-origin {east},{north}`, say.\n",
                furthest_m / 1000.0,
                shortest(1000.0 * step_m, 0.05),
            )
            .expect("a String takes everything");
        }
        text
    }
}

/// Largest distance in metres between neighbouring positions in an engine at which nobody sees them tremble.
const FINE_M: f64 = 0.001;

/// Clip distances of Blender's camera and windows, far and near, in sides of the region. The script sets the same
/// values. Seen from outside, a region is in view as a whole from about two sides away.
const CLIP_SIDES: f64 = 12.0;
const CLIP_START_SIDES: f64 = 1e-4;

/// Returns a Markdown table of two columns.
fn table(heads: [&str; 2], rows: &[(&str, String)]) -> String {
    let [what, value] = heads;
    let mut text = format!("| {what} | {value} |\n|---|---|\n");
    for (what, value) in rows {
        writeln!(text, "| {what} | {value} |").expect("a String takes everything");
    }
    text
}

/// Returns the text of IMPORT.md.
pub(super) fn notes(profile: Profile, request: &Request) -> String {
    let Request { name: preset_name, world, ref region, meshes, height_range_m, .. } = *request;
    let (min_m, max_m) = height_range_m;
    let (min_m, max_m) = (f64::from(min_m), f64::from(max_m));
    let numbers = Numbers {
        spacing_m: world.spacing_m(),
        min_m,
        max_m,
        step_m: (max_m - min_m) / 65535.0,
        sea_m: world.preset().sea_level_m,
    };
    let origin = meshes.origin.expect("a plan has one");
    let place = RegionPlacement::new(region, origin, numbers.spacing_m);
    let (program, steps) = match profile {
        Profile::Blender => ("Blender", blender(region, meshes, &numbers)),
        Profile::GodotTerrain3d => ("Godot, Terrain3D", terrain3d(region, origin, &place, &numbers)),
        Profile::Unreal => ("Unreal Engine", unreal(region, &place, &numbers, false)),
        Profile::UnrealTiled => ("Unreal Engine, in tiles", unreal(region, &place, &numbers, true)),
        Profile::Unity => ("Unity", unity(region, &place, &numbers)),
        Profile::Hterrain => ("Godot, HTerrain", hterrain(height_range_m, region, &place, &numbers)),
    };
    // Blender's script places further bakes itself, and its text tells how to do so by hand.
    let beside = if profile == Profile::Blender { String::new() } else { place.beside() };
    let tiles = |count: u64| if count == 1 { "tile" } else { "tiles" };
    let about = table(
        // In a table, a vertical bar would begin the next column.
        ["World", &preset_name.replace('|', "\\|")],
        &[
            ("seed", world.seed().to_string()),
            ("north-western tile", format!("{}, {}", region.at().x, region.at().y)),
            ("region", format!("{} x {} {}", region.cols(), region.rows(), tiles(region.tiles()))),
            ("cells a tile side", region.tile_cells().to_string()),
            ("metres between vertices", typed(numbers.spacing_m)),
            ("heights", format!("{} to {} m", numbers.height(min_m), numbers.height(max_m))),
            ("sea level", numbers.sea_m.map_or("no sea".into(), |level| format!("{} m", typed(level)))),
        ],
    );
    format!(
        "# Import into {program}\n\n{about}\nThe files, their hashes and the true numbers of the tiles are in `bake.json`.\n\n{steps}{beside}"
    )
}

fn blender(region: &Region, meshes: &MeshOptions, numbers: &Numbers) -> String {
    let [width, height] = [region.width(), region.height()];
    let [width_m, height_m] = [width, height].map(|vertices| (vertices - 1) as f64 * numbers.spacing_m);
    let side_m = width_m.max(height_m);
    let lod = match meshes.lods.all() {
        [] | [0, ..] => String::new(),
        [finest, ..] => format!("_lod{finest}"),
    };
    let origin = meshes.origin.unwrap_or_else(|| default_origin(region));
    // The middle of the region.
    let corner = region.at().area(region.tile_cells());
    let middle = |first: i64, origin: i64, vertices: u64| {
        ((first - origin) as f64 + (vertices - 1) as f64 / 2.0) * numbers.spacing_m
    };
    let [plane_x, plane_y] = [middle(corner.x0, origin[0], width), -middle(corner.y0, origin[1], height)];
    let inner = |vertices: u64| typed_share((vertices - 1) as f64 / vertices as f64);
    let half = |vertices: u64| typed_share(0.5 / vertices as f64);
    format!(
        include_str!("blender.md"),
        scene = scene_table(region, meshes, numbers, side_m),
        grid = table(
            ["Grid", "Value"],
            &[
                ("X Subdivisions", (width - 1).to_string()),
                ("Y Subdivisions", (height - 1).to_string()),
                ("Location X, Y, Z", format!("{}, {}, 0", typed(plane_x), typed(plane_y))),
                ("Sidebar (N), *Item*, *Dimensions* X", format!("{} m", typed(width_m))),
                ("Sidebar (N), *Item*, *Dimensions* Y", format!("{} m", typed(height_m))),
            ],
        ),
        warp = table(
            ["UV Warp", "Value"],
            &[("UV Center", "0.5, 0.5".into()), ("Scale X", inner(width)), ("Scale Y", inner(height)),],
        ),
        displace = displace_table(numbers),
        half_step_m = shortest(numbers.step_m / 2.0, numbers.step_m / 100.0),
        half_x = half(width),
        half_y = half(height),
        lod = lod,
        width = width,
        height = height,
        x = region.at().x,
        y = region.at().y,
    )
}

/// Returns the table of what is set in Blender's scene by hand. `side_m` is the longer side of the region.
fn scene_table(region: &Region, meshes: &MeshOptions, numbers: &Numbers, side_m: f64) -> String {
    let (clip_m, clip_start_m) = (CLIP_SIDES * side_m, (CLIP_START_SIDES * side_m).max(0.1));
    let clip = format!("{} m and {} m", typed(clip_start_m), typed(clip_m));
    let origin = meshes.origin.unwrap_or_else(|| default_origin(region));
    let [east_m, south_m] = origin.map(|at| at as f64 * numbers.spacing_m);
    table(
        ["Setting", "Value"],
        &[
            ("Sidebar (N), *View*, *Clip Start* and *End*", clip.clone()),
            ("Camera, *Lens*, *Clip Start* and *End*", clip),
            ("origin in the world, X (east)", format!("{} m", typed(east_m))),
            ("origin in the world, Y (north)", format!("{} m", typed(-south_m))),
            ("colour space of images but `colour`", "Non-Color".into()),
            (
                "weights of the vertices",
                "colour attributes `_GROUND`: grass, dirt, rock, sand; `_COVER`: snow, forest, scree, wetland".into(),
            ),
            ("sea", numbers.sea_m.map_or("none".into(), |level| format!("z = {} m", typed(level)))),
        ],
    )
}

/// Returns the table of Blender's second modifier for a plane that the heights displace.
fn displace_table(numbers: &Numbers) -> String {
    let range_m = numbers.max_m - numbers.min_m;
    table(
        ["Displace", "Value"],
        &[
            ("Texture, *Image*, *Open*", "`height/height.png`".into()),
            ("Texture, *Image*, *Color Space*", "Non-Color".into()),
            ("Texture, *Mapping*, *Extension*", "Extend".into()),
            // With its default filter, Blender 4.5 reads past the last texel.
            ("Texture, *Sampling*, *Filter Size*", "0.1".into()),
            ("Coordinates", "UV".into()),
            ("Direction", "Z".into()),
            ("Strength", numbers.height(range_m)),
            ("Midlevel", shortest(-numbers.min_m / range_m, f64::from(f32::EPSILON) / 2.0)),
        ],
    )
}

/// Formats a share of a picture for people to type, finer than a thousandth of a texel.
fn typed_share(share: f64) -> String {
    shortest(share, 1e-8)
}

fn unreal(region: &Region, place: &RegionPlacement, numbers: &Numbers, tiled: bool) -> String {
    // Landscapes of tiles without shared vertices lack the last column and row.
    let less = u64::from(tiled);
    let (width, height) = (region.width() - less, region.height() - less);
    let parts = components(width, height).expect("the plan has checked the size");
    let sections = format!("{0}x{0}", parts.sections);
    // A 16-bit step is ScaleZ / 12800 m, and the value 32768 lies at the landscape's own height.
    let scale_z = numbers.step_m * 12_800.0;
    let location_z = (numbers.min_m + 32_768.0 * numbers.step_m) * 100.0;
    let layers = Material::ALL.map(|material| format!("`{}`", material.name())).join(", ");
    let (heights, weights) = match tiled {
        true => ("any of `unreal/height_x*_y*.png`; the others are found by their names", "`unreal/NAME_x0_y0.png`"),
        false => ("`unreal/height.png`", "`unreal/NAME.png`"),
    };
    let tiles = match tiled {
        true => format!(
            "Tiles have {0} x {0} vertices and share none, so the landscape has {width} x {height}: {0} times {1} and {2}. It ends a \
             cell before the bake beside it begins, and leaves that strip open: bake both as one region, or with the profile \
             unreal, whose landscapes share their edge.\n\n",
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
                // Unreal counts in centimetres, and puts a landscape's first vertex at its location.
                ("Location X", typed(place.edges_m[0] * 100.0)),
                ("Location Y", typed(place.edges_m[1] * 100.0)),
                ("Location Z", shortest(location_z, 100.0 * noise_m(numbers.min_m, numbers.max_m))),
                ("Scale X", scale_xy.clone()),
                ("Scale Y", scale_xy),
                ("Scale Z", Numbers::factor(scale_z)),
                ("Section Size", format!("{0}x{0} Quads", parts.quads)),
                ("Sections Per Component", format!("{sections} Section{}", if parts.sections > 1 { "s" } else { "" })),
                ("Number of Components", format!("{} x {}", parts.cols, parts.rows)),
                ("Overall Resolution", format!("{width} x {height}")),
                ("Water level (Z)", sea),
            ],
        ),
        numbers.height(numbers.min_m),
        Numbers::factor(numbers.step_m),
    )
}

fn unity(region: &Region, place: &RegionPlacement, numbers: &Numbers) -> String {
    let cells = region.tile_cells();
    let side_m = f64::from(cells) * numbers.spacing_m;
    // Unity's z counts to the north, and terrains are numbered from the south.
    let [west_m, _, _, south_m] = place.edges_m;
    let [west, south] = [west_m, 0.0 - south_m].map(typed);
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
                ("Terrain Size Y", numbers.height(numbers.max_m - numbers.min_m)),
                ("Terrain Size Z", typed(side_m)),
                ("Start Position (Terrain Toolbox)", format!("{west}, {}, {south}", numbers.height(numbers.min_m))),
            ],
        ),
        table(
            ["Setting", "Value"],
            &[
                ("Heightmap Resolution", format!("{0} x {0}", cells + 1)),
                ("Control Texture Resolution", format!("{cells} x {cells}")),
                ("Position of terrain X_Z: x", format!("{west} + X * {}", typed(side_m))),
                ("Position of terrain X_Z: y", numbers.height(numbers.min_m)),
                ("Position of terrain X_Z: z", format!("{south} + Z * {}", typed(side_m))),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
    )
}

fn terrain3d(region: &Region, origin: [i64; 2], place: &RegionPlacement, numbers: &Numbers) -> String {
    let cells = u64::from(region.tile_cells());
    // Terrain3D's importer counts vertices, and a region of Terrain3D is a tile.
    let corner = region.at().area(region.tile_cells());
    let position = format!("{}, {}", corner.x0 - origin[0], corner.y0 - origin[1]);
    let (width, height) = (region.width() - 1, region.height() - 1);
    format!(
        "Open `addons/terrain_3d/tools/importer.tscn` and select its node.\n\n{}\n\
         The vertices of the eastern and southern edge, which the next regions begin with, are not in the files: {width} x \
         {height} pixels are {} x {} regions. A terrain has 32 x 32, 16 to each side of its origin: further bakes with \
         `{}` that lie there go into the same terrain, each at its own Import Position.\n\n\
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
                ("Import Position", position),
                ("Import Scale", "1: the heights are metres".into()),
                ("Height Offset", "0".into()),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
        region.cols(),
        region.rows(),
        place.option(),
    )
}

fn hterrain(range_m: (f32, f32), region: &Region, place: &RegionPlacement, numbers: &Numbers) -> String {
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
                ("Centered", "off".into()),
                ("Position", format!("x {}, y 0, z {}", typed(place.edges_m[0]), typed(place.edges_m[1]))),
                ("Water level (y)", numbers.sea_m.map_or("none".into(), typed)),
            ],
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::formats::profile::SCRIPT;

    #[test]
    fn what_is_typed_by_hand_is_what_the_script_sets() {
        let constant = |name: &str| -> f64 {
            let line = SCRIPT.1.lines().find_map(|line| line.strip_prefix(&format!("{name} = ")));
            line.expect("the script has it").parse().expect("it is a number")
        };
        assert_eq!(constant("CLIP_SIDES").to_bits(), CLIP_SIDES.to_bits());
        assert_eq!(constant("CLIP_START_SIDES").to_bits(), CLIP_START_SIDES.to_bits());
    }
}
