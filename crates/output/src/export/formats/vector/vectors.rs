//! The content of all vector exports: the features of the world, and contours.

use std::path::Path;
use std::sync::Mutex;

use crate::area::Region;
use crate::bake::frames;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::Request;
use crate::export::formats::locked;
use crate::export::formats::vector::contours::Contours;
use crate::export::formats::vector::store::FeatureStore;
use crate::features::Row;
use crate::stop::Stopped;
use crate::tile::Tile;

/// The features and contours of a region, while it is baked.
pub(crate) struct Vectors<'a> {
    region: Region,
    /// The features, which are complete once the last row of tiles is there.
    pub features: FeatureStore<'a>,
    contours: Mutex<Contours>,
}

impl<'a> Vectors<'a> {
    /// Begins without features. They wait in the folder of the file that will hold them.
    pub fn create(request: &Request<'a>, file: &Path) -> Result<Vectors<'a>, Error> {
        Ok(Vectors {
            region: request.region,
            features: FeatureStore::create(request, file)?,
            contours: Mutex::new(Contours::new(request.world, request.vectors.contours_m)),
        })
    }

    /// Returns the features and contours of a tile as the piece that a sink keeps.
    pub fn take(&self, tile: &Tile, clock: &Clock) -> Result<Vec<u8>, Stopped> {
        // Find contours without the lock, so that other threads find theirs meanwhile.
        let finder = locked(&self.contours).finder();
        Ok(Vectors::piece(&self.features.take(tile, clock)?, &finder.find(tile)))
    }

    /// Packs the features and contours of a tile as one piece.
    pub fn piece(features: &[u8], contours: &[u8]) -> Vec<u8> {
        let mut piece = Vec::with_capacity(features.len() + contours.len() + 16);
        frames::push(&mut piece, features);
        frames::push(&mut piece, contours);
        piece
    }

    /// Takes in a row of tiles, and hands on the contours that are complete.
    pub fn put(&self, row: u64, pieces: &[&[u8]], hand_on: impl FnMut(Row) -> Result<(), Error>) -> Result<(), Error> {
        let (mut features, mut contours) = (Vec::new(), Vec::new());
        for piece in pieces {
            let mut parts = frames::pieces(piece);
            features.extend(parts.next());
            contours.extend(parts.next());
        }
        self.features.put(&features)?;
        let is_last = row + 1 == self.region.rows();
        let next = (self.region.at().y + row as i64 + 1) * i64::from(self.region.tile_cells());
        locked(&self.contours).put(&contours, (!is_last).then_some(next), hand_on)
    }
}
