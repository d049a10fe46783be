//! Marks of settlements: a dot for a hamlet, a larger one for a village, a square for a town.

use crate::places::site::{Site, SiteClass};

/// Ink, and the paper around it that keeps it apart from the land, in sRGB. Chosen by eye.
const INK: [u8; 3] = [58, 38, 32];
const PAPER: [u8; 3] = [250, 246, 236];

/// Vertices from the middle of a mark to the end of its ink; the paper is one wider. Chosen by eye.
const HAMLET: i64 = 2;
const VILLAGE: i64 = 3;
const TOWN: i64 = 4;

/// Paints what the mark of a settlement has in row `y` of the map, whose first pixel is the vertex `x0`.
pub(super) fn paint_row(site: &Site, x0: i64, y: i64, pixels: &mut [[u8; 3]]) {
    let down = y - site.at[1];
    let size = match site.class {
        SiteClass::Hamlet => HAMLET,
        SiteClass::Village => VILLAGE,
        SiteClass::Town => TOWN,
    };
    for across in -size - 1..=size + 1 {
        let within = |radius: i64| {
            if site.class == SiteClass::Town {
                return across.abs().max(down.abs()) <= radius;
            }
            // A dot that is round at its size: the circle lies between two vertices.
            across * across + down * down <= radius * radius + radius
        };
        let column = usize::try_from(site.at[0] + across - x0).ok();
        if let Some(pixel) = column.and_then(|column| pixels.get_mut(column)).filter(|_| within(size + 1)) {
            *pixel = if within(size) { INK } else { PAPER };
        }
    }
}
