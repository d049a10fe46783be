//! Lakes: the outlines of their water.

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::fluvial::channel::Knot;
use crate::fluvial::lake::{Hollow, NO_LAKE};
use crate::fluvial::landforms::contour::{contours, twice_area};
use crate::geometry::LineSegment;
use crate::grain_point::{Point, padded};
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::{LakeId, LineId};
use crate::memory::heap_bytes;
use crate::stop::Stopped;

/// Area that no lake exceeds, in squares of the half width of the widest lakes of its level. The largest lakes lie where
/// up to eight trunks end in one sink; such pans of 94 squares were measured in deserts.
pub const LARGEST_LAKE: f64 = 260.0;

/// A lake.
#[derive(Clone, Debug, PartialEq)]
pub struct Lake {
    /// The id of the lake, the same in every area.
    pub id: LakeId,
    /// The shore, anticlockwise in a map, and the shores of islands, clockwise: rings in vertices east and south of the
    /// origin, each ending where it begins.
    pub rings: Vec<Vec<[f64; 2]>>,
    /// Height of the lake's surface in metres.
    pub level_m: f64,
    /// Area of the water in square metres, without islands.
    pub area_m2: f64,
    /// The river that leaves the lake.
    pub outlet: Option<LineId>,
}

heap_bytes!(Lake: rings);

/// Least depth in metres of a lake's vertex, and least height of a vertex on land, so that no crossing lies exactly on
/// a vertex.
const LEAST_M: f32 = 1e-3;

/// Side in vertices of the parts in which the land of a lake is made.
const PART: usize = 512;

/// Depth of vertices outside of lakes.
const NOT_LAKE: f32 = f32::NEG_INFINITY;

/// Greatest number of areas tried, each with twice the pad of the one before, to find the whole shore of a lake.
const MOST_LOOKS: u32 = 4;

impl Lake {
    /// Finds the lake of an id; `None` if no vertex lies in it.
    pub(crate) fn new(fluvial: &Fluvial, id: LakeId, clock: &Clock) -> Result<Option<Lake>, Stopped> {
        let channels = fluvial.lake_channels(id);
        let knots = || channels.iter().flat_map(|channel| &channel.knots).filter(|knot| knot.pool_m > NO_LAKE);
        let deepest = knots().min_by(|a, b| a.level_m.total_cmp(&b.level_m));
        let Some(deepest) = deepest else { return Ok(None) };
        let (middle, level_m) = (fluvial.in_world(deepest.at), fluvial.lifted_m(deepest.pool_m));
        let low = knots().fold(deepest.at, |low, Knot { at, .. }| Point { x: low.x.min(at.x), y: low.y.min(at.y) });
        let high = knots().fold(deepest.at, |high, Knot { at, .. }| Point { x: high.x.max(at.x), y: high.y.max(at.y) });
        let half_width = Hollow::widest(fluvial.fields(), id.0.0);
        // A lake's bays may reach further than the lake is wide.
        let looks = (0..MOST_LOOKS).map(|look| half_width * f64::from(1 << look));
        let mut seen = None;
        for pad in looks {
            let area = fluvial.area_in_world(padded([low, high], pad));
            let Some(depths) = depths(fluvial, area, middle, clock)? else { return Ok(None) };
            let ends = border(area).all(|(x, y)| depths.at(x, y) < 0.0);
            seen = Some(depths);
            if ends {
                break;
            }
        }
        let mut depths = seen.expect("there is a look");
        // If even the largest area does not hold the whole lake, its border cuts the lake off, so that the shore is
        // closed.
        for (x, y) in border(depths.area()) {
            depths.row_mut(y, x, x + 1)[0] = -LEAST_M;
        }
        let mut rings: Vec<Vec<[f64; 2]>> = contours(&depths).into_iter().map(|contour| contour.points).collect();
        // The shore runs in the opposite direction to those of islands.
        let Some(shore) = rings.iter().position(|ring| twice_area(ring) > 0.0) else { return Ok(None) };
        rings.swap(0, shore);
        rings[1..].sort_by(|a, b| a[0].partial_cmp(&b[0]).expect("places are numbers"));
        let spacing_m = fluvial.node_m();
        let area_m2 = rings.iter().fold(0.0, |sum, ring| sum + twice_area(ring) / 2.0) * spacing_m * spacing_m;
        Ok(Some(Lake { id, rings, level_m, area_m2, outlet: fluvial.outlet(id, clock)? }))
    }

    /// Tells whether a part of the lake lies in the rectangle that the outer vertices of an area span.
    pub fn touches(&self, area: &Area) -> bool {
        let corner = [(area.x1 - 1 - area.x0) as f64, (area.y1 - 1 - area.y0) as f64];
        let low = [area.x0 as f64, area.y0 as f64];
        let from = |point: [f64; 2]| [point[0] - low[0], point[1] - low[1]];
        let mut around = false;
        for pair in self.rings.iter().flat_map(|ring| ring.windows(2)) {
            let (a, b) = (from(pair[0]), from(pair[1]));
            if LineSegment::between(a, b).touches_rectangle(corner) {
                return true;
            }
            // The corner is inside if a line from it to the east crosses shores an odd number of times.
            if (a[1] > 0.0) != (b[1] > 0.0) && a[0] + (b[0] - a[0]) * (a[1] / (a[1] - b[1])) > 0.0 {
                around = !around;
            }
        }
        around
    }
}

/// Returns the outermost vertices of an area.
fn border(area: Area) -> impl Iterator<Item = (i64, i64)> {
    area.vertices().filter(move |(x, y)| *x == area.x0 || *y == area.y0 || x + 1 == area.x1 || y + 1 == area.y1)
}

/// Returns the depth in metres of one lake at each vertex of an area, negative outside of it. The lake is the lake
/// vertex nearest to a point, and all that is connected to it. `None` if there is no lake.
fn depths(fluvial: &Fluvial, area: Area, near: Point, clock: &Clock) -> Result<Option<Grid<f32>>, Stopped> {
    // Part by part: to make land takes much more memory than to keep its heights, and lakes are large.
    let (mut heights, mut water_m) = (Grid::filled(area, 0.0), Grid::filled(area, NOT_LAKE));
    for part in area.squares(PART) {
        let land = fluvial.land(part, clock)?;
        let Some(water) = land.water else { return Ok(None) };
        for y in part.y0..part.y1 {
            heights.row_mut(y, part.x0, part.x1).copy_from_slice(land.heights.row(y, part.x0, part.x1));
            let row = water_m.row_mut(y, part.x0, part.x1).iter_mut();
            let lakes = water.kind.row(y, part.x0, part.x1).iter().zip(water.depth_m.row(y, part.x0, part.x1));
            for (own, (kind, depth_m)) in row.zip(lakes) {
                *own = if *kind == WaterKind::Lake { *depth_m } else { NOT_LAKE };
            }
        }
    }
    let is_lake = |(x, y): (i64, i64)| water_m.at(x, y) != NOT_LAKE;
    let distance = |(x, y): (i64, i64)| (fluvial.at_node(x, y).distance(near), x, y);
    let first = area
        .vertices()
        .filter(|at| is_lake(*at))
        .min_by(|a, b| distance(*a).partial_cmp(&distance(*b)).expect("distances are numbers"));
    let Some(first) = first else { return Ok(None) };
    let surface_m = heights.at(first.0, first.1) + water_m.at(first.0, first.1);
    let mut depths = Grid::filled(area, -LEAST_M);
    for (depth_m, height_m) in depths.values_mut().iter_mut().zip(heights.values()) {
        *depth_m = (surface_m - height_m).min(-LEAST_M);
    }
    let mut open = vec![first];
    while let Some((x, y)) = open.pop() {
        let depth_m = &mut depths.row_mut(y, x, x + 1)[0];
        if *depth_m > 0.0 {
            continue;
        }
        *depth_m = water_m.at(x, y).max(LEAST_M);
        let around = [(x, y - 1), (x - 1, y), (x + 1, y), (x, y + 1)];
        open.extend(around.into_iter().filter(|(x, y)| area.has(*x, *y) && is_lake((*x, *y))));
    }
    Ok(Some(depths))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::area::{Area, Stride};
    use crate::fluvial::lake::Hollow;
    use crate::geography::Geography;
    use crate::grain_point::GRAINS;
    use crate::preset::Preset;

    #[test]
    fn closed_basins_of_dry_lands_end_in_salt_pans_with_a_level_floor() {
        let (_, preset) = Preset::load("world").unwrap();
        let geography =
            Geography::new(preset.geography.as_ref().unwrap(), preset.spacing_m / GRAINS as f64, preset.seed);
        let (settings, spacing) = (preset.fluvial.unwrap(), (preset.spacing_m, Stride::ONE));
        let geography = Some(Arc::new(geography));
        let fluvial = Fluvial::new(&settings, geography, spacing, preset.sea_level_m, preset.seed, None);
        let trunks = fluvial.network().trunks();
        let is_pan = |id: &(i64, i64)| trunks.is_pan(*id) && trunks.drained(*id).to.is_none();
        let pans: Vec<(i64, i64)> = Area::new(-330, 100, 200, 80).vertices().filter(is_pan).take(12).collect();
        let mut found = 0;
        for (x, y) in pans {
            let id = LakeId((0, x, y));
            assert!(fluvial.is_pan(id));
            let Some(pan) = Lake::new(&fluvial, id, &Clock::default()).unwrap() else { continue };
            let widest_m = Hollow::widest(fluvial.fields(), 0) * fluvial.fields().metres_a_grain();
            let range = 1e6..LARGEST_LAKE * widest_m * widest_m;
            assert!(pan.outlet.is_none() && range.contains(&pan.area_m2), "{} m2", pan.area_m2);
            let floors = fluvial.lake_channels(id);
            let depths = floors.iter().flat_map(|channel| &channel.knots).map(|knot| knot.pool_m - knot.level_m);
            let deepest_m = depths.fold(0.0, f64::max);
            assert!((0.1..0.5).contains(&deepest_m), "{deepest_m} m");
            found += 1;
        }
        assert!(found > 0, "no closed basin of a desert has a pan");
    }
}
