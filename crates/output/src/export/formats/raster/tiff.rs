//! The directories of a TIFF: lists of tags with their values, or with the offsets of values that need more room.
//!
//! Based on: TIFF 6.0; and BigTIFF, whose counts and offsets have 64 bits, for files that may be longer than 4 GiB. All
//! numbers are little-endian.

/// The values of a tag.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TagValues {
    /// A text in ASCII, without the zero byte that ends it in the file.
    Text(String),
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Doubles(Vec<f64>),
    /// Offsets in the file: 64 bits each in a BigTIFF, else 32 bits.
    Offsets(Vec<u64>),
}

impl TagValues {
    /// Returns TIFF's number of the values' type, the number of values, and their bytes.
    fn encoded(&self, big: bool) -> (u16, u64, Vec<u8>) {
        match self {
            TagValues::Text(text) => (2, text.len() as u64 + 1, [text.as_bytes(), &[0]].concat()),
            TagValues::Shorts(shorts) => {
                (3, shorts.len() as u64, shorts.iter().flat_map(|it| it.to_le_bytes()).collect())
            }
            TagValues::Longs(longs) => (4, longs.len() as u64, longs.iter().flat_map(|it| it.to_le_bytes()).collect()),
            TagValues::Doubles(reals) => {
                (12, reals.len() as u64, reals.iter().flat_map(|it| it.to_le_bytes()).collect())
            }
            TagValues::Offsets(places) if big => {
                (16, places.len() as u64, places.iter().flat_map(|it| it.to_le_bytes()).collect())
            }
            // The caller has checked that the offsets fit into 32 bits.
            TagValues::Offsets(places) => {
                (4, places.len() as u64, places.iter().flat_map(|it| (*it as u32).to_le_bytes()).collect())
            }
        }
    }
}

/// A directory: its tags and their values, in ascending order of the tags.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Directory(pub Vec<(u16, TagValues)>);

/// Returns the bytes of a file's header: the magic number, and the offset of the first directory.
pub(super) fn head(big: bool, first: u64) -> Vec<u8> {
    match big {
        true => [b"II+\0\x08\0\0\0", &first.to_le_bytes()[..]].concat(),
        false => [b"II*\0", &(first as u32).to_le_bytes()[..]].concat(),
    }
}

impl Directory {
    /// Returns the bytes of a directory at an offset `at` in the file, followed by its values. Unless it is the last
    /// one, the directory links to a next one right behind these bytes. Their number does not depend on the values of
    /// offsets, nor on `at` if that is a multiple of 8.
    pub fn encoded(&self, big: bool, at: u64, is_last: bool) -> Vec<u8> {
        let (count_bytes, entry_bytes, word) = if big { (8, 20, 8) } else { (2, 12, 4) };
        let number = |number: u64, bytes: usize| number.to_le_bytes()[..bytes].to_vec();
        let table = count_bytes + entry_bytes * self.0.len() + word;
        let (mut entries, mut values) = (number(self.0.len() as u64, count_bytes), Vec::new());
        for (tag, of_tag) in &self.0 {
            let (kind, count, bytes) = of_tag.encoded(big);
            entries.extend(tag.to_le_bytes());
            entries.extend(kind.to_le_bytes());
            entries.extend(number(count, word));
            if bytes.len() <= word {
                // Short values stand in the entry itself, in place of their offset.
                entries.extend(&bytes);
                entries.resize(entries.len() + word - bytes.len(), 0);
            } else {
                entries.extend(number(at + (table + values.len()) as u64, word));
                values.extend(&bytes);
                values.resize(values.len().next_multiple_of(8), 0);
            }
        }
        let end = at + (table + values.len()) as u64;
        // The next directory or block begins at a multiple of 8 (TIFF demands an even offset).
        values.resize(values.len() + (end.next_multiple_of(8) - end) as usize, 0);
        let next = if is_last { 0 } else { at + (table + values.len()) as u64 };
        entries.extend(number(next, word));
        [entries, values].concat()
    }
}
