//! The decisions of earlier walks, and tiles remade from them without a walker.

use crate::agents::record::{Records, TileRecord};
use crate::area::TileId;
use crate::clock::{Clock, stage};
use crate::error::Error;
use crate::stop::Stopped;
use crate::tile::Tile;
use crate::walker::classic::TileAgents;
use crate::walker::stand;
use crate::world::World;

/// The records of all tiles of a walk with agents, from which each tile can be made again.
///
/// Based on: Grelsson (2014), section 4.3.
#[derive(Debug)]
pub struct Walked<'w> {
    world: &'w World,
    records: Records,
}

impl<'w> Walked<'w> {
    /// Takes the records of a world.
    ///
    /// # Errors
    /// When a tile has two records, or when a record cannot belong to this world.
    pub fn new(world: &'w World, records: impl IntoIterator<Item = TileRecord>) -> Result<Walked<'w>, Error> {
        Ok(Walked { world, records: sound(world, records)? })
    }

    /// Returns the tile at `id` as the walk left it; `None` if the walk did not make it.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn tile(&self, id: TileId, clock: &Clock) -> Result<Option<Tile>, Stopped> {
        let Some(record) = self.records.find(id) else { return Ok(None) };
        let heights = clock.time(stage::RELIEF, || Tile::bare_heights(self.world, id))?;
        let lines = clock.time(stage::LINES, || TileAgents::new(self.world, id, &heights).lines(record))?;
        Ok(Some(stand(self.world, Some(&self.records), id, heights, lines, clock)?))
    }
}

/// Checks and sorts the records of a world's tiles.
///
/// # Errors
/// When a tile has two records, or when an agent of a record lies outside its tile.
pub(super) fn sound(world: &World, records: impl IntoIterator<Item = TileRecord>) -> Result<Records, Error> {
    let refuse = |message: String| Error::Option {
        message,
        hint: "give the records that a walker of the same world has kept".into(),
    };
    let records: Vec<TileRecord> = records.into_iter().collect();
    let cells = world.tile_cells() as u16;
    for TileRecord { id, river, road } in &records {
        let places = river.iter().chain(road).flat_map(|passage| [passage.start, passage.last]);
        if let Some([east, south]) = places.into_iter().find(|place| place.iter().any(|side| *side > cells)) {
            return Err(refuse(format!(
                "the record of tile {id} has an agent at vertex ({east}, {south}), but its tiles have {cells} cells a side"
            )));
        }
    }
    Records::new(records).map_err(|id| refuse(format!("tile {id} has two records")))
}
