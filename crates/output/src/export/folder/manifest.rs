//! `bake.json`: the input of a bake and the list of its files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

use schemars::{JsonSchema, Schema};
use serde::de::Error as _;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::area::{Place, Region, Stride, TileId};
use crate::bake::{FileRecord, Shard, shard_store};
use crate::error::{Error, clipped};
use crate::export::formats::web;
use crate::export::plan::bounds;
use crate::export::plan::digits::{noise_m, shortest};
use crate::export::{Export, MeshOptions, Plan, Profile, TileNames, VectorOptions};
use crate::generator;
use crate::preset::Preset;
use crate::walker::{Tour, Walk};
use crate::world::World;

/// Name of the file in the folder of the bake. The file is written last: if it exists, all files that it lists are
/// whole.
pub(crate) const PATH: &str = "bake.json";

/// The input of a bake and the list of its files. The same bake writes the same bytes: the manifest has no date.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Manifest {
    /// Always `terrane bake`.
    pub format: String,
    /// Version of this file's form; a reader should refuse a higher one.
    pub format_version: u32,
    /// Version of the program.
    pub generator: String,
    /// Version of each layer of the program: with other versions, the same preset may give another world. None in old
    /// files.
    #[serde(default)]
    pub layers: BTreeMap<String, u32>,
    /// The preset's name.
    pub preset_name: String,
    /// The preset with every default filled in.
    pub preset: Preset,
    /// The seed in use.
    pub seed: u64,
    /// The tiles that were baked.
    pub region: RegionRecord,
    /// Vertices of the preset's spacing from one vertex of the files to the next: 1, or a power of two of a bake at a
    /// scale.
    pub stride: i64,
    /// Metres between neighbouring vertices of the files.
    pub spacing_m: f64,
    /// Scale of 16-bit heights.
    pub height_range: HeightRange,
    /// Height of the sea's surface in metres, where the world has a sea.
    pub sea_level_m: Option<f64>,
    /// Orientation of rasters in the world.
    pub axes: Axes,
    /// The exports that were asked for, those of the profile included.
    #[serde(default)]
    pub exports: Vec<String>,
    /// The profile that was asked for, if any.
    #[serde(default)]
    pub profile: Option<String>,
    /// Options of meshes.
    #[serde(default)]
    pub meshes: MeshOptions,
    /// Naming of the files of tiles.
    #[serde(default)]
    pub tile_names: TileNames,
    /// Options of vectors.
    #[serde(default)]
    pub vectors: VectorOptions,
    /// The walk that was baked: the tiles of the region that it has, and their order. None if all tiles of the region
    /// were baked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walk: Option<Tour>,
    /// The shard of the region that was baked: the tiles that it has. None if all tiles of the region were baked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<ShardRecord>,
    /// Every other file of the bake, sorted by path.
    pub files: Vec<FileRecord>,
    /// BLAKE3 hash, in hexadecimal, of this file with this value empty; none in old files.
    #[serde(default)]
    pub blake3: String,
}

/// The tiles that were baked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionRecord {
    /// The north-western tile. In file names, tiles count from this one, `x0_y0`, unless files are named after the
    /// world.
    pub at: TileId,
    /// Tiles from west to east.
    pub cols: u64,
    /// Tiles from north to south.
    pub rows: u64,
    /// Cells a tile side; a tile has one vertex more.
    pub tile_cells: u32,
    /// Western, southern, eastern and northern edge in kilometres east and north of the world's origin.
    pub bounds_km: [f64; 4],
    /// Vertices from west to east.
    pub width: u64,
    /// Vertices from north to south.
    pub height: u64,
    /// Metres east and south of the world's origin at which the north-western vertex lies.
    pub origin_m: [f64; 2],
    /// Metres east and south of the world's origin at which the origin of all meshes lies.
    pub mesh_origin_m: [f64; 2],
}

impl RegionRecord {
    /// Records a region, the distance between its vertices, and the origin of its meshes.
    pub(crate) fn new(region: &Region, spacing_m: f64, mesh_origin_m: [f64; 2]) -> RegionRecord {
        let TileId { x, y } = region.at();
        let metres = |tile: i64| (tile * region.tile_cells() as i64) as f64 * spacing_m;
        RegionRecord {
            at: region.at(),
            cols: region.cols(),
            rows: region.rows(),
            tile_cells: region.tile_cells(),
            bounds_km: region.bounds_km(spacing_m),
            width: region.width(),
            height: region.height(),
            origin_m: [metres(x), metres(y)],
            mesh_origin_m,
        }
    }

    /// Returns the region.
    ///
    /// # Errors
    /// When the numbers make no possible region.
    pub fn region(&self) -> Result<Region, Error> {
        Region::new(self.at, self.cols, self.rows, self.tile_cells)
    }
}

/// The tiles of a region that belong to a shard.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ShardRecord {
    /// Number of the shard, from 1 on.
    pub number: u64,
    /// Number of shards of the region.
    pub of: u64,
    /// The north-western tile of the shard.
    pub at: TileId,
    /// Tiles from west to east.
    pub cols: u64,
    /// Tiles from north to south.
    pub rows: u64,
}

impl ShardRecord {
    /// Records a shard of a region.
    ///
    /// # Errors
    /// When there is no such shard.
    pub(crate) fn of(shard: Shard, whole: &Region) -> Result<ShardRecord, Error> {
        let tiles = shard.region(whole)?;
        Ok(ShardRecord {
            number: shard.number(),
            of: shard.of(),
            at: tiles.at(),
            cols: tiles.cols(),
            rows: tiles.rows(),
        })
    }

    /// Returns the rectangle of the shard's tiles, if all of them are tiles of the given region.
    pub(crate) fn tiles(&self, whole: &Region) -> Option<Region> {
        let tiles = Region::new(self.at, self.cols, self.rows, whole.tile_cells()).ok()?;
        let last = tiles.tile(Place { row: tiles.rows() - 1, col: tiles.cols() - 1 });
        [tiles.at(), last].into_iter().all(|tile| whole.place(tile).is_some()).then_some(tiles)
    }
}

impl std::fmt::Display for ShardRecord {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Scale of 16-bit heights: `min_m + value / 65535 * (max_m - min_m)`. A property of the world, the same in all its
/// bakes, unless another range was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeightRange {
    /// Metres of the value 0. No height of the world is lower, or lower heights have the value 0 too.
    pub min_m: f32,
    /// Metres of the value 65535. No height of the world is higher, or higher heights have the value 65535 too.
    pub max_m: f32,
    /// Metres from one value to the next.
    pub step_m: f32,
}

impl HeightRange {
    /// Returns the range that was asked for; `None` if the range is the world's own.
    fn asked_for(&self, world: &World) -> Option<[f32; 2]> {
        (world.height_range_m() != (self.min_m, self.max_m)).then_some([self.min_m, self.max_m])
    }

    /// Returns the lowest and the highest height as people write them: without the rounding noise of 32-bit numbers.
    pub fn written_m(&self) -> [String; 2] {
        let [min_m, max_m] = [self.min_m, self.max_m].map(f64::from);
        [min_m, max_m].map(|height_m| shortest(height_m, noise_m(min_m, max_m)))
    }
}

/// Orientation of rasters in the world.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Axes {
    /// Direction of columns.
    pub columns: String,
    /// Direction of rows.
    pub rows: String,
    /// Direction and unit of heights.
    pub heights: String,
    /// Convention of normal maps.
    pub normals: String,
}

/// Values of [`Manifest::format`] and [`Manifest::format_version`].
pub(crate) const FORMAT: &str = "terrane bake";
const FORMAT_VERSION: u32 = 1;

/// The fields that tell if the rest can be read. The file may be of any kind, so these fields take any value.
#[derive(Deserialize)]
struct ManifestHead {
    #[serde(default)]
    format: Value,
    #[serde(default)]
    format_version: Value,
}

impl Manifest {
    /// Reads the manifest of the bake in a folder.
    ///
    /// # Errors
    /// When the file is missing, is no manifest, or has a newer form than this program knows.
    pub fn read(folder: &Path) -> Result<Manifest, Error> {
        Manifest::read_file(&folder.join(PATH))
    }

    /// Reads the manifest in a file.
    pub(crate) fn read_file(path: &Path) -> Result<Manifest, Error> {
        let refuse =
            |message: String, hint: &str| Error::Output { path: path.to_owned(), message, hint: hint.to_owned() };
        let rebake = "bake again with this program";
        let text = fs::read_to_string(path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
                refuse("is not there, so the folder holds no finished bake".into(), "name the folder of a bake")
            }
            io::ErrorKind::InvalidData => refuse(format!("cannot be read: {error}"), rebake),
            _ => Error::io(path)(error),
        })?;
        let broken = |error: serde_json::Error| refuse(format!("cannot be read: {error}"), rebake);
        let ManifestHead { format, format_version } = serde_json::from_str(&text).map_err(broken)?;
        if format != FORMAT {
            return Err(refuse(format!("is not the manifest of a bake: expected \"format\": {FORMAT:?}"), rebake));
        }
        match format_version.as_u64() {
            Some(version) if version > u64::from(FORMAT_VERSION) => Err(refuse(
                format!("has the form {version}, and this program knows those up to {FORMAT_VERSION}"),
                "use a newer terrane",
            )),
            _ => Manifest::parse(&text).map_err(broken),
        }
    }

    /// Makes the manifest of a bake that has left `files`.
    pub(crate) fn new(plan: &Plan<'_>, mut files: Vec<FileRecord>) -> Manifest {
        let (preset_name, world, region) = (plan.preset_name(), plan.world(), plan.region());
        // Sinks finish in any order.
        files.sort_by(|a, b| a.path.cmp(&b.path));
        let (min_m, max_m) = plan.height_range_m();
        let spacing_m = world.spacing_m();
        let mesh_origin_m = plan.mesh_origin().map(|at| at as f64 * spacing_m);
        let manifest = Manifest {
            format: FORMAT.to_owned(),
            format_version: FORMAT_VERSION,
            generator: generator::NAME.to_owned(),
            layers: generator::layers(),
            preset_name: preset_name.to_owned(),
            preset: world.preset().clone(),
            seed: world.seed(),
            region: RegionRecord::new(region, spacing_m, mesh_origin_m),
            stride: world.stride().vertices(),
            spacing_m,
            height_range: HeightRange { min_m, max_m, step_m: (max_m - min_m) / 65535.0 },
            sea_level_m: world.preset().sea_level_m,
            axes: Axes {
                columns: "from west to east".to_owned(),
                rows: "from north to south".to_owned(),
                heights: "up, in metres".to_owned(),
                normals: "OpenGL: red is east, green is north, blue is up; (value - 127.5) / 127.5".to_owned(),
            },
            exports: plan.exports().iter().map(|export| export.name().to_owned()).collect(),
            profile: plan.profile().map(|profile| profile.name().to_owned()),
            meshes: plan.meshes().clone(),
            tile_names: plan.names(),
            vectors: plan.vectors().clone(),
            walk: plan.walk().map(|walk| walk.tour().clone()),
            shard: plan.shard().cloned(),
            files,
            blake3: String::new(),
        };
        Manifest { blake3: manifest.hash(), ..manifest }
    }

    /// Returns the world that was baked.
    ///
    /// # Errors
    /// When another version of the program has baked it, whose tiles may differ, or when the manifest describes an
    /// impossible world.
    pub fn world(&self) -> Result<World, Error> {
        self.check_generator()?;
        let stride = u64::try_from(self.stride).ok().and_then(Stride::new).ok_or_else(|| Error::Option {
            message: format!("the manifest has a stride of {}", self.stride),
            hint: "bake again".into(),
        })?;
        let world = World::strided(self.preset.clone(), Some(self.seed), stride)?;
        Ok(world.with_tile_cells(self.region.tile_cells))
    }

    /// Checks that this program makes the same world from the same preset.
    ///
    /// # Errors
    /// When a layer of this program has another version.
    pub fn check_generator(&self) -> Result<(), Error> {
        let here = generator::layers();
        if self.layers == here {
            return Ok(());
        }
        let other = |(layer, version): (&String, &u32)| here.get(layer) != Some(version);
        let others = self.layers.iter().filter(|layer| other(*layer)).map(|(layer, _)| layer.as_str());
        let others: Vec<&str> = others.chain(self.layers.is_empty().then_some("no layers")).collect();
        Err(Error::Option {
            message: format!(
                "this bake is of {}, which this one, {}, is not the same as: its manifest names {}",
                self.generator,
                generator::NAME,
                if others.is_empty() { "fewer layers".to_owned() } else { others.join(", ") }
            ),
            hint: "its tiles may be others here: use that version, or bake it again".into(),
        })
    }

    /// Lists the differences in what was asked for, as `key: this manifest's value, not the other's`, for those
    /// top-level keys that `counts` accepts.
    pub(crate) fn differences(&self, other: &Manifest, counts: impl Fn(&str) -> bool) -> Vec<String> {
        const ASKED: [&str; 10] = [
            "layers",
            "preset_name",
            "seed",
            "preset",
            "region",
            "stride",
            "height_range",
            "tile_names",
            "exports",
            "profile",
        ];
        let [own, other] = [self, other].map(|manifest| serde_json::to_value(manifest).expect("a manifest is JSON"));
        let mut found = Vec::new();
        // The walk comes early, since its region only follows from it.
        for key in ["shard", "walk"].into_iter().chain(ASKED).chain(["meshes", "vectors"]).filter(|key| counts(key)) {
            compare(key, &own[key], &other[key], &mut found);
        }
        found
    }

    /// Returns all files of the bake in a folder: those in the manifest, and those in listings of their own, which are
    /// too many for the manifest.
    pub(crate) fn all_files(&self, folder: &Path) -> Vec<FileRecord> {
        let listed = self.files.iter().filter(|record| web::is_listing(&record.path));
        let listed = listed.flat_map(|listing| web::listed(folder, listing));
        self.files.iter().cloned().chain(listed).collect()
    }

    /// Returns the tiles that were baked.
    ///
    /// # Errors
    /// When the region, the walk or the shard is impossible, or when another version of the program has baked the walk.
    pub(crate) fn tiles(&self) -> Result<BTreeSet<TileId>, Error> {
        if let Some(tour) = &self.walk {
            return Ok(Walk::new(tour.clone(), &self.world()?)?.tiles().clone());
        }
        let whole = self.region.region()?;
        let region = match &self.shard {
            None => whole,
            Some(shard) => shard.tiles(&whole).ok_or_else(|| Error::Option {
                message: format!("the manifest has a shard {shard} that is no part of its region"),
                hint: "bake again".into(),
            })?,
        };
        let places = (0..region.rows()).flat_map(|row| (0..region.cols()).map(move |col| Place { row, col }));
        Ok(places.map(|place| region.tile(place)).collect())
    }

    /// Refuses the manifest of a walk, which looks like that of a bake in all else.
    ///
    /// # Errors
    /// When it is one.
    pub fn check_is_no_walk(&self, folder: &Path) -> Result<(), Error> {
        match self.walk {
            None => Ok(()),
            Some(_) => Err(Error::Output {
                path: folder.to_owned(),
                message: "holds a walk, whose rivers and roads are its own, and whose tiles are no rectangle".into(),
                hint: "walk another way with terrane walk, or name the folder of a bake".into(),
            }),
        }
    }

    /// Refuses the manifest of a shard, which lacks tiles of its region, and all files of the whole region.
    ///
    /// # Errors
    /// When it is one.
    pub fn check_is_no_shard(&self, folder: &Path) -> Result<(), Error> {
        match &self.shard {
            None => Ok(()),
            Some(shard) => Err(Error::Output {
                path: folder.to_owned(),
                message: format!("holds the shard {shard} of a bake"),
                hint: "put all shards together with terrane merge, and name the folder of that".into(),
            }),
        }
    }

    /// Returns the exports that the manifest names.
    ///
    /// # Errors
    /// When one of them is not known.
    pub fn known_exports(&self) -> Result<Vec<Export>, Error> {
        let export = |name: &String| {
            let unknown = || Error::Export {
                message: format!("the manifest names an export {name:?} that is not known"),
                hint: "bake again with this program".into(),
            };
            Export::known().find(|export| export.name() == name).ok_or_else(unknown)
        };
        self.exports.iter().map(export).collect()
    }

    /// True if the bake has the files of an export.
    pub(crate) fn has(&self, export: Export) -> bool {
        self.exports.iter().any(|name| name == export.name())
    }

    /// True if an export of the bake reads the option, which only some exports read.
    pub fn reads(&self, option: &str) -> bool {
        Export::known().any(|export| export.0.options().contains(&option) && self.has(export))
    }

    /// Returns the range of 16-bit heights, if it is not the world's own.
    pub fn chosen_range_m(&self, world: &World) -> Option<[f32; 2]> {
        self.height_range.asked_for(world)
    }

    /// Computes the hash of the manifest with an empty hash field.
    fn hash(&self) -> String {
        let unsealed = Manifest { blake3: String::new(), ..self.clone() };
        blake3::hash(unsealed.to_json().as_bytes()).to_hex().to_string()
    }

    /// True if the manifest has the hash that it was written with, so nothing in it was changed.
    pub(crate) fn is_sealed(&self) -> bool {
        self.blake3 == self.hash()
    }

    /// Parses a manifest; refuses any that no bake could have written.
    pub(crate) fn parse(text: &str) -> serde_json::Result<Manifest> {
        serde_json::from_str::<bounds::TextCheck>(text)?;
        serde_json::from_str::<Manifest>(text)?.checked().map_err(serde_json::Error::custom)
    }

    /// Returns the manifest, if a bake could have written it.
    ///
    /// # Errors
    /// When a value is out of its bounds; the error names it.
    pub(crate) fn checked(self) -> Result<Manifest, String> {
        bounds::check(&self).map(|()| self)
    }

    /// Returns the JSON schema of the file, with all names that the exports of its files can have.
    pub fn schema() -> Schema {
        let mut schema = schemars::schema_for!(Manifest);
        let profiles = Profile::ALL.into_iter().map(Profile::name);
        let names: BTreeSet<_> =
            Export::known().map(Export::name).chain(profiles).chain(["registry", shard_store::EXPORT]).collect();
        let export = schema.pointer_mut("/$defs/FileRecord/properties/export").expect("files have exports");
        // The Rust type is a string; the possible names are known only here.
        export["enum"] = names.into_iter().collect();
        schema
    }

    /// Returns the file's text.
    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a manifest has only names and finite numbers") + "\n"
    }
}

/// Adds the differences between two values under a key.
fn compare(key: &str, own: &Value, other: &Value, found: &mut Vec<String>) {
    match (own, other) {
        (Value::Object(one), Value::Object(two)) => {
            let keys: BTreeSet<&String> = one.keys().chain(two.keys()).collect();
            for inner in keys {
                let [one, two] = [one, two].map(|object| object.get(inner).unwrap_or(&Value::Null));
                compare(&format!("{key}.{inner}"), one, two, found);
            }
        }
        _ if own != other => {
            // A value, such as a path, may be long.
            let [own, other] = [own, other].map(|value| clipped(&value.to_string()));
            found.push(format!("{key}: {own}, not {other}"));
        }
        _ => {}
    }
}
