//! Font files (SFNT), which are lists of tables: reads their tables, and makes small fonts for browsers.

use std::collections::BTreeSet;

use subsetter::GlyphRemapper;

use crate::error::Error;
use crate::map::font::Font;

/// The four letters that name a table.
type Tag = [u8; 4];

/// Returns all tables of a font file; damaged entries are left out.
fn tables(font: &[u8]) -> impl Iterator<Item = (Tag, &[u8])> {
    let number = |at: usize| Some(u32::from_be_bytes(font.get(at..at + 4)?.try_into().ok()?) as usize);
    let count = font.get(4..6).map_or(0, |bytes| usize::from(u16::from_be_bytes([bytes[0], bytes[1]])));
    (0..count).map(|index| 12 + 16 * index).filter_map(move |at| {
        let tag = font.get(at..at + 4)?.try_into().ok()?;
        let (start, length) = (number(at + 8)?, number(at + 12)?);
        Some((tag, font.get(start..start + length)?))
    })
}

/// Finds a table of a font file.
pub(super) fn table(font: &[u8], tag: Tag) -> Option<&[u8]> {
    tables(font).find(|(of, _)| *of == tag).map(|(_, table)| table)
}

/// Makes a font of some letters of another one, with the map from letters to glyphs that browsers need. The new font
/// has neither ligatures nor kerning.
///
/// # Errors
/// When the font is damaged.
pub(super) fn web_font(font: Font, letters: &BTreeSet<char>) -> Result<Vec<u8>, Error> {
    let mut glyphs = GlyphRemapper::new();
    let known = letters.iter().filter_map(|letter| Some((*letter, font.glyph_of(*letter)?)));
    let map: Vec<(char, u16)> = known.map(|(letter, glyph)| (letter, glyphs.remap(glyph))).collect();
    let part = subset(font, &glyphs)?;
    let mut parts: Vec<(Tag, Vec<u8>)> = tables(&part).map(|(tag, table)| (tag, table.to_vec())).collect();
    // The subset lacks these two tables, since PDF needs neither; browsers need both.
    parts.extend(font.table(*b"OS/2").map(|metrics| (*b"OS/2", metrics.to_vec())));
    parts.push((*b"cmap", character_map(&map)));
    Ok(assembled(&part[..4], parts))
}

/// Makes the subset of a font that holds some glyphs, as a PDF embeds it.
///
/// # Errors
/// When the font, which a user may have supplied, is damaged.
pub(super) fn subset(font: Font, glyphs: &GlyphRemapper) -> Result<Vec<u8>, Error> {
    subsetter::subset(font.data(), 0, glyphs).map_err(|error| Error::Option {
        message: format!("the font {} cannot be put into a document: {error}", font.full_name()),
        hint: "give another font, or --text outlines".into(),
    })
}

/// Makes the `cmap` table, which maps letters to glyphs (format 12).
fn character_map(map: &[(char, u16)]) -> Vec<u8> {
    const HEAD_BYTES: u32 = 16;
    let count = map.len() as u32;
    let mut table = Vec::new();
    // One subtable, of all of Unicode (platform 3, encoding 10), which begins at byte 12.
    table.extend([0, 1, 3, 10].map(u16::to_be_bytes).concat());
    table.extend(12_u32.to_be_bytes());
    table.extend([12, 0].map(u16::to_be_bytes).concat());
    table.extend([HEAD_BYTES + 12 * count, 0, count].map(u32::to_be_bytes).concat());
    for (letter, glyph) in map {
        table.extend([u32::from(*letter), u32::from(*letter), u32::from(*glyph)].map(u32::to_be_bytes).concat());
    }
    table
}

/// Assembles tables into a font file.
fn assembled(flavour: &[u8], mut tables: Vec<(Tag, Vec<u8>)>) -> Vec<u8> {
    tables.sort();
    let count = tables.len() as u16;
    let power = count.ilog2() as u16;
    let range = 16 << power;
    let mut font = flavour.to_vec();
    font.extend([count, range, power, 16 * count - range].map(u16::to_be_bytes).concat());
    let mut start = 12 + 16 * tables.len();
    for (tag, table) in &tables {
        font.extend(tag);
        font.extend([checksum(table), start as u32, table.len() as u32].map(u32::to_be_bytes).concat());
        start += table.len().next_multiple_of(4);
    }
    for (_, table) in &tables {
        font.extend(table);
        font.resize(font.len().next_multiple_of(4), 0);
    }
    font
}

/// Adds up a table as 32-bit big-endian numbers, wrapping around; the last one is padded with zeros.
fn checksum(table: &[u8]) -> u32 {
    let number = |bytes: &[u8]| bytes.iter().chain(&[0; 3]).take(4).fold(0, |sum, byte| sum << 8 | u32::from(*byte));
    table.chunks(4).map(number).fold(0, u32::wrapping_add)
}

#[cfg(test)]
mod tests {
    use skrifa::{FontRef, MetadataProvider};

    use super::*;
    use crate::map::font::Face;

    #[test]
    fn a_font_for_browsers_has_the_letters_that_are_asked_for() {
        for face in Face::ALL {
            let letters: BTreeSet<char> = "Große Ache, 1 234".chars().collect();
            let data = web_font(face.font(), &letters).unwrap();
            let font = FontRef::new(&data).unwrap();
            let all = FontRef::new(face.font().data()).unwrap();
            for letter in &letters {
                let glyph = font.charmap().map(*letter).unwrap_or_else(|| panic!("{face:?} lacks {letter:?}"));
                assert!(font.outline_glyphs().get(glyph).is_some());
            }
            assert_eq!(font.charmap().map('x'), None);
            assert!(all.charmap().map('x').is_some() && data.len() * 10 < face.font().data().len());
        }
    }
}
