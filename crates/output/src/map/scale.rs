//! The scale of a map: metres of the world to pixels, and pixels to millimetres on paper.

use glam::{DVec2, dvec2};

use crate::area::{Area, Stride};

/// Size in millimetres on paper of the smallest landforms that are visible.
const SEEN_MM: f64 = 0.2;

/// The scale of a map: metres of the world per pixel, and pixels per millimetre on paper.
///
/// Pixels are counted east and south from the origin of the world, so a place in the world is in the same pixel of
/// every map of one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Metres per pixel.
    pub metres_per_pixel: f64,
    /// Pixels per millimetre on paper.
    pub pixels_per_mm: f64,
}

impl Scale {
    /// Denominator of the scale: 50,000 for 1:50,000.
    pub fn denominator(&self) -> f64 {
        self.metres_per_pixel * self.pixels_per_mm * 1000.0
    }

    /// Converts a length in millimetres on paper to pixels.
    pub fn pixels(&self, mm: f64) -> f64 {
        mm * self.pixels_per_mm
    }

    /// Returns the stride whose nodes lie about one pixel apart, or as far apart as the smallest visible landform on
    /// paper if that is more. `spacing_m` is the distance in metres between vertices.
    pub fn stride(&self, spacing_m: f64) -> Stride {
        // Allow nodes √2 pixels apart: strides double, so this comes as close as possible to one node per pixel.
        let pixel_m = self.metres_per_pixel * std::f64::consts::SQRT_2;
        let most_m = pixel_m.max(SEEN_MM * self.denominator() / 1000.0);
        Stride::within(most_m, spacing_m)
    }

    /// Converts a place in metres east and north of the origin to pixels east and south of the origin.
    pub fn pixel(&self, [east, north]: [f64; 2]) -> DVec2 {
        dvec2(east, -north) / self.metres_per_pixel
    }

    /// Returns the pixels of a rectangle of the world, given by its west, south, east and north in metres from the
    /// origin.
    pub fn pixels_of(&self, [west, south, east, north]: [f64; 4]) -> Area {
        let at = |metres: f64| (metres / self.metres_per_pixel).round() as i64;
        Area { x0: at(west), y0: at(-north), x1: at(east), y1: at(-south) }
    }

    /// Returns the vertices or nodes, `node_m` metres apart, that lie in an area of pixels or right beside it.
    pub fn nodes_of(&self, pixels: Area, node_m: f64) -> Area {
        let first = |pixel: i64| (pixel as f64 * self.metres_per_pixel / node_m).floor() as i64;
        let last = |pixel: i64| (pixel as f64 * self.metres_per_pixel / node_m).ceil() as i64 + 1;
        Area { x0: first(pixels.x0), y0: first(pixels.y0), x1: last(pixels.x1), y1: last(pixels.y1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_lie_about_as_far_apart_as_pixels() {
        for (metres_per_pixel, stride) in
            [(2.0, 1), (10.0, 1), (14.0, 1), (15.0, 2), (40.0, 4), (170.0, 16), (1e6, 4096)]
        {
            let scale = Scale { metres_per_pixel, pixels_per_mm: 4.0 };
            assert_eq!(scale.stride(10.0).vertices(), stride, "{metres_per_pixel}");
        }
        let scale = Scale { metres_per_pixel: 2.5, pixels_per_mm: 10.0 };
        assert_eq!(scale.denominator(), 25_000.0);
        assert_eq!(scale.pixels_of([-10.0, -5.0, 20.0, 10.0]), Area { x0: -4, y0: -4, x1: 8, y1: 2 });
    }
}
