//! Colours of the ground by climate: straw for the grass of steppes, red-brown for stones of hot deserts, dark green for
//! rain forest.
//!
//! A table for each material has colours at some temperatures and droughts, and all other climates lie between those,
//! so no line runs through the land where one biome ends. Styles have colours of their own, so what is used of the
//! tables is by how much each colour differs from that of the same material in a mild and moist climate. The numbers
//! were chosen by eye, beside pictures of Earth from space (NASA, Blue Marble) and maps of the world in the style
//! `satellite`.

use crate::geography::climate::PlaceClimate;
use crate::geography::rock::{RockAtPlace, RockKind};
use crate::grain_point::Point;
use crate::grid::Grid;
use crate::map::terrain::Nodes;
use crate::tile::Material;
use crate::world::World;

/// Mean temperatures of the tables' rows in degrees Celsius.
const WARMTHS_C: [f32; 5] = [-12.0, -2.0, 8.0, 18.0, 26.0];

/// Droughts of the tables' columns; see [`PlaceClimate::drought`].
const DROUGHTS: [f32; 5] = [0.6, 1.5, 3.0, 8.0, 20.0];

/// Row and column of the mild and moist climate that has the style's own colours.
const MILD: [usize; 2] = [2, 0];

/// Drought from which on the kind of rock shows, and at which it shows most: no plants and no soil hide it.
const BARE: [f64; 2] = [3.0, 10.0];

/// Change of colour by the kind of rock, where ground is bare, in the order of [`RockKind::ALL`], as parts of the colour:
/// red, green, blue. Sandstone is red with iron, basalt dark, and clay pale.
const OF_ROCK: [[f32; 3]; RockKind::ALL.len()] =
    [[-0.1, -0.12, -0.12], [0.0, -0.14, -0.24], [-0.34, -0.32, -0.28], [0.06, 0.06, 0.06]];

/// Colours (sRGB) of a material: a row for each of [`WARMTHS_C`], a column for each of [`DROUGHTS`].
type ClimateColours = [[[u8; 3]; 5]; 5];

/// Tundra, meadows, prairie, savanna.
const GRASS: ClimateColours = [
    [[118, 112, 84], [124, 114, 86], [136, 122, 92], [152, 136, 106], [160, 144, 114]],
    [[104, 106, 70], [116, 110, 76], [144, 128, 90], [162, 142, 106], [170, 150, 116]],
    [[104, 120, 66], [118, 120, 68], [160, 142, 94], [176, 152, 110], [182, 158, 118]],
    [[92, 112, 54], [120, 116, 68], [158, 136, 90], [188, 156, 108], [200, 164, 116]],
    [[74, 102, 40], [118, 112, 62], [150, 128, 80], [196, 156, 104], [210, 166, 114]],
];

/// Larches, spruces, deciduous forest, Mediterranean woods, rain forest.
const FOREST: ClimateColours = [
    [[56, 64, 48], [62, 66, 50], [74, 74, 56], [80, 78, 60], [80, 78, 60]],
    [[36, 53, 43], [46, 59, 44], [66, 70, 50], [78, 78, 56], [78, 78, 56]],
    [[51, 70, 44], [66, 78, 46], [86, 88, 56], [96, 94, 62], [96, 94, 62]],
    [[52, 72, 38], [82, 86, 50], [104, 98, 62], [112, 104, 68], [112, 104, 68]],
    [[24, 60, 22], [66, 80, 34], [100, 94, 50], [112, 102, 60], [112, 102, 60]],
];

/// Frozen ground, brown earth, red earth of the tropics, desert pavement.
const DIRT: ClimateColours = [
    [[118, 108, 90], [122, 112, 94], [132, 120, 100], [144, 130, 110], [150, 136, 116]],
    [[124, 108, 84], [128, 112, 86], [142, 124, 96], [156, 136, 110], [162, 142, 116]],
    [[134, 112, 78], [138, 116, 82], [156, 132, 96], [170, 144, 110], [176, 150, 116]],
    [[136, 106, 70], [146, 114, 76], [170, 134, 92], [192, 152, 108], [202, 162, 116]],
    [[138, 92, 58], [150, 102, 62], [170, 126, 84], [200, 156, 112], [212, 172, 126]],
];

/// Grey rock, which is brown where it is hot and dry.
const ROCK: ClimateColours = [
    [[126, 121, 113], [128, 122, 114], [132, 124, 114], [138, 128, 116], [142, 132, 118]],
    [[130, 123, 113], [132, 124, 114], [138, 126, 112], [146, 130, 112], [150, 134, 116]],
    [[133, 124, 113], [136, 125, 112], [146, 128, 108], [158, 136, 110], [164, 142, 114]],
    [[132, 120, 106], [138, 122, 104], [154, 128, 100], [176, 140, 104], [184, 148, 110]],
    [[122, 108, 92], [136, 114, 92], [156, 124, 92], [182, 140, 98], [192, 150, 106]],
];

/// Beaches where it is wet, and dunes where it is dry: yellow, and orange where it is hot.
const SAND: ClimateColours = [
    [[190, 178, 148], [190, 178, 148], [190, 176, 146], [190, 174, 140], [192, 176, 140]],
    [[196, 182, 146], [196, 182, 146], [196, 180, 142], [198, 176, 134], [202, 180, 136]],
    [[203, 185, 142], [203, 185, 142], [204, 184, 140], [208, 182, 132], [212, 184, 132]],
    [[206, 188, 144], [206, 188, 144], [210, 184, 136], [220, 182, 122], [226, 186, 122]],
    [[210, 192, 150], [210, 192, 150], [214, 184, 134], [226, 176, 110], [234, 184, 114]],
];

/// Bogs, marshes, swamps.
const WETLAND: ClimateColours = [
    [[100, 96, 72], [104, 98, 74], [110, 104, 78], [114, 108, 82], [114, 108, 82]],
    [[92, 96, 68], [96, 98, 68], [104, 104, 74], [110, 108, 78], [110, 108, 78]],
    [[85, 104, 74], [88, 106, 72], [96, 106, 72], [104, 108, 76], [104, 108, 76]],
    [[74, 98, 60], [80, 100, 60], [92, 104, 64], [100, 106, 68], [100, 106, 68]],
    [[52, 84, 44], [64, 92, 48], [84, 100, 56], [96, 104, 62], [96, 104, 62]],
];

/// The colours of materials, in the order of [`Material::ALL`]: snow is white everywhere, and scree is rock.
const COLOURS: [Option<&ClimateColours>; 8] =
    [Some(&GRASS), Some(&DIRT), Some(&ROCK), Some(&SAND), None, Some(&FOREST), Some(&ROCK), Some(&WETLAND)];

/// Adds the changes of colours at nodes of a world, times `strength`, to the planes of red, green and blue that
/// [`covers_of`](super::relief::ShadedRelief::covers_of) gives for them. A world without a geography has none.
pub(super) fn add_changes([red, green, blue, _]: &mut [Grid<f32>; 4], nodes: &Nodes, world: &World, strength: f32) {
    let Some(geography) = world.geography() else { return };
    let area = nodes.heights.area();
    let (vertices, sea_m) = (world.stride().vertices(), world.preset().sea_level_m.unwrap_or(0.0));
    for y in area.y0..area.y1 {
        let row = |grid| Grid::row(grid, y, area.x0, area.x1);
        let (heights, ground, cover) = (nodes.heights.row(y, area.x0, area.x1), row(&nodes.ground), row(&nodes.cover));
        let places: Vec<Point> = (area.x0..area.x1).map(|x| Point::at_vertex(x * vertices, y * vertices)).collect();
        let climates = geography.climates(&places);
        let [red, green, blue] = [&mut *red, &mut *green, &mut *blue].map(|plane| plane.row_mut(y, area.x0, area.x1));
        for (n, (at, climate)) in places.into_iter().zip(climates).enumerate() {
            let rock = || geography.rocks(&[at], &geography.land_at_large(&[at]))[0];
            let changes = changes(&climate, (f64::from(heights[n]) - sea_m).max(0.0), rock);
            let weights = ground[n].to_le_bytes().into_iter().chain(cover[n].to_le_bytes());
            for (weight, change) in weights.zip(changes) {
                let seen = f32::from(weight) * (strength / 255.0);
                red[n] += change[0] * seen;
                green[n] += change[1] * seen;
                blue[n] += change[2] * seen;
            }
        }
    }
}

/// Returns the changes of the materials' colours, in the order of [`Material::ALL`], at a height in metres above the
/// sea: red, green and blue, in steps of sRGB from 0 to 255, 0 each in a mild and moist climate. `rock` is asked for the
/// rock of the place only where it shows.
fn changes(climate: &PlaceClimate, height_m: f64, rock: impl FnOnce() -> RockAtPlace) -> [[f32; 3]; 8] {
    let drought = climate.drought(height_m);
    let row = ClimateStep::of(climate.temperature_c(height_m) as f32, WARMTHS_C);
    let column = ClimateStep::of(drought as f32, DROUGHTS);
    let bare = ((drought - BARE[0]) / (BARE[1] - BARE[0])).clamp(0.0, 1.0) as f32;
    let of_rock = if bare > 0.0 { of_rock(&rock()).map(|change| change * bare) } else { [0.0; 3] };
    Material::ALL.map(|material| {
        let Some(colours) = COLOURS[material as usize] else { return [0.0; 3] };
        let mineral =
            if matches!(material, Material::Dirt | Material::Rock | Material::Scree) { of_rock } else { [0.0; 3] };
        [0, 1, 2].map(|channel| {
            let at = |row: usize, column: usize| f32::from(colours[row][column][channel]);
            let between = |row| column.between(at(row, column.from), at(row, column.from + 1));
            let here = row.between(between(row.from), between(row.from + 1));
            here * (1.0 + mineral[channel]) - at(MILD[0], MILD[1])
        })
    })
}

/// Returns the change of colour by the rock of a place, as parts of the colour.
fn of_rock(rock: &RockAtPlace) -> [f32; 3] {
    [0, 1, 2].map(|channel| {
        let of_kinds = rock.shares.iter().zip(OF_ROCK);
        of_kinds.map(|(share, change)| *share as f32 * change[channel]).sum()
    })
}

/// A position between two knots: the number of the first, and the share of the way to the second.
#[derive(Clone, Copy)]
struct ClimateStep {
    from: usize,
    share: f32,
}

impl ClimateStep {
    /// Finds a value between knots. Values beyond the ends are at that end.
    fn of(value: f32, knots: [f32; 5]) -> ClimateStep {
        let from = knots[1..4].iter().filter(|knot| value > **knot).count();
        ClimateStep { from, share: ((value - knots[from]) / (knots[from + 1] - knots[from])).clamp(0.0, 1.0) }
    }

    fn between(self, first: f32, second: f32) -> f32 {
        first + (second - first) * self.share
    }
}
