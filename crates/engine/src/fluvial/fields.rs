//! The fields of a fluvial world, which vary slowly: where its water flows at large, how fast the land rises, where the
//! sea is.
//!
//! To judge the numbers chosen by eye, look at hillshades: bare hillsides in `alps`, terraces in `plains`, beds beside
//! the coast in `archipelago`.

use std::sync::Arc;

use glam::DVec2;

use super::laws::{LawSource, Laws};
use super::potential::{Potential, PotentialAtLarge};
use super::settings::{CoastSettings, FluvialSettings};
use super::volcanoes::Volcanoes;
use crate::geography::Geography;
use crate::geography::rock::Rocks;
use crate::geometry::{bilinear, length, smooth};
use crate::grain_point::{AROUND, GRAINS, Point};
use crate::hash::{self, Stream};
use crate::lines::ChannelId;
use crate::memory::{Memory, Remembers};
use crate::noise::point_noise::{PointField, PointNoise};

pub(super) const SECONDS_A_YEAR: f64 = 31_556_952.0;

/// The slowly varying fields, and the laws that derive slopes and widths from them.
#[derive(Debug)]
pub struct Fields {
    settings: FluvialSettings,
    metres_a_grain: f64,
    /// Grains between channels of the finest level.
    finest: i64,
    potential: Potential,
    /// The source of the laws of each place.
    pub(super) law_source: LawSource,
    /// The laws, as far as they are the same everywhere.
    pub(super) everywhere: Laws,
    /// The least and the greatest value of each law over all places.
    bounds: [Laws; 2],
    flood_plain: PointNoise,
    sea: Option<Sea>,
    base_m: f64,
    /// The volcanoes of a world with a geography.
    pub(super) volcanoes: Option<Volcanoes>,
}

#[derive(Debug)]
struct Sea {
    level_m: f64,
    /// Metres from the lowstand's shore, about, for each unit of the potential.
    metres_a_unit: f64,
    /// Metres inland at points of the rasters' lattice, in patches: rasters and channels ask for each point many times.
    lattice_m: Memory<LatticePatch, Vec<f64>>,
}

/// Column and row of a patch of the lattice from which rasters get the shore, and the patch's side in points.
type LatticePatch = (i64, i64);
const PATCH: i64 = 8;

/// The straight way from a point on land to another.
pub struct DryWay {
    /// The share of the way at which it comes to the sea, if it does.
    pub sea_at: Option<f64>,
    /// The least potential at places of the way up to there, both ends left out.
    pub least: f64,
}

/// Distance in vertices between the places at which rasters know the lowstand's shore: the potential varies over
/// kilometres, and computing it at each vertex would cost more than all else.
pub const COAST_STEP: i64 = 16;

/// Largest length of a tributary in cells, before it wanders. A head that is further from all channels has no
/// tributary, so that a tributary depends only on channels nearby. Chosen by eye: with two cells mountainsides stay
/// bare, and three show no more.
const JOIN_CELLS: f64 = 2.5;

/// Distance in vertices that a brook runs on into the sea where there is room: near the shore its bed is deeper than
/// the sea's floor.
pub const INTO_SEA: f64 = 6.0;

/// Number of times that the sixteenth of a way with the shore in it is halved, which finds the shore to a grain or
/// less.
pub const SHORE_HALVINGS: u32 = 20;

/// Number of these halvings where only whole ways matter: the shore is then found to a hundredth part of the way.
pub const FEW_SHORE_HALVINGS: u32 = 3;

/// Height of a lake without outlet as a share of the planned height of the land: lower, since it is a hollow.
const BASIN_DEPTH: f64 = 0.5;

/// Size of the longest bends of a continent's shores, as a share of a plate's side; and metres from a shore by which the
/// `continent` of a place grows by 1, on the mean, as a share of the distance between continents.
const BENT_COAST: f64 = 0.16;
const CONTINENT_SLOPE: f64 = 0.05;

/// Width of the shelf around a continent, and of the slope beyond it, in metres; and the metres by which the floor of an
/// ocean lies below the shelf.
///
/// Based on: P. T. Harris et al., Geomorphology of the oceans, 2014 (shelves are 70 km wide on the mean).
const SHELF_M: f32 = 70e3;
const CONTINENTAL_SLOPE_M: f32 = 200e3;
const DEEPEST_OCEAN_M: f32 = 4200.0;

/// Runoff in metres a year below which a basin in a whole world has no outlet: the rain of a steppe leaves about as much.
const CLOSED_RUNOFF_M: f64 = 0.03;

/// Mean runoff of Earth's land in metres a year.
///
/// Source: B. M. Fekete, C. J. Vorosmarty and W. Grabs, High-resolution fields of global runoff, 2002.
const EARTHS_RUNOFF_M: f64 = 0.3;

/// Largest height of a bed as a share of the rise of the land's edge, so that the bed lies in a valley. Chosen by eye.
const COAST_INCISION: f64 = 0.7;

/// Upper limit of half the width of a valley's floor, as a share of a trunk cell's side: two floors side by side leave
/// room for a ridge.
pub(super) const WIDEST_TROUGH: f64 = 0.15;

/// Half width by which glaciers widen a floor, as a share of the distance between valleys of its level; and the largest
/// distance that counts, as a multiple of that of the finest level. Cirques are half a kilometre wide, as those of the
/// Alps.
const ICE_WIDTH: f64 = 0.12;
const WIDEST_ICE: i64 = 6;

/// Share of a floor that is flood plain, where terraces rise from it: its mean, and the factor of the noise that is
/// added; and the wavelength of the noise, as a share of the distance between trunks. Chosen by eye.
const FLOOD_PLAIN: (f64, f64) = (0.5, 1.2);
const FLOOD_PLAIN_WAVE: f64 = 0.2;

/// Depth in metres that no river exceeds: about as deep as the lower Amazon.
pub const DEEPEST_RIVER_M: f32 = 40.0;

/// Least slope across a channel, as a share of the hillside's: there the bed is as steep along the channel.
const LEAST_CROSS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Largest slope of the land from a channel down to a smaller bed beside it, as a share of the hillside's slope. It is
/// less than that of any valley's side, so no channel loses its water to a smaller one. Chosen by eye.
pub const BESIDE: f64 = 0.64;

/// Returns the area at the mouth of a tributary of a level, in cells of the trunk lattice.
pub fn most_area(level: u32) -> f64 {
    0.25f64.powi(level as i32)
}

/// Returns the slope across a channel, given that of its bed, both as shares of the hillside's slope, which they make
/// together.
///
/// The result is never less than the bed's slope: the sides of a bed further down would rise less than the bed does,
/// and undercut it.
pub fn across(bed: f64) -> f64 {
    (1.0 - bed * bed).max(0.0).sqrt().max(bed)
}

/// Share of the depth of drowned valleys that is left open, from one level to the next. It makes coasts as winding as
/// real ones: 2 km of a real coastline are 1.2 to 1.5 times as long as their chord.
const LEFT_OPEN: f64 = 0.25;

/// Least height of lakes above the sea in metres: more than a lake's shores rise above the valley that goes on from the
/// lake. Chosen by eye.
const LEAST_LAKE_M: f64 = 1.0;

/// Factor by which the land's edge is steeper than the slope that beds keep below. So the valleys shape the land down
/// to the lowstand's shore, and the strip that the coast shapes is too narrow to have hollows of its own. Chosen by
/// eye.
const EDGE_STEEPER: f32 = 6.0;

/// Returns the metres that the edge of the land rises where it would rise `rise_m` if it did not grow steeper.
fn edge_rise_m(rise_m: f32) -> f32 {
    // Steeper and steeper, so that the edge ends where the land is as high: where it would be 100 m high it is 200 m.
    rise_m * (1.0 + rise_m / 100.0)
}

impl Fields {
    /// Creates the fields of settings that have been checked.
    pub fn new(
        settings: &FluvialSettings,
        geography: Option<Arc<Geography>>,
        spacing_m: f64,
        sea_level_m: Option<f64>,
        seed: u64,
    ) -> Fields {
        let metres_a_grain = spacing_m / GRAINS as f64;
        let finest_vertices = (settings.trunk_m / spacing_m / (1u64 << settings.levels) as f64).round().max(1.0);
        let basin_m = match &geography {
            Some(geography) => BENT_COAST * geography.settings().plate_km * 1000.0,
            None => settings.basin_m.unwrap_or(5.0 * settings.trunk_m),
        };
        let noise = |wavelength_m: f64, octaves, stream: Stream| {
            PointNoise::new((wavelength_m / metres_a_grain).round() as i64, octaves, hash::stream(seed, stream))
        };
        let mask = &settings.uplift.mask;
        let potential = match sea_level_m {
            Some(_) => {
                let at_large = match &geography {
                    Some(geography) => PotentialAtLarge::Continents(Arc::clone(geography)),
                    None => PotentialAtLarge::Noise(noise(basin_m, settings.coast.octaves, Stream::Potential)),
                };
                Potential::with_shores(at_large, [basin_m, COAST_STEP as f64 * spacing_m, metres_a_grain], noise)
            }
            None => Potential::smooth(noise(basin_m, 2, Stream::Potential)),
        };
        let datum_m = sea_level_m.unwrap_or(0.0);
        let everywhere = Laws::everywhere(settings, datum_m);
        Fields {
            settings: settings.clone(),
            metres_a_grain,
            finest: finest_vertices as i64 * GRAINS,
            potential,
            law_source: if let Some(geography) = &geography {
                LawSource::Geography(Arc::clone(geography))
            } else {
                let rocks =
                    settings.rock.as_ref().map(|rock| Box::new((Rocks::new(metres_a_grain, seed), rock.at_large())));
                LawSource::Uplift(noise(mask.wavelength_m, mask.octaves, Stream::Uplift), rocks)
            },
            bounds: Laws::bounds(settings, everywhere, datum_m, geography.is_some()),
            everywhere,
            flood_plain: noise(FLOOD_PLAIN_WAVE * settings.trunk_m, 2, Stream::FloodPlain),
            sea: sea_level_m.map(|level_m| Sea {
                level_m,
                metres_a_unit: match &geography {
                    Some(geography) => CONTINENT_SLOPE * geography.settings().continent_km * 1000.0,
                    None => basin_m / 2.0,
                },
                lattice_m: Memory::new(8 << 20),
            }),
            base_m: match sea_level_m {
                Some(level_m) => level_m + settings.base_m.max(LEAST_LAKE_M),
                None => settings.base_m,
            },
            volcanoes: geography.as_ref().map(|_| Volcanoes::new(seed)),
        }
    }

    /// Returns the recipe.
    pub fn settings(&self) -> &FluvialSettings {
        &self.settings
    }

    /// Returns the caches.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        let geography = self.geography().into_iter().flat_map(|geography| geography.memories());
        let volcanoes = self.volcanoes.iter().flat_map(Volcanoes::memories);
        geography.chain(volcanoes).chain(self.sea.iter().map(|sea| &sea.lattice_m as &dyn Remembers)).collect()
    }

    /// Returns the metres a grain.
    pub fn metres_a_grain(&self) -> f64 {
        self.metres_a_grain
    }

    /// Returns the distance in metres between vertices.
    pub fn spacing_m(&self) -> f64 {
        self.metres_a_grain * GRAINS as f64
    }

    /// Returns the side in grains of a cell of a level's lattice; level 0 has the trunks.
    pub fn side(&self, level: u32) -> i64 {
        self.finest << (self.settings.levels - level)
    }

    /// Returns the cells of a level's lattice that touch a rectangle, row by row, as the ids of the channels whose
    /// heads they hold.
    pub fn cells(&self, level: u32, [low, high]: [Point; 2]) -> impl Iterator<Item = ChannelId> + use<> {
        let side = self.side(level);
        let columns = low.x.div_euclid(side)..=high.x.div_euclid(side);
        let rows = low.y.div_euclid(side)..=high.y.div_euclid(side);
        rows.flat_map(move |y| columns.clone().map(move |x| (level, x, y)))
    }

    /// Returns the number of levels, trunks among them.
    pub fn levels(&self) -> u32 {
        self.settings.levels + 1
    }

    /// Returns the number of straight segments of a channel of a level, each about as long as the finest level's cells.
    pub fn segments_a_channel(&self, level: u32) -> usize {
        1 << (self.levels() - 1 - level).max(2)
    }

    /// Returns the largest length in grains of the straight course of a tributary of a level.
    pub fn longest_tributary(&self, level: u32) -> f64 {
        JOIN_CELLS * self.side(level) as f64
    }

    /// Returns the largest length in grains of a straight segment of a channel of a level.
    pub fn longest_segment(&self, level: u32) -> f64 {
        let (cell, segments) = (self.side(level) as f64, self.segments_a_channel(level) as f64);
        match level {
            // Trunks turn little from one of their places to the next.
            0 => 8.0 * cell / segments,
            // Each halving of a course moves its middle aside by half a stretch at most, and all these moves add up.
            // Tributaries that come to the sea run straight on.
            _ => (self.longest_tributary(level) * length([1.0, f64::from(self.segments_a_channel(level).ilog2())])
                / segments)
                .max((INTO_SEA + 1.0) * GRAINS as f64),
        }
    }

    /// Returns the potential at a point, -1 to 1. Water flows from high potential to low.
    pub fn potential(&self, at: Point) -> f64 {
        self.potential.at(at)
    }

    /// Returns the potential at any number of points, for callers that know all points beforehand.
    pub fn potentials(&self, points: &[Point]) -> Vec<f64> {
        self.potential.at_all(points)
    }

    /// Returns the potential below which a place lay in the sea at its lowstand.
    pub fn sea_potential(&self) -> f64 {
        if self.sea.is_some() { self.settings.coast.below } else { f64::NEG_INFINITY }
    }

    /// Tells whether there are continents, whose potential has hollows of all sizes. Closed basins then spill until none
    /// is left that could, and trunks wander from node to node.
    pub fn has_continents(&self) -> bool {
        self.geography().is_some()
    }

    /// Tells whether it is so dry at a point that the water of a closed basin does not rise to its rim.
    pub fn keeps_water(&self, at: Point) -> bool {
        self.geography().is_some() && self.laws(at).runoff_m < CLOSED_RUNOFF_M
    }

    /// Tells whether there is a sea.
    pub fn has_sea(&self) -> bool {
        self.sea.is_some()
    }

    /// Returns the height of the sea; without one, negative infinity.
    pub fn sea_level_m(&self) -> f64 {
        self.sea.as_ref().map_or(f64::NEG_INFINITY, |sea| sea.level_m)
    }

    /// Returns the runoff in metres a year that is usual in the world: the same everywhere, or the mean of Earth's land.
    pub fn usual_runoff_m(&self) -> f64 {
        if self.has_continents() { EARTHS_RUNOFF_M } else { self.everywhere.runoff_m }
    }

    /// Returns the height from which the heights of settings count: that of the sea, or 0 without one.
    pub fn datum_m(&self) -> f64 {
        self.sea.as_ref().map_or(0.0, |sea| sea.level_m)
    }

    /// Returns the height of the sea at its lowstand, to which rivers cut their valleys; without a sea, negative
    /// infinity.
    pub fn lowstand_level_m(&self) -> f64 {
        self.sea_level_m() - self.settings.coast.lowstand_m
    }

    /// Returns the least height of a lake: so high above the sea that the sea comes into no lake, as floors fall a
    /// little.
    pub fn lowest_lake_m(&self) -> f64 {
        self.sea_level_m() + LEAST_LAKE_M
    }

    /// Returns the height to which the mouths of a level's valleys are filled with what the sea and their streams have
    /// left there since the lowstand.
    pub fn filled_m(&self, level: u32) -> f64 {
        self.sea_level_m() - self.settings.coast.lowstand_m * LEFT_OPEN.powi(level as i32)
    }

    /// Returns the level of the water at a sink. In a whole world, a lake without outlet lies as high as the country
    /// around it.
    pub fn sink_level_m(&self, in_sea: bool, at: Point) -> f64 {
        match self.geography() {
            _ if in_sea => self.lowstand_level_m(),
            Some(geography) => {
                let planned_m = geography.land_at_large(&[at])[0].planned_m();
                self.base_m + BASIN_DEPTH * planned_m.max(0.0)
            }
            None => self.base_m,
        }
    }

    /// Returns the least level of a lake without outlet.
    pub fn base_m(&self) -> f64 {
        self.base_m
    }

    /// Returns the geography of a whole world; none where the settings hold everywhere.
    pub fn geography(&self) -> Option<&Arc<Geography>> {
        match &self.law_source {
            LawSource::Geography(geography) => Some(geography),
            LawSource::Uplift(..) => None,
        }
    }

    /// Returns the least value of each law over all places.
    pub fn least_laws(&self) -> &Laws {
        &self.bounds[0]
    }

    /// Returns the greatest value of each law over all places.
    pub fn most_laws(&self) -> &Laws {
        &self.bounds[1]
    }

    /// Returns the least slope across a channel that follows the law of rivers, as a share of the hillside's, over all
    /// places.
    pub fn least_cross(&self) -> f64 {
        across(self.most_laws().channel_slope.min(LEAST_CROSS))
    }

    /// Returns the half width in grains that no floor of a level exceeds, over all places.
    pub fn widest_trough(&self, level: u32) -> f64 {
        match level {
            0 => self.widest_water_trough(),
            _ => Laws { ice_m: self.least_laws().ice_m, ..*self.most_laws() }.widest_trough(self, level),
        }
    }

    /// Returns the largest half width in grains by which glaciers widen the floors of a level. Trunks have none, as
    /// their width follows from the area that drains there, nor have the finest valleys, which are younger than the
    /// ice.
    pub(super) fn most_iced(&self, level: u32) -> f64 {
        match level > 0 && level + 1 < self.levels() {
            true => ICE_WIDTH * self.side(level).min(WIDEST_ICE * self.side(self.levels() - 1)) as f64,
            false => 0.0,
        }
    }

    /// Returns the half width in grains that no floor made by water alone reaches, however large the area is that
    /// drains there.
    pub(super) fn widest_water_trough(&self) -> f64 {
        WIDEST_TROUGH * self.side(0) as f64
    }

    /// Returns the number of terraces from the flood plains to the sides of valleys.
    pub fn terraces(&self) -> u32 {
        self.settings.terraces
    }

    /// Tells whether rills have a depth of their own, and lie in patches; otherwise they are gullies like the others.
    pub fn has_rills(&self) -> bool {
        self.settings.rills.is_some()
    }

    /// Returns the share of the level part of a floor that is flood plain at a point, where terraces rise from it.
    pub fn flood_plain(&self, at: Point) -> f64 {
        (FLOOD_PLAIN.0 + FLOOD_PLAIN.1 * self.flood_plain.at(at)).clamp(0.0, 1.0)
    }

    /// Returns the square metres, at least, from which a discharge in cubic metres a second runs off, wherever that is.
    pub fn drained_m2(&self, discharge_m3s: f64) -> f64 {
        discharge_m3s * SECONDS_A_YEAR / self.most_laws().runoff_m
    }

    /// Tells whether the tributary of a level with this head holds water, if there is one: its spring is then further
    /// up than its mouth.
    pub fn is_wet_at(&self, level: u32, head: Point) -> bool {
        // At most levels, all tributaries hold water or none does.
        self.may_be_wet(level) && (self.least_laws().is_wet(self, level) || self.laws(head).is_wet(self, level))
    }

    /// Tells whether there may be tributaries of a level that hold water.
    pub fn may_be_wet(&self, level: u32) -> bool {
        self.most_laws().is_wet(self, level)
    }

    /// Tells whether a channel with this discharge in cubic metres a second holds water.
    pub fn holds_water(&self, discharge_m3s: f64) -> bool {
        discharge_m3s >= self.spring_m3s()
    }

    /// Returns the discharge in cubic metres a second from which on a channel holds water.
    pub fn spring_m3s(&self) -> f64 {
        self.settings.spring_m3s
    }

    /// Returns the width of a river in metres, by its discharge in cubic metres a second.
    ///
    /// Based on: L. B. Leopold, T. Maddock, The hydraulic geometry of stream channels, 1953 (the root of the
    /// discharge).
    pub fn river_width_m(&self, discharge_m3s: f64) -> f64 {
        self.settings.river_width_m * discharge_m3s.sqrt()
    }

    /// Returns the half width of the largest lakes in grains.
    pub fn lake_half_width(&self) -> f64 {
        self.settings.lake_m.unwrap_or(self.settings.trunk_m / 16.0) / self.metres_a_grain
    }

    /// Returns the half width in grains that water must exceed to be a lake, where a river has this discharge: the
    /// river's own half width, and at least a vertex, as narrower water would hardly show.
    pub fn least_lake(&self, discharge_m3s: f64) -> f64 {
        (self.river_width_m(discharge_m3s) / 2.0 / self.metres_a_grain).max(GRAINS as f64)
    }

    /// Returns the metres from the lowstand's shore, about: inland above 0, at sea below. Infinite without a sea.
    pub fn inland_m(&self, at: Point) -> f64 {
        match &self.sea {
            Some(sea) => self.inland_by_m(sea, self.potential(at)),
            None => f64::INFINITY,
        }
    }

    /// Returns [`Fields::inland_m`] at any number of points, for callers that know all points beforehand.
    pub fn inlands_m(&self, points: &[Point]) -> Vec<f64> {
        match &self.sea {
            Some(sea) => {
                self.potentials(points).into_iter().map(|potential| self.inland_by_m(sea, potential)).collect()
            }
            None => vec![f64::INFINITY; points.len()],
        }
    }

    fn inland_by_m(&self, sea: &Sea, potential: f64) -> f64 {
        (potential - self.settings.coast.below) * sea.metres_a_unit
    }

    /// Tells whether a point lay in the sea at its lowstand.
    pub fn in_lowstand(&self, at: Point) -> bool {
        self.inland_of_rasters_m(at) < 0.0
    }

    /// Tells whether the sea covers a channel at a point: the water, at the given level, or the coast is lower than the
    /// sea.
    ///
    /// Water falls, so the sea covers all of a channel downstream of one point: no part of it lies cut off inland.
    pub fn is_drowned(&self, at: Point, level_m: f64) -> bool {
        let sea_m = self.sea_level_m();
        level_m < sea_m || (self.has_sea() && (self.edge_m(at) as f64) < sea_m)
    }

    /// Returns [`Fields::inland_m`], interpolated on the lattice from which the rasters get the coast.
    fn inland_of_rasters_m(&self, at: Point) -> f64 {
        if self.sea.is_none() {
            return f64::INFINITY;
        }
        let step = COAST_STEP * GRAINS;
        let (i, j) = (at.x.div_euclid(step), at.y.div_euclid(step));
        let [u, v] = [at.x, at.y].map(|grains| grains.rem_euclid(step) as f64 / step as f64);
        let mut corners = self.inlands_of_lattice_m([(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]);
        bilinear([(); 4].map(|()| corners.next().expect("there are four")), [u, v])
    }

    /// Returns [`Fields::inland_m`] at points of the lattice from which the rasters get the coast. Hollows of the
    /// potential that do not lead to the sea count as so far inland that the coast takes nothing of the land: it would
    /// cut pits there.
    pub fn inlands_of_lattice_m(&self, points: impl IntoIterator<Item = (i64, i64)>) -> impl Iterator<Item = f64> {
        let mut last: Option<(LatticePatch, Arc<Vec<f64>>)> = None;
        points.into_iter().map(move |(i, j)| {
            let Some(sea) = &self.sea else { return f64::INFINITY };
            let patch = (i.div_euclid(PATCH), j.div_euclid(PATCH));
            let values_m = match last.take().filter(|(own, _)| *own == patch) {
                Some((_, values_m)) => values_m,
                None => sea.lattice_m.get(patch, || {
                    let points = (0..PATCH * PATCH).map(|n| (patch.0 * PATCH + n % PATCH, patch.1 * PATCH + n / PATCH));
                    self.find_inlands_of_lattice_m(&points.collect::<Vec<_>>())
                }),
            };
            let value_m = values_m[(j.rem_euclid(PATCH) * PATCH + i.rem_euclid(PATCH)) as usize];
            last = Some((patch, values_m));
            value_m
        })
    }

    /// Returns [`Fields::inlands_of_lattice_m`] without caching the values, for those who hardly ask for a point twice.
    pub fn find_inlands_of_lattice_m(&self, points: &[(i64, i64)]) -> Vec<f64> {
        // The largest number of steps downhill. One or two lead to nearly all shores.
        const STEPS: usize = 32;
        let all_m = |points: &[(i64, i64)]| {
            let vertices = points.iter().map(|(i, j)| Point::at_vertex(i * COAST_STEP, j * COAST_STEP));
            self.inlands_m(&vertices.collect::<Vec<_>>())
        };
        let most_m = (COAST_STEP * GRAINS) as f64 * self.metres_a_grain;
        let found_m = |(start, here_m): (&(i64, i64), f64)| {
            if here_m <= 0.0 || here_m > most_m {
                return here_m;
            }
            let (mut at, mut lowest_m) = (*start, here_m);
            for _ in 0..STEPS {
                let around = AROUND.map(|(u, v)| (at.0 + u, at.1 + v));
                let around_m = all_m(&around);
                // Then the lowest of the points around lies in the sea.
                if around_m.iter().any(|around_m| *around_m <= 0.0) {
                    return here_m;
                }
                let mut lower = None;
                for (around, around_m) in around.into_iter().zip(around_m) {
                    if around_m < lowest_m {
                        (lowest_m, lower) = (around_m, Some(around));
                    }
                }
                let Some(lower) = lower else { return most_m };
                at = lower;
            }
            here_m
        };
        points.iter().zip(all_m(points)).map(found_m).collect()
    }

    /// Returns the height that the coast alone gives a place this far inland: the edge of the land, or the sea's floor.
    pub fn coast_m(&self, inland_m: f32) -> f32 {
        let [land, shelf] = self.settings.coast.slope.map(|slope| slope as f32);
        let (lowstand_m, deepest_m) = (self.lowstand_level_m() as f32, self.settings.coast.depth_m as f32);
        if inland_m > 0.0 {
            lowstand_m + edge_rise_m(inland_m * land * EDGE_STEEPER)
        } else {
            // The depth approaches the greatest depth asymptotically.
            let depth_m = -inland_m * shelf;
            lowstand_m - depth_m / (1.0 + depth_m / deepest_m) - self.below_shelf_m(inland_m)
        }
    }

    /// Returns the metres by which an ocean is deeper than its shelf where the lowstand's shore is so many metres away;
    /// a sea of a land without a geography is a shelf everywhere.
    fn below_shelf_m(&self, inland_m: f32) -> f32 {
        match self.geography() {
            Some(_) => DEEPEST_OCEAN_M * smooth(f64::from((-inland_m - SHELF_M) / CONTINENTAL_SLOPE_M)) as f32,
            None => 0.0,
        }
    }

    /// Returns the height in metres of the lowest floor of the sea.
    pub fn lowest_sea_m(&self) -> f64 {
        let ocean_m = self.geography().map_or(0.0, |_| f64::from(DEEPEST_OCEAN_M));
        self.lowstand_level_m() - self.settings.coast.depth_m - ocean_m
    }

    /// Returns the metres inland at which the edge of the land comes out of today's sea.
    pub fn shore_m(&self) -> f32 {
        let (rise_m, land) = (self.settings.coast.lowstand_m as f32, self.settings.coast.slope[0] as f32);
        // The inverse of `edge_rise_m`.
        let least_m = 50.0 * ((1.0 + rise_m / 25.0).sqrt() - 1.0);
        least_m / (land * EDGE_STEEPER)
    }

    /// Returns the vertices off the lowstand's shore at which [`Fields::coast_m`] has the sea's floor this high, about;
    /// 0 above the lowstand.
    pub fn off_shore(&self, floor_m: f32) -> f64 {
        let CoastSettings { slope: [_, shelf], depth_m: deepest_m, .. } = self.settings.coast;
        let depth_m = (self.lowstand_level_m() - floor_m as f64).max(0.0);
        let left = (1.0 - depth_m / deepest_m).max(1e-3);
        depth_m / left / shelf / (GRAINS as f64 * self.metres_a_grain)
    }

    /// Returns [`Fields::coast_m`] at a point, as the rasters have it.
    pub fn edge_m(&self, at: Point) -> f32 {
        self.coast_m(self.inland_of_rasters_m(at) as f32)
    }

    /// Returns the height in metres that no bed exceeds at a place: above the height to which its valley is
    /// [filled](Self::filled_m), the bed cuts into the land's edge. Infinite without a sea.
    pub fn below_coast_m(&self, at: Point, filled_m: f64) -> f64 {
        if self.has_sea() { self.below_coast_of_m(self.potential(at), filled_m) } else { f64::INFINITY }
    }

    /// Returns [`Fields::below_coast_m`] by the potential at the place: the height grows with the potential.
    pub fn below_coast_of_m(&self, potential: f64, filled_m: f64) -> f64 {
        let Some(sea) = &self.sea else { return f64::INFINITY };
        let rise_m = self.inland_by_m(sea, potential).max(0.0) * self.settings.coast.slope[0];
        filled_m + COAST_INCISION * edge_rise_m(rise_m as f32) as f64
    }

    /// Returns the heights in metres that the coast leaves the bed of a channel, from its head down: they never rise
    /// downstream.
    pub fn below_coast_along_m(&self, course: impl Iterator<Item = Point>, filled_m: f64) -> Vec<f64> {
        let course: Vec<Point> = course.collect();
        let lower = |most_m: &mut f64, potential: f64| {
            *most_m = most_m.min(self.below_coast_of_m(potential, filled_m));
            Some(*most_m)
        };
        match self.has_sea() {
            true => self.potentials(&course).into_iter().scan(f64::INFINITY, lower).collect(),
            false => vec![f64::INFINITY; course.len()],
        }
    }

    /// Returns the share of the straight way from a point on land at which the way comes to the lowstand's sea, if it
    /// does.
    pub fn dry_share(&self, from: Point, to: Point) -> Option<f64> {
        self.dry_way([from, to], || self.potential(to), SHORE_HALVINGS).sea_at
    }

    /// Returns what is known of a straight way from a point on land. `end` computes the potential at the way's end, if
    /// it is needed; `halvings` is the number of times that the part with the shore is halved.
    pub fn dry_way(&self, [from, to]: [Point; 2], end: impl FnOnce() -> f64, halvings: u32) -> DryWay {
        // The number of steps in which the way is looked at before the halvings: a narrower arm of the sea may be
        // missed.
        const PLACES: usize = 16;
        // A channel keeps below the coast at every second place, so only these count for `least`.
        const COAST: usize = 2;
        let mut least = f64::INFINITY;
        if self.sea.is_none() {
            return DryWay { sea_at: None, least };
        }
        let at = |share: f64| from.towards(to, share);
        let step = 1.0 / PLACES as f64;
        let places: Vec<Point> = (1..PLACES).map(|place| at(place as f64 * step)).collect();
        let comes_to_sea = |(place, here): &(usize, f64)| {
            if place.is_multiple_of(COAST) {
                least = least.min(*here);
            }
            *here < self.sea_potential()
        };
        // The nearer half first: many ways come to the sea early.
        let halves = places.chunks(PLACES / 2).flat_map(|half| self.potentials(half));
        let wet = (1..PLACES).zip(halves).find(comes_to_sea).map(|(place, _)| place);
        let wet = wet.or_else(|| (end() < self.sea_potential()).then_some(PLACES));
        let Some(wet) = wet else { return DryWay { sea_at: None, least } };
        let mut dry = (wet - 1) as f64 * step;
        let mut width = step;
        let mut left = halvings;
        while left > 0 {
            // Three halvings at a time, with all middles that they may need. The shares are binary fractions, so none
            // is rounded.
            let parts = 1_usize << left.min(3);
            width /= parts as f64;
            let middles: Vec<Point> = (1..parts).map(|part| at(dry + part as f64 * width)).collect();
            let potentials = self.potentials(&middles);
            let (mut low, mut high) = (0, parts);
            while high - low > 1 {
                let middle = usize::midpoint(low, high);
                if potentials[middle - 1] < self.sea_potential() { high = middle } else { low = middle }
            }
            dry += low as f64 * width;
            left -= left.min(3);
        }
        DryWay { sea_at: Some(dry), least }
    }

    /// Returns the nearest point of the lowstand's shore from a point on land, about, and a point of the sea beyond it,
    /// if the shore is no further than `most` grains. The shore is that of the rasters.
    pub fn coast_near(&self, at: Point, most: f64) -> Option<[Point; 2]> {
        self.sea.as_ref()?;
        let above = |at: Point| self.potential(at) - self.settings.coast.below;
        let here = above(at);
        // The potential's slope, over a stretch in which coasts of that size show.
        let step = most / 4.0;
        let slope = [DVec2::X, DVec2::Y].map(|axis| {
            let difference = above(at.moved(axis * step)) - above(at.moved(axis * -step));
            difference / (2.0 * step)
        });
        let slope = DVec2::from(slope);
        let steepness = slope.length();
        // By this slope the shore would be further away than `most`.
        if here <= 0.0 || here > steepness * most {
            return None;
        }
        let down = -slope / steepness;
        let place = |grains: f64| at.moved(down * grains);
        if self.in_lowstand(at) || !self.in_lowstand(place(most)) {
            return None;
        }
        let (mut dry, mut wet) = (0.0, most);
        while wet - dry > 0.5 {
            let middle = f64::midpoint(dry, wet);
            if self.in_lowstand(place(middle)) { wet = middle } else { dry = middle }
        }
        // In a narrow bay, the point of the sea is less far from the shore.
        let mut beyond = INTO_SEA * GRAINS as f64;
        while beyond > 1.0 && !self.in_lowstand(place(wet + beyond)) {
            beyond /= 2.0;
        }
        // The first point is on land, so that the coast lies on the bed between the two.
        Some([place((dry - 2.0).max(0.0)), place(wet + beyond)])
    }
}

/// Returns the depth of a river in metres, by its discharge: the 3/8 th power, which takes square roots only.
///
/// Based on: L. B. Leopold, T. Maddock, The hydraulic geometry of stream channels, 1953, where depth goes with about
/// the 0.4 th power of discharge.
pub(super) fn river_depth_m(discharge_m3s: f64) -> f32 {
    let fourth = discharge_m3s.sqrt().sqrt();
    ((0.35 * fourth * fourth.sqrt()) as f32).min(DEEPEST_RIVER_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the sizes of the seas that are cut off from others by the potential: in a lattice of places, those that
    /// do not come to its edge.
    fn closed_seas(fields: &Fields, side: i64) -> Vec<usize> {
        let wet = |i: i64, j: i64| fields.inland_m(Point::at_vertex(i * COAST_STEP, j * COAST_STEP)) < 0.0;
        let mut open: Vec<bool> = (0..side * side).map(|place| wet(place % side, place / side)).collect();
        let mut closed = Vec::new();
        for first in 0..open.len() {
            let (mut size, mut at_edge, mut left) = (0, false, vec![first as i64]);
            while let Some(place) = left.pop() {
                if !std::mem::take(&mut open[place as usize]) {
                    continue;
                }
                let (i, j) = (place % side, place / side);
                size += 1;
                if i.min(j) == 0 || i.max(j) + 1 == side {
                    at_edge = true;
                } else {
                    left.extend([place - 1, place + 1, place - side, place + side]);
                }
            }
            if size > 0 && !at_edge {
                closed.push(size);
            }
        }
        closed
    }

    #[test]
    fn no_level_holds_water_on_its_last_stretch_alone() {
        let wet = |spring_m3s: f64| {
            let fields = Fields::of_preset("alps", 1, |settings| settings.spring_m3s = spring_m3s);
            let is_wet = fields.may_be_wet(3);
            let mouth_m3s = fields.most_laws().mouth_m3s(&fields, 3);
            assert_eq!(fields.holds_water(mouth_m3s), is_wet, "at {mouth_m3s} m3/s");
            is_wet
        };
        let mouth_m3s = 15_360.0f64.powi(2) * 0.8 / 31_556_952.0 / 64.0;
        let shares = [0.5, 0.79, 0.81, 0.99, 1.01];
        assert_eq!(shares.map(|share| wet(share * mouth_m3s)), [true, true, false, false, false]);
    }

    /// Bending makes no new hollows in a field, whereas more octaves would leave small seas by the dozen.
    #[test]
    fn bent_shores_cut_off_hardly_any_small_sea() {
        let small = |octaves: u32| {
            let fields = |seed| Fields::of_preset("archipelago", seed, |settings| settings.coast.octaves = octaves);
            let of = |seed| closed_seas(&fields(seed), 1024);
            // The lattice is 64 tiles wide, so it has 64 squares of 8 x 8 tiles; a square kilometre has 61 places.
            (1..=2).flat_map(of).filter(|size| *size < 61).count()
        };
        let [few, many] = [2, 4].map(small);
        assert!(few <= 12, "{few} seas of less than a square kilometre in 128 times 8 x 8 tiles");
        assert!(many > 10 * few, "{many} with four octaves, {few} with two");
    }
}
