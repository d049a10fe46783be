//! Land, rock and climate at large at a tile's vertices, in worlds that have a geography.

use crate::area::Area;
use crate::geography::Geography;
use crate::geography::climate::PlaceClimate;
use crate::geography::lithology::Lithology;
use crate::geography::rock::BedsLie;
use crate::grain_point::Point;
use crate::tile::TileView;

impl<'a> TileView<'a> {
    /// Returns the climates at the vertices of a row of the tile, an area one vertex high, each with the height of the
    /// ground there in metres above the sea, 0 in the sea.
    ///
    /// # Panics
    /// When the world has no geography, or a part of the row is outside the tile.
    pub fn climates(self, row: Area) -> Vec<(PlaceClimate, f64)> {
        let sea_m = self.world.preset().sea_level_m.unwrap_or(0.0);
        let heights = self.tile.heights.row(row.y0, row.x0, row.x1).iter();
        let above_sea_m = heights.map(|height_m| (f64::from(*height_m) - sea_m).max(0.0));
        self.geography().climates(&self.points(row)).into_iter().zip(above_sea_m).collect()
    }

    /// Returns the [uplift](crate::geography::LandAtLarge::uplift) at the vertices of a row of the tile, an area one
    /// vertex high.
    ///
    /// # Panics
    /// When the world has no geography.
    pub fn uplifts(self, row: Area) -> Vec<f64> {
        self.geography().land_at_large(&self.points(row)).into_iter().map(|land| land.uplift).collect()
    }

    /// Returns the rocks at the vertices of a row of the tile, an area one vertex high.
    ///
    /// # Panics
    /// When the world has no geography.
    pub fn lithologies(self, row: Area) -> Vec<Lithology> {
        self.geography().settings_at(&self.points(row)).iter().map(Lithology::of).collect()
    }

    /// Returns strike and dip of the rock's beds at the vertices of a row of the tile, an area one vertex high.
    ///
    /// # Panics
    /// When the world has no geography.
    pub fn beds(self, row: Area) -> Vec<BedsLie> {
        let (geography, places) = (self.geography(), self.points(row));
        let land = geography.land_at_large(&places);
        places.iter().zip(&land).map(|(at, land)| geography.beds_lie(*at, land)).collect()
    }

    fn geography(self) -> &'a Geography {
        self.world.geography().expect("only worlds with a geography are asked for their climates")
    }

    /// Returns the places of an area's vertices.
    fn points(self, area: Area) -> Vec<Point> {
        let apart = self.world.stride().vertices();
        area.vertices().map(|(x, y)| Point::at_vertex(x * apart, y * apart)).collect()
    }
}
