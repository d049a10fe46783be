//! Properties of all layers, whatever their features.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::layer::{MakeRow, ValueKind};
use super::*;
use crate::area::Area;
use crate::clock::Clock;
use crate::geometry::LineSegment;
use crate::preset::Preset;

/// A preset with lakes, a coast, settlements and roads within a few hundred vertices of the origin.
const FLUVIAL: &str = include_str!("../../../../tests/settled.toml");

const AGENTS: &str = "
    tile_cells = 32
    noise = [{ kind = \"ridged\", height_m = 60.0, wavelength_m = 500.0, octaves = 4 }]
    rivers = { density = 1.0, width_m = [1.0, 4.0], bank_m = 3.0 }
    roads = { density = 1.0 }
";

fn world(text: &str) -> World {
    World::new(Preset::parse("test", text).unwrap(), Some(5)).unwrap()
}

/// The rows of a layer by key.
type RowsByKey = BTreeMap<Vec<u8>, Row>;

fn rows(layer: &dyn AnyLayer, world: &World, area: &Area) -> RowsByKey {
    let mut rows = BTreeMap::new();
    let insert = &mut |key, row: &MakeRow<'_>| {
        rows.insert(key, row()?);
        Ok(())
    };
    layer.visit(world, area, &Clock::default(), insert).unwrap();
    rows
}

/// Returns a fluvial world with an area around its origin. The world is made once and shared by the tests.
fn fluvial() -> (&'static World, Area) {
    static WORLD: LazyLock<World> = LazyLock::new(|| world(FLUVIAL));
    (&WORLD, Area::new(-256, -256, 385, 385))
}

/// Returns the rows of each layer in two overlapping areas. The second area is asked of a fresh world, which remembers
/// nothing of the first.
fn in_windows(text: &str, (first, one): (&World, Area), other: Area) -> Vec<(&'static dyn AnyLayer, [RowsByKey; 2])> {
    let second = world(text);
    let both = |layer| (layer, [rows(layer, first, &one), rows(layer, &second, &other)]);
    layers(first).iter().map(|layer| both(*layer)).collect()
}

#[test]
fn a_feature_of_agents_is_the_same_in_every_window() {
    check_windows(in_windows(AGENTS, (&world(AGENTS), Area::new(-96, -64, 193, 161)), Area::new(-10, -33, 400, 65)));
}

/// The test suite compares files that were written from windows; this slow comparison of the rows themselves is left to
/// `.ci/run`.
#[test]
#[ignore = "slow for its own sake"]
fn a_feature_of_fluvial_land_is_the_same_in_every_window() {
    check_windows(in_windows(FLUVIAL, fluvial(), Area::new(-100, -200, 320, 330)));
}

fn check_windows(layers: Vec<(&dyn AnyLayer, [RowsByKey; 2])>) {
    let mut alone = 0;
    for (layer, [first, second]) in &layers {
        let shared: Vec<_> = first.iter().filter(|(key, _)| second.contains_key(*key)).collect();
        assert!(!shared.is_empty(), "no {} are in both windows", layer.name());
        assert!(shared.iter().all(|(key, row)| second[*key] == **row), "{} differ", layer.name());
        alone += first.len() + second.len() - 2 * shared.len();
        for row in first.values().chain(second.values()) {
            check_kinds(*layer, row);
        }
    }
    assert!(alone > 0, "the windows are one");
}

/// Checks that the values of a row have the types that the layer's columns declare.
fn check_kinds(layer: &dyn AnyLayer, row: &Row) {
    let heads = layer.heads();
    assert_eq!(heads.len(), row.values.len(), "{}", layer.name());
    for (head, value) in heads.iter().zip(&row.values) {
        let is_right = match value {
            Value::Nothing => !head.required,
            Value::Integer(_) => head.kind == ValueKind::Integer,
            Value::Real(_) => head.kind == ValueKind::Real,
            Value::Real32(_) => head.kind == ValueKind::Real32,
            Value::Text(_) => head.kind == ValueKind::Text,
        };
        assert!(is_right, "{}: {value:?} is no {head:?}", layer.name());
    }
}

#[test]
fn typed_features_are_found_once_and_sorted() {
    let (world, area) = fluvial();
    let sites = sites::SITES.find(world, &area, &Clock::default()).unwrap();
    assert!(sites.len() > 2, "{sites:?}");
    assert!(sites.is_sorted_by(|a, b| a.id.to_string() < b.id.to_string()));
    let roads = lines::ROADS.find(world, &area, &Clock::default()).unwrap();
    assert!(roads.len() > 2);
    for road in &roads {
        for (id, end) in road.sites.iter().zip([road.line[0], road.line[road.line.len() - 1]]) {
            // The settlement at the end of a road is in the table. The road ends there or on another road that cuts it
            // short; lines are simplified to 25 cm.
            let site = sites.iter().find(|site| site.id == *id).unwrap_or_else(|| panic!("no {id}"));
            let end = [end[0], end[1]];
            let [x, y] = [end[0], -end[1]].map(|metres| (metres / world.spacing_m()).round() as i64);
            let near = || lines::ROADS.find(world, &Area::new(x, y, 1, 1).padded(1), &Clock::default()).unwrap();
            let is_on = |other: &lines::RoadFeature| {
                let flat = |at: &[f64; 3]| [at[0], at[1]];
                let pieces = other.line.windows(2).map(|ends| LineSegment::between(flat(&ends[0]), flat(&ends[1])));
                other.id != road.id && pieces.into_iter().any(|piece| piece.distance(end) < 0.3)
            };
            assert!(
                site.at == end || roads.iter().any(is_on) || near().iter().any(is_on),
                "{} ends at {end:?}",
                road.id
            );
        }
    }
    let crossings = lines::CROSSINGS.find(world, &area, &Clock::default()).unwrap();
    assert!(!crossings.is_empty());
    assert!(crossings.iter().all(|crossing| roads.iter().any(|road| road.id == crossing.road)));
}
