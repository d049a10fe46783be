//! The surfaces of water: few triangles between banks and shores, because water is flat.

use std::collections::{HashMap, HashSet};

use spade::Triangulation;
use spade::handles::FixedVertexHandle;

use super::PARTS;
use super::constrained::{CutVertex, constrained};
use super::waterline::{WaterPoint, Waterlines};
use crate::land::WaterKind;

/// The surface of the water of one kind on a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct WaterSheet {
    /// River, lake or sea.
    pub kind: WaterKind,
    /// Vertices: [parts](PARTS) of a cell east and south of the tile's north-western corner, and height in metres.
    pub vertices: Vec<([u32; 2], f32)>,
    /// Triangles, counter-clockwise seen from above, as in [`Surface`](super::Surface).
    pub triangles: Vec<[u32; 3]>,
}

/// Returns the water surfaces of a tile, of rivers, lakes and the sea, as far as there are any. On the tile's edge they
/// have vertices at its corners and where shores and banks cross it, which the neighbour has too.
pub fn sheets(waters: &Waterlines) -> Vec<WaterSheet> {
    let side = waters.cells() as u32;
    let shores: HashMap<[i64; 2], WaterKind> = waters
        .lines()
        .iter()
        .filter(|line| line.kind != WaterKind::River)
        .flat_map(|line| line.points.iter().map(|point| (point.place, line.kind)))
        .collect();
    // Each vertex has the water whose edge it lies on, or in which it lies, and that water's level in metres.
    let place = |point: &WaterPoint| {
        let kind = shores.get(&point.place).copied().unwrap_or(WaterKind::River);
        CutVertex { place: point.place, is: (kind, point.level_m) }
    };
    let mut places: Vec<CutVertex<(WaterKind, f32)>> = waters.points().iter().map(place).collect();
    let known: HashSet<[i64; 2]> = places.iter().map(|place| place.place).collect();
    for corner in [[0, 0], [side, 0], [0, side], [side, side]] {
        let place = corner.map(|at| i64::from(at) * i64::from(PARTS));
        if !known.contains(&place) {
            places.push(CutVertex { place, is: waters.at_vertex(corner).unwrap_or((WaterKind::Dry, 0.0)) });
        }
    }
    let numbers: HashMap<[i64; 2], usize> =
        places.iter().enumerate().map(|(number, place)| (place.place, number)).collect();
    // Each piece has its water on the left, as the triangulation turns.
    let pieces: HashMap<[usize; 2], WaterKind> =
        waters.pieces().map(|(kind, ends)| (ends.map(|end| numbers[&end]), kind)).collect();
    let mut edges: Vec<[usize; 2]> = pieces.keys().copied().collect();
    edges.sort_unstable();
    let surface = constrained(places, edges.into_iter());
    let mut sheets: Vec<WaterSheet> = [WaterKind::River, WaterKind::Lake, WaterKind::Sea]
        .map(|kind| WaterSheet { kind, vertices: Vec::new(), triangles: Vec::new() })
        .into();
    let mut given: Vec<HashMap<usize, u32>> = vec![HashMap::new(); sheets.len()];
    for face in surface.inner_faces() {
        let corners = face.vertices().map(|vertex| vertex.fix());
        let number = |vertex: FixedVertexHandle| vertex.index();
        let sides = [0, 1, 2].map(|side| [number(corners[side]), number(corners[(side + 1) % 3])]);
        // A triangle at the tile's edge takes the water of the edge, as the neighbour's triangle does. Any other takes
        // the water of a shore or bank at its side, or else the water around its middle.
        let at = |corner: usize| surface.vertex(corners[corner]).data().place;
        let border = [0, 1, 2].into_iter().find_map(|side| waters.border([at(side), at((side + 1) % 3)]));
        let inside = sides.iter().find_map(|side| pieces.get(side).copied());
        let is_ashore =
            sides.iter().any(|&[from, to]| matches!(pieces.get(&[to, from]), Some(kind) if *kind != WaterKind::River));
        let middle = [0, 1]
            .map(|axis| corners.iter().map(|at| surface.vertex(*at).data().place[axis] as f64).sum::<f64>() / 3.0);
        let around = || match is_ashore {
            true => None,
            false => waters.standing_at(middle),
        };
        let river = || waters.is_river(middle).then_some(WaterKind::River);
        let kind = border.unwrap_or_else(|| inside.or_else(around).or_else(river));
        let Some(kind) = kind else { continue };
        let Some(sheet) = sheets.iter().position(|sheet| sheet.kind == kind) else { continue };
        let own = corners.map(|corner| surface.vertex(corner).data().is).into_iter().filter(|(own, _)| *own == kind);
        let still_m = own.map(|(_, level_m)| level_m).reduce(f32::max);
        let still_m = still_m.or_else(|| waters.standing_level_m(middle)).unwrap_or(0.0);
        let WaterSheet { vertices, triangles, .. } = &mut sheets[sheet];
        let [a, b, c] = corners.map(|corner| {
            *given[sheet].entry(corner.index()).or_insert_with(|| {
                let CutVertex { place, is: (own, level_m) } = *surface.vertex(corner).data();
                // Standing water stays level up to the mouth of a river.
                let level_m = if own == kind || kind == WaterKind::River { level_m } else { still_m };
                vertices.push((place.map(|at| at as u32), level_m));
                vertices.len() as u32 - 1
            })
        });
        // Spade turns counter-clockwise with y up, which is clockwise with y south.
        triangles.push([a, c, b]);
    }
    sheets.retain(|sheet| !sheet.triangles.is_empty());
    sheets
}
