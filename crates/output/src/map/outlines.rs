//! Outlines: the lines that follow from the ground of a block: contours with their numbers, depth contours, coasts and
//! signs.

use glam::DVec2;

use crate::area::Area;
use crate::map::contour_lines::{ContourLine, contours, shores};
use crate::map::label::overlap;
use crate::map::plotter::{Pen, Plotter, bounds, widened};
use crate::map::relief::{GroundPixels, ShadedRelief};
use crate::map::scale::Scale;
use crate::map::signs::{Slopes, signs};
use crate::map::style::{Colour, Style};
use crate::map::text::{Placed, Quad, Shaped, shape};

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
type Polylines = Vec<Vec<DVec2>>;

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
                let pen = Pen { opacity: 0.6, ..Pen::solid(style.water.line, scale.pixels(style.water.depth_mm)) };
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
        let mut pens: [(Pen, Polylines); 4] = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(index, snow)| {
            let mm = [contour.width_mm, contour.index_width_mm][index];
            let colour = [contour.colour, contour.on_snow][snow];
            (Pen { opacity: contour.opacity as f32, ..Pen::solid(colour, scale.pixels(mm)) }, Vec::new())
        });
        for line in contours {
            // Split the line into runs on snow and off it, which overlap by a point. No run goes through a number.
            let of_index = 2 * usize::from(line.is_index());
            let is_snow = |DVec2 { x, y }| {
                let Area { x0, y0, x1, y1 } = ground.area;
                usize::from(ground.snow.at((x as i64).clamp(x0, x1 - 1), (y as i64).clamp(y0, y1 - 1)) > 0.5)
            };
            let mut run: Vec<DVec2> = Vec::new();
            let mut snow = is_snow(line.points[0]);
            let mut put = |run: &mut Vec<DVec2>, snow: usize, from: usize| {
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
    corner: DVec2,
    sides: [DVec2; 2],
}

impl Gap {
    /// Creates the gap of a number's box, wider by `by` at both ends of the text.
    fn new(quad: &Quad, by: f64) -> Gap {
        let [a, b, _, d] = *quad;
        let along = b - a;
        let wider = along * by / along.length().max(1e-9);
        let (corner, [ahead, aside]) = (a - wider, [along + 2.0 * wider, d - a]);
        let bounds = bounds([corner, corner + ahead, corner + ahead + aside, corner + aside].iter());
        Gap { bounds, corner, sides: [ahead, aside] }
    }

    fn holds(&self, at: DVec2) -> bool {
        let [west, north, east, south] = self.bounds;
        if at.x < west || at.x > east || at.y < north || at.y > south {
            return false;
        }
        let from = at - self.corner;
        self.sides.iter().all(|side| (0.0..=side.length_squared()).contains(&from.dot(*side)))
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
        let squares = self.ground.area.squares(SQUARE as usize);
        squares
            .filter_map(|square| {
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
        let [west, north, east, south] = widened(square.edges(), -edge);
        let mut places = Vec::new();
        let mut last = f64::NEG_INFINITY;
        let mut at = 0.0;
        for (index, pair) in line.points.windows(2).enumerate() {
            at += pair[0].distance(pair[1]);
            let middle = pair[1];
            let is_inside = (west..=east).contains(&middle.x) && (north..=south).contains(&middle.y);
            // Trying a place every half width of the number is enough.
            if !is_inside || at < last + half {
                continue;
            }
            last = at;
            let Some((from, to)) = ends(&line.points, index + 1, reach) else { continue };
            let straight = from.distance(to) / (2.0 * reach);
            if straight < STRAIGHT {
                continue;
            }
            let placed = self.placed(&text, from.midpoint(to), to - from);
            let is_free = |quad: &Quad| written.iter().all(|other| !overlap(quad, other, gap));
            if placed.boxes.iter().all(is_free) {
                places.push((straight, placed));
            }
        }
        places
    }

    /// Sets a number with its middle at a place and its top uphill.
    fn placed(&self, text: &Shaped, middle: DVec2, chord: DVec2) -> Placed {
        let mut along = chord / chord.length();
        let height_at = |side: f64| {
            let at = (middle - along.perp() * side).floor();
            self.ground.heights.at(at.x as i64, at.y as i64)
        };
        if height_at(UPHILL_PX) < height_at(-UPHILL_PX) {
            along = -along;
        }
        let start = middle - along * (0.5 * text.width) + along.perp() * (0.5 * text.cap_height);
        text.at(start, libm::atan2(along.y, along.x))
    }
}

/// Returns the points of a line at the distance `reach` before and after one of its own points, if the line goes on for
/// so long.
fn ends(points: &[DVec2], middle: usize, reach: f64) -> Option<(DVec2, DVec2)> {
    let walk = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut last = *points.next()?;
        let mut left = reach;
        for point in points {
            let step = point - last;
            let long = step.length();
            if long >= left {
                return Some(last + step * left / long);
            }
            left -= long;
            last = *point;
        }
        None
    };
    Some((walk(&mut points[..=middle].iter().rev())?, walk(&mut points[middle..].iter())?))
}
