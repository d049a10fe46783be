//! Outlines: the lines that follow from the ground of a block: contours with their numbers, depth contours, coasts and
//! signs.

use crate::area::Area;
use crate::geometry::{dot, length};
use crate::map::contour_lines::{ContourLine, contours, shores};
use crate::map::label::overlap;
use crate::map::plotter::{Pen, Plotter, bounds};
use crate::map::relief::{GroundPixels, ShadedRelief};
use crate::map::scale::Scale;
use crate::map::signs::{Slopes, signs};
use crate::map::style::{Colour, Style};
use crate::map::text::{Placed, Quad, shape};

/// Side in pixels of the squares that have at most one number each. A number lies within its square, so each block
/// places its numbers without looking at other blocks.
pub(super) const SQUARE: i64 = 256;

/// Smallest gap in millimetres between a number and the ends of its line, other names, and the edges of its square.
const GAP_MM: f64 = 0.5;

/// Smallest length of the chord of a line under a number, as a share of the line's length there.
const STRAIGHT: f64 = 0.97;

/// Distance in pixels to both sides of a number at which heights are compared to find the side that is uphill.
const UPHILL_PX: f64 = 4.0;

/// Kinds of lines on the ground, from the lowest to the highest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GroundLine {
    Sign,
    Depth,
    Contour,
    IndexContour,
}

/// Lines of points, in pixels.
type Polylines = Vec<Vec<[f64; 2]>>;

/// All lines of a block, in pixels.
pub(super) struct Outlines {
    /// Lines by their kind and by the pen that draws them.
    lines: Vec<(GroundLine, Pen, Polylines)>,
    pub coasts: Polylines,
    numbers: Vec<Placed>,
    ink: Colour,
}

impl Outlines {
    /// Creates the lines of the ground of a block. Contours have numbers where no name is written.
    pub fn new(
        (style, relief): (&Style, &ShadedRelief),
        scale: Scale,
        interval_m: f64,
        sea_level_m: Option<f64>,
        ground: &GroundPixels,
        written: &[Quad],
    ) -> Outlines {
        let area = ground.area;
        let mut outlines =
            Outlines { lines: Vec::new(), coasts: Vec::new(), numbers: Vec::new(), ink: style.labels.contour.colour };
        if let Some([rock, scree]) = &ground.stones {
            let slopes = Slopes {
                heights: &ground.heights,
                metres_per_pixel: scale.metres_per_pixel,
                steepening: relief.steepening(),
                rock,
                scree,
                sea_level_m: sea_level_m.map_or(f32::NEG_INFINITY, |level| level as f32),
            };
            let mut signs_style = style.signs.clone();
            if scale.denominator() > signs_style.most {
                (signs_style.rock, signs_style.scree) = (0.0, 0.0);
            }
            let signs = signs(&signs_style, scale, relief.sun(), area, &slopes);
            outlines.lines.extend(signs.into_iter().map(|(pen, lines)| (GroundLine::Sign, pen, lines)));
        }
        let has_depths = style.water.draw && style.water.depth_mm > 0.0;
        if style.contours.draw || has_depths {
            let sea_level_m = sea_level_m.unwrap_or(f64::NEG_INFINITY);
            let (land, sea): (Vec<ContourLine>, Vec<ContourLine>) = contours(&ground.heights, area, interval_m)
                .into_iter()
                .filter(|line| line.number as f64 * interval_m != sea_level_m)
                .partition(|line| line.number as f64 * interval_m > sea_level_m);
            if has_depths {
                let pen = Pen {
                    colour: style.water.line,
                    opacity: 0.6,
                    width: scale.pixels(style.water.depth_mm) as f32,
                    dash: None,
                };
                outlines.lines.push((GroundLine::Depth, pen, sea.into_iter().map(|line| line.points).collect()));
            }
            if style.contours.draw {
                outlines.add_contours(style, scale, interval_m, ground, &land, written);
            }
        }
        if let Some(level_m) = sea_level_m.filter(|_| style.water.draw) {
            outlines.coasts = shores(&ground.heights, area, level_m as f32);
        }
        outlines
    }

    fn add_contours(
        &mut self,
        style: &Style,
        scale: Scale,
        interval_m: f64,
        ground: &GroundPixels,
        contours: &[ContourLine],
        written: &[Quad],
    ) {
        if style.labels.draw && style.labels.contour.size_mm > 0.0 {
            self.numbers = Numberer { style, scale, interval_m, ground }.numbers(contours, written);
        }
        let gaps: Vec<Gap> = self
            .numbers
            .iter()
            .flat_map(|number| &number.boxes)
            .map(|quad| Gap::new(quad, scale.pixels(GAP_MM)))
            .collect();
        let contour = &style.contours;
        let mut pens: [(Pen, Vec<Vec<[f64; 2]>>); 4] = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(index, snow)| {
            let mm = [contour.width_mm, contour.index_width_mm][index];
            let colour = [contour.colour, contour.on_snow][snow];
            let width = scale.pixels(mm) as f32;
            (Pen { colour, opacity: contour.opacity as f32, width, dash: None }, Vec::new())
        });
        for line in contours {
            // Split the line into runs on snow and off it, which overlap by a point. No run goes through a number.
            let of_index = 2 * usize::from(line.is_index());
            let is_snow = |[x, y]: [f64; 2]| {
                let Area { x0, y0, x1, y1 } = ground.area;
                usize::from(ground.snow.at((x as i64).clamp(x0, x1 - 1), (y as i64).clamp(y0, y1 - 1)) > 0.5)
            };
            let mut run: Vec<[f64; 2]> = Vec::new();
            let mut snow = is_snow(line.points[0]);
            let mut put = |run: &mut Vec<[f64; 2]>, snow: usize, from: usize| {
                let rest = run.split_off(from);
                let whole = std::mem::replace(run, rest);
                if whole.len() + usize::from(!run.is_empty()) > 1 {
                    pens[of_index + snow].1.push(whole.into_iter().chain(run.first().copied()).collect());
                }
            };
            for point in &line.points {
                if gaps.iter().any(|gap| gap.holds(*point)) {
                    let end = run.len();
                    put(&mut run, snow, end);
                    continue;
                }
                run.push(*point);
                let now = is_snow(*point);
                if now != snow {
                    let last = run.len() - 1;
                    put(&mut run, snow, last);
                    snow = now;
                }
            }
            let end = run.len();
            put(&mut run, snow, end);
        }
        let traces = [GroundLine::Contour, GroundLine::Contour, GroundLine::IndexContour, GroundLine::IndexContour];
        self.lines.extend(traces.into_iter().zip(pens).map(|(trace, (pen, lines))| (trace, pen, lines)));
    }

    /// Draws the lines of one kind.
    pub fn draw(&self, trace: GroundLine, plotter: &mut dyn Plotter) {
        for (_, pen, lines) in self.lines.iter().filter(|(of, _, _)| *of == trace) {
            plotter.stroke(lines, pen);
        }
    }

    /// Writes the numbers of contours.
    pub fn write(&self, plotter: &mut dyn Plotter) {
        self.numbers.iter().for_each(|number| plotter.write(number, self.ink));
    }
}

/// The gap around a number, in which no contour is drawn.
struct Gap {
    bounds: [f64; 4],
    /// A corner of the gap, and the sides that begin there.
    corner: [f64; 2],
    sides: [[f64; 2]; 2],
}

impl Gap {
    /// Creates the gap of a number's box, wider by `by` at both ends of the text.
    fn new(quad: &Quad, by: f64) -> Gap {
        let [a, b, _, d] = *quad;
        let along = [b[0] - a[0], b[1] - a[1]];
        let long = length(along).max(1e-9);
        let wider = along.map(|axis| axis * by / long);
        let corner = [a[0] - wider[0], a[1] - wider[1]];
        let sides = [[along[0] + 2.0 * wider[0], along[1] + 2.0 * wider[1]], [d[0] - a[0], d[1] - a[1]]];
        let at = |u: f64, v: f64| [0, 1].map(|axis| corner[axis] + u * sides[0][axis] + v * sides[1][axis]);
        let bounds = bounds([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)].iter());
        Gap { bounds, corner, sides }
    }

    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let [west, north, east, south] = self.bounds;
        if x < west || x > east || y < north || y > south {
            return false;
        }
        let from = [x - self.corner[0], y - self.corner[1]];
        self.sides.iter().all(|side| (0.0..=dot(*side, *side)).contains(&dot(from, *side)))
    }
}

/// Finds places for the numbers of contours.
struct Numberer<'a> {
    style: &'a Style,
    scale: Scale,
    interval_m: f64,
    ground: &'a GroundPixels,
}

impl Numberer<'_> {
    /// Returns at most one number for each square, on the straightest part of an index line.
    fn numbers(&self, contours: &[ContourLine], written: &[Quad]) -> Vec<Placed> {
        let Area { x0, y0, x1, y1 } = self.ground.area;
        let squares =
            (y0..y1).step_by(SQUARE as usize).flat_map(|y| (x0..x1).step_by(SQUARE as usize).map(move |x| [x, y]));
        squares
            .filter_map(|[x, y]| {
                let square = Area::new(x, y, SQUARE as usize, SQUARE as usize);
                let near: Vec<&Quad> = written.iter().filter(|quad| square.meets(bounds(quad.iter()))).collect();
                let index = contours.iter().filter(|line| line.is_index());
                let places = index.flat_map(|line| self.places(line, square, &near));
                // Of equally straight places, take the first.
                places.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, number)| number)
            })
            .collect()
    }

    /// Returns places for the number of a line in a square, each with the straightness of the line there.
    fn places(&self, line: &ContourLine, square: Area, written: &[&Quad]) -> Vec<(f64, Placed)> {
        let style = self.style.labels.contour;
        let metres = line.number as f64 * self.interval_m;
        let digits = usize::from(self.interval_m.fract() != 0.0);
        let size = self.scale.pixels(style.size_mm) as f32;
        let typeface = self.style.labels.typeface(style.face);
        let text = shape(&format!("{metres:.digits$}"), typeface, size, style.spacing as f32);
        let (gap, half) = (self.scale.pixels(GAP_MM), 0.5 * text.width);
        let reach = half + gap;
        // A number with its middle this far from the edges lies within the square, however it is turned.
        let edge = reach + text.cap_height;
        let inner = [square.x0, square.y0].map(|at| at as f64 + edge);
        let outer = [square.x1, square.y1].map(|at| at as f64 - edge);
        let mut places = Vec::new();
        let mut last = f64::NEG_INFINITY;
        let mut at = 0.0;
        for (index, pair) in line.points.windows(2).enumerate() {
            at += length([pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
            let middle = pair[1];
            let is_inside = (0..2).all(|axis| inner[axis] <= middle[axis] && middle[axis] <= outer[axis]);
            // Trying a place every half width of the number is enough.
            if !is_inside || at < last + half {
                continue;
            }
            last = at;
            let Some((from, to)) = ends(&line.points, index + 1, reach) else { continue };
            let chord = [to[0] - from[0], to[1] - from[1]];
            let straight = length(chord) / (2.0 * reach);
            if straight < STRAIGHT {
                continue;
            }
            let placed = self.placed(&text, [(from[0] + to[0]) * 0.5, (from[1] + to[1]) * 0.5], chord);
            let is_free = |quad: &Quad| written.iter().all(|other| !overlap(quad, other, gap));
            if placed.boxes.iter().all(is_free) {
                places.push((straight, placed));
            }
        }
        places
    }

    /// Sets a number with its middle at a place and its top uphill.
    fn placed(&self, text: &crate::map::text::Shaped, [x, y]: [f64; 2], chord: [f64; 2]) -> Placed {
        let long = length(chord);
        let mut along = chord.map(|axis| axis / long);
        let height_at = |side: f64| {
            let at = [x + along[1] * side, y - along[0] * side];
            self.ground.heights.at(at[0].floor() as i64, at[1].floor() as i64)
        };
        if height_at(UPHILL_PX) < height_at(-UPHILL_PX) {
            along = along.map(|axis| -axis);
        }
        let (half, down) = (0.5 * text.width, 0.5 * text.cap_height);
        let start = [x - along[0] * half - along[1] * down, y - along[1] * half + along[0] * down];
        text.at(start, libm::atan2(along[1], along[0]))
    }
}

/// Returns the points of a line at the distance `reach` before and after one of its own points, if the line goes on for
/// so long.
fn ends(points: &[[f64; 2]], middle: usize, reach: f64) -> Option<([f64; 2], [f64; 2])> {
    let walk = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut last = *points.next()?;
        let mut left = reach;
        for point in points {
            let step = [point[0] - last[0], point[1] - last[1]];
            let long = length(step);
            if long >= left {
                return Some([0, 1].map(|axis| last[axis] + step[axis] * left / long));
            }
            left -= long;
            last = *point;
        }
        None
    };
    Some((walk(&mut points[..=middle].iter().rev())?, walk(&mut points[middle..].iter())?))
}
