//! The place that a command covers.

use clap::Args;

use super::values::{parse_kilometres, parse_numbers, parse_size, parse_tile};
use crate::area::{MAX_COORDINATE, Region, TileId};
use crate::cli::console::Console;
use crate::error::Error;
use crate::find;
use crate::preset::Preset;

/// A part of a world.
#[derive(Args, Clone, Default)]
#[command(next_help_heading = "Place")]
pub struct PlaceArguments {
    /// North-western tile of the region: tiles east and tiles south of tile 0,0; may be negative [default: 0,0].
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, value_parser = parse_tile)]
    pub at: Option<TileId>,
    /// Size of the region in tiles [default: 8x8].
    #[arg(long, value_name = "COLSxROWS", value_parser = parse_size)]
    pub size: Option<(u64, u64)>,
    /// The region in kilometres east and north of the origin. A bake takes all tiles that the region touches.
    #[arg(long, value_name = "W,S,E,N", allow_hyphen_values = true, value_parser = parse_numbers::<4>)]
    #[arg(conflicts_with_all = ["at", "size", "around"])]
    pub bounds: Option<[f64; 4]>,
    /// The middle of the region in kilometres east and north of the origin, or the name of something (a settlement
    /// within 300 km of the origin, a lake, river or peak within 30 km, or in a whole world a continent, sea, desert and
    /// so on within 2000 km), and the region's width and height in kilometres.
    #[arg(long, value_name = "X,Y,KM|NAME[,KM]", allow_hyphen_values = true, value_parser = parse_around)]
    #[arg(alias = "middle", conflicts_with_all = ["at", "size"])]
    pub around: Option<Around>,
}

/// The middle of a region, and perhaps the region's width and height in kilometres.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    pub middle: Middle,
    pub km: Option<f64>,
}

/// The middle of a region.
#[derive(Clone, Debug, PartialEq)]
pub enum Middle {
    /// Kilometres east and north of the origin.
    At([f64; 2]),
    /// The name of something.
    Named(String),
}

fn parse_around(text: &str) -> Result<Around, String> {
    let is_number = |part: &str| part.trim().parse::<f64>().is_ok();
    let parts: Vec<&str> = text.split(',').collect();
    if is_number(parts[0]) {
        return match parts.len() {
            2 => parse_numbers(text).map(|at| Around { middle: Middle::At(at), km: None }),
            _ => parse_numbers(text).map(|[x, y, km]| Around { middle: Middle::At([x, y]), km: Some(km) }),
        };
    }
    let (name, km) = text.rsplit_once(',').map_or((text, None), |(name, km)| (name, Some(km)));
    let km = km.map(parse_kilometres).transpose()?;
    match name.trim() {
        "" => Err("expected X,Y,KM or a name".to_owned()),
        name => Ok(Around { middle: Middle::Named(name.to_owned()), km }),
    }
}

/// Rounds kilometres to the nanometre, to drop the noise that a sum leaves in the last digits.
fn without_noise(km: f64) -> f64 {
    const NANOMETRES: f64 = 1e12;
    // Far from the origin, doubles hold no such fine digits, and the product would not be an exact whole number.
    if km.abs() < MAX_COORDINATE as f64 / NANOMETRES { (km * NANOMETRES).round() / NANOMETRES } else { km }
}

impl PlaceArguments {
    /// True if any place is given.
    pub fn is_given(&self) -> bool {
        self.at.is_some() || self.size.is_some() || self.bounds.is_some() || self.around.is_some()
    }

    /// True if the place has a size of its own, and not its middle alone.
    pub fn has_size(&self) -> bool {
        self.is_given() && self.around.as_ref().is_none_or(|around| around.km.is_some())
    }

    /// Returns the same place by numbers alone: a name is looked up in the world of a preset.
    ///
    /// # Errors
    /// When nothing has the name, or the search is stopped.
    pub fn located(&self, preset: &Preset, seed: Option<u64>, console: &Console) -> Result<PlaceArguments, Error> {
        let mut located = self.clone();
        if let Some(Around { middle: Middle::Named(name), km }) = &self.around {
            let found = find::named(preset.clone(), seed, name, [0.0; 2], &console.watch().clock)?;
            located.around = Some(Around { middle: Middle::At(found.at_km), km: km.or(Some(found.around_km)) });
        }
        Ok(located)
    }

    /// Returns the middle of a place without a size, in kilometres east and north of the origin.
    pub fn middle_km(&self) -> [f64; 2] {
        match self.around {
            Some(Around { middle: Middle::At(at), .. }) => at,
            _ => [0.0; 2],
        }
    }

    /// Returns the rectangle from --bounds or --around in kilometres, if one is given: west, south, east and north.
    fn bounds_km(&self, spacing_m: f64) -> Result<Option<[f64; 4]>, Error> {
        let around = self.around.as_ref().map(|around| match around {
            Around { middle: Middle::At([x, y]), km: Some(km) } => {
                Ok([x - km / 2.0, y - km / 2.0, x + km / 2.0, y + km / 2.0].map(without_noise))
            }
            Around { middle: Middle::At([x, y]), km: None } => Err(Error::Region {
                message: format!("--around={x},{y} says no width and height"),
                hint: format!("add them in kilometres, such as --around={x},{y},10"),
            }),
            Around { middle: Middle::Named(name), .. } => unreachable!("{name} has not been located"),
        });
        let bounds = self.bounds.or(around.transpose()?);
        let Some([west, south, east, north]) = bounds else { return Ok(None) };
        if west >= east || south >= north {
            return Err(Error::Region {
                message: format!("from {west} to {east} km east and from {south} to {north} km north there is nothing"),
                hint: "give west, south, east and north, such as --bounds=-10,-10,10,10".into(),
            });
        }
        let most_km = MAX_COORDINATE as f64 * spacing_m / 1000.0;
        if [west, south, east, north].iter().any(|km| km.abs() > most_km) {
            return Err(Error::Region {
                message: format!("{west},{south},{east},{north} km leaves the coordinates"),
                hint: format!("no vertex lies more than {most_km:.0} km from the origin"),
            });
        }
        Ok(bounds)
    }

    /// Returns the region of all tiles that are asked for or touched, with `tile_cells` cells a side of `spacing_m`
    /// metres each.
    pub fn region(&self, tile_cells: u32, spacing_m: f64) -> Result<Region, Error> {
        let Some([west, south, east, north]) = self.bounds_km(spacing_m)? else {
            let (cols, rows) = self.size.unwrap_or((8, 8));
            return Region::new(self.at.unwrap_or(TileId { x: 0, y: 0 }), cols, rows, tile_cells);
        };
        let tile_km = f64::from(tile_cells) * spacing_m / 1000.0;
        // Rows count to the south.
        let [x0, y0, x1, y1] = [west, -north, east, -south].map(|km| km / tile_km);
        let at = TileId { x: x0.floor() as i64, y: y0.floor() as i64 };
        Region::new(at, (x1.ceil() - x0.floor()) as u64, (y1.ceil() - y0.floor()) as u64, tile_cells)
    }

    /// Returns the bounds of the place in metres east and north of the origin: west, south, east and north.
    pub fn bounds_m(&self, tile_cells: u32, spacing_m: f64) -> Result<[f64; 4], Error> {
        let km = match self.bounds_km(spacing_m)? {
            Some(bounds) => bounds,
            None => self.region(tile_cells, spacing_m)?.bounds_km(spacing_m),
        };
        Ok(km.map(|km| km * 1000.0))
    }
}
