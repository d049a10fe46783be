//! Records: the data about a tile from which it is made again after a walker has left it, together with the records of
//! its four neighbours.
//!
//! Based on: Grelsson (2014), section 4.3. The thesis keeps 40 bytes per tile: its position, and start and direction of
//! its river and of its road. Heights need no record. A tile here needs [`TileRecord::BYTES`] = 64 bytes. Positions are
//! 64-bit integers, and the record also has what the thesis leaves out although tiles cannot be remade without it: the
//! edge over which an agent came and the distance it had covered, the number of nodes that are left of its way after it
//! was cut, and the place where it waits.

use crate::agents::Direction;
use crate::area::TileId;
use crate::lines::LineKind;

/// Everything that is kept of a tile. Its record, those of its four neighbours and the world are enough to remake the
/// tile byte for byte. The neighbours' records tell which agents step over the shared edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileRecord {
    /// Position of the tile.
    pub id: TileId,
    /// River in the tile.
    pub river: Option<Passage>,
    /// Road in the tile.
    pub road: Option<Passage>,
}

/// The part of an agent's way that lies in one tile. Vertices are counted from the tile's north-western vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// First node in this tile: east, south.
    pub start: [u16; 2],
    /// Direction that was assigned to the agent.
    pub direction: Direction,
    /// Direction of the step over the edge into this tile; `None` if the agent started here.
    pub entry: Option<Direction>,
    /// Direction in which the agent leaves the tile, or waits to do so; `None` if it ends here.
    pub exit: Option<Direction>,
    /// Number of nodes in this tile, at least 1.
    pub nodes: u16,
    /// Last node in this tile: east, south.
    pub last: [u16; 2],
    /// Length in cells of the agent's way before this tile.
    pub before_cells: u32,
    /// Height in metres of the lowest ground on the way before this tile, or of the start if the agent started here.
    pub lowest_before_m: f32,
    /// Height in metres of the lowest ground on the way up to the last node in this tile.
    pub lowest_m: f32,
}

impl Passage {
    /// Returns the length in cells of the way from the agent's start, which may lie in another tile, to its last node
    /// in this tile.
    pub fn end_cells(&self, stride: u32) -> u32 {
        let steps = self.nodes as u32 - 1 + u32::from(self.entry.is_some());
        self.before_cells.saturating_add(steps * stride)
    }

    fn write(passage: Option<&Passage>, bytes: &mut [u8]) {
        // All bytes zero, including the direction, stand for no agent, as in the thesis.
        let Some(passage) = passage else { return };
        for (at, value) in [passage.start[0], passage.start[1], passage.last[0], passage.last[1], passage.nodes]
            .into_iter()
            .enumerate()
        {
            bytes[2 * at..2 * at + 2].copy_from_slice(&value.to_le_bytes());
        }
        bytes[10] = code(Some(passage.direction));
        bytes[11] = code(passage.entry) | code(passage.exit) << 4;
        bytes[12..16].copy_from_slice(&passage.before_cells.to_le_bytes());
        bytes[16..20].copy_from_slice(&passage.lowest_before_m.to_le_bytes());
        bytes[20..24].copy_from_slice(&passage.lowest_m.to_le_bytes());
    }

    /// Decodes a passage; all bytes zero decode as none.
    fn read(bytes: &[u8]) -> Result<Option<Passage>, NotARecord> {
        if bytes.iter().all(|byte| *byte == 0) {
            return Ok(None);
        }
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let long = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let passage = Passage {
            start: [word(0), word(2)],
            last: [word(4), word(6)],
            nodes: word(8),
            direction: decode(bytes[10])?.ok_or(NotARecord)?,
            entry: decode(bytes[11] & 15)?,
            exit: decode(bytes[11] >> 4)?,
            before_cells: u32::from_le_bytes(long(12)),
            lowest_before_m: f32::from_le_bytes(long(16)),
            lowest_m: f32::from_le_bytes(long(20)),
        };
        let sound = passage.nodes > 0 && passage.lowest_before_m.is_finite() && passage.lowest_m.is_finite();
        if sound { Ok(Some(passage)) } else { Err(NotARecord) }
    }
}

/// Error: bytes that encode no record.
struct NotARecord;

/// Size of an encoded passage in bytes.
const PASSAGE_BYTES: usize = 24;

impl TileRecord {
    /// Size of a record in bytes; in the thesis it is 40.
    pub const BYTES: usize = 16 + 2 * PASSAGE_BYTES;

    /// Returns the river or the road.
    pub fn passage(&self, kind: LineKind) -> Option<&Passage> {
        match kind {
            LineKind::River => self.river.as_ref(),
            LineKind::Road => self.road.as_ref(),
        }
    }

    /// Encodes the record in little-endian byte order: position, river, road.
    pub fn to_bytes(&self) -> [u8; TileRecord::BYTES] {
        let mut bytes = [0; TileRecord::BYTES];
        bytes[..8].copy_from_slice(&self.id.x.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.id.y.to_le_bytes());
        let (river, road) = bytes[16..].split_at_mut(PASSAGE_BYTES);
        Passage::write(self.river.as_ref(), river);
        Passage::write(self.road.as_ref(), road);
        bytes
    }

    /// Decodes a record that [`to_bytes`](TileRecord::to_bytes) wrote; `None` if the bytes are no valid record.
    pub fn from_bytes(bytes: &[u8; TileRecord::BYTES]) -> Option<TileRecord> {
        let (x, rest) = bytes.split_first_chunk()?;
        let (y, rest) = rest.split_first_chunk()?;
        let (river, road) = rest.split_at(PASSAGE_BYTES);
        Some(TileRecord {
            id: TileId { x: i64::from_le_bytes(*x), y: i64::from_le_bytes(*y) },
            river: Passage::read(river).ok()?,
            road: Passage::read(road).ok()?,
        })
    }
}

/// Encodes a direction as 1 to 4, clockwise from north, and none as 0.
fn code(direction: Option<Direction>) -> u8 {
    direction.map_or(0, |direction| direction as u8 + 1)
}

fn decode(code: u8) -> Result<Option<Direction>, NotARecord> {
    match code {
        0 => Ok(None),
        1..=4 => Ok(Some(Direction::ALL[code as usize - 1])),
        _ => Err(NotARecord),
    }
}

/// The records of all tiles ever made: an array sorted by position, with binary search.
#[derive(Clone, Debug, Default)]
pub(crate) struct Records(Vec<TileRecord>);

impl Records {
    /// Sorts the given records. The error is a tile with two records.
    pub fn new(mut records: Vec<TileRecord>) -> Result<Records, TileId> {
        records.sort_by_key(|record| record.id);
        match records.windows(2).find(|pair| pair[0].id == pair[1].id) {
            Some(pair) => Err(pair[0].id),
            None => Ok(Records(records)),
        }
    }

    pub fn find(&self, id: TileId) -> Option<&TileRecord> {
        self.0.binary_search_by_key(&id, |record| record.id).ok().map(|at| &self.0[at])
    }

    /// Adds the record of a tile that has none yet.
    pub fn add(&mut self, record: TileRecord) {
        let at = self.0.binary_search_by_key(&record.id, |record| record.id);
        self.0.insert(at.expect_err("a tile is recorded once"), record);
    }

    pub fn all(&self) -> &[TileRecord] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORD: TileRecord = TileRecord {
        id: TileId { x: -1_000_000_000, y: 7 },
        river: Some(Passage {
            start: [0, 4096],
            direction: Direction::North,
            entry: Some(Direction::West),
            exit: None,
            nodes: 32_768,
            last: [17, 3],
            before_cells: 70_000,
            lowest_before_m: 12.5,
            lowest_m: -3.25,
        }),
        road: None,
    };

    #[test]
    fn records_come_back_from_their_bytes() {
        let both = TileRecord { road: RECORD.river.map(|river| Passage { entry: None, ..river }), ..RECORD };
        for record in [RECORD, both, TileRecord { river: None, ..RECORD }] {
            assert_eq!(TileRecord::from_bytes(&record.to_bytes()), Some(record));
        }
    }

    #[test]
    fn what_is_no_record_is_refused() {
        let bytes = RECORD.to_bytes();
        let with = |at: usize, value: &[u8]| {
            let mut bytes = bytes;
            bytes[at..at + value.len()].copy_from_slice(value);
            TileRecord::from_bytes(&bytes)
        };
        assert_eq!(with(26, &[5]), None, "a direction that is none of the four");
        assert_eq!(with(26, &[0]), None, "an agent without a direction");
        assert_eq!(with(27, &[0x90]), None, "an exit to nowhere");
        assert_eq!(with(24, &[0, 0]), None, "no nodes");
        assert_eq!(with(36, &f32::NAN.to_le_bytes()), None, "a height that is no number");
    }

    #[test]
    fn records_are_found_wherever_they_were_added() {
        let at = |x, y| TileRecord { id: TileId { x, y }, ..RECORD };
        let mut records = Records::new(vec![at(3, 0), at(-2, 9)]).unwrap();
        records.add(at(-2, 3));
        records.add(at(5, -5));
        assert!(records.all().is_sorted_by_key(|record| record.id));
        assert_eq!(records.find(TileId { x: -2, y: 3 }), Some(&at(-2, 3)));
        assert_eq!(records.find(TileId { x: 0, y: 0 }), None);
        assert_eq!(Records::new(vec![at(1, 1), at(0, 0), at(1, 1)]).unwrap_err(), TileId { x: 1, y: 1 });
    }
}
