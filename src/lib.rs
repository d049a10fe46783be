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
//!   stop, error, area, grid, hash, grain_point, geometry, contour, clock, watch, threads, memory, generator, simd, wgsl   what all use
//!      |
//!   noise/      fractals of simplex noise on the lanes of simd
//!   recipe/     text of an author -> a preset or a style; what all settings share: key paths, faults, checks, masks
//!   geography/  what lies where at large: plates, continents, uplift, climate, biome           a function of place
//!               realms: continents, seas, deserts, each as one thing               input: as long as a realm may be
//!   land        heights and the water on them
//!   lines/      one type for rivers and roads, and the imprint that they leave in land        input: 9 vertices more
//!   names/      names of rivers, lakes, peaks, settlements and realms, in the tongues of the peoples of a world
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
//!               "desert > 10000 km2" -> the nearest, on the nodes of the geography alone
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
//! Each word is the name of a type or a module and has one meaning.
//!
//! | Word | Meaning |
//! |---|---|
//! | [area](area::Area) | a rectangle of vertices; its far edges are not part of it |
//! | [stride](area::Stride) | the distance between the nodes at which a world is made: every 2^k-th vertex |
//! | [tile](tile::Tile) | N x N cells, so (N+1) x (N+1) vertices; neighbours share those of their edge |
//! | [region](area::Region) | the rectangle of tiles that one bake covers |
//! | [preset](preset::Preset) | the recipe of a world, as it is written |
//! | [world](world::World) | a checked preset with a seed, from which any tile can be made |
//! | [stream](hash::Stream) | one use of chance, with its own number, so that no two uses share their luck |
//! | [realm](geography::realms::Realm) | a continent, sea, island, desert, plain or range of a whole world |
//! | [relief](relief::Relief) | the maker of bare land: of noise, or of rivers |
//! | [land](land::Land) | heights, and the water on them |
//! | [network](fluvial::network::Network) | all channels of a world, from trunks down to brooks |
//! | [channel](fluvial::channel::Channel) | the middle line of a valley, wet or dry, from head to mouth |
//! | [survey](fluvial::survey::Survey) | the land as planners see it: sparse heights and waters, rivers as lines |
//! | [site](places::site::Site) | a settlement; each cell of their lattice has one at most |
//! | [line](lines::Line) | a whole river or road: its middle points with heights and widths |
//! | [structure](lines::Structure) | a bridge, tunnel or ford, which carries a line where the land does not |
//! | [bed](lines::Bed) | the way in which a line changes the land: natural, dug, trodden or built |
//! | [imprint](lines::Imprint) | the effect of all lines together on an area |
//! | [agents] | the makers of rivers and roads of the thesis, which search their way from tile to tile |
//! | [walk](walker::Walk) | the tiles that a walker comes to, in order |
//! | [blend](tile::Blend) | shares of the ground materials at each vertex, which sum to exactly 255 |
//! | [growth](tile::Growth) | a kind of thing that stands on the ground: trees, shrubs, grass or rocks |
//! | [instance](tile::Instance) | a single tree, shrub or rock, with its place |
//! | [digest](tile::Digest) | the BLAKE3 hash of each part of a tile |
//! | [style](map::style::Style) | the look of maps: colours, widths, fonts; never a part of a world |
//! | [scale](map::scale::Scale) | metres of the world to a pixel, and pixels to a millimetre of paper |
//! | [chart](map::Chart) | all maps of one world in one style and scale |
//! | [picture](map::Picture) | a rectangle of a chart |
//! | [sheet](map::sheet::Sheet) | a picture with a frame, a grid and a legend around it |
//! | [profile](export::Profile) | the formats, sizes and names of files that an engine takes |
//! | [manifest](export::Manifest) | `bake.json`: the record of a bake and of all its files |
//! | [registry] | `registry.sqlite`: the list of all tiles and files of a bake |
//! | [shard](bake::Shard) | a part of a region that one machine bakes by itself |
//! | [memory](memory::Memory) | a cache of a pure function, bounded in bytes |
//! | [budget](memory::Budget) | the bytes that several memories share |
//!
//! # Units and axes
//!
//! Metres, x east, y south, height up. A *vertex* is a point of the world's lattice: whole numbers x and y, `spacing_m`
//! metres apart. A *cell* is the square between four vertices, and a *node* is a vertex of a coarser lattice.
//!
//! Row 0 of every raster is its northern edge. A 16-bit height is `round((h - min_m) / (max_m - min_m) * 65535)` over
//! the range that the world proves from its preset ([`world::World::height_range_m`]), never over the heights of one
//! tile, so files of two bakes agree.
//!
//! # Numbers
//!
//! Lattice coordinates are integers; an octave of noise splits them exactly into a lattice cell and a fraction, and
//! only the fraction is `f32`. All arithmetic that shapes bytes uses `+ - * /` and `sqrt`, which IEEE 754 defines to
//! the bit, in one order for all instruction sets; a constant that needs other functions is computed once with `libm`.

#[doc(inline)]
pub use terrane_engine::{
    agents, area, clock, contour, device, error, features, find, fluvial, generator, geography, geometry, grain_point,
    grid, hash, land, lines, memory, names, noise, places, preset, recipe, relief, simd, stop, threads, tile, walker,
    watch, world,
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
