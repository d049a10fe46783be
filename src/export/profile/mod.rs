//! Profiles: what a program at the other end takes, chosen together.
//!
//! ```text
//!   mod.rs     the profiles: their images and what they refuse
//!   sizes.rs   region -> the nearest that a profile takes
//!   notes.rs   world, region -> IMPORT.md
//!   import_terrane.py   bake.json, GLBs -> a scene in Blender
//! ```

mod notes;
mod sizes;

use std::path::Path;
use std::str::FromStr;

use crate::area::Region;
use crate::bake::FileRecord;
use crate::error::{Error, nearest};
use crate::export::file::write_whole;
use crate::export::image::{Edge, Image, Layout, Naming, Rows};
use crate::export::mesh::{Lods, MeshOptions};
use crate::export::raster::Quantity;
use crate::export::writer::Format;
use crate::export::{Content, Export, Kind};
use crate::tile::Material;
use crate::world::World;

pub(super) use sizes::components;

/// A program at the other end, and everything that it wants to be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Blender, with a script that builds the scene.
    Blender,
    /// Godot with the Terrain3D plugin.
    GodotTerrain3d,
    /// Unreal Engine: one landscape.
    Unreal,
    /// Unreal Engine: a landscape imported tile by tile.
    UnrealTiled,
    /// Unity: a terrain a tile.
    Unity,
    /// Godot with the HTerrain plugin.
    Hterrain,
}

/// The text beside the files.
const NOTES: &str = "IMPORT.md";

/// The script beside the files, and its text.
const SCRIPT: (&str, &str) = ("import_terrane.py", include_str!("import_terrane.py"));

/// No text beside the files is longer.
pub(super) const WRITTEN_BYTES: u64 = 64 << 10;

/// Metres a vertex of Terrain3D, which clamps what lies outside. Source: `Terrain3D::set_vertex_spacing`.
const TERRAIN3D_SPACING_M: [f64; 2] = [0.25, 100.0];

const fn image(stem: &'static str, quantity: Quantity, format: Format) -> Image {
    Image { export: "", stem, quantity, format, tiles: false, layout: Layout::PLAIN }
}

impl Image {
    const fn of(self, export: &'static str) -> Image {
        Image { export, ..self }
    }

    /// Without the vertices that tiles share.
    const fn owned_only(self) -> Image {
        Image { layout: Layout { edge: Edge::Owned, ..self.layout }, ..self }
    }

    /// One a tile.
    const fn a_tile(self) -> Image {
        Image { tiles: true, ..self }
    }

    /// One a tile, which the name counts from the south-west.
    const fn a_tile_from_south(self) -> Image {
        Image { tiles: true, layout: Layout { naming: Naming::Bare, ..self.layout }, ..self }
    }

    /// With the southernmost row first.
    const fn upside_down(self) -> Image {
        Image { layout: Layout { rows: Rows::FromSouth, ..self.layout }, ..self }
    }
}

const fn weight(stem: &'static str, material: Material) -> Image {
    image(stem, Quantity::Weight(material), Format::Png)
}

// No digit stands after an x, y, u or v in a name, but for a tile's place: Unreal would take it for one.
const UNREAL: &[Image] = &[
    image("unreal/height", Quantity::Height16, Format::Png).of("unreal"),
    weight("unreal/grass", Material::Grass).of("unreal"),
    weight("unreal/dirt", Material::Dirt).of("unreal"),
    weight("unreal/rock", Material::Rock).of("unreal"),
    weight("unreal/sand", Material::Sand).of("unreal"),
    weight("unreal/snow", Material::Snow).of("unreal"),
];

const UNREAL_TILED: &[Image] = &[
    image("unreal/height", Quantity::Height16, Format::Png).of("unreal-tiled").a_tile().owned_only(),
    weight("unreal/grass", Material::Grass).of("unreal-tiled").a_tile().owned_only(),
    weight("unreal/dirt", Material::Dirt).of("unreal-tiled").a_tile().owned_only(),
    weight("unreal/rock", Material::Rock).of("unreal-tiled").a_tile().owned_only(),
    weight("unreal/sand", Material::Sand).of("unreal-tiled").a_tile().owned_only(),
    weight("unreal/snow", Material::Snow).of("unreal-tiled").a_tile().owned_only(),
];

const UNITY: &[Image] = &[
    image("unity/height", Quantity::Height16, Format::Raw).of("unity").a_tile_from_south().upside_down(),
    image("unity/splat_ground", Quantity::GroundWeights, Format::Png).of("unity").a_tile_from_south().owned_only(),
    image("unity/splat_cover", Quantity::CoverWeights, Format::Png).of("unity").a_tile_from_south().owned_only(),
];

const TERRAIN3D: &[Image] = &[
    image("terrain3d/height", Quantity::HeightMetres, Format::ExrRgb).of("godot-terrain3d").owned_only(),
    image("terrain3d/control", Quantity::Control, Format::ExrRgb).of("godot-terrain3d").owned_only(),
    image("terrain3d/splat_ground", Quantity::GroundWeights, Format::Png).of("godot-terrain3d").owned_only(),
    image("terrain3d/splat_cover", Quantity::CoverWeights, Format::Png).of("godot-terrain3d").owned_only(),
];

// The names that HTerrain gives to its own maps.
const HTERRAIN: &[Image] = &[
    image("hterrain/height", Quantity::Height16Whole, Format::Raw).of("hterrain"),
    image("hterrain/splat", Quantity::GroundWeights, Format::Png).of("hterrain"),
    image("hterrain/splat_1", Quantity::CoverWeights, Format::Png).of("hterrain"),
];

const fn engine(name: &'static str, about: &'static str, images: &'static [Image]) -> Kind {
    Kind { name, about, content: Content::Engine(images) }
}

/// The exports of profiles, which nothing else can ask for.
static KINDS: [Kind; 5] = [
    engine("unreal", "16-bit PNG, and a weight map a layer", UNREAL),
    engine("unreal-tiled", "the same a tile, without the shared edge", UNREAL_TILED),
    engine("unity", "RAW from the south, and splat maps, a tile each", UNITY),
    engine("godot-terrain3d", "heights in metres, control map, splat maps", TERRAIN3D),
    engine("hterrain", "RAW, and splat maps", HTERRAIN),
];

/// The exports of all profiles.
pub(super) fn exports() -> impl Iterator<Item = Export> {
    KINDS.iter().map(Export)
}

/// Whether a profile writes a file of that path besides its exports.
pub(super) fn names(path: &str) -> bool {
    [NOTES, SCRIPT.0].contains(&path)
}

/// The world's height range rounded out: HTerrain's dialog takes heights from -2000 to 2000 m, and each multiple of the
/// scale that brings a range into it is a whole number there.
pub(super) fn whole_range_m(world: &World) -> (f32, f32) {
    let ((min_m, max_m), scale) = (world.height_range_m(), hterrain_scale(world));
    let (low, mut high) = ((min_m / scale).floor(), (max_m / scale).ceil());
    if low == high {
        high += 1.0;
    }
    (low * scale, high * scale)
}

/// By how much HTerrain must stretch heights: 1, or as much more as brings them into its dialog.
fn hterrain_scale(world: &World) -> f32 {
    let (min_m, max_m) = world.height_range_m();
    (min_m.abs().max(max_m.abs()) / 2000.0).ceil().max(1.0)
}

impl Profile {
    /// All profiles.
    pub const ALL: [Profile; 6] = [
        Profile::Blender,
        Profile::GodotTerrain3d,
        Profile::Unreal,
        Profile::UnrealTiled,
        Profile::Unity,
        Profile::Hterrain,
    ];

    /// The name, as the command knows it.
    pub fn name(self) -> &'static str {
        match self {
            Profile::Blender => "blender",
            Profile::GodotTerrain3d => "godot-terrain3d",
            Profile::Unreal => "unreal",
            Profile::UnrealTiled => "unreal-tiled",
            Profile::Unity => "unity",
            Profile::Hterrain => "hterrain",
        }
    }

    /// What it leaves, in a few words.
    pub fn about(self) -> &'static str {
        match self {
            Profile::Blender => "GLBs, and a script that builds the scene: collections, materials, water, sun, camera",
            Profile::GodotTerrain3d => "heights in metres, control map and splat maps for Godot's Terrain3D",
            Profile::Unreal => "one landscape: 16-bit heights and a weight map a layer",
            Profile::UnrealTiled => "a landscape in tiles without shared edges",
            Profile::Unity => "a RAW and splat maps a tile",
            Profile::Hterrain => "a square RAW and splat maps for Godot's HTerrain",
        }
    }

    /// The levels of detail of its meshes when none are chosen.
    pub fn lods(self) -> Lods {
        match self {
            // Every vertex is more than Blender's window can turn around.
            Profile::Blender => Lods::only(1),
            _ => Lods::default(),
        }
    }

    /// The exports that it brings.
    pub(super) fn exports(self) -> impl Iterator<Item = Export> {
        let gltf = Export::all().filter(move |export| self == Profile::Blender && export.name() == "gltf");
        exports().filter(move |export| export.name() == self.name()).chain(gltf)
    }

    /// The files that it writes besides.
    pub(super) fn written(self) -> &'static [&'static str] {
        match self {
            Profile::Blender => &[NOTES, SCRIPT.0],
            _ => &[NOTES],
        }
    }

    /// Whether it takes a region of a world.
    ///
    /// # Errors
    /// When it does not; the hint names the nearest that it takes.
    pub(super) fn check(self, world: &World, region: &Region, meshes: &MeshOptions) -> Result<(), Error> {
        let spacing_m = world.spacing_m();
        let [least, most] = TERRAIN3D_SPACING_M;
        if self == Profile::GodotTerrain3d && !(least..=most).contains(&spacing_m) {
            return Err(Error::Option {
                message: format!(
                    "Terrain3D takes vertices {least} to {most} m apart, and the preset has {spacing_m} m"
                ),
                hint: format!("set spacing_m of the preset to {}", spacing_m.clamp(least, most)),
            });
        }
        if self == Profile::Blender && meshes.compressed {
            return Err(Error::Option {
                message: "Blender does not read EXT_meshopt_compression, which --meshopt asks for".into(),
                hint: "leave out --meshopt; --quantize makes files smaller, and Blender reads it".into(),
            });
        }
        sizes::check(self, world, region)
    }

    /// Writes the files besides the exports.
    pub(super) fn write(
        self,
        world: &World,
        region: &Region,
        preset_name: &str,
        out: &Path,
    ) -> Result<Vec<FileRecord>, Error> {
        let notes = notes::notes(self, world, region, preset_name);
        let texts = [(NOTES, &notes[..]), SCRIPT];
        let written = texts.into_iter().filter(|(path, _)| self.written().contains(path));
        let write = |(path, text): (&str, &str)| {
            Ok(FileRecord::new(path.to_owned(), self.name(), write_whole(out.join(path), text.as_bytes())?))
        };
        written.map(write).collect()
    }
}

impl FromStr for Profile {
    type Err = Error;

    fn from_str(name: &str) -> Result<Profile, Error> {
        Profile::ALL.into_iter().find(|profile| profile.name() == name).ok_or_else(|| {
            let names = || Profile::ALL.into_iter().map(Profile::name);
            let list = names().collect::<Vec<_>>().join(", ");
            Error::Option {
                message: format!("there is no profile named {name:?}"),
                hint: match nearest(name, names()) {
                    Some(meant) => format!("did you mean {meant}? profiles: {list}"),
                    None => format!("profiles: {list}"),
                },
            }
        })
    }
}
