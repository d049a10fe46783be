//! `terrane walk`.

use std::path::{Path, PathBuf};

use crate::area::TileId;
use crate::cli::args::WalkArguments;
use crate::cli::bake::{carry_out, on_device};
use crate::cli::console::Console;
use crate::error::Error;
use crate::export::{Export, Plan};
use crate::walker::{Tour, Walk, Way};
use crate::world::World;

/// Walks the way that the command line asks for, and bakes the tiles that the walker comes to.
pub(super) fn run(arguments: &WalkArguments, console: &Console) -> Result<(), Error> {
    let WalkArguments { world: asked, export, names, vectors, folder, manner, .. } = arguments;
    // Check all options before anything is written.
    let sources = arguments.sources()?;
    let name = sources.name().to_owned();
    let preset = sources.read_all()?;
    let moved = preset.warnings(&sources);
    let world = World::new(preset, asked.seed)?;
    let tour = arguments.tour()?;
    console.warnings(&[moved, world.warnings()].concat());
    let out = folder.out.clone().unwrap_or_else(|| default_folder(&name, &world, &tour, arguments.path.as_deref()));
    let plan = Plan::of_walk(&world, &name, Walk::new(tour, &world)?, Export::parse_list(export)?)?
        .with_vectors(vectors.options())?
        .with_names(*names);
    plan.check_options(&vectors.given())?;
    let plan = on_device(plan, manner, console)?;
    carry_out(&plan, folder.mode(), &out, &manner.run, console)
}

/// Returns the default folder of a walk: a different one for each seed and way.
fn default_folder(name: &str, world: &World, tour: &Tour, path: Option<&Path>) -> PathBuf {
    let way = match &tour.way {
        Way::Camera { at: TileId { x, y }, minutes, .. } => format!("x{x}-y{y}-{minutes}min"),
        Way::Path { .. } => path.and_then(Path::file_stem).unwrap_or_default().to_string_lossy().into_owned(),
    };
    Path::new("out").join(format!("{name}-seed{}-walk-{way}", world.seed()))
}
