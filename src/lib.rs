//! terrane bakes endless procedural terrain, offline, into maps and assets.
//!
//! ```
//! use terrane::{area::TileId, preset::Preset, tile::Tile, world::World};
//!
//! let (_, preset) = Preset::load("thesis")?;
//! let world = World::new(preset, Some(7))?;
//! let tile = Tile::new(&world, TileId { x: 1_000_000_000, y: -1_000_000_000 });
//! let (lowest_m, highest_m) = world.height_range_m();
//! assert!(tile.heights().values().iter().all(|height_m| (lowest_m..=highest_m).contains(height_m)));
//! # Ok::<(), terrane::error::Error>(())
//! ```
//!
//! # Three promises
//!
//! 1. **One world.** A tile's bytes depend on the version, the preset, the seed and the tile's place: not on the
//!    window that was baked, its order, the threads, the CPU, or what was baked before.
//! 2. **No seams.** Heights, normals and blend weights agree exactly at a shared edge, without blending or skirts.
//! 3. **Endless, in bounded memory.** Coordinates are 64-bit integers, and the terrain at tile (10^9, -10^9) is as
//!    smooth as at (0, 0). Memory grows with a row of tiles, and nothing is stored to make a tile again.
//!
//! # How data flows
//!
//! ```text
//!   preset/     text -> Preset, with every key checked               a user's recipe; recipe/: what all settings share
//!      |
//!   world.rs    Preset + seed -> World                               ranges proved, pads added up
//!      |
//!   relief/     World, area -> heights in metres                     pad 0
//!      |          noise/ over simd.rs: fractals of simplex noise
//!      |          fluvial/: rivers first, then the land between them; a river is followed to its end
//!   agents/     bare heights -> rivers and roads, whole              reach: the tiles that a path may cross
//!      |
//!   places/     fluvial land -> settlements, roads between them      reach: 2 site cells
//!      |
//!   tile/       heights, paths, roads -> carved, graded -> normals -> blend weights   pad HEIGHT_PAD = 1
//!      |
//!   features/   World, area -> rivers, lakes, coasts, peaks, sites, roads, with attributes and names
//!      |
//!   mesh/       heights -> triangles, all or few within a bound; waters, roads    an edge looks at its own heights only
//!      |
//!   bake/       Region -> all its tiles, in parallel, in order
//!      |
//!   export/     tiles, features -> files, map/ -> pictures; registry.rs, a log and never an input; profiles, plan, manifest
//!      |
//!   experiment/ World, camera -> timings, tables, charts             the thesis' measurement and method
//!      |
//!   cli/        the command, a thin layer on all this                the only part that prints
//! ```
//!
//! The modules below stand in this order, after the small ones that all use: [`error`], [`area`], [`grid`], [`hash`],
//! [`clock`]. Each layer is a pure function of the world and of lattice coordinates and reads only the layers above it,
//! within a pad that stands in one place ([`world::HEIGHT_PAD`]); no tile ever looks at a neighbouring tile.
//! One is an exception to the order: [`agents::walker`], the endless terrain around a walker, which stands on tiles and whose agents look at neighbours.
//!
//! # Words
//!
//! | Word | Meaning |
//! |---|---|
//! | vertex lattice | all integer points (x east, y south), `i64`, `spacing_m` metres apart |
//! | cell | the square between four vertices |
//! | tile | N x N cells and so (N+1) x (N+1) vertices; neighbours share those of their edge |
//! | area | a half-open rectangle of vertices |
//! | region | the rectangle of tiles that one bake covers |
//! | pad | how far around its area a stage must read |
//! | preset / world | the recipe as written / as checked and resolved |
//! | blend map | how much of each ground material a vertex has; the weights of a vertex sum to exactly 255 |
//! | reach | how far a river or road sticks out of the tile that owns it |
//! | path, way | a river or a road, whole / its bed |
//! | sink, export | a consumer of finished tiles: a format |
//!
//! # Units and axes
//!
//! Metres, x east, y south, height up. Row 0 of every raster is its northern edge. A 16-bit height is
//! `round((h - min_m) / (max_m - min_m) * 65535)` over the range that the world proves from its preset
//! ([`world::World::height_range_m`]), never over what a tile happens to hold, so files of two bakes agree.
//!
//! # Numbers
//!
//! Lattice coordinates are integers; an octave of noise splits them exactly into a lattice cell and a fraction, and
//! only the fraction is `f32`. All that shapes bytes uses `+ - * /` and `sqrt`, which IEEE 754 defines to the bit, in
//! one order for all instruction sets; where a constant needs more, it is computed once with `libm`.

pub mod error;
pub mod area;
pub mod grid;
pub mod hash;
pub mod geometry;
pub mod clock;
mod memory;
pub mod device;
pub mod simd;

pub mod noise;
pub mod recipe;
pub mod land;
pub mod lines;
pub mod names;
pub mod fluvial;
pub mod relief;
pub mod places;
pub mod agents;
pub mod preset;
pub mod world;
pub mod tile;
pub mod features;
pub mod mesh;
pub mod map;
pub mod bake;
pub mod registry;
pub mod export;
pub mod walker;
pub mod experiment;
#[cfg(feature = "cli")]
pub mod cli;
