//! Ice sheets: ice so thick that it buries whole countries, near the poles and on the highest plateaus.
//!
//! The surface of a sheet is a smooth dome above the country, lower towards its margin and towards the sea, where it ends
//! in a cliff. Land that is higher stands out of it. Nothing flows on a sheet.
//!
//! Based on: S. S. Vialov, Regularities of glacial shields movement, 1958 (the profile rises steeply from the margin, and
//! is nearly level in the middle).

use super::fields::Fields;
use super::warp::Displaced;
use crate::geography::Setting;
use crate::grain_point::Point;
use crate::grid::{Grid, corners, spline_between_corners};
use crate::land::{Land, WaterKind};

/// Vertices between the corners between which the surface is interpolated.
const CORNERS: i64 = 32;

/// Height of a sheet's surface in metres at the sea, and its rise from there to the middle of a large continent.
const CLIFF_M: f64 = 40.0;
const DOME_M: f64 = 2100.0;

/// Part of the planned height of the country in the surface.
const COUNTRY: f64 = 0.35;

/// Depth in metres below the sea at which the surface lies where there is no sheet: below all land.
const NOWHERE_M: f64 = 400.0;

/// Thickness of ice in metres from which on water under it is not seen.
const HIDES_M: f32 = 1.0;

/// Buries the land of an area under ice sheets. Its nodes lie `nodes.step` vertices apart.
pub fn bury(fields: &Fields, nodes: &Displaced, land: &mut Land) {
    let Some(geography) = fields.geography() else { return };
    let (area, step) = (land.heights.area(), nodes.step);
    let apart = (CORNERS / step).max(1);
    let at_corner = |(x, y): (i64, i64)| Point::at_vertex(x * apart * step, y * apart * step);
    let places: Vec<Point> = corners(area, apart).padded(1).vertices().map(at_corner).collect();
    let surface: Vec<f32> = geography.settings_at(&places).iter().map(|setting| surface_m(setting) as f32).collect();
    let nowhere = |surface_m: &f32| *surface_m <= -NOWHERE_M as f32;
    if surface.iter().all(nowhere) {
        return;
    }
    let surface = spline_between_corners(area, apart, &surface);
    let sea_m = fields.sea_level_m() as f32;
    let Some(water) = &mut land.water else { return };
    let ice_m = water.ice_m.get_or_insert_with(|| Grid::filled(area, 0.0));
    for (at, (height_m, above_m)) in land.heights.values_mut().iter_mut().zip(surface).enumerate() {
        let thick_m = sea_m + above_m - *height_m;
        if thick_m <= 0.0 || water.kind.values()[at] == WaterKind::Sea {
            continue;
        }
        *height_m += thick_m;
        ice_m.values_mut()[at] += thick_m;
        if thick_m > HIDES_M {
            water.kind.values_mut()[at] = WaterKind::Dry;
            water.depth_m.values_mut()[at] = 0.0;
            water.flow_m3s.values_mut()[at] = 0.0;
        }
    }
}

/// Returns the height in metres above the sea of the surface of an ice sheet at a place, below all land without one.
fn surface_m(setting: &Setting) -> f64 {
    let (sheet, land) = (setting.is_under_ice(), &setting.land);
    let dome_m = CLIFF_M + DOME_M * land.continent.clamp(0.0, 1.0).sqrt() + COUNTRY * land.planned_m().max(0.0);
    sheet * dome_m - (1.0 - sheet) * NOWHERE_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::fluvial::tests::fields_of_world;
    use crate::land::Water;

    #[test]
    fn land_near_a_pole_lies_under_ice_and_land_near_the_equator_does_not() {
        let fields = fields_of_world(3);
        let geography = fields.geography().unwrap();
        let of_latitude = |north_km: f64| {
            let at = |n: i64| Point { x: (n as f64 * 100e3 / fields.metres_a_grain()) as i64, y: 0 };
            let at = |n: i64| at(n).moved([0.0, -north_km * 1000.0 / fields.metres_a_grain()].into());
            let places: Vec<Point> = (-100..100).map(at).collect();
            let land = geography.settings_at(&places).into_iter().zip(places);
            land.filter(|(setting, _)| setting.land.continent > 0.1).collect::<Vec<_>>()
        };
        let (polar, tropical) = (of_latitude(2800.0), of_latitude(-7000.0));
        let buried = polar.iter().filter(|(setting, _)| surface_m(setting) > 500.0).collect::<Vec<_>>();
        assert!(!polar.is_empty() && buried.len() * 2 > polar.len(), "{} of {}", buried.len(), polar.len());
        assert!(!tropical.is_empty() && tropical.iter().all(|(setting, _)| surface_m(setting) < 0.0));
        let at = buried[0].1;
        let area = Area::new(at.x / 256, at.y / 256, 40, 30);
        let zeros = || vec![0.0; area.len()];
        let nodes = Displaced { area, step: 1, metres: [zeros(), zeros()] };
        let mut water = Water::none(area);
        water.kind.values_mut().fill(WaterKind::River);
        let mut land = Land { heights: Grid::of(area, |x, _| (x - area.x0) as f32 * 10.0), water: Some(water) };
        bury(&fields, &nodes, &mut land);
        let water = land.water.unwrap();
        assert!(water.kind.values().iter().all(|kind| *kind == WaterKind::Dry));
        let steps = land.heights.row(area.y0, area.x0, area.x1).windows(2).map(|pair| (pair[1] - pair[0]).abs());
        assert!(steps.fold(0.0, f32::max) < 1.0, "the surface is smooth");
    }
}
