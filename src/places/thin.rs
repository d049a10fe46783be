//! The points of a road that suffice to draw it.

use crate::places::land::FIXED;
use crate::places::road::{Road, RoadPoint};

/// Metres by which the line of the points that are kept may miss one that is not.
const MISS_M: f64 = 0.25;

/// Share by which a piece may seem steeper than the road, for rounding alone.
const STEEPER: f64 = 1.0 + 1e-9;

impl Road {
    /// The points that suffice to draw it, from its start on: its ends, those where its kind changes, and of the others so
    /// many that the line is nowhere 25 cm off, to the side or in height, and nowhere steeper than the road.
    ///
    /// Based on: D. H. Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points", 1973.
    pub fn outline(&self, spacing_m: f64) -> Vec<RoadPoint> {
        let points = &self.points;
        let last = points.len() - 1;
        let mut kept = vec![false; points.len()];
        (kept[0], kept[last]) = (true, true);
        for index in 0..last {
            if points[index].kind != points[index + 1].kind {
                (kept[index], kept[index + 1]) = (true, true);
            }
        }
        let fixed: Vec<usize> = (0..=last).filter(|index| kept[*index]).collect();
        let mut open: Vec<(usize, usize)> = fixed.windows(2).map(|pair| (pair[0], pair[1])).collect();
        while let Some((first, last)) = open.pop() {
            if last - first < 2 {
                continue;
            }
            let piece = Piece::new(&points[first], &points[last], spacing_m);
            let (mut most, mut furthest) = (0.0, first + 1);
            for (index, point) in points.iter().enumerate().take(last).skip(first + 1) {
                let miss_m = piece.miss_m(point);
                if miss_m > most {
                    (most, furthest) = (miss_m, index);
                }
            }
            if most > MISS_M || piece.rise_m.abs() > self.max_grade * STEEPER * piece.length_m {
                kept[furthest] = true;
                open.extend([(first, furthest), (furthest, last)]);
            }
        }
        points.iter().zip(kept).filter_map(|(point, kept)| kept.then_some(*point)).collect()
    }
}

/// A straight piece from one point to another.
struct Piece {
    from: RoadPoint,
    along: [f64; 2],
    rise_m: f64,
    length_m: f64,
    part_m: f64,
}

impl Piece {
    fn new(from: &RoadPoint, to: &RoadPoint, spacing_m: f64) -> Piece {
        let part_m = spacing_m / FIXED as f64;
        let along = [0, 1].map(|axis| (to.at[axis] - from.at[axis]) as f64 * part_m);
        let length_m = (along[0] * along[0] + along[1] * along[1]).sqrt();
        Piece { from: *from, along, rise_m: to.level_m as f64 - from.level_m as f64, length_m, part_m }
    }

    /// Metres from the piece to a point, in the place that is nearest as seen from above.
    fn miss_m(&self, point: &RoadPoint) -> f64 {
        let off = [0, 1].map(|axis| (point.at[axis] - self.from.at[axis]) as f64 * self.part_m);
        let square = self.length_m * self.length_m;
        let dot = off[0] * self.along[0] + off[1] * self.along[1];
        let share = if square > 0.0 { (dot / square).clamp(0.0, 1.0) } else { 0.0 };
        let away = [off[0] - self.along[0] * share, off[1] - self.along[1] * share];
        let up = point.level_m as f64 - self.from.level_m as f64 - self.rise_m * share;
        (away[0] * away[0] + away[1] * away[1] + up * up).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::places::road::{RoadClass, RoadKind};
    use crate::places::site::SiteId;

    /// 8 m east from point to point, in a world of 1 m between vertices.
    fn road(points: impl Iterator<Item = (f64, f32, RoadKind)>) -> Road {
        let at = |index: usize, south_m: f64| [index as i64 * 8 * FIXED, (south_m * FIXED as f64) as i64];
        let point = |(index, (south_m, level_m, kind))| RoadPoint { at: at(index, south_m), level_m, kind };
        Road {
            id: (SiteId { i: 0, j: 0 }, SiteId { i: 1, j: 0 }),
            class: RoadClass::Road,
            points: points.enumerate().map(point).collect(),
            width_m: 5.0,
            length_m: 0.0,
            max_grade: 0.125,
            bank_m: 10.0,
            bounds: Area::new(0, 0, 1, 1),
        }
    }

    fn columns(road: &Road) -> Vec<i64> {
        road.outline(1.0).iter().map(|point| point.at[0] / (8 * FIXED)).collect()
    }

    #[test]
    fn what_is_straight_and_even_has_only_its_ends() {
        assert_eq!(columns(&road((0..100).map(|index| (0.0, index as f32, RoadKind::Ground)))), [0, 99]);
    }

    #[test]
    fn corners_summits_and_bridges_are_kept() {
        let corner = road((0..100).map(|index| (f64::from(index - 40).max(0.0), 0.0, RoadKind::Ground)));
        assert_eq!(columns(&corner), [0, 40, 99]);
        let summit = road((0..100).map(|index: i32| (0.0, 50.0 - (index - 30).abs() as f32, RoadKind::Ground)));
        assert_eq!(columns(&summit), [0, 30, 99]);
        let kind = |index| if (20..24).contains(&index) { RoadKind::Bridge } else { RoadKind::Ground };
        assert_eq!(columns(&road((0..100).map(|index| (0.0, 0.0, kind(index))))), [0, 19, 20, 23, 24, 99]);
    }

    #[test]
    fn a_curve_is_drawn_as_closely_as_promised() {
        let height_m = |index: f64| (4.0 * (index / 9.0).sin()) as f32;
        let curve = road((0..200).map(|index| {
            let index = f64::from(index);
            (40.0 * (index / 17.0).sin(), height_m(index), RoadKind::Ground)
        }));
        let outline = curve.outline(1.0);
        assert!(outline.len() > 20 && outline.len() < 120, "{} of 200", outline.len());
        for point in &curve.points {
            let misses = outline.windows(2).map(|pair| Piece::new(&pair[0], &pair[1], 1.0).miss_m(point));
            assert!(misses.fold(f64::INFINITY, f64::min) <= MISS_M, "{point:?}");
        }
        for pair in outline.windows(2) {
            let piece = Piece::new(&pair[0], &pair[1], 1.0);
            assert!(piece.rise_m.abs() <= curve.max_grade * STEEPER * piece.length_m);
        }
    }
}
