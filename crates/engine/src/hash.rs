//! The only source of chance: everything random is a hash of the seed and of what it is for, never of a history.
//!
//! What it is for stands in a register: each use of chance in the crate is a [`Stream`], and no two can share one.

/// A well-mixed function of `value`: each bit of the input changes each bit of the output about half of the time.
///
/// Based on: the finaliser of SplitMix64 with the constants of Stafford's "Mix13".
#[inline]
pub const fn mix(value: u64) -> u64 {
    let mut z = value;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The golden ratio's bits keep small numbers, which seeds and streams mostly are, from cancelling out.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// [`mix`] for numbers that may be small or 0, of which that makes 0.
#[inline]
pub const fn scatter(value: u64) -> u64 {
    mix(value.wrapping_add(GOLDEN))
}

/// A key made of a key and a number.
#[inline]
pub const fn combine(key: u64, number: u64) -> u64 {
    with_number(scatter(key), number)
}

/// [`combine`] of a key that is [scattered](scatter) already, for whoever makes many of one.
#[inline]
pub const fn with_number(scattered: u64, number: u64) -> u64 {
    mix(scattered ^ number.wrapping_mul(GOLDEN))
}

/// A key made of a key and a text; of an empty text it is the key itself.
pub fn with_text(key: u64, text: &str) -> u64 {
    text.bytes().fold(key, |key, byte| combine(key, byte.into()))
}

/// The seed of one stream of chance, independent of the seeds of all other streams.
pub fn stream(seed: u64, stream: impl Into<StreamNumber>) -> u64 {
    combine(seed, stream.into().0)
}

/// The hash of a point of a lattice in a stream.
pub const fn lattice(stream: u64, x: i64, y: i64) -> u64 {
    mix(mix(stream ^ x as u64) ^ (y as u64).rotate_left(32))
}

/// A hash as a number from 0 to 1, 1 excluded: of its upper 53 bits, which are what a double holds.
pub const fn share(hash: u64) -> f64 {
    const SCALE: f64 = 1.0 / (1u64 << 53) as f64;
    (hash >> 11) as f64 * SCALE
}

/// A register of uses: an enum whose variants are the first of so many numbers, and own them all.
macro_rules! register {
    ($(#[$about:meta])* $name:ident: $($(#[$doc:meta])* $variant:ident = $first:expr, $count:expr;)+) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u64)]
        pub enum $name {
            $($(#[$doc])* $variant = $first,)+
        }

        impl $name {
            /// All of them.
            pub const ALL: &[$name] = &[$($name::$variant),+];

            /// How many numbers it owns, from its own on.
            pub const fn count(self) -> u64 {
                match self {
                    $($name::$variant => $count,)+
                }
            }

            /// The number of one of its parts.
            ///
            /// # Panics
            /// When it has no such part.
            pub const fn number(self, part: u64) -> u64 {
                assert!(part < self.count(), "the part belongs to another use of chance");
                self as u64 + part
            }
        }
    };
}

/// Streams that have parts, a term of noise each, say, may have so many.
const PARTS: u64 = 1 << 32;

register! {
    /// Every use of chance in a world: its number, and how many it owns. What is new takes the next number that is
    /// free; to change one changes worlds.
    Stream:
    /// Domain warp of relief of noise, east.
    NoiseWarpEast = 1, 1;
    /// Domain warp of relief of noise, south.
    NoiseWarpSouth = 2, 1;
    /// The mask of land and sea floor of relief of noise.
    NoiseLand = 3, 1;
    /// Terms of relief of noise, by their index.
    NoiseTerm = 1 << 32, PARTS;
    /// Masks of the terms, by the term's index.
    NoiseTermMask = 2 << 32, PARTS;
    /// Which tiles have a river of the agents, and where it goes.
    AgentRiver = 3 << 32, 1;
    /// Which tiles have a road of the agents, and where it goes.
    AgentRoad = 4 << 32, 1;
    /// The order in which rivers of the agents give way to each other.
    AgentRank = 5 << 32, 1;
    /// Where water of fluvial relief flows at large.
    Potential = 6 << 32, 1;
    /// How fast fluvial relief rises.
    Uplift = 7 << 32, 1;
    /// Warp of fluvial relief, east.
    FluvialWarpEast = 8 << 32, 1;
    /// Warp of fluvial relief, south.
    FluvialWarpSouth = 9 << 32, 1;
    /// The network of channels, which divides it by [`network_level`] and by [`Draw`].
    Network = 10 << 32, 1;
    /// Octaves of gullies, by their index.
    Gullies = 11 << 32, PARTS;
    /// Roughness of hillsides.
    Roughness = 12 << 32, 1;
    /// Layers of rock.
    Strata = 13 << 32, 1;
    /// Which agents a tile around a walker starts.
    WalkerAgent = 14 << 32, 1;
    /// To which side the first tile around a walker grows.
    WalkerGrowth = 15 << 32, 1;
    /// Where tongues are at home.
    Tongue = 16 << 32, 1;
    /// Names of settlements.
    SettlementName = 17 << 32, 1;
    /// Names of rivers.
    RiverName = 18 << 32, 1;
    /// Names of lakes.
    LakeName = 19 << 32, 1;
    /// Names of peaks.
    PeakName = 20 << 32, 1;
    /// Positions that are compared for a settlement, by their index.
    SitePosition = 21 << 32, PARTS;
    /// Which cells are settled.
    Settled = 22 << 32, 1;
    /// What becomes of a settlement.
    SiteClass = 23 << 32, 1;
    /// How bad ground is to walk on.
    RouteWander = 24 << 32, 1;
    /// Bends of the shores of fluvial relief, east.
    CoastEast = 25 << 32, 1;
    /// Bends of the shores of fluvial relief, south.
    CoastSouth = 26 << 32, 1;
    /// Where woods stand, and how far rubble and wet ground reach.
    GroundCover = 27 << 32, 1;
    /// Short bends of the shores of fluvial relief, east.
    ShortCoastEast = 28 << 32, 1;
    /// Short bends of the shores of fluvial relief, south.
    ShortCoastSouth = 29 << 32, 1;
    /// How far flood plains reach.
    FloodPlain = 30 << 32, 1;
    /// The shortest bends of the shores of fluvial relief, east.
    LeastCoastEast = 31 << 32, 1;
    /// The shortest bends of the shores of fluvial relief, south.
    LeastCoastSouth = 32 << 32, 1;
    /// Skerries: where they are, their shoals, bays and directions.
    Skerries = 33 << 32, 5;
    /// Moraines, divided as the network is.
    Moraines = 34 << 32, 1;
    /// Where moraines are higher.
    MoraineShape = 36 << 32, 1;
    /// Glaciers, divided as the network is.
    Glaciers = 35 << 32, 1;
    /// Where rills are deep.
    Rills = 37 << 32, 1;
    /// Barriers across drowned valleys.
    Barriers = 38 << 32, 1;
    /// Where barriers are higher.
    BarrierShape = 39 << 32, 1;
    /// Names of mountain ranges.
    RangeName = 40 << 32, 1;
    /// Where single trees, shrubs, tufts and rocks stand.
    Instances = 41 << 32, 1;
}

/// The number of a stream, or of a part of one.
#[derive(Clone, Copy, Debug)]
pub struct StreamNumber(u64);

impl Stream {
    /// A part of the stream.
    ///
    /// # Panics
    /// When it has no such part.
    pub const fn of(self, part: u64) -> StreamNumber {
        StreamNumber(self.number(part))
    }
}

impl From<Stream> for StreamNumber {
    fn from(stream: Stream) -> StreamNumber {
        stream.of(0)
    }
}

register! {
    /// What is left to chance of one channel of a level of the network.
    Draw:
    /// Where its head stands, east and south.
    Head = 0, 2;
    /// Of a trunk's node, whether it has a lake; of a tributary, whether it is left out.
    Choice = 2, 1;
    /// How wide its lake is.
    LakeWidth = 3, 1;
    /// How flat a valley's side it begins on.
    Flat = 4, 1;
    /// Where it ends, of several that would end at one place.
    Foot = 5, 1;
    /// How far down its lake ends.
    LakeSill = 6, 1;
    /// How long its lake is.
    LakeLength = 7, 1;
    /// Where in a wave its meanders begin.
    MeanderPhase = 8, 1;
    /// How long a wave of its meanders is, by the knot.
    MeanderWave = 9, 1;
    /// How far a wave of its meanders turns, by the knot.
    MeanderTurn = 10, 1;
    /// Of a tributary, whether it has a lake.
    Lake = 11, 1;
    /// Of a place of a trunk, by the knot: which branch it has, where, how large it is and what its shape is.
    Branch = 12, 4;
    /// How far it swings to the side, by the knot.
    Swing = 16, PARTS;
    /// Of a skerry: whether it is there, how large, and where, east and south.
    Skerry = 2 << 32, 4;
    /// How long a trunk's delta is.
    Delta = 3 << 32, 1;
    /// Where on its floor moraines lie, and how large they are.
    Moraine = 4 << 32, PARTS;
    /// How far down a glacier comes.
    Glacier = 5 << 32, 1;
    /// Of a barrier: whether it is there, how wide and how high.
    Barrier = 6 << 32, 3;
}

/// Knots for which a level of the network has room.
const KNOTS: u64 = 1 << 8;

/// The seed of a level of the network, whose channels then have their [`Draw`]s.
pub const fn network_level(network: u64, level: u32) -> u64 {
    network.wrapping_add(level as u64 * KNOTS)
}

/// The seed of a knot of the channels of a level: where what is drawn differs from knot to knot.
///
/// # Panics
/// When the knot is one for which a level has no room.
pub const fn network_knot(level: u64, knot: usize) -> u64 {
    assert!(knot < KNOTS as usize, "a channel has more knots than there are streams for");
    level.wrapping_add(knot as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_of_seed_or_stream_changes_half_of_the_bits() {
        let mut flipped = 0;
        for bit in 0..64 {
            for n in 0..64 {
                flipped += (combine(n, 3) ^ combine(n ^ (1 << bit), 3)).count_ones();
                flipped += (combine(3, n) ^ combine(3, n ^ (1 << bit))).count_ones();
            }
        }
        let mean = flipped as f64 / (2.0 * 64.0 * 64.0);
        assert!((mean - 32.0).abs() < 0.5, "{mean} of 64 bits change on average");
    }

    #[test]
    fn every_letter_of_a_text_changes_the_key() {
        assert_eq!(with_text(7, ""), 7);
        let mut keys: Vec<u64> =
            ["", "a", "b", "aa", "ab", "ba", "alps", "Alps", "spal"].map(|text| with_text(7, text)).into();
        keys.extend(["a", "b", "alps"].map(|text| with_text(8, text)));
        let count = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), count);
    }

    #[test]
    fn no_two_uses_of_chance_share_a_number() {
        let check = |uses: Vec<(String, u64, u64)>| {
            for (one, first, count) in &uses {
                assert!(*count > 0 && first.checked_add(*count).is_some(), "{one}");
                for (other, from, _) in uses.iter().filter(|(other, ..)| other != one) {
                    assert!(!(*first..first + count).contains(from), "{other} has a number of {one}");
                }
            }
        };
        check(Stream::ALL.iter().map(|stream| (format!("{stream:?}"), *stream as u64, stream.count())).collect());
        check(Draw::ALL.iter().map(|draw| (format!("{draw:?}"), *draw as u64, draw.count())).collect());
    }

    #[test]
    #[should_panic(expected = "belongs to another use")]
    fn a_stream_has_no_parts_but_its_own() {
        Stream::NoiseLand.of(1);
    }
}
