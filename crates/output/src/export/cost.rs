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

/// What one tile of a bake takes, with so many threads at work: how long to plan what lies around it, and how long to make it then, in
/// seconds of one of them; and what the world remembers then.
pub struct Trial {
    at_once: usize,
    /// How many times longer a thread takes than if it were alone.
    slower: f64,
    planning: f64,
    making: f64,
    usages: Vec<Usage>,
}

impl Trial {
    /// Makes the middle tile of a region, alone and then on so many threads at a time, but no more than there are cores: as a rule those
    /// share more than memory, and two that are called cores are together little faster than one.
    ///
    /// Where `formats` ask for features, these are looked for there too, and where they ask for its accumulation, that is made.
    pub(super) fn take(request: &Request, formats: &FormatCost, threads: usize) -> Trial {
        // The least of some times is what another program disturbs least.
        const TIMES: usize = 3;
        let Request { world, region, .. } = request;
        let middle = region.tile(Place { row: region.rows() / 2, col: region.cols() / 2 });
        // Made and dropped: what counts is how long it takes, and what the world remembers of it.
        let time = || {
            let start = Instant::now();
            let tile = black_box(Tile::timed(world, middle, &Clock::default()));
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
        let least = || (0..TIMES).map(|_| time()).fold(f64::INFINITY, f64::min);
        // The first time pays for what later ones find remembered.
        let first = time();
        let alone = least();
        let cores = thread::available_parallelism().map_or(1, usize::from);
        // More threads than cores or than tiles are no faster.
        let at_once = threads.min(cores).min(usize::try_from(request.tiles()).unwrap_or(usize::MAX));
        let making = thread::scope(|scope| {
            let others: Vec<_> = (1..at_once).map(|_| scope.spawn(least)).collect();
            let all = others.into_iter().map(|other| other.join().expect("a tile that was made is made again"));
            let own = least();
            (all.sum::<f64>() + own) / at_once as f64
        });
        let slower = (making / alone).max(1.0);
        Trial { at_once, slower, planning: (first - alone).max(0.0) * slower, making, usages: world.usages() }
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
    pub(super) fn new(trial: &Trial, request: &Request, cost: &Cost, formats: &FormatCost) -> Forecast {
        let Request { world, region, .. } = request;
        let Trial { at_once, slower, planning, making, usages } = trial;
        // What is planned, and what of it is remembered, grows with the area that is planned for.
        let growth = |around: i64| {
            let side = |vertices: u64| vertices as f64 + 2.0 * around as f64;
            let tile_cells = world.tile_cells() as u64;
            match request.walk {
                None => side(region.width()) * side(region.height()) / side(tile_cells).powi(2),
                // Its agents plan nothing.
                Some(_) => 0.0,
            }
        };
        let remembered_growth = growth(world.planned_around());
        // One whose values are large may hold more already than it should.
        let remembered = |usage: &Usage| {
            let held = usage.held as f64;
            (held * remembered_growth).min(usage.most as f64 * FULL).max(held) * SPREAD
        };
        let remembered: f64 = usages.iter().map(remembered).sum();
        let tiles = request.tiles();
        let formats_s = (request.vertices() * formats.work_ns_a_vertex) as f64 * 1e-9;
        let files_s = (formats_s + cost.disk_bytes as f64 / ENCODED_BYTES_A_SECOND) * slower;
        let work = planning * growth(world.planned_whole_around()) + making * tiles as f64 + files_s;
        let seconds = work / *at_once as f64;
        let not_yet_made = (1.0 - BATCHES) * 2.0 * cost.batch_bytes as f64;
        let working_bytes = cost.working_bytes - not_yet_made as u64;
        Forecast {
            memory_bytes: working_bytes.saturating_add(remembered as u64).min(cost.memory_bytes),
            // A `Duration` panics beyond 2^64 seconds, and no one waits for that long.
            time: Duration::from_secs_f64(seconds.min(1e15)),
        }
    }
}
