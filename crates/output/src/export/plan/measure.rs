//! The heights of a region, measured before it is baked.

use rayon::prelude::*;

use crate::area::{Place, Region};
use crate::error::Error;
use crate::tile::Tile;
use crate::watch::Watch;
use crate::world::World;

/// Returns the range of a region's heights, in whole metres. Makes every tile to measure it, on the threads of the
/// current rayon pool.
///
/// # Errors
/// When the work is stopped.
pub fn measured_range_m(world: &World, region: &Region, watch: &Watch) -> Result<[f32; 2], Error> {
    watch.begin("measuring heights", Some((region.tiles(), "tiles")));
    let of_tile = |index: u64| {
        let place = Place { row: index / region.cols(), col: index % region.cols() };
        let tile = Tile::timed(world, region.tile(place), &watch.clock)?;
        let area = tile.area();
        let heights = (area.y0..area.y1).flat_map(|y| tile.heights().row(y, area.x0, area.x1));
        let range = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[min, max], &m| [m.min(min), m.max(max)]);
        watch.add(1);
        Ok(range)
    };
    let both = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let nothing = || [f32::INFINITY, f32::NEG_INFINITY];
    let ranges = (0..region.tiles()).into_par_iter().map(of_tile);
    let [min_m, max_m] = ranges.try_reduce(nothing, |a, b| Ok::<_, Error>(both(a, b)))?;
    // A flat region needs a range too: make it at least one metre.
    Ok([min_m.floor(), max_m.ceil().max(min_m.floor() + 1.0)])
}
