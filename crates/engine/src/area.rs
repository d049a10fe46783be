//! Positions and extents: rectangles of the vertex lattice, tiles and regions.
//!
//! The vertex lattice is all integer points, x east and y south. A cell is the square between four vertices. Tile (tx,
//! ty) of N x N cells covers cells `[tx N, (tx+1) N) x [ty N, (ty+1) N)`; it has N+1 vertices a side and shares the
//! vertices of its edges with its neighbours.

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

    /// Number of vertices from west to east.
    pub const fn width(&self) -> usize {
        (self.x1 - self.x0) as usize
    }

    /// Number of vertices from north to south.
    pub const fn height(&self) -> usize {
        (self.y1 - self.y0) as usize
    }

    /// Number of vertices in the area.
    pub const fn len(&self) -> usize {
        self.width() * self.height()
    }

    /// True if the area holds no vertex.
    pub const fn is_empty(&self) -> bool {
        self.x1 <= self.x0 || self.y1 <= self.y0
    }

    /// Returns this area with `pad` more vertices on each side.
    #[must_use]
    pub const fn padded(&self, pad: usize) -> Area {
        let pad = pad as i64;
        Area { x0: self.x0 - pad, y0: self.y0 - pad, x1: self.x1 + pad, y1: self.y1 + pad }
    }

    /// Returns the smallest area that holds this one and consists of whole squares of `side` x `side` vertices, aligned
    /// to the origin.
    #[must_use]
    pub const fn on_grid(&self, side: i64) -> Area {
        let [x0, y0] = [self.x0.div_euclid(side) * side, self.y0.div_euclid(side) * side];
        let [x1, y1] = [(self.x1 - 1).div_euclid(side) * side + side, (self.y1 - 1).div_euclid(side) * side + side];
        Area { x0, y0, x1, y1 }
    }

    /// Returns the bounding box of this area and another.
    #[must_use]
    pub fn hull(&self, other: &Area) -> Area {
        Area {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// Returns the intersection of two areas, or `None` if it is empty.
    pub fn common(&self, other: &Area) -> Option<Area> {
        let area = Area {
            x0: self.x0.max(other.x0),
            y0: self.y0.max(other.y0),
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
        };
        (!area.is_empty()).then_some(area)
    }

    /// Iterates over the vertices, row by row from the north-western one.
    pub fn vertices(self) -> impl DoubleEndedIterator<Item = (i64, i64)> + Clone {
        (self.y0..self.y1).flat_map(move |y| (self.x0..self.x1).map(move |x| (x, y)))
    }

    /// Returns the columns and rows of the squares of `side` x `side` vertices, aligned to the origin, in which the
    /// area has a part, row by row.
    pub fn square_numbers(self, side: i64) -> impl Iterator<Item = [i64; 2]> {
        let span = move |from: i64, past: i64| from.div_euclid(side)..=(past - 1).div_euclid(side);
        span(self.y0, self.y1).flat_map(move |row| span(self.x0, self.x1).map(move |column| [column, row]))
    }

    /// Returns the parts of the area that lie in squares of `side` x `side` vertices, aligned to the origin.
    pub fn squares(self, side: usize) -> impl Iterator<Item = Area> {
        let whole = self.on_grid(side as i64);
        let firsts = move |from: i64, past: i64| (from..past).step_by(side);
        let corners = firsts(whole.y0, whole.y1).flat_map(move |y| firsts(whole.x0, whole.x1).map(move |x| (x, y)));
        corners.filter_map(move |(x, y)| Area::new(x, y, side, side).common(&self))
    }

    /// Cuts the area in two across its longer side; one half is at most one vertex wider than the other.
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

    /// Returns the western, northern, eastern and southern edge.
    pub fn edges(&self) -> [f64; 4] {
        [self.x0, self.y0, self.x1, self.y1].map(|edge| edge as f64)
    }

    /// Tells whether a bounding box, given by its western, northern, eastern and southern edge, overlaps the unit
    /// squares whose north-western corners are the area's vertices. In an area of pixels, these squares are the pixels.
    pub fn meets(&self, [west, north, east, south]: [f64; 4]) -> bool {
        let [x0, y0, x1, y1] = self.edges();
        east > x0 && west < x1 && south > y0 && north < y1
    }

    /// Returns the number of a vertex in the order of [`Area::vertices`].
    pub const fn index(&self, x: i64, y: i64) -> usize {
        (y - self.y0) as usize * self.width() + (x - self.x0) as usize
    }

    /// Tells whether a vertex is in this area.
    pub const fn has(&self, x: i64, y: i64) -> bool {
        self.x0 <= x && x < self.x1 && self.y0 <= y && y < self.y1
    }

    /// Tells whether every vertex of `other` is in this area.
    pub const fn contains(&self, other: &Area) -> bool {
        self.x0 <= other.x0 && self.y0 <= other.y0 && other.x1 <= self.x1 && other.y1 <= self.y1
    }
}

/// Least number of cells a side of a tile of a [strided](Region::strided) region, unless the region's own tiles have
/// fewer.
const LEAST_STRIDED_CELLS: u32 = 16;
/// Nodes by which a tile's side grows, about, with the border that is computed around it.
const STRIDED_PAD: u128 = 32;

/// Distance in vertices between neighbouring nodes of a strided lattice: a power of two.
///
/// Strided land keeps one vertex out of so many along each axis, and looks as it does from afar: detail too small for
/// the nodes enters as its mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Stride {
    power: u32,
}

impl Stride {
    /// The stride of 1, whose nodes are all vertices.
    pub const ONE: Stride = Stride { power: 0 };

    /// Exponent of the largest stride, 2^12 = 4096 vertices.
    pub const MAX_POWER: u32 = 12;

    /// Returns the stride of so many vertices, or `None` if the number is no power of two from 1 to 4096.
    pub const fn new(vertices: u64) -> Option<Stride> {
        match vertices.is_power_of_two() && vertices.trailing_zeros() <= Stride::MAX_POWER {
            true => Some(Stride { power: vertices.trailing_zeros() }),
            false => None,
        }
    }

    /// Returns the widest stride whose nodes lie at most `most_m` metres apart, or [`Stride::ONE`] if none does, given
    /// the metres between vertices.
    pub fn within(most_m: f64, spacing_m: f64) -> Stride {
        let strides = (0..=Stride::MAX_POWER).map(|power| Stride { power });
        let fitting = strides.take_while(|stride| spacing_m * stride.vertices() as f64 <= most_m);
        fitting.last().unwrap_or(Stride::ONE)
    }

    /// Returns the stride with nodes twice as far apart, or the widest stride if this is it.
    #[must_use]
    pub const fn twice(self) -> Stride {
        Stride { power: if self.power < Stride::MAX_POWER { self.power + 1 } else { self.power } }
    }

    /// Number of vertices from a node to the next.
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
    /// Number of rows south of the region's first row.
    pub row: u64,
    /// Number of columns east of the region's first column.
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

/// Largest distance from the origin of a vertex, along each axis: beyond 2^53 a coordinate in metres is no longer exact
/// in `f64`, and the programs that read the files have no wider number.
pub const MAX_COORDINATE: i64 = 1 << 53;

impl Region {
    /// Returns the region of `cols` x `rows` tiles of `cells` x `cells` cells whose north-western tile is `at`.
    ///
    /// # Errors
    /// When the region has no tile, or tiles without cells, or more than 2^63 vertices, or when a vertex of it would
    /// lie more than [`MAX_COORDINATE`] from the origin.
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

    /// Returns the region of strided tiles that covers this region. Its tiles have as many nodes a side as this
    /// region's tiles have cells, or fewer. Among the tile sizes that fit, the one is chosen for which the fewest nodes
    /// are computed: small tiles cover the region more closely, but each needs a border of its own.
    ///
    /// # Errors
    /// When a vertex of the strided region would lie more than [`MAX_COORDINATE`] nodes from the origin.
    pub fn strided(&self, stride: Stride) -> Result<Region, Error> {
        let (vertices, cells) = (stride.vertices() as u64, self.cells as u64);
        // Candidate sides of a strided tile, in tiles of this region.
        let sides = (0..=Stride::MAX_POWER).map(|power| 1 << power).take_while(|tiles| *tiles <= vertices);
        let nodes = |tiles: u64| (cells * tiles).is_multiple_of(vertices).then(|| cells * tiles / vertices);
        let least = u64::from(LEAST_STRIDED_CELLS).min(cells);
        let sides = sides.filter_map(|tiles| Some((tiles as i64, nodes(tiles).filter(|nodes| *nodes >= least)?)));
        let end = [self.at.x + self.cols as i64, self.at.y + self.rows as i64];
        let covering = sides.map(|(tiles, nodes)| {
            let first = [self.at.x, self.at.y].map(|at| at.div_euclid(tiles));
            let count = [0, 1].map(|axis| ((end[axis] + tiles - 1).div_euclid(tiles) - first[axis]) as u64);
            // Number of nodes computed, borders included; among equals the region with fewer tiles that nobody asked
            // for wins.
            let beside = (count[0] * tiles as u64 - self.cols) + (count[1] * tiles as u64 - self.rows);
            let made = count[0] as u128 * count[1] as u128 * (u128::from(nodes) + STRIDED_PAD).pow(2);
            (made, beside, first, count, nodes as u32)
        });
        let best = covering.min_by_key(|(made, beside, ..)| (*made, *beside));
        // The largest candidate always qualifies: a stride's vertices times a tile's cells are as many nodes as a tile
        // has cells.
        let (.., first, count, nodes) = best.expect("there are whole nodes in a tile's vertices times a node's");
        Region::new(TileId { x: first[0], y: first[1] }, count[0], count[1], nodes)
    }

    /// The north-western tile.
    pub fn at(&self) -> TileId {
        self.at
    }

    /// Number of tiles from west to east.
    pub fn cols(&self) -> u64 {
        self.cols
    }

    /// Number of tiles from north to south.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Number of cells a tile side.
    pub fn tile_cells(&self) -> u32 {
        self.cells
    }

    /// Number of tiles in the region.
    pub fn tiles(&self) -> u64 {
        self.cols * self.rows
    }

    /// Number of vertices from west to east, both edges included.
    pub fn width(&self) -> u64 {
        self.cols * self.cells as u64 + 1
    }

    /// Number of vertices from north to south, both edges included.
    pub fn height(&self) -> u64 {
        self.rows * self.cells as u64 + 1
    }

    /// Returns the region's western, southern, eastern and northern edge in kilometres east and north of the origin.
    pub fn bounds_km(&self, spacing_m: f64) -> [f64; 4] {
        let km = |tile: i64| (tile * self.cells as i64) as f64 * spacing_m / 1000.0;
        let (cols, rows) = (self.cols as i64, self.rows as i64);
        // Subtracted from 0 instead of negated, since negating 0 gives -0.
        [km(self.at.x), 0.0 - km(self.at.y + rows), km(self.at.x + cols), 0.0 - km(self.at.y)]
    }

    /// Number of vertices in the region, shared edges counted once.
    pub fn vertices(&self) -> u64 {
        self.width() * self.height()
    }

    /// Returns how many columns and rows of vertices a raster of the whole region takes from the tile at a place.
    /// Vertices of a shared edge belong to the next tile, east or south; on the region's own eastern and southern edge
    /// they belong to its last tile.
    pub fn owned(&self, place: Place) -> (usize, usize) {
        let cells = self.cells as usize;
        let side = |at: u64, count: u64| cells + usize::from(at + 1 == count);
        (side(place.col, self.cols), side(place.row, self.rows))
    }

    /// Returns the tile at a place of this region.
    pub fn tile(&self, place: Place) -> TileId {
        TileId { x: self.at.x + place.col as i64, y: self.at.y + place.row as i64 }
    }

    /// Returns a tile's place in the region, or `None` if the tile lies outside.
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
        // Where whole tiles fit exactly they are used; where they do not, smaller ones, if few of them are needed.
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
