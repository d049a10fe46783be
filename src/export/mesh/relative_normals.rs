//! Normal maps for meshes with few vertices: what their own normals leave out.

use crate::mesh::Surface;
use crate::tile::Tile;

use super::values::tangent;

/// The raster's normals as a mesh's material has them: relative to the normal and the tangent that the mesh has at each
/// vertex of the raster, in RGB, row by row; green is north.
///
/// So the mesh is lit as the raster would be, at any level of detail.
pub(super) fn relative_normals(tile: &Tile, surface: &Surface) -> Vec<u8> {
    let area = tile.area();
    let side = area.width();
    let normal = |[column, row]: [i64; 2]| tile.normals().at(area.x0 + column, area.y0 + row);
    // All are set below, since a surface covers its tile.
    let mut texels = vec![[128, 128, 255]; side * side];
    surface.for_each_under(|corners, at, parts| {
        let normals = corners.map(normal);
        // The sum need not be a unit.
        let mixed = [0, 1, 2].map(|axis| (0..3).map(|corner| normals[corner][axis] * parts[corner] as f32).sum());
        texels[at[1] as usize * side + at[0] as usize] = texel(normal(at), mixed);
    });
    texels.into_flattened()
}

/// A normal in the frame of the mesh's normal, which need not be a unit.
fn texel(normal: [f32; 3], mixed: [f32; 3]) -> [u8; 3] {
    let length = dot(mixed, mixed).sqrt();
    let up = mixed.map(|axis| axis / length);
    let [east, rise, south, _] = tangent(up);
    let ahead = [east, rise, south];
    // The bitangent is normal x tangent, as glTF has it where the tangent's fourth number is 1.
    let aside = [up[1] * south - up[2] * rise, up[2] * east - up[0] * south, up[0] * rise - up[1] * east];
    [ahead, aside, up].map(|axis| (dot(normal, axis) * 127.5 + 128.0) as u8)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
