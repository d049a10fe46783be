//! Maps: top-down pictures of the land.
//!
//! ```text
//! World, Scale --> terrain.rs   land at the nodes that the scale needs, and at the pixels between
//!                  relief.rs    tints, what the ground is made of, light and shadow; sky.rs
//!                  signs.rs     strokes on rock and slopes, stones of scree
//! Style (TOML) --> contour.rs   lines of equal height, outlines.rs with numbers
//!                  drawing.rs   rivers, lakes, roads and places as lines and areas in pixels; houses.rs
//!                  ranges.rs    mountain ranges and valleys, from afar
//!                  climb.rs     high ground from afar to the peak there; summits.rs
//!                  text.rs      shaped names, label.rs their places, within a frame.rs if there is one
//!                      |
//!                  chart.rs     a block of pixels of all that: every map of a style and a scale has the same
//!                      |
//!                  sheet.rs     a frame, a grid, a scale bar and a legend around it; atlas.rs, many of them
//!
//! Tile         --> plain.rs     the same of tiles, a pixel a vertex, for bakes
//! ```

pub mod atlas;
pub(crate) mod colour;
mod canvas;
mod chart;
mod climb;
pub(crate) mod contour;
mod drawing;
pub mod font;
mod frame;
mod generalise;
mod houses;
mod light;
mod outlines;
mod plain;
pub(crate) mod plotter;
mod ranges;
mod relief;
mod rows;
pub mod label;
mod names;
pub mod scale;
pub mod sheet;
mod signs;
mod sky;
pub mod style;
mod summits;
mod symbols;
mod terrain;
pub mod text;
mod tint;

pub use chart::{Chart, Picture};
pub use plain::MapPainter;
