//! The place of vertices relative to an agent's line, from which its bed and its dirt follow.

use crate::area::Area;
use crate::grid::Grid;
#[cfg(feature = "gpu")]
use crate::lines::gpu_words::{PieceWords, corners};
use crate::lines::{Bed, Line, LinePoint};

/// The place of a vertex relative to a line, at the line's point nearest to the vertex.
#[derive(Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to each name")]
pub(super) struct Nearest {
    /// Distance in metres from the line's edge; negative inside.
    pub outside_m: f32,
    /// Height of the line's floor in metres.
    pub floor_m: f32,
    /// Metres from the floor up to the line's level, and metres from the line's middle to its edge.
    pub filled_m: f32,
    pub half_width_m: f32,
}

/// Returns the pieces of an agent's line that can have an effect on a vertex of `area`, for kernels of the GPU. Vertices
/// are counted from vertex `from`.
#[cfg(feature = "gpu")]
pub(super) fn pack(line: &Line, area: Area, from: [i64; 2]) -> Vec<PieceWords> {
    let pieces = line.pieces().map(|ends| BedPiece::new(line, ends, bank_m(line)));
    let near = pieces.map(|piece| (piece.near(area), piece)).filter(|(near, _)| !near.is_empty());
    let words = |(near, piece): (Area, BedPiece)| PieceWords {
        near: corners(near, from),
        begin: piece.from,
        end: piece.to,
        half_width_m: piece.half_width_m,
        floor_m: piece.floor_m,
    };
    near.map(words).collect()
}

/// Returns the distance in metres from the edge of an agent's line to the hard end of its effect.
pub(super) fn bank_m(line: &Line) -> f32 {
    match line.bed {
        Bed::Dug { bank_m } => bank_m as f32,
        Bed::Trodden { shoulder_m, .. } => shoulder_m as f32,
        Bed::Natural | Bed::Built { .. } => unreachable!("agents dig and tread"),
    }
}

/// Calls `visit` for all vertices of `area` on which an agent's line has an effect, once each.
///
/// Only the nearest piece of the line counts. The greatest effect of any piece would be close to that, but leaves a
/// ripple along the bank where one piece follows another.
pub(super) fn visit(line: &Line, area: Area, mut visit: impl FnMut(i64, i64, Nearest)) {
    let Some(part) = area.common(&line.bounds) else { return };
    let bank_m = bank_m(line);
    // Infinitely far, so that the first piece in reach is nearer.
    let nowhere = Nearest { outside_m: f32::INFINITY, floor_m: 0.0, filled_m: 0.0, half_width_m: 0.0 };
    let mut nearest = Grid::filled(part, nowhere);
    for piece in line.pieces().map(|ends| BedPiece::new(line, ends, bank_m)) {
        let Area { x0, y0, x1, y1 } = piece.near(part);
        if x0 == x1 {
            // The piece lies east or west of the area, so no row has vertices near it.
            continue;
        }
        for y in y0..y1 {
            for (x, here) in (x0..x1).zip(nearest.row_mut(y, x0, x1)) {
                let place = piece.nearest(x, y);
                // On a tie the piece further up the line stays, so the result follows the order of the line, whatever
                // area is asked for.
                if place.outside_m < here.outside_m {
                    *here = place;
                }
            }
        }
    }
    // Only once all pieces are in: a vertex in reach of one piece may lie nearer to a later one.
    for y in part.y0..part.y1 {
        for (x, place) in (part.x0..part.x1).zip(nearest.row(y, part.x0, part.x1)) {
            // A vertex that no piece has reached lies beyond the end of the effect.
            if place.outside_m < bank_m {
                visit(x, y, *place);
            }
        }
    }
}

/// True if any piece of an agent's line can have an effect on a vertex of `area`. Exact, except at the corners of a
/// piece's bounding box.
pub(super) fn touches(line: &Line, area: &Area) -> bool {
    let pieces = || line.pieces().map(|ends| BedPiece::new(line, ends, bank_m(line)));
    // The bounds first: most lines lie elsewhere, and their pieces need no visit.
    line.bounds.common(area).is_some() && pieces().any(|piece| !piece.near(*area).is_empty())
}

/// Returns 1 for distances up to 0, 0 from 1 on, and a smooth transition between.
pub(crate) fn fade(distance: f32) -> f32 {
    let rest = 1.0 - distance.clamp(0.0, 1.0);
    // The slope is 0 at both ends, so that no crease shows where a bank begins or ends.
    rest * rest * (3.0 - 2.0 * rest)
}

/// Raises the value of a vertex to `value`, if that is greater.
pub(super) fn raise<T: Copy + PartialOrd>(grid: &mut Grid<T>, x: i64, y: i64, value: T) {
    let here = &mut grid.row_mut(y, x, x + 1)[0];
    if value > *here {
        *here = value;
    }
}

/// A straight piece of an agent's line, in `f32`, since its points lie near the line's origin. Pairs hold values at its
/// start and its end.
struct BedPiece {
    /// The line's origin, a vertex.
    origin: [i64; 2],
    from: [f32; 2],
    to: [f32; 2],
    half_width_m: [f32; 2],
    floor_m: [f32; 2],
    filled_m: [f32; 2],
    bank_m: f32,
    spacing_m: f32,
}

impl BedPiece {
    fn new(line: &Line, [from, to]: [&LinePoint; 2], bank_m: f32) -> BedPiece {
        let ends = |value: fn(&LinePoint) -> f64| [value(from) as f32, value(to) as f32];
        BedPiece {
            origin: line.origin,
            from: from.place.map(|at| at as f32),
            to: to.place.map(|at| at as f32),
            half_width_m: ends(|point| point.half_width_m),
            floor_m: ends(|point| point.floor_m),
            filled_m: ends(|point| point.level_m - point.floor_m),
            bank_m,
            spacing_m: line.spacing_m as f32,
        }
    }

    /// Returns the vertices of `area` that the piece can have an effect on, and a few more.
    fn near(&self, area: Area) -> Area {
        let reach = (self.half_width_m[0].max(self.half_width_m[1]) + self.bank_m) / self.spacing_m;
        // Rounded outwards, so that no vertex is missed. The origin is added after the conversion to a whole number:
        // far out in the world a float has no room for it.
        let low = |axis: usize, edge: i64| {
            (self.origin[axis] + (self.from[axis].min(self.to[axis]) - reach).floor() as i64).max(edge)
        };
        let high = |axis: usize, edge: i64| {
            (self.origin[axis] + (self.from[axis].max(self.to[axis]) + reach).ceil() as i64 + 1).min(edge)
        };
        let (x0, y0) = (low(0, area.x0), low(1, area.y0));
        // Beside the area the end would come before the beginning, so the area is made empty.
        Area { x0, y0, x1: high(0, area.x1).max(x0), y1: high(1, area.y1).max(y0) }
    }

    /// Returns the place of a vertex relative to the piece.
    fn nearest(&self, x: i64, y: i64) -> Nearest {
        let along = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        // Whole numbers are subtracted first: the difference is small and exact, wherever in the world the line lies.
        let east = (x - self.origin[0]) as f32 - self.from[0];
        let south = (y - self.origin[1]) as f32 - self.from[1];
        let share = if square > 0.0 { ((east * along[0] + south * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
        let (off_east, off_south) = (east - along[0] * share, south - along[1] * share);
        let distance_m = (off_east * off_east + off_south * off_south).sqrt() * self.spacing_m;
        let between = |[from, to]: [f32; 2]| from + (to - from) * share;
        let half_width_m = between(self.half_width_m);
        Nearest {
            outside_m: distance_m - half_width_m,
            floor_m: between(self.floor_m),
            filled_m: between(self.filled_m),
            half_width_m,
        }
    }
}
