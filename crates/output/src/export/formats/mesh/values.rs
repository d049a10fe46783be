//! The numbers of meshes, as glTF stores them: attributes of vertices, and indices.

use gltf_json::accessor::{ComponentType, Type};
use gltf_json::mesh::Semantic;

use super::relative_normals::normal_at;

use crate::area::Area;
use crate::mesh::{Frame, Ground, GroundVertex, PARTS, Ribbon, WaterSheet};
use crate::preset::ground::GroundSettings;
use crate::tile::{Material, Tile};

/// An attribute's numbers as they lie in a file. Those of each vertex begin at a multiple of 4 bytes.
#[derive(Debug)]
pub(super) struct Values {
    pub component: ComponentType,
    pub dimensions: Type,
    /// True if whole numbers stand for 0..1 or -1..1.
    pub normalized: bool,
    pub count: usize,
    pub bytes: Vec<u8>,
    /// The least and the greatest value of each dimension, for attributes of which readers need them.
    pub bounds: Option<[Vec<f64>; 2]>,
}

impl Values {
    /// Bytes from one vertex to the next.
    pub fn stride(&self) -> usize {
        (self.component.size() * self.dimensions.multiplicity()).next_multiple_of(4)
    }

    fn floats<const N: usize>(values: impl Iterator<Item = [f32; N]>) -> Values {
        let values: Vec<[[u8; 4]; N]> = values.map(|value| value.map(f32::to_le_bytes)).collect();
        Values {
            component: ComponentType::F32,
            dimensions: dimensions(N),
            normalized: false,
            count: values.len(),
            bytes: values.into_flattened().into_flattened(),
            bounds: None,
        }
    }

    fn whole<const N: usize, const BYTES: usize>(
        component: ComponentType,
        values: impl Iterator<Item = [[u8; BYTES]; N]>,
    ) -> Values {
        // Pad each value to a multiple of 4 bytes, as glTF requires of vertices.
        let mut all = Values {
            component,
            dimensions: dimensions(N),
            normalized: true,
            count: 0,
            bytes: Vec::new(),
            bounds: None,
        };
        let stride = all.stride();
        for value in values {
            all.count += 1;
            all.bytes.extend(value.as_flattened());
            all.bytes.resize(all.count * stride, 0);
        }
        all
    }

    /// Packs numbers from 0 to 1, in 16 bits if `quantized`.
    fn shares<const N: usize>(values: impl Iterator<Item = [f32; N]>, quantized: bool) -> Values {
        if !quantized {
            return Values::floats(values);
        }
        let whole = |share: f32| ((share * 65535.0 + 0.5) as u16).to_le_bytes();
        Values::whole(ComponentType::U16, values.map(|value| value.map(whole)))
    }

    /// Packs directions, in 8 bits if `quantized`.
    fn directions<const N: usize>(values: impl Iterator<Item = [f32; N]>, quantized: bool) -> Values {
        if !quantized {
            return Values::floats(values);
        }
        // -128 is not used: glTF takes both -127 and -128 for -1.
        let whole = |axis: f32| ((axis * 127.0).round() as i8).to_le_bytes();
        Values::whole(ComponentType::I8, values.map(|value| value.map(whole)))
    }

    /// Packs positions as floats, with their bounds.
    fn positions(places: impl Iterator<Item = [f32; 3]> + Clone) -> Values {
        Values::floats(places.clone()).bounded(places.map(|place| place.map(f64::from)))
    }

    /// Adds the bounds of positions.
    fn bounded<const N: usize>(mut self, places: impl Iterator<Item = [f64; N]>) -> Values {
        let mut bounds = [vec![f64::INFINITY; N], vec![f64::NEG_INFINITY; N]];
        for place in places {
            for (axis, value) in place.into_iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(value);
                bounds[1][axis] = bounds[1][axis].max(value);
            }
        }
        self.bounds = Some(bounds);
        self
    }
}

fn dimensions(count: usize) -> Type {
    match count {
        1 => Type::Scalar,
        2 => Type::Vec2,
        3 => Type::Vec3,
        4 => Type::Vec4,
        _ => unreachable!("no attribute has {count} dimensions"),
    }
}

/// A mesh, ready to be written.
#[derive(Debug)]
pub(super) struct MeshData {
    pub attributes: Vec<(Semantic, Values)>,
    /// Indices of triangles, in an order that suits a GPU.
    pub indices: Vec<u32>,
}

/// Returns the tangent at a vertex with this normal, for textures that lie from west to east: east, up, south, and the
/// side of the bitangent, which points north.
pub(super) fn tangent([east, up, _]: [f32; 3]) -> [f32; 4] {
    let length = (east * east + up * up).sqrt();
    // The tangent is at right angles to the normal and to the south, so that textures lie straight.
    if length > 0.0 { [up / length, -east / length, 0.0, 1.0] } else { [1.0, 0.0, 0.0, 1.0] }
}

/// Returns the raster's value at a place in a tile, in [parts](PARTS) of a cell: the value of a vertex or, between
/// vertices, the mean of those around, weighted by nearness.
pub(super) fn between<const N: usize>(tile: &Tile, place: [u32; 2], at: impl Fn(i64, i64) -> [f32; N]) -> [f32; N] {
    let area = tile.area();
    let [(x, u), (y, v)] = [(area.x0, 0), (area.y0, 1)].map(|(first, axis)| {
        let (cells, parts) = (place[axis] / PARTS as u32, place[axis] % PARTS as u32);
        (first + i64::from(cells), parts as f32 / PARTS as f32)
    });
    let mix =
        |a: [f32; N], b: [f32; N], share: f32| std::array::from_fn(|index| a[index] + (b[index] - a[index]) * share);
    // On the edge of the tile, vertices beyond it are not read.
    let row = |y: i64| if u == 0.0 { at(x, y) } else { mix(at(x, y), at(x + 1, y), u) };
    if v == 0.0 { row(y) } else { mix(row(y), row(y + 1), v) }
}

/// Returns the land of a tile: positions, normals, texture coordinates, the weights of materials, and tangents if the
/// material has a normal map. Quantised numbers are whole, and positions count the steps of the frame.
pub(super) fn of_land(
    tile: &Tile,
    land: &Ground,
    frame: &Frame,
    ground: &GroundSettings,
    quantized: bool,
    tangents: bool,
) -> MeshData {
    let normals = || land.vertices.iter().map(|vertex| normal_at(tile, vertex));
    let side = (land.cells * PARTS as u32) as f32;
    let in_tile = land.vertices.iter().map(|vertex| vertex.place.map(|at| at as f32 / side));
    let mut attributes = vec![
        (Semantic::Positions, positions(tile, land, frame, quantized)),
        (Semantic::Normals, Values::directions(normals(), quantized)),
    ];
    if tangents {
        attributes.push((Semantic::Tangents, Values::directions(normals().map(tangent), quantized)));
    }
    attributes.push((Semantic::TexCoords(0), Values::shares(in_tile, quantized)));
    // Weights as in the blend map, four in a word, since Blender ignores attributes of a single byte.
    let weights: Vec<[u8; 8]> = land.vertices.iter().map(|vertex| weights_at(tile, vertex)).collect();
    for (half, (name, materials)) in ["GROUND", "COVER"].into_iter().zip(Material::ALL.chunks(4)).enumerate() {
        if materials.iter().any(|material| material.is_of(ground)) {
            let of_half = weights.iter().map(|all| [0, 1, 2, 3].map(|channel| [all[4 * half + channel]]));
            attributes.push((Semantic::Extras(name.to_owned()), Values::whole(ComponentType::U8, of_half)));
        }
    }
    MeshData { attributes, indices: land.triangles.as_flattened().to_vec() }
}

/// Returns the weights of all materials at a vertex of a ground. Their sum is 255 between the raster's vertices too.
fn weights_at(tile: &Tile, vertex: &GroundVertex) -> [u8; 8] {
    let blend = tile.blend();
    let all = |x: i64, y: i64| {
        let halves = [blend.ground(), blend.cover()].map(|words| words.at(x, y).to_le_bytes());
        std::array::from_fn::<f32, 8, _>(|channel| f32::from(halves[channel / 4][channel % 4]))
    };
    let mixed = between(tile, vertex.place, all);
    let mut weights = mixed.map(|weight| weight as u8);
    // Give what rounding down has left to the weights that lost most by it.
    let mut order: [usize; 8] = std::array::from_fn(|channel| channel);
    order.sort_by(|a, b| mixed[*b].fract().total_cmp(&mixed[*a].fract()));
    let left = 255 - weights.iter().map(|weight| u32::from(*weight)).sum::<u32>().min(255);
    for channel in order.into_iter().take(left as usize) {
        weights[channel] += 1;
    }
    weights
}

/// Returns the land of a tile with positions alone.
pub(super) fn positions_of_land(tile: &Tile, land: &Ground, frame: &Frame, quantized: bool) -> MeshData {
    let attributes = vec![(Semantic::Positions, positions(tile, land, frame, quantized))];
    MeshData { attributes, indices: land.triangles.as_flattened().to_vec() }
}

/// Returns the positions of the land's vertices. Quantised positions count the steps of the frame.
fn positions(tile: &Tile, land: &Ground, frame: &Frame, quantized: bool) -> Values {
    let area = tile.area();
    // The node's scale converts steps to metres: shared vertices stay exactly where the neighbours have them.
    if quantized {
        let steps = land.vertices.iter().map(|vertex| {
            let [east, south] = frame.steps_between(&area, vertex.place).map(|steps| steps as u16);
            [east, frame.height_steps(vertex.height_m), south]
        });
        let values = Values::whole(ComponentType::U16, steps.clone().map(|place| place.map(u16::to_le_bytes)));
        Values { normalized: false, ..values }.bounded(steps.map(|place| place.map(f64::from)))
    } else {
        Values::positions(land.vertices.iter().map(|vertex| placed(frame, &area, vertex.place, vertex.height_m)))
    }
}

/// Converts a place in parts of a cell and a height to metres east, up and south of the tile's corner.
fn placed(frame: &Frame, area: &Area, place: [u32; 2], height_m: f32) -> [f32; 3] {
    let [east, south] = frame.steps_between(area, place).map(|steps| (steps as f64 * frame.step_m()) as f32);
    [east, height_m, south]
}

/// Returns the surface of water as a mesh.
pub(super) fn of_sheet(sheet: &WaterSheet, frame: &Frame, area: &Area) -> MeshData {
    let places = sheet.vertices.iter().map(|(place, height_m)| placed(frame, area, *place, *height_m));
    let side = ((area.width() - 1) as u32 * PARTS as u32) as f32;
    let textures = sheet.vertices.iter().map(|(place, _)| place.map(|at| at as f32 / side));
    let attributes = vec![
        (Semantic::Positions, Values::positions(places)),
        (Semantic::Normals, Values::floats(sheet.vertices.iter().map(|_| [0.0, 1.0, 0.0]))),
        (Semantic::TexCoords(0), Values::floats(textures)),
    ];
    MeshData { attributes, indices: sheet.triangles.as_flattened().to_vec() }
}

/// Returns ribbons as one mesh.
pub(super) fn of_ribbons(ribbons: &[Ribbon], frame: &Frame, area: &Area) -> MeshData {
    let vertices = || ribbons.iter().flat_map(|ribbon| &ribbon.vertices);
    let places = vertices().map(|vertex| {
        let [east, south] = frame.local_m(area, vertex.place);
        [east as f32, vertex.height_m as f32, south as f32]
    });
    let attributes = vec![
        (Semantic::Positions, Values::positions(places)),
        (Semantic::Normals, Values::floats(vertices().map(|vertex| vertex.normal))),
        (Semantic::TexCoords(0), Values::floats(vertices().map(|vertex| vertex.texture))),
    ];
    let mut indices = Vec::new();
    let mut before = 0;
    for ribbon in ribbons {
        indices.extend(ribbon.triangles.as_flattened().iter().map(|index| before + index));
        // Indices count from the first vertex of the mesh, a ribbon's from the ribbon's own first vertex.
        before += ribbon.vertices.len() as u32;
    }
    MeshData { attributes, indices }
}
