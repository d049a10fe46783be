//! Levels: the supported sets of vector instructions, and the choice of one that this CPU has.

use std::sync::OnceLock;

/// A set of vector instructions, from the narrowest to the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// Plain arrays: the reference, compiled to NEON on aarch64.
    Scalar,
    /// 4 lanes; every x86-64 CPU.
    Sse2,
    /// 8 lanes.
    Avx2,
    /// 16 lanes (F, BW, DQ and VL, which all CPUs since Skylake-X have together).
    Avx512,
}

impl Level {
    /// Environment variable that forces a level.
    pub const VARIABLE: &str = "TERRANE_SIMD";
    /// All levels, available on this CPU or not.
    pub const ALL: [Level; 4] = [Level::Scalar, Level::Sse2, Level::Avx2, Level::Avx512];

    /// Returns the name, as written in the environment variable.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Sse2 => "sse2",
            Level::Avx2 => "avx2",
            Level::Avx512 => "avx512",
        }
    }

    /// True if this CPU has the level.
    pub fn is_available(self) -> bool {
        match self {
            Level::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Level::Sse2 => true,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                // All features that `run_avx512` enables: it must not run if one is missing.
                is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// Returns the levels that this CPU has, narrowest first; never empty.
    pub fn available() -> Vec<Level> {
        Level::ALL.into_iter().filter(|level| level.is_available()).collect()
    }

    /// Returns the level that [`dispatch`](crate::simd::dispatch) uses: the one named by `TERRANE_SIMD`, or else the
    /// widest available.
    ///
    /// # Errors
    /// A sentence for the user, if the variable names an unknown level or one that this CPU lacks.
    pub fn chosen() -> Result<Level, String> {
        static CHOSEN: OnceLock<Result<Level, String>> = OnceLock::new();
        CHOSEN
            .get_or_init(|| match std::env::var_os(Level::VARIABLE) {
                // An empty variable counts as not set.
                None => Ok(Level::widest()),
                Some(name) if name.is_empty() => Ok(Level::widest()),
                Some(name) => Level::from_name(&name.to_string_lossy()),
            })
            .clone()
    }

    fn widest() -> Level {
        Level::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Level::Scalar)
    }

    fn from_name(name: &str) -> Result<Level, String> {
        let list = |levels: &[Level]| levels.iter().map(|level| level.name()).collect::<Vec<_>>().join(", ");
        let Some(level) = Level::ALL.into_iter().find(|level| level.name() == name) else {
            return Err(format!(
                "{}={name:?} is not a known instruction set; known are {}",
                Level::VARIABLE,
                list(&Level::ALL)
            ));
        };
        if !level.is_available() {
            return Err(format!(
                "{}={name:?} asks for instructions that this CPU lacks; it has {}",
                Level::VARIABLE,
                list(&Level::available())
            ));
        }
        Ok(level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_name_lists_the_known_ones() {
        let message = Level::from_name("mmx").unwrap_err();
        assert!(
            message.contains("TERRANE_SIMD=\"mmx\"") && message.contains("scalar, sse2, avx2, avx512"),
            "{message}"
        );
        assert_eq!(Level::from_name("scalar"), Ok(Level::Scalar));
    }
}
