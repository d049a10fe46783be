//! Profiles: the formats and files that a certain program takes, chosen together.
//!
//! ```text
//!   mod.rs     the profiles: their formats and what they refuse
//!   sizes.rs   region -> the nearest region that a profile takes
//!   notes.rs   world, region -> IMPORT.md
//!   import_terrane.py   bake.json, GLBs -> a scene in Blender
//! ```

mod notes;
mod sizes;

use std::path::Path;
use std::str::FromStr;

use crate::area::Region;
use crate::bake::FileRecord;
use crate::error::Error;
use crate::export::formats::format::Request;
use crate::export::formats::raster::Rasters;
use crate::export::formats::raster::image::Image;
use crate::export::formats::raster::quantity::{
    CONTROL, COVER_WEIGHTS, GROUND_WEIGHTS, HEIGHT, HEIGHT_STEPS, WEIGHTS, WHOLE_HEIGHT_STEPS,
};
use crate::export::formats::raster::writer::Encoding;
use crate::export::formats::{Export, unknown};
use crate::export::plan::options::{Lods, MeshOptions};
use crate::file::write_whole;
use crate::mesh::default_origin;
use crate::tile::Material;
use crate::world::World;

use notes::typed;
pub(super) use sizes::components;

/// A program that takes the files of a bake, and all that it needs to be given.
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

/// The text beside the exports.
const NOTES: &str = "IMPORT.md";

/// The script beside the exports, and its text.
const SCRIPT: (&str, &str) = ("import_terrane.py", include_str!("import_terrane.py"));

/// Range of metres between vertices in Terrain3D, which clamps other values. Source: `Terrain3D::set_vertex_spacing`.
const TERRAIN3D_SPACING_M: [f64; 2] = [0.25, 100.0];

const fn weight(stem: &'static str, material: Material) -> Image {
    Image::new(stem, &WEIGHTS[material as usize], Encoding::Png)
}

// In these names no digit follows an x, y, u or v, except in the place of a tile: Unreal would take the name for that
// of a tile.
const UNREAL: [Image; 9] = [
    Image::new("unreal/height", &HEIGHT_STEPS, Encoding::Png),
    weight("unreal/grass", Material::Grass),
    weight("unreal/dirt", Material::Dirt),
    weight("unreal/rock", Material::Rock),
    weight("unreal/sand", Material::Sand),
    weight("unreal/snow", Material::Snow),
    weight("unreal/forest", Material::Forest),
    weight("unreal/scree", Material::Scree),
    weight("unreal/wetland", Material::Wetland),
];

const UNREAL_TILED: [Image; 9] = {
    let [height, grass, dirt, rock, sand, snow, forest, scree, wetland] = UNREAL;
    [
        height.owned_only(),
        grass.owned_only(),
        dirt.owned_only(),
        rock.owned_only(),
        sand.owned_only(),
        snow.owned_only(),
        forest.owned_only(),
        scree.owned_only(),
        wetland.owned_only(),
    ]
};

const UNITY: [Image; 3] = [
    Image::new("unity/height", &HEIGHT_STEPS, Encoding::Raw).named_from_south().upside_down(),
    Image::new("unity/splat_ground", &GROUND_WEIGHTS, Encoding::Png).named_from_south().owned_only(),
    Image::new("unity/splat_cover", &COVER_WEIGHTS, Encoding::Png).named_from_south().owned_only(),
];

const TERRAIN3D: [Image; 4] = [
    Image::new("terrain3d/height", &HEIGHT, Encoding::ExrRgb).owned_only(),
    Image::new("terrain3d/control", &CONTROL, Encoding::ExrRgb).owned_only(),
    Image::new("terrain3d/splat_ground", &GROUND_WEIGHTS, Encoding::Png).owned_only(),
    Image::new("terrain3d/splat_cover", &COVER_WEIGHTS, Encoding::Png).owned_only(),
];

// The file names are those that HTerrain gives to its own maps.
const HTERRAIN: [Image; 3] = [
    Image::new("hterrain/height", &WHOLE_HEIGHT_STEPS, Encoding::Raw),
    Image::new("hterrain/splat", &GROUND_WEIGHTS, Encoding::Png),
    Image::new("hterrain/splat_1", &COVER_WEIGHTS, Encoding::Png),
];

const fn engine(name: &'static str, about: &'static str, tiles: bool, images: &'static [Image]) -> Rasters {
    Rasters { name, about, tiles, placed: false, images }
}

/// The formats that only the profile of the same name can ask for.
pub(super) static FORMATS: [Rasters; 5] = [
    engine("unreal", "16-bit PNG, and a weight map a layer", false, &UNREAL),
    engine("unreal-tiled", "the same a tile, without the shared edge", true, &UNREAL_TILED),
    engine("unity", "RAW from the south, and splat maps, a tile each", true, &UNITY),
    engine("godot-terrain3d", "heights in metres, control map, splat maps", false, &TERRAIN3D),
    engine("hterrain", "RAW, and splat maps", false, &HTERRAIN),
];

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

    /// The options that only some exports read, and that the profiles' own files mention.
    pub(crate) const OPTIONS: &[&str] = &["--mesh-origin"];

    /// Returns the name by which the command knows the profile.
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

    /// Returns a short description of the profile's files.
    pub fn about(self) -> &'static str {
        match self {
            Profile::Blender => {
                "GLBs, heights, and a script that builds the scene: collections, materials, water, sun, camera"
            }
            Profile::GodotTerrain3d => "heights in metres, control map and splat maps for Godot's Terrain3D",
            Profile::Unreal => "one landscape: 16-bit heights and a weight map a layer",
            Profile::UnrealTiled => "a landscape in tiles without shared edges",
            Profile::Unity => "a RAW and splat maps a tile",
            Profile::Hterrain => "a square RAW and splat maps for Godot's HTerrain",
        }
    }

    /// Returns the levels of detail of the profile's meshes if none are chosen.
    pub fn lods(self) -> Lods {
        match self {
            // A mesh with every vertex is more than Blender's window can turn around.
            Profile::Blender => Lods::only(1),
            _ => Lods::default(),
        }
    }

    /// Returns the vertex of the world that is the origin of a region's files if nobody asks for another one; `None` if
    /// the program takes the usual origin.
    pub fn origin(self, region: &Region) -> Option<[i64; 2]> {
        (self == Profile::GodotTerrain3d).then(|| sizes::terrain3d_origin(region))
    }

    /// Returns the exports of the profile.
    pub(crate) fn exports(self) -> Vec<Export> {
        let names: &[&str] = match self {
            // Blender needs no format of its own. The heights are for users who displace a plane by them.
            Profile::Blender => &["gltf", "height"],
            _ => &[self.name()],
        };
        Export::known().filter(|export| names.contains(&export.name())).collect()
    }

    /// Returns the files that the profile writes besides the exports.
    pub(crate) fn written(self) -> &'static [&'static str] {
        match self {
            Profile::Blender => &[NOTES, SCRIPT.0],
            _ => &[NOTES],
        }
    }

    /// Checks that the profile takes a region of a world.
    ///
    /// # Errors
    /// When it does not; the hint names the nearest region that it takes.
    pub(crate) fn check(self, world: &World, region: &Region, meshes: &MeshOptions) -> Result<(), Error> {
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
        sizes::check(self, world, region)?;
        let origin = meshes.origin.unwrap_or_else(|| default_origin(region));
        if self == Profile::GodotTerrain3d && !sizes::is_on_terrain3d(region, origin) {
            let metres = |[x, y]: [i64; 2]| format!("{},{}", typed(x as f64 * spacing_m), typed(-y as f64 * spacing_m));
            return Err(Error::Region {
                message: format!(
                    "a terrain of Terrain3D has 16 regions to each side of its origin, which is a corner of tiles; this one, of \
                     {} x {} tiles from {}, {} on, does not fit around --mesh-origin {}",
                    region.cols(),
                    region.rows(),
                    region.at().x,
                    region.at().y,
                    metres(origin)
                ),
                hint: format!(
                    "give --mesh-origin {}, and the same to all bakes that go into one terrain",
                    metres(sizes::terrain3d_origin(region))
                ),
            });
        }
        Ok(())
    }

    /// Returns the nearest region that the profile takes, and the options that ask for it; `None` if it takes the given
    /// one. Tiles of that region may have another size, which the caller must give to the world.
    ///
    /// # Errors
    /// When the profile takes no region of that world.
    pub fn fitted(self, world: &World, region: &Region) -> Result<Option<(Region, String)>, Error> {
        sizes::fitted(self, world, region)
    }

    /// Writes the files besides the exports.
    pub(crate) fn write(self, request: &Request, out: &Path) -> Result<Vec<FileRecord>, Error> {
        let notes = notes::notes(self, request);
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
            let (message, hint) = unknown("profile", name, &Profile::ALL.map(Profile::name));
            Error::Option { message, hint }
        })
    }
}
