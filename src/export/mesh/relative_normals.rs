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
    let mut texels = vec![[128, 128, 255]; side * side];
    for triangle in &surface.triangles {
        let corners = triangle.map(|index| surface.vertices[index as usize].map(i64::from));
        let normals = corners.map(normal);
        let [a, b, c] = corners;
        // Twice the area of the triangle of two corners and a place, positive inside.
        let side_of =
            |[x0, y0]: [i64; 2], [x1, y1]: [i64; 2], [x, y]: [i64; 2]| (y1 - y0) * (x - x0) - (x1 - x0) * (y - y0);
        let whole = side_of(a, b, c) as f32;
        let least = |axis: usize| a[axis].min(b[axis]).min(c[axis]);
        let most = |axis: usize| a[axis].max(b[axis]).max(c[axis]);
        for row in least(1)..=most(1) {
            for column in least(0)..=most(0) {
                let at = [column, row];
                let shares = [side_of(b, c, at), side_of(c, a, at), side_of(a, b, at)];
                if shares.into_iter().all(|share| share >= 0) {
                    let shares = shares.map(|share| share as f32 / whole);
                    let mixed = [0, 1, 2].map(|axis| (0..3).map(|corner| normals[corner][axis] * shares[corner]).sum());
                    texels[row as usize * side + column as usize] = texel(normal(at), mixed);
                }
            }
        }
    }
    texels.into_flattened()
}

/// A normal in the frame of the mesh's normal, which need not be a unit.
fn texel(normal: [f32; 3], mixed: [f32; 3]) -> [u8; 3] {
    let length = dot(mixed, mixed).sqrt();
    let up = mixed.map(|axis| axis / length);
    let [east, rise, south, _] = tangent(up);
    let ahead = [east, rise, south];
    let aside = [up[1] * south - up[2] * rise, up[2] * east - up[0] * south, up[0] * rise - up[1] * east];
    [ahead, aside, up].map(|axis| (dot(normal, axis) * 127.5 + 128.0) as u8)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
