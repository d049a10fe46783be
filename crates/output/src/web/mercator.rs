//! Web Mercator, EPSG:3857: the plane in which web maps and GIS draw the Earth.
//!
//! Metres east and north of a world's origin are taken as metres in this plane. So the world's origin lies where the
//! equator meets Greenwich, and tiles, longitudes and latitudes of one world agree in every reader. Near the equator a
//! metre of the plane is a metre on the Earth. Further north and south the plane is stretched, and readers take its
//! metre for less: by 1.2 % at 1,000 km from the origin.

use std::f64::consts::PI;

/// Radius of the Earth at the equator in metres, as web maps define it.
const EQUATOR_M: f64 = 6_378_137.0;

/// Side length in metres of the square that the plane is. The Earth's origin lies at its centre.
pub const SIDE_M: f64 = 2.0 * PI * EQUATOR_M;

/// Returns the longitude and latitude of a place in metres east and north.
pub fn degrees([east_m, north_m]: [f64; 2]) -> [f64; 2] {
    let latitude = libm::atan(libm::sinh(north_m / EQUATOR_M));
    [east_m / EQUATOR_M, latitude].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_those_of_epsg_3857() {
        // Expected values from PROJ 9: cs2cs EPSG:3857 EPSG:4326.
        let near = |[east_m, north_m]: [f64; 2], [longitude, latitude]: [f64; 2]| {
            let found = degrees([east_m, north_m]);
            assert!((found[0] - longitude).abs() < 1e-9 && (found[1] - latitude).abs() < 1e-9, "{found:?}");
        };
        near([0.0, 0.0], [0.0, 0.0]);
        near([SIDE_M / 2.0, SIDE_M / 2.0], [180.0, 85.051_128_779_806_6]);
        near([-500_000.0, 1_000_000.0], [-4.491_576_420_597_607, 8.946_573_850_543_413]);
    }
}
