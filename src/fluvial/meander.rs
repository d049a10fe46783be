//! Meanders: how a river swings to and fro along its course.
//!
//! A river that is free to choose takes the way whose direction swings as a sine along its own length: the
//! sine-generated curve, which spreads the turning evenly and so bends least. Here it is added to a smooth course, as
//! what each place of that is moved along it and to its side.
//!
//! Based on: W. B. Langbein, L. B. Leopold, River meanders: theory of minimum variance, 1966.

use std::f64::consts::TAU;

use crate::geometry::length;

/// Widths of a river from one meander to the next.
///
/// Based on: L. B. Leopold, M. G. Wolman, River meanders, 1960.
pub const WAVE_WIDTHS: f64 = 11.0;

/// How far a river turns from its course at most, in radians: with waves of 11 widths a bend has a radius of 2.2
/// widths, and natural ones seldom have less than 2.
pub const MOST_TURN: f64 = 1.1;

/// How far a line turns, in radians, from one of its knots to the next about: of a river whose width shows, where more
/// would be a corner, and of a narrow one.
pub const WIDE_TURN: f64 = 0.12;
pub const NARROW_TURN: f64 = 0.5;

/// Places a meander and a straight segment of a course that are looked at for how far the line turns.
const LOOKS_A_WAVE: f64 = 32.0;
const LOOKS: f64 = 8.0;
const MOST_LOOKS: f64 = 96.0;

/// The meanders at a place of a course.
#[derive(Clone, Copy, Debug)]
pub struct Meander {
    /// Meanders since some place upstream.
    pub phase: f64,
    /// How far the river turns from its course at most, in radians, up to [`MOST_TURN`].
    pub turn: f64,
    /// Length of a meander, measured along the course.
    pub wave: f64,
}

impl Meander {
    /// How far meanders of that length swing to the side that turn so far at most; less than in proportion.
    pub fn swing(wave: f64, turn: f64) -> f64 {
        let [along, side, _] = series(turn);
        wave / TAU * side / along
    }

    /// What is moved there: along the course, and to its side.
    fn moved(&self) -> [f64; 2] {
        let [along, side, sway] = series(self.turn);
        let scale = self.wave / (TAU * along);
        // The phase alone may be large: whole turns are taken off before it is an angle.
        let phase = TAU * (self.phase - self.phase.floor());
        [scale * sway * libm::sin(2.0 * phase), scale * side * libm::cos(phase)]
    }

    fn towards(&self, other: &Meander, share: f64) -> Meander {
        let mix = |from: f64, to: f64| from + (to - from) * share;
        Meander {
            phase: mix(self.phase, other.phase),
            turn: mix(self.turn, other.turn),
            wave: mix(self.wave, other.wave),
        }
    }
}

/// Bessel functions of a turn: the zeroth, twice the first, and the second, which are how far a sine-generated curve
/// comes along, to the side, and ahead and behind. Their power series, exact to a thousandth up to 1.3.
fn series(turn: f64) -> [f64; 3] {
    let square = turn * turn;
    let along = 1.0 - square / 4.0 * (1.0 - square / 16.0 * (1.0 - square / 36.0));
    let side = turn * (1.0 - square / 8.0 * (1.0 - square / 24.0));
    let sway = square / 8.0 * (1.0 - square / 12.0 * (1.0 - square / 32.0));
    [along, side, sway]
}

/// A place of a line: in which straight segment of the course, at which share of it, and where it is moved.
#[derive(Clone, Copy, Debug)]
pub struct LinePlace {
    /// The number of the segment.
    pub segment: usize,
    /// The share of the segment, 0 to 1, 1 excluded but for the end of the course.
    pub share: f64,
    /// Where it is.
    pub at: [f64; 2],
}

/// The line of a river that meanders along a course: through its places, if it does not meander there, smoothly, and
/// with more places in between where it has turned by `knot_turn`, in radians. At both ends it stays where the course is.
pub fn line(course: &[[f64; 2]], meanders: &[Meander], knot_turn: f64) -> Vec<LinePlace> {
    let last = course.len() - 1;
    let mut places = Vec::new();
    for segment in 0..last {
        let (from, to) = (meanders[segment], meanders[segment + 1]);
        let whole = length(way(course[segment], course[segment + 1]));
        let waves = if from.turn + to.turn > 0.0 { whole / from.wave.min(to.wave) } else { 0.0 };
        let looks = (LOOKS_A_WAVE * waves).clamp(LOOKS, MOST_LOOKS).ceil();
        for look in 0..looks as usize {
            let share = look as f64 / looks;
            let (at, ahead) = smooth(course, segment, share);
            let [along, side] = from.towards(&to, share).moved();
            let scale = 1.0 / length(ahead).max(1e-9);
            let at = [
                at[0] + (ahead[0] * along - ahead[1] * side) * scale,
                at[1] + (ahead[1] * along + ahead[0] * side) * scale,
            ];
            places.push(LinePlace { segment, share, at });
        }
    }
    places[0].at = course[0];
    places.push(LinePlace { segment: last - 1, share: 1.0, at: course[last] });
    thinned(&places, knot_turn)
}

fn way(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

/// A place of a smooth curve through those of a course, and the direction there.
///
/// Based on: E. Catmull, R. Rom, A class of local interpolating splines, 1974; at both ends the curve goes on as if the
/// course turned there as much as at the place before.
fn smooth(course: &[[f64; 2]], segment: usize, share: f64) -> ([f64; 2], [f64; 2]) {
    let last = course.len() - 1;
    let (from, to) = (course[segment], course[segment + 1]);
    let tangent = |at: usize| -> [f64; 2] {
        if last < 2 {
            return way(from, to);
        }
        [0, 1].map(|axis| {
            let place = |at: usize| course[at][axis];
            match at {
                0 => 0.5 * (4.0 * place(1) - 3.0 * place(0) - place(2)),
                _ if at == last => 0.5 * (3.0 * place(last) - 4.0 * place(last - 1) + place(last - 2)),
                _ => 0.5 * (place(at + 1) - place(at - 1)),
            }
        })
    };
    let (leave, arrive) = (tangent(segment), tangent(segment + 1));
    let (t, t2) = (share, share * share);
    let t3 = t2 * t;
    let place = [0, 1].map(|axis| {
        from[axis]
            + (to[axis] - from[axis]) * (3.0 * t2 - 2.0 * t3)
            + leave[axis] * (t3 - 2.0 * t2 + t)
            + arrive[axis] * (t3 - t2)
    });
    let direction = [0, 1].map(|axis| {
        (to[axis] - from[axis]) * 6.0 * (t - t2)
            + leave[axis] * (3.0 * t2 - 4.0 * t + 1.0)
            + arrive[axis] * (3.0 * t2 - 2.0 * t)
    });
    (place, direction)
}

/// What is left of a line's places: where segments of the course begin, and where the line has turned enough.
fn thinned(places: &[LinePlace], knot_turn: f64) -> Vec<LinePlace> {
    let mut kept = vec![places[0]];
    let mut turned = 0.0;
    for three in places.windows(3) {
        let (before, after) = (way(three[0].at, three[1].at), way(three[1].at, three[2].at));
        let (cross, dot) = (before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1]);
        turned += libm::atan2(cross, dot).abs();
        if three[1].share == 0.0 || turned > knot_turn {
            kept.push(three[1]);
            turned = 0.0;
        }
    }
    kept.push(places[places.len() - 1]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight course with meanders that grow from its ends.
    fn meandering(turn: f64) -> Vec<LinePlace> {
        let course: Vec<[f64; 2]> = (0..=16).map(|step| [1000.0 * step as f64, 0.0]).collect();
        let meander = |step: i32| {
            let grown = (step.min(16 - step) as f64 / 4.0).min(1.0);
            Meander { phase: step as f64 * 0.5, turn: turn * grown, wave: 2000.0 }
        };
        line(&course, &(0..=16).map(meander).collect::<Vec<_>>(), WIDE_TURN)
    }

    #[test]
    fn bends_are_round_and_no_tighter_than_two_widths() {
        let width = 2000.0 / WAVE_WIDTHS;
        let places = meandering(MOST_TURN);
        let mut sharpest: f64 = 0.0;
        for three in places.windows(3) {
            let (before, after) = (way(three[0].at, three[1].at), way(three[1].at, three[2].at));
            let turn =
                libm::atan2(before[0] * after[1] - before[1] * after[0], before[0] * after[0] + before[1] * after[1]);
            sharpest = sharpest.max(turn.abs());
        }
        assert!(sharpest < 0.35, "a corner of {sharpest} rad");
        // As wide as the series says, and longer than the course.
        let widest = places.iter().map(|place| place.at[1].abs()).fold(0.0, f64::max);
        let swing = Meander::swing(2000.0, MOST_TURN);
        assert!((widest / swing - 1.0).abs() < 0.02, "{widest} for {swing}");
        assert!(2.0 * width < swing && swing < 3.0 * width);
    }

    #[test]
    fn a_straight_course_without_meanders_has_its_own_places() {
        let places = meandering(0.0);
        assert_eq!(places.len(), 17);
        assert!(places.iter().enumerate().all(|(step, place)| (place.at[0] - 1000.0 * step as f64).abs() < 1e-6));
        assert!(places.iter().all(|place| place.at[1] == 0.0));
    }
}
