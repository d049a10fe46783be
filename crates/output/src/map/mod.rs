//! Maps: top-down pictures of the land.
//!
//! ```text
//! World, Scale --> terrain.rs   land at the nodes that the scale needs, and at the pixels between
//!                  relief.rs    tints, materials of the ground, light and shadow; sky.rs open sky, cast shadows
//!                  climate_colours.rs   colours of the ground by climate
//!                  signs.rs     strokes on rock and slopes, stones of scree
//! Style (TOML) --> contour_lines.rs   contours; outlines.rs adds their numbers
//!                  drawing.rs   rivers, lakes, roads and settlements as lines and areas in pixels; houses.rs
//!                  ranges.rs    mountain ranges and valleys, found in coarse land
//!                  realms.rs    continents, oceans, deserts and so on of a whole world
//!                  climb.rs     from high ground in coarse land to the peak there; summits.rs
//!                  text.rs      shapes names; label.rs places them, within a frame.rs if there is one
//!                      |
//!                  chart.rs     draws all of this in blocks of pixels, the same in every map of a style and a scale
//!                      |
//!                  sheet.rs     a frame, a grid, a scale bar and a legend around the map; atlas.rs many sheets
//!
//! Tile         --> plain.rs     maps of tiles for bakes, one pixel for each vertex
//! ```

pub mod atlas;
pub(crate) mod colour;
mod canvas;
mod chart;
mod climate_colours;
mod climb;
pub(crate) mod contour_lines;
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
mod realms;
mod relief;
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
mod weighted_sums;

pub use chart::{Chart, Picture};
pub use plain::MapPainter;
