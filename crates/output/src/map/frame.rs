//! The frame of a sheet, which no name crosses.

use glam::DVec2;

use crate::area::Area;
use crate::geometry::LineSegment;
use crate::map::plotter::{bounds, ring, widened};
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
        MapFrame { map: area.edges(), room: widened(area.edges(), -scale.pixels(GAP_MM)) }
    }

    /// True if the map shows a place.
    pub fn shows(&self, DVec2 { x, y }: DVec2) -> bool {
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
    pub fn parts(&self, line: &[DVec2]) -> Vec<Vec<DVec2>> {
        let mut parts: Vec<Vec<DVec2>> = Vec::new();
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
        let corners = ring(self.map);
        (0..4).map(move |side| [corners[side], corners[side + 1], corners[side + 1], corners[side]])
    }
}

/// Returns the part of a straight line within a rectangle (west, north, east and south), if there is one longer than a
/// point.
pub(super) fn clipped([a, b]: [DVec2; 2], [west, north, east, south]: [f64; 4]) -> Option<[DVec2; 2]> {
    let along = b - a;
    let line = LineSegment { from: a.into(), along: along.into() };
    let [from, to] = line.clipped([west, north], [east, south])?.map(|end| end.share);
    // Ends that are not cut keep their coordinates to the bit.
    let place = |share: f64| match share {
        0.0 => a,
        1.0 => b,
        _ => a + along * share,
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
        let parts = frame.parts(&line.map(DVec2::from));
        let first = [[1.0, 10.0], [50.0, 10.0], [50.0, 49.0]].map(DVec2::from);
        assert_eq!(parts, [first, [[70.0, 49.0], [70.0, 20.0], [80.0, 20.0]].map(DVec2::from)]);
        assert!(frame.parts(&[[-5.0, -5.0], [200.0, -5.0]].map(DVec2::from)).is_empty());
        assert!(frame.shows(DVec2::new(0.0, 50.0)) && !frame.shows(DVec2::new(0.0, 50.1)));
        assert_eq!(frame.part([-10.0, 20.0, 30.0, 70.0]), Some([1.0, 20.0, 30.0, 49.0]));
        assert_eq!(frame.part([-10.0, 20.0, 1.0, 70.0]), None);
    }
}
