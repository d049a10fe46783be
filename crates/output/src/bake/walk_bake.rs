//! The bake of a walk: tiles are made in the order in which the walker comes to them, and then handed to the sinks like
//! those of a bake.
//!
//! A tile depends on the tiles that were made before it, so none is made twice. The bytes that sinks keep of tiles wait
//! in the journal until the last tile exists. Then they pass from north to south, as rows of the region around all
//! tiles. In these rows, tiles that were never made have no bytes.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Place, TileId};
use crate::bake::{Batch, JOURNAL, Journal, Kept, Sink};
use crate::device::LandMaker;
use crate::error::Error;
use crate::tile::Tile;
use crate::walker::{Walk, Walker};
use crate::watch::Watch;
use crate::world::World;

/// Walks over the land of `maker`, and hands all tiles to the sinks, on the threads of the current rayon pool. Tiles
/// that the journal has from an earlier run are not written again.
///
/// Memory holds the tiles around the walker and a record of each tile that it has come to; later, the bytes of one row
/// of tiles.
///
/// # Errors
/// The first error of a sink or of the journal.
pub(crate) fn walk(
    (world, maker): (&World, Arc<dyn LandMaker>),
    walk: &Walk,
    sinks: &[Box<dyn Sink + '_>],
    journal: &Journal,
    watch: &Watch,
) -> Result<(), Error> {
    let region = walk.region();
    watch.begin("walking", Some((walk.tiles().len() as u64, "tiles")));
    let mut walker = Walker::with_maker(world, walk.options(), Arc::clone(&maker), watch.clock.stop())?;
    let mut seen = BTreeSet::new();
    for tile in walk.route() {
        let entered: Vec<TileId> = match walker.enter(*tile)? {
            Some(expansion) => expansion.entered,
            // The tiles around the first one exist before the walker moves.
            None => walker.tiles().map(Tile::id).collect(),
        };
        // A tile to which the walker comes back is unchanged.
        let new: Vec<TileId> = entered.into_iter().filter(|id| seen.insert(*id)).collect();
        let note = |id: &TileId| {
            if journal.recall(*id, sinks.len())?.is_some() {
                watch.skip(1);
                return Ok::<_, Error>(());
            }
            let (tile, record) = walker.tile(*id).zip(walker.record(*id)).expect("a tile that was entered stands");
            let place = region.place(*id).expect("the region holds all tiles of the walk");
            let clock = &watch.clock;
            let take =
                |sink: &dyn Sink| clock.time(&format!("paint {}", sink.name()), || sink.take(tile, place, clock))?;
            let kept = sinks.iter().map(|sink| take(sink.as_ref())).collect::<Result<Vec<Kept>, Error>>()?;
            clock.time(JOURNAL, || journal.record_walked(tile, record, kept))??;
            watch.add(1);
            Ok(())
        };
        new.par_iter().try_for_each(note)?;
        watch.clock.time(JOURNAL, || journal.save())??;
    }
    for (stage, spent) in walker.clock().stages() {
        watch.clock.book(&stage, spent);
    }
    // Hand over the rows of the region, from north to south.
    watch.begin("writing rows", Some((region.rows(), "rows of tiles")));
    for row in 0..region.rows() {
        watch.clock.check()?;
        let pieces = |col: u64| {
            let id = region.tile(Place { row, col });
            let is_there = walk.tiles().contains(&id);
            if is_there { journal.pieces(id, sinks.len()) } else { Ok(vec![Vec::new(); sinks.len()]) }
        };
        let pieces = (0..region.cols()).map(pieces).collect::<Result<Vec<_>, Error>>()?;
        Batch { first_row: row, pieces }.append(&region, sinks, watch)?;
        watch.add(1);
    }
    Ok(())
}
