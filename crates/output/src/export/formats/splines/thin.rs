//! The knots of a line: as few of its points as keep a curve through them within a set distance of the line.
//!
//! The curve is the uniform Catmull-Rom spline: its tangent at a knot is half of the way from the knot before to the
//! knot after. Based on: E. Catmull, R. Rom, "A class of local interpolating splines", 1974. Beyond an end, the mirror
//! image of the knot next to it stands for the missing knot, as if the line went on as it came.
//!
//! In a span much shorter than its neighbour the curve would overshoot, so no span is more than [`MOST_RATIO`] times as
//! long as a neighbour. A span whose curve is too far off is halved, so that curve and line come together, at corners
//! too.

use glam::DVec3;

use crate::geometry::come;

/// Largest distance in metres between the curve and the line.
pub(super) const MISS_M: f64 = 0.5;

/// The same limit while knots are chosen. It is stricter, because places between the compared ones may be further off
/// and numbers are rounded.
const CHOSEN_M: f64 = 0.9 * MISS_M;

/// Largest ratio of the length of a span to that of its neighbour.
const MOST_RATIO: f64 = 3.0;

/// Number of steps along a span at whose ends curve and line are compared.
const LOOKS: u32 = 16;

/// Returns the distance from a place to the straight line between two places.
fn distance_to_piece(place: DVec3, [from, to]: [DVec3; 2]) -> f64 {
    let along = to - from;
    let square = along.length_squared();
    let share = if square > 0.0 { ((place - from).dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    place.distance(from + along * share)
}

/// Returns the place of the curve at a share of the span from the second of four knots to the third.
pub(super) fn on_curve([before, from, to, after]: [DVec3; 4], share: f64) -> DVec3 {
    let (square, cube) = (share * share, share * share * share);
    (2.0 * cube - 3.0 * square + 1.0) * from
        + (cube - 2.0 * square + share) * ((to - before) / 2.0)
        + (3.0 * square - 2.0 * cube) * to
        + (cube - square) * ((after - from) / 2.0)
}

/// Returns the four knots that shape the curve of a span.
pub(super) fn around(knots: &[DVec3], span: usize) -> [DVec3; 4] {
    let mirrored = |of: DVec3, at: DVec3| 2.0 * at - of;
    let [from, to] = [knots[span], knots[span + 1]];
    let before = if span > 0 { knots[span - 1] } else { mirrored(to, from) };
    let after = knots.get(span + 2).copied().unwrap_or_else(|| mirrored(from, to));
    [before, from, to, after]
}

/// A line whose knots are sought. Positions on it are numbers: a whole number is a point, a fraction the share of the
/// way to the next one.
struct Thinned<'a> {
    points: &'a [DVec3],
    /// Metres from the start to each point.
    come_m: Vec<f64>,
}

impl Thinned<'_> {
    fn place(&self, at: f64) -> DVec3 {
        let index = (at as usize).min(self.points.len() - 2);
        self.points[index] + (self.points[index + 1] - self.points[index]) * (at - index as f64)
    }

    fn metres(&self, at: f64) -> f64 {
        let index = (at as usize).min(self.points.len() - 2);
        self.come_m[index] + (self.come_m[index + 1] - self.come_m[index]) * (at - index as f64)
    }

    /// Returns the points between two positions, together with the positions themselves.
    fn between(&self, from: f64, to: f64) -> Vec<DVec3> {
        let inner = (from.floor() as usize + 1)..(to.ceil() as usize);
        let inner = inner.map(|index| self.points[index]);
        std::iter::once(self.place(from)).chain(inner).chain([self.place(to)]).collect()
    }

    /// Returns the position at which a span is halved: a point of the line near the middle, or the middle itself.
    fn middle(&self, from: f64, to: f64) -> f64 {
        let half_m = f64::midpoint(self.metres(from), self.metres(to));
        let (first, last) = (from.floor() as usize + 1, to.ceil() as usize);
        // Points between the ends; there are none in a straight piece.
        let nearest = (first..last).min_by(|a, b| {
            let off = |index: usize| (self.come_m[index] - half_m).abs();
            off(*a).total_cmp(&off(*b))
        });
        let quarter_m = (self.metres(to) - self.metres(from)) / 4.0;
        // A point close to an end would leave nearly all of the span in one half.
        if let Some(index) = nearest.filter(|index| (self.come_m[*index] - half_m).abs() <= quarter_m) {
            return index as f64;
        }
        let index = (0..self.points.len() - 1).rev().find(|index| self.come_m[*index] <= half_m).unwrap_or(0);
        let piece_m = self.come_m[index + 1] - self.come_m[index];
        index as f64 + if piece_m > 0.0 { ((half_m - self.come_m[index]) / piece_m).min(1.0) } else { 0.5 }
    }

    /// Tells whether a span's curve and the line are close to each other everywhere.
    fn is_near(&self, knots: &[f64], span: usize) -> bool {
        // The four knots that shape the curve of the span.
        let first = span.saturating_sub(1);
        let places: Vec<DVec3> = knots[first..(span + 3).min(knots.len())].iter().map(|at| self.place(*at)).collect();
        let corners = around(&places, span - first);
        let curve: Vec<DVec3> = (0..=LOOKS).map(|look| on_curve(corners, f64::from(look) / f64::from(LOOKS))).collect();
        let line = self.between(knots[span], knots[span + 1]);
        let reaches = |places: &[DVec3], line: &[DVec3]| {
            places
                .iter()
                .all(|place| line.windows(2).any(|piece| distance_to_piece(*place, [piece[0], piece[1]]) <= CHOSEN_M))
        };
        reaches(&curve, &line) && reaches(&line, &curve)
    }
}

impl Thinned<'_> {
    /// Tells whether a span is more than [`MOST_RATIO`] times as long as one of its neighbours.
    fn is_too_long(&self, knots: &[f64], span: usize) -> bool {
        let length_m = |span: usize| Some(self.metres(*knots.get(span + 1)?) - self.metres(knots[span]));
        let beside = [span.checked_sub(1), Some(span + 1)].into_iter().flatten().filter_map(length_m);
        length_m(span).is_some_and(|length_m| length_m > MOST_RATIO * beside.fold(f64::INFINITY, f64::min))
    }

    /// Tells whether none of some spans is too long or too far from the line.
    fn is_good(&self, knots: &[f64], mut spans: impl Iterator<Item = usize>) -> bool {
        spans.all(|span| !self.is_too_long(knots, span) && self.is_near(knots, span))
    }

    /// Halves spans until all are good.
    fn part(&self, mut knots: Vec<f64>) -> Vec<f64> {
        loop {
            let mut parted = vec![knots[0]];
            for span in 0..knots.len() - 1 {
                if !self.is_good(&knots, span..=span) {
                    parted.push(self.middle(knots[span], knots[span + 1]));
                }
                parted.push(knots[span + 1]);
            }
            if parted.len() == knots.len() {
                return knots;
            }
            knots = parted;
        }
    }

    /// Removes knots that are not needed to keep all spans good. Halving makes spans shorter than necessary, and some
    /// of the knots that bends needed are in the way of others.
    fn thin(&self, knots: &mut Vec<f64>, is_fixed: impl Fn(f64) -> bool) {
        loop {
            let before = knots.len();
            let mut at = 1;
            while at + 1 < knots.len() {
                if is_fixed(knots[at]) {
                    at += 1;
                    continue;
                }
                let knot = knots.remove(at);
                // The joined span, and the two spans to each side, whose curve or whose neighbour has changed.
                let spans = at.saturating_sub(3)..(at + 2).min(knots.len() - 1);
                if !self.is_good(knots, spans) {
                    knots.insert(at, knot);
                    at += 1;
                }
            }
            if knots.len() == before {
                return;
            }
        }
    }
}

/// Returns the knots of a line as positions on it, from the first point to the last; all `fixed` points are among them.
///
/// The line has at least two points, and no two in a row are the same.
pub(super) fn thinned(points: &[DVec3], fixed: &[bool]) -> Vec<f64> {
    let come_m = come(points.windows(2).map(|pair| pair[0].distance(pair[1])));
    let line = Thinned { points, come_m };
    let last = points.len() - 1;
    let is_fixed = |index: usize| index == 0 || index == last || fixed[index];
    let mut knots = line.part((0..=last).filter(|index| is_fixed(*index)).map(|index| index as f64).collect());
    line.thin(&mut knots, |knot| knot.fract() == 0.0 && is_fixed(knot as usize));
    knots
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[DVec3], knots: &[f64]) -> Vec<DVec3> {
        let line = Thinned { points, come_m: come(points.windows(2).map(|pair| pair[0].distance(pair[1]))) };
        let places: Vec<DVec3> = knots.iter().map(|at| line.place(*at)).collect();
        let spans = 0..knots.len() - 1;
        spans
            .flat_map(|span| (0..=64).map(move |look| (span, f64::from(look) / 64.0)))
            .map(|(span, share)| on_curve(around(&places, span), share))
            .collect()
    }

    fn furthest(places: &[DVec3], line: &[DVec3]) -> f64 {
        let to_line = |place: &DVec3| {
            line.windows(2).map(|pair| distance_to_piece(*place, [pair[0], pair[1]])).fold(f64::INFINITY, f64::min)
        };
        places.iter().map(to_line).fold(0.0, f64::max)
    }

    #[test]
    fn a_straight_line_has_its_ends() {
        let points: Vec<DVec3> =
            (0..50).map(|index| DVec3::new(f64::from(index) * 20.0, 3.0, f64::from(index))).collect();
        assert_eq!(thinned(&points, &[false; 50]), [0.0, 49.0]);
    }

    #[test]
    fn the_curve_is_as_near_as_promised_also_at_corners() {
        let wave = |index: i32| [f64::from(index) * 15.0, 200.0 * (f64::from(index) / 9.0).sin(), f64::from(index % 7)];
        let corner = |index: i32| [f64::from(index.min(20)) * 30.0, f64::from((index - 20).max(0)) * 30.0, 0.0];
        // The line goes back the way that it came.
        let hairpin = |index: i32| [200.0 - f64::from((index - 20).abs()) * 10.0, f64::from(index / 20), 0.0];
        for line in [wave, corner, hairpin] {
            let points: Vec<DVec3> = (0..=40).map(line).map(DVec3::from).collect();
            let mut fixed = [false; 41];
            (fixed[7], fixed[8]) = (true, true);
            let knots = thinned(&points, &fixed);
            assert!(knots.contains(&7.0) && knots.contains(&8.0) && knots.is_sorted_by(|a, b| a < b));
            let curve = curve(&points, &knots);
            let off = [furthest(&curve, &points), furthest(&points, &curve)];
            assert!(off.iter().all(|off| *off <= MISS_M), "{off:?} m with {} knots", knots.len());
        }
    }
}
