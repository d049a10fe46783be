//! The directories of a TIFF: lists of tags, each with its values, and where these lie.
//!
//! Based on: TIFF 6.0; for files that may be longer than 4 GiB BigTIFF, whose counts and offsets have 64 bits. All is
//! little-endian.

/// The values of a tag.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    /// A text in ASCII; it ends with a zero, which is not part of it here.
    Text(String),
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Doubles(Vec<f64>),
    /// Places in the file: of 64 bits in a BigTIFF.
    Offsets(Vec<u64>),
}

impl Values {
    /// The number of their type, how many they are, and their bytes.
    fn encoded(&self, big: bool) -> (u16, u64, Vec<u8>) {
        match self {
            Values::Text(text) => (2, text.len() as u64 + 1, [text.as_bytes(), &[0]].concat()),
            Values::Shorts(shorts) => (3, shorts.len() as u64, shorts.iter().flat_map(|it| it.to_le_bytes()).collect()),
            Values::Longs(longs) => (4, longs.len() as u64, longs.iter().flat_map(|it| it.to_le_bytes()).collect()),
            Values::Doubles(reals) => (12, reals.len() as u64, reals.iter().flat_map(|it| it.to_le_bytes()).collect()),
            Values::Offsets(places) if big => {
                (16, places.len() as u64, places.iter().flat_map(|it| it.to_le_bytes()).collect())
            }
            // The caller has seen that they fit.
            Values::Offsets(places) => {
                (4, places.len() as u64, places.iter().flat_map(|it| (*it as u32).to_le_bytes()).collect())
            }
        }
    }
}

/// A directory: its tags, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Directory(pub Vec<(u16, Values)>);

/// Bytes of the head of a file: what it is, and where the first directory lies.
pub(super) fn head(big: bool, first: u64) -> Vec<u8> {
    match big {
        true => [b"II+\0\x08\0\0\0", &first.to_le_bytes()[..]].concat(),
        false => [b"II*\0", &(first as u32).to_le_bytes()[..]].concat(),
    }
}

impl Directory {
    /// The bytes of a directory that lies at a place in the file, with its values behind it, and says where the next one lies
    /// if it is not the last. They are as many wherever it lies and whatever its offsets are.
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
                // In the place of their offset.
                entries.extend(&bytes);
                entries.resize(entries.len() + word - bytes.len(), 0);
            } else {
                entries.extend(number(at + (table + values.len()) as u64, word));
                values.extend(&bytes);
                values.resize(values.len().next_multiple_of(8), 0);
            }
        }
        let end = at + (table + values.len()) as u64;
        // Whatever comes next begins at an even place.
        values.resize(values.len() + (end.next_multiple_of(8) - end) as usize, 0);
        let next = if is_last { 0 } else { at + (table + values.len()) as u64 };
        entries.extend(number(next, word));
        [entries, values].concat()
    }
}
