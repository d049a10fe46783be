//! Rivers and roads as lines: what the vector exports write, collected tile by tile.
//!
//! Coordinates are metres in the plane of the world: east is x, north is y, so y is the negative of the lattice's
//! south and a map shows north up. No coordinate reference system of the Earth applies. A path is one feature, whole,
//! even where it leaves the region, and once, however many tiles it crosses.

use std::collections::BTreeMap;
use std::path::Path as FilePath;
use std::sync::{Arc, Mutex};

use rusqlite::{Connection, params};

use crate::agents::paths::{Path, PathEnding};
use crate::agents::way::WayKind;
use crate::area::{Area, Region, TileId};
use crate::error::Error;
use crate::export::file::PartFile;
use crate::preset::Preset;
use crate::registry::unjournaled;
use crate::tile::Tile;
use crate::world::World;

/// A river or a road as the exports write it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Feature {
    pub kind: WayKind,
    /// The tile whose hash has started it: with the kind, its name in the world.
    pub owner: TileId,
    /// `sea`, `river`, `pond` or `nothing`.
    pub ending: &'static str,
    /// The owner of the river that it ends in.
    pub joins: Option<TileId>,
    pub length_m: f64,
    /// Width at its start and at its end.
    pub width_m: [f32; 2],
    /// Height of the bed's floor, or of the road, at its start and at its end.
    pub floor_m: [f32; 2],
    /// Metres east and north; at least two points.
    pub line: Vec<[f64; 2]>,
}

const ENDINGS: [&str; 4] = ["sea", "river", "pond", "nothing"];

impl Feature {
    /// The feature of a path in a world of that spacing.
    pub fn new(path: &Path, spacing_m: f64) -> Feature {
        let (points, origin) = (path.way.points(), path.way.origin());
        let mut line: Vec<[f64; 2]> = points
            .iter()
            .map(|point| {
                let south_m = (origin.1 as f64 + point.south as f64) * spacing_m;
                // Not the negative, which has a zero of its own.
                [(origin.0 as f64 + point.east as f64) * spacing_m, 0.0 - south_m]
            })
            .collect();
        let step_m = |pair: &[[f64; 2]]| {
            let [east, north] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            (east * east + north * north).sqrt()
        };
        // Not `sum`, whose nothing is the negative zero.
        let length_m = line.windows(2).map(step_m).fold(0.0, |sum, step| sum + step);
        // A line has two points in every format, and a way may be one place.
        if line.len() == 1 {
            line.push(line[0]);
        }
        let (first, last) = (points[0], points[points.len() - 1]);
        let (ending, joins) = match path.ending {
            PathEnding::Sea => (ENDINGS[0], None),
            PathEnding::River(other) => (ENDINGS[1], Some(other)),
            PathEnding::Pond => (ENDINGS[2], None),
            PathEnding::Nothing => (ENDINGS[3], None),
        };
        Feature {
            kind: path.way.kind(),
            owner: path.owner,
            ending,
            joins,
            length_m,
            width_m: [2.0 * first.half_width_m, 2.0 * last.half_width_m],
            floor_m: [first.floor_m, last.floor_m],
            line,
        }
    }
}

/// The most bytes that a vector export of a region takes, the store of its paths among them.
///
/// How long paths are shows only when they are made; this is room for ways four times as long as their reach.
pub(crate) fn bytes_at_most(preset: &Preset, region: &Region) -> u64 {
    // A footprint with its row; and a point of a path as text with all digits, and in the store.
    const TILE_BYTES: u64 = 256;
    const POINT_BYTES: u64 = 44 + 16;
    const FEATURE_BYTES: u64 = 1024;
    let paths = |density: f64, max_tiles: u32| {
        let side = |count: u64| count.saturating_add(2 * max_tiles as u64);
        let owners = side(region.cols()).saturating_mul(side(region.rows())) as f64 * density;
        // A point is at most every vertex.
        let points = 4 * (max_tiles as u64 + 1) * region.tile_cells() as u64;
        (owners.ceil() as u64).saturating_mul(points * POINT_BYTES + FEATURE_BYTES)
    };
    let rivers = preset.rivers.as_ref().map_or(0, |rivers| paths(rivers.density, rivers.max_tiles));
    let roads = preset.roads.as_ref().map_or(0, |roads| paths(roads.density, roads.max_tiles));
    let tiles = region.tiles().saturating_mul(TILE_BYTES);
    // What an empty database takes.
    [rivers, roads, tiles, 1 << 18].into_iter().fold(0, u64::saturating_add)
}

/// The paths of a region, each once, sorted when they are read.
///
/// Paths wait in memory for their row of tiles and then in a nameless database in the folder of the bake, so memory
/// does not grow with the region.
pub(crate) struct PathStore {
    area: Area,
    spacing_m: f64,
    waiting: Mutex<BTreeMap<(WayKind, TileId), Arc<Path>>>,
    store: Mutex<(Connection, PartFile)>,
}

impl PathStore {
    /// The store of the paths that touch a region, in the folder in which its file will be.
    pub fn create(world: &World, region: &Region, file: &FilePath) -> Result<PathStore, Error> {
        let mut part = PartFile::create(file.with_extension("paths"))?;
        let path = part.lend();
        let open = || {
            let connection = Connection::open(path)?;
            unjournaled(&connection)?;
            connection.execute_batch(
                "CREATE TABLE paths (kind, x, y, ending, joins_x, joins_y, length_m, width_0, width_1, floor_0, floor_1, \
                 line, PRIMARY KEY (kind, x, y))",
            )?;
            Ok(connection)
        };
        let connection = open().map_err(Error::sqlite(path))?;
        let first = region.at().area(region.tile_cells());
        Ok(PathStore {
            area: Area::new(first.x0, first.y0, region.width() as usize, region.height() as usize),
            spacing_m: world.spacing_m(),
            waiting: Mutex::default(),
            store: Mutex::new((connection, part)),
        })
    }

    /// Takes the paths of a tile.
    pub fn take(&self, tile: &Tile) {
        self.add(tile.paths());
    }

    /// Takes paths, of which some may be there already and some may not touch the region.
    pub fn add(&self, paths: &[Arc<Path>]) {
        let mut waiting = self.waiting.lock().expect("no thread panics while it adds");
        for path in paths.iter().filter(|path| path.way.touches(&self.area)) {
            waiting.entry((path.way.kind(), path.owner)).or_insert_with(|| Arc::clone(path));
        }
    }

    /// Puts away what waits.
    pub fn flush(&self) -> Result<(), Error> {
        let waiting = std::mem::take(&mut *self.waiting.lock().expect("no thread panics while it adds"));
        let (connection, part) = &mut *self.store.lock().expect("no thread panics while it writes");
        let mut put = || {
            let transaction = connection.transaction()?;
            let mut insert = transaction
                .prepare_cached("INSERT OR IGNORE INTO paths VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)")?;
            for path in waiting.values() {
                let Feature { kind, owner, ending, joins, length_m, width_m, floor_m, line } =
                    Feature::new(path, self.spacing_m);
                insert.execute(params![
                    kind == WayKind::Road,
                    owner.x,
                    owner.y,
                    ENDINGS.iter().position(|name| *name == ending).map(|index| index as u8),
                    joins.map(|tile| tile.x),
                    joins.map(|tile| tile.y),
                    length_m,
                    width_m[0],
                    width_m[1],
                    floor_m[0],
                    floor_m[1],
                    bytemuck::cast_slice::<_, u8>(&line),
                ])?;
            }
            drop(insert);
            transaction.commit()
        };
        put().map_err(Error::sqlite(part.path()))
    }

    /// Visits all features of a kind, sorted by owner, without holding them.
    pub fn for_each(&self, kind: WayKind, mut visit: impl FnMut(Feature) -> Result<(), Error>) -> Result<(), Error> {
        self.flush()?;
        let (connection, part) = &*self.store.lock().expect("no thread panics while it writes");
        let failed = || Error::sqlite(part.path());
        let select = "SELECT * FROM paths WHERE kind = ? ORDER BY x, y";
        let mut select = connection.prepare(select).map_err(failed())?;
        let parse = |row: &rusqlite::Row| {
            let joins: Option<(i64, i64)> = row.get::<_, Option<i64>>(4)?.zip(row.get(5)?);
            let bytes: Vec<u8> = row.get(11)?;
            let mut line = vec![[0.0; 2]; bytes.len() / size_of::<[f64; 2]>()];
            bytemuck::cast_slice_mut(&mut line).copy_from_slice(&bytes);
            Ok(Feature {
                kind,
                owner: TileId { x: row.get(1)?, y: row.get(2)? },
                ending: ENDINGS[row.get::<_, u8>(3)? as usize],
                joins: joins.map(|(x, y)| TileId { x, y }),
                length_m: row.get(6)?,
                width_m: [row.get(7)?, row.get(8)?],
                floor_m: [row.get(9)?, row.get(10)?],
                line,
            })
        };
        for feature in select.query_map([kind == WayKind::Road], parse).map_err(failed())? {
            visit(feature.map_err(failed())?)?;
        }
        Ok(())
    }
}
