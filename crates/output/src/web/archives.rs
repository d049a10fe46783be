//! The archives of a set of pictures.

use std::path::Path;

use crate::error::Error;
use crate::file::{FileRecord, Finished};
use crate::web::block_painter::{Set, TilePicture};
use crate::web::mbtiles::MbTiles;
use crate::web::meta::{Described, Meta};
use crate::web::pmtiles::PmTiles;
use crate::web::{Choice, EXPORT, Pyramid};

/// The archives of a set that are asked for.
pub(super) struct Archives {
    stem: String,
    mbtiles: Option<MbTiles>,
    pmtiles: Option<PmTiles>,
}

impl Archives {
    /// Creates the archives that are asked for.
    pub fn create(folder: &Path, pyramid: &Pyramid, meta: &Meta, choice: Choice, set: &Set) -> Result<Archives, Error> {
        let stem = format!("{}{}", set.layer, set.mark());
        let about = |further: u8| Described::new(pyramid, meta, set.title, set.scale, further);
        let path = |ending: &str| folder.join(format!("{stem}.{ending}"));
        let mbtiles = || MbTiles::create(path("mbtiles"), choice.encoding.ending(), &about(set.further()));
        let pmtiles = || PmTiles::create(path("pmtiles"), choice.encoding, &about(0));
        let (mbtiles, pmtiles) = (choice.mbtiles.then(mbtiles).transpose()?, choice.pmtiles.then(pmtiles).transpose()?);
        Ok(Archives { stem, mbtiles, pmtiles })
    }

    /// Adds a picture to the archives.
    pub fn add(&mut self, picture: &TilePicture) -> Result<(), Error> {
        let TilePicture { place, bytes, hash, quarters, .. } = picture;
        if let Some(mbtiles) = &mut self.mbtiles {
            match quarters {
                Some(quarters) => quarters.iter().try_for_each(|it| mbtiles.add(it.place, &it.hash, &it.bytes))?,
                None => mbtiles.add(*place, hash, bytes)?,
            }
        }
        if let Some(pmtiles) = &mut self.pmtiles {
            pmtiles.add(*place, bytes)?;
        }
        Ok(())
    }

    /// Finishes the archives, and adds their records to those of the map.
    pub fn finish(self, files: &mut Vec<FileRecord>) -> Result<(), Error> {
        let mut push = |ending: &str, finished: Finished| {
            files.push(FileRecord::new(format!("{}.{ending}", self.stem), EXPORT, finished));
        };
        if let Some(mbtiles) = self.mbtiles {
            push("mbtiles", mbtiles.finish()?);
        }
        if let Some(pmtiles) = self.pmtiles {
            push("pmtiles", pmtiles.finish()?);
        }
        Ok(())
    }
}
