//! A PMTiles archive: all tiles of a set in one file that a browser reads in pieces from any web server.
//!
//! Based on: Protomaps, PMTiles version 3. Tiles are stored in the order of their numbers, equal tiles are stored once,
//! and the directories are compressed.

use std::io;
use std::path::PathBuf;

use pmtiles::{PmTilesStreamWriter, PmTilesWriter, PmtError, TileType};

use crate::error::Error;
use crate::file::{Finished, PartFile, SharedFile};
use crate::web::encode::TileEncoding;
use crate::web::meta::Described;
use crate::web::pyramid::TilePlace;

/// An archive that is being written.
pub(super) struct PmTiles {
    path: PathBuf,
    file: SharedFile,
    writer: PmTilesStreamWriter<SharedFile>,
}

impl PmTiles {
    /// Creates the archive that will be at `path`.
    pub fn create(path: PathBuf, encoding: TileEncoding, about: &Described) -> Result<PmTiles, Error> {
        let file = SharedFile::new(PartFile::create(path.clone())?);
        let tile_type = match encoding {
            TileEncoding::WebP => TileType::Webp,
            TileEncoding::Png => TileType::Png,
        };
        let [west, south, east, north] = about.degrees;
        let (longitude, latitude, zoom) = about.center();
        let writer = PmTilesWriter::new(tile_type)
            .min_zoom(*about.zooms.start())
            .max_zoom(*about.zooms.end())
            .bounds(west, south, east, north)
            .center(longitude, latitude)
            .center_zoom(zoom)
            .metadata(about.json().to_string())
            .create(file.clone())
            .map_err(failed(&path))?;
        Ok(PmTiles { path, file, writer })
    }

    /// Adds a tile. Tiles must come in the order of their numbers.
    pub fn add(&mut self, place: TilePlace, bytes: &[u8]) -> Result<(), Error> {
        self.writer.add_tile(place.coord(), bytes).map_err(failed(&self.path))
    }

    /// Writes the directories and gives the file its name.
    pub fn finish(self) -> Result<Finished, Error> {
        self.writer.finalize().map_err(failed(&self.path))?;
        self.file.finish()
    }
}

fn failed(path: &PathBuf) -> impl FnOnce(PmtError) -> Error {
    move |error| {
        Error::io(path)(match error {
            PmtError::Reading(error) => error,
            other => io::Error::other(other),
        })
    }
}
