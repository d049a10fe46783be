//! Finding what is as large as a continent, on the coarse nodes of a world's geography, and volcanoes.

use crate::error::Error;
use crate::find::{Beside, BiomeLetters, Found, Measure, Query, Thing, nearest};
use crate::fluvial::volcanoes::Volcano;
use crate::geography::Geography;
use crate::geography::realms::{Realm, RealmKind};
use crate::geometry::length;
use crate::grain_point::{GRAINS, Point};
use crate::watch::Watch;
use crate::world::World;

/// Width in kilometres of the area around a place with a climate.
const BIOME_KM: f64 = 20.0;

/// Side in kilometres of the blocks in which volcanoes are searched.
const VOLCANO_BLOCK_KM: f64 = 250.0;

/// Width of the area around a volcano, as a multiple of its radius.
const VOLCANO_WIDTH: f64 = 3.0;

/// Width of the area around a realm, as a multiple of the width that holds all of it.
const REALM_WIDTH: f64 = 1.1;

/// Places of a square, the nearest ones, whose climates are looked up. At the edge of a climate, coarse nodes may be
/// wrong.
const LOOKS: usize = 9;

/// Halvings of the way from a node to the sea in search of the coast: to 250 m on Earth.
const HALVINGS: u32 = 7;

/// Finds things of a geography, as [`Finder::find`](crate::find::Finder::find) does.
pub(super) fn find(
    world: &World,
    query: &Query,
    near: ([f64; 2], f64),
    limit: usize,
    watch: &Watch,
) -> Result<Vec<Found>, Error> {
    let Some(geography) = world.geography() else {
        return Err(Error::Option {
            message: format!("a world of one land has no {} to be found", query.thing.name()),
            hint: "give a preset with [geography], such as world".into(),
        });
    };
    let search = LargeSearch { world, geography, query, near_km: near.0 };
    let block_km = |grains: i64| search.km(grains);
    match query.thing {
        Thing::Realm(kind) => nearest(block_km(geography.realm_block(kind)), near, limit, watch, |[x, y]| {
            watch.clock.check()?;
            Ok(search.realms(kind, (x, -y - 1)))
        }),
        Thing::Biome(letters) => nearest(block_km(geography.biome_square()), near, limit, watch, |[x, y]| {
            watch.clock.check()?;
            Ok(search.biome(letters, (x, -y - 1)).into_iter().collect())
        }),
        Thing::Volcano => nearest(VOLCANO_BLOCK_KM, near, limit, watch, |block| {
            watch.clock.check()?;
            Ok(search.volcanoes(block))
        }),
        Thing::Lake | Thing::Peak | Thing::River | Thing::Site(_) => Ok(Vec::new()),
    }
}

/// Returns a realm as found from a place in kilometres.
pub(super) fn realm_found(world: &World, realm: &Realm, near_km: [f64; 2]) -> Found {
    let at_km = at_km(world, realm.middle);
    let [low, high] = realm.bounds.map(|corner| corner.from(realm.middle).abs().max_element());
    let whole_km = 2.0 * low.max(high) * world.spacing_m() / GRAINS as f64 / 1000.0;
    Found {
        id: realm.to_string(),
        name: world.names().map(|names| names.realm(realm)),
        at_km,
        distance_km: length([0, 1].map(|axis| at_km[axis] - near_km[axis])),
        around_km: (REALM_WIDTH * whole_km).max(BIOME_KM).ceil(),
        values: vec![(Measure::Area, realm.area_km2.round())],
    }
}

/// Returns the kilometres east and north of a place.
fn at_km(world: &World, Point { x, y }: Point) -> [f64; 2] {
    [x, -y].map(|grains| grains as f64 * world.spacing_m() / GRAINS as f64 / 1000.0)
}

/// Returns the place so many kilometres east and north of the origin.
fn place_at(world: &World, at_km: [f64; 2]) -> Point {
    let [x, y] = [at_km[0], -at_km[1]].map(|km| (km * 1000.0 / world.spacing_m() * GRAINS as f64) as i64);
    Point { x, y }
}

/// A search in a geography.
struct LargeSearch<'a> {
    world: &'a World,
    geography: &'a Geography,
    query: &'a Query,
    near_km: [f64; 2],
}

impl LargeSearch<'_> {
    fn km(&self, grains: i64) -> f64 {
        grains as f64 * self.world.spacing_m() / GRAINS as f64 / 1000.0
    }

    /// Finds the realms whose middles lie in a block.
    fn realms(&self, kind: RealmKind, block: (i64, i64)) -> Vec<Found> {
        let realms = self.geography.realms_of_block(kind, block);
        let found = realms.iter().map(|realm| realm_found(self.world, realm, self.near_km));
        found.filter(|found| self.query.keeps(&found.values)).collect()
    }

    /// Finds the volcanoes whose middles lie in a block.
    fn volcanoes(&self, block: [i64; 2]) -> Vec<Found> {
        let Some(fluvial) = self.world.relief().fluvial() else { return Vec::new() };
        // The corners of neighbouring blocks are the same points, so no volcano lies between blocks.
        let corner = |off: [i64; 2]| {
            place_at(self.world, [0, 1].map(|axis| (block[axis] + off[axis]) as f64 * VOLCANO_BLOCK_KM))
        };
        let [low, high] = [corner([0, 1]), corner([1, 0])];
        let found = |volcano: Volcano| {
            let at_km = at_km(self.world, volcano.middle);
            Found {
                id: format!("{}:{}:{}", volcano.kind.name(), volcano.node.0, volcano.node.1),
                name: None,
                at_km,
                distance_km: length([0, 1].map(|axis| at_km[axis] - self.near_km[axis])),
                around_km: (VOLCANO_WIDTH * volcano.radius_m / 1000.0).ceil(),
                values: vec![(Measure::Height, volcano.height_m.round())],
            }
        };
        let found = fluvial.volcanoes([low, high]).into_iter().map(found);
        found.filter(|found| self.query.keeps(&found.values)).collect()
    }

    /// Finds the nearest place of a square with a climate, if there is one. On a coast it lies at the shore, or at most
    /// a node inland if the climate is another at the shore: 32 km on Earth.
    fn biome(&self, letters: BiomeLetters, square: (i64, i64)) -> Option<Found> {
        let is_coast = self.query.beside == Some(Beside::Sea);
        let nodes = self.geography.biome_nodes(square, |biome| letters.has(biome));
        let candidates = |(node, sea): (Point, Option<Point>)| match sea {
            Some(sea) if is_coast => {
                let shore = self.coast(node, sea);
                vec![shore, shore.towards(node, 0.5), node]
            }
            _ if is_coast => Vec::new(),
            _ => vec![node],
        };
        let off_km = |at: Point| {
            let at_km = at_km(self.world, at);
            length([0, 1].map(|axis| at_km[axis] - self.near_km[axis]))
        };
        let mut places: Vec<(f64, Point)> = nodes.into_iter().flat_map(candidates).map(|at| (off_km(at), at)).collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        places.into_iter().take(LOOKS).find_map(|(distance_km, at)| {
            let setting = self.geography.settings_at(&[at])[0];
            let biome = setting.climate.biome(setting.land.planned_m().max(0.0));
            (setting.land.continent > 0.0 && letters.has(biome)).then(|| Found {
                id: format!("{}:{}:{}", biome.code(), at.x.div_euclid(GRAINS), at.y.div_euclid(GRAINS)),
                name: None,
                at_km: at_km(self.world, at),
                distance_km,
                around_km: BIOME_KM,
                values: Vec::new(),
            })
        })
    }

    /// Returns the last place on land on the way from a node to a node in the sea.
    fn coast(&self, mut land: Point, mut sea: Point) -> Point {
        for _ in 0..HALVINGS {
            let middle = land.towards(sea, 0.5);
            let [continent] = self.geography.continents([middle]);
            if continent > 0.0 {
                land = middle;
            } else {
                sea = middle;
            }
        }
        land
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::find::Finder;
    use crate::preset::Preset;

    fn finder() -> Finder {
        let (_, preset) = Preset::load("world").unwrap();
        Finder::of_world(Arc::new(World::new(preset, Some(3)).unwrap())).unwrap()
    }

    fn find(finder: &mut Finder, query: &str, near_km: [f64; 2], limit: usize) -> Vec<Found> {
        let query: Query = query.parse().unwrap();
        finder.find(&query, near_km, query.thing.radius_km(), limit, &Watch::default()).unwrap()
    }

    #[test]
    fn large_things_are_found_by_their_size_nearest_first() {
        let mut finder = finder();
        for (text, sizes) in [
            ("desert > 10000 km2", 1e4..1e8),
            ("continent", 1e6..1e8),
            ("sea > 100000 km2", 1e5..6e6),
            ("range > 20000 km2 < 1000000 km2", 2e4..1e6),
            ("island > 500 km2 < 5000 km2", 500.0..5e3),
        ] {
            let found = find(&mut finder, text, [300.0, -900.0], 4);
            assert_eq!(found.len(), 4, "{text}: {found:?}");
            assert!(found.is_sorted_by(|a, b| a.distance_km <= b.distance_km), "{text}: {found:?}");
            for one in &found {
                let [(Measure::Area, km2)] = one.values[..] else { panic!("{one:?}") };
                assert!(sizes.contains(&km2) && one.name.is_some() && one.distance_km < 5000.0, "{text}: {one:?}");
            }
            // From a place beside, the nearest of these is the nearest still.
            let there = find(&mut finder, text, found[1].at_km, 1);
            assert_eq!(there[0].id, found[1].id, "{text}");
        }
    }

    #[test]
    fn climates_are_found_where_the_geography_has_them() {
        let mut finder = finder();
        for (text, letters, most) in [("biome = Csb", "Csb", 1.0), ("biome = BW on coast", "BW", 0.1)] {
            let found = find(&mut finder, text, [0.0, 0.0], 2);
            assert_eq!(found.len(), 2, "{text}: {found:?}");
            for one in found {
                let at = place_at(finder.world(), one.at_km);
                let setting = finder.world().geography().unwrap().settings_at(&[at])[0];
                let biome = setting.climate.biome(setting.land.planned_m().max(0.0));
                assert!(biome.code().starts_with(letters) && one.id.starts_with(letters), "{biome:?}: {one:?}");
                assert!((-1e-6..most).contains(&setting.land.continent), "{text}: {setting:?}");
            }
        }
    }

    #[test]
    fn volcanoes_are_found_where_they_stand_nearest_first() {
        let mut finder = finder();
        let found = find(&mut finder, "volcano > 1500 m", [1900.0, 3000.0], 3);
        assert!(found.len() == 3 && found.is_sorted_by(|a, b| a.distance_km <= b.distance_km), "{found:?}");
        for one in &found {
            let [(Measure::Height, height_m)] = one.values[..] else { panic!("{one:?}") };
            assert!(height_m > 1500.0 && one.distance_km < 1000.0 && one.around_km < 60.0, "{one:?}");
            let land = finder.world().geography().unwrap().land_at_large(&[place_at(finder.world(), one.at_km)])[0];
            assert!(land.volcanism > 0.0, "{one:?}: {land:?}");
        }
        // From a place beside, the nearest of these is the nearest still.
        let there = find(&mut finder, "volcano > 1500 m", found[2].at_km, 1);
        assert_eq!(there[0].id, found[2].id);
    }

    #[test]
    fn a_world_of_one_land_has_nothing_large() {
        let (_, preset) = Preset::load("alps").unwrap();
        let mut finder = Finder::new(preset, None).unwrap();
        for text in ["desert", "biome = Csb", "volcano"] {
            let query: Query = text.parse().unwrap();
            let error = finder.find(&query, [0.0; 2], 200.0, 1, &Watch::default()).unwrap_err();
            assert!(error.exit_code() == 2 && error.hint().is_some_and(|hint| hint.contains("world")), "{error}");
        }
    }
}
