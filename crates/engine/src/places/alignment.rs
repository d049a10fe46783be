//! The middle line of a road: a route with rounded corners, as points evenly spaced along the line.

use glam::DVec2;

use crate::clock::Clock;
use crate::fluvial::survey::{Sampling, Surveyed};
use crate::geometry::bilinear;
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::places::fixed::{FixedSegment, fixed};
use crate::places::plan_land::{PlanNode, PlanScale};
use crate::places::route::Route;
use crate::places::turn_cost::bend_m;

/// Largest distance in nodes between a rounded corner and the route's own corner: less than half, since the search
/// knows nothing of the land between nodes.
const MISS: f64 = 0.4;

/// Number of straight pieces that a bend is made of before points are laid along it. In a hairpin of 150 degrees each
/// piece turns by about 10 degrees, and the middle of a piece misses an arc of 60 m radius by about a quarter of a
/// metre.
const BEND_PIECES: i64 = 16;

/// Number of points for which the land is queried at a time.
// Few, since the query covers the points' bounding box, whose area grows with the square of their number on a slanting
// line.
const CHUNK: usize = 16;

/// The middle line of a road, about [`PlanScale::apart`] vertices from point to point.
#[derive(Debug)]
pub(super) struct Alignment {
    /// Points in 1/256 vertex from the window's first node.
    pub points: Vec<[i64; 2]>,
    /// For each point, true if it lies on a leg that bridges a lake or the sea.
    pub bridged: Vec<bool>,
    /// Length in metres of the piece from each point to the next.
    pub lengths_m: Vec<f64>,
    /// The scale of the plan on which the route was found.
    pub scale: PlanScale,
}

impl Alignment {
    /// Returns the line along a route. `softness` (0 to 1) tells how far corners are rounded, but each is rounded at
    /// least so far that no curve is sharper than `radius_m`.
    pub fn along(route: &Route, scale: &PlanScale, radius_m: f64, softness: f64) -> Alignment {
        let (corners, legs) = corners(route, scale);
        let mut path = vec![(corners[0], legs[0])];
        for index in 1..corners.len() - 1 {
            let (before, here, after) = (corners[index - 1], corners[index], corners[index + 1]);
            let ((to, to_length), (away, away_length)) = (direction(before, here), direction(here, after));
            let cos = to.dot(away);
            // Sine and cosine of half the angle by which the line turns.
            let [half_sin, half_cos] = [1.0 - cos, 1.0 + cos].map(|twice| (twice / 2.0).max(0.0).sqrt());
            let least = bend_m(cos, radius_m) / scale.spacing_m;
            // At a bridge's end the bend is as short as the radius allows.
            let soft = if legs[index - 1] || legs[index] { 0.0 } else { softness };
            // A bend takes at most half of a leg, since the other half is the next corner's: so bends do not overlap.
            // The middle of a bend misses the corner by the bend's reach times `missed`, the tangent of a quarter of
            // the angle.
            let missed = half_sin / (1.0 + half_cos);
            let wished = (to_length.min(away_length) / 2.0).min(MISS * scale.step as f64 / missed.max(1e-9)) * soft;
            // `least` fits in half a leg too: the search allows no turn that needs more.
            let reach = least.max(wished);
            let (start, end) = (here - to * reach, here + away * reach);
            for piece in 0..=BEND_PIECES {
                let along = piece as f64 / BEND_PIECES as f64;
                let rest = 1.0 - along;
                // A circular arc as a rational Bezier curve: the weight of its corner is the cosine of half the angle.
                let [a, b, c] = [rest * rest, 2.0 * half_cos * rest * along, along * along];
                let at = (start * a + here * b + end * c) / (a + b + c);
                let leg = if piece * 2 < BEND_PIECES { legs[index - 1] } else { legs[index] };
                path.push((at, leg));
            }
        }
        path.push((corners[corners.len() - 1], legs[legs.len() - 1]));
        Alignment::laid(&path, scale)
    }

    /// Lays points evenly along a path. Each vertex of the path has a flag: true if the piece after it is a bridge.
    fn laid(path: &[(DVec2, bool)], scale: &PlanScale) -> Alignment {
        let lengths: Vec<f64> = path.windows(2).map(|pair| direction(pair[0].0, pair[1].0).1).collect();
        let whole: f64 = lengths.iter().sum();
        // At least one point lies between the two ends, which are the sites' own points.
        let count = ((whole / scale.apart as f64) as usize).max(2);
        let mut line = Alignment { points: Vec::new(), bridged: Vec::new(), lengths_m: Vec::new(), scale: *scale };
        let (mut piece, mut before) = (0, 0.0);
        for index in 0..=count {
            // Computed from the whole length each time, since a sum of steps would drift away from the end.
            let at = whole * index as f64 / count as f64;
            while piece + 1 < lengths.len() && before + lengths[piece] < at {
                before += lengths[piece];
                piece += 1;
            }
            let share = if lengths[piece] > 0.0 { ((at - before) / lengths[piece]).clamp(0.0, 1.0) } else { 0.0 };
            let (from, to) = (path[piece].0, path[piece + 1].0);
            line.points.push(fixed(from + (to - from) * share));
            line.bridged.push(path[piece].1);
        }
        // The ends lie on the sites exactly, whatever rounding the sums above have.
        line.points[0] = fixed(path[0].0);
        line.points[count] = fixed(path[path.len() - 1].0);
        // Lengths of the pieces between the rounded points, since grades are measured between those.
        line.lengths_m = (0..count).map(|index| line.piece(index).length_m(scale.spacing_m)).collect();
        line
    }

    /// Returns the piece from a point to the next.
    pub fn piece(&self, index: usize) -> FixedSegment {
        FixedSegment { from: self.points[index], to: self.points[index + 1] }
    }

    /// Finds the first two pieces that cross each other, and returns the indices of their first points.
    pub fn crosses_itself(&self) -> Option<[usize; 2]> {
        let longest_m = self.lengths_m.iter().copied().fold(0.0, f64::max);
        (0..self.lengths_m.len()).find_map(|first| {
            let own = self.piece(first);
            // The next piece shares a point with this one, so it is left out.
            let mut second = first + 2;
            while second < self.lengths_m.len() {
                let other = self.piece(second);
                if own.crosses(&other) {
                    return Some([first, second]);
                }
                // Skip pieces: the way along the line is no shorter than the straight distance, so the next ones cannot
                // reach back to `own`.
                let apart_m = FixedSegment { from: own.from, to: other.from }.length_m(self.scale.spacing_m);
                second += ((apart_m / longest_m) as usize).saturating_sub(2).max(1);
            }
            None
        })
    }

    /// Returns the index of the route's leg that is nearest to a point.
    pub fn leg(&self, point: usize, route: &Route) -> usize {
        let far = |leg: usize| {
            let [from, to] = [route.nodes[leg], route.nodes[leg + 1]].map(|node| self.scale.fixed(node));
            FixedSegment { from, to }.distance2(self.points[point])
        };
        (0..route.bridges.len()).min_by(|a, b| far(*a).total_cmp(&far(*b))).expect("a way has legs")
    }

    /// Returns the water at each point, as the corners of its grid cell have it, [`PlanScale::fine`] vertices a side.
    /// If a corner lies in a lake or the sea, so does the point, since the line to the next point may cross that water.
    /// Otherwise the nearest corner decides. `origin` is the window's first vertex.
    ///
    /// Once the clock of the land stops the work, the points that are left get nothing, here and below.
    pub fn waters(&self, land: Surveyed<'_>, origin: [i64; 2]) -> Vec<WaterKind> {
        self.asked(land.clock, origin, |x0, y0, cols, rows| {
            let waters = land.survey.waters(x0, y0, Sampling::whole(self.scale.fine), cols, rows);
            move |corners: [usize; 4], share: [f64; 2]| {
                let [right, below] = share.map(|share| usize::from(share >= 0.5));
                let nearest = waters[corners[2 * below + right]];
                corners.map(|corner| waters[corner]).into_iter().find(|water| water.is_open()).unwrap_or(nearest)
            }
        })
    }

    /// Returns the height of the land at each point in metres. `origin` is the window's first vertex.
    pub fn heights_m(&self, land: Surveyed<'_>, origin: [i64; 2]) -> Vec<f64> {
        self.asked(land.clock, origin, |x0, y0, cols, rows| {
            let heights_m = land.survey.heights_m(x0, y0, Sampling::whole(self.scale.fine), cols, rows);
            move |corners: [usize; 4], share| bilinear(corners.map(|corner| heights_m[corner] as f64), share)
        })
    }

    /// Queries the land around some points at a time with `ask`, and reads it at each point with `read`, which gets the
    /// indices of the four corners of the point's grid cell and the point's place within the cell.
    fn asked<T, R: Fn([usize; 4], [f64; 2]) -> T>(
        &self,
        clock: &Clock,
        origin: [i64; 2],
        ask: impl Fn(i64, i64, usize, usize) -> R,
    ) -> Vec<T> {
        let fine = self.scale.fine;
        let side = fine * FIXED;
        let mut values = Vec::with_capacity(self.points.len());
        for chunk in self.points.chunks(CHUNK).take_while(|_| clock.check().is_ok()) {
            // The grid cells belong to the world, not to the window: any window and any chunk queries the land at the
            // same vertices.
            let cells = |at: &[i64; 2]| [0, 1].map(|axis| (at[axis] + origin[axis] * FIXED).div_euclid(side));
            let end = |axis: usize, sign: i64| {
                chunk.iter().map(|at| cells(at)[axis] * sign).max().expect("a chunk has points") * sign
            };
            let (x0, y0, x1, y1) = (end(0, -1), end(1, -1), end(0, 1), end(1, 1));
            // One more since both ends count, and one for the far corners of the last cells.
            let (cols, rows) = ((x1 - x0 + 2) as usize, (y1 - y0 + 2) as usize);
            let read = ask(x0 * fine, y0 * fine, cols, rows);
            for at in chunk {
                let [x, y] = cells(at);
                let corner = (y - y0) as usize * cols + (x - x0) as usize;
                let share = |axis: usize| (at[axis] + origin[axis] * FIXED).rem_euclid(side) as f64 / side as f64;
                values.push(read([corner, corner + 1, corner + cols, corner + cols + 1], [share(0), share(1)]));
            }
        }
        values
    }
}

/// Returns the ends and turning points of a route in vertices, and for each leg between them whether it is bridged.
fn corners(route: &Route, scale: &PlanScale) -> (Vec<DVec2>, Vec<bool>) {
    let place = |node: PlanNode| DVec2::from(scale.vertex(node).map(|at| at as f64));
    let (mut corners, mut legs) = (vec![place(route.nodes[0])], vec![route.bridges[0]]);
    for index in 1..route.nodes.len() - 1 {
        let [before, here, after] = [route.nodes[index - 1], route.nodes[index], route.nodes[index + 1]];
        let (a, b) = ([here[0] - before[0], here[1] - before[1]], [after[0] - here[0], after[1] - here[1]]);
        // Exact in whole numbers. The search lets no route turn straight back, so collinear moves go on in the same
        // direction.
        let goes_on = a[0] * b[1] == a[1] * b[0] && route.bridges[index - 1] == route.bridges[index];
        if !goes_on {
            corners.push(place(here));
            legs.push(route.bridges[index]);
        }
    }
    corners.push(place(route.nodes[route.nodes.len() - 1]));
    (corners, legs)
}

/// Returns the unit vector from one place to another, and their distance.
fn direction(from: DVec2, to: DVec2) -> (DVec2, f64) {
    let length = from.distance(to);
    ((to - from) * if length > 0.0 { 1.0 / length } else { 0.0 }, length)
}
