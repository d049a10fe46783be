//! A small world and the bake of its vectors, for the tests that look at what bakes leave.

use std::path::Path;
use std::sync::LazyLock;

use terrane::area::Region;
use terrane::export::{Export, Mode, Output, Plan};
use terrane::preset::Preset;
use terrane::watch::Watch;
use terrane::world::World;

/// Fluvial land with lakes, a coast and settlements within a few tiles of the origin.
pub const FLUVIAL: &str = include_str!("../settled.toml");

/// That world, which all tests of the process share.
pub fn settled() -> &'static World {
    static WORLD: LazyLock<World> = LazyLock::new(fresh);
    &WORLD
}

/// That world, of nobody else: nothing of it is remembered.
pub fn fresh() -> World {
    World::new(Preset::parse("test", FLUVIAL).unwrap(), Some(5)).unwrap()
}

/// The same without settlements.
pub fn unsettled() -> &'static str {
    FLUVIAL.split_once("[places]").unwrap().0
}

/// Bakes a region into both formats of vectors, so many files in all, on so many threads.
pub fn bake_vectors(world: &World, region: Region, threads: usize, out: &Path, files: usize) {
    let plan = Plan::new(world, "test", region, Export::parse_list("vector,geojson").unwrap()).unwrap();
    let cost = plan.cost(threads);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let output = Output::prepare(out, Mode::New, &plan, &cost).unwrap();
    let manifest = pool.install(|| plan.run(&output, &Watch::default())).unwrap();
    // The list has all but the manifest.
    assert_eq!((manifest.files.len() + 1, cost.files), (files, files as u64));
}
