//! Web Mercator, EPSG:3857: the plane in which web maps and GIS have the Earth.
//!
//! A world's metres east and north of its origin are taken for the metres of this plane: so its origin lies where the equator
//! meets Greenwich, and tiles, longitudes and latitudes of one world lie on each other in every reader. Near the equator a metre
//! of the plane is one of the Earth; further north and south readers take it for less, since there the plane is stretched: 1,000 km
//! from the origin by 1.2 %.

use std::f64::consts::PI;

/// Metres from the Earth's middle to its equator, as web maps have it.
const EQUATOR_M: f64 = 6_378_137.0;

/// Metres on a side of the square that the plane is. The Earth's origin lies in its middle.
pub const SIDE_M: f64 = 2.0 * PI * EQUATOR_M;

/// Longitude and latitude of a place in metres east and north.
pub fn degrees([east_m, north_m]: [f64; 2]) -> [f64; 2] {
    let latitude = libm::atan(libm::sinh(north_m / EQUATOR_M));
    [east_m / EQUATOR_M, latitude].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_those_of_epsg_3857() {
        // By PROJ 9: cs2cs EPSG:3857 EPSG:4326.
        let near = |[east_m, north_m]: [f64; 2], [longitude, latitude]: [f64; 2]| {
            let found = degrees([east_m, north_m]);
            assert!((found[0] - longitude).abs() < 1e-9 && (found[1] - latitude).abs() < 1e-9, "{found:?}");
        };
        near([0.0, 0.0], [0.0, 0.0]);
        near([SIDE_M / 2.0, SIDE_M / 2.0], [180.0, 85.051_128_779_806_6]);
        near([-500_000.0, 1_000_000.0], [-4.491_576_420_597_607, 8.946_573_850_543_413]);
    }
}
