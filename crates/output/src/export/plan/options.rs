//! Options for meshes, names of tile files, and vectors.

use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::area::{Place, Region, TileId};
use crate::error::Error;
use crate::export::plan::digits::{no_less, no_more};
use crate::mesh::{Frame, default_origin};
use crate::world::World;

/// Options of meshes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeshOptions {
    /// Levels of detail, none twice, the finest first.
    pub lods: Lods,
    /// Largest vertical distance in metres between a vertex of the raster and the mesh of LOD 1; twice as much for each
    /// LOD after it. Default: a quarter of the spacing.
    pub error_m: Option<f64>,
    /// True if numbers are written in 8 and 16 bits (KHR_mesh_quantization); glTF only.
    pub quantized: bool,
    /// True if the numbers are compressed (EXT_meshopt_compression); glTF only.
    pub compressed: bool,
    /// True if coarser levels keep all vertices of the finest level on the edges of tiles, so that tiles of different
    /// levels meet without a crack.
    #[serde(default)]
    pub even_borders: bool,
    /// The vertex of the world, east and south, that is the origin of all meshes. Default: chosen by the region, nearly
    /// always the origin of the world.
    #[serde(default)]
    pub origin: Option<[i64; 2]>,
}

/// Naming of the files of tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TileNames {
    /// By the tile's place in the region, counted from the north-western corner: `x0_y0` is the first one.
    #[default]
    Region,
    /// By the tile's number in the world: the same in every region.
    World,
}

impl TileNames {
    /// Returns the numbers of a tile in file names, east and south.
    pub(crate) fn numbers(self, region: &Region, place: Place) -> [i64; 2] {
        match self {
            TileNames::Region => [place.col as i64, place.row as i64],
            TileNames::World => {
                let TileId { x, y } = region.tile(place);
                [x, y]
            }
        }
    }
}

impl FromStr for TileNames {
    type Err = String;

    fn from_str(text: &str) -> Result<TileNames, String> {
        match text {
            "region" => Ok(TileNames::Region),
            "world" => Ok(TileNames::World),
            _ => Err(format!("expected region or world, found {text:?}")),
        }
    }
}

/// Options of vectors.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct VectorOptions {
    /// True if features are cut off at the edge of the region. Otherwise they are whole, and reach beyond it.
    pub clipped: bool,
    /// True if GeoJSON has longitudes and latitudes instead of metres. The metres are taken as web Mercator coordinates
    /// (EPSG:3857), so the world's origin lies at 0, 0.
    pub degrees: bool,
    /// Metres between two contours. Default: chosen by the spacing and the heights of the world.
    pub contours_m: Option<f64>,
}

impl VectorOptions {
    /// Checks that vectors of a region can be written with these options.
    ///
    /// # Errors
    /// When the contour interval is not positive or gives too many contours, or when the region reaches beyond the
    /// possible longitudes and latitudes; the hint says what would do.
    pub(crate) fn check(&self, world: &World, region: &Region) -> Result<(), Error> {
        let refuse = |message: String, hint: String| Err(Error::Option { message, hint });
        let (min_m, max_m) = world.height_range_m();
        let least_m = f64::from(max_m - min_m) / MOST_CONTOURS;
        if let Some(contours_m) = self.contours_m
            && !(contours_m.is_finite() && contours_m > 0.0 && contours_m >= least_m)
        {
            return refuse(
                format!("contours {contours_m} m apart are not possible where heights span {} m", max_m - min_m),
                format!("give at least {} m", no_less(least_m)),
            );
        }
        let reach_m =
            region.bounds_km(world.spacing_m()).into_iter().fold(0.0, |most: f64, km| most.max(km.abs())) * 1000.0;
        if self.degrees && reach_m > MOST_DEGREES_M {
            return refuse(
                format!(
                    "the region reaches {:.0} km from the world's origin, and the Earth ends at 20,037 km",
                    reach_m / 1000.0
                ),
                "leave out --degrees, or choose a region nearer to the origin".into(),
            );
        }
        Ok(())
    }
}

/// Largest number of contours from the lowest to the highest land.
const MOST_CONTOURS: f64 = 10_000.0;

/// Distance in metres from the origin at which web Mercator ends, rounded down: half the Earth's equator.
const MOST_DEGREES_M: f64 = 20_037_000.0;

/// Levels of detail: 0 keeps every vertex, and the error bound doubles from each level to the next.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Lods(Vec<u32>);

impl Default for Lods {
    /// LOD 0 alone, which keeps every vertex.
    fn default() -> Lods {
        Lods::only(0)
    }
}

/// Highest level of detail that can be asked for: the error bound has then grown beyond any height range.
pub(crate) const MAX_LOD: u32 = 31;

impl Lods {
    /// Returns a list of one level.
    pub(crate) fn only(lod: u32) -> Lods {
        Lods(vec![lod])
    }

    /// Returns the levels, ascending.
    pub fn all(&self) -> &[u32] {
        &self.0
    }
}

impl FromStr for Lods {
    type Err = String;

    /// Parses `2`, or `0..3` for all levels from 0 to 3, or several of these with commas between.
    fn from_str(text: &str) -> Result<Lods, String> {
        let number = |text: &str| match text.trim().parse::<u32>() {
            Ok(lod @ 0..=MAX_LOD) => Ok(lod),
            _ => Err(format!("expected levels of detail from 0 to {MAX_LOD}, such as 2, 0..3 or 0,2; found {text:?}")),
        };
        let mut lods = Vec::new();
        for part in text.split(',') {
            match part.split_once("..") {
                Some((from, to)) => {
                    // Those who know Rust may write `0..=3`: both forms include the end.
                    let (from, to) = (number(from)?, number(to.trim_start_matches('='))?);
                    if from > to {
                        return Err(format!("{part:?} counts down; the finest level comes first: {to}..{from}"));
                    }
                    lods.extend(from..=to);
                }
                None => lods.push(number(part)?),
            }
        }
        lods.sort_unstable();
        lods.dedup();
        Ok(Lods(lods))
    }
}

impl MeshOptions {
    /// Returns the error bound in metres of a level of detail; `None` for LOD 0, which keeps every vertex.
    pub fn bound_m(&self, world: &World, lod: u32) -> Option<f64> {
        let first_m = self.error_m.unwrap_or(world.spacing_m() / 4.0);
        (lod > 0).then(|| first_m * f64::from(lod - 1).exp2())
    }

    /// Returns the frame of a region's meshes. Positions in the frame are 16-bit integers if `quantized`.
    pub(crate) fn frame(&self, world: &World, region: &Region, quantized: bool) -> Frame {
        Frame::new(world, self.origin.unwrap_or_else(|| default_origin(region)), quantized)
    }

    /// Checks that meshes of a region can be made with these options.
    ///
    /// # Errors
    /// When the error bound is not a positive number, or exceeds the range of the world's heights, or is finer than
    /// quantised positions; the hint says what would do.
    pub(crate) fn check(&self, world: &World, region: &Region) -> Result<(), Error> {
        let refuse = |message: String, hint: String| Err(Error::Option { message, hint });
        let (min_m, max_m) = world.height_range_m();
        let range_m = f64::from(max_m - min_m);
        let range = no_more(range_m);
        if let Some(error_m) = self.error_m
            && !(error_m > 0.0 && error_m <= range_m)
        {
            return refuse(
                format!("a mesh error of {error_m} m makes no sense where heights span {range} m"),
                format!(
                    "give more than 0 and less than {range} with --mesh-error; a quarter of the spacing is {} m",
                    { world.spacing_m() / 4.0 }
                ),
            );
        }
        // Rounding to 16 bits uses up a part of the bound, and triangles have only the rest.
        let finest_m = self.frame(world, region, self.quantized).height_error_m();
        let finest = no_less(finest_m);
        for &lod in self.lods.all() {
            let Some(bound_m) = self.bound_m(world, lod) else { continue };
            if bound_m > range_m {
                let highest =
                    // The coarsest level whose bound is within the height range.
                    (1..lod).rev().find(|lod| self.bound_m(world, *lod).is_some_and(|bound| bound <= range_m));
                return refuse(
                    format!(
                        "LOD {lod} may be {bound_m} m off, and heights span {range} m: no triangle of the land would be left \
                         but the two of a plane"
                    ),
                    match highest {
                        Some(highest) => format!("the coarsest level of this world is --lod {highest}"),
                        None => format!("give a smaller bound with --mesh-error, such as {}", world.spacing_m() / 4.0),
                    },
                );
            }
            if bound_m <= finest_m {
                return refuse(
                    format!("LOD {lod} may be {bound_m} m off, and quantised heights are up to {finest} m off"),
                    format!("give more than {finest} with --mesh-error, or leave out --quantize"),
                );
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_as_people_write_them() {
        let levels = |text: &str| text.parse::<Lods>().map(|lods| lods.0);
        assert_eq!(levels("2"), Ok(vec![2]));
        assert_eq!(levels("0..3"), Ok(vec![0, 1, 2, 3]));
        assert_eq!(levels("0..=1,5, 1"), Ok(vec![0, 1, 5]));
        for wrong in ["", "-1", "3..1", "32", "a"] {
            assert!(levels(wrong).is_err(), "{wrong:?}");
        }
    }
}
