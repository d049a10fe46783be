//! A shard: one of several rectangles of tiles that make up a region, each baked by itself, on any machine.
//!
//! A shard writes the files of its tiles as any bake does, but no files of the whole region. The bytes that the sinks
//! of those files keep of its tiles wait in a [store](crate::bake::shard_store) for the merge of all shards.

use std::fmt;
use std::str::FromStr;

use crate::area::{Place, Region, TileId};
use crate::error::Error;

/// The number of a shard, from 1 on, and the number of shards in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// Returns the shard of a number; `None` if there is no such shard.
    pub fn new(number: u64, of: u64) -> Option<Shard> {
        (1..=of).contains(&number).then_some(Shard { number, of })
    }

    /// Number of the shard, from 1 on.
    pub fn number(self) -> u64 {
        self.number
    }

    /// Number of shards in all.
    pub fn of(self) -> u64 {
        self.of
    }

    /// Returns the tiles of the shard. All shards of a region are equally large, to within a row or a column of tiles,
    /// and as square as possible, because what lies around an edge between two shards is planned by both.
    ///
    /// # Errors
    /// If there are more shards than tiles.
    pub fn region(self, whole: &Region) -> Result<Region, Error> {
        if self.of > whole.tiles() {
            return Err(Error::Option {
                message: format!("{} shards are more than the {} tiles of the region", self.of, whole.tiles()),
                hint: format!("give at most {}, such as --shard 1/{}", whole.tiles(), whole.tiles()),
            });
        }
        let (mut region, mut before, mut of) = (*whole, self.number - 1, self.of);
        while of > 1 {
            let ([first, second], count) = cut(&region, of);
            if before < count {
                (region, of) = (first, count);
            } else {
                (region, of) = (second, of - count);
                before -= count;
            }
        }
        Ok(region)
    }
}

/// Cuts a region, which has at least as many tiles as it is to have shards, into two parts. Also returns the number of
/// shards of the first part.
fn cut(region: &Region, shards: u64) -> ([Region; 2], u64) {
    let (cols, rows) = (region.cols(), region.rows());
    let (long, short) = (cols.max(rows), cols.min(rows));
    let half = shards / 2;
    // Rounded to the nearest tile. The product needs more than 64 bits, since a region may have 2^63 vertices.
    let share = (u128::from(long) * u128::from(half) * 2 + u128::from(shards)) / (2 * u128::from(shards));
    let at = (share as u64).clamp(1, long - 1);
    // Neither part gets more shards than it has tiles.
    let count =
        half.clamp(shards.saturating_sub((long - at).saturating_mul(short)).max(1), (at * short).min(shards - 1));
    let part = |first: u64, length: u64| {
        let is_wide = cols == long;
        let place = if is_wide { Place { row: 0, col: first } } else { Place { row: first, col: 0 } };
        let (cols, rows) = if is_wide { (length, rows) } else { (cols, length) };
        Region::new(region.tile(place), cols, rows, region.tile_cells()).expect("a part of a region is one")
    };
    ([part(0, at), part(at, long - at)], count)
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let shard = numbers.and_then(|(number, of)| Shard::new(number, of));
        shard.ok_or_else(|| format!("expected a number from 1 on and of how many, such as 3/16, found {text:?}"))
    }
}

/// Names the corner tiles of a rectangle of tiles, for people.
pub(crate) fn corners(region: &Region) -> String {
    let TileId { x, y } = region.tile(Place { row: region.rows() - 1, col: region.cols() - 1 });
    let first = region.at();
    if region.tiles() == 1 { format!("tile {first}") } else { format!("tiles {first} to {}", TileId { x, y }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shards(region: &Region, of: u64) -> Vec<Region> {
        (1..=of).map(|number| Shard::new(number, of).unwrap().region(region).unwrap()).collect()
    }

    #[test]
    fn shards_are_all_tiles_of_a_region_and_each_once() {
        for (cols, rows) in [(1, 1), (1, 7), (5, 3), (8, 8), (13, 4)] {
            let region = Region::new(TileId { x: -3, y: 2 }, cols, rows, 16).unwrap();
            for of in 1..=region.tiles() {
                let mut seen = vec![0; region.tiles() as usize];
                for shard in shards(&region, of) {
                    for row in 0..shard.rows() {
                        for col in 0..shard.cols() {
                            let place = region.place(shard.tile(Place { row, col })).unwrap();
                            seen[(place.row * cols + place.col) as usize] += 1;
                        }
                    }
                }
                assert!(seen.iter().all(|count| *count == 1), "{of} of {cols} x {rows}: {seen:?}");
            }
            assert!(Shard::new(1, region.tiles() + 1).unwrap().region(&region).is_err());
        }
    }

    #[test]
    fn shards_are_alike_and_square() {
        let region = Region::new(TileId { x: 0, y: 0 }, 256, 256, 256).unwrap();
        for of in [2, 3, 4, 7, 16, 100] {
            let tiles: Vec<u64> = shards(&region, of).iter().map(Region::tiles).collect();
            let (least, most) = (tiles.iter().min().unwrap(), tiles.iter().max().unwrap());
            assert!(most * 9 <= least * 10, "{of}: {least} to {most}");
        }
        assert!(shards(&region, 16).iter().all(|shard| (shard.cols(), shard.rows()) == (64, 64)));
        // As large a region as possible.
        let wide = Region::new(TileId { x: -(1 << 44), y: 0 }, 1 << 45, 1, 256).unwrap();
        assert_eq!(shards(&wide, 2)[1].at().x, 0);
    }

    #[test]
    fn a_shard_is_read_as_it_is_written() {
        assert_eq!("3/16".parse::<Shard>().unwrap().to_string(), "3/16");
        for text in ["", "3", "0/4", "5/4", "-1/4", "1/0", "1/2/3", "a/b"] {
            assert!(text.parse::<Shard>().is_err(), "{text:?}");
        }
    }
}
