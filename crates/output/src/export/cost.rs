//! What a bake takes of the machine: disk, memory, time.

use std::hint::black_box;
use std::thread;
use std::time::{Duration, Instant};

use crate::area::Place;
use crate::clock::Clock;
use crate::export::format::{FormatCost, Request};
use crate::features::layers;
use crate::memory::Usage;
use crate::tile::Tile;
use crate::world::World;

/// What a bake will leave and need, as far as its formats and its region say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Files, the manifest among them.
    pub files: u64,
    /// The most bytes that they can take on the disk: as if nothing could be compressed.
    pub disk_bytes: u64,
    /// The most bytes of memory that are needed beside what the world remembers.
    pub working_bytes: u64,
    /// Of these, what one batch of rows holds until it is written.
    pub batch_bytes: u64,
    /// The most bytes of memory that may be in use: those, and all that the world can remember.
    pub memory_bytes: u64,
}

/// What one tile of a bake takes: how long it takes to make the first time, in seconds, when much may have to be planned for it, and
/// how long again; and what the world remembers then.
pub struct Trial {
    first: f64,
    again: f64,
    usages: Vec<Usage>,
}

impl Trial {
    /// Makes the middle tile of a region.
    ///
    /// Where `formats` ask for features, these are looked for there too, and where they ask for its accumulation, that is made.
    pub(super) fn take(request: &Request, formats: &FormatCost) -> Trial {
        let Request { world, region, .. } = request;
        let middle = region.tile(Place { row: region.rows() / 2, col: region.cols() / 2 });
        let clock = Clock::default();
        // Made and dropped: what counts is how long it takes, and what the world remembers of it.
        let time = || {
            let start = Instant::now();
            let tile = black_box(Tile::timed(world, middle, &clock));
            if formats.features {
                let area = tile.area();
                for layer in layers(world) {
                    layer.visit(world, &area, &mut |_, row| _ = black_box(row()));
                }
            }
            if formats.accumulation {
                black_box(tile.accumulation_m2(world));
            }
            start.elapsed().as_secs_f64()
        };
        // The first time pays for what later ones find remembered.
        let first = time();
        // The least of three, which is what another program disturbs least.
        let again = (0..3).map(|_| time()).fold(f64::INFINITY, f64::min);
        Trial { first, again, usages: world.usages() }
    }
}

/// What a bake will probably take, by one tile of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// About the most memory in use.
    pub memory_bytes: u64,
    /// About how long it takes.
    pub time: Duration,
}

/// Raw bytes that one thread encodes a second, with the settings of the exports: the middle of what they reach. Of 151 million
/// vertices of `thesis`, PNGs of heights were encoded at 470 million bytes a second, those of blend weights at 860 and OpenEXR at
/// 1100, beside what bare heights take; pictures that must be shaded first are slower.
const ENCODED_BYTES_A_SECOND: f64 = 600e6;

// With the three numbers below, the bakes of `tests/suite/cost.rs` are told no less than they take, and no more than a
// quarter above.

/// A memory that has forgotten things is so full when most are: one of two generations is between empty and full.
const FULL: f64 = 0.95;

/// Share of two batches of rows that is held at once: as a rule the first is written before the second is made.
const BATCHES: f64 = 0.95;

/// What the allocator takes for each byte that is remembered, since things of all sizes come and go, and a little more, so that
/// as a rule a bake takes no more than is told.
const SPREAD: f64 = 1.35;

impl Forecast {
    /// What a trial says of a bake.
    pub(super) fn new(trial: &Trial, request: &Request, cost: &Cost, formats: &FormatCost, threads: usize) -> Forecast {
        let Request { world, region, .. } = request;
        let Trial { first, again, usages } = trial;
        // What is planned, and what of it is remembered, grows with the area that is planned for.
        let growth = match request.walk {
            None => {
                let tile_cells = world.tile_cells() as u64;
                planned_area(world, region.width(), region.height()) / planned_area(world, tile_cells, tile_cells)
            }
            // Its agents plan nothing.
            Some(_) => 0.0,
        };
        // One whose values are large may hold more already than it should.
        let remembered = |usage: &Usage| {
            let held = usage.held as f64;
            (held * growth).min(usage.most as f64 * FULL).max(held) * SPREAD
        };
        let remembered: f64 = usages.iter().map(remembered).sum();
        let tiles = request.tiles();
        let formats_s = (request.vertices() * formats.work_ns_a_vertex) as f64 * 1e-9;
        let work = (first - again).max(0.0) * growth + again * tiles as f64 + formats_s;
        let cores = thread::available_parallelism().map_or(1, usize::from);
        // More threads than cores or than tiles are no faster.
        let at_once = (threads.min(cores) as u64).min(tiles) as f64;
        let seconds = (work + cost.disk_bytes as f64 / ENCODED_BYTES_A_SECOND) / at_once;
        let not_yet_made = (1.0 - BATCHES) * 2.0 * cost.batch_bytes as f64;
        let working_bytes = cost.working_bytes - not_yet_made as u64;
        Forecast {
            memory_bytes: working_bytes.saturating_add(remembered as u64).min(cost.memory_bytes),
            // A `Duration` panics beyond 2^64 seconds, and no one waits for that long.
            time: Duration::from_secs_f64(seconds.min(1e15)),
        }
    }
}

/// Vertices of the area that is planned to make so many columns and rows.
fn planned_area(world: &World, cols: u64, rows: u64) -> f64 {
    let around = 2.0 * world.planned_around() as f64;
    (cols as f64 + around) * (rows as f64 + around)
}
