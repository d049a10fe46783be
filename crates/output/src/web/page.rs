//! The page that shows a folder of tiles, from a web server or opened from the disk.
//!
//! `index.html` is the same for all maps. The facts about a map stand beside it in scripts, because a page opened from
//! the disk may read nothing else: `map.js` and `names.js`, and the heights of each tile.

use std::path::Path;

use serde_json::{Value, json};

use crate::bake::FileRecord;
use crate::error::Error;
use crate::file::write_whole;
use crate::web::block_painter::HEIGHT_SPACING_PX;
use crate::web::encode::HEIGHT_STEP_M;
use crate::web::meta::{Meta, ground};
use crate::web::{Choice, EXPORT, Feature, MapContent, Pyramid};

/// The page. It exists only when everything that it shows exists.
pub(super) const PAGE: &str = "index.html";

/// The page; its style sheet and script are inserted into it, so that they cannot be separated.
const VIEWER: &str = include_str!("viewer.html");
/// The page's style sheet, which the explorer shares.
pub const LOOK: &str = include_str!("viewer.css");
const LOOK_PLACE: &str = "/* viewer.css */";
/// The page's script, which the explorer shares.
pub const PROGRAM: &str = include_str!("viewer.js");
const PROGRAM_PLACE: &str = "/* viewer.js */";

/// Writes the page and its two scripts, the page last.
pub(super) fn write(
    folder: &Path,
    pyramid: &Pyramid,
    meta: &Meta,
    choice: Choice,
    content: &MapContent,
) -> Result<Vec<FileRecord>, Error> {
    let files = [
        ("map.js", format!("terrane.map({});\n", about(pyramid, meta, choice, content))),
        ("names.js", format!("terrane.names({});\n", names(content))),
        (PAGE, VIEWER.replace(LOOK_PLACE, LOOK).replace(PROGRAM_PLACE, PROGRAM)),
    ];
    let write = |(name, text): (&str, String)| {
        let finished = write_whole(folder.join(name), text.as_bytes())?;
        Ok(FileRecord::new(name.to_owned(), EXPORT, finished))
    };
    files.into_iter().map(write).collect()
}

/// Returns the facts about the map that the page needs.
fn about(pyramid: &Pyramid, meta: &Meta, choice: Choice, content: &MapContent) -> Value {
    let layers: Vec<Value> =
        content.layers.iter().map(|layer| json!({ "name": layer.name, "title": layer.title })).collect();
    let heights = content.heights.map(|_| json!({ "step_m": HEIGHT_STEP_M, "spacing_px": HEIGHT_SPACING_PX }));
    json!({
        "name": meta.name,
        "description": meta.description,
        "version": meta.version,
        "ground": ground(pyramid, 1, 0),
        "ending": choice.encoding.ending(),
        "dense": choice.dense,
        "layers": layers,
        "heights": heights,
    })
}

/// Returns the features, sorted by rank: name, kind, metres east and north, rank.
fn names(content: &MapContent) -> Value {
    let mut features: Vec<_> = content.features.iter().filter(|feature| !feature.name.is_empty()).collect();
    // A stable sort: features of the same rank and name keep their order.
    features.sort_by_key(|feature| (feature.rank, feature.name));
    let row = |feature: &&Feature| {
        json!([feature.name, feature.kind, feature.east_m.round(), feature.north_m.round(), feature.rank])
    };
    features.iter().map(row).collect()
}
