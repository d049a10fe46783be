//! Instances as text: the objects on each tile, point by point, for programs that take lists of points and no
//! densities.
//!
//! One CSV file per tile, with a header line. `x_m`, `y_m` and `z_m` are metres east, up and south of the origin of the
//! meshes ([`splines`](super::splines) has what engines make of these axes); `east_m` and `north_m` are metres from the
//! world's origin, the same in every region. `y_m` is the height in both. `yaw_deg` turns anticlockwise seen from
//! above; `scale` is 1 on the average. `plant` is a plant of the biome at the place, and `tall_m` its height in metres;
//! in a world without a geography `plant` is the kind again. [`A_HECTARE`](crate::tile::A_HECTARE) has the number of instances per hectare
//! where densities are 255.

use std::path::{Path, PathBuf};

use crate::area::{Area, Place, Region};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request};
use crate::export::plan::digits::push_decimal;
use crate::export::plan::options::TileNames;
use crate::file::write_whole;
use crate::tile::{Grows, Tile, instances, most_instances};
use crate::watch::Watch;
use crate::world::World;

/// The folder of the files, inside the bake's folder.
const FOLDER: &str = "instances";

const HEADS: &str = "kind,x_m,y_m,z_m,east_m,north_m,yaw_deg,scale,plant,tall_m\n";

/// Most bytes of a line: the longest kind and plant, metres with three decimals on the furthest tiles, and the rest.
const LINE_BYTES: u64 = 136;

/// Instances, as a format: one text file per tile.
pub(crate) struct Instances;

impl Format for Instances {
    fn name(&self) -> &'static str {
        "instances"
    }

    fn about(&self) -> &'static str {
        "trees, shrubs, tufts and rocks as points, a CSV a tile: at most 60, 30, 30 and 20 a hectare"
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn options(&self) -> &'static [&'static str] {
        &["--mesh-origin"]
    }

    fn is_of_tiles_alone(&self) -> bool {
        true
    }

    // These files are no rasters, but a larger region keeps them like rasters, since its meshes keep their origin.
    fn rasters_of(&self, region: &Region, place: Place, names: TileNames) -> Vec<String> {
        vec![path(region, place, names)]
    }

    fn files(&self, request: &Request) -> u64 {
        request.region.tiles()
    }

    fn held_bytes(&self, request: &Request, threads: usize) -> u64 {
        threads as u64 * LINE_BYTES * most_instances(request.world, request.region.tile_cells())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        let Request { world, region, names, .. } = *request;
        let origin = request.meshes.origin.expect("a plan has one");
        Ok(vec![Box::new(InstanceSink { world, region, names, origin, grows: Grows::new(world), out: out.to_owned() })])
    }
}

/// Returns the path of a tile's file.
fn path(region: &Region, place: Place, names: TileNames) -> String {
    let [x, y] = names.numbers(region, place);
    format!("{FOLDER}/instances_x{x}_y{y}.csv")
}

/// Writes the files, each by the thread that made the tile.
struct InstanceSink<'a> {
    world: &'a World,
    region: Region,
    names: TileNames,
    /// The vertex at the meshes' origin.
    origin: [i64; 2],
    grows: Grows<'a>,
    out: PathBuf,
}

impl InstanceSink<'_> {
    fn text(&self, tile: &Tile) -> String {
        let Area { x0, y0, .. } = tile.area();
        let spacing_m = tile.spacing_m();
        let corner = [(x0 - self.origin[0]) as f64, (y0 - self.origin[1]) as f64];
        let mut text = String::from(HEADS);
        for instance in instances(self.world, &self.grows, tile) {
            let [east, south] = instance.place;
            text.push_str(instance.growth.name());
            let metres = [
                (corner[0] + east) * spacing_m,
                instance.height_m,
                (corner[1] + south) * spacing_m,
                (x0 as f64 + east) * spacing_m,
                // Not a plain minus sign, which would make 0.0 a -0.0.
                0.0 - (y0 as f64 + south) * spacing_m,
            ];
            for metres in metres {
                text.push(',');
                push_decimal(&mut text, metres, 3);
            }
            for (number, digits) in [(instance.yaw_deg, 1), (instance.scale, 3)] {
                text.push(',');
                push_decimal(&mut text, number, digits);
            }
            text.push(',');
            text.push_str(instance.plant.name);
            text.push(',');
            push_decimal(&mut text, instance.tall_m(), 2);
            text.push('\n');
        }
        text
    }
}

impl Sink for InstanceSink<'_> {
    fn name(&self) -> &'static str {
        "instances/*.csv"
    }

    fn take(&self, tile: &Tile, place: Place, _clock: &Clock) -> Result<Kept, Error> {
        let path = path(&self.region, place, self.names);
        let finished = write_whole(self.out.join(&path), self.text(tile).as_bytes())?;
        let record = FileRecord { tile: Some(tile.id()), ..FileRecord::new(path, Instances.name(), finished) };
        Ok(Kept { piece: Vec::new(), files: vec![record] })
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        Ok(Vec::new())
    }
}
