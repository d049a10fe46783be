//! Meanders: how a river swings to and fro along its course.
//!
//! The direction of a freely meandering river swings as a sine of the distance along the river: the sine-generated
//! curve, which spreads the turning evenly and so bends least. Here the curve is added to a smooth course: each place
//! of the course is moved along the course and to its side.
//!
//! Based on: W. B. Langbein, L. B. Leopold, River meanders: theory of minimum variance, 1966.
//!
//! To judge the numbers chosen by eye, look at the rivers of `plains`.

use std::f64::consts::TAU;

use glam::DVec2;

use super::fields::Fields;
use crate::geometry::LineSegment;
use crate::grain_point::GRAINS;

/// Least length of a meander, in widths of its river.
///
/// This is half as long again as in L. B. Leopold, M. G. Wolman, River meanders, 1960, so that bends stay rounder than
/// two widths where the warp tightens them, and where a long river is narrower than its mean width.
pub const WAVE_WIDTHS: f64 = 18.0;

/// Width in vertices of the narrowest river for which meanders are made: smaller meanders would be ripples beside the
/// bends of the valley, and take many knots. Chosen by eye.
const NARROWEST: f64 = 7.0;

/// Greatest angle in radians between a river and its course: on a wide floor, where the river is 1.3 times as long as
/// its course, and in a valley without a floor.
pub const MOST_TURN: f64 = 1.0;
pub const CONFINED_TURN: f64 = 0.8;

/// Angle in radians by which a line turns from one knot to the next: for a river one vertex wide, and less with the
/// root of the width, so that the chord of a bend of two widths is off the bend by a thirtieth of a vertex. And the
/// least and greatest angle.
const KNOT_TURN: f64 = 0.35;
const KNOT_TURNS: [f64; 2] = [0.12, 0.2];

/// Sharpest turn of a line from half its width before a place to half its width after it: the tangent of 0.22 radians,
/// by which a bend of 2.3 widths turns. Sharper turns are smoothed in up to so many rounds, of so many passes each.
const SHARPEST: f64 = 0.223_619_421_518_684_08;
const FAIR_ROUNDS: u32 = 48;
const FAIR_PASSES: u32 = 4;

/// Places examined for how far the line turns: in each meander, in each straight segment of a course at least, and at
/// most.
const LOOKS_A_WAVE: f64 = 64.0;
const LOOKS: f64 = 8.0;
const MOST_LOOKS: f64 = 384.0;

/// Most places in a loop in which a line crosses itself: with so many places, a line turns round more than once.
const MOST_LOOP: usize = 24;

/// Returns the width in grains that counts for the meanders of a river with a discharge in cubic metres a second.
pub fn meander_width(fields: &Fields, discharge_m3s: f64) -> f64 {
    (fields.river_width_m(discharge_m3s) / fields.metres_a_grain()).max(NARROWEST * GRAINS as f64)
}

/// The meanders at a place of a course.
#[derive(Clone, Copy, Debug)]
pub struct Meander {
    /// Number of meanders from some place upstream to here.
    pub phase: f64,
    /// Greatest angle in radians between the river and its course, up to [`MOST_TURN`].
    pub turn: f64,
    /// Length of a meander, measured along the course.
    pub wave: f64,
}

impl Meander {
    /// Returns the sideways swing of meanders of that length and turn. It grows less than in proportion to the turn.
    pub fn swing(wave: f64, turn: f64) -> f64 {
        let [along, side, _] = series(turn);
        wave / TAU * side / along
    }

    /// Returns the displacement of the place: along the course, and to its side.
    fn moved(&self) -> DVec2 {
        if self.turn == 0.0 {
            return DVec2::ZERO;
        }
        let [along, side, sway] = series(self.turn);
        let scale = self.wave / (TAU * along);
        // The phase may be large, so whole turns are taken off before it becomes an angle.
        let phase = TAU * (self.phase - self.phase.floor());
        DVec2::new(scale * sway * libm::sin(2.0 * phase), scale * side * libm::cos(phase))
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

/// Returns the Bessel functions of a turn: the zeroth, twice the first, and the second. They are the amplitudes of a
/// sine-generated curve along the course, to the side, and ahead and behind. Computed by their power series, exact to a
/// thousandth up to [`MOST_TURN`].
fn series(turn: f64) -> [f64; 3] {
    let square = turn * turn;
    let along = 1.0 - square / 4.0 * (1.0 - square / 16.0 * (1.0 - square / 36.0));
    let side = turn * (1.0 - square / 8.0 * (1.0 - square / 24.0 * (1.0 - square / 48.0)));
    let sway = square / 8.0 * (1.0 - square / 12.0 * (1.0 - square / 32.0));
    [along, side, sway]
}

/// A place of a line: its segment of the course, its share of that segment, and where it is moved to.
#[derive(Clone, Copy, Debug)]
pub struct LinePlace {
    /// The number of the segment.
    pub segment: usize,
    /// The share of the segment, 0 to 1, 1 excluded except at the end of the course.
    pub share: f64,
    /// The displaced place.
    pub at: DVec2,
}

/// Returns the line of a river of that width that meanders along a course. Without meanders the line passes smoothly
/// through the places of the course. It has more places where it turns so much that a corner would show. At both ends
/// it stays on the course, and has the direction in `ends`, if one is given.
pub fn line(course: &[DVec2], ends: [Option<DVec2>; 2], meanders: &[Meander], width: f64) -> Vec<LinePlace> {
    let last = course.len() - 1;
    let tangents = tangents(course, ends);
    let mut places = Vec::new();
    for segment in 0..last {
        let (from, to) = (meanders[segment], meanders[segment + 1]);
        let whole = course[segment + 1].distance(course[segment]);
        let waves = if from.turn + to.turn > 0.0 { whole / from.wave.min(to.wave) } else { 0.0 };
        let looks = (LOOKS_A_WAVE * waves).clamp(LOOKS, MOST_LOOKS).ceil();
        for look in 0..looks as usize {
            let share = look as f64 / looks;
            let (at, ahead) = smooth(course, &tangents, segment, share);
            let by = from.towards(&to, share).moved();
            let at = at + (ahead * by.x + ahead.perp() * by.y) * (1.0 / ahead.length().max(1e-9));
            places.push(LinePlace { segment, share, at });
        }
    }
    places[0].at = course[0];
    places.push(LinePlace { segment: last - 1, share: 1.0, at: course[last] });
    fair(&mut places, width);
    unlooped(&thinned(&places, knot_turn(width)))
}

/// Cuts off small loops in which a line crosses itself, where its course bends more tightly than it swings.
fn unlooped(places: &[LinePlace]) -> Vec<LinePlace> {
    let segment = |index: usize| LineSegment::between(places[index].at.into(), places[index + 1].at.into());
    let mut kept = vec![places[0]];
    let mut index = 0;
    while index + 1 < places.len() {
        let far = (index + MOST_LOOP).min(places.len() - 2);
        let here = segment(index);
        let crossing = (index + 2..=far).rev().find(|other| segment(*other).crosses(&here));
        index = crossing.unwrap_or(index) + 1;
        kept.push(places[index]);
    }
    kept
}

/// Returns the angle in radians by which a line of that width in grains turns from one knot to the next.
fn knot_turn(width: f64) -> f64 {
    let [least, most] = KNOT_TURNS;
    (KNOT_TURN / (width / GRAINS as f64).sqrt()).clamp(least, most)
}

/// Smooths a line where it turns more sharply than rivers of that width do: where its course bends towards the side to
/// which it swings.
fn fair(places: &mut [LinePlace], width: f64) {
    let last = places.len() - 1;
    // Compares squares of distances with the square of half a width, to save square roots.
    let least = width * width / 4.0;
    for _ in 0..FAIR_ROUNDS {
        let mut is_sharp = vec![false; places.len()];
        let (mut from, mut to) = (0, 0);
        for index in 1..last {
            let off = |other: usize| places[other].at.distance_squared(places[index].at);
            while from + 1 < index && off(from + 1) >= least {
                from += 1;
            }
            to = to.max(index + 1);
            while to < last && off(to) < least {
                to += 1;
            }
            let here = places[index].at;
            let (before, after) = (here - places[from].at, places[to].at - here);
            if before.perp_dot(after).abs() > SHARPEST * before.dot(after) {
                is_sharp[from.max(1)..=to.min(last - 1)].fill(true);
            }
        }
        if !is_sharp.contains(&true) {
            return;
        }
        for _ in 0..FAIR_PASSES {
            let mut before = places[0].at;
            for index in 1..last {
                let (here, after) = (places[index].at, places[index + 1].at);
                if is_sharp[index] {
                    places[index].at = 0.25 * (before + 2.0 * here + after);
                }
                before = here;
            }
        }
    }
}

/// Returns the angle in radians from one direction to another, positive clockwise where y is down.
fn turn(before: DVec2, after: DVec2) -> f64 {
    libm::atan2(before.perp_dot(after), before.dot(after))
}

/// Returns the tangents of a smooth curve at the places of a course. `ends` may give the directions at its ends. An end
/// without one turns as much as the place beside it.
///
/// Based on: E. Catmull, R. Rom, A class of local interpolating splines, 1974.
fn tangents(course: &[DVec2], ends: [Option<DVec2>; 2]) -> Vec<DVec2> {
    let last = course.len() - 1;
    let inner = course.windows(3).map(|three| 0.5 * (three[2] - three[0]));
    let mut tangents: Vec<DVec2> = std::iter::once(DVec2::ZERO).chain(inner).chain([DVec2::ZERO]).collect();
    for (end, beside, number) in [(0, 1, 0), (last, last - 1, 1)] {
        let along = course[end.max(beside)] - course[end.min(beside)];
        tangents[end] = match ends[number] {
            Some(direction) => direction * along.length() / direction.length().max(1e-9),
            None if last < 2 => along,
            None => 2.0 * along - tangents[beside],
        };
    }
    tangents
}

/// Returns a place of the smooth curve through a course, and the direction there.
fn smooth(course: &[DVec2], tangents: &[DVec2], segment: usize, share: f64) -> (DVec2, DVec2) {
    let (from, to) = (course[segment], course[segment + 1]);
    let (leave, arrive) = (tangents[segment], tangents[segment + 1]);
    let (t, t2) = (share, share * share);
    let t3 = t2 * t;
    let way = to - from;
    let place = from + way * (3.0 * t2 - 2.0 * t3) + leave * (t3 - 2.0 * t2 + t) + arrive * (t3 - t2);
    let direction = way * 6.0 * (t - t2) + leave * (3.0 * t2 - 4.0 * t + 1.0) + arrive * (3.0 * t2 - 2.0 * t);
    (place, direction)
}

/// Thins the places of a line: keeps those where segments of the course begin, and those where the line has turned
/// enough.
fn thinned(places: &[LinePlace], knot_turn: f64) -> Vec<LinePlace> {
    let last = places.len() - 1;
    let ways = |index: usize| {
        let [before, here, after] = [index - 1, index, index + 1].map(|index| places[index].at);
        (here - before, after - here)
    };
    let mut kept = vec![places[0]];
    let mut first = 1;
    for segment in places[1..last].chunk_by(|_, next| next.share != 0.0) {
        let mut inner = first..first + segment.len();
        first = inner.end;
        if segment[0].share == 0.0 {
            kept.push(segment[0]);
            inner.next();
        }
        // Most segments turn little in all. The sum of tangents, which are never less than their angles, shows that
        // without computing an angle.
        let tangent = |index: usize| {
            let (before, after) = ways(index);
            let ahead = before.dot(after);
            if ahead > 0.0 { before.perp_dot(after).abs() / ahead } else { f64::INFINITY }
        };
        if inner.clone().map(tangent).sum::<f64>() < 0.999 * knot_turn {
            continue;
        }
        let mut turned = 0.0;
        for index in inner {
            let (before, after) = ways(index);
            turned += turn(before, after).abs();
            if turned > knot_turn {
                kept.push(places[index]);
                turned = 0.0;
            }
        }
    }
    kept.push(places[last]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: f64 = 2000.0 / WAVE_WIDTHS;

    /// A straight course with meanders that grow from its ends.
    fn meandering(turn: f64) -> Vec<LinePlace> {
        let course: Vec<DVec2> = (0..=16).map(|step| DVec2::new(1000.0 * step as f64, 0.0)).collect();
        let meander = |step: i32| {
            let grown = (step.min(16 - step) as f64 / 4.0).min(1.0);
            Meander { phase: step as f64 * 0.5, turn: turn * grown, wave: 2000.0 }
        };
        line(&course, [None; 2], &(0..=16).map(meander).collect::<Vec<_>>(), WIDTH)
    }

    #[test]
    fn bends_are_round_and_no_tighter_than_two_widths() {
        let places = meandering(MOST_TURN);
        let mut sharpest: f64 = 0.0;
        for three in places.windows(3) {
            sharpest = sharpest.max(turn(three[1].at - three[0].at, three[2].at - three[1].at).abs());
        }
        assert!(sharpest < 0.35, "a corner of {sharpest} rad");
        // The swing is as wide as the series says.
        let widest = places.iter().map(|place| place.at.y.abs()).fold(0.0, f64::max);
        let swing = Meander::swing(2000.0, MOST_TURN);
        assert!((widest / swing - 1.0).abs() < 0.02, "{widest} for {swing}");
        assert!(2.0 * WIDTH < swing && swing < 3.5 * WIDTH);
        // Where it swings most, the line is 1.3 times as long as its course.
        let middle: Vec<DVec2> = places.iter().filter(|p| (4..12).contains(&p.segment)).map(|p| p.at).collect();
        let long: f64 = middle.windows(2).map(|pair| pair[1].distance(pair[0])).sum();
        assert!((1.25..1.35).contains(&(long / 8000.0)), "{long} for 8000");
    }

    #[test]
    fn a_bend_towards_the_side_of_a_meander_is_no_corner() {
        // A course that turns by 140 degrees within six widths, with meanders that swing as far as its bend is wide.
        let way = |step: i32| {
            let angle = (1.2 * f64::from(step - 16)).clamp(-1.2, 1.2);
            3.0 * WIDTH * DVec2::new(libm::cos(angle), libm::sin(angle))
        };
        let mut course = vec![DVec2::ZERO];
        for step in 0..32 {
            course.push(course[step as usize] + way(step));
        }
        for phase in 0..8 {
            let meander = |step: i32| Meander {
                phase: f64::from(phase) / 8.0 + f64::from(step) * 3.0 / WAVE_WIDTHS,
                turn: MOST_TURN * f64::from(step.min(32 - step)) / 16.0,
                wave: WAVE_WIDTHS * WIDTH,
            };
            let meanders: Vec<Meander> = (0..=32).map(meander).collect();
            let places = line(&course, [Some(way(0)), Some(way(31))], &meanders, WIDTH);
            // Measures the turn from half a width before each place to half a width after it.
            for (index, place) in places.iter().enumerate() {
                let off = |other: &&LinePlace| other.at.distance(place.at) > 0.5 * WIDTH;
                let (before, after) = (places[..index].iter().rev().find(off), places[index..].iter().find(off));
                let (Some(before), Some(after)) = (before, after) else { continue };
                let turn = turn(place.at - before.at, after.at - place.at);
                assert!(turn.abs() < 0.55, "phase {phase}: a corner of {turn} rad at {:?}", place.at);
            }
        }
    }

    #[test]
    fn a_straight_course_without_meanders_has_its_own_places() {
        let places = meandering(0.0);
        assert_eq!(places.len(), 17);
        assert!(places.iter().enumerate().all(|(step, place)| (place.at.x - 1000.0 * step as f64).abs() < 1e-6));
        assert!(places.iter().all(|place| place.at.y == 0.0));
    }
}
