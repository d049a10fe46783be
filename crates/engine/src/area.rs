//! Where things are: rectangles of the vertex lattice, tiles and regions.
//!
//! The vertex lattice is all integer points, x east and y south. A cell is the square between four vertices. Tile
//! (tx, ty) of N x N cells covers cells `[tx N, (tx+1) N) x [ty N, (ty+1) N)`; it has N+1 vertices a side and shares
//! those of its edge with its neighbours.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::Error;

/// A half-open rectangle of the vertex lattice: `x0 <= x < x1`, `y0 <= y < y1`, x east and y south.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Area {
    /// Western edge, inside.
    pub x0: i64,
    /// Northern edge, inside.
    pub y0: i64,
    /// Eastern edge, outside.
    pub x1: i64,
    /// Southern edge, outside.
    pub y1: i64,
}

impl Area {
    /// The area of `width` x `height` vertices whose north-western one is `(x0, y0)`.
    pub const fn new(x0: i64, y0: i64, width: usize, height: usize) -> Area {
        Area { x0, y0, x1: x0 + width as i64, y1: y0 + height as i64 }
    }

    /// Vertices from west to east.
    pub const fn width(&self) -> usize {
        (self.x1 - self.x0) as usize
    }

    /// Vertices from north to south.
    pub const fn height(&self) -> usize {
        (self.y1 - self.y0) as usize
    }

    /// Vertices in all.
    pub const fn len(&self) -> usize {
        self.width() * self.height()
    }

    /// Whether the area holds no vertex.
    pub const fn is_empty(&self) -> bool {
        self.x1 <= self.x0 || self.y1 <= self.y0
    }

    /// This area with `pad` more vertices on each side.
    #[must_use]
    pub const fn padded(&self, pad: usize) -> Area {
        let pad = pad as i64;
        Area { x0: self.x0 - pad, y0: self.y0 - pad, x1: self.x1 + pad, y1: self.y1 + pad }
    }

    /// The smallest area that holds this one and is made of whole squares of so many vertices a side, counted from the origin.
    #[must_use]
    pub const fn on_grid(&self, side: i64) -> Area {
        let [x0, y0] = [self.x0.div_euclid(side) * side, self.y0.div_euclid(side) * side];
        let [x1, y1] = [(self.x1 - 1).div_euclid(side) * side + side, (self.y1 - 1).div_euclid(side) * side + side];
        Area { x0, y0, x1, y1 }
    }

    /// The smallest area that holds this one and another.
    #[must_use]
    pub fn hull(&self, other: &Area) -> Area {
        Area {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// The vertices that are in both areas, if there are any.
    pub fn common(&self, other: &Area) -> Option<Area> {
        let area = Area {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        };
        (!area.is_empty()).then_some(area)
    }

    /// The vertices, row by row from the north-western one.
    pub fn vertices(self) -> impl DoubleEndedIterator<Item = (i64, i64)> + Clone {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }

    /// The area in two parts, cut across its longer side, of which one has at most a vertex's width more.
    #[must_use]
    pub fn halves(self) -> [Area; 2] {
        let Area { x0, y0, x1, y1 } = self;
        if x1 - x0 > y1 - y0 {
            let middle = x0 + (x1 - x0) / 2;
            return [Area { x1: middle, ..self }, Area { x0: middle, ..self }];
        }
        let middle = y0 + (y1 - y0) / 2;
        [Area { y1: middle, ..self }, Area { y0: middle, ..self }]
    }

    /// Whether what spans so much, west, north, east and south, may lie in the square cells that begin at the area's vertices: of
    /// an area of pixels, on these.
    pub fn meets(&self, [west, north, east, south]: [f64; 4]) -> bool {
        east > self.x0 as f64 && west < self.x1 as f64 && south > self.y0 as f64 && north < self.y1 as f64
    }

    /// Whether every vertex of `other` is in this area.
    pub const fn contains(&self, other: &Area) -> bool {
        self.x0 <= other.x0 && self.y0 <= other.y0 && other.x1 <= self.x1 && other.y1 <= self.y1
    }
}

/// Cells a side that a tile of a stride's nodes has at least; and about as many nodes around it are made for it.
const LEAST_STRIDED_CELLS: u32 = 16;
const STRIDED_PAD: u128 = 32;

/// How many vertices a node of a strided lattice lies from the next: a power of two.
///
/// The land of a stride is that of every so many vertices, as it looks from so far: what it cannot show is there in the mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Stride {
    power: u32,
}

impl Stride {
    /// Every vertex.
    pub const ONE: Stride = Stride { power: 0 };

    /// The greatest power of two.
    pub const MAX_POWER: u32 = 12;

    /// The stride of so many vertices; `None` if that is no power of two from 1 to 4096.
    pub const fn new(vertices: u64) -> Option<Stride> {
        match vertices.is_power_of_two() && vertices.trailing_zeros() <= Stride::MAX_POWER {
            true => Some(Stride { power: vertices.trailing_zeros() }),
            false => None,
        }
    }

    /// The widest stride whose nodes lie at most so many metres apart, or else every vertex, given the metres between vertices.
    pub fn within(most_m: f64, spacing_m: f64) -> Stride {
        let strides = (0..=Stride::MAX_POWER).map(|power| Stride { power });
        let fitting = strides.take_while(|stride| spacing_m * stride.vertices() as f64 <= most_m);
        fitting.last().unwrap_or(Stride::ONE)
    }

    /// The stride with nodes twice as far apart, or the widest that there is.
    #[must_use]
    pub const fn twice(self) -> Stride {
        Stride { power: if self.power < Stride::MAX_POWER { self.power + 1 } else { self.power } }
    }

    /// Vertices from a node to the next.
    pub const fn vertices(self) -> i64 {
        1 << self.power
    }
}

/// A tile's place in the world: tile (0, 0) has its north-western vertex at the origin of the lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct TileId {
    /// Tiles east of tile (0, 0); may be negative.
    pub x: i64,
    /// Tiles south of tile (0, 0); may be negative.
    pub y: i64,
}

impl TileId {
    /// The tile's vertices, `cells + 1` a side, those of its edge included.
    pub const fn area(self, cells: u32) -> Area {
        let n = cells as i64;
        Area::new(self.x * n, self.y * n, cells as usize + 1, cells as usize + 1)
    }
}

impl std::fmt::Display for TileId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", self.x, self.y)
    }
}

/// A tile's place in a region: column and row, counted from the region's north-western tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Rows south of the region's first.
    pub row: u64,
    /// Columns east of the region's first.
    pub col: u64,
}

/// The rectangle of tiles that one bake covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    at: TileId,
    cols: u64,
    rows: u64,
    cells: u32,
}

/// How far from the origin a vertex may lie: beyond 2^53 a coordinate in metres is no longer exact in `f64`, and the
/// files' readers have nothing wider.
pub const MAX_COORDINATE: i64 = 1 << 53;

impl Region {
    /// The region of `cols` x `rows` tiles of `cells` x `cells` cells whose north-western tile is `at`.
    ///
    /// # Errors
    /// When it has no tile or tiles of no cells, or when a vertex of it would lie more than [`MAX_COORDINATE`] from the origin.
    pub fn new(at: TileId, cols: u64, rows: u64, cells: u32) -> Result<Region, Error> {
        let refuse = |message: String, hint: &str| Err(Error::Region { message, hint: hint.into() });
        if cells == 0 {
            return refuse("a tile of no cells holds no land".into(), "give at least 1");
        }
        if cols == 0 || rows == 0 {
            return refuse(format!("a region of {cols} x {rows} tiles has no tile"), "give at least 1x1");
        }
        let fits = |first: i64, count: u64| {
            let end = first as i128 + count as i128;
            let limit = (MAX_COORDINATE / cells as i64) as i128;
            -limit <= first as i128 && end <= limit
        };
        if !fits(at.x, cols) || !fits(at.y, rows) {
            return refuse(
                format!("a region of {cols} x {rows} tiles of {cells} cells at {at} leaves the coordinates"),
                &format!("with this tile size, tile numbers run from -{0} to {0}", MAX_COORDINATE / cells as i64),
            );
        }
        let region = Region { at, cols, rows, cells };
        if region.width() as u128 * region.height() as u128 > i64::MAX as u128 {
            return refuse(
                format!("a region of {cols} x {rows} tiles of {cells} cells has more than 2^63 vertices"),
                "bake it in parts: regions of one world always fit together",
            );
        }
        Ok(region)
    }

    /// The region of tiles of a stride's nodes that covers this one, with tiles of the same side or of a part of it: of those
    /// with which the least is made, for what lies around a small tile is made for it too.
    ///
    /// # Errors
    /// When a vertex of it would lie more than [`MAX_COORDINATE`] nodes from the origin.
    pub fn strided(&self, stride: Stride) -> Result<Region, Error> {
        let (vertices, cells) = (stride.vertices() as u64, self.cells as u64);
        // So many tiles a side, in nodes.
        let sides = (0..=Stride::MAX_POWER).map(|power| 1 << power).take_while(|tiles| *tiles <= vertices);
        let nodes = |tiles: u64| (cells * tiles).is_multiple_of(vertices).then(|| cells * tiles / vertices);
        let least = u64::from(LEAST_STRIDED_CELLS).min(cells);
        let sides = sides.filter_map(|tiles| Some((tiles as i64, nodes(tiles).filter(|nodes| *nodes >= least)?)));
        let end = [self.at.x + self.cols as i64, self.at.y + self.rows as i64];
        let covering = sides.map(|(tiles, nodes)| {
            let first = [self.at.x, self.at.y].map(|at| at.div_euclid(tiles));
            let count = [0, 1].map(|axis| ((end[axis] + tiles - 1).div_euclid(tiles) - first[axis]) as u64);
            // What is made, with what lies around each tile; and then no more than is asked for.
            let beside = (count[0] * tiles as u64 - self.cols) + (count[1] * tiles as u64 - self.rows);
            let made = count[0] as u128 * count[1] as u128 * (u128::from(nodes) + STRIDED_PAD).pow(2);
            (made, beside, first, count, nodes as u32)
        });
        let best = covering.min_by_key(|(made, beside, ..)| (*made, *beside));
        // As many tiles as a node has vertices are always as many nodes wide as a tile has cells.
        let (.., first, count, nodes) = best.expect("there are whole nodes in a tile's vertices times a node's");
        Region::new(TileId { x: first[0], y: first[1] }, count[0], count[1], nodes)
    }

    /// The north-western tile.
    pub fn at(&self) -> TileId {
        self.at
    }

    /// Tiles from west to east.
    pub fn cols(&self) -> u64 {
        self.cols
    }

    /// Tiles from north to south.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Cells a tile side.
    pub fn tile_cells(&self) -> u32 {
        self.cells
    }

    /// Tiles in all.
    pub fn tiles(&self) -> u64 {
        self.cols * self.rows
    }

    /// Vertices from west to east, both edges included.
    pub fn width(&self) -> u64 {
        self.cols * self.cells as u64 + 1
    }

    /// Vertices from north to south, both edges included.
    pub fn height(&self) -> u64 {
        self.rows * self.cells as u64 + 1
    }

    /// Its western, southern, eastern and northern edge in kilometres east and north of the origin.
    pub fn bounds_km(&self, spacing_m: f64) -> [f64; 4] {
        let km = |tile: i64| (tile * self.cells as i64) as f64 * spacing_m / 1000.0;
        let (cols, rows) = (self.cols as i64, self.rows as i64);
        // Not the negative, which has a zero of its own.
        [km(self.at.x), 0.0 - km(self.at.y + rows), km(self.at.x + cols), 0.0 - km(self.at.y)]
    }

    /// Vertices in all, shared edges counted once.
    pub fn vertices(&self) -> u64 {
        self.width() * self.height()
    }

    /// The columns and rows of vertices that a raster of the whole region takes from the tile at a place: a shared
    /// edge is the next tile's, but for the region's own eastern and southern edge.
    pub fn owned(&self, place: Place) -> (usize, usize) {
        let cells = self.cells as usize;
        let side = |at: u64, count: u64| cells + usize::from(at + 1 == count);
        (side(place.col, self.cols), side(place.row, self.rows))
    }

    /// The tile at a place of this region.
    pub fn tile(&self, place: Place) -> TileId {
        TileId { x: self.at.x + place.col as i64, y: self.at.y + place.row as i64 }
    }

    /// Where a tile lies in the region, if it does.
    pub fn place(&self, tile: TileId) -> Option<Place> {
        let within =
            |tile: i64, at: i64, count: u64| u64::try_from(tile.checked_sub(at)?).ok().filter(|it| *it < count);
        Some(Place { row: within(tile.y, self.at.y, self.rows)?, col: within(tile.x, self.at.x, self.cols)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_share_their_edge() {
        let (a, b) = (TileId { x: -1, y: 7 }.area(16), TileId { x: 0, y: 7 }.area(16));
        assert_eq!(a.x1 - 1, b.x0);
        assert_eq!((a.y0, a.y1), (b.y0, b.y1));
        assert_eq!(a.width(), 17);
    }

    #[test]
    fn regions_of_a_stride_cover_what_is_asked_for() {
        let region = |x: i64, y: i64, cols: u64, rows: u64| Region::new(TileId { x, y }, cols, rows, 256).unwrap();
        let strided = |region: &Region, vertices: u64| region.strided(Stride::new(vertices).unwrap()).unwrap();
        // Where whole tiles fit there are no others; where they do not, smaller ones, if few are needed.
        assert_eq!(strided(&region(-8, 4, 8, 16), 4), Region::new(TileId { x: -2, y: 1 }, 2, 4, 256).unwrap());
        assert_eq!(strided(&region(5, 7, 8, 8), 4), Region::new(TileId { x: 5, y: 7 }, 8, 8, 64).unwrap());
        assert_eq!(
            strided(&region(-98, -98, 196, 196), 32),
            Region::new(TileId { x: -7, y: -7 }, 14, 14, 128).unwrap()
        );
        for vertices in (0..=Stride::MAX_POWER).map(|power| 1 << power) {
            for asked in [region(-3, 5, 1, 1), region(-100, -7, 157, 3)] {
                let covering = strided(&asked, vertices);
                let side = (covering.tile_cells() as u64 * vertices) as i64;
                let ends = |at: i64, count: u64, side: i64| [at * side, (at + count as i64) * side];
                for (asked, covering) in [
                    (ends(asked.at.x, asked.cols, 256), ends(covering.at.x, covering.cols, side)),
                    (ends(asked.at.y, asked.rows, 256), ends(covering.at.y, covering.rows, side)),
                ] {
                    assert!(covering[0] <= asked[0] && covering[1] >= asked[1], "{vertices}");
                    assert!(asked[0] - covering[0] < side && covering[1] - asked[1] < side, "{vertices}");
                }
            }
        }
        let odd = Region::new(TileId { x: 0, y: 0 }, 4, 4, 99).unwrap();
        assert_eq!(strided(&odd, 4), Region::new(TileId { x: 0, y: 0 }, 1, 1, 99).unwrap());
    }

    #[test]
    fn regions_that_leave_the_coordinates_are_refused() {
        let at = |x| TileId { x, y: 0 };
        assert!(Region::new(at(0), 0, 3, 256).is_err());
        assert!(Region::new(at(i64::MAX), 1, 1, 256).is_err());
        assert!(Region::new(at(i64::MIN), 1, 1, 256).is_err());
        assert!(Region::new(at(0), u64::MAX, u64::MAX, 4096).is_err());
        assert!(Region::new(at(0), 1_000_000_000, 1_000_000_000, 256).is_err());
        let last = MAX_COORDINATE / 256;
        assert!(Region::new(at(last - 1), 1, 1, 256).is_ok());
        assert!(Region::new(at(last), 1, 1, 256).is_err());
        assert!(Region::new(at(-last), 1, 1, 256).is_ok());
    }
}
