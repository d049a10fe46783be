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
//! 1. **One world.** A tile's bytes depend on the version, the preset, the seed and the tile's place: not on the window
//!    that was baked, the order of tiles, the threads, the CPU, or earlier bakes.
//! 2. **No seams.** Heights, normals and blend weights agree exactly at a shared edge, without blending or skirts.
//! 3. **Endless, in bounded memory.** Worlds reach 2^53 vertices from the origin ([`area::MAX_COORDINATE`]), and the
//!    terrain at tile (10^9, -10^9) is as smooth as at (0, 0). Memory grows with a row of tiles, and nothing is stored
//!    to make a tile again.
//!
//! # How data flows
//!
//! The modules below stand in the order of this diagram, and a file imports only from modules above its own, which a
//! test checks. The first two parts are crates of their own, so that they compile in parallel. Each layer is a pure
//! function of the world and of lattice coordinates, and no tile ever looks at a neighbour.
//!
//! ```text
//!   terrane-engine
//!
//!   error, area, grid, hash, geometry, contour, stop, clock, watch, threads, memory, generator, simd, wgsl   what all use
//!      |
//!   noise/      fractals of simplex noise on the lanes of simd
//!   recipe/     text of an author -> a preset or a style; what all settings share: key paths, faults, checks, masks
//!   land        heights and the water on them
//!   lines/      one type for rivers and roads, and the imprint that they leave in land        input: 9 vertices more
//!   names       names of rivers, lakes, peaks and settlements
//!      |
//!   fluvial/    rivers first, then the land between them; lakes, coasts, peaks; a survey for planners
//!   relief/     World, area -> land: of noise, or fluvial                                     input: the area
//!   places/     survey -> settlements, and roads between them: lines                          reach: 2.5 site cells
//!   agents/     bare heights -> the thesis' rivers and roads: lines                   reach: the tiles they may cross
//!      |
//!   preset/     text -> Preset: a user's recipe, every key checked by the stage that reads it
//!   world       Preset + seed -> World: ranges proved, memories bounded
//!   tile/       land, lines -> imprint -> normals -> blend weights; the digest of each part
//!               on request: slope, curvature, accumulation, wetness, growth               input: 65 vertices more
//!   device/     areas -> their land and tiles: by the CPU, or by a GPU with the same bits
//!   walker/     the endless terrain around a walker, whose agents look at neighbours; the tiles of a walk
//!   features/   World, area -> rivers, lakes, coasts, roads, sites, peaks, crossings with typed attributes
//!   find/       "lake > 2 km2", a place -> the nearest such lakes, searched on coarse land first
//!
//!   terrane-output
//!
//!   mesh/       tile -> triangles: land into which banks and shores are cut, water between them, roads
//!                                                                              input: lines some 24 vertices around
//!   map/        World, style, scale -> a sheet: relief, lines, names                  reach: the names around it
//!               tile -> its plain picture
//!      |
//!   file/       files that are whole or not there, and all errors of the disk
//!   registry    the list of tiles and files that there are; a log and never an input of a bake
//!   bake/       Region -> all its tiles, in parallel, in order, to sinks; a walk -> its tiles as it goes on;
//!               the journal from which either resumes; a shard -> a file of what its sinks keep
//!   web/        pictures at any scale -> a pyramid of tiles, packed for the web, and a page that shows it
//!   export/     a file for each format, and the list of formats; profiles, plan, manifest; the folder of a bake;
//!               shards -> a bake
//!
//!   terrane
//!
//!   shell       commands as somebody types them
//!   experiment/ World, camera -> timings, tables, charts: the thesis' measurement
//!   explore/    the endless world in a browser, drawn while somebody looks
//!   cli/        the command, a thin layer on all this, and the only part that prints
//! ```
//!
//! A stage that reads an area around the one that it makes has a function `input(area) -> area`, and its callers
//! combine these functions: [`tile::shaped_input`] for normals and weights, [`lines::Imprint::input`] for drains, and
//! [`tile::accumulation_input`] for accumulation, which uses land of its own. For each a test fills everything outside
//! the input with NaN and finds the result unchanged.
//!
//! The same world can be had at the nodes of a [stride](area::Stride), every 2^k-th vertex: with
//! [`world::World::strided`], with [`at_stride`](world::World::at_stride) of an open world, or coarser, for a quick
//! picture, with [`sketch_at_stride`](world::World::sketch_at_stride). Areas, tiles and lines are then counted in
//! nodes, and all layers below `relief` are the same. Details too small for the nodes are left out before they cost
//! anything, and are kept in the mean.
//!
//! # Words
//!
//! | Word | Meaning |
//! |---|---|
//! | vertex lattice | all integer points (x east, y south), `i64`, `spacing_m` metres apart |
//! | cell | the square between four vertices |
//! | tile | N x N cells and so (N+1) x (N+1) vertices; neighbours share those of their edge |
//! | area | a half-open rectangle of vertices |
//! | region | the rectangle of tiles that one bake covers, or that holds all tiles of a walk |
//! | walk, route | the tiles that a walker comes to on its way / those of them that it is in, in order |
//! | input | the area that a stage reads to make an area |
//! | reach | how far a river or road sticks out of the tile or site that owns it |
//! | preset / world | the recipe as written / as checked and resolved |
//! | settings | what a preset says to one stage |
//! | fault | what is wrong with a setting, and under which key |
//! | stream | one use of chance, with its number in the register ([`hash::Stream`]) |
//! | land | heights and the water on them |
//! | survey | land as planners ask for it: sparse heights and waters, rivers as lines |
//! | line | a river or a road, whole: points with place, level, floor, half width and discharge |
//! | structure | what carries a line where the land does not: a bridge, a tunnel, a ford |
//! | bed | what a line does to the land: natural, dug, trodden or built |
//! | imprint | what all lines together do to an area |
//! | piece | a straight part of a line as some stage sees it: of a river, a road, a bed, a lake |
//! | channel, segment | a watercourse of the network, wet or dry / a straight part of it |
//! | trunk, tributary | a channel of the coarsest level / of one below |
//! | course, part | the way of a river or a road from end to end / what lakes, or other roads, leave of it |
//! | alignment, profile | the middle of a road as planned / its heights |
//! | site, site cell | a settlement / the square of the lattice that holds one at most |
//! | plan, node | the coarse lattice on which sites and roads are found / a point of it |
//! | route, move, leg | the nodes of a planned road / a straight way from one node to another / one of a route |
//! | trace | the nodes of an agent's way |
//! | span | the points of a road that are carried over water, or go through it |
//! | landform, feature | a lake, coast or peak as found / anything that maps and vectors show, with attributes |
//! | blend map | how much of each ground material a vertex has; the weights of a vertex sum to exactly 255 |
//! | accumulation | square metres of land that drain through a vertex, from a bounded way upstream and of rivers whole |
//! | growth, instance | what stands on the ground: trees, shrubs, grass, loose rocks / a single one |
//! | knot | a point of a line through which an engine's curve runs |
//! | part of a tile, digest | one kind of what it holds, such as its heights / the BLAKE3 of each |
//! | colour channel | one of the numbers of a pixel, as image formats call it |
//! | scale, pixel | metres that a pixel of a map shows, and pixels to a millimetre of paper / the square of the world that it is |
//! | chart, picture, sheet | all maps of a world in one style and scale / a part of one / that with a frame and a legend around it |
//! | style | how maps are drawn: a file of its own, never a part of a world |
//! | shard, merge | one of some rectangles of a region that are baked by themselves / what makes the bake of the region of them all |
//! | format, sink | a way to write a bake / what writes one bake so |
//! | piece of a sink, journal | what it keeps of a tile until it writes it / where a bake under way has those of all its tiles |
//! | memory, budget | values of a pure function that are kept for a while, bounded by bytes / the bytes that several memories share |
//!
//! # Units and axes
//!
//! Metres, x east, y south, height up. Row 0 of every raster is its northern edge. A 16-bit height is `round((h -
//! min_m) / (max_m - min_m) * 65535)` over the range that the world proves from its preset
//! ([`world::World::height_range_m`]), never over the heights of one tile, so files of two bakes agree.
//!
//! # Numbers
//!
//! Lattice coordinates are integers; an octave of noise splits them exactly into a lattice cell and a fraction, and
//! only the fraction is `f32`. All arithmetic that shapes bytes uses `+ - * /` and `sqrt`, which IEEE 754 defines to
//! the bit, in one order for all instruction sets; a constant that needs other functions is computed once with `libm`.

#[doc(inline)]
pub use terrane_engine::{
    agents, area, clock, contour, device, error, features, find, fluvial, generator, geometry, grid, hash, land, lines,
    memory, names, noise, places, preset, recipe, relief, simd, stop, threads, tile, walker, watch, world,
};
#[doc(inline)]
pub use terrane_output::{bake, export, map, mesh, registry, web};

// Public in `terrane_output` for this crate alone.
use terrane_output::file;

#[cfg(any(feature = "cli", feature = "explore"))]
mod shell;

pub mod experiment;
#[cfg(feature = "explore")]
pub mod explore;
#[cfg(feature = "cli")]
pub mod cli;
