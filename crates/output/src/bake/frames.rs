//! Frames: pieces of bytes one after the other, each preceded by its length.

use std::io::{self, Write};

/// Number of bytes of a length.
const LENGTH: usize = size_of::<u64>();

/// Writes a piece to the end of `target`.
pub(crate) fn write(target: &mut impl Write, piece: &[u8]) -> io::Result<()> {
    target.write_all(&(piece.len() as u64).to_le_bytes())?;
    target.write_all(piece)
}

/// Appends a piece to `bytes`.
pub(crate) fn push(bytes: &mut Vec<u8>, piece: &[u8]) {
    write(bytes, piece).expect("memory takes everything");
}

/// Returns the pieces in some bytes. A piece that is cut off at the end is left out.
pub(crate) fn pieces(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        let (length, behind) = rest.split_first_chunk::<LENGTH>()?;
        let (piece, behind) = behind.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        rest = behind;
        Some(piece)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_come_out_as_they_went_in_and_cut_ones_not_at_all() {
        let mut bytes = Vec::new();
        for piece in [&b"one"[..], b"", b"three"] {
            push(&mut bytes, piece);
        }
        assert_eq!(pieces(&bytes).collect::<Vec<_>>(), [&b"one"[..], b"", b"three"]);
        assert_eq!(pieces(&bytes[..bytes.len() - 1]).count(), 2);
        assert_eq!(pieces(&[255; 12]).count(), 0);
    }
}
