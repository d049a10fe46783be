//! Small forms of plains and plateaus: drumlins and eskers, which ice sheets have left, and dolines, where water has
//! dissolved limestone.
//!
//! Each stands in a cell of a lattice, well within it, or follows a line at even distances, swayed by noise. Drumlins and
//! eskers lie along the way that the ice went: from the poles, bent over hundreds of kilometres. All keep off water, and
//! fade out where rock or climate ask for none. They have hollows without outlet between and in them, as real ones do,
//! so they come after breaches.
//!
//! Based on: C. D. Clark et al., Size and shape characteristics of drumlins, 2009 (sizes); P. Ford, D. Williams, Karst
//! hydrogeology and geomorphology, 2007 (dolines).
//!
//! To judge the numbers chosen by eye, look at hillshades of the north of `world`, and of limestone where it rains.

use super::fields::Fields;
use super::free_ground::{FreeGround, free_ground};
use super::segment::Segments;
use super::warp::Displaced;
use crate::area::Area;
use crate::clock::Clock;
use crate::geography::Setting;
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::grid::{corners, spline_between_corners};
use crate::hash::{self, Stream};
use crate::land::{Land, WaterKind};
use crate::noise::point_noise::{PointField, PointNoise};
use crate::stop::Stopped;

/// Vertices between the corners between which the slowly varying numbers are interpolated.
const CORNERS: i64 = 32;

/// Largest distance in metres between nodes that show the forms.
const SHOW_M: f64 = 40.0;

/// Wavelength and amplitude in metres of the bends of the way of the ice: they turn it by up to 40 degrees.
const BENDS_M: f64 = 240e3;
const BENT_M: f64 = 45e3;

/// Length and width in metres of a drumlin's cell; half of a drumlin's length and width, the least and the addition by
/// chance; its height as a share of half its width, likewise; and the factor by which its end towards the ice is shorter.
const DRUMLIN_CELL_M: [f64; 2] = [1000.0, 400.0];
const DRUMLIN_LONG_M: [f64; 2] = [230.0, 170.0];
const DRUMLIN_WIDE_M: [f64; 2] = [75.0, 55.0];
const DRUMLIN_HEIGHT: [f64; 2] = [0.12, 0.08];
const BLUNT: f64 = 1.35;

/// Wavelength in metres of swarms of drumlins, the noise at which a swarm begins, and the rise of the noise from there to
/// a whole swarm; and the share of a swarm's cells that have a drumlin.
const SWARMS_M: f64 = 30e3;
const SWARM_FROM: f64 = -0.05;
const SWARM_OVER: f64 = 0.2;
const SWARM: f64 = 0.85;

/// Distance in metres from one esker to the next; half its width and its height; wavelength and amplitude in metres of
/// its bends; and wavelength in metres of its stretches and gaps.
const ESKERS_M: f64 = 13e3;
const ESKER_HALF_M: f64 = 50.0;
const ESKER_HEIGHT_M: f64 = 15.0;
const ESKER_BENDS_M: [f64; 2] = [3500.0, 600.0];
const ESKER_STRETCH_M: f64 = 15e3;

/// Side in metres of a doline's cell; the share of cells that have one; its radius in metres, the least and the addition by
/// chance, most being small; and its depth as a share of the radius.
const DOLINE_CELL_M: f64 = 320.0;
const DOLINES: f64 = 0.6;
const DOLINE_RADIUS_M: [f64; 2] = [25.0, 110.0];
const DOLINE_DEPTH: f64 = 0.32;

/// Metres from the floor of a valley with a river, and half widths of the largest lakes from the middle of a lake, at
/// which forms begin, and metres over which they reach their height.
const FREE: FreeGround = FreeGround { off_rivers_m: 20.0, off_lakes: 1.2, rise_m: 120.0 };

/// The small forms of a world.
#[derive(Debug)]
pub struct GroundForms {
    bends: [PointNoise; 2],
    swarms: PointNoise,
    esker_bends: PointNoise,
    esker_stretches: PointNoise,
    drumlins: u64,
    dolines: u64,
}

/// The slowly varying numbers of the forms at the nodes of an area.
struct FormsAtLarge {
    /// Metres east and south by which the plane of the ice is bent.
    bends_m: [Vec<f32>; 2],
    /// Heights of forms of ice and depths of dolines, as shares of the whole ones.
    ice: Vec<f32>,
    karst: Vec<f32>,
}

/// A cell of a lattice, with chance of its own.
struct FormCell {
    seed: u64,
    column: i64,
    row: i64,
    /// Offset in grains of a point from the cell's middle.
    off: [f64; 2],
}

impl FormCell {
    /// Finds the cell of a lattice in which a point lies. Columns are shifted against each other by chance.
    fn of(seed: u64, point: Point, [wide, long]: [i64; 2]) -> FormCell {
        let column = point.x.div_euclid(wide);
        let y = point.y + (hash::share(hash::combine(seed, column as u64)) * long as f64) as i64;
        let off = [point.x.rem_euclid(wide) - wide / 2, y.rem_euclid(long) - long / 2].map(|off| off as f64);
        FormCell { seed, column, row: y.div_euclid(long), off }
    }

    /// Returns a chance of the cell, 0 to 1.
    fn chance(&self, part: u64) -> f64 {
        hash::share(hash::lattice(hash::combine(self.seed, 1 + part), self.column, self.row))
    }
}

impl GroundForms {
    /// Makes the small forms of a world with these fields; `None` without a geography.
    pub fn new(fields: &Fields, seed: u64) -> Option<GroundForms> {
        fields.geography()?;
        let seed = |part| hash::stream(seed, Stream::GroundForms.of(part));
        let noise = |metres: f64, octaves, part| {
            PointNoise::new((metres / fields.metres_a_grain()).round().max(1.0) as i64, octaves, seed(part))
        };
        Some(GroundForms {
            bends: [noise(BENDS_M, 2, 0), noise(BENDS_M, 2, 1)],
            swarms: noise(SWARMS_M, 2, 2),
            esker_bends: noise(ESKER_BENDS_M[0], 2, 3),
            esker_stretches: noise(ESKER_STRETCH_M, 2, 4),
            drumlins: seed(5),
            dolines: seed(6),
        })
    }

    /// Shapes the dry land of an area, whose nodes lie `nodes.step` vertices apart.
    pub fn shape(
        &self,
        fields: &Fields,
        segments: &Segments,
        nodes: &Displaced,
        land: &mut Land,
        clock: &Clock,
    ) -> Result<(), Stopped> {
        let (area, step) = (land.heights.area(), nodes.step);
        if fields.spacing_m() * step as f64 > SHOW_M {
            return Ok(());
        }
        let Some(large) = self.at_large(fields, area, step) else { return Ok(()) };
        clock.check()?;
        let free = free_ground(fields, segments, nodes, area, &FREE);
        let sea_m = fields.sea_level_m() as f32;
        let kinds = land.water.as_ref().map(|water| &water.kind);
        for (at, (x, y)) in area.vertices().enumerate() {
            if large.ice[at] <= 0.0 && large.karst[at] <= 0.0
                || kinds.is_some_and(|kinds| kinds.at(x, y) != WaterKind::Dry)
            {
                continue;
            }
            let free = free.as_ref().map_or(1.0, |free| free.at(x, y));
            let height_m = &mut land.heights.row_mut(y, x, x + 1)[0];
            // Nothing is dissolved below the level of the sea.
            let above = (*height_m - sea_m).clamp(0.0, 20.0) / 20.0;
            if free * above > 0.0 {
                let point = Point::at_vertex(x * step, y * step);
                *height_m += (self.height_m(fields.metres_a_grain(), &large, at, point) as f32) * free * above;
            }
        }
        Ok(())
    }

    /// Returns the slowly varying numbers at nodes; `None` where there are no forms.
    fn at_large(&self, fields: &Fields, area: Area, step: i64) -> Option<FormsAtLarge> {
        let geography = fields.geography()?;
        let apart = (CORNERS / step).max(1);
        let at_corner = |(x, y): (i64, i64)| Point::at_vertex(x * apart * step, y * apart * step);
        let places: Vec<Point> = corners(area, apart).padded(1).vertices().map(at_corner).collect();
        let settings = geography.settings_at(&places);
        let [ice, karst] = [ice_forms, karst].map(|of| settings.iter().map(of).collect::<Vec<f64>>());
        if ice.iter().chain(&karst).all(|share| *share <= 0.0) {
            return None;
        }
        let table = |values: &[f64]| {
            spline_between_corners(area, apart, &values.iter().map(|value| *value as f32).collect::<Vec<_>>())
        };
        let bends_m = self.bends.each_ref().map(|bend| {
            let values: Vec<f64> = bend.at_all(&places).iter().map(|value| value * BENT_M).collect();
            table(&values)
        });
        Some(FormsAtLarge { bends_m, ice: table(&ice), karst: table(&karst) })
    }

    /// Returns the height in metres of all forms at a node and its point.
    fn height_m(&self, metres: f64, large: &FormsAtLarge, at: usize, point: Point) -> f64 {
        let (ice, karst) = (f64::from(large.ice[at]), f64::from(large.karst[at]));
        let mut height_m = 0.0;
        if ice > 0.0 {
            let [east, south] = [0, 1].map(|axis| f64::from(large.bends_m[axis][at]) / metres);
            let bent = point.moved([east, south].into());
            let swarm = SWARM * smooth((self.swarms.at(point) - SWARM_FROM) / SWARM_OVER);
            height_m += ice * self.drumlin_m(bent, metres, swarm).max(self.esker_m(point, bent, metres));
        }
        if karst > 0.0 {
            height_m -= karst * self.doline_m(point, metres);
        }
        height_m
    }

    /// Returns the height in metres of a drumlin at a point of the bent plane, where a share of the cells has one.
    fn drumlin_m(&self, bent: Point, metres: f64, share: f64) -> f64 {
        let [long_m, wide_m] = DRUMLIN_CELL_M;
        let cell = FormCell::of(self.drumlins, bent, [wide_m, long_m].map(|metres_m| (metres_m / metres) as i64));
        // At the edge of a swarm drumlins are lower, and none is cut off.
        let whole = ((share - cell.chance(0)) / 0.15).clamp(0.0, 1.0);
        if whole == 0.0 {
            return 0.0;
        }
        let by_chance = |[least, more]: [f64; 2], part| least + more * cell.chance(part);
        let (half_long_m, half_wide_m) = (by_chance(DRUMLIN_LONG_M, 1), by_chance(DRUMLIN_WIDE_M, 2));
        let aside = |room_m: f64, part| (cell.chance(part) - 0.5) * room_m;
        let along = (cell.off[1] * metres - aside(long_m - 2.0 * half_long_m, 3)) / half_long_m;
        let across = (cell.off[0] * metres - aside(wide_m - 2.0 * half_wide_m, 4)) / half_wide_m;
        let along = if along < 0.0 { along * BLUNT } else { along };
        let left = (1.0 - along * along - across * across).max(0.0);
        whole * by_chance(DRUMLIN_HEIGHT, 5) * half_wide_m * left * left
    }

    /// Returns the height in metres of an esker at a point, which has this place in the bent plane.
    fn esker_m(&self, point: Point, bent: Point, metres: f64) -> f64 {
        let apart = (ESKERS_M / metres) as i64;
        let off_m = (bent.x.rem_euclid(apart) - apart / 2) as f64 * metres;
        let [_, most_m] = ESKER_BENDS_M;
        if off_m.abs() > most_m + ESKER_HALF_M {
            return 0.0;
        }
        let off = (off_m + most_m * self.esker_bends.at(point)) / ESKER_HALF_M;
        let left = (1.0 - off * off).max(0.0);
        if left == 0.0 {
            return 0.0;
        }
        ESKER_HEIGHT_M * left * left * smooth(4.0 * self.esker_stretches.at(point) + 0.5)
    }

    /// Returns the depth in metres of a doline at a point.
    fn doline_m(&self, point: Point, metres: f64) -> f64 {
        let side = (DOLINE_CELL_M / metres) as i64;
        let cell = FormCell::of(self.dolines, point, [side; 2]);
        if cell.chance(0) > DOLINES {
            return 0.0;
        }
        let [least_m, more_m] = DOLINE_RADIUS_M;
        let luck = cell.chance(1);
        let radius_m = least_m + more_m * luck * luck;
        let room_m = DOLINE_CELL_M - 2.0 * radius_m;
        let off =
            [0, 1].map(|axis| (cell.off[axis] * metres - (cell.chance(2 + axis as u64) - 0.5) * room_m) / radius_m);
        let left = (1.0 - off[0] * off[0] - off[1] * off[1]).max(0.0);
        DOLINE_DEPTH * radius_m * left
    }
}

/// Returns the share of whole drumlins and eskers at a place: they stand on low land that an ice sheet has left.
fn ice_forms(setting: &Setting) -> f64 {
    setting.was_under_ice() * setting.land.flatness() * (1.0 - setting.is_under_ice())
}

/// Returns the share of whole dolines at a place: in limestone, where it rains.
fn karst(setting: &Setting) -> f64 {
    let rain = smooth((setting.climate.runoff_m(setting.land.planned_m().max(0.0)) - 0.15) / 0.3);
    let limestone = setting.rock.limestone_share();
    (smooth((limestone - 0.3) / 0.4) * rain * (1.0 - setting.is_under_ice())).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::tests::fields_of_world;
    use crate::land::Water;

    /// Returns the forms on level dry land in metres where their shares are these.
    fn shaped(forms: &GroundForms, area: Area, [ice, karst]: [f32; 2]) -> Vec<f64> {
        let flat = |value: f32| vec![value; area.len()];
        let large = FormsAtLarge { bends_m: [flat(100.0), flat(-50.0)], ice: flat(ice), karst: flat(karst) };
        let height_m =
            |(at, (x, y)): (usize, (i64, i64))| forms.height_m(10.0 / 256.0, &large, at, Point::at_vertex(x, y));
        area.vertices().enumerate().map(height_m).collect()
    }

    #[test]
    fn drumlins_and_eskers_rise_dolines_sink_and_none_is_steeper_than_loose_ground_lies() {
        let forms = GroundForms::new(&fields_of_world(3), 3).expect("a world has forms");
        for from in [0, 1 << 40] {
            let area = Area::new(from, -from, 1500, 1500);
            let (ice, karst) = (shaped(&forms, area, [1.0, 0.0]), shaped(&forms, area, [0.0, 1.0]));
            let share =
                |of: &[f64], is: fn(f64) -> bool| of.iter().filter(|m| is(**m)).count() as f64 / of.len() as f64;
            assert!(ice.iter().all(|m| *m >= 0.0) && (0.02..0.5).contains(&share(&ice, |m| m > 1.0)));
            assert!(karst.iter().all(|m| *m <= 0.0) && (0.02..0.3).contains(&share(&karst, |m| m < -1.0)));
            for heights_m in [ice, karst] {
                let steps = heights_m.windows(2).map(|pair| (pair[1] - pair[0]).abs() / 10.0);
                let steepest = steps.enumerate().filter(|(n, _)| (n + 1) % 1500 != 0).map(|(_, step)| step);
                assert!(steepest.fold(0.0, f64::max) < 0.7);
            }
        }
    }

    #[test]
    fn forms_keep_off_water_and_warm_plains() {
        let fields = fields_of_world(3);
        let forms = GroundForms::new(&fields, 3).expect("a world has forms");
        let area = Area::new(0, 0, 64, 64);
        let nodes_area = area.padded(1).on_grid(8);
        let zeros = || vec![0.0; nodes_area.len()];
        let nodes = Displaced { area: nodes_area, step: 1, metres: [zeros(), zeros()] };
        let segments = Segments { origin: Point::default(), channels: Vec::new(), all: Vec::new() };
        let mut water = Water::none(area);
        water.kind.values_mut().fill(WaterKind::Lake);
        let mut land = Land { heights: crate::grid::Grid::filled(area, 500.0), water: Some(water) };
        forms.shape(&fields, &segments, &nodes, &mut land, &Clock::default()).unwrap();
        assert!(land.heights.values().iter().all(|height_m| *height_m == 500.0));
    }
}
