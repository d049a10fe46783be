//! Promise 3: far from the origin the terrain is as smooth and as varied as there.

use terrane::area::Area;
use terrane::preset::Preset;
use terrane::world::World;

/// Quantiles of the first and second differences between neighbouring vertices, over several places around a tile.
struct Differences {
    first: [f64; 3],
    second: [f64; 3],
}

fn differences(heights: impl Fn(i64, i64, usize, usize) -> Vec<f32>, tile: (i64, i64)) -> Differences {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    // Places 5 km apart, so that a single mountain does not decide.
    for place in 0..144 {
        let x0 = tile.0 * 256 + (place % 12) * 5003;
        let y0 = tile.1 * 256 + (place / 12) * 5003;
        let width = 64;
        let values = heights(x0, y0, width, 8);
        for row in values.chunks(width) {
            first.extend(row.windows(2).map(|pair| f64::from(pair[1] - pair[0]).abs()));
            second.extend(row.windows(3).map(|three| f64::from(three[2] - 2.0 * three[1] + three[0]).abs()));
        }
    }
    let quantiles = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        [0.25, 0.5, 0.9].map(|share| values[(values.len() as f64 * share) as usize])
    };
    Differences { first: quantiles(first), second: quantiles(second) }
}

/// How far the quantiles at one place may be from those at another, as a ratio: what different places of one world
/// differ by at most, seen over the presets and places below.
const LIKENESS: f64 = 1.6;

fn alike(one: &Differences, other: &Differences) -> bool {
    let pairs = one.first.iter().zip(&other.first).chain(one.second.iter().zip(&other.second));
    pairs.into_iter().all(|(a, b)| a.max(*b) <= LIKENESS * a.min(*b))
}

/// The thesis' terrain, whose finest octave has waves of little more than two vertices: nothing loses precision sooner.
fn world() -> World {
    World::new(Preset::load("thesis").unwrap().1, None).unwrap()
}

#[test]
fn far_away_is_like_the_origin() {
    let world = world();
    let heights = |x0, y0, width, height| world.relief().heights(Area::new(x0, y0, width, height)).values().to_vec();
    let origin = differences(heights, (0, 0));
    for tile in [(1_000_000_000, -1_000_000_000), (1 << 40, 1 << 40), (-(1 << 40), 3)] {
        let there = differences(heights, tile);
        assert!(
            alike(&origin, &there),
            "at tile {tile:?}: first {:?} and second {:?}; at the origin {:?} and {:?}",
            there.first,
            there.second,
            origin.first,
            origin.second
        );
    }
}

#[test]
fn coordinates_through_f32_would_be_noticed() {
    let world = world();
    // What a shader does that is handed world coordinates: the vertex that f32 makes of the vertex.
    let through_f32 = |x0: i64, y0: i64, width: usize, height: usize| {
        let at = |x: i64, y: i64| world.relief().heights(Area::new(x as f32 as i64, y as f32 as i64, 1, 1)).values()[0];
        Area::new(x0, y0, width, height).vertices().map(|(x, y)| at(x, y)).collect::<Vec<f32>>()
    };
    let heights = |x0, y0, width, height| world.relief().heights(Area::new(x0, y0, width, height)).values().to_vec();
    let origin = differences(heights, (0, 0));
    assert!(!alike(&origin, &differences(through_f32, (1_000_000_000, -1_000_000_000))));
}
