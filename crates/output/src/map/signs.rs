//! Signs on the ground: strokes down rock and slopes, and the stones of scree.
//!
//! Signs stand on a jittered grid of the scale. Whether there is a sign depends on its place alone.

use glam::{DVec2, dvec2};

use crate::area::Area;
use crate::grid::Grid;
use crate::hash::{self, SignDraw};
use crate::map::plotter::Pen;
use crate::map::scale::Scale;
use crate::map::style::SignsStyle;

/// Pixels of ground around a block in which signs are looked for: no sign reaches further from its middle.
pub(super) const REACH: usize = 12;

/// Spacing of signs and length of strokes on the steepest slopes, in millimetres.
const ROCK_MM: [f64; 2] = [0.9, 1.5];
const SCREE_MM: f64 = 0.55;
const HACHURE_MM: [f64; 2] = [0.75, 1.2];

/// Least slope (rise over run) of rock with strokes; and the slopes from which on hachures appear and at which they are
/// full.
const ROCK_SLOPE: f64 = 0.45;
const HACHURE_SLOPE: [f64; 2] = [0.1, 0.6];

/// Number of widths of strokes.
const WIDTHS: usize = 4;

/// The ground that decides where signs stand.
pub(super) struct Slopes<'a> {
    /// Heights of the area and of some pixels around it, and the distance in metres between two of them.
    pub heights: &'a Grid<f32>,
    pub metres_per_pixel: f64,
    /// Factor by which slopes are exaggerated at the scale.
    pub steepening: f64,
    /// Shares of rock and of scree, 0 to 1, in the area and [`REACH`] around it.
    pub rock: &'a Grid<f32>,
    pub scree: &'a Grid<f32>,
    /// Height of the sea in metres: no signs stand below it.
    pub sea_level_m: f32,
}

/// Returns the signs of an area: lines, grouped by pen.
pub(super) fn signs(
    style: &SignsStyle,
    scale: Scale,
    sun: DVec2,
    area: Area,
    slopes: &Slopes,
) -> Vec<(Pen, Vec<Vec<DVec2>>)> {
    let mut strokes: [Vec<Vec<DVec2>>; WIDTHS] = Default::default();
    let mut stones = Vec::new();
    let seen = area.padded(REACH);
    let at = |place: DVec2| (place.x.floor() as i64, place.y.floor() as i64);
    // Returns the downhill gradient, east and south, and how far the slope is turned away from the sun, 0 to 1.
    let fall = |place: DVec2| {
        let (x, y) = at(place);
        let height = |x, y| f64::from(slopes.heights.at(x, y));
        let per_m = slopes.steepening / (2.0 * slopes.metres_per_pixel);
        let fall = dvec2(height(x - 1, y) - height(x + 1, y), height(x, y - 1) - height(x, y + 1)) * per_m;
        let shade = 0.5 - 0.5 * fall.dot(sun) / fall.length().max(1e-9);
        (fall, shade)
    };
    let mut stroke = |place: DVec2, fall: DVec2, long: f64, weight: f64| {
        let half = fall / fall.length() * 0.5 * long;
        let width = (weight * WIDTHS as f64) as usize;
        strokes[width.min(WIDTHS - 1)].push(vec![place - half, place + half]);
    };
    if style.rock > 0.0 {
        each_place(slopes, seen, scale.pixels(ROCK_MM[0]), SignDraw::Rock, |place, chance| {
            let (fall, shade) = fall(place);
            let (x, y) = at(place);
            let share = f64::from(slopes.rock.at(x, y)) * style.rock * (0.35 + 0.65 * shade);
            if fall.length() > ROCK_SLOPE && chance < share {
                let long = scale.pixels(ROCK_MM[1]) * (0.5 + chance).min(1.0);
                stroke(place, fall, long.min(2.0 * REACH as f64 - 2.0), 0.2 + 0.8 * shade);
            }
        });
    }
    if style.hachures > 0.0 {
        each_place(slopes, seen, scale.pixels(HACHURE_MM[0]), SignDraw::Hachure, |place, chance| {
            let (fall, shade) = fall(place);
            let [least, most] = HACHURE_SLOPE;
            let steep = ((fall.length() - least) / (most - least)).clamp(0.0, 1.0);
            if steep > 0.0 && chance < style.hachures * (0.25 + 0.75 * shade) * (0.4 + 0.6 * steep) {
                let long = scale.pixels(HACHURE_MM[1]) * (0.45 + 0.55 * steep);
                stroke(place, fall, long.min(2.0 * REACH as f64 - 2.0), shade * (0.3 + 0.7 * steep));
            }
        });
    }
    if style.scree > 0.0 {
        each_place(slopes, seen, scale.pixels(SCREE_MM), SignDraw::Scree, |place, chance| {
            let (x, y) = at(place);
            if chance < f64::from(slopes.scree.at(x, y)) * style.scree {
                // The shortest possible line: its round ends make a dot.
                stones.push(vec![place, place + dvec2(0.02, 0.0)]);
            }
        });
    }
    let pen = |mm: f64| Pen { opacity: style.opacity as f32, ..Pen::solid(style.colour, scale.pixels(mm)) };
    let widths = (1..).zip(strokes).map(|(step, lines)| (pen(style.width_mm * f64::from(step) / WIDTHS as f64), lines));
    widths.chain([(pen(1.2 * style.width_mm), stones)]).filter(|(_, lines)| !lines.is_empty()).collect()
}

/// Calls with each point of a jittered grid that is on land within an area, and with a random number from 0 to 1.
fn each_place(slopes: &Slopes, area: Area, step: f64, sign: SignDraw, mut call: impl FnMut(DVec2, f64)) {
    let span = |from: i64, to: i64| (from as f64 / step).floor() as i64 - 1..=(to as f64 / step).ceil() as i64;
    for j in span(area.y0, area.y1) {
        for i in span(area.x0, area.x1) {
            let number = hash::of([sign as u64, i as u64, j as u64]);
            let part = |by: u32| ((number >> by) & 0xFFFF) as f64 / 65_536.0;
            let place = dvec2(i as f64 + part(0), j as f64 + part(16)) * step;
            let (x, y) = (place.x.floor() as i64, place.y.floor() as i64);
            if area.contains(&Area::new(x, y, 1, 1)) && slopes.heights.at(x, y) > slopes.sea_level_m {
                call(place, part(32));
            }
        }
    }
}
