//! Skerries: low rounded islands on shoals off the coast.
//!
//! Skerries stand on a lattice of the world, each well inside its cell, so no two touch and there is sea between them.
//! None reaches the shore: a strip of water along it stays free for rivers that end there. Shoals only raise the sea's
//! floor.
//!
//! To judge the numbers chosen by eye, look at the coasts of `archipelago` and `fjords`.

use glam::DVec2;

use super::fields::Fields;
use super::plane::unit;
use crate::area::Area;
use crate::geometry::smooth;
use crate::grain_point::{GRAINS, Point, chance};
use crate::hash::{self, Draw, Stream};
use crate::noise::point_noise::{PointField, PointNoise};

/// Vertices a side of a cell of the lattice.
const CELL: i64 = 32;

/// Half length of skerries in vertices: the least value, and the range that chance adds.
const HALF: (f64, f64) = (2.0, 5.5);

/// Ratio of a skerry's length to its width. Chosen by eye.
const LENGTH: f64 = 1.5;

/// Amplitude of a skerry's outline, as a share of the square of its size: so small that the skerry still falls to all
/// sides. And the vertices from one bay to the next.
const ROUGHNESS: f64 = 0.35;
const BAYS: i64 = 10;

/// Square of the distance, relative to the skerry's size, at which its slope under the sea ends. Chosen by eye.
const SKIRT: f64 = 2.25;

/// Metres that a skerry rises above the sea for each vertex of its half length, up to [`HIGHEST_M`]. Chosen by eye.
const RISE_M: f64 = 1.1;

/// Greatest height of a skerry in metres above the sea.
pub const HIGHEST_M: f64 = 10.0;

/// Depth of the sea in metres up to which nothing rises from its floor, and how many metres deeper shoals and skerries
/// have their full height.
const SHORE_M: (f64, f64) = (6.0, 12.0);

/// Depth of the water over a shoal in metres, and distance in vertices from one shoal to the next, about.
const SHOAL_M: f64 = 5.0;
const SHOALS: i64 = 150;

/// Noise at which a shoal begins, where the setting asks for the fewest and for the most shoals; and rise of the noise
/// from there to a whole shoal.
const SHOAL_FROM: (f64, f64) = (0.35, -0.1);
const SHOAL_OVER: f64 = 0.3;

/// Least share of a whole shoal at which skerries stand, and share of the cells there that have one. Chosen by eye.
const SKERRIES: f64 = 0.3;
const ON_SHOAL: f64 = 0.8;

/// Distance from the lowstand's shore in vertices within which there are shoals, fading outwards.
const OFF_SHORE: f64 = 180.0;

/// Wavelength in vertices of the direction in which skerries are long.
const STRIKE: i64 = 1500;

/// The random draws of a skerry.
const IS_THERE: u64 = 0;
const SIZE: u64 = 1;
const MIDDLE: u64 = 2;

/// The skerries of a world.
#[derive(Debug)]
pub struct Skerries {
    seed: u64,
    /// Noise at and above which there is a shoal.
    from: f64,
    shoals: PointNoise,
    bays: PointNoise,
    strike: [PointNoise; 2],
}

/// A skerry: an ellipse.
#[derive(Clone, Copy, Debug)]
struct Skerry {
    /// The corner of the skerry's cell.
    corner: [i64; 2],
    /// The middle of the skerry, in vertices from the corner.
    middle: DVec2,
    /// The direction of the skerry's long axis.
    axis: DVec2,
    /// Half of the skerry's length in vertices.
    half: f64,
}

/// The skerries of an area.
#[derive(Debug)]
pub struct AreaSkerries<'a> {
    all: &'a Skerries,
    fields: &'a Fields,
    first: (i64, i64),
    columns: usize,
    cells: Vec<Option<Skerry>>,
}

impl Skerries {
    /// Returns the skerries of a world with these fields; `None` if it has none.
    pub fn new(fields: &Fields, seed: u64) -> Option<Skerries> {
        let share = fields.settings().coast.skerries;
        let seed = |part| hash::stream(seed, Stream::Skerries.of(part));
        let noise = |vertices: i64, octaves, part| PointNoise::new(vertices * GRAINS, octaves, seed(part));
        (fields.has_sea() && share > 0.0).then(|| Skerries {
            seed: seed(0),
            from: SHOAL_FROM.0 + (SHOAL_FROM.1 - SHOAL_FROM.0) * share,
            shoals: noise(SHOALS, 3, 1),
            bays: noise(BAYS, 2, 2),
            strike: [3, 4].map(|part| noise(STRIKE, 1, part)),
        })
    }

    /// Returns the skerries that may lie in an area of nodes `step` vertices apart.
    pub fn around<'a>(&'a self, fields: &'a Fields, area: Area, step: i64) -> AreaSkerries<'a> {
        let cells = |first: i64, end: i64| ((first * step).div_euclid(CELL), ((end - 1) * step).div_euclid(CELL) + 1);
        let (columns, rows) = (cells(area.x0, area.x1), cells(area.y0, area.y1));
        let all = (rows.0..rows.1).flat_map(|j| (columns.0..columns.1).map(move |i| (i, j)));
        AreaSkerries {
            all: self,
            fields,
            first: (columns.0, rows.0),
            columns: (columns.1 - columns.0) as usize,
            cells: all.map(|cell| self.skerry(fields, cell)).collect(),
        }
    }

    /// Returns the share of a whole shoal at a place, from 0 to 1, `off` vertices off the lowstand's shore.
    fn shoal(&self, at: Point, off: f64) -> f64 {
        let near = smooth(1.0 - off / OFF_SHORE);
        if near > 0.0 { near * smooth((self.shoals.at(at) - self.from) / SHOAL_OVER) } else { 0.0 }
    }

    /// Returns the skerry of a cell, well inside the cell.
    fn skerry(&self, fields: &Fields, cell: (i64, i64)) -> Option<Skerry> {
        let luck = |part| chance(self.seed, cell, Draw::Skerry, part);
        if luck(IS_THERE) >= ON_SHOAL {
            return None;
        }
        let half = HALF.0 + HALF.1 * luck(SIZE) * luck(SIZE);
        let most = CELL as f64 / 2.0;
        let room = most - half * (SKIRT / (1.0 - ROUGHNESS)).sqrt();
        let middle = DVec2::from([0, 1].map(|axis| most + room * (2.0 * luck(MIDDLE + axis) - 1.0)));
        let corner = [cell.0 * CELL, cell.1 * CELL];
        let at = Point::at_vertex(corner[0], corner[1]).moved(middle * GRAINS as f64);
        // The noise alone is cheaper than the distance from the shore, so test it first.
        if self.shoal(at, 0.0) < SKERRIES {
            return None;
        }
        let off = -fields.inland_m(at) / (GRAINS as f64 * fields.metres_a_grain());
        if off < 0.0 || self.shoal(at, off) < SKERRIES {
            return None;
        }
        let axis = unit(self.strike.each_ref().map(|strike| strike.at(at)).into());
        Some(Skerry { corner, middle, axis, half })
    }
}

impl Skerry {
    /// Returns the square of a vertex's distance from the skerry's middle, relative to the skerry's size in that
    /// direction.
    fn square(&self, at: [i64; 2]) -> f64 {
        let off = DVec2::from([0, 1].map(|axis| (at[axis] - self.corner[axis]) as f64)) - self.middle;
        let along = off.dot(self.axis);
        let across = self.axis.perp_dot(off) * LENGTH;
        (along * along + across * across) / (self.half * self.half)
    }
}

impl AreaSkerries<'_> {
    /// True if there are no skerries.
    pub fn is_empty(&self) -> bool {
        self.cells.iter().all(Option::is_none)
    }

    /// Returns the height in metres at a vertex whose sea floor without shoals and skerries is at `floor_m`.
    pub fn raised_m(&self, at: [i64; 2], floor_m: f32) -> f32 {
        let Skerries { bays, .. } = self.all;
        let sea_m = self.fields.sea_level_m();
        let depth_m = sea_m - floor_m as f64;
        if depth_m <= SHORE_M.0 {
            return floor_m;
        }
        let free = smooth((depth_m - SHORE_M.0) / SHORE_M.1);
        let point = Point::at_vertex(at[0], at[1]);
        let shoal_m = free * (depth_m - SHOAL_M) * self.all.shoal(point, self.fields.off_shore(floor_m)) - depth_m;
        let [i, j] = [(at[0], self.first.0), (at[1], self.first.1)].map(|(at, first)| at.div_euclid(CELL) - first);
        let risen_m = self.cells[j as usize * self.columns + i as usize].map_or(0.0, |skerry| {
            let square = skerry.square(at);
            if square * (1.0 - ROUGHNESS) >= SKIRT {
                return 0.0;
            }
            let square = square * (1.0 + ROUGHNESS * bays.at(point));
            let dome_m = (RISE_M * skerry.half).min(HIGHEST_M) * (1.0 - square);
            free * (dome_m - shoal_m).max(0.0) * smooth((SKIRT - square) / (SKIRT - 1.0))
        });
        if risen_m > 0.0 || shoal_m > -depth_m { (sea_m + shoal_m + risen_m) as f32 } else { floor_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> (Fields, Skerries) {
        let fields = Fields::of_preset("archipelago", 5, |settings| settings.coast.skerries = 1.0);
        let skerries = Skerries::new(&fields, 5).unwrap();
        (fields, skerries)
    }

    #[test]
    fn skerries_fall_to_all_sides_and_stay_in_their_cells() {
        let (fields, skerries) = world();
        let around = skerries.around(&fields, Area::new(-1920, 1920, 3840, 3840), 1);
        let mut dry = 0;
        for (skerry, floor_m) in around.cells.iter().flatten().zip([-41.0, -400.0].into_iter().cycle()) {
            let [x0, y0] = skerry.corner;
            for (x, y) in Area::new(x0, y0, CELL as usize, CELL as usize).vertices() {
                let here_m = around.raised_m([x, y], floor_m);
                assert!((floor_m..=HIGHEST_M as f32).contains(&here_m), "{here_m} m at {x},{y}");
                if here_m < 0.0 {
                    continue;
                }
                dry += 1;
                assert!([x - x0, y - y0].iter().all(|at| (1..CELL - 1).contains(at)), "{x},{y} is by another cell");
                let beside = (-1..=1).flat_map(|v| (-1..=1).map(move |u| [x + u, y + v]));
                let lowest_m = beside.map(|at| around.raised_m(at, floor_m)).fold(f32::INFINITY, f32::min);
                // A vertex may be the highest of those around, but never the lowest.
                assert!(lowest_m < here_m, "{x},{y} is a hollow");
            }
        }
        assert!(dry > 1000, "{dry} vertices of skerries");
    }

    #[test]
    fn windows_have_the_same_skerries_and_shores_none() {
        let (fields, skerries) = world();
        let wide = Area::new(-700, -500, 1400, 1000);
        let around = skerries.around(&fields, wide, 1);
        let mut raised = 0;
        for (x, y) in wide.vertices().step_by(37) {
            let here_m = around.raised_m([x, y], -41.0);
            raised += usize::from(here_m > -41.0);
            assert_eq!(skerries.around(&fields, Area::new(x, y, 1, 1), 1).raised_m([x, y], -41.0), here_m);
            assert_eq!(around.raised_m([x, y], -SHORE_M.0 as f32), -SHORE_M.0 as f32);
        }
        assert!(raised > 100, "{raised} places near skerries");
    }
}
