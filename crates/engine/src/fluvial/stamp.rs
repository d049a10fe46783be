//! Stamps: landforms that raise the land around a fixed point of a channel, by a function of the offset from that
//! point.
//!
//! The point is a point of the network, so the stamp is the same in every area that knows the channel. Its reach is so
//! short that every area within the reach does know the channel.

use glam::DVec2;

use super::fields::Fields;
use super::valley;
use super::warp::Displaced;
use crate::clock::Clock;
use crate::grain_point::{GRAINS, Point};
use crate::stop::Stopped;

/// Vertices a side of a block. Stamps are looked up once for each block.
const BLOCK: usize = 16;

/// A landform stamped on the land.
pub trait Stamp {
    /// Returns the stamp's fixed point, and the distance in metres beyond which the stamp changes nothing.
    fn reach(&self) -> (Point, f64);
}

/// Distance in metres from a place of a level's channel within which every vertex knows the channel.
pub fn known_m(fields: &Fields, level: u32) -> f64 {
    valley::reach(fields, fields.levels()).of(fields.side(level) as f64) * fields.metres_a_grain()
}

/// Calls `take` with each node that stamps may reach: its index, its vertex, and these stamps.
pub fn nodes_of<T: Stamp>(
    (fields, clock): (&Fields, &Clock),
    stamps: &[T],
    nodes: &Displaced,
    mut take: impl FnMut(usize, Point, &[&T]),
) -> Result<(), Stopped> {
    let (area, metres) = (nodes.area, fields.metres_a_grain());
    let node_m = (nodes.step * GRAINS) as f64 * metres;
    for block in area.squares(BLOCK).filter(|_| !stamps.is_empty()) {
        clock.check()?;
        let [least, greatest] = nodes.extremes(block);
        let across_m = [block.width(), block.height()].map(|nodes| (nodes - 1) as f64 * node_m);
        let corner = Point::at_vertex(block.x0 * nodes.step, block.y0 * nodes.step);
        let reaches = |stamp: &&T| {
            let (at, reach_m) = stamp.reach();
            let at = at.from(corner) * metres;
            // One metre more allows for rounding: this only selects stamps for an exact test.
            let most_m = reach_m + 1.0;
            [0, 1].into_iter().all(|axis| {
                at[axis] + most_m >= f64::from(least[axis])
                    && at[axis] - most_m <= across_m[axis] + f64::from(greatest[axis])
            })
        };
        let near: Vec<&T> = stamps.iter().filter(reaches).collect();
        for (x, y) in block.vertices().filter(|_| !near.is_empty()) {
            take(area.index(x, y), Point::at_vertex(x * nodes.step, y * nodes.step), &near);
        }
    }
    Ok(())
}

/// Returns the metres east and south from a point to a node, given by its index and vertex.
pub fn off_m(fields: &Fields, nodes: &Displaced, index: usize, vertex: Point, from: Point) -> DVec2 {
    // The difference is exact whatever the origin, except for the last sum, so all windows find the same offset.
    vertex.from(from) * fields.metres_a_grain() + nodes.displacement_m(index)
}
