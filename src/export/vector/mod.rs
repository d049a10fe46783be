//! Features as files that hold vectors.
//!
//! ```text
//!   store.rs        features, tile by tile -> each once, sorted
//!   geopackage.rs   store -> one database        geojson.rs   store -> a text a layer
//! ```

mod geojson;
mod geopackage;
mod store;

pub(super) use geojson::GeoJson;
pub(super) use geopackage::GeoPackage;
