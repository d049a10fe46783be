//! The outline of a line: the points that suffice to draw it.

use crate::geometry::{length, simplified};
use crate::lines::{Line, LinePoint};

/// Largest distance in metres between the outline and a point that it leaves out: about the width of a line on a map at
/// 1:1000.
const MISS_M: f64 = 0.25;

/// Factor by which a piece of the outline may be steeper than the road, for rounding alone.
const STEEPER: f64 = 1.0 + 1e-9;

impl Line {
    /// Returns the points that suffice to draw the line, from its start on: the line's ends, the ends of its
    /// structures, and enough of the other points for the outline to be nowhere more than 25 cm off the line, to the
    /// side or in height, and nowhere steeper than the line.
    ///
    /// Based on: D. H. Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points", 1973.
    pub fn outline(&self) -> Vec<LinePoint> {
        let points = &self.points;
        let most_grade = self.max_grade() * STEEPER;
        // The ends of structures, and the points beside them.
        let is_kept = |index: &usize| {
            let is_at = |end: usize, index: usize| (end..end + 2).contains(&index);
            self.structures.iter().any(|structure| is_at(structure.first, index + 1) || is_at(structure.last, *index))
        };
        let split = |first: usize, last: usize| {
            if let Some(index) = (first + 1..last).find(is_kept) {
                return Some(index);
            }
            let chord = Chord::new(&points[first], &points[last], self.spacing_m);
            let misses = (first + 1..last).map(|index| (index, chord.miss_m(&points[index])));
            // The first of those that are furthest.
            let (furthest, most_m) = misses.reduce(|most, next| if next.1 > most.1 { next } else { most })?;
            (most_m > MISS_M || chord.rise_m.abs() > most_grade * chord.length_m).then_some(furthest)
        };
        simplified(points.len(), split).into_iter().map(|at| points[at]).collect()
    }
}

/// The straight segment from one point to another.
struct Chord {
    from: LinePoint,
    along: [f64; 2],
    rise_m: f64,
    length_m: f64,
    spacing_m: f64,
}

impl Chord {
    fn new(from: &LinePoint, to: &LinePoint, spacing_m: f64) -> Chord {
        let along = [0, 1].map(|axis| (to.place[axis] - from.place[axis]) * spacing_m);
        Chord { from: *from, along, rise_m: to.level_m - from.level_m, length_m: length(along), spacing_m }
    }

    /// Returns the distance in metres from the chord to a point, measured at the place of the chord that is nearest as
    /// seen from above.
    fn miss_m(&self, point: &LinePoint) -> f64 {
        let off = [0, 1].map(|axis| (point.place[axis] - self.from.place[axis]) * self.spacing_m);
        let square = self.length_m * self.length_m;
        let dot = off[0] * self.along[0] + off[1] * self.along[1];
        let share = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
        let away = [off[0] - self.along[0] * share, off[1] - self.along[1] * share];
        let up = point.level_m - self.from.level_m - self.rise_m * share;
        (away[0] * away[0] + away[1] * away[1] + up * up).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::StructureKind;
    use crate::lines::testing::road;

    /// Builds a line whose points follow each other 8 m further east, in a world of 1 m between vertices.
    fn line(points: impl Iterator<Item = (f64, f64, Option<StructureKind>)>) -> Line {
        road(
            points.enumerate().map(|(index, (south_m, level_m, kind))| ([8.0 * index as f64, south_m], level_m, kind)),
            1.0,
        )
    }

    fn columns(line: &Line) -> Vec<i64> {
        line.outline().iter().map(|point| point.place[0] as i64 / 8).collect()
    }

    #[test]
    fn what_is_straight_and_even_has_only_its_ends() {
        assert_eq!(columns(&line((0..100).map(|index| (0.0, f64::from(index), None)))), [0, 99]);
    }

    #[test]
    fn corners_summits_and_bridges_are_kept() {
        let corner = line((0..100).map(|index| (f64::from(index - 40).max(0.0), 0.0, None)));
        assert_eq!(columns(&corner), [0, 40, 99]);
        let summit = line((0..100).map(|index: i32| (0.0, 50.0 - f64::from((index - 30).abs()), None)));
        assert_eq!(columns(&summit), [0, 30, 99]);
        let kind = |index| (20..24).contains(&index).then_some(StructureKind::Bridge);
        assert_eq!(columns(&line((0..100).map(|index| (0.0, 0.0, kind(index))))), [0, 19, 20, 23, 24, 99]);
    }

    #[test]
    fn a_curve_is_drawn_as_closely_as_promised() {
        let curve = line((0..200).map(|index| {
            let index = f64::from(index);
            (40.0 * (index / 17.0).sin(), 4.0 * (index / 9.0).sin(), None)
        }));
        let outline = curve.outline();
        assert!(outline.len() > 20 && outline.len() < 120, "{} of 200", outline.len());
        for point in &curve.points {
            let misses = outline.windows(2).map(|pair| Chord::new(&pair[0], &pair[1], 1.0).miss_m(point));
            assert!(misses.fold(f64::INFINITY, f64::min) <= MISS_M, "{point:?}");
        }
        for pair in outline.windows(2) {
            let chord = Chord::new(&pair[0], &pair[1], 1.0);
            assert!(chord.rise_m.abs() <= curve.max_grade() * STEEPER * chord.length_m);
        }
    }
}
