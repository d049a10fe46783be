//! Hashes, the only source of chance: every random number is a hash of the seed and of its purpose, never of anything
//! that happened earlier.
//!
//! Purposes stand in a register: each use of chance in the crate is a [`Stream`], and no two uses can share one.

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

/// The golden ratio's bits. They keep small numbers, as seeds and streams mostly are, from cancelling out.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// [`mix`] for numbers that may be small or 0; `mix` itself maps 0 to 0.
#[inline]
pub const fn scatter(value: u64) -> u64 {
    mix(value.wrapping_add(GOLDEN))
}

/// Returns a key made of a key and a number.
#[inline]
pub const fn combine(key: u64, number: u64) -> u64 {
    with_number(scatter(key), number)
}

/// Returns the hash of some numbers in their order; 0 of none.
pub fn of(numbers: impl IntoIterator<Item = u64>) -> u64 {
    numbers.into_iter().fold(0, |key, number| mix(key ^ number))
}

/// [`combine`] of a key that is already [scattered](scatter): saves time when many keys are made of one.
#[inline]
pub const fn with_number(scattered: u64, number: u64) -> u64 {
    mix(scattered ^ number.wrapping_mul(GOLDEN))
}

/// Returns a key made of a key and a text; with an empty text the key itself.
pub fn with_text(key: u64, text: &str) -> u64 {
    text.bytes().fold(key, |key, byte| combine(key, byte.into()))
}

/// Returns the seed of one stream of chance, independent of the seeds of all other streams.
pub fn stream(seed: u64, stream: impl Into<StreamNumber>) -> u64 {
    combine(seed, stream.into().0)
}

/// Returns the hash of a lattice point in a stream.
pub const fn lattice(stream: u64, x: i64, y: i64) -> u64 {
    mix(mix(stream ^ x as u64) ^ (y as u64).rotate_left(32))
}

/// Returns a hash as a number from 0 to 1, 1 excluded, made of its upper 53 bits, which an `f64` holds exactly.
pub const fn share(hash: u64) -> f64 {
    const SCALE: f64 = 1.0 / (1u64 << 53) as f64;
    (hash >> 11) as f64 * SCALE
}

/// A register of uses of chance: an enum. Each variant stands for a range of numbers, its own value the first of them.
macro_rules! register {
    ($(#[$about:meta])* $name:ident: $($(#[$doc:meta])* $variant:ident = $first:expr, $count:expr;)+) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u64)]
        pub enum $name {
            $($(#[$doc])* $variant = $first,)+
        }

        impl $name {
            /// All variants.
            pub const ALL: &[$name] = &[$($name::$variant),+];

            /// Number of numbers that the variant owns, from its own value on.
            pub const fn count(self) -> u64 {
                match self {
                    $($name::$variant => $count,)+
                }
            }

            /// Returns the number of one of the variant's parts.
            ///
            /// # Panics
            /// When the variant has no such part.
            pub const fn number(self, part: u64) -> u64 {
                assert!(part < self.count(), "the part belongs to another use of chance");
                self as u64 + part
            }
        }
    };
}

/// Number of parts of a stream that is divided, for example into the terms of noise.
const PARTS: u64 = 1 << 32;

register! {
    /// Every use of chance in a world, with its first number and how many numbers it owns. A new use takes the next
    /// free number; changing an existing number changes worlds.
    Stream:
    /// Domain warp of noise relief, east.
    NoiseWarpEast = 1, 1;
    /// Domain warp of noise relief, south.
    NoiseWarpSouth = 2, 1;
    /// The mask that separates land from sea floor in noise relief.
    NoiseLand = 3, 1;
    /// Terms of noise relief, by their index.
    NoiseTerm = 1 << 32, PARTS;
    /// Masks of the terms of noise relief, by the term's index.
    NoiseTermMask = 2 << 32, PARTS;
    /// Rivers of the agents: which tiles have one, and its course.
    AgentRiver = 3 << 32, 1;
    /// Roads of the agents: which tiles have one, and its course.
    AgentRoad = 4 << 32, 1;
    /// The order in which rivers of the agents give way to each other.
    AgentRank = 5 << 32, 1;
    /// Potential of fluvial relief: the water flows down it at large.
    Potential = 6 << 32, 1;
    /// Uplift rate of fluvial relief.
    Uplift = 7 << 32, 1;
    /// Domain warp of fluvial relief, east.
    FluvialWarpEast = 8 << 32, 1;
    /// Domain warp of fluvial relief, south.
    FluvialWarpSouth = 9 << 32, 1;
    /// The network of channels, divided further by [`network_level`] and by [`Draw`].
    Network = 10 << 32, 1;
    /// Octaves of gullies, by their index.
    Gullies = 11 << 32, PARTS;
    /// Roughness of hillsides.
    Roughness = 12 << 32, 1;
    /// Rock layers.
    Strata = 13 << 32, 1;
    /// Kinds of agents that a tile around a walker starts.
    WalkerAgent = 14 << 32, 1;
    /// Direction in which the first tile around a walker grows.
    WalkerGrowth = 15 << 32, 1;
    /// Homes of the tongues, the languages of names.
    Tongue = 16 << 32, 1;
    /// Names of settlements.
    SettlementName = 17 << 32, 1;
    /// Names of rivers.
    RiverName = 18 << 32, 1;
    /// Names of lakes.
    LakeName = 19 << 32, 1;
    /// Names of peaks.
    PeakName = 20 << 32, 1;
    /// Candidate positions of a settlement, by their index.
    SitePosition = 21 << 32, PARTS;
    /// Presence of a settlement in a site cell.
    Settled = 22 << 32, 1;
    /// Share of chance in a settlement's class and population.
    SiteClass = 23 << 32, 1;
    /// Random cost of ground for roads, which makes routes wander.
    RouteWander = 24 << 32, 1;
    /// Bends of the shores of fluvial relief, east.
    CoastEast = 25 << 32, 1;
    /// Bends of the shores of fluvial relief, south.
    CoastSouth = 26 << 32, 1;
    /// Edges of woods, scree and wet ground.
    GroundCover = 27 << 32, 1;
    /// Short bends of the shores of fluvial relief, east.
    ShortCoastEast = 28 << 32, 1;
    /// Short bends of the shores of fluvial relief, south.
    ShortCoastSouth = 29 << 32, 1;
    /// Width of flood plains.
    FloodPlain = 30 << 32, 1;
    /// The shortest bends of the shores of fluvial relief, east.
    LeastCoastEast = 31 << 32, 1;
    /// The shortest bends of the shores of fluvial relief, south.
    LeastCoastSouth = 32 << 32, 1;
    /// Skerries: where they are, their shoals, bays and directions.
    Skerries = 33 << 32, 5;
    /// Moraines, divided by level and by [`Draw`] as the network is.
    Moraines = 34 << 32, 1;
    /// Variation of the height of moraines.
    MoraineShape = 36 << 32, 1;
    /// Glaciers, divided by level and by [`Draw`] as the network is.
    Glaciers = 35 << 32, 1;
    /// Depth of rills, patch by patch.
    Rills = 37 << 32, 1;
    /// Barriers across drowned valleys.
    Barriers = 38 << 32, 1;
    /// Variation of the height of barriers.
    BarrierShape = 39 << 32, 1;
    /// Names of mountain ranges.
    RangeName = 40 << 32, 1;
    /// Positions of single trees, shrubs, tufts and rocks.
    Instances = 41 << 32, 1;
    /// Continents: their positions and sizes.
    Continents = 42 << 32, 1;
    /// Plates of the crust, of today and of an earlier age: their positions, kinds and movements.
    Plates = 43 << 32, 2;
    /// Bends of the borders between plates, east and south, of today's plates and of those of an earlier age.
    PlateBends = 44 << 32, 4;
    /// Noise of the geography, by its purpose.
    Geography = 45 << 32, PARTS;
    /// Volcanoes: where they stand, their kinds, ages and sizes, their cinder cones and lava flows.
    Volcanoes = 50 << 32, 1;
    /// Shapes of volcanoes: ravines, and the bends of all that runs down from them.
    VolcanoShape = 51 << 32, 4;
    /// Noise of rocks, by its purpose.
    Rock = 52 << 32, PARTS;
    /// Beds of layered rock.
    Beds = 53 << 32, 1;
    /// Drumlins, eskers and dolines, by the purpose of each noise and lattice.
    GroundForms = 54 << 32, PARTS;
    /// Cultural regions: positions of their homes, their tongues, and their dialects.
    Cultures = 46 << 32, 3;
    /// Realms, by their kind: the basins that cut large ones, then their names.
    Realms = 47 << 32, 16;
    /// Sand seas of deserts.
    Sand = 48 << 32, 1;
    /// Dunes, by the purpose of each noise and lattice.
    Dunes = 49 << 32, PARTS;
}

/// The number of a stream, or of a part of a stream.
#[derive(Clone, Copy, Debug)]
pub struct StreamNumber(u64);

impl Stream {
    /// Returns the number of a part of the stream.
    ///
    /// # Panics
    /// When the stream has no such part.
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
    /// Uses of chance of a channel of one level of the network, and of the features that are numbered like channels.
    Draw:
    /// Position of a tributary's head or of a trunk's node in its cell, east and south.
    Head = 0, 2;
    /// Presence of a lake at a trunk's node; for a tributary, whether the network leaves it out.
    Choice = 2, 1;
    /// Width of a channel's lake.
    LakeWidth = 3, 1;
    /// Least steepness of the valley side on which a dry tributary begins.
    Flat = 4, 1;
    /// Distance between the ends of tributaries that would otherwise end at one place.
    Foot = 5, 1;
    /// Position of a lake's sill along its channel.
    LakeSill = 6, 1;
    /// Length of a channel's lake.
    LakeLength = 7, 1;
    /// Phase in which a channel's meanders begin.
    MeanderPhase = 8, 1;
    /// Wavelength of meanders, drawn for each wave.
    MeanderWave = 9, 1;
    /// Turn of meanders, drawn for each wave.
    MeanderTurn = 10, 1;
    /// Presence of a lake on a tributary.
    Lake = 11, 1;
    /// Branch in a stretch of a trunk: its kind, position, size and shape, drawn for each stretch.
    Branch = 12, 4;
    /// Swing of a channel's course to the side, with the knot as the part.
    Swing = 16, PARTS;
    /// A skerry: its presence, its size, and its position east and south.
    Skerry = 2 << 32, 4;
    /// Length of a trunk's delta.
    Delta = 3 << 32, 1;
    /// Moraines along a channel, with the stretch and its moraines in the part: presence, positions and sizes.
    Moraine = 4 << 32, PARTS;
    /// Height to which a glacier comes down.
    Glacier = 5 << 32, 1;
    /// A barrier: its presence, width and height.
    Barrier = 6 << 32, 3;
    /// Chance in the height of a trunk's node, which makes rivers wander.
    Wander = 7 << 32, 1;
}

register! {
    /// Labels of maps, among which chance decides where they are equal; the same in all worlds.
    LabelDraw:
    /// Names of settlements.
    Site = 1, 1;
    /// Names of lakes.
    Lake = 2, 1;
    /// Names of rivers.
    River = 3, 1;
    /// Names and heights of peaks.
    Peak = 4, 1;
    /// Names of valleys.
    Valley = 5, 1;
    /// Names of mountain ranges.
    Range = 6, 1;
    /// Names of continents, seas, deserts and so on.
    Realm = 7, 1;
}

register! {
    /// Signs on the ground of maps, whose places chance decides; the same in all worlds.
    SignDraw:
    /// Strokes on rock.
    Rock = 1, 1;
    /// Hachures on slopes.
    Hachure = 2, 1;
    /// Stones of scree.
    Scree = 3, 1;
}

/// Number of knots for which each level of the network has seeds.
const KNOTS: u64 = 1 << 8;

/// Returns the seed of a level of the network, from which the level's channels take their [`Draw`]s.
pub const fn network_level(network: u64, level: u32) -> u64 {
    network.wrapping_add(level as u64 * KNOTS)
}

/// Returns the seed of one knot of a level's channels, for draws that differ from knot to knot.
///
/// # Panics
/// When the level has no seed for so large a knot number.
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
        check(LabelDraw::ALL.iter().map(|draw| (format!("{draw:?}"), *draw as u64, draw.count())).collect());
        check(SignDraw::ALL.iter().map(|draw| (format!("{draw:?}"), *draw as u64, draw.count())).collect());
    }

    #[test]
    #[should_panic(expected = "belongs to another use")]
    fn a_stream_has_no_parts_but_its_own() {
        Stream::NoiseLand.of(1);
    }
}
