//! Finding by name.

use rayon::prelude::*;

use crate::error::Error;
use crate::find::{Finder, Found, LEAST_AROUND_KM, Query};
use crate::geometry::length;
use crate::lines::SiteId;
use crate::names::settlement;
use crate::preset::Preset;
use crate::stop;
use crate::world::World;

/// Kilometres from the origin within which settlements are looked for, whose names are known without their land; and other
/// things, whose names are not.
const SETTLEMENTS_KM: f64 = 300.0;
const THINGS_KM: f64 = 30.0;

/// Things of a kind that are looked at, at most.
const MOST: usize = 10_000;

/// Names that are told of where none is right.
const NEARLY: usize = 4;

/// What has a name in the world of a preset, whatever its letters' case: the settlement that is nearest to the origin, or else
/// the lake, river or peak.
///
/// # Errors
/// When the world has no names, or nothing has this one; the hint has those that are most like it.
pub fn named(preset: Preset, seed: Option<u64>, name: &str) -> Result<Found, Error> {
    let mut finder = Finder::new(preset, seed)?;
    let Some(places) = finder.world().places() else {
        return Err(Error::Option {
            message: format!("nothing is called {name:?}: the world has no names"),
            hint: "give a preset with [places], such as alps, or numbers: X,Y,KM".into(),
        });
    };
    let wanted = name.to_lowercase();
    let (world, side_km) = (finder.world(), places.site_side() as f64 * finder.world().spacing_m() / 1000.0);
    let cells = settlements(world, side_km);
    let is_wanted = |cell: &&(SiteId, String)| cell.1.to_lowercase() == wanted;
    if let Some(found) = cells.iter().filter(is_wanted).find_map(|(id, _)| site(world, *id)) {
        return Ok(found);
    }
    let mut near: Vec<String> = Vec::new();
    for thing in ["lake", "river", "peak"] {
        let query: Query = thing.parse().expect("it is a thing");
        for found in finder.find(&query, [0.0; 2], THINGS_KM, MOST)? {
            match &found.name {
                Some(known) if known.to_lowercase() == wanted => return Ok(found),
                known => near.extend(known.clone()),
            }
        }
    }
    // Of the cells, few have a settlement: the first that are like the name and have one.
    let world = finder.world();
    let likeness = |known: &str| strsim::jaro_winkler(&known.to_lowercase(), &wanted);
    let mut by_likeness: Vec<(f64, &(SiteId, String))> = cells.iter().map(|cell| (likeness(&cell.1), cell)).collect();
    by_likeness.sort_by(|a, b| b.0.total_cmp(&a.0));
    let alike = by_likeness.iter().take(200).filter(|(_, cell)| site(world, cell.0).is_some()).take(NEARLY);
    near.extend(alike.map(|(_, cell)| cell.1.clone()));
    near.sort_by(|a, b| likeness(b).total_cmp(&likeness(a)).then_with(|| a.cmp(b)));
    near.dedup();
    near.truncate(NEARLY);
    Err(Error::Option {
        message: format!(
            "no settlement within {SETTLEMENTS_KM} km of the origin and no lake, river or peak within {THINGS_KM} km is \
             called {name:?}"
        ),
        hint: format!("there are {}; or give numbers: X,Y,KM", near.join(", ")),
    })
}

/// The cells around the origin that may have a settlement, nearest first, and what it would be called.
fn settlements(world: &World, side_km: f64) -> Vec<(SiteId, String)> {
    let reach = (SETTLEMENTS_KM / side_km).ceil() as i64;
    let mut cells: Vec<SiteId> = (-reach..reach).flat_map(|j| (-reach..reach).map(move |i| SiteId { i, j })).collect();
    let off = |cell: &SiteId| length([cell.i, cell.j].map(|at| at as f64 + 0.5));
    cells.retain(|cell| off(cell) <= reach as f64);
    cells.sort_by(|a, b| off(a).total_cmp(&off(b)).then(a.cmp(b)));
    let seed = world.seed();
    let named = |cell| {
        stop::check();
        (cell, settlement(seed, cell))
    };
    cells.into_par_iter().map(named).collect()
}

/// The settlement of a cell, if it has one.
fn site(world: &World, id: SiteId) -> Option<Found> {
    let site = world.site(id)?;
    let spacing_km = world.spacing_m() / 1000.0;
    let at_km = [site.at[0] as f64 * spacing_km, -site.at[1] as f64 * spacing_km];
    Some(Found {
        id: id.to_string(),
        name: Some(site.name.clone()),
        at_km,
        distance_km: length(at_km),
        around_km: 2.0 * LEAST_AROUND_KM,
        values: Vec::new(),
    })
}
