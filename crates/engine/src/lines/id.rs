//! The names of lines, and of what they lead to: numbers of lattices, the same whoever asks.

use std::fmt;

use crate::area::TileId;
use crate::hash::{self, StreamNumber};
use crate::lines::LineKind;

/// A channel of fluvial relief: its level, and the cell of that level's lattice that holds its head.
pub type ChannelId = (u32, i64, i64);

/// The name of a lake: the channel in which it lies; of one without an outlet, its node as a channel of level 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LakeId(pub ChannelId);

impl fmt::Display for LakeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LakeId((level, x, y)) = self;
        write!(f, "l{level}:{x}:{y}")
    }
}

/// A site cell, which holds one settlement at most, and that settlement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SiteId {
    /// Site cells east of that at the origin; may be negative.
    pub i: i64,
    /// Site cells south of that at the origin; may be negative.
    pub j: i64,
}

impl SiteId {
    /// The hash of the cell in a stream of chance.
    pub(crate) fn hash(self, seed: u64, stream: impl Into<StreamNumber>) -> u64 {
        hash::lattice(hash::stream(seed, stream), self.i, self.j)
    }
}

impl fmt::Display for SiteId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s:{}:{}", self.i, self.j)
    }
}

/// The name of a line in its world. Lines are sorted by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LineId {
    /// A river of fluvial relief.
    River {
        /// The channel in which it begins.
        channel: ChannelId,
        /// 0 but where a channel is cut by lakes or by the sea: the number among those that begin in it.
        part: u32,
    },
    /// A road between settlements.
    Road {
        /// The smaller of the two settlements' cells.
        from: SiteId,
        /// The cell of the other settlement.
        to: SiteId,
        /// 0 but where roads above it have cut it: the number among its parts, from the smaller settlement on.
        part: u32,
    },
    /// A river or a road of an agent.
    Agent {
        /// Whether it is a river or a road.
        kind: LineKind,
        /// The tile whose hash has started it.
        owner: TileId,
    },
}

impl LineId {
    /// A river or a road.
    pub fn kind(self) -> LineKind {
        match self {
            LineId::River { .. } => LineKind::River,
            LineId::Road { .. } => LineKind::Road,
            LineId::Agent { kind, .. } => kind,
        }
    }
}

impl fmt::Display for LineId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LineId::River { channel: (level, x, y), part: 0 } => write!(f, "r{level}:{x}:{y}"),
            LineId::River { channel: (level, x, y), part } => write!(f, "r{level}:{x}:{y}:{part}"),
            LineId::Road { from, to, part: 0 } => write!(f, "w:{}:{}:{}:{}", from.i, from.j, to.i, to.j),
            LineId::Road { from, to, part } => write!(f, "w:{}:{}:{}:{}:{part}", from.i, from.j, to.i, to.j),
            LineId::Agent { kind, owner } => write!(f, "{}:{}:{}", kind.name(), owner.x, owner.y),
        }
    }
}
