//! Addresses of tiles on the page: zoom levels with columns and rows counted from the world's origin.

use serde::Deserialize;

use crate::area::{Area, MAX_COORDINATE};
use crate::web::TILE_PX;

/// The finest zoom level, where a pixel is a quarter of the distance from a vertex to the next. At the coarsest level,
/// 0, a pixel is 128 vertices wide: at a coarser one it would take minutes to draw a screen.
pub(super) const MAX_ZOOM: u8 = 9;

/// Number of pixels from a vertex to the next at the finest level, as a power of two.
const FINEST: u8 = 2;

/// Distance in vertices from the origin within which there are tiles. All that is planned around a tile is then well
/// within the range of a world.
pub(super) const REACH: i64 = MAX_COORDINATE / 2;

/// Level of detail of a tile's picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Stage {
    /// Like a draft, from land at fewer nodes still.
    Glance,
    /// Relief and waters, from land at fewer nodes than those of the full picture.
    Draft,
    /// Everything that the style draws.
    #[default]
    Full,
}

impl Stage {
    /// Returns how often every second node of the full picture's land is left out; `None` for the full picture.
    pub fn halvings(self) -> Option<u32> {
        match self {
            Stage::Glance => Some(3),
            Stage::Draft => Some(1),
            Stage::Full => None,
        }
    }
}

/// A tile: its zoom level, column from the west and row from the north, counted from the world's origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TileAddress {
    pub zoom: u8,
    pub x: i64,
    pub y: i64,
    /// True if the tile has twice as many pixels a side, for dense screens.
    pub is_dense: bool,
}

impl TileAddress {
    /// Returns a tile, if there is one at this place.
    pub fn new(zoom: i64, x: i64, y: i64, is_dense: bool) -> Option<TileAddress> {
        let zoom = u8::try_from(zoom).ok().filter(|zoom| *zoom <= MAX_ZOOM)?;
        let tiles = (REACH << FINEST >> (MAX_ZOOM - zoom)) / TILE_PX;
        let is_within = |at: i64| (-tiles..tiles).contains(&at);
        (is_within(x) && is_within(y)).then_some(TileAddress { zoom, x, y, is_dense })
    }

    /// Returns the tile's area in pixels, counted from the origin.
    pub fn pixels(&self) -> Area {
        let side = if self.is_dense { 2 * TILE_PX } else { TILE_PX };
        Area::new(self.x * side, self.y * side, side as usize, side as usize)
    }
}

/// Returns the metres that a pixel of a tile shows, in a world with `spacing_m` metres between vertices. A pixel of a
/// dense tile shows half as much.
pub(super) fn pixel_m(spacing_m: f64, zoom: u8) -> f64 {
    spacing_m * f64::from(1_u32 << (MAX_ZOOM - zoom)) / f64::from(1_u32 << FINEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_and_end_where_the_world_does() {
        assert_eq!([9, 7, 0].map(|zoom| pixel_m(10.0, zoom)), [2.5, 10.0, 1280.0]);
        for zoom in 0..=MAX_ZOOM {
            // The side of a tile in quarters of a vertex, without fractions.
            let side = i128::from(TILE_PX) << (MAX_ZOOM - zoom);
            let last = (i128::from(REACH) * 4 / side) as i64 - 1;
            assert!(TileAddress::new(zoom.into(), last, -last - 1, true).is_some(), "{zoom}");
            assert!(
                TileAddress::new(zoom.into(), last + 1, 0, true).is_none()
                    && TileAddress::new(zoom.into(), 0, -last - 2, false).is_none()
            );
        }
        assert_eq!(TileAddress::new(10, 0, 0, false), None);
        assert_eq!(TileAddress::new(5, -1, 2, true).unwrap().pixels(), Area::new(-512, 1024, 512, 512));
    }
}
