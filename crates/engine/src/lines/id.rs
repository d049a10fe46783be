//! Ids of lines, and of the things that they lead to: numbers of lattice cells, so that they are the same in every
//! query.

use std::fmt;

use crate::area::TileId;
use crate::hash::{self, StreamNumber};
use crate::lines::LineKind;

/// A channel of fluvial relief: its level, and the cell of that level's lattice that holds its head.
pub type ChannelId = (u32, i64, i64);

/// Id of a lake: the channel in which it lies. For a lake without an outlet, its node, written as a channel of level 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LakeId(pub ChannelId);

impl fmt::Display for LakeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LakeId((level, x, y)) = self;
        write!(f, "l{level}:{x}:{y}")
    }
}

/// Id of a site cell and of its settlement: a cell holds one settlement at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SiteId {
    /// Site cells east of the cell at the origin; may be negative.
    pub i: i64,
    /// Site cells south of the cell at the origin; may be negative.
    pub j: i64,
}

impl SiteId {
    /// Returns the hash of the cell in a random stream.
    pub(crate) fn hash(self, seed: u64, stream: impl Into<StreamNumber>) -> u64 {
        hash::lattice(hash::stream(seed, stream), self.i, self.j)
    }
}

impl fmt::Display for SiteId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s:{}:{}", self.i, self.j)
    }
}

/// Id of a line in its world. Lines are sorted by their ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LineId {
    /// A river of fluvial relief.
    River {
        /// The channel in which it begins.
        channel: ChannelId,
        /// 0, unless lakes or the sea cut the channel: then the number of this line among those that begin in the
        /// channel.
        part: u32,
    },
    /// A road between settlements.
    Road {
        /// The smaller one of the two settlements' cells.
        from: SiteId,
        /// The cell of the other settlement.
        to: SiteId,
        /// 0, unless roads that rank higher have cut this one: then the number of the part, counted from the smaller
        /// cell on.
        part: u32,
    },
    /// A river or a road of an agent.
    Agent {
        /// The kind of line.
        kind: LineKind,
        /// The tile whose hash started the agent.
        owner: TileId,
    },
}

impl LineId {
    /// Returns the kind of line.
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
