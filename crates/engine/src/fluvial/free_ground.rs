//! Ground free of rivers and lakes, on which forms may rise that water would wash away.

use super::fields::Fields;
use super::segment::Segments;
use super::warp::Displaced;
use crate::area::Area;
use crate::geometry::{LineSegment, lerp, smooth};
use crate::grain_point::{GRAINS, Point};
use crate::grid::Grid;

/// Distances from rivers and lakes from which on ground is free.
#[derive(Debug)]
pub struct FreeGround {
    /// Metres from the floor of a valley with a river at which forms begin.
    pub off_rivers_m: f64,
    /// Distance from the middle of a lake at which forms begin, in half widths of the largest lakes.
    pub off_lakes: f64,
    /// Metres over which forms reach their height.
    pub rise_m: f64,
}

/// Nodes a side of the squares for which rivers nearby are found together.
const BLOCK: usize = 16;

/// A line that forms keep away from, and the distance in grains at which they begin.
struct KeptOff {
    line: LineSegment,
    from: f64,
}

/// Returns the share of forms that may stand at the nodes of an area, from 0 near rivers and lakes to 1; `None` where
/// there are neither.
pub fn free_ground(
    fields: &Fields,
    segments: &Segments,
    nodes: &Displaced,
    area: Area,
    free: &FreeGround,
) -> Option<Grid<f32>> {
    let metres = fields.metres_a_grain();
    let lakes = free.off_lakes * fields.lake_half_width();
    // Side arms lie on the floors of their rivers. They matter in a smaller part of the land, and so are not always known
    // here.
    let is_whole = |channel: u32| segments.channels[channel as usize].near == f64::INFINITY;
    let kept = segments.all.iter().filter(|segment| is_whole(segment.channel)).filter_map(|segment| {
        let is_lake = segment.pool_m > f64::NEG_INFINITY;
        let is_wet = fields.holds_water(lerp(segment.discharge_m3s, 1.0));
        let floor = segment.widest_trough() + free.off_rivers_m / metres;
        let from = if is_lake { floor.max(lakes) } else { floor };
        (is_lake || is_wet).then(|| KeptOff { line: segment.line(), from })
    });
    let kept: Vec<KeptOff> = kept.collect();
    if kept.is_empty() {
        return None;
    }
    let mut shares = Grid::filled(area, 1.0);
    let rise = free.rise_m / metres;
    let place = |x: i64, y: i64| {
        let displaced = nodes.displacement_m(nodes.area.index(x, y)) / metres;
        Point::at_vertex(x * nodes.step, y * nodes.step).from(segments.origin) + displaced
    };
    for block in area.squares(BLOCK) {
        let middle = place(block.x0, block.y0);
        // The warp moves a node by less than a node more than the one beside it.
        let around = 2.0 * 1.5 * (BLOCK as i64 * nodes.step * GRAINS) as f64;
        let near: Vec<&KeptOff> =
            kept.iter().filter(|kept| kept.line.distance(middle.into()) < kept.from + rise + around).collect();
        if near.is_empty() {
            continue;
        }
        for (x, y) in block.vertices() {
            let at = place(x, y).into();
            let distances = near.iter().map(|kept| (kept.line.distance(at) - kept.from) / rise);
            shares.row_mut(y, x, x + 1)[0] = smooth(distances.fold(1.0, f64::min)) as f32;
        }
    }
    Some(shares)
}
