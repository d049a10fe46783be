//! A ground with every vertex of the raster, into which waters have cut their shores and banks. Each cell that a shore
//! or bank runs through is triangulated by itself; all others keep the triangles that they have without water.

use std::collections::{BTreeMap, HashMap};

use spade::Triangulation;

use super::constrained::{CutVertex, constrained};
use super::waterline::{WaterPoint, Waterlines};
use super::{Ground, GroundVertex, PARTS, Surface};
use crate::area::Area;
use crate::grid::Grid;

/// Parts per cell.
const CELL: i64 = PARTS as i64;

/// Cuts waters into the ground of a surface that has every vertex.
pub(super) fn cut(surface: &Surface, heights: &Grid<f32>, area: Area, waters: &Waterlines) -> Ground {
    let mut ground = Ground::new(surface, heights, area);
    let side = surface.cells as usize + 1;
    let mut builder = Builder {
        cells: i64::from(surface.cells),
        grain: waters.grain(),
        between: Vec::new(),
        at: HashMap::new(),
        touched: BTreeMap::new(),
    };
    // The index of each vertex of the raster in the ground, row by row.
    let mut numbers = vec![0; side * side];
    for (number, [column, row]) in (0..).zip(&surface.vertices) {
        numbers[*row as usize * side + *column as usize] = number;
    }
    let number_at = |[column, row]: [i64; 2]| numbers[row as usize * side + column as usize];
    for at in waters.covered() {
        let vertex = &mut ground.vertices[number_at(at.map(i64::from)) as usize];
        vertex.height_m = waters.lowered(at, vertex.height_m);
    }
    for point in waters.points() {
        builder.add(point);
    }
    for line in waters.lines() {
        line.points.windows(2).for_each(|pair| builder.add_piece(&pair[0], &pair[1]));
    }
    // Points on the edges of a cell belong to its neighbours too.
    let Builder { cells, between, mut touched, .. } = builder;
    let first = ground.vertices.len() as u32;
    for (number, point) in (first..).zip(&between) {
        for cell in cells_at(point.place, cells) {
            touched.entry(cell).or_default().points.push(number);
        }
    }
    ground.vertices.extend(
        between.iter().map(|point| GroundVertex { place: point.place.map(|at| at as u32), height_m: point.ground_m }),
    );
    // A triangle of the surface belongs to the cell whose north-western corner is the least column and row of its
    // corners.
    let cell_of = |triangle: &[u32; 3]| {
        let corners = triangle.map(|corner| surface.vertices[corner as usize]);
        [0, 1].map(|axis| i64::from(corners[0][axis].min(corners[1][axis]).min(corners[2][axis])))
    };
    let mut is_touched = vec![false; side * side];
    for [column, row] in touched.keys() {
        is_touched[*row as usize * side + *column as usize] = true;
    }
    ground.triangles.retain(|triangle| {
        let [column, row] = cell_of(triangle);
        !is_touched[row as usize * side + column as usize]
    });
    for ([column, row], touched) in &touched {
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dy]| number_at([column + dx, row + dy]));
        touched.triangulate(corners, &mut ground);
    }
    ground
}

/// Returns the cells that contain a place or have it on an edge.
fn cells_at(place: [i64; 2], cells: i64) -> impl Iterator<Item = [i64; 2]> {
    let range = move |at: i64| {
        let last = at.div_euclid(CELL).min(cells - 1);
        let first = if at % CELL == 0 { (at / CELL - 1).max(0) } else { last };
        first..=last
    };
    range(place[1]).flat_map(move |row| range(place[0]).map(move |column| [column, row]))
}

struct Builder {
    cells: i64,
    grain: i64,
    /// Points between the vertices.
    between: Vec<WaterPoint>,
    /// Index in `between` of the point at a place.
    at: HashMap<[i64; 2], usize>,
    touched: BTreeMap<[i64; 2], Touched>,
}

/// The points and pieces of shores and banks in a cell.
#[derive(Default)]
struct Touched {
    /// Indices of vertices of the ground that are not vertices of the raster.
    points: Vec<u32>,
    /// Pieces of shores and banks, by their places.
    pieces: Vec<[[i64; 2]; 2]>,
}

impl Builder {
    /// Adds a point, unless there is a vertex of the raster or another point at its place.
    fn add(&mut self, point: WaterPoint) {
        if point.place.iter().all(|at| at % CELL == 0) {
            return;
        }
        let number = self.between.len();
        self.at.entry(point.place).or_insert_with(|| {
            self.between.push(point);
            number
        });
    }

    /// Adds a piece of a shore or a bank, cut where it crosses from cell to cell.
    fn add_piece(&mut self, from: &WaterPoint, to: &WaterPoint) {
        let mut shares: Vec<(f64, WaterPoint)> = vec![(0.0, *from), (1.0, *to)];
        for axis in 0..2 {
            let (low, high) = (from.place[axis].min(to.place[axis]), from.place[axis].max(to.place[axis]));
            for line in low.div_euclid(CELL) + 1..=(high - 1).div_euclid(CELL) {
                let along = to.place[axis] - from.place[axis];
                let share = (line * CELL - from.place[axis]) as f64 / along as f64;
                let mut point = from.towards(to, share, self.grain);
                point.place[axis] = line * CELL;
                shares.push((share, point));
            }
        }
        shares.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, point) in &shares {
            self.add(*point);
        }
        for pair in shares.windows(2) {
            let [a, b] = [pair[0].1.place, pair[1].1.place];
            // Add the piece to the only cell that has both ends. A piece along an edge has two such cells and needs
            // none.
            let mut both = cells_at(a, self.cells).filter(|cell| cells_at(b, self.cells).any(|other| other == *cell));
            if let (Some(cell), None) = (both.next(), both.next())
                && a != b
            {
                self.touched.entry(cell).or_default().pieces.push([a, b]);
            }
        }
    }
}

impl Touched {
    /// Adds the triangles of the cell to the ground.
    fn triangulate(&self, corners: [u32; 4], ground: &mut Ground) {
        // Vertices of the cell, with their indices in the ground.
        let corner = |&is: &u32| CutVertex { place: ground.vertices[is as usize].place.map(i64::from), is };
        let vertices: Vec<CutVertex<u32>> = corners.iter().chain(&self.points).map(corner).collect();
        let index = |place: [i64; 2]| vertices.iter().position(|vertex| vertex.place == place);
        let pieces = self.pieces.iter().filter_map(|[from, to]| Some([index(*from)?, index(*to)?]));
        let pieces: Vec<[usize; 2]> = pieces.collect();
        for face in constrained(vertices, pieces.into_iter()).inner_faces() {
            // Spade turns counter-clockwise with y up, which is clockwise with y south.
            let [a, b, c] = face.vertices().map(|vertex| vertex.data().is);
            ground.triangles.push([a, c, b]);
        }
    }
}
