//! Where tiles are: zoom levels without end in columns and rows.

use crate::area::{Area, MAX_COORDINATE};
use crate::web::TILE_PX;

/// The finest zoom level, whose pixels are a quarter of the way from a vertex to the next. The coarsest is 0, where a pixel is 128
/// vertices: from further away it takes minutes to see what a screen shows.
pub(super) const MAX_ZOOM: u8 = 9;

/// Pixels of a vertex at the finest level, as a power of two.
const FINEST: u8 = 2;

/// Vertices from the origin within which there are tiles: what is planned around one is well within what a world has.
pub(super) const REACH: i64 = MAX_COORDINATE / 2;

/// How much of a map is drawn, and how well.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Stage {
    /// As a draft, of land at fewer nodes again.
    Glance,
    /// Relief and waters, of land at fewer nodes.
    Draft,
    /// All that the style draws.
    Full,
}

impl Stage {
    /// What addresses call it.
    pub fn named(name: &str) -> Option<Stage> {
        match name {
            "glance" => Some(Stage::Glance),
            "draft" => Some(Stage::Draft),
            "full" => Some(Stage::Full),
            _ => None,
        }
    }

    /// How often the nodes of its land are thinned out to every second one, if they are.
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
pub(super) struct Spot {
    pub zoom: u8,
    pub x: i64,
    pub y: i64,
    /// Whether it has twice the pixels a side.
    pub is_dense: bool,
}

impl Spot {
    /// A tile, if there is one.
    pub fn new(zoom: u64, x: i64, y: i64, is_dense: bool) -> Option<Spot> {
        let zoom = u8::try_from(zoom).ok().filter(|zoom| *zoom <= MAX_ZOOM)?;
        let tiles = (REACH << FINEST >> (MAX_ZOOM - zoom)) / TILE_PX;
        let is_within = |at: i64| (-tiles..tiles).contains(&at);
        (is_within(x) && is_within(y)).then_some(Spot { zoom, x, y, is_dense })
    }

    /// Its pixels, counted from the origin.
    pub fn pixels(&self) -> Area {
        let side = if self.is_dense { 2 * TILE_PX } else { TILE_PX };
        Area::new(self.x * side, self.y * side, side as usize, side as usize)
    }
}

/// Metres that a pixel of a tile that is not dense shows, in a world with so many metres between vertices.
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
            // What a column is in vertices, without fractions.
            let side = i128::from(TILE_PX) << (MAX_ZOOM - zoom);
            let last = (i128::from(REACH) * 4 / side) as i64 - 1;
            assert!(Spot::new(zoom.into(), last, -last - 1, true).is_some(), "{zoom}");
            assert!(
                Spot::new(zoom.into(), last + 1, 0, true).is_none()
                    && Spot::new(zoom.into(), 0, -last - 2, false).is_none()
            );
        }
        assert_eq!(Spot::new(10, 0, 0, false), None);
        assert_eq!(Spot::new(5, -1, 2, true).unwrap().pixels(), Area::new(-512, 1024, 512, 512));
    }
}
