//! Finding: searches a world for the things of a query, nearest first.
//!
//! ```text
//! "lake > 2 km2" --> Query --> blocks by distance --> candidates at a coarse stride --> exact check --> Found
//! ```
//!
//! Realms and climates are as large as continents. They are searched on the coarse nodes of the geography, in blocks of
//! its own, and volcanoes by the plan of their places. No land is made for them.
//!
//! The search goes through the world block by block, outwards from a place, until it has found enough. Expensive
//! properties are first looked up in the same world at a coarse stride, and at every vertex only where that shows a
//! candidate.

mod large;
mod name;
mod query;

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::area::{Area, MAX_COORDINATE, Stride};
use crate::clock::Clock;
use crate::error::Error;
use crate::features::landforms::{LAKES, LakeFeature, PEAKS, PeakFeature};
use crate::geometry::length;
use crate::lines::{Line, LineKind, LinePoint};
use crate::memory::Budget;
use crate::places::site::SiteClass;
use crate::preset::Preset;
use crate::stop::Stopped;
use crate::watch::Watch;
use crate::world::World;
pub use name::{REALMS_KM, SETTLEMENTS_KM, THINGS_KM, named, named_in};
pub use query::{Beside, BiomeLetters, Bound, Measure, Query, Sign, Thing};

/// Side of a block in kilometres.
const BLOCK_KM: f64 = 12.0;

/// Memory in bytes for the cache of a finder's own world, shared with its coarse copies.
const REMEMBERED: usize = 384 << 20;

/// Distance in metres within which two things are beside each other.
const BESIDE_M: f64 = 500.0;

/// Largest stride of the coarse world in vertices, and approximate number of nodes across the smallest lake that is
/// searched for.
const COARSEST: u64 = 16;
const LAKE_NODES: f64 = 12.0;

/// Tolerances of the coarse world: a lake shows at least this share of its area, and a peak may appear lower by this
/// share of the world's range of heights.
const LEAST_AREA: f64 = 0.6;
const LOWER: f32 = 0.05;

/// Least width in kilometres of the area to bake around a found thing.
const LEAST_AROUND_KM: f64 = 5.0;

/// A thing that a search has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Identifier, unique in the world.
    pub id: String,
    /// Name on maps; `None` in a world without places.
    pub name: Option<String>,
    /// Position in kilometres east and north of the origin: the middle of the thing, and for a river its nearest point.
    pub at_km: [f64; 2],
    /// Distance in kilometres from the place where the search began.
    pub distance_km: f64,
    /// Side in kilometres of an area that shows the thing with as much land around it.
    pub around_km: f64,
    /// Measures of the thing.
    pub values: Vec<(Measure, f64)>,
}

impl Found {
    /// Describes a thing with the bounding box `low` to `high` in metres east and north, as found from a place in
    /// kilometres.
    fn new(
        id: String,
        name: Option<String>,
        [low, high]: [[f64; 2]; 2],
        near_km: [f64; 2],
        values: Vec<(Measure, f64)>,
    ) -> Found {
        let at_km = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]) / 1000.0);
        let wide_km = (high[0] - low[0]).max(high[1] - low[1]) / 1000.0;
        let around_km = (2.0 * wide_km).max(LEAST_AROUND_KM).ceil();
        let distance_km = length([0, 1].map(|axis| at_km[axis] - near_km[axis]));
        Found { id, name, at_km, distance_km, around_km, values }
    }
}

fn lake_found(lake: LakeFeature, near_km: [f64; 2]) -> Found {
    let values = vec![(Measure::Area, lake.area_m2 / 1e6), (Measure::Height, lake.level_m)];
    Found::new(lake.id, lake.name, middle_of(&lake.rings[0]), near_km, values)
}

fn peak_found(peak: PeakFeature, near_km: [f64; 2]) -> Found {
    Found::new(peak.id, peak.name, [peak.at; 2], near_km, vec![(Measure::Height, f64::from(peak.height_m))])
}

/// Finds the nearest point of a river with at least this discharge, if it has one.
fn river_found(river: &Line, least_m3s: f64, near_km: [f64; 2]) -> Option<Found> {
    let place = |point: &LinePoint| {
        let [x, y] = river.place_from([0, 0], point);
        [x * river.spacing_m, -y * river.spacing_m]
    };
    let off = |at: &[f64; 2]| length([0, 1].map(|axis| at[axis] - 1000.0 * near_km[axis]));
    let large = river.points.iter().filter(|point| point.discharge_m3s >= least_m3s).map(place);
    let at = large.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let discharge_m3s = river.points[river.points.len() - 1].discharge_m3s;
    let values = vec![(Measure::Length, river.length_m() / 1000.0), (Measure::Discharge, discharge_m3s)];
    Some(Found::new(river.id.to_string(), river.name.clone(), [at; 2], near_km, values))
}

/// A world prepared for searches.
#[derive(Debug)]
pub struct Finder {
    world: Arc<World>,
    afar: BTreeMap<Stride, World>,
}

impl Finder {
    /// Creates a finder in the world of a preset.
    ///
    /// # Errors
    /// When a value of the preset is out of its range, or when the relief is noise, in which nothing can be found.
    pub fn new(preset: Preset, seed: Option<u64>) -> Result<Finder, Error> {
        Finder::of_world(Arc::new(World::new(preset, seed)?.within(&Budget::new(REMEMBERED))))
    }

    /// Creates a finder in an existing world.
    ///
    /// # Errors
    /// When the relief is noise, in which nothing can be found.
    pub fn of_world(world: Arc<World>) -> Result<Finder, Error> {
        if world.relief().fluvial().is_none() {
            return Err(Error::Option {
                message: "a world of noise has no lakes, peaks, rivers and places to be found".into(),
                hint: "give a preset of fluvial relief, such as alps".into(),
            });
        }
        Ok(Finder { world, afar: BTreeMap::new() })
    }

    /// Returns the searched world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Finds at most `limit` things within a radius of a place, nearest first. The place is given in kilometres east
    /// and north. `watch` counts the blocks that are searched, of all within the radius.
    ///
    /// # Errors
    /// When the radius reaches beyond the largest coordinates, the world has no geography to find such a thing in, or
    /// the work is stopped.
    pub fn find(
        &mut self,
        query: &Query,
        near_km: [f64; 2],
        radius_km: f64,
        limit: usize,
        watch: &Watch,
    ) -> Result<Vec<Found>, Error> {
        let spacing_km = self.world.spacing_m() / 1000.0;
        let most_km = MAX_COORDINATE as f64 * spacing_km;
        if !near_km.iter().all(|km| km.abs() + radius_km < most_km) {
            return Err(Error::Option {
                message: format!("{radius_km} km around {},{} leave the coordinates", near_km[0], near_km[1]),
                hint: format!("no vertex lies more than {most_km:.0} km from the origin"),
            });
        }
        if query.thing.is_large() {
            return large::find(&self.world, query, (near_km, radius_km), limit, watch);
        }
        let stride = self.stride(query);
        if stride != Stride::ONE && !self.afar.contains_key(&stride) {
            self.afar.insert(stride, self.world.at_stride(stride));
        }
        let afar = self.afar.get(&stride);
        let search = NearestSearch { world: &self.world, afar, query, near_km, clock: &watch.clock };
        // Blocks are a multiple of four times the coarsest stride, so that their quarters consist of whole nodes at
        // every stride.
        let whole = 4 * COARSEST as i64;
        let side = ((BLOCK_KM / spacing_km) as i64).div_euclid(whole).max(1) * whole;
        let block_km = side as f64 * spacing_km;
        nearest(block_km, (near_km, radius_km), limit, watch, |block| search.block(block, side))
    }

    /// Returns the stride of the coarse world in which candidates for a query are searched.
    fn stride(&self, query: &Query) -> Stride {
        let node_m = match query.thing {
            Thing::Lake => (query.least(Measure::Area).unwrap_or(0.0) * 1e6).sqrt() / LAKE_NODES,
            Thing::Peak => f64::INFINITY,
            Thing::River | Thing::Site(_) | Thing::Realm(_) | Thing::Biome(_) | Thing::Volcano => 0.0,
        };
        let vertices = (node_m / self.world.spacing_m()).min(COARSEST as f64).max(1.0) as u64;
        Stride::new(1 << vertices.ilog2()).expect("a power of two that is no more than the coarsest")
    }
}

/// Finds at most `limit` things within a radius of a place, nearest first, by searching block after block.
///
/// `search` returns the things of a block, by its column and row east and north of the origin. Each thing lies in a
/// block in which `search` finds it.
fn nearest(
    block_km: f64,
    (near_km, radius_km): ([f64; 2], f64),
    limit: usize,
    watch: &Watch,
    search: impl Fn([i64; 2]) -> Result<Vec<Found>, Stopped> + Sync,
) -> Result<Vec<Found>, Error> {
    let first = near_km.map(|km| ((km - radius_km) / block_km).floor() as i64);
    let last = near_km.map(|km| ((km + radius_km) / block_km).floor() as i64);
    let mut found: BTreeMap<String, Found> = BTreeMap::new();
    let count = [0, 1].map(|axis| (last[axis] - first[axis] + 1) as u64);
    watch.begin("searching", Some((count[0].saturating_mul(count[1]), "blocks at most")));
    // Goes through rings of blocks, each farther out than the last, because all blocks at once may not fit into memory.
    let middle = near_km.map(|km| (km / block_km).floor() as i64);
    for ring in 0..count[0].max(count[1]) as i64 {
        let mut blocks: Vec<[i64; 2]> = Vec::new();
        for y in middle[1] - ring..=middle[1] + ring {
            let is_end = (y - middle[1]).abs() == ring;
            let columns = middle[0] - ring..=middle[0] + ring;
            blocks.extend(columns.filter(|x| is_end || (x - middle[0]).abs() == ring).map(|x| [x, y]));
        }
        let all = blocks.len();
        blocks.retain(|block| off_km(*block, block_km, near_km) <= radius_km);
        watch.add((all - blocks.len()) as u64);
        if blocks.is_empty() {
            break;
        }
        let here = |block: &[i64; 2]| {
            let found = search(*block);
            watch.add(1);
            found
        };
        let all = blocks.par_iter().map(here).collect::<Result<Vec<Vec<Found>>, Stopped>>()?;
        let near = all.into_iter().flatten().filter(|found| found.distance_km <= radius_km);
        found.extend(near.map(|found| (found.id.clone(), found)));
        // Nothing outside the rings searched so far is nearer than this.
        let sure_km = ring as f64 * block_km;
        if found.values().filter(|found| found.distance_km <= sure_km).count() >= limit {
            break;
        }
    }
    let mut found: Vec<Found> = found.into_values().collect();
    found.sort_by(|a, b| a.distance_km.total_cmp(&b.distance_km).then_with(|| a.id.cmp(&b.id)));
    found.truncate(limit);
    Ok(found)
}

/// Returns the distance in kilometres from a place to the nearest point of a block.
fn off_km(block: [i64; 2], block_km: f64, near_km: [f64; 2]) -> f64 {
    length([0, 1].map(|axis| {
        let low = block[axis] as f64 * block_km;
        (low - near_km[axis]).max(near_km[axis] - low - block_km).max(0.0)
    }))
}

/// A search for one thing.
struct NearestSearch<'a> {
    world: &'a World,
    afar: Option<&'a World>,
    query: &'a Query,
    near_km: [f64; 2],
    clock: &'a Clock,
}

impl NearestSearch<'_> {
    /// Finds the things that lie in a block or reach into it.
    fn block(&self, [x, y]: [i64; 2], side: i64) -> Result<Vec<Found>, Stopped> {
        // Rows of vertices count southwards.
        let area = Area::new(x * side, -(y + 1) * side, side as usize, side as usize);
        let found = match self.query.thing {
            Thing::Lake => self.lakes(area)?,
            Thing::Peak => self.peaks(area)?,
            Thing::River => self.rivers(area)?,
            Thing::Site(class) => self.sites(area, class)?,
            Thing::Realm(_) | Thing::Biome(_) | Thing::Volcano => Vec::new(),
        };
        let mut asked = Vec::new();
        for found in found {
            if self.is_asked_for(&found)? {
                asked.push(found);
            }
        }
        Ok(asked)
    }

    fn lakes(&self, area: Area) -> Result<Vec<Found>, Stopped> {
        let least_m2 = self.query.least(Measure::Area).unwrap_or(0.0) * 1e6;
        let seen = match self.afar {
            None => vec![area],
            Some(afar) => {
                let stride = afar.stride().vertices();
                let large = afar.lakes(&in_nodes(area, stride), self.clock)?;
                let large = large.iter().filter(|lake| lake.area_m2 >= LEAST_AREA * least_m2);
                // Only the surroundings of one shore point are searched at full resolution: the lake lies there or very
                // near.
                let shore = large.map(|lake| lake.rings[0][0].map(|at| at as i64 * stride));
                shore.map(|[x, y]| Area::new(x, y, 1, 1).padded(2 * stride as usize)).collect()
            }
        };
        let mut lakes = Vec::new();
        for area in &seen {
            lakes.extend(LAKES.find(self.world, area, self.clock)?);
        }
        Ok(lakes.into_iter().map(|lake| lake_found(lake, self.near_km)).collect())
    }

    fn peaks(&self, area: Area) -> Result<Vec<Found>, Stopped> {
        let least_m = self.query.least(Measure::Height).unwrap_or(f64::NEG_INFINITY) as f32;
        let parts = area.halves().into_iter().flat_map(Area::halves).flat_map(Area::halves).flat_map(Area::halves);
        let may_have = |part: &Area| {
            let Some(afar) = self.afar else { return Ok(true) };
            let (low_m, high_m) = afar.height_range_m();
            let land = afar.relief().land(in_nodes(*part, afar.stride().vertices()), self.clock)?;
            Ok(land.heights.values().iter().any(|height_m| *height_m > least_m - LOWER * (high_m - low_m)))
        };
        let mut peaks = Vec::new();
        for part in parts {
            if may_have(&part)? {
                peaks.extend(PEAKS.find(self.world, &part, self.clock)?);
            }
        }
        Ok(peaks.into_iter().map(|peak| peak_found(peak, self.near_km)).collect())
    }

    fn rivers(&self, area: Area) -> Result<Vec<Found>, Stopped> {
        let least_m3s = self.query.least(Measure::Discharge).unwrap_or(0.0);
        let rivers = self.world.lines_through(LineKind::River, &area, self.clock)?;
        Ok(rivers.iter().filter_map(|river| river_found(river, least_m3s, self.near_km)).collect())
    }

    fn sites(&self, area: Area, class: Option<SiteClass>) -> Result<Vec<Found>, Stopped> {
        let sites = self.world.sites(&area, self.clock)?;
        let asked = sites.iter().filter(|site| class.is_none_or(|class| class == site.class));
        let found = asked.map(|site| {
            let spacing_m = self.world.spacing_m();
            let at = [site.at[0] as f64 * spacing_m, -site.at[1] as f64 * spacing_m];
            let values =
                vec![(Measure::Population, f64::from(site.population)), (Measure::Height, f64::from(site.height_m))];
            Found::new(site.id.to_string(), Some(site.name.clone()), [at; 2], self.near_km, values)
        });
        Ok(found.collect())
    }

    /// True if a found thing fulfils the query.
    fn is_asked_for(&self, found: &Found) -> Result<bool, Stopped> {
        let at_m = found.at_km.map(|km| km * 1000.0);
        match self.query.beside.filter(|_| self.query.keeps(&found.values)) {
            Some(beside) => self.is_beside(beside, at_m),
            None => Ok(self.query.keeps(&found.values)),
        }
    }

    /// True if a thing of the kind `beside` lies near a place in metres east and north.
    fn is_beside(&self, beside: Beside, at: [f64; 2]) -> Result<bool, Stopped> {
        let spacing_m = self.world.spacing_m();
        let [x, y] = [at[0], -at[1]].map(|m| (m / spacing_m).round() as i64);
        let area = Area::new(x, y, 1, 1).padded((BESIDE_M / spacing_m).ceil() as usize);
        Ok(match beside {
            Beside::River => !self.world.lines_through(LineKind::River, &area, self.clock)?.is_empty(),
            Beside::Lake => !self.world.lakes(&area, self.clock)?.is_empty(),
            Beside::Sea => !self.world.coasts(&area, self.clock)?.is_empty(),
        })
    }
}

/// Converts an area of vertices, whose corners are nodes of the stride, to an area of nodes.
fn in_nodes(area: Area, stride: i64) -> Area {
    let Area { x0, y0, x1, y1 } = area;
    Area { x0: x0 / stride, y0: y0 / stride, x1: x1 / stride, y1: y1 / stride }
}

/// Returns the corners of the bounding box of some places.
fn middle_of(places: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let fold = |start: f64, pick: fn(f64, f64) -> f64| {
        [0, 1].map(|axis| places.iter().map(|place| place[axis]).fold(start, pick))
    };
    [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
}
