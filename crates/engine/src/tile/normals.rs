//! Normals and slopes of the land.

use crate::area::Area;
use crate::grid::Grid;
use crate::simd::{Kernel, Simd, dispatch, starts};

/// Returns the area of heights that the normals of an area depend on.
pub(super) const fn input(area: Area) -> Area {
    area.padded(1)
}

/// Unit normals and slopes of vertices, from central differences.
///
/// At a tile's edge the difference reaches across the edge, into the pad of the heights, so two neighbours agree on the
/// vertices that they share.
#[derive(Debug)]
pub struct Normals {
    east: Grid<f32>,
    up: Grid<f32>,
    south: Grid<f32>,
    slope: Grid<f32>,
}

impl Normals {
    /// Computes the normals of the vertices of `area`.
    ///
    /// # Panics
    /// When `heights` does not reach one vertex past `area` on each side.
    pub fn new(heights: &Grid<f32>, area: Area, spacing_m: f64) -> Normals {
        let grid = || Grid::filled(area, 0.0);
        let mut normals = Normals { east: grid(), up: grid(), south: grid(), slope: grid() };
        dispatch(CentralDifferences {
            heights,
            area,
            half_per_spacing: (0.5 / spacing_m) as f32,
            normals: &mut normals,
        });
        normals
    }

    /// Takes over normals that a kernel on another device has computed: east, up, south, and the slope.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_planes([east, up, south, slope]: [Grid<f32>; 4]) -> Normals {
        Normals { east, up, south, slope }
    }

    /// Returns the unit normal at a vertex: east, up, south.
    ///
    /// # Panics
    /// When the vertex is outside the area.
    pub fn at(&self, x: i64, y: i64) -> [f32; 3] {
        self.axes().map(|axis| axis.at(x, y))
    }

    /// Returns the components east, up and south of row `y` at `x0 <= x < x1`.
    ///
    /// # Panics
    /// When a part of the row is outside the area.
    pub fn row(&self, y: i64, x0: i64, x1: i64) -> [&[f32]; 3] {
        self.axes().map(|axis| axis.row(y, x0, x1))
    }

    /// Returns the components east, up and south of all vertices.
    pub fn axes(&self) -> [&Grid<f32>; 3] {
        [&self.east, &self.up, &self.south]
    }

    /// Returns the upward component of each normal: the cosine of the slope's angle, 0 to 1.
    pub fn up(&self) -> &Grid<f32> {
        &self.up
    }

    /// Returns the slope at each vertex: metres up per metre along the steepest way, 0 and more.
    pub fn slope(&self) -> &Grid<f32> {
        &self.slope
    }
}

struct CentralDifferences<'a> {
    heights: &'a Grid<f32>,
    area: Area,
    half_per_spacing: f32,
    normals: &'a mut Normals,
}

impl Kernel for CentralDifferences<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.area;
        let width = self.area.width();
        let scale = simd.splat(self.half_per_spacing);
        let one = simd.splat(1.0);
        for y in y0..y1 {
            let north = self.heights.row(y - 1, x0, x1);
            let middle = self.heights.row(y, x0 - 1, x1 + 1);
            let south = self.heights.row(y + 1, x0, x1);
            let to_east = self.normals.east.row_mut(y, x0, x1);
            let to_up = self.normals.up.row_mut(y, x0, x1);
            let to_south = self.normals.south.row_mut(y, x0, x1);
            let to_slope = self.normals.slope.row_mut(y, x0, x1);
            for from in starts(width, S::LANES) {
                let rise_east = (simd.load(&middle[from + 2..]) - simd.load(&middle[from..])) * scale;
                let rise_south = (simd.load(&south[from..]) - simd.load(&north[from..])) * scale;
                let square = rise_east * rise_east + rise_south * rise_south;
                let up = one / simd.sqrt(square + one);
                simd.store(-rise_east * up, &mut to_east[from..]);
                simd.store(up, &mut to_up[from..]);
                simd.store(-rise_south * up, &mut to_south[from..]);
                simd.store(simd.sqrt(square), &mut to_slope[from..]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_its_normal_everywhere() {
        let area = Area::new(-5, 3, 20, 17);
        let heights = Grid::of(area.padded(1), |x, y| (3 * x - 4 * y) as f32);
        // Two metres between vertices: the plane rises 1.5 m a metre to the east and 2 m a metre to the north.
        let normals = Normals::new(&heights, area, 2.0);
        let length = f32::sqrt(1.0 + 1.5 * 1.5 + 2.0 * 2.0);
        for (got, expected) in normals.at(14, 19).iter().zip([-1.5 / length, 1.0 / length, 2.0 / length]) {
            assert!((got - expected).abs() < 1e-6, "{:?}", normals.at(14, 19));
        }
        assert_eq!(normals.slope().at(-5, 3), 2.5);
    }

    #[test]
    fn nothing_outside_the_input_matters() {
        let area = Area::new(-3, 8, 17, 20);
        let mut heights = Grid::filled(area.padded(9), 0.0);
        for (index, height_m) in heights.values_mut().iter_mut().enumerate() {
            *height_m = (index * 7919 % 1013) as f32;
        }
        let made = |heights: &Grid<f32>| {
            let normals = Normals::new(heights, area, 3.0);
            [&normals.east, &normals.up, &normals.south, &normals.slope].map(Clone::clone)
        };
        let expected = made(&heights);
        heights.fill_outside(input(area), f32::NAN);
        assert_eq!(made(&heights), expected);
        assert_eq!(made(&heights.part(input(area))), expected);
    }
}
