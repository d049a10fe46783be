//! The bake: every tile of a region, made in parallel and handed to the sinks in order.

pub(crate) mod frames;
mod journal;
mod shard;
pub(crate) mod shard_store;
mod walk_bake;

pub(crate) use journal::Journal;
pub use shard::Shard;
pub(crate) use shard::corners;
pub(crate) use walk_bake::walk;

use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::area::{Place, Region, Stride};
use crate::clock::Clock;
use crate::device::LandMaker;
use crate::error::Error;
pub use crate::file::{FileRecord, MeshRecord};
use crate::stop::Stopped;
use crate::tile::{Tile, TilePlan};
use crate::watch::Watch;
use crate::world::World;

/// A consumer of finished tiles: a format.
///
/// [`take`](Sink::take) runs on any thread in any order; [`append`](Sink::append) gets whole rows of tiles from north
/// to south. Everything that a sink knows of a tile passes from `take` to `append` as bytes. So a bake that was
/// interrupted can go on with the bytes that were kept of tiles, without making these tiles again.
pub(crate) trait Sink: Send + Sync {
    /// Name of the sink for progress, timings and the journal. All sinks of a bake have different names.
    fn name(&self) -> &str;

    /// Takes a tile: writes the files of this tile alone, and returns the bytes that `append` needs of it.
    ///
    /// # Errors
    /// If a file cannot be written, or `clock` stops the work, here and below.
    fn take(&self, tile: &Tile, place: Place, clock: &Clock) -> Result<Kept, Error>;

    /// Consumes one row of tiles: the bytes kept of each, from west to east. They are empty for a tile that a walk
    /// never reached.
    ///
    /// # Errors
    /// If a file cannot be written.
    fn append(&self, row: u64, pieces: &[&[u8]], clock: &Clock) -> Result<(), Error>;

    /// Finishes the sink's files and gives them their names. Called once, after the last row. Lengthy work begins a
    /// stage of its own.
    ///
    /// # Errors
    /// If a file cannot be written.
    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error>;
}

/// The result of taking a tile.
#[derive(Default)]
pub(crate) struct Kept {
    /// Bytes for [`Sink::append`], in a format of the sink's own.
    pub piece: Vec<u8>,
    /// Files of the tile, which are complete.
    pub files: Vec<FileRecord>,
}

/// Least number of tiles in work per thread, so that no thread waits long for the last tile of a batch.
const TILES_A_THREAD: u64 = 4;

/// Number of rows of tiles that are made together: one, or as many as keep all threads busy in a narrow region.
pub fn rows_in_flight(region: &Region, threads: usize) -> u64 {
    (TILES_A_THREAD * threads as u64).div_ceil(region.cols()).clamp(1, region.rows())
}

/// Makes all tiles of a region with the land of `maker`, and hands them to the sinks, on the threads of the current
/// rayon pool.
///
/// While the sinks write one batch of rows, the next batch is made. So memory holds at most two batches of the bytes
/// that sinks keep, and one tile per thread: it grows with the width of the region and not with its height. Tiles that
/// the journal has from an earlier run are not made again.
///
/// # Errors
/// The first error of a sink or of the journal.
pub(crate) fn bake(
    (world, maker): (&World, &dyn LandMaker),
    region: &Region,
    sinks: &[Box<dyn Sink + '_>],
    journal: &Journal,
    watch: &Watch,
) -> Result<(), Error> {
    world.prepare_for(region.cols());
    watch.begin(planning(world).unwrap_or(TILES), Some((region.tiles(), "tiles")));
    deliver(region, sinks, journal, watch, |first_row, rows| {
        Batch::make((world, maker), region, first_row, rows, sinks, journal, watch)
    })
}

/// Hands all rows of a region to the sinks: while they write one batch of rows, the next batch is made.
fn deliver(
    region: &Region,
    sinks: &[Box<dyn Sink + '_>],
    journal: &Journal,
    watch: &Watch,
    mut make: impl FnMut(u64, u64) -> Result<Batch, Error> + Send,
) -> Result<(), Error> {
    let batch_rows = rows_in_flight(region, rayon::current_num_threads());
    let mut made: Option<Batch> = None;
    let mut first_row = 0;
    while first_row < region.rows() {
        let rows = batch_rows.min(region.rows() - first_row);
        let (written, next) = rayon::join(
            || made.take().map_or(Ok(()), |batch| batch.append(region, sinks, watch)),
            || make(first_row, rows),
        );
        written?;
        watch.clock.time(JOURNAL, || journal.save())??;
        made = Some(next?);
        first_row += rows;
    }
    watch.clock.time(JOURNAL, || journal.save())??;
    made.map_or(Ok(()), |batch| batch.append(region, sinks, watch))
}

/// Hands bytes that were kept earlier of all tiles of a region to the same sinks. `read` returns them for some rows of
/// tiles, tile by tile, and for each tile sink by sink.
///
/// # Errors
/// The first error of a sink, of the journal, or of `read`.
pub(crate) fn hand_on(
    region: &Region,
    sinks: &[Box<dyn Sink + '_>],
    journal: &Journal,
    watch: &Watch,
    mut read: impl FnMut(u64, u64) -> Result<Vec<Vec<Vec<u8>>>, Error> + Send,
) -> Result<(), Error> {
    watch.begin("merging tiles", Some((region.tiles(), "tiles")));
    deliver(region, sinks, journal, watch, |first_row, rows| {
        watch.clock.check()?;
        let pieces = read(first_row, rows)?;
        watch.add(rows * region.cols());
        Ok(Batch { first_row, pieces })
    })
}

/// The stage in which tiles are made.
const TILES: &str = "baking tiles";

/// Name in timings of the work for the journal: digests of tiles, and all that is recorded of them.
pub(crate) const JOURNAL: &str = "journal";

/// Name of the lengthy planning that comes before the first tile, if there is any. The plan serves the tiles around it
/// too.
fn planning(world: &World) -> Option<&'static str> {
    match world.relief().fluvial() {
        Some(_) if world.places().is_some() && world.stride() == Stride::ONE => Some("planning roads"),
        Some(_) => Some("planning rivers"),
        None => None,
    }
}

/// Some rows of tiles, as the bytes that sinks keep of them.
struct Batch {
    first_row: u64,
    /// Bytes kept, by tile, row by row, and by sink.
    pieces: Vec<Vec<Vec<u8>>>,
}

impl Batch {
    fn make(
        (world, maker): (&World, &dyn LandMaker),
        region: &Region,
        first_row: u64,
        rows: u64,
        sinks: &[Box<dyn Sink + '_>],
        journal: &Journal,
        watch: &Watch,
    ) -> Result<Batch, Error> {
        let cols = region.cols();
        let clock = &watch.clock;
        let finish = |place: Place, tile: Tile, made: Duration| {
            let start = Instant::now();
            let take =
                |sink: &dyn Sink| clock.time(&format!("paint {}", sink.name()), || sink.take(&tile, place, clock))?;
            let kept = sinks.iter().map(|sink| take(sink.as_ref())).collect::<Result<Vec<Kept>, Error>>()?;
            let spent = made + start.elapsed();
            let pieces = clock.time(JOURNAL, || journal.record(&tile, kept, spent))??;
            if watch.add(1) == 0 && planning(world).is_some() {
                watch.go_on(TILES);
            }
            Ok(pieces)
        };
        // Makes a group of tiles together.
        let make = |indices: &[u64]| {
            clock.check()?;
            let mut pieces = Vec::with_capacity(indices.len());
            let mut missing = Vec::new();
            for index in indices {
                let place = Place { row: first_row + index / cols, col: index % cols };
                let recalled = journal.recall(region.tile(place), sinks.len())?;
                match recalled {
                    Some(_) => watch.skip(1),
                    None => missing.push((pieces.len(), place)),
                }
                pieces.push(recalled.unwrap_or_default());
            }
            let start = Instant::now();
            let plans = missing.par_iter().map(|(_, place)| TilePlan::new(world, region.tile(*place), clock));
            let tiles = maker.tiles(world, plans.collect::<Result<_, Stopped>>()?, clock)?;
            let made = start.elapsed().div_f64(missing.len().max(1) as f64);
            let finished = missing.par_iter().zip(tiles).map(|(&(_, place), tile)| finish(place, tile, made));
            for ((at, _), made) in missing.iter().zip(finished.collect::<Result<Vec<_>, Error>>()?) {
                pieces[*at] = made;
            }
            Ok(pieces)
        };
        let indices: Vec<u64> = (0..rows * cols).collect();
        let pieces = indices.par_chunks(maker.together()).map(make).collect::<Result<Vec<_>, Error>>()?;
        Ok(Batch { first_row, pieces: pieces.into_iter().flatten().collect() })
    }

    fn append(self, region: &Region, sinks: &[Box<dyn Sink + '_>], watch: &Watch) -> Result<(), Error> {
        sinks.par_iter().enumerate().try_for_each(|(index, sink)| {
            for (row, tiles) in (self.first_row..).zip(self.pieces.chunks(region.cols() as usize)) {
                let pieces: Vec<&[u8]> = tiles.iter().map(|tile| &tile[index][..]).collect();
                let clock = &watch.clock;
                clock.time(&format!("encode {}", sink.name()), || sink.append(row, &pieces, clock))??;
            }
            Ok(())
        })
    }
}
