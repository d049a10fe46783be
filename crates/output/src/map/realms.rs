//! Names of continents, oceans, deserts and so on, on maps at small scales of a whole world.
//!
//! They come from the coarse nodes of the world's geography. No land is made for them.

use glam::DVec2;
use rayon::prelude::*;

use crate::area::Area;
use crate::clock::Clock;
use crate::geography::realms::{Realm, RealmKind};
use crate::grain_point::{GRAINS, Point};
use crate::map::scale::Scale;
use crate::map::style::{LabelStyle, LabelsStyle};
use crate::stop::Stopped;
use crate::world::World;

/// Smallest scale denominator at which realms have names, in place of the mountain ranges of coarse land: 1:2,000,000,
/// less the rounding of pixels.
const LEAST: f64 = 1.9e6;

/// Largest scale denominator at which all kinds have names whatever their size. Beyond it only continents, oceans and
/// seas have.
const MOST_SMALL: f64 = 25e6;

/// Least area on paper, in square centimetres, of other things that have names beyond this scale.
const LEAST_CM2: f64 = 2.0;

/// A realm on a map.
#[derive(Clone, Debug)]
pub(super) struct NamedRealm {
    pub kind: RealmKind,
    /// The node at its middle, which identifies it among those of its kind.
    pub node: [i64; 2],
    pub name: String,
    pub area_km2: f64,
    /// Its middle, and the length of the longer side of its bounding box, in pixels.
    pub at: DVec2,
    pub longest_px: f64,
}

/// True if realms of a world have names at a scale.
pub(super) fn are_named(world: &World, scale: Scale) -> bool {
    world.names().is_some() && world.geography().is_some() && scale.denominator() >= LEAST
}

/// Returns the realms whose middles lie in an area of pixels, if they have names at the scale.
pub(super) fn seen(world: &World, scale: Scale, area: Area, clock: &Clock) -> Result<Vec<NamedRealm>, Stopped> {
    let known = world.names().zip(world.geography()).filter(|_| are_named(world, scale));
    let Some((names, geography)) = known else { return Ok(Vec::new()) };
    let pixel = scale.metres_per_pixel / world.spacing_m() * GRAINS as f64;
    let place = |x: i64, y: i64| Point { x: (x as f64 * pixel) as i64, y: (y as f64 * pixel) as i64 };
    let around = [place(area.x0, area.y0), place(area.x1, area.y1)];
    let named = |realm: &Realm| NamedRealm {
        kind: realm.kind,
        node: realm.node,
        name: names.realm(realm),
        area_km2: realm.area_km2,
        at: DVec2::new(realm.middle.x as f64, realm.middle.y as f64) / pixel,
        longest_px: realm.longest() as f64 / pixel,
    };
    let of_kind = |kind: &RealmKind| -> Result<Vec<NamedRealm>, Stopped> {
        clock.check()?;
        let is_far = [RealmKind::Continent, RealmKind::Ocean, RealmKind::Sea].contains(kind);
        // A centimetre is 1e-5 km.
        let cm_km = scale.denominator() * 1e-5;
        let least_km2 = if is_far || scale.denominator() <= MOST_SMALL { 0.0 } else { LEAST_CM2 * cm_km * cm_km };
        let realms = geography.realms_within(*kind, around);
        Ok(realms.iter().filter(|realm| realm.area_km2 >= least_km2).map(named).collect())
    };
    let realms = RealmKind::ALL.par_iter().map(of_kind).collect::<Result<Vec<Vec<NamedRealm>>, Stopped>>()?;
    Ok(realms.into_iter().flatten().collect())
}

impl NamedRealm {
    /// Returns the lettering of the name: that of ranges on land and of lakes in water, the larger and the wider spaced
    /// the larger such things are.
    pub fn lettering(&self, labels: &LabelsStyle) -> LabelStyle {
        let (style, larger, wider) = match self.kind {
            RealmKind::Continent => (labels.range, 1.35, 0.2),
            RealmKind::Range | RealmKind::Desert => (labels.range, 0.9, 0.05),
            RealmKind::Plain => (labels.range, 0.8, 0.0),
            RealmKind::Island => (labels.range, 0.7, 0.0),
            RealmKind::Ocean => (labels.lake, 2.0, 0.15),
            RealmKind::Sea => (labels.lake, 1.5, 0.05),
            RealmKind::Bay => (labels.lake, 1.0, 0.0),
        };
        LabelStyle { size_mm: larger * style.size_mm, spacing: style.spacing + wider, ..style }
    }

    /// Returns the name as it is written: that of a continent or an ocean in capitals.
    pub fn text(&self) -> String {
        match self.kind {
            RealmKind::Continent | RealmKind::Ocean => self.name.to_uppercase(),
            _ => self.name.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::preset::Preset;

    #[test]
    fn realms_of_a_part_are_those_of_the_whole_that_lie_in_it() {
        let (_, preset) = Preset::load("world").unwrap();
        let world = World::new(preset, Some(3)).unwrap();
        let scale = |denominator: f64| Scale { metres_per_pixel: denominator / 2000.0, pixels_per_mm: 2.0 };
        let named = |denominator: f64, area: Area| -> BTreeSet<(RealmKind, String, [i64; 2])> {
            let seen = seen(&world, scale(denominator), area, &Clock::default()).unwrap();
            seen.into_iter()
                .map(|realm| (realm.kind, realm.name, [realm.at.x, realm.at.y].map(|at| at as i64)))
                .collect()
        };
        let (whole, part) = (Area::new(-250, -150, 500, 600), Area::new(-80, 10, 250, 250));
        let mut all = named(20e6, whole);
        assert!(all.iter().map(|(kind, ..)| *kind).collect::<BTreeSet<_>>().len() >= 7, "{all:?}");
        all.retain(|(.., [x, y])| part.contains(&Area::new(*x, *y, 1, 1)));
        assert!(all.len() > 10, "{all:?}");
        assert_eq!(named(20e6, part), all);
        // Small things have no names on a map of the whole world, and on maps of a region nothing large has.
        let afar = seen(&world, scale(40e6), part, &Clock::default()).unwrap();
        let is_far = |kind| [RealmKind::Continent, RealmKind::Ocean, RealmKind::Sea].contains(&kind);
        let is_large = |realm: &NamedRealm| is_far(realm.kind) || realm.area_km2 >= 320_000.0;
        assert!(afar.len() > 1 && afar.len() < all.len() && afar.iter().all(is_large), "{afar:?}");
        assert!(named(1e6, part).is_empty());
    }
}
