//! The vertex at which a triangle is furthest from the heights.

use super::delaunay::GridPoint;
use super::height_steps::HeightSteps;

/// The vertex that is furthest from a triangle, in steps above or below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FurthestVertex {
    /// Distance in steps times [`doubled_area`](super::delaunay::doubled_area): a whole number.
    pub scaled: f64,
    /// Twice the area of the triangle.
    pub doubled_area: f64,
    /// Index of the vertex in the steps' values; meaningless if the distance is zero.
    pub index: u32,
}

impl FurthestVertex {
    /// Finds a vertex of a triangle that is further away than `bound` steps, or else the furthest of all. In a triangle
    /// of many rows, the vertex found is the furthest in some of the rows only.
    ///
    /// Large triangles are looked at most often, and are too far away nearly everywhere: nearly any vertex improves
    /// them as much as the furthest. Looking at all rows of each takes up to twice as long and saves no triangles.
    pub fn beyond(steps: &HeightSteps, corners: [GridPoint; 3], bound: f64) -> FurthestVertex {
        // Look at sixteen rows at least: enough to notice a triangle that is too far away nearly everywhere.
        const ENOUGH_ROWS: i32 = 16;
        let [a, b, c] = corners.map(|corner| corner.y);
        let stride = (a.max(b).max(c) - a.min(b).min(c)) / ENOUGH_ROWS;
        if stride > 1 {
            let worst = FurthestVertex::of(steps, corners, stride);
            if worst.is_beyond(bound) {
                return worst;
            }
        }
        FurthestVertex::of(steps, corners, 1)
    }

    /// True if the distance is more than `bound` steps. Exact: a whole number and a fraction differ by at least 2^-24
    /// of a step, and both are below 2^29.
    pub fn is_beyond(&self, bound: f64) -> bool {
        self.scaled / self.doubled_area > bound
    }

    /// Finds the furthest of the vertices in a triangle; of equal ones, the first row by row. Northern and eastern
    /// edges do not belong to a triangle, so each vertex belongs to one triangle.
    ///
    /// Only every `stride`-th row is looked at. Vertices on the tile's border are within the bound anyway, by their
    /// chain.
    ///
    /// The numerator is a whole number below 2^53, which is exact in `f64`: 2^24 for the area times 2^29 for the
    /// difference of two heights.
    fn of(steps: &HeightSteps, corners: [GridPoint; 3], stride: i32) -> FurthestVertex {
        let [mut a, mut b, mut c] = corners;
        // Sort the corners from north to south.
        if b.y < a.y {
            (a, b) = (b, a);
        }
        if c.y < b.y {
            (b, c) = (c, b);
        }
        if b.y < a.y {
            (a, b) = (b, a);
        }
        let (ux, uy, uz) = ((b.x - a.x) as i64, (b.y - a.y) as i64, (b.z - a.z) as i64);
        let (vx, vy, vz) = ((c.x - a.x) as i64, (c.y - a.y) as i64, (c.z - a.z) as i64);
        // Positive if b is east of the edge from a to c. The plane is `area * z = at_a + east * x + south * y`.
        let mut area = ux * vy - uy * vx;
        let mut east = uz * vy - vz * uy;
        let mut south = ux * vz - vx * uz;
        let b_is_east = area > 0;
        if !b_is_east {
            (area, east, south) = (-area, -east, -south);
        }
        let origin = area * a.z as i64 - east * a.x as i64 - south * a.y as i64;
        let mut worst = FurthestVertex { scaled: 0.0, doubled_area: area as f64, index: 0 };
        // The long edge spans all rows; the two short edges follow each other on its other side.
        let mut long = ScanLine::new(a, c);
        for (from, to) in [(a, b), (b, c)] {
            let mut short = ScanLine::new(from, to);
            // Skip the northern row: it belongs to the triangle above.
            for y in from.y + 1..=to.y {
                let (x0, x1) = match b_is_east {
                    true => (long.next(), short.next()),
                    false => (short.next(), long.next()),
                };
                if stride > 1 && y % stride != 0 || x0 >= x1 {
                    continue;
                }
                let start = y as usize * steps.side() + x0 as usize;
                let row = &steps.values()[start..start + (x1 - x0) as usize];
                worst.look(row, start, (origin + south * y as i64 + east * x0 as i64) as f64, east as f64);
            }
        }
        worst
    }

    /// Compares a row of vertices with the triangle's plane, which starts at `first` and rises by `east` per vertex.
    #[inline(always)]
    fn look(&mut self, row: &[i32], start: usize, first: f64, east: f64) {
        // Floats that hold whole numbers are exact, and SIMD multiplies them; few CPUs have that for 64-bit integers.
        let distance = |offset: usize, z: i32| (self.doubled_area * z as f64 - (first + east * offset as f64)).abs();
        for (offset, z) in row.iter().enumerate() {
            let scaled = distance(offset, *z);
            if scaled > self.scaled {
                self.scaled = scaled;
                self.index = (start + offset) as u32;
            }
        }
    }
}

/// The columns at which a line from north to south crosses the rows, rounded up: Bresenham's line.
struct ScanLine {
    x: i32,
    whole: i32,
    part: i32,
    sum: i32,
    rows: i32,
}

impl ScanLine {
    /// Creates the line between two vertices, starting at the northern one. A level line crosses no rows.
    fn new(from: GridPoint, to: GridPoint) -> ScanLine {
        let rows = (to.y - from.y).max(1);
        let columns = to.x - from.x;
        ScanLine { x: from.x, whole: columns.div_euclid(rows), part: columns.rem_euclid(rows), sum: rows - 1, rows }
    }

    /// Moves one row south and returns the first column at or east of the line.
    #[inline(always)]
    fn next(&mut self) -> i32 {
        self.x += self.whole;
        // Like Bresenham, count the fraction in parts of a column, one per row of the line, so nothing is rounded.
        self.sum += self.part;
        if self.sum >= self.rows {
            self.sum -= self.rows;
            self.x += 1;
        }
        self.x
    }
}
