//! Values that several commands take, as they are written.

use std::ops::RangeInclusive;

use crate::area::TileId;

/// Reads a number of tiles, `columns x rows`.
pub fn parse_size(text: &str) -> Result<(u64, u64), String> {
    let (cols, rows) = text.split_once(['x', 'X']).ok_or("expected columns x rows, such as 8x8")?;
    let number = |text: &str| match text.trim().parse() {
        Ok(0) => Err("a region has at least one tile each way, such as 1x1".to_owned()),
        Ok(count) => Ok(count),
        Err(error) => Err(format!("expected a whole number of tiles, found {text:?}: {error}")),
    };
    Ok((number(cols)?, number(rows)?))
}

/// Reads the numbers of a tile.
pub fn parse_tile(text: &str) -> Result<TileId, String> {
    let (x, y) = text.split_once(',').ok_or("expected two whole numbers with a comma between, such as -3,12")?;
    let number = |text: &str| {
        text.trim().parse().map_err(|error| format!("expected a whole number of 64 bits, found {text:?}: {error}"))
    };
    Ok(TileId { x: number(x)?, y: number(y)? })
}

/// Reads exactly `N` numbers with commas between.
pub fn parse_numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let number = |part: &str| match part.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("expected a number, found {part:?}")),
    };
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let found = numbers.len();
    numbers.try_into().map_err(|_| format!("expected {N} numbers with commas between, found {found}"))
}

/// Reads kilometres above 0, with or without the unit.
pub fn parse_kilometres(text: &str) -> Result<f64, String> {
    let number = text.trim();
    match number.strip_suffix("km").unwrap_or(number).trim_end().parse::<f64>() {
        Ok(km) if km.is_finite() && km > 0.0 => Ok(km),
        _ => Err(format!("expected kilometres above 0, such as 200km, found {text:?}")),
    }
}

/// Reads a number in a range, of a unit that the message names.
pub fn within(range: RangeInclusive<f64>, unit: &'static str) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| match text.trim().parse::<f64>() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!("expected {} to {}{unit}, found {text:?}", range.start(), range.end())),
    }
}
