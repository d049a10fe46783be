//! The explorer: shows the endless world in a browser and draws its tiles while somebody looks.
//!
//! ```text
//!   tile_address.rs zoom levels and the places of tiles
//!   heap.rs         freed memory, back to the system
//!   request.rs      addresses -> requests; who may send them, and what is wrong with them
//!   cache.rs        drawn tiles on the disk, within a limit
//!   queue.rs        requests -> threads, in lanes for quick and slow work; work that nobody waits for is stopped
//!   worlds.rs       preset, seed, settings -> an open world, by its identity
//!   charts.rs       an open world -> its maps at each zoom level
//!   tiles.rs        a tile -> its picture, heights and names
//!   search.rs       "lake > 2 km2" -> the lakes near the middle of the view
//!   bakes.rs        a rectangle -> the command that bakes it, what it takes, its progress
//!   save_preset.rs  a world -> a preset file
//!   page.rs         the files of the page
//!   server.rs       HTTP on this machine's own address
//! ```
//!
//! A tile of the page is a tile of a web map ([`crate::web`]): a square of pixels, counted from the world's origin,
//! which [`Chart`](crate::map::Chart) draws in any style. A zoom level has columns and rows as far as the world
//! reaches.
//!
//! Each tile is drawn in two stages. The draft has relief and waters of coarser land and takes a second or so. The full
//! picture also has contours, roads, places and names, for which all the land around must be planned. Until the draft
//! is there, the page shows a glance: an even coarser picture of the tile two zoom levels up. One lane of threads draws
//! glances and drafts and another one full pictures, so that an empty part of the screen never waits for a tile that
//! has its draft. A third lane serves what somebody points at, and waits for neither.
//!
//! All worlds at all scales share one [budget](crate::memory::Budget) for what they remember, so memory does not grow
//! with what is looked at.

mod tile_address;
mod heap;
mod request;
mod cache;
mod queue;
mod worlds;
mod charts;
mod tiles;
mod search;
mod bakes;
mod save_preset;
mod page;
mod server;

pub use server::{Options, Server};
pub use worlds::Given;
