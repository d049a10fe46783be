//! Landforms: the lakes, coasts and peaks of fluvial land, besides its [rivers](crate::fluvial::rivers).
//!
//! ```text
//! Land of a lake's surroundings, of a cell of the world --> contour.rs  lines between vertices
//!                                                              |
//!                                          lakes.rs, coast.rs, peaks.rs: landforms with ids
//! ```
//!
//! A landform is a function of its id: it is whole and the same whichever area asks for it. What has been found is
//! remembered for a while.

mod contour;

pub mod coast;
pub mod lakes;
pub mod peaks;

use std::sync::Arc;

use crate::area::Area;
use crate::fluvial::Fluvial;
use crate::lines::LakeId;
use crate::memory::{Memory, Usage};
use coast::Coast;
use lakes::Lake;
use peaks::{Peak, Summits};

/// The landforms of a world that have been found, remembered for a while.
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
    /// How full its memories are.
    pub(crate) fn usages(&self) -> Vec<Usage> {
        vec![self.lakes.usage(), self.coasts.usage(), self.summits.usage()]
    }
}

/// The cells of a lattice, `side` vertices apart, that hold vertices of an area padded by `pad`.
fn cells(area: &Area, side: i64, pad: i64) -> impl Iterator<Item = (i64, i64)> + use<> {
    let span = |from: i64, to: i64| (from - pad).div_euclid(side)..=(to - 1 + pad).div_euclid(side);
    let columns = span(area.x0, area.x1);
    span(area.y0, area.y1).flat_map(move |y| columns.clone().map(move |x| (x, y)))
}

impl Landforms {
    /// All lakes of which a part lies in an area, whole, sorted by id.
    pub fn lakes(&self, fluvial: &Fluvial, area: &Area) -> Vec<Arc<Lake>> {
        let lake = |id| Option::clone(&self.lakes.get(id, || Lake::new(fluvial, id).map(Arc::new)));
        fluvial.lake_ids(area).into_iter().filter_map(lake).filter(|lake| lake.touches(area)).collect()
    }

    /// All pieces of coast of which a part lies in an area, whole, sorted by id.
    pub fn coasts(&self, fluvial: &Fluvial, area: &Area) -> Vec<Arc<Coast>> {
        let mut found: Vec<Arc<Coast>> = Vec::new();
        // A line may run along the edge of the cell before.
        for cell in cells(area, coast::CELL, 1) {
            let coasts = self.coasts.get(cell, || Coast::of_cell(fluvial, cell).into_iter().map(Arc::new).collect());
            found.extend(coasts.iter().filter(|coast| coast.touches(area)).cloned());
        }
        found.sort_by_key(|coast| coast.id);
        found
    }

    /// All peaks that stand on a vertex of an area, sorted by id.
    pub fn peaks(&self, fluvial: &Fluvial, area: &Area) -> Vec<Peak> {
        let side = peaks::side(fluvial);
        let summits = |cell| self.summits.get(cell, || Summits::new(fluvial, cell));
        let inside = |peak: &Peak| area.contains(&Area::new(peak.at[0], peak.at[1], 1, 1));
        let mut found: Vec<Peak> =
            cells(area, side, 0).filter_map(|cell| Peak::of_cell(fluvial, cell, summits)).filter(inside).collect();
        found.sort_by_key(|peak| peak.id);
        found
    }
}
