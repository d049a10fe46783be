//! The ground that roads lie on: its height at any place of the tile.

use super::Ground;
use crate::area::Area;
use crate::grid::Grid;

/// The heights of a tile's ground at all vertices of the raster, which between them are as good as its triangles.
#[derive(Debug)]
pub struct Drape {
    cells: usize,
    heights_m: Vec<f32>,
}

impl Drape {
    /// The heights of a ground. One that has every vertex has those of `heights` there, but below waters.
    ///
    /// # Panics
    /// When `heights` does not hold the area.
    pub fn new(ground: &Ground, heights: &Grid<f32>, area: Area) -> Drape {
        let side = area.width();
        let mut heights_m = Vec::with_capacity(area.len());
        for y in area.y0..area.y1 {
            heights_m.extend_from_slice(heights.row(y, area.x0, area.x1));
        }
        // With every vertex a surface is the raster itself.
        if ground.vertices.len() == heights_m.len() {
            return Drape { cells: side - 1, heights_m };
        }
        for (facet, triangle) in ground.facets().zip(&ground.triangles) {
            let corners_m = triangle.map(|corner| f64::from(ground.vertices[corner as usize].height_m));
            let whole = facet.whole() as f64;
            for span in facet.spans() {
                let start = span.row * side + span.column;
                let (shares, growth) = (span.shares.map(|share| share as f64), span.growth.map(|growth| growth as f64));
                // Corners keep their height, since all shares are theirs; the others are mixed from those alone.
                for (offset, height_m) in (0_i32..).zip(&mut heights_m[start..start + span.count]) {
                    let share = |corner: usize| shares[corner] + growth[corner] * f64::from(offset);
                    let sum = share(0) * corners_m[0] + share(1) * corners_m[1] + share(2) * corners_m[2];
                    *height_m = (sum / whole) as f32;
                }
            }
        }
        Drape { cells: side - 1, heights_m }
    }

    /// The height in metres at a vertex of the tile.
    pub fn at(&self, column: u32, row: u32) -> f32 {
        self.heights_m[row as usize * (self.cells + 1) + column as usize]
    }

    /// The height in metres at a place in vertices from the tile's north-western corner, or at the place of the tile that is
    /// nearest to it: that of the land's triangles, or a little more.
    pub fn between(&self, place: [f64; 2]) -> f64 {
        // A bridge or a bank may stick out of the tile.
        let [x, y] = place.map(|at| at.clamp(0.0, self.cells as f64));
        let (column, row) = ((x as usize).min(self.cells - 1), (y as usize).min(self.cells - 1));
        let (u, v) = (x - column as f64, y - row as f64);
        let height =
            |east: usize, south: usize| f64::from(self.heights_m[(row + south) * (self.cells + 1) + column + east]);
        let [nw, ne, sw, se] = [height(0, 0), height(1, 0), height(0, 1), height(1, 1)];
        // Either diagonal may be an edge of the land's triangles: the higher one shows.
        let falling = if u > v { nw + (ne - nw) * u + (se - ne) * v } else { nw + (sw - nw) * v + (se - sw) * u };
        let rising = match u + v <= 1.0 {
            true => nw + (ne - nw) * u + (sw - nw) * v,
            false => se + (sw - se) * (1.0 - u) + (ne - se) * (1.0 - v),
        };
        falling.max(rising)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Surface;

    #[test]
    fn it_lies_on_the_triangles() {
        let area = Area::new(-3, 7, 9, 9);
        let mut heights = Grid::filled(area, 0.0);
        for y in area.y0..area.y1 {
            for x in area.x0..area.x1 {
                heights.row_mut(y, x, x + 1)[0] = ((x * 7 + y * 5) % 11) as f32;
            }
        }
        let full = Drape::new(&Ground::new(&Surface::full(8), &heights, area), &heights, area);
        assert_eq!((full.at(3, 2), full.between([3.0, 2.0])), (heights.at(0, 9), f64::from(heights.at(0, 9))));
        let two =
            Surface { cells: 8, vertices: vec![[0, 0], [0, 8], [8, 8], [8, 0]], triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let flat = Drape::new(&Ground::new(&two, &heights, area), &heights, area);
        let corner = |column: i64, row: i64| f64::from(heights.at(area.x0 + column, area.y0 + row));
        assert_eq!(f64::from(flat.at(4, 4)), f64::midpoint(corner(0, 0), corner(8, 8)));
        assert_eq!(flat.between([-5.0, 4.0]), f64::midpoint(corner(0, 0), corner(0, 8)));
    }
}
