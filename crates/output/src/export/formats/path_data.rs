//! The text of path data in SVG.

use std::fmt::{self, Display, Formatter, Write};

use glam::DVec2;

/// A number that is written with at most two decimals: hundredths of pixels are finer than what any printer shows.
pub(super) struct Hundredths(pub f64);

impl Display for Hundredths {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let text = format!("{:.2}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

/// Path data under way. Points are written relative to the point before, which takes fewer digits.
#[derive(Default)]
pub(super) struct PathData {
    text: String,
    /// Place of the pen in whole hundredths of a pixel, so that rounding errors do not add up from point to point.
    pen: [i64; 2],
    /// Last command: SVG lets a repeated command be left out.
    command: Option<char>,
}

impl PathData {
    pub fn move_to(&mut self, at: DVec2) {
        self.pen = hundredths(at);
        self.command = None;
        let [x, y] = self.pen.map(|axis| Hundredths(axis as f64 / 100.0));
        write!(self.text, "M{x} {y}").expect("memory takes everything");
    }

    pub fn line_to(&mut self, at: DVec2) {
        self.curve('l', &[at]);
    }

    pub fn quadratic_to(&mut self, control: DVec2, at: DVec2) {
        self.curve('q', &[control, at]);
    }

    pub fn close(&mut self) {
        self.command = None;
        self.text.push('Z');
    }

    pub fn finish(self) -> String {
        self.text
    }

    /// Moves the pen to the last of `points` with a command whose points are written relative to the pen.
    fn curve(&mut self, command: char, points: &[DVec2]) {
        let mut is_first = self.command != Some(command);
        if is_first {
            self.command = Some(command);
            self.text.push(command);
        }
        let points = points.iter().map(|point| hundredths(*point));
        let mut last = self.pen;
        for point in points {
            for (at, pen) in point.into_iter().zip(self.pen) {
                let step = at - pen;
                // A minus sign separates two numbers, so no space is needed.
                let space = if is_first || step < 0 { "" } else { " " };
                is_first = false;
                write!(self.text, "{space}{}", Hundredths(step as f64 / 100.0)).expect("memory takes everything");
            }
            last = point;
        }
        self.pen = last;
    }
}

fn hundredths(at: DVec2) -> [i64; 2] {
    (at * 100.0).round().to_array().map(|axis| axis as i64)
}

#[cfg(test)]
mod tests {
    use glam::dvec2;

    use super::*;

    #[test]
    fn points_are_told_from_one_to_the_next_and_none_drifts() {
        let mut data = PathData::default();
        data.move_to(dvec2(1.0, 2.5));
        data.line_to(dvec2(3.0, 1.25));
        data.line_to(dvec2(3.004, 1.0));
        data.quadratic_to(dvec2(4.0, 1.0), dvec2(4.0, 2.0));
        data.close();
        data.move_to(dvec2(-0.001, 0.0));
        assert_eq!(data.finish(), "M1 2.5l2-1.25 0-0.25q1 0 1 1ZM0 0");
        let mut data = PathData::default();
        data.move_to(DVec2::ZERO);
        // Each third is rounded by itself, so the errors do not add up.
        (1..=300).for_each(|step| data.line_to(dvec2(f64::from(step) / 3.0, 0.0)));
        assert_eq!(data.pen, [10_000, 0]);
    }
}
