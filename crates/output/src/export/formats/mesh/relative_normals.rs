//! Normal maps for meshes with few vertices: the detail that their own normals leave out.

use crate::area::Area;
use crate::mesh::{Facet, Ground, GroundVertex, PARTS, RowSpan};
use crate::simd::{Kernel, Simd, dispatch};
use crate::tile::{Normals, Tile};

/// Returns the raster's normals for the material of a mesh: relative to the normal and the
/// [tangent](super::values::tangent) that the mesh has at each vertex of the raster, in RGB, row by row; green is
/// north.
///
/// With them the mesh is lit as the raster would be, at any level of detail.
pub(super) fn relative_normals(tile: &Tile, ground: &Ground) -> Vec<u8> {
    let area = tile.area();
    // All words are set below, since a ground covers its tile.
    let mut words = vec![0; area.len()];
    for (facet, triangle) in ground.facets().zip(&ground.triangles) {
        let corners = triangle.map(|corner| normal_at(tile, &ground.vertices[corner as usize]));
        dispatch(Relative { area, normals: tile.normals(), facet, corners, words: &mut words });
    }
    // A lane makes a word for each texel; three bytes of the word are the texel.
    let mut texels = vec![[0; 3]; words.len()];
    for (texel, word) in texels.iter_mut().zip(words) {
        let [red, green, blue, _] = word.to_le_bytes();
        *texel = [red, green, blue];
    }
    texels.into_flattened()
}

/// Returns the normal of a vertex of a ground: the raster's, or between its vertices the mean of those around.
pub(super) fn normal_at(tile: &Tile, vertex: &GroundVertex) -> [f32; 3] {
    let mixed = super::values::between(tile, vertex.place, |x, y| tile.normals().at(x, y));
    if vertex.place.iter().all(|at| at % PARTS as u32 == 0) {
        return mixed;
    }
    let length = mixed.iter().map(|axis| axis * axis).sum::<f32>().sqrt();
    mixed.map(|axis| axis / length)
}

/// Converts the normals under a triangle to the tangent frames of the mesh.
struct Relative<'a> {
    area: Area,
    normals: &'a Normals,
    facet: Facet,
    /// The normals of the triangle's corners.
    corners: [[f32; 3]; 3],
    /// The texels of the area: red in the lowest byte, then green and blue.
    words: &'a mut [u32],
}

impl Kernel for Relative<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let width = self.area.width();
        for span in self.facet.spans() {
            let normal = self.normals.row(self.area.y0 + span.row as i64, self.area.x0, self.area.x1);
            let words = &mut self.words[span.row * width..][..width];
            let mut column = span.column;
            while column < span.column + span.count {
                // Near the end of the row, the vector begins before the column.
                let from = column.min(width - S::LANES);
                let offset = simd.lane_numbers() + simd.splat_i32(from as i32 - span.column as i32);
                let texels = texels(simd, &span, simd.i32_to_f32(offset), &self.corners, normal, from);
                // Lanes beside the triangle belong to other triangles, and keep their words.
                let is_within =
                    simd.gt_i32(offset, simd.splat_i32(-1)) & simd.gt_i32(simd.splat_i32(span.count as i32), offset);
                let others = simd.load_u32(&words[from..]);
                simd.store_u32(simd.select_u32(is_within, texels, others), &mut words[from..]);
                column += S::LANES;
            }
        }
    }
}

/// Returns the texels at vertices some `offset` from the first of a span. The raster's normals, from column `from` of
/// the row on, are given in the frame of the normal that is mixed from the corners' normals.
#[inline(always)]
fn texels<S: Simd>(
    simd: S,
    span: &RowSpan,
    offset: S::F32,
    corners: &[[f32; 3]; 3],
    normal: [&[f32]; 3],
    from: usize,
) -> S::U32 {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let mut mixed = [zero; 3];
    let mut corner = 0;
    while corner < 3 {
        let share = simd.splat(span.shares[corner] as f32) + simd.splat(span.growth[corner] as f32) * offset;
        let mut axis = 0;
        while axis < 3 {
            mixed[axis] = mixed[axis] + simd.splat(corners[corner][axis]) * share;
            axis += 1;
        }
        corner += 1;
    }
    // The sum need not have length 1.
    let [east, up, south] = mixed;
    let length = simd.sqrt((east * east + up * up) + south * south);
    let [east, up, south] = [east / length, up / length, south / length];
    // The tangent, which has no southern component.
    let length = simd.sqrt(east * east + up * up);
    let is_upright = simd.gt(length, zero);
    let ahead_east = simd.select(is_upright, up / length, one);
    let ahead_up = simd.select(is_upright, -east / length, zero);
    // The bitangent is normal x tangent, as glTF has it where the tangent's fourth number is 1.
    let (aside_east, aside_up) = (-(south * ahead_up), south * ahead_east);
    let aside_south = east * ahead_up - up * ahead_east;
    let normal_east = simd.load(&normal[0][from..]);
    let normal_up = simd.load(&normal[1][from..]);
    let normal_south = simd.load(&normal[2][from..]);
    let ahead = normal_east * ahead_east + normal_up * ahead_up;
    let aside = (normal_east * aside_east + normal_up * aside_up) + normal_south * aside_south;
    let above = (normal_east * east + normal_up * up) + normal_south * south;
    // The vectors have length 1, so no value exceeds a byte.
    let (scale, middle) = (simd.splat(127.5), simd.splat(128.0));
    let red = simd.truncate_to_i32(ahead * scale + middle);
    let green = simd.truncate_to_i32(aside * scale + middle);
    let blue = simd.truncate_to_i32(above * scale + middle);
    red | simd.shl::<8>(green) | simd.shl::<16>(blue)
}
