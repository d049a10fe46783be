//! Structures: bridges, tunnels and fords, which carry a line where the land does not.

use crate::geometry::length;
use crate::lines::Line;
use crate::memory::heap_bytes;

/// Kind of a structure that carries a road instead of the land.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StructureKind {
    /// A bridge over water or over a dip. The land under it stays as it is.
    Bridge,
    /// A tunnel. The land over it stays as it is.
    Tunnel,
    /// A ford: wheels and hooves go through the river's bed.
    Ford,
}

impl StructureKind {
    /// Returns the name in files.
    pub fn name(self) -> &'static str {
        match self {
            StructureKind::Bridge => "bridge",
            StructureKind::Tunnel => "tunnel",
            StructureKind::Ford => "ford",
        }
    }
}

/// A bridge, a tunnel or a ford of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Structure {
    /// The kind of structure.
    pub kind: StructureKind,
    /// Index of the structure's first point in the line.
    pub first: usize,
    /// Index of the structure's last point in the line; may be the same as `first`.
    pub last: usize,
}

heap_bytes!(Structure);

impl Structure {
    /// Returns the structures of a line, given the carrier of each point: a run of the same kind is one structure.
    pub fn of_points(carriers: &[Option<StructureKind>]) -> Vec<Structure> {
        let (mut structures, mut first) = (Vec::new(), 0);
        for run in carriers.chunk_by(|a, b| a == b) {
            let last = first + run.len() - 1;
            structures.extend(run[0].map(|kind| Structure { kind, first, last }));
            first = last + 1;
        }
        structures
    }

    /// Returns the midpoint of the structure along the line, in 1/256 vertex.
    pub fn middle(&self, line: &Line) -> [i64; 2] {
        let points = &line.points[self.first..=self.last];
        let fixed: Vec<[i64; 2]> = points.iter().map(|point| line.fixed(point)).collect();
        halfway(&fixed)
    }
}

/// Returns the midpoint of a polyline along its length.
fn halfway(places: &[[i64; 2]]) -> [i64; 2] {
    let way = |pair: &[[i64; 2]]| [0, 1].map(|axis| (pair[1][axis] - pair[0][axis]) as f64);
    let mut left = places.windows(2).map(|pair| length(way(pair))).sum::<f64>() / 2.0;
    for pair in places.windows(2) {
        let own = length(way(pair));
        if left <= own {
            let share = if own > 0.0 { left / own } else { 0.0 };
            let [x, y] = way(pair).map(|part| (part * share).round() as i64);
            return [pair[0][0] + x, pair[0][1] + y];
        }
        left -= own;
    }
    places[places.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_structure_lies_on_the_road_also_where_it_bends() {
        assert_eq!(halfway(&[[0, 0], [100, 0], [100, 300]]), [100, 100]);
        assert_eq!(halfway(&[[7, -9]]), [7, -9]);
        assert_eq!(halfway(&[[7, -9], [7, -9]]), [7, -9]);
    }

    #[test]
    fn a_run_of_points_that_are_carried_alike_is_one_structure() {
        use StructureKind::{Bridge, Ford};
        let carriers = [None, Some(Bridge), Some(Bridge), Some(Ford), None, Some(Ford)];
        let expected = [(Bridge, 1, 2), (Ford, 3, 3), (Ford, 5, 5)];
        assert_eq!(
            Structure::of_points(&carriers),
            expected.map(|(kind, first, last)| Structure { kind, first, last })
        );
    }
}
