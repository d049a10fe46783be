//! The frame of a sheet, which no name crosses.

use crate::area::Area;
use crate::map::plotter::bounds;
use crate::map::scale::Scale;
use crate::map::text::Quad;

/// Smallest distance in millimetres from the frame to a letter.
const GAP_MM: f64 = 0.6;

/// The frame of a map that ends at its edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapFrame {
    /// Edges of the map in pixels: west, north, east and south.
    map: [f64; 4],
    /// The part of the map that letters may cover.
    room: [f64; 4],
}

impl MapFrame {
    /// Creates the frame around an area of pixels.
    pub fn new(area: Area, scale: Scale) -> MapFrame {
        let map = [area.x0, area.y0, area.x1, area.y1].map(|at| at as f64);
        let gap = scale.pixels(GAP_MM);
        MapFrame { map, room: [map[0] + gap, map[1] + gap, map[2] - gap, map[3] - gap] }
    }

    /// True if the map shows a place.
    pub fn shows(&self, [x, y]: [f64; 2]) -> bool {
        let [west, north, east, south] = self.map;
        (west..=east).contains(&x) && (north..=south).contains(&y)
    }

    /// True if all of some boxes lie where letters may.
    pub fn has_room(&self, boxes: &[Quad]) -> bool {
        let [west, north, east, south] = bounds(boxes.iter().flatten());
        west >= self.room[0] && north >= self.room[1] && east <= self.room[2] && south <= self.room[3]
    }

    /// Returns the part of a rectangle (west, north, east and south) that letters may cover, if there is one.
    pub fn part(&self, [west, north, east, south]: [f64; 4]) -> Option<[f64; 4]> {
        let [least_x, least_y, most_x, most_y] = self.room;
        let part = [west.max(least_x), north.max(least_y), east.min(most_x), south.min(most_y)];
        (part[0] < part[2] && part[1] < part[3]).then_some(part)
    }

    /// Returns the parts of a line that lie where letters may.
    pub fn parts(&self, line: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
        for pair in line.windows(2) {
            let Some([from, to]) = clipped([pair[0], pair[1]], self.room) else { continue };
            match parts.last_mut().filter(|part| part.last() == Some(&from)) {
                Some(part) => part.push(to),
                None => parts.push(vec![from, to]),
            }
        }
        parts
    }

    /// Returns the four edges of the map as boxes without width.
    pub fn edges(&self) -> impl Iterator<Item = Quad> {
        let [west, north, east, south] = self.map;
        let corners = [[west, north], [east, north], [east, south], [west, south]];
        (0..4).map(move |side| {
            let (from, to) = (corners[side], corners[(side + 1) % 4]);
            [from, to, to, from]
        })
    }
}

/// Returns the part of a straight line within a rectangle (west, north, east and south), if there is one longer than a
/// point.
///
/// Based on: Liang and Barsky (A New Concept and Method for Line Clipping, 1984). Each edge narrows the range of the
/// line that lies within all four edges.
pub(super) fn clipped([a, b]: [[f64; 2]; 2], [west, north, east, south]: [f64; 4]) -> Option<[[f64; 2]; 2]> {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (way, left) in [(-dx, a[0] - west), (dx, east - a[0]), (-dy, a[1] - north), (dy, south - a[1])] {
        if way == 0.0 {
            if left < 0.0 {
                return None;
            }
        } else if way < 0.0 {
            from = from.max(left / way);
        } else {
            to = to.min(left / way);
        }
    }
    // Ends that are not cut keep their coordinates to the bit.
    let place = |share: f64| match share {
        0.0 => a,
        1.0 => b,
        _ => [a[0] + dx * share, a[1] + dy * share],
    };
    (from < to).then(|| [place(from), place(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_leaves_the_map_and_comes_back_has_two_parts() {
        let frame =
            MapFrame::new(Area::new(0, 0, 100, 50), Scale { metres_per_pixel: 1.0, pixels_per_mm: 1.0 / GAP_MM });
        let line = [[-20.0, 10.0], [50.0, 10.0], [50.0, 80.0], [70.0, 80.0], [70.0, 20.0], [80.0, 20.0]];
        let parts = frame.parts(&line);
        let first = vec![[1.0, 10.0], [50.0, 10.0], [50.0, 49.0]];
        assert_eq!(parts, [first, vec![[70.0, 49.0], [70.0, 20.0], [80.0, 20.0]]]);
        assert!(frame.parts(&[[-5.0, -5.0], [200.0, -5.0]]).is_empty());
        assert!(frame.shows([0.0, 50.0]) && !frame.shows([0.0, 50.1]));
        assert_eq!(frame.part([-10.0, 20.0, 30.0, 70.0]), Some([1.0, 20.0, 30.0, 49.0]));
        assert_eq!(frame.part([-10.0, 20.0, 1.0, 70.0]), None);
    }
}
