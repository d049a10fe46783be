//! Endless terrain around a walker: near tiles are kept, far ones are removed, and tiles that were seen come back the
//! same.
//!
//! Based on: Grelsson (2014), chapter 4. Its agents depend on the order in which tiles are made, and so on the walker's
//! route: two walkers who take different routes through one world see different rivers. A bake must give the same world
//! whatever is baked, so it uses the order-free agents of [`order_free`](crate::agents::order_free), and the thesis'
//! agents stay with the walker. Seams do not occur here either, at a price: an existing tile never changes, so a bed
//! that runs along an edge ends there, with a steep bank.
//!
//! ```text
//!   mod.rs     the walker and the tiles around it        classic.rs   the agents of these tiles
//!   camera.rs  time -> place                             path.rs      a text -> places
//!   walk.rs    either -> the tiles of the walk           walked.rs    records -> tiles again
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

mod camera;
mod classic;
mod path;
mod walk;
mod walked;

pub use camera::{Camera, FRAMES_A_SECOND};
pub use classic::NODES_A_CELL;
pub use walk::{LAYERS, Tour, Walk, Way};
pub use walked::Walked;

use crate::agents::Direction;
use crate::agents::record::{Records, TileRecord};
use crate::area::{Area, MAX_COORDINATE, TileId};
use crate::clock::{Clock, stage};
use crate::device::{Cpu, LandMaker};
use crate::error::Error;
use crate::grid::Grid;
use crate::hash::{self, Stream};
use crate::land::Land;
use crate::lines::{Line, Lines};
use crate::stop::{Stop, Stopped};
use crate::tile::{self, Tile, TilePlan, TileSurface};
use crate::world::World;
use classic::TileAgents;

/// Options of a walker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WalkerOptions {
    /// Tile in whose middle the walker starts. Default: (0, 0).
    pub start: TileId,
    /// True to make rivers and roads, if the preset has them. Default: true.
    pub agents: bool,
    /// Layers of tiles around the walker's own, at least 1: n layers are `(2n + 1)^2` tiles. A world with smaller tiles
    /// (`tile_cells` of its preset) and more layers shows as much land with smaller expansions. Default: 1, the eight
    /// neighbours.
    pub layers: u32,
    /// True to make at most one missing tile per step, the nearest first, instead of all. A fast walker then stands
    /// where there is no tile for some steps. Default: false.
    pub one_tile_a_step: bool,
}

impl Default for WalkerOptions {
    fn default() -> WalkerOptions {
        WalkerOptions { start: TileId { x: 0, y: 0 }, agents: true, layers: 1, one_tile_a_step: false }
    }
}

/// Changes of the tiles in one step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expansion {
    /// Tiles that were made, in that order.
    pub entered: Vec<TileId>,
    /// Tiles that were removed, sorted.
    pub left: Vec<TileId>,
    /// Time that the step took.
    pub elapsed: Duration,
}

/// A walker in a world, and the tiles around it.
///
/// Memory holds `(2 layers + 1)^2` tiles however far the walker goes. In addition, a walker with agents keeps a record
/// of [`TileRecord::BYTES`] for every tile that it has made.
///
/// ```
/// # use terrane_engine as terrane;
/// use terrane::walker::{Walker, WalkerOptions};
/// use terrane::{preset::Preset, world::World};
///
/// let mut preset = Preset::load("thesis")?.1;
/// preset.tile_cells = 64;
/// let world = World::new(preset, Some(7))?;
/// let mut walker = Walker::new(&world, WalkerOptions::default());
/// // Tile (0, 0) is 64 m wide, and the walker starts in its middle.
/// assert!(walker.move_to(63.0, 32.0)?.is_none());
/// let expansion = walker.move_to(65.0, 32.0)?.expect("the next tile");
/// assert_eq!((expansion.entered.len(), expansion.left.len()), (3, 3));
/// # Ok::<(), terrane::error::Error>(())
/// ```
#[derive(Debug)]
pub struct Walker<'w> {
    world: &'w World,
    maker: Arc<dyn LandMaker>,
    options: WalkerOptions,
    position_m: [f64; 2],
    tile: TileId,
    /// True if the walker's last move between tiles went mainly north or south.
    moved_south: bool,
    standing: BTreeMap<TileId, Tile>,
    records: Records,
    clock: Clock,
}

impl<'w> Walker<'w> {
    /// Creates a walker in the middle of its first tile, and makes all tiles around it.
    ///
    /// # Panics
    /// When there are no layers, or when a vertex would lie more than [`MAX_COORDINATE`] from the origin.
    pub fn new(world: &'w World, options: WalkerOptions) -> Walker<'w> {
        let maker = Cpu::maker(world.relief());
        Clock::unstopped(|clock| Walker::with_maker(world, options, maker, clock.stop()))
    }

    /// Creates a walker as [`new`](Walker::new) does, with a given maker of the world's land and a stop. The tiles are
    /// the same.
    ///
    /// # Errors
    /// When the work is stopped.
    ///
    /// # Panics
    /// As [`new`](Walker::new).
    pub fn with_maker(
        world: &'w World,
        options: WalkerOptions,
        maker: Arc<dyn LandMaker>,
        stop: &Stop,
    ) -> Result<Walker<'w>, Stopped> {
        Walker::begin(world, maker, options, Records::default(), stop)
    }

    /// Creates a walker that knows the tiles of an earlier walk. When it comes upon one of them, that tile is as it
    /// was.
    ///
    /// # Errors
    /// When a tile has two records, or when a record cannot belong to this world.
    ///
    /// # Panics
    /// As [`new`](Walker::new).
    pub fn with_records(
        world: &'w World,
        options: WalkerOptions,
        records: impl IntoIterator<Item = TileRecord>,
    ) -> Result<Walker<'w>, Error> {
        let records = walked::sound(world, records)?;
        let maker = Cpu::maker(world.relief());
        Ok(Clock::unstopped(|clock| Walker::begin(world, maker, options, records, clock.stop())))
    }

    fn begin(
        world: &'w World,
        maker: Arc<dyn LandMaker>,
        options: WalkerOptions,
        records: Records,
        stop: &Stop,
    ) -> Result<Walker<'w>, Stopped> {
        assert!(options.layers > 0, "a walker has at least one layer of tiles around its own");
        let mut walker = Walker {
            world,
            maker,
            options,
            position_m: middle_m(world, options.start),
            tile: options.start,
            moved_south: false,
            standing: BTreeMap::new(),
            records,
            clock: Clock::stopped_by(stop),
        };
        walker.check_tile();
        let missing = walker.missing();
        walker.make(&missing)?;
        Ok(walker)
    }

    /// Moves the walker to a place in metres from the origin. Returns `None` if the walker stays in its tile and no
    /// tile is missing.
    ///
    /// If the walker enters another tile, the missing tiles around it are made, and tiles outside its layers are
    /// removed.
    ///
    /// # Errors
    /// When the work is stopped.
    ///
    /// # Panics
    /// When a vertex would lie more than [`MAX_COORDINATE`] from the origin.
    pub fn move_to(&mut self, east_m: f64, south_m: f64) -> Result<Option<Expansion>, Stopped> {
        assert!(east_m.is_finite() && south_m.is_finite(), "a walker is somewhere, not at ({east_m}, {south_m})");
        let side_m = self.world.tile_cells() as f64 * self.world.spacing_m();
        let [x, y] = [east_m, south_m].map(|metres| (metres / side_m).floor() as i64);
        self.go([east_m, south_m], TileId { x, y })
    }

    /// Moves the walker to the middle of a tile; otherwise as [`move_to`](Walker::move_to).
    ///
    /// # Errors
    /// When the work is stopped.
    ///
    /// # Panics
    /// When a vertex would lie more than [`MAX_COORDINATE`] from the origin.
    pub fn enter(&mut self, tile: TileId) -> Result<Option<Expansion>, Stopped> {
        self.go(middle_m(self.world, tile), tile)
    }

    fn go(&mut self, position_m: [f64; 2], tile: TileId) -> Result<Option<Expansion>, Stopped> {
        let start = Instant::now();
        self.position_m = position_m;
        let before = std::mem::replace(&mut self.tile, tile);
        if before != tile {
            self.check_tile();
            self.moved_south = tile.y.abs_diff(before.y) > tile.x.abs_diff(before.x);
        }
        let mut entered = self.missing();
        if self.options.one_tile_a_step {
            entered.truncate(1);
        }
        let layers = self.options.layers as u64;
        let left: Vec<TileId> = self.standing.keys().copied().filter(|id| distance(self.tile, *id) > layers).collect();
        if entered.is_empty() && left.is_empty() {
            return Ok(None);
        }
        for id in &left {
            self.standing.remove(id);
        }
        self.make(&entered)?;
        Ok(Some(Expansion { entered, left, elapsed: start.elapsed() }))
    }

    /// Returns the walker's position in metres east and south of the origin.
    pub fn position_m(&self) -> [f64; 2] {
        self.position_m
    }

    /// Returns the tile that contains the walker.
    pub fn current(&self) -> TileId {
        self.tile
    }

    /// Returns the tile with this id, if it exists.
    pub fn tile(&self, id: TileId) -> Option<&Tile> {
        self.standing.get(&id)
    }

    /// Returns all existing tiles, sorted by position.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &Tile> {
        self.standing.values()
    }

    /// Returns the parts of rivers and roads that lie in a tile; none if the tile does not exist.
    pub fn lines(&self, id: TileId) -> &[Arc<Line>] {
        self.standing.get(&id).map_or(&[], Tile::lines)
    }

    /// Returns the record of a tile that was made with agents, or that was given.
    pub fn record(&self, id: TileId) -> Option<&TileRecord> {
        self.records.find(id)
    }

    /// Returns the records of all tiles that were made with agents, or that were given, sorted by position.
    pub fn records(&self) -> &[TileRecord] {
        self.records.all()
    }

    /// Returns the time spent in each stage, added up over all threads.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Returns the tiles around the walker that do not exist yet, the nearest first.
    pub fn missing(&self) -> Vec<TileId> {
        let (TileId { x, y }, layers) = (self.tile, self.options.layers as i64);
        let around = (x - layers..=x + layers).flat_map(|x| (y - layers..=y + layers).map(move |y| TileId { x, y }));
        let mut missing: Vec<TileId> = around.filter(|id| !self.standing.contains_key(id)).collect();
        missing.sort_by_key(|id| ((id.x - x).pow(2) + (id.y - y).pow(2), *id));
        missing
    }

    fn check_tile(&self) {
        let limit = MAX_COORDINATE / self.world.tile_cells() as i64 - self.options.layers as i64 - 1;
        let near = |tile: i64| tile.unsigned_abs() <= limit.max(0) as u64;
        assert!(near(self.tile.x) && near(self.tile.y), "tile {} is too far from the origin", self.tile);
    }

    /// Makes tiles that do not exist yet.
    fn make(&mut self, ids: &[TileId]) -> Result<(), Stopped> {
        // The bare heights of all tiles are made in parallel.
        let heights = self.bare_heights(ids)?;
        // The agents walk one tile after another, because the next tile continues the agents that wait at its edges.
        let mut lines = Vec::with_capacity(ids.len());
        for (&id, heights) in ids.iter().zip(&heights) {
            lines.push(self.settle(id, heights)?);
        }
        // Lines from records, beds, normals and blend weights are made in parallel again.
        let Walker { world, options, records, clock, .. } = self;
        let jobs: Vec<_> = ids.iter().zip(heights).zip(lines).collect();
        let made = jobs.into_par_iter().map(|((&id, heights), lines)| {
            let lines = match (lines, records.find(id).filter(|_| options.agents)) {
                (Some(lines), _) => lines,
                (None, Some(record)) => {
                    clock.time(stage::LINES, || TileAgents::new(world, id, &heights).lines(record))?
                }
                (None, None) => Vec::new(),
            };
            Ok((id, stand(world, options.agents.then_some(&*records), id, heights, lines, clock)?))
        });
        let made: Vec<_> = made.collect::<Result<_, _>>()?;
        self.standing.extend(made);
        Ok(())
    }

    /// Makes and records the lines of a tile that is made for the first time; `None` for any other tile.
    fn settle(&mut self, id: TileId, heights: &Grid<f32>) -> Result<Option<Vec<Line>>, Stopped> {
        if !self.options.agents || self.records.find(id).is_some() {
            return Ok(None);
        }
        let growth = self.growth(id);
        let agents = TileAgents::new(self.world, id, heights);
        let (record, lines) = self.clock.time(stage::LINES, || agents.settle(&self.records, growth))?;
        self.records.add(record);
        Ok(Some(lines))
    }

    /// Returns the direction in which the terrain grows at a tile: from the walker to the tile, and at a corner along
    /// the axis of the walker's last move.
    fn growth(&self, id: TileId) -> Direction {
        let (east, south) = (id.x - self.tile.x, id.y - self.tile.y);
        let along_south = match east.abs().cmp(&south.abs()) {
            std::cmp::Ordering::Less => true,
            std::cmp::Ordering::Equal => self.moved_south,
            std::cmp::Ordering::Greater => false,
        };
        match (along_south, east.signum(), south.signum()) {
            // The walker's first tile grows to all sides, so its direction comes from a hash.
            (_, 0, 0) => {
                let stream = hash::stream(self.world.chance(), Stream::WalkerGrowth);
                Direction::ALL[(hash::lattice(stream, id.x, id.y) % 4) as usize]
            }
            (true, _, 1) => Direction::South,
            (true, ..) => Direction::North,
            (false, 1, _) => Direction::East,
            (false, ..) => Direction::West,
        }
    }

    /// Makes the bare heights of tiles, with their pad.
    fn bare_heights(&self, ids: &[TileId]) -> Result<Vec<Grid<f32>>, Stopped> {
        // Split into bands, so that threads share the work evenly instead of waiting for one that makes the last tile.
        const BAND_ROWS: i64 = 32;
        let area = |id: &TileId| tile::shaped_input(self.world, id.area(self.world.tile_cells()));
        let bands_of = |area: Area| {
            let edges = move |y0: i64| (y0.max(area.y0), (y0 + BAND_ROWS).min(area.y1));
            let first = area.y0.div_euclid(BAND_ROWS) * BAND_ROWS;
            (first..area.y1).step_by(BAND_ROWS as usize).map(edges).map(move |(y0, y1)| Area { y0, y1, ..area })
        };
        let bands: Vec<Area> = ids.iter().map(area).flat_map(bands_of).collect();
        let mut made = self.maker.lands(&bands, &self.clock)?.into_iter();
        let joined = |id: &TileId| {
            let mut heights = Grid::filled(area(id), 0.0);
            let mut left = heights.values_mut();
            for _ in bands_of(area(id)) {
                let band = made.next().expect("a land for each band").heights;
                left.split_off_mut(..band.values().len())
                    .expect("bands make up the area")
                    .copy_from_slice(band.values());
            }
            heights
        };
        Ok(ids.iter().map(joined).collect())
    }
}

/// Makes a tile of its bare heights and lines; with records, also of the agents' crossings over its edges.
fn stand(
    world: &World,
    records: Option<&Records>,
    id: TileId,
    heights: Grid<f32>,
    lines: Vec<Line>,
    clock: &Clock,
) -> Result<Tile, Stopped> {
    let agents = TileAgents::new(world, id, &heights);
    let (mut crossings, mut imprint) = (Vec::new(), None);
    if let Some(records) = records {
        crossings = clock.time(stage::LINES, || agents.crossings(records))?;
        imprint = clock.time(stage::IMPRINT, || agents.imprint(&lines, &crossings))?;
    }
    let lines: Lines = lines.into_iter().map(Arc::new).collect();
    let crossings: Lines = crossings.into_iter().map(|(_, line)| Arc::new(line)).collect();
    let (land, surface) = TileSurface::of_land(world, id, Land { heights, water: None }, imprint, clock)?;
    Ok(Tile::build(world, TilePlan::of_lines(world, id, lines, crossings), land, surface))
}

/// Returns the middle of a tile in metres east and south of the origin.
fn middle_m(world: &World, tile: TileId) -> [f64; 2] {
    let side_m = world.tile_cells() as f64 * world.spacing_m();
    [tile.x, tile.y].map(|tile| (tile as f64 + 0.5) * side_m)
}

/// Returns the distance between two tiles in tiles, where a diagonal step counts as 1.
fn distance(one: TileId, other: TileId) -> u64 {
    one.x.abs_diff(other.x).max(one.y.abs_diff(other.y))
}
