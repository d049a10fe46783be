//! The plan of a pyramid: the tiles at each zoom level, and the pixels of the world that each tile holds.
//!
//! Tiles, their numbers and their zoom levels are those of all web maps: at zoom level z, Web Mercator's square
//! ([`SIDE_M`]) has `2^z` tiles per side. The world's metres are the metres of its plane, with the world's origin at
//! the centre. So a tile lies where the metres and degrees of the world's other files lie, and two bakes of one world
//! have the same tiles where they overlap. But the size of a pixel in metres is no multiple of the metres between
//! vertices.
//!
//! The finest zoom level is the one whose pixels are nearest in size to the cells between vertices. The coarsest is the
//! one in which everything fits into the size of a tile.
//!
//! A world has no end, but the Earth has one. Beyond it, the square repeats to the east, west, north and south. A
//! pyramid lies in the square that holds its region, and [`Pyramid::corner_m`] tells where that square is.

use std::ops::RangeInclusive;

use pmtiles::{TileCoord, TileId};

use crate::area::Area;
use crate::error::Error;
use crate::web::mercator::{SIDE_M, degrees};

/// Pixels per side of a tile.
pub const TILE_PX: i64 = 256;

/// The finest zoom level, with pixels of 19 mm. MapLibre shows none beyond 24, and dense tiles that are cut take one
/// level more.
pub const MAX_ZOOM: u8 = 23;

/// Tiles per side of a block, as a power of two: 1024 pixels, so that the surroundings that must be read are small
/// compared to the picture.
const BLOCK_BITS: u8 = 2;

/// Tiles per side of a square of blocks, as a power of two: 8192 pixels, so that the surroundings that must be known
/// are small compared to the square.
const SQUARE_BITS: u8 = 5;

/// Largest distance of a pixel from the origin, in pixels, so that metres as `f64` tell pixels apart.
const MAX_PIXEL: f64 = (1_u64 << 50) as f64;

/// A rectangle of the world in metres, east and north of its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Western edge.
    pub west_m: f64,
    /// Southern edge.
    pub south_m: f64,
    /// Eastern edge.
    pub east_m: f64,
    /// Northern edge.
    pub north_m: f64,
}

/// The tiles of a web map.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    bounds: Bounds,
    min_zoom: u8,
    max_zoom: u8,
    /// Number of the repeated square, east and south of the one whose centre is the world's origin.
    square: [i64; 2],
    /// Bounds in pixels of the finest zoom, rounded outwards and counted from the square's north-western corner.
    pixels: Area,
}

/// A tile by its place in an archive: column from the west, row from the north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TilePlace {
    /// Zoom level.
    pub zoom: u8,
    /// Column from the west, below `2^zoom`.
    pub x: u32,
    /// Row from the north, below `2^zoom`.
    pub y: u32,
}

impl TilePlace {
    /// Returns the place as PMTiles has it.
    pub(super) fn coord(self) -> TileCoord {
        TileCoord::new(self.zoom, self.x, self.y).expect("a plan's tiles lie in its square")
    }

    /// Number of the place along the Hilbert curves of all zoom levels.
    fn id(self) -> u64 {
        TileId::from(self.coord()).value()
    }

    /// Returns the four tiles of the next zoom level that cover this tile, in the order of the curve.
    pub(super) fn quarters(self) -> [TilePlace; 4] {
        let quarter = |x, y| TilePlace { zoom: self.zoom + 1, x: 2 * self.x + x, y: 2 * self.y + y };
        let mut quarters = [quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1)];
        quarters.sort_by_key(|tile| tile.id());
        quarters
    }
}

/// Tiles that are drawn as one picture: a square of tiles, clipped to those that exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Zoom level of the tiles.
    pub zoom: u8,
    /// Columns and rows of the tiles in the archive.
    pub places: Area,
}

impl Block {
    /// Column and row of the square in which the block lies.
    pub(super) fn square(&self) -> [i64; 2] {
        [self.places.x0, self.places.y0].map(|at| at >> SQUARE_BITS)
    }

    /// Returns the tiles in the order of their numbers.
    pub fn tiles(&self) -> Vec<TilePlace> {
        let place = |(x, y)| TilePlace { zoom: self.zoom, x: x as u32, y: y as u32 };
        let mut tiles: Vec<TilePlace> = self.places.vertices().map(place).collect();
        tiles.sort_by_key(|tile| tile.id());
        tiles
    }
}

impl Pyramid {
    /// Plans a pyramid that covers `bounds`. Its finest pixels are about `cell_m` metres wide: between 0.7 and 1.4
    /// times as much, where there is such a zoom level.
    ///
    /// # Errors
    /// If the bounds are empty, beyond what `f64` can tell apart, or across the edge of two squares.
    pub fn new(bounds: Bounds, cell_m: f64) -> Result<Pyramid, Error> {
        let refused = |message: String, hint: &str| Error::Option { message, hint: hint.into() };
        if !(cell_m.is_finite() && cell_m > 0.0) {
            return Err(refused(format!("a pixel of {cell_m} m cannot be"), "take a pixel larger than 0 m"));
        }
        let Bounds { west_m, south_m, east_m, north_m } = bounds;
        if !(west_m < east_m && south_m < north_m) {
            let message =
                format!("a map from {west_m} m to {east_m} m east, {south_m} m to {north_m} m north is empty");
            return Err(refused(message, "west comes before east, and south before north"));
        }
        let is_fine = |zoom: &u8| pixel_m(*zoom) <= cell_m * std::f64::consts::SQRT_2;
        let max_zoom = (0..=MAX_ZOOM).find(is_fine).unwrap_or(MAX_ZOOM);
        let edges = [west_m, -north_m, east_m, -south_m].map(|metres| metres / pixel_m(max_zoom));
        if edges.iter().any(|edge| edge.abs() > MAX_PIXEL) {
            let message = format!("pixels of {cell_m} m cannot be told apart as far from the origin as this");
            return Err(refused(message, "take a place nearer to the origin, or larger pixels"));
        }
        let [x0, y0] = [edges[0], edges[1]].map(|edge| edge.floor() as i64);
        let [x1, y1] = [edges[2], edges[3]].map(|edge| edge.ceil() as i64);
        let side = TILE_PX << max_zoom;
        let square_of = |pixel: i64| (pixel + side / 2).div_euclid(side);
        let square = [x0, y0].map(square_of);
        for (axis, (first, last)) in
            [(square[0], square_of(x1 - 1)), (square[1], square_of(y1 - 1))].into_iter().enumerate()
        {
            if first != last {
                let edge_km = (first as f64 + 0.5) * SIDE_M / 1000.0;
                let (edge_km, side) = if axis == 0 { (edge_km, "east") } else { (0.0 - edge_km, "north") };
                let message = format!(
                    "web maps have the Earth's size, and the region lies across the edge of one, {edge_km:.0} km {side} of the origin"
                );
                return Err(refused(message, "choose a region on one side of the edge, or bake it without a web map"));
            }
        }
        let [left, top] = square.map(|square| square * side - side / 2);
        let pixels = Area { x0: x0 - left, y0: y0 - top, x1: x1 - left, y1: y1 - top };
        let fits = |zoom: &u8| pixels.width().max(pixels.height()) as i64 <= TILE_PX << (max_zoom - zoom);
        let min_zoom = (0..=max_zoom).rev().find(fits).expect("a square has the size of the tile of zoom 0");
        Ok(Pyramid { bounds, min_zoom, max_zoom, square, pixels })
    }

    /// Bounds of the map; its tiles reach further by less than a tile.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The coarsest zoom level, in which the bounds have 256 pixels at most.
    pub fn min_zoom(&self) -> u8 {
        self.min_zoom
    }

    /// The finest zoom level.
    pub fn max_zoom(&self) -> u8 {
        self.max_zoom
    }

    /// All zoom levels, the coarsest first.
    pub fn zooms(&self) -> RangeInclusive<u8> {
        self.min_zoom..=self.max_zoom
    }

    /// The north-western corner of the square of tiles, in metres east and north of the world's origin.
    pub fn corner_m(&self) -> [f64; 2] {
        let [east, south] = self.square.map(|square| (square as f64 - 0.5) * SIDE_M);
        [east, -south]
    }

    /// Side length of a pixel in metres.
    ///
    /// # Panics
    /// If there is no such zoom level.
    pub fn pixel_m(&self, zoom: u8) -> f64 {
        assert!(zoom <= self.max_zoom, "zoom {zoom} of {}", self.max_zoom);
        pixel_m(zoom)
    }

    /// Returns the columns and rows of the tiles of a zoom level.
    ///
    /// # Panics
    /// If there is no such zoom level.
    pub fn places(&self, zoom: u8) -> Area {
        assert!(zoom <= self.max_zoom, "zoom {zoom} of {}", self.max_zoom);
        let side = TILE_PX << (self.max_zoom - zoom);
        let Area { x0, y0, x1, y1 } = self.pixels;
        let [x0, y0] = [x0, y0].map(|edge| edge.div_euclid(side));
        let [x1, y1] = [x1, y1].map(|edge| (edge - 1).div_euclid(side) + 1);
        Area { x0, y0, x1, y1 }
    }

    /// Returns the columns and rows of the tiles of a square of blocks.
    pub(super) fn square(&self, zoom: u8, [x, y]: [i64; 2]) -> Area {
        let side = 1 << SQUARE_BITS;
        let all = Area::new(x * side, y * side, side as usize, side as usize);
        self.places(zoom).common(&all).expect("a square has a block")
    }

    /// Number of tiles, at all zoom levels.
    pub fn tiles(&self) -> u64 {
        self.zooms().map(|zoom| self.places(zoom).len() as u64).sum()
    }

    /// Returns the pixels of some tiles of a zoom level, counted from the world's origin.
    pub fn world_pixels(&self, zoom: u8, places: Area) -> Area {
        let side = TILE_PX << zoom;
        let [left, top] = self.square.map(|square| square * side - side / 2);
        let Area { x0, y0, x1, y1 } = places;
        Area { x0: left + x0 * TILE_PX, y0: top + y0 * TILE_PX, x1: left + x1 * TILE_PX, y1: top + y1 * TILE_PX }
    }

    /// Returns all tiles of a zoom level in blocks, in the order of the tiles' numbers, in which each block is beside
    /// the one before.
    ///
    /// A block is a square of a quadtree, so its tiles are consecutive along the curve that numbers them.
    pub fn blocks(&self, zoom: u8) -> impl Iterator<Item = Block> {
        let (places, level) = (self.places(zoom), zoom.saturating_sub(BLOCK_BITS));
        let mut waiting = vec![TilePlace { zoom: 0, x: 0, y: 0 }];
        std::iter::from_fn(move || {
            while let Some(square) = waiting.pop() {
                let side = 1_i64 << (zoom - square.zoom);
                let (x, y) = (square.x as i64 * side, square.y as i64 * side);
                let Some(common) = places.common(&Area { x0: x, y0: y, x1: x + side, y1: y + side }) else { continue };
                if square.zoom == level {
                    return Some(Block { zoom, places: common });
                }
                // The last square in is the first out.
                waiting.extend(square.quarters().into_iter().rev());
            }
            None
        })
    }

    /// Returns the bounds in degrees: west, south, east and north. They are rounded outwards to whole pixels of the
    /// finest zoom, because GDAL takes the corner of the bounds for the corner of a pixel.
    pub fn degrees(&self) -> [f64; 4] {
        let finest_m = pixel_m(self.max_zoom);
        let at = |x: i64, y: i64| degrees([x as f64 * finest_m - SIDE_M / 2.0, SIDE_M / 2.0 - y as f64 * finest_m]);
        let Area { x0, y0, x1, y1 } = self.pixels;
        let ([west, south], [east, north]) = (at(x0, y1), at(x1, y0));
        [west, south, east, north]
    }
}

/// Returns the side length in metres of a pixel of a zoom level.
fn pixel_m(zoom: u8) -> f64 {
    SIDE_M / (TILE_PX << zoom) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pyramid(west_m: f64, south_m: f64, east_m: f64, north_m: f64, cell_m: f64) -> Pyramid {
        Pyramid::new(Bounds { west_m, south_m, east_m, north_m }, cell_m).unwrap()
    }

    #[test]
    fn tiles_are_those_of_web_mercator() {
        // With 10 m per vertex, zoom 14 has pixels of 9.55 m, and four tiles of zoom 9 meet at the origin.
        let pyramid = pyramid(-5000.0, -3000.0, 5000.0, 3000.0, 10.0);
        assert_eq!(pyramid.zooms(), 11..=14);
        assert!((pyramid.pixel_m(14) - 9.554_628_535_647_032).abs() < 1e-12);
        // By the formulas of "Slippy map tilenames" for -0.0449, 0.0269 and 0.0449, -0.0269 degrees.
        assert_eq!(pyramid.places(14), Area { x0: 8189, y0: 8190, x1: 8195, y1: 8194 });
        assert_eq!(pyramid.places(11), Area { x0: 1023, y0: 1023, x1: 1025, y1: 1025 });
        assert_eq!(pyramid.world_pixels(14, pyramid.places(14)), Area { x0: -768, y0: -512, x1: 768, y1: 512 });
        assert_eq!(pyramid.corner_m(), [-SIDE_M / 2.0, SIDE_M / 2.0]);
    }

    #[test]
    fn the_finest_pixels_are_nearest_to_the_cells() {
        let finest = |cell_m: f64| pyramid(0.0, 0.0, 1e4, 1e4, cell_m).max_zoom();
        assert_eq!([1e4, 10.0, 8.0, 6.8, 6.7, 1.0, 0.01, 0.001].map(finest), [4, 14, 14, 14, 15, 17, 23, 23]);
    }

    #[test]
    fn degrees_are_those_of_the_bounds() {
        let pyramid = pyramid(-7000.0, 11_000.0, -2000.0, 14_000.0, 10.0);
        let [west, south, east, north] = pyramid.degrees();
        let pixel = degrees([pyramid.pixel_m(pyramid.max_zoom()), 0.0])[0];
        for (found, metres, axis) in
            [(west, -7000.0, 0), (east, -2000.0, 0), (south, 11_000.0, 1), (north, 14_000.0, 1)]
        {
            assert!((found - degrees([metres, metres])[axis]).abs() <= pixel, "{found} of {metres} m");
        }
        assert!(west <= degrees([-7000.0, 0.0])[0] && north >= degrees([0.0, 14_000.0])[1], "outwards");
    }

    #[test]
    fn tiles_hold_the_bounds_and_lie_in_the_square() {
        for (west, south, width, height, finest) in [
            (-1.0, -1.0, 2.0, 2.0, 1.0),
            (1e9, -3e9, 70_000.0, 30.0, 4.0),
            (-513.0, 511.0, 12_345.0, 6_789.0, 0.5),
            (0.0, 0.0, 256.0, 256.0, 1.0),
            (-40_000.0, 10.0, 65_536.0, 1_000.0, 7.5),
        ] {
            let pyramid = pyramid(west, south, west + width, south + height, finest);
            for zoom in pyramid.zooms() {
                let (places, pixel_m) = (pyramid.places(zoom), pyramid.pixel_m(zoom));
                assert!(
                    places.x0 >= 0 && places.y0 >= 0 && places.x1.max(places.y1) <= 1 << zoom,
                    "{pyramid:?} {zoom}"
                );
                let pixels = pyramid.world_pixels(zoom, places);
                assert!(pixels.x0 as f64 * pixel_m <= west && pixels.x1 as f64 * pixel_m >= west + width);
                assert!(-pixels.y1 as f64 * pixel_m <= south && -pixels.y0 as f64 * pixel_m >= south + height);
                assert!(zoom == 0 || pixels.x0 % TILE_PX == 0 && pixels.y0 % TILE_PX == 0, "a tile is the world's");
            }
            assert!(pyramid.places(pyramid.min_zoom()).len() <= 4, "all has the size of a tile");
            let [west, south, east, north] = pyramid.degrees();
            assert!(-180.0 <= west && east <= 180.0 && -86.0 < south && north < 86.0, "on the Earth");
        }
    }

    #[test]
    fn two_bakes_of_a_world_have_the_same_tiles() {
        let (one, other) = (pyramid(0.0, 0.0, 9000.0, 9000.0, 2.0), pyramid(-9000.0, -800.0, 4000.0, 30_000.0, 2.0));
        assert_ne!(one.min_zoom(), other.min_zoom());
        for zoom in one.zooms() {
            let common = one.places(zoom).common(&other.places(zoom)).unwrap();
            assert_eq!(one.world_pixels(zoom, common), other.world_pixels(zoom, common));
        }
    }

    #[test]
    fn beyond_the_earth_tiles_begin_again() {
        let (here, there) = (pyramid(0.0, 0.0, 900.0, 900.0, 2.0), 4.0 * SIDE_M);
        let far = pyramid(there, -there, there + 900.0, 900.0 - there, 2.0);
        assert_eq!((far.places(15), far.degrees()), (here.places(15), here.degrees()));
        let (near, far) = (here.world_pixels(15, here.places(15)), far.world_pixels(15, far.places(15)));
        assert_eq!([far.x0 - near.x0, far.y0 - near.y0], [4 * (TILE_PX << 15); 2]);
    }

    #[test]
    fn blocks_hold_every_tile_once_and_in_the_order_of_their_numbers() {
        let pyramid = pyramid(-7000.0, 1000.0, 5000.0, 12_000.0, 3.0);
        let mut last = None;
        let mut all = 0;
        for zoom in pyramid.zooms() {
            let places = pyramid.places(zoom);
            for tile in pyramid.blocks(zoom).flat_map(|block| block.tiles()) {
                assert!(last < Some(tile.id()), "{tile:?}");
                assert!(places.common(&Area::new(tile.x.into(), tile.y.into(), 1, 1)).is_some(), "{tile:?}");
                last = Some(tile.id());
                all += 1;
            }
        }
        assert_eq!(all, pyramid.tiles());
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |west_m: f64, east_m: f64, finest_m: f64| {
            let bounds = Bounds { west_m, south_m: 0.0, east_m, north_m: 1.0 };
            Pyramid::new(bounds, finest_m).unwrap_err().to_string()
        };
        assert!(refused(0.0, 1.0, 0.0).contains("0 m"));
        assert!(refused(0.0, 1.0, f64::NAN).contains("NaN"));
        assert!(refused(1.0, 1.0, 1.0).contains("empty"));
        assert!(refused(0.0, f64::NAN, 1.0).contains("empty"));
        assert!(refused(1e17, 2e17, 1.0).contains("origin"));
        assert!(refused(2e7, 2.1e7, 1.0).contains("20038 km east"));
        let bounds = Bounds { west_m: 0.0, south_m: -2.1e7, east_m: 1.0, north_m: -2e7 };
        assert!(Pyramid::new(bounds, 1.0).unwrap_err().to_string().contains("-20038 km north"));
    }
}
