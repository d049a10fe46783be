//! The plan of a pyramid: which tiles there are at each zoom level, and which pixels of the world each holds.
//!
//! The pixels of a zoom level are those of the whole world, counted from its origin, and a tile begins at a multiple of
//! [`TILE_PX`]: two bakes of one world with the same finest pixel have the same tiles where they overlap. Archives count
//! tiles from zero in a square of `2^zoom` on a side. That square's north-western corner is put at a multiple of half
//! its side: one that holds the bounds is then never more than four times as large as they are, even when they lie
//! across the origin, and from zoom 1 on its tiles are the world's. Only the one tile of zoom 0 may lie between them.
//!
//! So tile `(zoom, x, y)` of an archive is the world's tile `(x + corner_x * 2^(zoom - 1), y + corner_y * 2^(zoom - 1))`
//! for the two integers of [`Plan::corner`].

use pmtiles::{TileCoord, TileId};

use crate::area::Area;
use crate::error::Error;

/// Pixels on a side of a tile.
pub const TILE_PX: i64 = 256;

/// The most zoom levels above the coarsest: GDAL takes no MBTiles with more, and the finest then has 2^32 pixels a side.
pub const MAX_ZOOM: u8 = 24;

/// Tiles on a side of a block, as a power of two: 1024 pixels, so that what is read around a picture weighs little.
const BLOCK_BITS: u8 = 2;

/// Tiles on a side of a square of blocks, as a power of two: 8192 pixels, so that what is known of all that lies around a
/// square weighs little beside it.
const SQUARE_BITS: u8 = 5;

/// No pixel is further from the origin, so that metres, as `f64`, tell pixels apart.
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

/// Which tiles a web map has.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    bounds: Bounds,
    finest_m: f64,
    max_zoom: u8,
    /// North-western corner of the square, in halves of its side.
    corner: [i64; 2],
    /// The bounds in pixels of the finest zoom, counted from the corner.
    pixels: Area,
}

/// A tile by its place in an archive: column from the west, row from the north.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TilePlace {
    /// Zoom level; 0 is the coarsest.
    pub zoom: u8,
    /// Column from the west, below `2^zoom`.
    pub x: u32,
    /// Row from the north, below `2^zoom`.
    pub y: u32,
}

impl TilePlace {
    /// The same place as PMTiles has it.
    pub(super) fn coord(self) -> TileCoord {
        TileCoord::new(self.zoom, self.x, self.y).expect("a plan's tiles lie in its square")
    }

    /// The place's number along the Hilbert curves of all zoom levels.
    fn id(self) -> u64 {
        TileId::from(self.coord()).value()
    }

    /// The four tiles of the next zoom that cover this one, along the curve.
    fn quarters(self) -> [TilePlace; 4] {
        let quarter = |x, y| TilePlace { zoom: self.zoom + 1, x: 2 * self.x + x, y: 2 * self.y + y };
        let mut quarters = [quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1)];
        quarters.sort_by_key(|tile| tile.id());
        quarters
    }
}

/// Tiles that are drawn as one picture: a square of them, cut to those that there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Their zoom level.
    pub zoom: u8,
    /// Columns and rows in the archive.
    pub places: Area,
}

impl Block {
    /// The square that it lies in, by its column and row.
    pub(super) fn square(&self) -> [i64; 2] {
        [self.places.x0, self.places.y0].map(|at| at >> SQUARE_BITS)
    }

    /// The tiles in the order of their numbers.
    pub fn tiles(&self) -> Vec<TilePlace> {
        let place = |(x, y)| TilePlace { zoom: self.zoom, x: x as u32, y: y as u32 };
        let mut tiles: Vec<TilePlace> = self.places.vertices().map(place).collect();
        tiles.sort_by_key(|tile| tile.id());
        tiles
    }
}

impl Plan {
    /// The plan of a pyramid that covers `bounds`, with pixels of `finest_m` metres at its finest zoom.
    ///
    /// It has as many zoom levels as it takes until all fits in one tile, and two at least.
    ///
    /// # Errors
    /// When the bounds are empty, beyond what `f64` can tell apart, or take more than [`MAX_ZOOM`] levels.
    pub fn new(bounds: Bounds, finest_m: f64) -> Result<Plan, Error> {
        let refused = |message: String, hint: &str| Error::Option { message, hint: hint.into() };
        if !(finest_m.is_finite() && finest_m > 0.0) {
            return Err(refused(format!("a pixel of {finest_m} m cannot be"), "take a pixel larger than 0 m"));
        }
        let Bounds { west_m, south_m, east_m, north_m } = bounds;
        if !(west_m < east_m && south_m < north_m) {
            let message =
                format!("a map from {west_m} m to {east_m} m east, {south_m} m to {north_m} m north is empty");
            return Err(refused(message, "west comes before east, and south before north"));
        }
        let edges = [west_m / finest_m, -north_m / finest_m, east_m / finest_m, -south_m / finest_m];
        if edges.iter().any(|edge| edge.abs() > MAX_PIXEL) {
            let message = format!("pixels of {finest_m} m cannot be told apart as far from the origin as this");
            return Err(refused(message, "take a place nearer to the origin, or larger pixels"));
        }
        let [x0, y0] = [edges[0], edges[1]].map(|edge| edge.floor() as i64);
        let [x1, y1] = [edges[2], edges[3]].map(|edge| edge.ceil() as i64);
        let world = Area { x0, y0, x1, y1 };
        let Some(max_zoom) = (1..=MAX_ZOOM).find(|zoom| fits(&world, *zoom)) else {
            let message = format!(
                "a map of {} x {} pixels takes more than {MAX_ZOOM} zoom levels",
                world.width(),
                world.height()
            );
            return Err(refused(message, "take larger pixels, or a smaller place"));
        };
        let corner = [x0, y0].map(|edge| edge.div_euclid(half(max_zoom)));
        let [left, top] = corner.map(|corner| corner * half(max_zoom));
        let pixels = Area { x0: x0 - left, y0: y0 - top, x1: x1 - left, y1: y1 - top };
        Ok(Plan { bounds, finest_m, max_zoom, corner, pixels })
    }

    /// What the map shows; its tiles reach up to a tile further.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The finest zoom; the coarsest is 0.
    pub fn max_zoom(&self) -> u8 {
        self.max_zoom
    }

    /// The north-western corner of the square of tiles, in halves of its side east and south of the world's origin.
    pub fn corner(&self) -> [i64; 2] {
        self.corner
    }

    /// That corner in metres east and north.
    pub fn corner_m(&self) -> [f64; 2] {
        let half_m = half(self.max_zoom) as f64 * self.finest_m;
        // Not the negative, which has a zero of its own.
        [self.corner[0] as f64 * half_m, 0.0 - self.corner[1] as f64 * half_m]
    }

    /// Metres on a side of a pixel.
    ///
    /// # Panics
    /// When there is no such zoom.
    pub fn pixel_m(&self, zoom: u8) -> f64 {
        assert!(zoom <= self.max_zoom, "zoom {zoom} of {}", self.max_zoom);
        self.finest_m * (1_u64 << (self.max_zoom - zoom)) as f64
    }

    /// The columns and rows of the tiles of a zoom.
    ///
    /// # Panics
    /// When there is no such zoom.
    pub fn places(&self, zoom: u8) -> Area {
        assert!(zoom <= self.max_zoom, "zoom {zoom} of {}", self.max_zoom);
        let side = TILE_PX << (self.max_zoom - zoom);
        let Area { x0, y0, x1, y1 } = self.pixels;
        let [x0, y0] = [x0, y0].map(|edge| edge.div_euclid(side));
        let [x1, y1] = [x1, y1].map(|edge| (edge - 1).div_euclid(side) + 1);
        Area { x0, y0, x1, y1 }
    }

    /// The columns and rows of the tiles of a square of blocks.
    pub(super) fn square(&self, zoom: u8, [x, y]: [i64; 2]) -> Area {
        let side = 1 << SQUARE_BITS;
        let all = Area::new(x * side, y * side, side as usize, side as usize);
        self.places(zoom).common(&all).expect("a square has a block")
    }

    /// How many tiles there are, of all zoom levels.
    pub fn tiles(&self) -> u64 {
        (0..=self.max_zoom).map(|zoom| self.places(zoom).len() as u64).sum()
    }

    /// The pixels of some tiles of a zoom, counted from the world's origin.
    pub fn world_pixels(&self, zoom: u8, places: Area) -> Area {
        // Halves of the side in pixels of this zoom: at zoom 0 the half of a tile.
        let [left, top] = self.corner.map(|corner| corner * half(zoom));
        let Area { x0, y0, x1, y1 } = places;
        Area { x0: left + x0 * TILE_PX, y0: top + y0 * TILE_PX, x1: left + x1 * TILE_PX, y1: top + y1 * TILE_PX }
    }

    /// All tiles of a zoom in blocks, in the order of the tiles' numbers: the next block is beside the last.
    ///
    /// A block is a square of a quadtree, and so its tiles follow one another along the curve that numbers them.
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
                // The last in is the first out.
                waiting.extend(square.quarters().into_iter().rev());
            }
            None
        })
    }

    /// The bounds in degrees, west, south, east and north, as if the square were the Earth in Web Mercator.
    ///
    /// That is where readers that know only the Earth must put a flat world for its tiles to lie where they are.
    pub fn degrees(&self) -> [f64; 4] {
        let side = (TILE_PX << self.max_zoom) as f64;
        let Area { x0, y0, x1, y1 } = self.pixels;
        let longitude = |x: i64| x as f64 / side * 360.0 - 180.0;
        let latitude = |y: i64| {
            let turned = std::f64::consts::PI * (1.0 - 2.0 * y as f64 / side);
            libm::atan(libm::sinh(turned)).to_degrees()
        };
        [longitude(x0), latitude(y1), longitude(x1), latitude(y0)]
    }
}

/// Half the side of the square in pixels of a zoom.
fn half(zoom: u8) -> i64 {
    (TILE_PX / 2) << zoom
}

/// Whether a square with its corner at a multiple of its half, and `2^zoom` tiles on a side, holds the pixels.
fn fits(pixels: &Area, zoom: u8) -> bool {
    let holds = |from: i64, to: i64| to <= (from.div_euclid(half(zoom)) + 2) * half(zoom);
    holds(pixels.x0, pixels.x1) && holds(pixels.y0, pixels.y1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(west_m: f64, south_m: f64, east_m: f64, north_m: f64, finest_m: f64) -> Plan {
        Plan::new(Bounds { west_m, south_m, east_m, north_m }, finest_m).unwrap()
    }

    #[test]
    fn a_map_across_the_origin_has_few_levels() {
        let plan = plan(-5000.0, -3000.0, 5000.0, 3000.0, 10.0);
        // 1000 x 600 pixels in a square of 1024 whose middle is the origin.
        assert_eq!((plan.max_zoom(), plan.corner(), plan.corner_m()), (2, [-1, -1], [-5120.0, 5120.0]));
        assert_eq!(plan.places(2), Area { x0: 0, y0: 0, x1: 4, y1: 4 });
        assert_eq!(plan.places(0), Area { x0: 0, y0: 0, x1: 1, y1: 1 });
        assert_eq!(plan.world_pixels(2, plan.places(2)), Area { x0: -512, y0: -512, x1: 512, y1: 512 });
        assert_eq!((plan.pixel_m(2), plan.pixel_m(0)), (10.0, 40.0));
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
            let plan = plan(west, south, west + width, south + height, finest);
            for zoom in 0..=plan.max_zoom() {
                let (places, pixel_m) = (plan.places(zoom), plan.pixel_m(zoom));
                assert!(places.x0 >= 0 && places.y0 >= 0 && places.x1.max(places.y1) <= 1 << zoom, "{plan:?} {zoom}");
                let pixels = plan.world_pixels(zoom, places);
                assert!(pixels.x0 as f64 * pixel_m <= west && pixels.x1 as f64 * pixel_m >= west + width);
                assert!(-pixels.y1 as f64 * pixel_m <= south && -pixels.y0 as f64 * pixel_m >= south + height);
                assert!(zoom == 0 || pixels.x0 % TILE_PX == 0 && pixels.y0 % TILE_PX == 0, "a tile is the world's");
            }
            assert_eq!(plan.places(0).len(), 1, "all fits in one tile");
        }
    }

    #[test]
    fn two_bakes_of_a_world_have_the_same_tiles() {
        let (one, other) = (plan(0.0, 0.0, 9000.0, 9000.0, 2.0), plan(-9000.0, -800.0, 4000.0, 30_000.0, 2.0));
        assert_ne!(one.max_zoom(), other.max_zoom());
        for up in 0..one.max_zoom() {
            let zooms = [one.max_zoom() - up, other.max_zoom() - up];
            let [tile, twin] = [(&one, zooms[0]), (&other, zooms[1])].map(|(plan, zoom)| {
                assert_eq!(plan.pixel_m(zoom), 2.0 * f64::from(1 << up));
                // The tile that holds the metre 3000 east, 3000 north.
                let pixel = |metres: f64| (metres / plan.pixel_m(zoom)) as i64;
                let all = plan.world_pixels(zoom, plan.places(zoom));
                let (x, y) = ((pixel(3000.0) - all.x0) / TILE_PX, (pixel(-3000.0) - all.y0) / TILE_PX);
                let place = Area::new(plan.places(zoom).x0 + x, plan.places(zoom).y0 + y, 1, 1);
                plan.world_pixels(zoom, place)
            });
            assert_eq!(tile, twin);
        }
    }

    #[test]
    fn blocks_hold_every_tile_once_and_in_the_order_of_their_numbers() {
        let plan = plan(-7000.0, 1000.0, 5000.0, 12_000.0, 3.0);
        let mut last = None;
        let mut all = 0;
        for zoom in 0..=plan.max_zoom() {
            let places = plan.places(zoom);
            for tile in plan.blocks(zoom).flat_map(|block| block.tiles()) {
                assert!(last < Some(tile.id()), "{tile:?}");
                assert!(places.common(&Area::new(tile.x.into(), tile.y.into(), 1, 1)).is_some(), "{tile:?}");
                last = Some(tile.id());
                all += 1;
            }
        }
        assert_eq!(all, plan.tiles());
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |west_m: f64, east_m: f64, finest_m: f64| {
            let bounds = Bounds { west_m, south_m: 0.0, east_m, north_m: 1.0 };
            Plan::new(bounds, finest_m).unwrap_err().to_string()
        };
        assert!(refused(0.0, 1.0, 0.0).contains("0 m"));
        assert!(refused(0.0, 1.0, f64::NAN).contains("NaN"));
        assert!(refused(1.0, 1.0, 1.0).contains("empty"));
        assert!(refused(0.0, f64::NAN, 1.0).contains("empty"));
        assert!(refused(1e17, 2e17, 1.0).contains("origin"));
        assert!(refused(0.0, 1e10, 1.0).contains("zoom levels"));
    }
}
