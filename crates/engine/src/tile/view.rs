//! A tile seen with its world: quantities of which the tile alone holds only a part.

use crate::tile::Tile;
use crate::world::World;

/// A tile and the world that it is a tile of.
///
/// A tile holds what its vertices need and no settings of the world, such as the level of the sea. Whatever takes both
/// reads them from here.
#[derive(Clone, Copy, Debug)]
pub struct TileView<'a> {
    /// The tile.
    pub tile: &'a Tile,
    /// Its world.
    pub world: &'a World,
}

impl<'a> TileView<'a> {
    /// A view of a tile of that world.
    pub fn new(tile: &'a Tile, world: &'a World) -> TileView<'a> {
        TileView { tile, world }
    }
}
