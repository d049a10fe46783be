//! Landforms: the lakes, coasts and peaks of fluvial land, besides its [rivers](crate::fluvial::rivers).
//!
//! ```text
//! Land around a lake, or of a cell of the world --> contour.rs  lines between vertices
//!                                                       |
//!                                   lakes.rs, coast.rs, peaks.rs: landforms with ids
//! ```
//!
//! A landform is a function of its id: it is whole, and the same in every area. Landforms that have been found are
//! cached.

mod contour;

pub mod coast;
pub mod lakes;
pub mod peaks;

use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::fluvial::Fluvial;
use crate::lines::LakeId;
use crate::memory::{Memory, Remembers};
use crate::stop::Stopped;
use coast::Coast;
use lakes::Lake;
use peaks::{Peak, Rise, Summits};

/// The caches of a world's landforms.
#[derive(Debug)]
pub struct Landforms {
    lakes: Memory<LakeId, Option<Arc<Lake>>>,
    coasts: Memory<(i64, i64), Vec<Arc<Coast>>>,
    summits: Memory<(i64, i64), Summits>,
}

impl Default for Landforms {
    fn default() -> Landforms {
        Landforms { lakes: Memory::new(4 << 20), coasts: Memory::new(4 << 20), summits: Memory::new(8 << 20) }
    }
}

impl Landforms {
    /// Returns these caches.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.lakes, &self.coasts, &self.summits]
    }
}

#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
impl Landforms {
    /// Returns all lakes of which a part lies in an area, whole, sorted by id, of all levels whose widest lakes have at
    /// least this half width in metres.
    pub fn lakes(
        &self,
        fluvial: &Fluvial,
        area: &Area,
        least_half_width_m: f64,
        clock: &Clock,
    ) -> Result<Vec<Arc<Lake>>, Stopped> {
        let mut found = Vec::new();
        for id in fluvial.lake_ids(area, least_half_width_m, clock)? {
            found.extend(self.lake(fluvial, id, clock)?.filter(|lake| lake.touches(area)));
        }
        Ok(found)
    }

    /// Returns the lake of an id, if there is one.
    pub fn lake(&self, fluvial: &Fluvial, id: LakeId, clock: &Clock) -> Result<Option<Arc<Lake>>, Stopped> {
        let lake = self.lakes.try_get(id, || Ok(Lake::new(fluvial, id, clock)?.map(Arc::new)))?;
        Ok(Option::clone(&lake))
    }

    /// Returns all pieces of coast of which a part lies in an area, whole, sorted by id.
    pub fn coasts(&self, fluvial: &Fluvial, area: &Area, clock: &Clock) -> Result<Vec<Arc<Coast>>, Stopped> {
        let mut found: Vec<Arc<Coast>> = Vec::new();
        // A line may run along the edge of the cell before, so pad by one.
        for cell in area.padded(1).square_numbers(coast::CELL).map(|[x, y]| (x, y)) {
            let coasts = || Ok(Coast::of_cell(fluvial, cell, clock)?.into_iter().map(Arc::new).collect());
            let coasts = self.coasts.try_get(cell, coasts)?;
            found.extend(coasts.iter().filter(|coast| coast.touches(area)).cloned());
        }
        found.sort_by_key(|coast| coast.id);
        Ok(found)
    }

    /// Returns all peaks that stand on a vertex of an area, sorted by id.
    pub fn peaks(&self, fluvial: &Fluvial, area: &Area, clock: &Clock) -> Result<Vec<Peak>, Stopped> {
        let inside = |peak: &Peak| area.has(peak.at[0], peak.at[1]);
        let mut found: Vec<Peak> = Vec::new();
        for [x, y] in area.square_numbers(peaks::side(fluvial)) {
            found.extend(self.peak(fluvial, (x, y), clock)?.filter(inside));
        }
        found.sort_by_key(|peak| peak.id);
        Ok(found)
    }

    /// Returns the peak of a cell, if it has one.
    pub fn peak(&self, fluvial: &Fluvial, cell: (i64, i64), clock: &Clock) -> Result<Option<Peak>, Stopped> {
        Ok(self.rise(fluvial, cell, clock)?.peak())
    }

    /// Returns the peak above a vertex: the peak of its cell or, where there is higher ground close by in another cell,
    /// the peak of that cell. `None` where the search finds no peak, or one more than a cell away.
    pub fn peak_above(&self, fluvial: &Fluvial, at: [i64; 2], clock: &Clock) -> Result<Option<Peak>, Stopped> {
        let side = peaks::side(fluvial);
        let mut cell = (at[0].div_euclid(side), at[1].div_euclid(side));
        for _ in 0..peaks::MOST_CELLS {
            match self.rise(fluvial, cell, clock)? {
                Rise::Peak(peak) => {
                    return Ok((0..2).all(|axis| (peak.at[axis] - at[axis]).abs() <= side).then_some(peak));
                }
                Rise::Below(higher) => cell = higher,
                Rise::Low => break,
            }
        }
        Ok(None)
    }

    /// Returns the highest vertex of a cell, and whether it is a peak.
    fn rise(&self, fluvial: &Fluvial, cell: (i64, i64), clock: &Clock) -> Result<Rise, Stopped> {
        Rise::of_cell(fluvial, cell, |cell| self.summits.try_get(cell, || Summits::new(fluvial, cell, clock)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluvial::lake::Hollow;

    #[test]
    fn wide_lakes_are_those_of_the_coarser_levels() {
        let fluvial = Fluvial::of_preset("highlands", 3, |settings| settings.lakes = 1.0);
        let area = Area::new(-1024, -1024, 2048, 2048);
        let found = |least_m| {
            let lakes = Landforms::default().lakes(&fluvial, &area, least_m, &Clock::default()).unwrap();
            lakes.iter().map(|lake| lake.id).collect::<Vec<_>>()
        };
        let all = found(0.0);
        for lake in Landforms::default().lakes(&fluvial, &area, 0.0, &Clock::default()).unwrap() {
            let widest_m = Hollow::widest(fluvial.fields(), lake.id.0.0) * fluvial.fields().metres_a_grain();
            assert!(lake.area_m2 < lakes::LARGEST_LAKE * widest_m * widest_m, "{}: {} m2", lake.id, lake.area_m2);
        }
        for level in 0..4 {
            let widest_m = Hollow::widest(fluvial.fields(), level) * fluvial.fields().metres_a_grain();
            let wide: Vec<LakeId> = all.iter().copied().filter(|lake| lake.0.0 <= level).collect();
            assert_eq!(found(widest_m), wide, "level {level}");
        }
        assert!(all.iter().any(|lake| lake.0.0 > 1) && all.iter().any(|lake| lake.0.0 <= 1), "{all:?}");
    }
}
