//! An explorer: a page of the endless world in a browser, drawn while one looks.
//!
//! ```text
//!   spot.rs      zoom levels and the places of tiles                            heap.rs     freed memory, back to the system
//!   request.rs   addresses -> what is asked for, and by whom; what is wrong with it
//!   cache.rs     what was drawn, on the disk within a limit
//!   queue.rs     what is asked for -> threads: what is looked at first; what nobody waits for any more is stopped
//!   worlds.rs    preset, seed, settings -> an open world, by its identity       charts.rs   its maps at each zoom level
//!   tiles.rs     a tile -> its picture, heights and names                       search.rs   "lake > 2 km2" -> where they are
//!   bakes.rs     a rectangle -> the command that bakes it, what it takes, its progress        saved.rs   a preset as a file
//!   page.rs      the page itself        server.rs   HTTP on this machine's own address
//! ```
//!
//! A tile of the page is a tile of a web map ([`crate::web`]): so many pixels of the world, counted from its origin, drawn by
//! [`Chart`](crate::map::Chart) in any style. Zoom levels have no end in columns and rows, only the range of the world.
//!
//! Each is drawn twice. A draft has relief and waters, of coarser land, and takes a second or so; the full picture also contours, roads,
//! places and names, for which all that lies around must be planned. Before either there is a glance at a tile two levels up. Two lanes of
//! threads draw them, so that what is new on the screen never waits for what is already there as a draft; a third is for what somebody
//! points at, which waits for neither.
//!
//! What all worlds at all scales remember shares one [budget](crate::memory::Budget), so that nothing grows with what is looked at.

mod spot;
mod heap;
mod request;
mod cache;
mod queue;
mod worlds;
mod charts;
mod tiles;
mod search;
mod bakes;
mod saved;
mod page;
mod server;

pub use server::{Options, Server};
pub use worlds::Given;
