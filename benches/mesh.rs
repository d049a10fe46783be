//! Meshes side by side with the method that is published for them: triangles and time, as the tables of docs/speed.md.
//!
//! `cargo bench --bench mesh`. One thread. The peer is plain greedy insertion as hmm and delatin do it, made anew below:
//! Garland & Heckbert's refinement of a Delaunay triangulation from two triangles on, with floats, borders free, and a
//! heap that knows where each triangle stands. Both get the same heights and the same bound, and take turns.

use std::hint::black_box;
use std::time::Instant;

use terrane::area::{Area, TileId};
use terrane::clock::Clock;
use terrane::grid::Grid;
use terrane::mesh::Surface;
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::world::World;

const ROUNDS: usize = 5;

fn main() {
    println!("| preset | tiles | bound | triangles | of the peer's | ms | of the peer's |");
    println!("|---|---|---|---|---|---|---|");
    for preset in ["alps", "thesis"] {
        for (tiles, cells) in [(8, 256), (1, 1024)] {
            contest(preset, tiles, cells);
        }
    }
}

/// Lets both make the meshes of a square of tiles within several bounds, and prints a row for each.
fn contest(name: &str, tiles: i64, cells: u32) {
    let (_, mut preset) = Preset::load(name).expect("it is built in");
    preset.tile_cells = cells;
    let world = World::new(preset, None).expect("built-in presets are sound");
    let ids = (0..tiles * tiles).map(|tile| TileId { x: tile % tiles, y: tile / tiles });
    let lands: Vec<Grid<f32>> = ids.map(|id| cropped(&Tile::new(&world, id))).collect();
    let values = || lands.iter().flat_map(Grid::values);
    let range_m = values().fold(f32::NEG_INFINITY, |most, height_m| most.max(*height_m))
        - values().fold(f32::INFINITY, |least, height_m| least.min(*height_m));
    for bound_m in [range_m as f64 * 0.001, 1.0, 2.0, 4.0, 8.0, 16.0] {
        let ours = || {
            lands
                .iter()
                .map(|land| {
                    Surface::simplified(land, land.area(), bound_m, None, &Clock::default()).unwrap().triangles.len()
                })
                .sum()
        };
        let peers =
            || lands.iter().map(|land| peer::triangles(land.values(), cells as usize + 1, bound_m as f32)).sum();
        let ([triangles, peer_triangles], [ms, peer_ms]) = take_turns(&ours, &peers);
        println!(
            "| {name} | {} of {} | {bound_m:.1} m | {triangles} | {:.3} | {ms:.1} | {:.2} |",
            tiles * tiles,
            cells + 1,
            triangles as f64 / peer_triangles as f64,
            ms / peer_ms,
        );
    }
}

/// The heights of a tile without the pad.
fn cropped(tile: &Tile) -> Grid<f32> {
    let area: Area = tile.area();
    let mut land = Grid::filled(area, 0.0);
    for y in area.y0..area.y1 {
        land.row_mut(y, area.x0, area.x1).copy_from_slice(tile.heights().row(y, area.x0, area.x1));
    }
    land
}

/// The results of two works and the median of their milliseconds.
fn take_turns(ours: &dyn Fn() -> usize, peers: &dyn Fn() -> usize) -> ([usize; 2], [f64; 2]) {
    let (mut results, mut spent_ms) = ([0; 2], [const { Vec::new() }; 2]);
    for _ in 0..ROUNDS {
        for (at, work) in [ours, peers].into_iter().enumerate() {
            let start = Instant::now();
            results[at] = black_box(work());
            spent_ms[at].push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let median = |mut spent: Vec<f64>| {
        spent.sort_by(f64::total_cmp);
        spent[ROUNDS / 2]
    };
    (results, spent_ms.map(median))
}

/// The published method, plainly.
mod peer {
    const NONE: usize = usize::MAX;

    /// How many triangles keep all of a square of heights within `bound`.
    pub fn triangles(heights: &[f32], side: usize, bound: f32) -> usize {
        let mut mesh = Mesh {
            heights,
            side,
            points: Vec::new(),
            corners: Vec::new(),
            twins: Vec::new(),
            candidates: Vec::new(),
            errors: Vec::new(),
            queue: Vec::new(),
            places: Vec::new(),
            pending: Vec::new(),
        };
        let last = side as i32 - 1;
        let [nw, ne, se, sw] = [[0, 0], [last, 0], [last, last], [0, last]].map(|point| mesh.add_point(point));
        let first = mesh.add_triangle([nw, se, sw], [NONE; 3], None);
        mesh.add_triangle([se, nw, ne], [first, NONE, NONE], None);
        mesh.flush();
        while mesh.errors[mesh.queue[0]] > bound {
            mesh.step();
        }
        mesh.corners.len() / 3
    }

    struct Mesh<'a> {
        heights: &'a [f32],
        side: usize,
        points: Vec<[i32; 2]>,
        /// Three a triangle: the point at which each edge starts, and the edge on its other side.
        corners: Vec<usize>,
        twins: Vec<usize>,
        /// Each triangle's furthest vertex, its distance, and its place in the queue.
        candidates: Vec<[i32; 2]>,
        errors: Vec<f32>,
        places: Vec<usize>,
        queue: Vec<usize>,
        /// Triangles whose candidate is not known.
        pending: Vec<usize>,
    }

    impl Mesh<'_> {
        fn height(&self, [x, y]: [i32; 2]) -> f32 {
            self.heights[y as usize * self.side + x as usize]
        }

        fn add_point(&mut self, point: [i32; 2]) -> usize {
            self.points.push(point);
            self.points.len() - 1
        }

        /// Adds a triangle, or puts it in the place of the one whose first edge is `at`; returns its first edge.
        fn add_triangle(&mut self, corners: [usize; 3], twins: [usize; 3], at: Option<usize>) -> usize {
            let at = at.unwrap_or(self.corners.len());
            if at == self.corners.len() {
                self.corners.extend(corners);
                self.twins.extend(twins);
                self.candidates.push([0; 2]);
                self.errors.push(0.0);
                self.places.push(NONE);
            } else {
                self.corners[at..at + 3].copy_from_slice(&corners);
                self.twins[at..at + 3].copy_from_slice(&twins);
            }
            for (edge, twin) in (at..).zip(twins) {
                if twin != NONE {
                    self.twins[twin] = edge;
                }
            }
            self.candidates[at / 3] = [0; 2];
            self.errors[at / 3] = 0.0;
            self.places[at / 3] = NONE;
            self.pending.push(at / 3);
            at
        }

        /// Looks for the candidates of all triangles that wait for it, and queues them.
        fn flush(&mut self) {
            for triangle in std::mem::take(&mut self.pending) {
                if self.places[triangle] == NONE {
                    self.find_candidate(triangle);
                    self.push(triangle);
                }
            }
        }

        fn find_candidate(&mut self, triangle: usize) {
            let [a, b, c] = [0, 1, 2].map(|at| self.points[self.corners[3 * triangle + at]]);
            let [low, high] = [
                [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis])),
                [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis])),
            ];
            // Barycentric weights, which change evenly along rows and columns.
            let mut row = [orient(b, c, low), orient(c, a, low), orient(a, b, low)];
            let east = [b[1] - c[1], c[1] - a[1], a[1] - b[1]];
            let south = [c[0] - b[0], a[0] - c[0], b[0] - a[0]];
            let area = orient(a, b, c) as f32;
            let [za, zb, zc] = [a, b, c].map(|point| self.height(point) / area);
            let (mut worst, mut candidate) = (0.0, [0; 2]);
            for y in low[1]..=high[1] {
                // The columns before the triangle, in one step.
                let mut skip = 0;
                for at in 0..3 {
                    if row[at] < 0 && east[at] != 0 {
                        skip = skip.max(-row[at] / east[at]);
                    }
                }
                let mut weights = [0, 1, 2].map(|at| row[at] + east[at] * skip);
                let mut was_inside = false;
                for x in low[0] + skip..=high[0] {
                    if weights.iter().all(|weight| *weight >= 0) {
                        was_inside = true;
                        let z = za * weights[0] as f32 + zb * weights[1] as f32 + zc * weights[2] as f32;
                        let error = (z - self.heights[y as usize * self.side + x as usize]).abs();
                        if error > worst {
                            (worst, candidate) = (error, [x, y]);
                        }
                    } else if was_inside {
                        break;
                    }
                    for at in 0..3 {
                        weights[at] += east[at];
                    }
                }
                for at in 0..3 {
                    row[at] += south[at];
                }
            }
            if [a, b, c].contains(&candidate) {
                worst = 0.0;
            }
            self.candidates[triangle] = candidate;
            self.errors[triangle] = worst;
        }

        /// Inserts the worst triangle's candidate.
        fn step(&mut self) {
            let triangle = self.pop();
            let [e0, e1, e2] = [0, 1, 2].map(|at| 3 * triangle + at);
            let [p0, p1, p2] = [e0, e1, e2].map(|edge| self.corners[edge]);
            let candidate = self.candidates[triangle];
            let new = self.add_point(candidate);
            let [a, b, c] = [p0, p1, p2].map(|at| self.points[at]);
            if orient(a, b, candidate) == 0 {
                self.split_edge(new, e0);
            } else if orient(b, c, candidate) == 0 {
                self.split_edge(new, e1);
            } else if orient(c, a, candidate) == 0 {
                self.split_edge(new, e2);
            } else {
                let [h0, h1, h2] = [e0, e1, e2].map(|edge| self.twins[edge]);
                let t0 = self.add_triangle([p0, p1, new], [h0, NONE, NONE], Some(e0));
                let t1 = self.add_triangle([p1, p2, new], [h1, NONE, t0 + 1], None);
                let t2 = self.add_triangle([p2, p0, new], [h2, t0 + 2, t1 + 1], None);
                for edge in [t0, t1, t2] {
                    self.legalise(edge);
                }
            }
            self.flush();
        }

        /// Splits the triangles at an edge by a point on it.
        fn split_edge(&mut self, new: usize, edge: usize) {
            let first = edge - edge % 3;
            let [left, right] = [first + (edge + 1) % 3, first + (edge + 2) % 3];
            let [start, end, apex] = [edge, left, right].map(|at| self.corners[at]);
            let [h_left, h_right, twin] = [left, right, edge].map(|at| self.twins[at]);
            if twin == NONE {
                let t0 = self.add_triangle([new, apex, start], [NONE, h_right, NONE], Some(first));
                let t1 = self.add_triangle([apex, new, end], [t0, NONE, h_left], None);
                self.legalise(t0 + 1);
                self.legalise(t1 + 2);
                return;
            }
            let other = twin - twin % 3;
            let [b_left, b_right] = [other + (twin + 2) % 3, other + (twin + 1) % 3];
            let far = self.corners[b_left];
            let [g_left, g_right] = [b_left, b_right].map(|at| self.twins[at]);
            self.forget(other / 3);
            let t0 = self.add_triangle([start, far, new], [g_right, NONE, NONE], Some(first));
            let t1 = self.add_triangle([far, end, new], [g_left, NONE, t0 + 1], Some(other));
            let t2 = self.add_triangle([end, apex, new], [h_left, NONE, t1 + 1], None);
            let t3 = self.add_triangle([apex, start, new], [h_right, t0 + 2, t2 + 1], None);
            for edge in [t0, t1, t2, t3] {
                self.legalise(edge);
            }
        }

        /// Flips an edge if the point behind it is inside its triangle's circumcircle, and then those that it bares.
        fn legalise(&mut self, edge: usize) {
            let twin = self.twins[edge];
            if twin == NONE {
                return;
            }
            let [first, other] = [edge - edge % 3, twin - twin % 3];
            let [al, ar] = [first + (edge + 1) % 3, first + (edge + 2) % 3];
            let [bl, br] = [other + (twin + 2) % 3, other + (twin + 1) % 3];
            let [p0, pr, pl, p1] = [ar, edge, al, bl].map(|at| self.corners[at]);
            if !in_circle([p0, pr, pl, p1].map(|at| self.points[at])) {
                return;
            }
            let [hal, har, hbl, hbr] = [al, ar, bl, br].map(|at| self.twins[at]);
            self.forget(first / 3);
            self.forget(other / 3);
            let t0 = self.add_triangle([p0, p1, pl], [NONE, hbl, hal], Some(first));
            let t1 = self.add_triangle([p1, p0, pr], [t0, har, hbr], Some(other));
            self.legalise(t0 + 1);
            self.legalise(t1 + 2);
        }

        // The queue: a heap of triangles, the worst first, each of which knows its place.

        fn push(&mut self, triangle: usize) {
            self.places[triangle] = self.queue.len();
            self.queue.push(triangle);
            self.up(self.queue.len() - 1);
        }

        fn pop(&mut self) -> usize {
            let worst = self.queue[0];
            self.forget(worst);
            worst
        }

        /// Takes a triangle out of the queue.
        fn forget(&mut self, triangle: usize) {
            let place = self.places[triangle];
            if place == NONE {
                return;
            }
            let last = self.queue.len() - 1;
            self.swap(place, last);
            self.queue.pop();
            self.places[triangle] = NONE;
            if place < last && !self.down(place) {
                self.up(place);
            }
        }

        fn up(&mut self, mut place: usize) {
            while place > 0 {
                let parent = (place - 1) / 2;
                if self.errors[self.queue[place]] <= self.errors[self.queue[parent]] {
                    break;
                }
                self.swap(place, parent);
                place = parent;
            }
        }

        fn down(&mut self, start: usize) -> bool {
            let mut place = start;
            loop {
                let mut child = 2 * place + 1;
                if child >= self.queue.len() {
                    break;
                }
                if child + 1 < self.queue.len() && self.errors[self.queue[child + 1]] > self.errors[self.queue[child]] {
                    child += 1;
                }
                if self.errors[self.queue[child]] <= self.errors[self.queue[place]] {
                    break;
                }
                self.swap(place, child);
                place = child;
            }
            place > start
        }

        fn swap(&mut self, one: usize, other: usize) {
            self.queue.swap(one, other);
            self.places[self.queue[one]] = one;
            self.places[self.queue[other]] = other;
        }
    }

    fn orient(a: [i32; 2], b: [i32; 2], c: [i32; 2]) -> i32 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Whether the last point is inside the circle through the others.
    fn in_circle([a, b, c, p]: [[i32; 2]; 4]) -> bool {
        let [[dx, dy], [ex, ey], [fx, fy]] =
            [a, b, c].map(|point| [(point[0] - p[0]) as i64, (point[1] - p[1]) as i64]);
        let [ap, bp, cp] = [dx * dx + dy * dy, ex * ex + ey * ey, fx * fx + fy * fy];
        dx * (ey * cp - bp * fy) - dy * (ex * cp - bp * fx) + ap * (ex * fy - ey * fx) > 0
    }
}
