//! Versions of the layers that make worlds. Together they fix which bytes a preset and a seed give.
//!
//! Each layer of the program has a number. **Whoever changes what a layer makes, be it one bit of one vertex, raises
//! its number here**, in the same commit that changes `tests/golden.txt`: the list of golden hashes names the numbers
//! with which it was written, and accepts no other hashes under the same numbers. A bake's manifest lists the numbers
//! as well. A bake with other numbers is not resumed, added to, extended or repaired, since its tiles could differ from
//! those made here.

use std::collections::BTreeMap;

use crate::error::Error;

/// The version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Name and version of the program, as manifests have them.
pub const NAME: &str = concat!("terrane ", env!("CARGO_PKG_VERSION"));

/// The layers, each with the version of its work on the output of the layers before it.
pub const LAYERS: [(&str, u32); 10] = [
    ("noise", 2),
    ("geography", 4),
    ("fluvial", 6),
    ("places", 4),
    ("agents", 3),
    ("lines", 1),
    ("tile", 3),
    ("features", 3),
    ("mesh", 3),
    ("map", 5),
];

/// Returns the layers' versions by name, as manifests have them.
pub fn layers() -> BTreeMap<String, u32> {
    LAYERS.iter().map(|(layer, version)| ((*layer).to_owned(), *version)).collect()
}

/// Checks that this program makes the worlds of a version, such as `0.1` or `0.1.0`.
///
/// # Errors
/// When the program has another version.
pub fn check(version: &str) -> Result<(), Error> {
    let wanted = version.strip_prefix("terrane ").unwrap_or(version);
    let is_same = !wanted.is_empty() && (VERSION == wanted || VERSION.starts_with(&format!("{wanted}.")));
    if is_same {
        return Ok(());
    }
    Err(Error::Option {
        message: format!("this is {NAME}, which does not make the worlds of terrane {wanted}"),
        hint: format!("use that version of the program, or give --generator {VERSION} to bake the world as it is here"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_this_one_or_refused() {
        let (minor, _) = VERSION.rsplit_once('.').unwrap();
        assert!(check(VERSION).is_ok() && check(minor).is_ok() && check(NAME).is_ok());
        for other in ["", "0.0.1", "9", &format!("{VERSION}.1"), &minor[..minor.len() - 1]] {
            assert_eq!(check(other).unwrap_err().exit_code(), 2, "{other}");
        }
    }
}
