//! Dunes: what the wind makes of the sand of sand seas.
//!
//! A plane of its own, bent over hundreds of kilometres, is laid over the world so that the wind blows along its first
//! axis everywhere. In it, crests are where a phase is whole: the distance along the axis or across it in wavelengths,
//! swayed by noise. Where crest lines begin and end in pairs, the phase turns once around each end. So crests go on for
//! as long as they may, join, and never jump. Crescents and stars stand on lattices.
//!
//! Which kind there is follows from the sand and from the wind: where the wind comes from one side, crescents, or where
//! there is more sand, ridges across it; where it swings between sides, lines along it; and where it comes from
//! everywhere, stars. Where a phase changes faster, its dunes are lower, and sand that is steeper than it lies slides.
//!
//! Dunes only add height, and none lies on water or near to it. They have hollows without outlet between them, as real
//! ones do. So they come after breaches, and no river flows there. Seen from so far that a kind's shapes are lost, the
//! land is higher by their mean.
//!
//! Based on: N. Lancaster, Geomorphology of desert dunes, 1995 (kinds, sizes and distances); S. Courrech du Pont, C.
//! Narteau, X. Gao, Two modes for dune orientation, 2014.
//!
//! To judge the numbers chosen by eye, look at hillshades of deserts of `world`.

use super::fields::Fields;
use super::free_ground::{FreeGround, free_ground};
use super::segment::Segments;
use super::warp::Displaced;
use crate::area::Area;
use crate::clock::Clock;
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::grid::{between_corners, corners};
use crate::hash::{self, Stream};
use crate::land::{Land, WaterKind};
use crate::noise::point_noise::{PointField, PointNoise};
use crate::stop::Stopped;

/// Wavelength and amplitude in metres of the bends of the plane: they turn the wind by up to 35 degrees.
const BENDS_M: f64 = 360e3;
const BENT_M: f64 = 60e3;

/// Steadiness of the wind below which it counts as coming from everywhere, and above which as coming from one side; the
/// range over which one passes into the other; and the wavelength in metres of chance in it.
const VARIABLE: f64 = 0.26;
const STEADY: f64 = 0.5;
const PASSES: f64 = 0.08;
const STEADY_M: f64 = 180e3;

/// Sand that covers the ground; sand at which crescents give way to ridges, and narrow lines to wide ones; and sand
/// with
/// which dunes have their whole height.
pub const COVERS: f64 = 0.06;
const RIDGES: [f64; 2] = [0.22, 0.34];
const WIDE_LINES: [f64; 2] = [0.35, 0.55];
const WHOLE: f64 = 0.6;

/// Metres from the floor of a valley with a river, and half widths of the largest lakes from the middle of a lake, at
/// which dunes begin, and metres over which they reach their height; and the same range in metres of height above the
/// sea.
const FREE: FreeGround = FreeGround { off_rivers_m: 150.0, off_lakes: 1.5, rise_m: 700.0 };
const ABOVE_SEA_M: [f32; 2] = [1.0, 20.0];

/// Vertices between the corners between which the slowly varying numbers are interpolated, as those of hillsides are.
const CORNERS: i64 = 32;

/// Least wavelength of crest lines, and distance of stars, in nodes, and the largest distance of nodes in metres that
/// show crescents: others enter as their mean.
const SHORTEST: f64 = 4.0;
const STARS_SHORTEST: f64 = 8.0;
const CRESCENTS_SHOW_M: f64 = 40.0;

/// Nodes over which sand slides where it is steeper than a slip face.
const SLIDES: usize = 8;

/// Tangent of the angle of a slip face: 31 degrees.
const SLIP: f64 = 0.6;

/// Distance between crescents in metres; the share of places that have one; their widths in metres; their height, as a
/// share of the width; and the mean height of ground with crescents.
const CRESCENTS_M: f64 = 420.0;
const CRESCENTS: f64 = 0.8;
const CRESCENT_WIDTHS_M: [f64; 2] = [90.0, 300.0];
const CRESCENT_HEIGHT: f64 = 0.085;
const CRESCENTS_MEAN_M: f64 = 0.6;

/// Distance between stars in metres; their heights in metres; the slope of their arms' sides; and their mean height.
const STARS_M: f64 = 1900.0;
const STAR_HEIGHTS_M: [f64; 2] = [110.0, 190.0];
const STAR_SLOPE: f64 = 0.38;
const STARS_MEAN_M: f64 = 8.0;

/// Largest number of arms of a star.
const ARMS: usize = 5;

/// The dunes of a world.
#[derive(Debug)]
pub struct Dunes {
    bends: [PointNoise; 2],
    steady: PointNoise,
    /// Ridges across the wind, wide lines and narrow lines along it, and small dunes on all sand.
    crests: [CrestLines; 4],
    crescents: u64,
    stars: u64,
    /// Noise that bends the arms of stars.
    arms: [PointNoise; 2],
}

/// Crest lines at about even distances.
#[derive(Debug)]
struct CrestLines {
    /// Grains from one crest to the next.
    wavelength: i64,
    wavelength_m: f64,
    /// True for lines across the wind.
    is_across: bool,
    /// Greatest height in metres on the mean, and its mean over the ground as a share of that.
    height_m: f64,
    mean: f64,
    /// Noise by which lines sway, with the amplitudes in wavelengths.
    sways: [(PointNoise, f64); 2],
    /// Noise by which heights vary, and its amplitude.
    varies: (PointNoise, f64),
    /// Chance of the ends of lines; `None` where lines do not end in pairs.
    ends: Option<u64>,
    profile: fn(f64) -> f64,
}

/// A star: where it stands, its height, and its arms, each with its direction and length.
#[derive(Clone, Copy, Debug)]
struct StarDune {
    middle: Point,
    height_m: f64,
    arms: [([f64; 2], f64); ARMS],
    count: usize,
}

/// The slowly varying numbers of the dunes at the nodes of an area.
struct WindAndSand {
    /// Metres east and south by which the plane of the wind is bent.
    bends_m: [Vec<f32>; 2],
    /// Above 0 where the wind blows to the east.
    eastward: Vec<f32>,
    /// Factor of heights where the bent plane is narrower than the world.
    squeezed: Vec<f32>,
    /// Height of each kind as a share of its greatest: crest lines, crescents, stars.
    strengths: [Vec<f32>; 6],
}

const CRESCENT: usize = 4;
const STAR: usize = 5;

impl Dunes {
    /// Makes the dunes of a world with these fields; `None` where there is no sand.
    pub fn new(fields: &Fields, seed: u64) -> Option<Dunes> {
        if fields.most_laws().sand == 0.0 {
            return None;
        }
        let seed = |part| hash::stream(seed, Stream::Dunes.of(part));
        let grains = |metres: f64| (metres / fields.metres_a_grain()).round() as i64;
        let noise = |metres: f64, octaves, part| PointNoise::new(grains(metres), octaves, seed(part));
        // Each kind of crest lines has eight parts.
        let lines = |kind: u64, wavelength_m: f64, sways: [(f64, f64); 2], varies: (f64, f64)| CrestLines {
            wavelength: grains(wavelength_m),
            wavelength_m: grains(wavelength_m) as f64 * fields.metres_a_grain(),
            is_across: false,
            height_m: 0.0,
            mean: 0.0,
            sways: [0, 1].map(|n| (noise(sways[n].0 * wavelength_m, 1, 8 * kind + n as u64), sways[n].1)),
            varies: (noise(varies.0 * wavelength_m, 2, 8 * kind + 2), varies.1),
            ends: Some(seed(8 * kind + 3)),
            profile: line_profile,
        };
        let wide = lines(2, 1900.0, [(3.0, 0.5), (0.9, 0.13)], (1.3, 0.5));
        let narrow = lines(3, 800.0, [(4.0, 0.55), (1.2, 0.15)], (1.5, 0.5));
        let ridges = lines(4, 680.0, [(2.3, 0.75), (0.85, 0.45)], (1.4, 0.5));
        let small = lines(5, 190.0, [(4.0, 0.8), (1.4, 0.5)], (4.0, 0.7));
        let across = |lines| CrestLines { is_across: true, ends: None, profile: ridge_profile, ..lines };
        Some(Dunes {
            bends: [0, 1].map(|part| noise(BENDS_M, 2, part)),
            steady: noise(STEADY_M, 2, 2),
            crests: [
                CrestLines { height_m: 34.0, mean: 0.3, ..across(ridges) },
                CrestLines { height_m: 85.0, mean: 0.15, ..wide },
                CrestLines { height_m: 30.0, mean: 0.15, ..narrow },
                CrestLines { height_m: 2.6, mean: 0.3, profile: small_profile, ..across(small) },
            ],
            crescents: seed(3),
            stars: seed(4),
            arms: [5, 6].map(|part| noise(1300.0, 1, part)),
        })
    }

    /// Raises the dry land of an area, whose nodes lie `nodes.step` vertices apart.
    pub fn raise(
        &self,
        fields: &Fields,
        segments: &Segments,
        nodes: &Displaced,
        land: &mut Land,
        clock: &Clock,
    ) -> Result<(), Stopped> {
        let area = land.heights.area();
        let wide = area.padded(SLIDES + 1);
        let Some(place) = self.wind_and_sand(fields, wide, nodes.step) else { return Ok(()) };
        clock.check()?;
        let points: Vec<Point> =
            wide.vertices().map(|(x, y)| Point::at_vertex(x * nodes.step, y * nodes.step)).collect();
        let node_m = fields.spacing_m() * nodes.step as f64;
        let metres = fields.metres_a_grain();
        let (mut most_m, mut added_m) = (vec![0.0; wide.len()], vec![0.0; wide.len()]);
        for (kind, lines) in self.crests.iter().enumerate() {
            let strength = &place.strengths[kind];
            if strength.iter().all(|strength| *strength == 0.0) {
                continue;
            }
            if lines.wavelength_m < SHORTEST * node_m {
                let mean_m = lines.height_m * lines.mean;
                added_m
                    .iter_mut()
                    .zip(strength)
                    .for_each(|(added_m, strength)| *added_m += mean_m * f64::from(*strength));
                continue;
            }
            let to = if kind == 3 { &mut added_m } else { &mut most_m };
            lines.raise(&place, kind, (&points, wide, metres), node_m, to);
            clock.check()?;
        }
        for (kind, shows, mean_m) in [
            (CRESCENT, node_m <= CRESCENTS_SHOW_M, CRESCENTS_MEAN_M),
            (STAR, STARS_M >= STARS_SHORTEST * node_m, STARS_MEAN_M),
        ] {
            let strength = &place.strengths[kind];
            if strength.iter().all(|strength| *strength == 0.0) {
                continue;
            }
            match (shows, kind) {
                (false, _) => {
                    added_m.iter_mut().zip(strength).for_each(|(m, strength)| *m += mean_m * f64::from(*strength));
                }
                (true, CRESCENT) => self.raise_crescents(&place, &points, metres, &mut most_m),
                (true, _) => self.raise_stars(&place, &points, metres, &mut most_m),
            }
        }
        clock.check()?;
        let mut dune_m: Vec<f64> =
            most_m.iter().zip(&added_m).map(|(most_m, added_m)| most_m.max(0.0) + added_m).collect();
        slide(wide, node_m, &mut dune_m);
        let free = free_ground(fields, segments, nodes, area, &FREE);
        let sea_m = fields.sea_level_m() as f32;
        let kinds = land.water.as_ref().map(|water| &water.kind);
        for (x, y) in area.vertices() {
            let at = wide.index(x, y);
            let dune_m = dune_m[at];
            if dune_m <= 0.0 || kinds.is_some_and(|kinds| kinds.at(x, y) != WaterKind::Dry) {
                continue;
            }
            let height_m = &mut land.heights.row_mut(y, x, x + 1)[0];
            let above = smooth(f64::from((*height_m - sea_m - ABOVE_SEA_M[0]) / (ABOVE_SEA_M[1] - ABOVE_SEA_M[0])));
            let free = free.as_ref().map_or(1.0, |free| free.at(x, y));
            *height_m += (dune_m * above * f64::from(free)) as f32;
        }
        Ok(())
    }

    /// Returns the wind and the sand at nodes; `None` where there is no sand.
    fn wind_and_sand(&self, fields: &Fields, area: Area, step: i64) -> Option<WindAndSand> {
        let geography = fields.geography()?;
        let apart = (CORNERS / step).max(1);
        let at_corner = |(x, y): (i64, i64)| Point::at_vertex(x * apart * step, y * apart * step);
        let places: Vec<Point> = corners(area, apart).vertices().map(at_corner).collect();
        let sand: Vec<f64> = fields.all_laws(&places).iter().map(|laws| laws.sand).collect();
        if sand.iter().all(|sand| *sand == 0.0) {
            return None;
        }
        let table = |values: &[f64]| {
            between_corners(area, apart, &values.iter().map(|value| *value as f32).collect::<Vec<_>>())
        };
        let eastward: Vec<f64> = places.iter().map(|at| geography.eastward(*at)).collect();
        let chance = self.steady.at_all(&places);
        let strengths: Vec<[f64; 6]> =
            (0..places.len()).map(|n| strengths(sand[n], eastward[n].abs() * (0.62 + 0.5 * chance[n]))).collect();
        let bends_m = self.bends.each_ref().map(|bend| {
            let values: Vec<f64> = bend.at_all(&places).iter().map(|value| value * BENT_M).collect();
            table(&values)
        });
        let squeezed: Vec<f64> = places.iter().map(|at| self.squeezed(*at, fields.metres_a_grain())).collect();
        Some(WindAndSand {
            bends_m,
            eastward: table(&eastward),
            squeezed: table(&squeezed),
            strengths: std::array::from_fn(|kind| {
                table(&strengths.iter().map(|strengths| strengths[kind]).collect::<Vec<_>>())
            }),
        })
    }

    /// Returns the factor by which shapes of the bent plane are lower at a place, so that they are no steeper where the
    /// plane is narrower: the inverse of a bound of the greatest factor by which it shortens a way.
    fn squeezed(&self, at: Point, metres_a_grain: f64) -> f64 {
        const AWAY_M: f64 = 500.0;
        let away = (AWAY_M / metres_a_grain).round() as i64;
        let around = [(away, 0), (-away, 0), (0, away), (0, -away)];
        let around = around.map(|(x, y)| Point { x: at.x + x, y: at.y + y });
        let [u, v] = self.bends.each_ref().map(|bend| {
            let [east, west, south, north] = bend.at_each(around).map(|value| value * BENT_M / (2.0 * AWAY_M));
            [east - west, south - north]
        });
        let (u, v) = ([u[0] + 1.0, u[1]], [v[0], v[1] + 1.0]);
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        1.0 / (dot(u, u).max(dot(v, v)) + dot(u, v).abs()).max(1.0).sqrt()
    }

    /// Raises crescents, each well within a cell of a lattice of the bent plane.
    fn raise_crescents(&self, place: &WindAndSand, points: &[Point], metres: f64, most_m: &mut [f64]) {
        let side = (CRESCENTS_M / metres).round() as i64;
        for (at, point) in points.iter().enumerate() {
            let strength = f64::from(place.strengths[CRESCENT][at]);
            if strength == 0.0 {
                continue;
            }
            let bent = place.bent(at, *point, metres);
            let row = bent.y.div_euclid(side);
            // Rows are shifted against each other, so that no columns show.
            let shift = (hash::share(hash::combine(self.crescents, row as u64)) * side as f64) as i64;
            let column = (bent.x + shift).div_euclid(side);
            let luck = |part: u64| hash::share(hash::lattice(hash::combine(self.crescents, part), column, row));
            if luck(1) >= CRESCENTS {
                continue;
            }
            let [least, most] = CRESCENT_WIDTHS_M;
            let width_m = least + (most - least) * luck(2) * luck(2);
            let place_in = |from: i64, size: f64, part: u64| {
                let middle = (luck(part) - 0.5) * (CRESCENTS_M - size * width_m);
                (from.rem_euclid(side) as f64 - 0.5 * side as f64) * metres - middle
            };
            let downwind = place_in(bent.x + shift, 1.35, 3);
            let downwind = if place.eastward[at] < 0.0 { -downwind } else { downwind };
            let across = place_in(bent.y, 1.05, 4) * 2.0 / width_m;
            let height_m = crescent(downwind / width_m, across) * width_m;
            most_m[at] = most_m[at].max(height_m * strength * f64::from(place.squeezed[at]));
        }
    }

    /// Raises stars.
    fn raise_stars(&self, place: &WindAndSand, points: &[Point], metres: f64, most_m: &mut [f64]) {
        let side = (STARS_M / metres).round() as i64;
        // The north-western one of the four cells whose middles are nearest: the reach of a star ends within them.
        let cell = |at: i64| (at - side / 2).div_euclid(side);
        let (low, high) = (points[0], points[points.len() - 1]);
        let cells = Area { x0: cell(low.x), y0: cell(low.y), x1: cell(high.x) + 2, y1: cell(high.y) + 2 };
        // The shift of rows and the bends of arms move points by less than this.
        let cells = cells.padded(1);
        let stars: Vec<StarDune> = cells.vertices().map(|id| self.star(id, side, metres)).collect();
        let bends = self.arms.each_ref().map(|noise| noise.at_all(points));
        for (at, point) in points.iter().enumerate() {
            let strength = f64::from(place.strengths[STAR][at]);
            if strength == 0.0 {
                continue;
            }
            let by = |axis: usize| (bends[axis][at] * 90.0 / metres).round() as i64;
            let point = Point { x: point.x + by(0), y: point.y + by(1) };
            let row = cell(point.y);
            for y in [row, row + 1] {
                let column = cell(point.x - self.row_shift(y, side));
                for x in [column, column + 1] {
                    let star = &stars[cells.index(x, y)];
                    most_m[at] = most_m[at].max(star.height_m(point, metres) * strength);
                }
            }
        }
    }

    /// Returns the grains by which a row of stars is shifted to the east, so that no columns show: less than half of a
    /// cell's side to either side.
    fn row_shift(&self, row: i64, side: i64) -> i64 {
        ((hash::share(hash::combine(self.stars, row as u64)) - 0.5) * side as f64) as i64
    }

    /// Returns the star of a cell.
    fn star(&self, (i, j): (i64, i64), side: i64, metres: f64) -> StarDune {
        let luck = |part: u64| hash::share(hash::lattice(hash::combine(self.stars, part), i, j));
        let middle = |cell: i64, part: u64| cell * side + ((0.5 + 0.5 * (luck(part) - 0.5)) * side as f64) as i64;
        let size = 0.6 + 0.4 * luck(2);
        let count = 3 + (3.0 * luck(3)) as usize;
        let first = luck(4);
        let arm = |arm: usize| {
            let turns = first + (arm as f64 + 0.5 * (luck(10 + arm as u64) - 0.5)) / count as f64;
            (direction(turns), 0.74 * side as f64 * metres * size * (0.7 + 0.3 * luck(20 + arm as u64)))
        };
        let [least, most] = STAR_HEIGHTS_M;
        StarDune {
            middle: Point { x: middle(i, 0) + self.row_shift(j, side), y: middle(j, 1) },
            height_m: (least + (most - least) * luck(5)) * size,
            arms: std::array::from_fn(arm),
            count,
        }
    }
}

impl WindAndSand {
    /// Returns the point of the bent plane at a node.
    fn bent(&self, at: usize, point: Point, metres: f64) -> Point {
        let by = |axis: usize| (f64::from(self.bends_m[axis][at]) / metres).round() as i64;
        Point { x: point.x + by(0), y: point.y + by(1) }
    }
}

impl CrestLines {
    /// Raises dunes along crest lines, at nodes `node_m` metres apart. Nodes on the area's edge only tell how fast the
    /// phase changes beside them.
    fn raise(
        &self,
        place: &WindAndSand,
        kind: usize,
        (points, area, metres): (&[Point], Area, f64),
        node_m: f64,
        most_m: &mut [f64],
    ) {
        let strength = &place.strengths[kind];
        let sways = self.sways.each_ref().map(|(noise, _)| noise.at_all(points));
        let varies = self.varies.0.at_all(points);
        let phase = |at: usize| {
            let point = points[at];
            let (along, bend_m) = match self.is_across {
                true => (point.x, place.bends_m[0][at]),
                false => (point.y, place.bends_m[1][at]),
            };
            // The distance is taken within a wavelength first, where it is exact.
            let waves = along.rem_euclid(self.wavelength) as f64 / self.wavelength as f64;
            let bent = waves + f64::from(bend_m) / self.wavelength_m;
            let swayed = bent + sways[0][at] * self.sways[0].1 + sways[1][at] * self.sways[1].1;
            swayed + self.ends.map_or(0.0, |seed| self.turned(seed, place.bent(at, point, metres)))
        };
        let phases: Vec<f64> = (0..points.len()).map(phase).collect();
        let width = area.width();
        let to_wave = self.wavelength_m / node_m;
        for row in 1..area.height() - 1 {
            for at in row * width + 1..(row + 1) * width - 1 {
                if strength[at] == 0.0 {
                    continue;
                }
                // Whole turns do not count, so that the phase may jump by them.
                let change = |to: usize, from: usize| {
                    let change = phases[to] - phases[from];
                    change - (change + 0.5).floor()
                };
                let east = 0.5 * (change(at + 1, at) + change(at, at - 1));
                let south = 0.5 * (change(at + width, at) + change(at, at - width));
                // The factor by which crests are closer than elsewhere. Around an end they come together.
                let closer = (east * east + south * south).sqrt() * to_wave;
                let mut share = phases[at] - phases[at].floor();
                if self.is_across && place.eastward[at] < 0.0 {
                    share = 1.0 - share;
                }
                let varied = (1.0 + self.varies.1 * 2.0 * varies[at]).clamp(0.2, 1.35);
                let height_m = self.height_m * varied * (self.profile)(share) / closer.max(1.0);
                most_m[at] = most_m[at].max(height_m * f64::from(strength[at]));
            }
        }
    }

    /// Returns the turns by which pairs of ends change the phase at a place of the bent plane: around each end it turns
    /// once, one way or the other, and beyond the pair the turns fade out.
    fn turned(&self, seed: u64, at: Point) -> f64 {
        let sides = [(5.3 * self.wavelength as f64) as i64, (3.1 * self.wavelength as f64) as i64];
        let own = [at.x.div_euclid(sides[0]), at.y.div_euclid(sides[1])];
        let inside = [at.x.rem_euclid(sides[0]), at.y.rem_euclid(sides[1])];
        let mut turned = 0.0;
        for (east, south) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
            let [i, j] = [own[0] + east, own[1] + south];
            let luck = |part: u64| hash::share(hash::lattice(hash::combine(seed, part), i, j));
            let off = |axis: usize, cells: i64, jitter: f64| {
                let middle = (cells as f64 + 0.5 + jitter * (luck(axis as u64) - 0.5)) * sides[axis] as f64;
                inside[axis] as f64 - middle
            };
            let [x, y] = [off(0, east, 0.5), off(1, south, 0.6)];
            let (u, v) = (x / (1.05 * sides[0] as f64), y / (1.1 * sides[1] as f64));
            let near = smooth(2.0 * (1.0 - (u * u + v * v).sqrt()));
            if near == 0.0 {
                continue;
            }
            let half = (0.22 + 0.25 * luck(2)) * sides[0] as f64;
            let side = if luck(3) < 0.5 { 1.0 } else { -1.0 };
            let turn = turns([x + half, y]) - turns([x - half, y]);
            let turn = turn - (turn + 0.5).floor();
            turned += side * near * turn;
        }
        turned
    }
}

impl StarDune {
    /// Returns the height in metres at a point: that of the highest arm there.
    fn height_m(&self, point: Point, metres: f64) -> f64 {
        let [x, y] = [(point.x - self.middle.x) as f64 * metres, (point.y - self.middle.y) as f64 * metres];
        let mut most_m: f64 = 0.0;
        for ([east, south], length_m) in &self.arms[..self.count] {
            let (along, beside) = (x * east + y * south, y * east - x * south);
            let left = 1.0 - (along / length_m).clamp(0.0, 1.0);
            let behind = (-along).max(0.0).max(along - length_m);
            let ridge_m = self.height_m * left * (0.4 + 0.6 * left);
            most_m = most_m.max(ridge_m - STAR_SLOPE * (beside * beside + behind * behind).sqrt());
        }
        most_m
    }
}

/// Returns the strengths of all kinds, by the sand and the steadiness of the wind.
fn strengths(sand: f64, steadiness: f64) -> [f64; 6] {
    let rises = |value: f64, [from, to]: [f64; 2]| smooth((value - from) / (to - from));
    let steady = rises(steadiness, [STEADY, STEADY + PASSES]);
    let variable = 1.0 - rises(steadiness, [VARIABLE, VARIABLE + PASSES]);
    let swings = 1.0 - steady - variable;
    let (ridges, wide) = (rises(sand, RIDGES), rises(sand, WIDE_LINES));
    let covered = smooth(sand / COVERS);
    let high = covered * (0.4 + 0.6 * (sand / WHOLE).min(1.0));
    [
        steady * ridges * high,
        swings * wide * high,
        swings * (1.0 - wide) * high,
        // Ridges are steep enough without.
        covered * (1.0 - 0.7 * steady * ridges),
        steady * (1.0 - ridges) * covered,
        variable * high,
    ]
}

/// Returns the height of a crescent at a place, in widths of the crescent, given the widths downwind from its middle,
/// and half widths to the side.
///
/// Its brink bends downwind to the tips of two horns. Before it, the land rises to the brink, as high as the crescent
/// is
/// there, and behind it, falls with the slope of a slip face.
fn crescent(downwind: f64, across: f64) -> f64 {
    let whole = 1.0 - across * across;
    if whole <= 0.0 {
        return 0.0;
    }
    const BENDS: f64 = 0.5;
    let before = BENDS * across * across - 0.25 - downwind;
    let brink = CRESCENT_HEIGHT * whole;
    if before < 0.0 {
        let aslant = 4.0 * BENDS * across;
        return (brink + SLIP * before / (1.0 + aslant * aslant).sqrt()).max(0.0);
    }
    brink * (1.0 - before * before / (0.36 * whole)).max(0.0)
}

/// Returns the profile of a ridge across the wind: it rises gently to its brink, and falls down its slip face.
fn ridge_profile(share: f64) -> f64 {
    const LEE: f64 = 0.14;
    let up = share / (1.0 - LEE);
    if up < 1.0 { 0.6 * smooth(up) + 0.4 * up } else { (1.0 - share) / LEE }
}

/// Returns the profile of a small dune.
fn small_profile(share: f64) -> f64 {
    const LEE: f64 = 0.35;
    if share < 1.0 - LEE { smooth(share / (1.0 - LEE)) } else { smooth((1.0 - share) / LEE) }
}

/// Returns the profile of a line along the wind: a sharp crest on a wide foot, and a flat lane to the next.
fn line_profile(share: f64) -> f64 {
    let off = share.min(1.0 - share);
    let (foot, crest) = ((1.0 - off / 0.36).max(0.0), (1.0 - off / 0.1).max(0.0));
    0.55 * foot * foot + 0.45 * crest
}

/// Lets sand slide where it is steeper than a slip face towards one of the eight nodes around: the higher node loses
/// what is too much. The values of nodes within [`SLIDES`] nodes of the edge depend on where the edge is.
fn slide(area: Area, node_m: f64, dune_m: &mut Vec<f64>) {
    let width = area.width();
    let [beside_m, aslant_m] = [SLIP * node_m, SLIP * node_m * std::f64::consts::SQRT_2];
    let mut slid = dune_m.clone();
    for _ in 0..SLIDES {
        for row in 1..area.height() - 1 {
            for at in row * width + 1..(row + 1) * width - 1 {
                let beside = dune_m[at - 1].min(dune_m[at + 1]).min(dune_m[at - width]).min(dune_m[at + width]);
                let north = dune_m[at - width - 1].min(dune_m[at - width + 1]);
                let south = dune_m[at + width - 1].min(dune_m[at + width + 1]);
                slid[at] = dune_m[at].min(beside + beside_m).min(north.min(south) + aslant_m);
            }
        }
        std::mem::swap(dune_m, &mut slid);
    }
}

/// Returns the angle of a vector in turns, from -0.5 to 0.5, within 0.0003.
fn turns([x, y]: [f64; 2]) -> f64 {
    let (wide, high) = (x.abs(), y.abs());
    let (least, most) = if wide < high { (wide, high) } else { (high, wide) };
    if most == 0.0 {
        return 0.0;
    }
    let slope = least / most;
    // Exact at 0 and at an eighth of a turn, so it has no jumps.
    let eighth = slope / 8.0 + slope * (1.0 - slope) * (0.038_94 + 0.010_55 * slope);
    let quarter = if wide < high { 0.25 - eighth } else { eighth };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    if y < 0.0 { -half } else { half }
}

/// Returns the unit vector of an angle in turns.
fn direction(turns: f64) -> [f64; 2] {
    // A point of a square around the origin, drawn onto the circle: directions need not be evenly spread.
    let at = 8.0 * (turns - turns.floor());
    let [x, y] = match at {
        at if at < 2.0 => [1.0, at - 1.0],
        at if at < 4.0 => [3.0 - at, 1.0],
        at if at < 6.0 => [-1.0, 5.0 - at],
        at => [at - 7.0, -1.0],
    };
    let length = (x * x + y * y).sqrt();
    [x / length, y / length]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::clock::Clock;
    use crate::geography::Geography;
    use crate::grid::Grid;
    use crate::land::Water;
    use crate::preset::Preset;

    /// The fields and the dunes of a world.
    fn world() -> (Fields, Dunes) {
        let (_, preset) = Preset::load("world").unwrap();
        let metres_a_grain = preset.spacing_m / crate::grain_point::GRAINS as f64;
        let geography = Arc::new(Geography::new(preset.geography.as_ref().unwrap(), metres_a_grain, 5));
        let fields = Fields::new(&preset.fluvial.unwrap(), Some(geography), preset.spacing_m, preset.sea_level_m, 5);
        let dunes = Dunes::new(&fields, 5).expect("a world has deserts");
        (fields, dunes)
    }

    /// Returns the dunes on level dry land in metres, at nodes `step` vertices apart.
    fn raised(fields: &Fields, dunes: &Dunes, area: Area, step: i64) -> Grid<f32> {
        let nodes_area = area.padded(1).on_grid(8);
        let zeros = || vec![0.0; nodes_area.len()];
        let nodes = Displaced { area: nodes_area, step, metres: [zeros(), zeros()] };
        let segments = Segments { origin: Point::default(), channels: Vec::new(), all: Vec::new() };
        let mut land = Land { heights: Grid::filled(area, 1000.0), water: Some(Water::none(area)) };
        dunes.raise(fields, &segments, &nodes, &mut land, &Clock::default()).unwrap();
        let mut heights = land.heights;
        heights.values_mut().iter_mut().for_each(|height_m| *height_m -= 1000.0);
        heights
    }

    /// Returns for each kind but the small dunes a vertex where it alone stands and is high, or as nearly so as a
    /// search
    /// of some deserts finds, with its strength.
    fn places(fields: &Fields, dunes: &Dunes) -> Vec<(usize, [i64; 2], f64)> {
        let mut best = [0, 1, 2, CRESCENT, STAR].map(|kind| (kind, [0, 0], 0.0));
        let geography = fields.geography().unwrap();
        let search = Area::new(-80, -10, 160, 60).vertices().map(|(x, y)| [x * 6400, y * 6400]);
        let points: Vec<Point> = search.clone().map(|[x, y]| Point::at_vertex(x, y)).collect();
        for ((at, point), laws) in search.zip(&points).zip(fields.all_laws(&points)) {
            let (sand, point) = (laws.sand, *point);
            if sand > 0.0 {
                let steadiness = geography.eastward(point).abs() * (0.62 + 0.5 * dunes.steady.at(point));
                let found = strengths(sand, steadiness);
                for (kind, place, most) in &mut best {
                    if found[*kind] > *most {
                        (*place, *most) = (at, found[*kind]);
                    }
                }
            }
        }
        best.to_vec()
    }

    #[test]
    fn all_kinds_stand_somewhere_as_steep_as_sand_lies_and_as_high_on_the_mean_from_afar() {
        let (fields, dunes) = world();
        let mut wrong = Vec::new();
        for (kind, [x, y], strength) in places(&fields, &dunes) {
            assert!(strength > 0.4, "kind {kind} has no place of its own");
            let side = 768;
            let near = raised(&fields, &dunes, Area::new(x, y, side, side), 1);
            let mut steepest: f32 = 0.0;
            let inside = near.area().vertices().filter(|(x, y)| *x > near.area().x0 && *y > near.area().y0);
            for (x, y) in inside.filter(|(x, _)| *x + 1 < near.area().x1) {
                for (u, v, away) in [
                    (x - 1, y, 1.0),
                    (x, y - 1, 1.0),
                    (x - 1, y - 1, std::f32::consts::SQRT_2),
                    (x + 1, y - 1, std::f32::consts::SQRT_2),
                ] {
                    let rise = (near.at(x, y) - near.at(u, v)) / (away * fields.spacing_m() as f32);
                    steepest = steepest.max(rise.abs());
                }
            }
            let mean = |grid: &Grid<f32>| grid.values().iter().sum::<f32>() / grid.values().len() as f32;
            let most_m = near.values().iter().copied().fold(0.0, f32::max);
            let far = raised(&fields, &dunes, Area::new(x / 256, y / 256, 3, 3), 256);
            let [near_m, far_m] = [&near, &far].map(mean);
            println!(
                "kind {kind}: strength {strength}, up to {most_m} m, mean {near_m} and {far_m} m, slope {steepest}"
            );
            // Tangent of 34 degrees.
            let is_right = steepest < 0.6745 && most_m > 6.0 && (near_m - far_m).abs() < 0.3 * near_m + 0.3;
            wrong.extend((!is_right).then_some(kind));
        }
        assert!(wrong.is_empty(), "kinds {wrong:?}");
    }

    #[test]
    fn a_window_has_the_dunes_of_the_whole() {
        let (fields, dunes) = world();
        for (_, [x, y], _) in places(&fields, &dunes) {
            let area = Area::new(x - 100, y - 70, 220, 150);
            let whole = raised(&fields, &dunes, area, 1);
            for part in [Area::new(x - 37, y - 5, 31, 40), Area::new(x, y, 1, 1), area.halves()[1]] {
                assert_eq!(raised(&fields, &dunes, part, 1), whole.part(part));
            }
            // Shapes show all that they are at the stride of 2, but slip faces, which are narrower.
            let half = raised(&fields, &dunes, Area::new(x / 2 - 20, y / 2 - 20, 40, 40), 2);
            let off = half.area().vertices().map(|(x, y)| (half.at(x, y) - whole.at(2 * x, 2 * y)).abs());
            let mean_m = off.sum::<f32>() / half.area().len() as f32;
            assert!(mean_m < 1.0, "{mean_m} m from stride to stride");
        }
    }

    #[test]
    fn no_dune_stands_in_water_by_the_sea_or_where_it_rains() {
        let (fields, dunes) = world();
        let wet = raised(&fields, &dunes, Area::new(0, 0, 64, 64), 1);
        assert!(fields.laws(Point::default()).runoff_m > 0.1 && wet.values().iter().all(|dune_m| *dune_m == 0.0));
        let (_, [x, y], _) = places(&fields, &dunes)[1];
        let area = Area::new(x, y, 300, 300);
        let nodes_area = area.padded(1).on_grid(8);
        let zeros = || vec![0.0; nodes_area.len()];
        let nodes = Displaced { area: nodes_area, step: 1, metres: [zeros(), zeros()] };
        let segments = Segments { origin: Point::default(), channels: Vec::new(), all: Vec::new() };
        let mut water = Water::none(area);
        water.kind = Grid::of(area, |x, _| if x % 7 == 0 { WaterKind::River } else { WaterKind::Dry });
        // From below the sea's level in the north to high land in the south.
        let before = Grid::of(area, |_, y| (y - area.y0) as f32 - 50.0);
        let mut land = Land { heights: before.clone(), water: Some(water) };
        dunes.raise(&fields, &segments, &nodes, &mut land, &Clock::default()).unwrap();
        let mut raised = 0;
        for (x, y) in area.vertices() {
            let dune_m = land.heights.at(x, y) - before.at(x, y);
            assert!(dune_m == 0.0 || (x % 7 != 0 && before.at(x, y) > ABOVE_SEA_M[0]), "{dune_m} m at {x},{y}");
            raised += usize::from(dune_m > 1.0);
        }
        assert!(raised > 10_000, "{raised} vertices with dunes");
    }

    #[test]
    fn angles_in_turns_are_close_and_have_no_jumps() {
        for n in 0..4000 {
            let angle = f64::from(n) / 4000.0 - 0.5;
            let at = [libm::cos(angle * std::f64::consts::TAU), libm::sin(angle * std::f64::consts::TAU)];
            let off = turns(at) - angle;
            assert!((off - off.round()).abs() < 0.0003, "{angle}: {}", turns(at));
            let [x, y] = direction(angle);
            assert!((x * x + y * y - 1.0).abs() < 1e-12);
        }
    }
}
