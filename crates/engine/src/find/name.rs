//! Finding by name.
//!
//! A name follows from numbers: from the cell of a settlement or a peak, or from the channel in which a river or a lake
//! begins. So the names of all possible things are known without making any land. Land is made only to check whether
//! the thing with the right name exists.

use std::collections::BTreeSet;
use std::ops::Range;

use rayon::prelude::*;

use crate::clock::Clock;
use crate::error::Error;
use crate::features::landforms::{LAKES, PEAKS, lake_name};
use crate::find::large::realm_found;
use crate::find::{Finder, Found, LEAST_AROUND_KM, lake_found, peak_found, river_found};
use crate::fluvial::landforms::peaks;
use crate::geography::realms::{Realm, RealmKind};
use crate::geometry::length;
use crate::grain_point::{GRAINS, Point};
use crate::lines::{ChannelId, LakeId, SiteId};
use crate::places::site::Site;
use crate::preset::Preset;
use crate::stop::Stopped;
use crate::world::World;

/// Radius in kilometres of the search for settlements.
pub const SETTLEMENTS_KM: f64 = 300.0;
/// Radius in kilometres of the search for lakes, rivers and peaks, of which there are many more.
pub const THINGS_KM: f64 = 30.0;
/// Radius in kilometres of the search for continents, seas, deserts and so on, whose middles are meant.
pub const REALMS_KM: f64 = 2000.0;

/// Largest number of similar names that are suggested when no name matches.
const NEARLY: usize = 4;
/// Largest number of candidates that are checked for these suggestions.
const MOST_LOOKS: usize = 32;
/// Bytes of land that these checks may make. After that, only large rivers are checked, which need the least land, and
/// things whose names differ by a typing slip.
const MOST_LAND: u64 = 12 << 20;
/// Levels of the channel network whose rivers count as large.
const LARGE: Range<u32> = 0..3;
/// Letters per typing mistake: a name is a slip of another if at most one letter in this many is wrong.
const LETTERS_A_SLIP: usize = 5;

/// Penalty on the likeness of a name (0 to 1, where 1 is the same name) at the distance `SETTLEMENTS_KM`, and
/// proportionally less nearer, since most people mistype the name of something nearby.
const FAR: f64 = 0.3;

/// A thing that may exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MayBe {
    Settlement(SiteId),
    Lake(LakeId),
    /// Identified by the channel in which its course begins.
    River(ChannelId),
    /// Identified by its cell.
    Peak((i64, i64)),
}

/// A possible thing with the name that it would have, and its approximate distance in kilometres.
#[derive(Debug)]
struct Called {
    thing: MayBe,
    name: String,
    off_km: f64,
}

/// Finds the thing with a name in the world of a preset, ignoring case: of the settlements the one nearest to a place
/// in kilometres east and north; if there is none, the nearest lake, river or peak; in a whole world, if there is none,
/// the nearest continent, sea, desert and so on.
///
/// # Errors
/// When `clock` stops the work, the world has no names, or nothing has this name; then the hint suggests similar names
/// of things nearby.
pub fn named(preset: Preset, seed: Option<u64>, name: &str, near_km: [f64; 2], clock: &Clock) -> Result<Found, Error> {
    named_in(&Finder::new(preset, seed)?, name, near_km, clock)
}

/// Finds the thing with a name as [`named`] does, but in the world of a finder, which caches the land that it makes.
///
/// # Errors
/// When the world has no names, or nothing has this name. When `clock` stops the work.
pub fn named_in(finder: &Finder, name: &str, near_km: [f64; 2], clock: &Clock) -> Result<Found, Error> {
    let world = finder.world();
    if world.names().is_none() {
        return Err(Error::Option {
            message: format!("nothing is called {name:?}: the world has no names"),
            hint: "give a preset with [places], such as alps, or numbers: X,Y,KM".into(),
        });
    }
    let wanted = name.trim().to_lowercase();
    let all = all(world, near_km, clock)?;
    for called in all.iter().filter(|called| called.name.to_lowercase() == wanted) {
        if let Some(found) = called.found(world, near_km, clock)? {
            return Ok(found);
        }
    }
    let realms = realms(world, near_km, clock)?;
    let is_called = |found: &&Found| found.name.as_ref().is_some_and(|name| name.to_lowercase() == wanted);
    if let Some(found) = realms.iter().find(is_called) {
        return Ok(found.clone());
    }
    let [x, y] = near_km;
    let mut names = alike(world, &all, &wanted, near_km, clock)?;
    names.extend(realms.into_iter().filter_map(|found| found.name).filter(|name| is_slip(name, &wanted)));
    names.dedup();
    let large = match world.geography() {
        Some(_) => format!(", nor a continent, sea, desert and so on within {REALMS_KM} km,"),
        None => String::new(),
    };
    let numbers = "give numbers: X,Y,KM";
    Err(Error::Option {
        message: format!(
            "no settlement within {SETTLEMENTS_KM} km of {x},{y} and no lake, river or peak within {THINGS_KM} km\
             {large} is called {name:?}"
        ),
        hint: match &names[..] {
            [] => numbers.to_owned(),
            names => format!("there are {}; or {numbers}", names.join(", ")),
        },
    })
}

/// Returns the names of existing things that are most like the `wanted` name, which nothing has.
fn alike(
    world: &World,
    all: &[Called],
    wanted: &str,
    near_km: [f64; 2],
    clock: &Clock,
) -> Result<Vec<String>, Stopped> {
    let score = |called: &Called| {
        let likeness = strsim::jaro_winkler(&called.name.to_lowercase(), wanted);
        likeness - FAR * called.off_km / SETTLEMENTS_KM
    };
    let mut scored: Vec<(f64, &Called)> = all.par_iter().map(|called| (score(called), called)).collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.thing.cmp(&b.1.thing)));
    let before = world.remembered_bytes();
    let is_worth_it = |called: &Called| {
        let has_land_left = world.remembered_bytes() < before + MOST_LAND;
        has_land_left || called.is_large_river() || is_slip(&called.name, wanted)
    };
    let mut names: Vec<String> = Vec::new();
    let looked_at = scored.into_iter().map(|(_, called)| called).filter(|called| is_worth_it(called)).take(MOST_LOOKS);
    for called in looked_at {
        if !names.contains(&called.name) && called.found(world, near_km, clock)?.is_some() {
            names.push(called.name.clone());
        }
        if names.len() == NEARLY {
            break;
        }
    }
    Ok(names)
}

/// True if a name differs from the `wanted` one by a typing slip.
fn is_slip(name: &str, wanted: &str) -> bool {
    strsim::damerau_levenshtein(&name.to_lowercase(), wanted) * LETTERS_A_SLIP <= wanted.chars().count()
}

/// Returns the realms near a place, nearest first; none in a world without a geography.
fn realms(world: &World, near_km: [f64; 2], clock: &Clock) -> Result<Vec<Found>, Stopped> {
    let Some(geography) = world.geography() else { return Ok(Vec::new()) };
    let grains = |km: f64| (km * 1000.0 / world.spacing_m() * GRAINS as f64) as i64;
    let [x, y] = [near_km[0], -near_km[1]].map(grains);
    let reach = grains(REALMS_KM);
    let around = [Point { x: x - reach, y: y - reach }, Point { x: x + reach, y: y + reach }];
    let of_kind = |kind: &RealmKind| {
        clock.check()?;
        Ok(geography.realms_within(*kind, around))
    };
    let realms: Vec<Vec<Realm>> = RealmKind::ALL.par_iter().map(of_kind).collect::<Result<_, Stopped>>()?;
    let found = realms.iter().flatten().map(|realm| realm_found(world, realm, near_km));
    let mut found: Vec<Found> = found.filter(|found| found.distance_km <= REALMS_KM).collect();
    found.sort_by(|a, b| a.distance_km.total_cmp(&b.distance_km).then_with(|| a.id.cmp(&b.id)));
    Ok(found)
}

/// Returns all things that may exist near a place: settlements first, each group nearest first.
fn all(world: &World, near_km: [f64; 2], clock: &Clock) -> Result<Vec<Called>, Stopped> {
    let mut all = settlements(world, near_km);
    clock.check()?;
    all.extend(things(world, near_km, clock)?);
    Ok(all)
}

/// Returns the settlements that may exist near a place.
fn settlements(world: &World, near_km: [f64; 2]) -> Vec<Called> {
    let Some((places, names)) = world.places().zip(world.names()) else { return Vec::new() };
    let cells = cells(world, places.site_side(), near_km, SETTLEMENTS_KM);
    let called = cells.into_par_iter().map(|([i, j], off_km)| {
        let id = SiteId { i, j };
        Called { thing: MayBe::Settlement(id), name: names.settlement(id), off_km }
    });
    called.collect()
}

/// Returns the lakes, rivers and peaks that may exist near a place.
fn things(world: &World, near_km: [f64; 2], clock: &Clock) -> Result<Vec<Called>, Stopped> {
    let Some((fluvial, names)) = world.relief().fluvial().zip(world.names()) else { return Ok(Vec::new()) };
    let mut things = Vec::new();
    for level in 0..fluvial.fields().levels() {
        clock.check()?;
        let cells = cells(world, fluvial.fields().side(level) / GRAINS, near_km, THINGS_KM);
        things.par_extend(cells.into_par_iter().flat_map_iter(|([x, y], off_km)| {
            let id = (level, x, y);
            let river = fluvial.may_have_rivers(level).then(|| fluvial.river_name(id)).flatten();
            let river = river.map(|name| Called { thing: MayBe::River(id), name, off_km });
            let lake = fluvial.may_be_lake(LakeId(id)).then(|| lake_name(world, LakeId(id))).flatten();
            river.into_iter().chain(lake.map(|name| Called { thing: MayBe::Lake(LakeId(id)), name, off_km }))
        }));
    }
    let side = peaks::side(fluvial);
    things.par_extend(cells(world, side, near_km, THINGS_KM).into_par_iter().flat_map_iter(|([x, y], off_km)| {
        // The name also depends on the peak's position within its cell, so all names that it could have are listed.
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [(x + i) * side - i, (y + j) * side - j]);
        let called: BTreeSet<String> = corners.iter().map(|at| names.peak(*at, &[x, y])).collect();
        called.into_iter().map(move |name| Called { thing: MayBe::Peak((x, y)), name, off_km })
    }));
    things.sort_by(|a, b| a.off_km.total_cmp(&b.off_km).then(a.thing.cmp(&b.thing)));
    Ok(things)
}

/// Returns the cells of a lattice whose centres lie within a radius of a place, with their distances in kilometres,
/// nearest first. `side` is the width of a cell in vertices.
fn cells(world: &World, side: i64, [east, north]: [f64; 2], radius_km: f64) -> Vec<([i64; 2], f64)> {
    let side_km = side as f64 * world.spacing_m() / 1000.0;
    // Rows of vertices count southwards.
    let near_km = [east, -north];
    let span = |axis: usize| {
        let at = |by: f64| ((near_km[axis] + by) / side_km).floor() as i64;
        at(-radius_km)..=at(radius_km)
    };
    let off_km = |cell: [i64; 2]| length([0, 1].map(|axis| (cell[axis] as f64 + 0.5) * side_km - near_km[axis]));
    let mut cells: Vec<([i64; 2], f64)> =
        span(1).flat_map(|y| span(0).map(move |x| [x, y])).map(|cell| (cell, off_km(cell))).collect();
    cells.retain(|(_, off_km)| *off_km <= radius_km);
    cells.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    cells
}

impl Called {
    fn is_large_river(&self) -> bool {
        matches!(self.thing, MayBe::River((level, ..)) if LARGE.contains(&level))
    }

    /// Checks that the thing exists and has this name, and returns it.
    fn found(&self, world: &World, near_km: [f64; 2], clock: &Clock) -> Result<Option<Found>, Stopped> {
        clock.check()?;
        let found = match self.thing {
            MayBe::Settlement(id) => world.site(id, clock)?.map(|site| site_found(world, &site, near_km)),
            MayBe::Lake(id) => {
                let lakes = LAKES.features(world, world.lake(id, clock)?.into_iter().collect(), clock)?;
                lakes.into_iter().next().map(|lake| lake_found(lake, near_km))
            }
            MayBe::River(top) => {
                let rivers = world.rivers_from(top, clock)?;
                let all = rivers.iter().filter_map(|river| river_found(river, 0.0, near_km));
                all.min_by(|a, b| a.distance_km.total_cmp(&b.distance_km))
            }
            MayBe::Peak(cell) => {
                let peaks = PEAKS.features(world, world.peak(cell, clock)?.into_iter().collect(), clock)?;
                peaks.into_iter().next().map(|peak| peak_found(peak, near_km))
            }
        };
        Ok(found.filter(|found| found.name.as_ref() == Some(&self.name)))
    }
}

fn site_found(world: &World, site: &Site, near_km: [f64; 2]) -> Found {
    let spacing_m = world.spacing_m();
    let at = [site.at[0] as f64 * spacing_m, -site.at[1] as f64 * spacing_m];
    let found = Found::new(site.id.to_string(), Some(site.name.clone()), [at; 2], near_km, Vec::new());
    Found { around_km: 2.0 * LEAST_AROUND_KM, ..found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::lines::LineKind;

    fn world() -> World {
        let (_, preset) = Preset::load("highlands").unwrap();
        World::new(preset, Some(11)).unwrap()
    }

    #[test]
    fn each_kind_of_thing_is_found_by_its_name() {
        let known = world();
        let area = Area::new(-1500, -1500, 3000, 3000);
        let lake = &LAKES.find(&known, &area, &Clock::default()).unwrap()[0];
        let peak = &PEAKS.find(&known, &area, &Clock::default()).unwrap()[0];
        // Every lake that exists must be among the possible lakes.
        let lakes: BTreeSet<String> = all(&known, [0.0; 2], &Clock::default())
            .unwrap()
            .into_iter()
            .filter_map(|called| matches!(called.thing, MayBe::Lake(_)).then_some(called.name))
            .collect();
        let found = LAKES.find(&known, &area, &Clock::default()).unwrap();
        assert!(found.len() > 3 && found.iter().all(|lake| lakes.contains(lake.name.as_ref().unwrap())), "{lakes:?}");
        let river = &known.lines_through(LineKind::River, &area, &Clock::default()).unwrap()[0];
        let site = &known.sites(&area, &Clock::default()).unwrap()[0];
        for name in [lake.name.clone(), peak.name.clone(), river.name.clone(), Some(site.name.clone())] {
            let name = name.expect("things of this world have names");
            // Searched in another world, whose caches are empty. Another thing nearer to the origin may have the same
            // name.
            let found =
                named(known.preset().clone(), Some(11), &name.to_uppercase(), [0.0; 2], &Clock::default()).unwrap();
            assert!(found.name.as_ref() == Some(&name) && found.distance_km < 60.0, "{name}: {found:?}");
        }
    }

    #[test]
    fn what_is_large_is_found_by_its_name() {
        let (_, preset) = Preset::load("world").unwrap();
        let world = World::new(preset.clone(), Some(3)).unwrap();
        let near_km = [-4000.0, -9000.0];
        let realms = realms(&world, near_km, &Clock::default()).unwrap();
        let kinds: BTreeSet<&str> = realms.iter().map(|realm| realm.id.split(':').next().unwrap()).collect();
        assert!(realms.len() > 20 && kinds.len() > 5, "{kinds:?}");
        let far = realms.iter().filter(|realm| realm.around_km > 1000.0).next_back().unwrap();
        let name = far.name.as_ref().unwrap();
        let found = named(preset.clone(), Some(3), &name.to_lowercase(), near_km, &Clock::default()).unwrap();
        assert!(found.name.as_ref() == Some(name) && found.around_km > 20.0, "{name}: {found:?}");
        let wrong = named(preset, Some(3), &format!("{name}q"), near_km, &Clock::default()).unwrap_err();
        assert!(wrong.hint().is_some_and(|hint| hint.contains(&name[..])), "{wrong}: {:?}", wrong.hint());
    }

    #[test]
    fn hardly_any_land_is_made_to_say_that_a_name_is_wrong() {
        let world = world();
        let before = world.remembered_bytes();
        let all = all(&world, [0.0; 2], &Clock::default()).unwrap();
        assert!(all.len() > 10_000 && world.remembered_bytes() == before, "{} names", all.len());
        let names = alike(&world, &all, "brondalvatn", [0.0; 2], &Clock::default()).unwrap();
        assert!((1..=NEARLY).contains(&names.len()), "{names:?}");
        let made = world.remembered_bytes() - before;
        assert!(made < 24 << 20, "{made} bytes are remembered");
    }
}
