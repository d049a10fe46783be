//! Plates of the crust: where continents lie, and where plates meet.
//!
//! A plate is the land nearest to one point of a jittered lattice. It carries a continent or the floor of an ocean, and
//! moves. Around a place the plates are blended by their nearness, so nothing jumps where another plate becomes the
//! nearest.
//!
//! To judge the numbers chosen by eye, look at maps of `world` at 1:40,000,000 for several seeds.

use glam::DVec2;

use super::turned_noise::TurnedNoise;
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::noise::point_noise::PointField;

/// Greatest distance of a point from the middle of its cell along each axis, as a share of the cell's side.
const PLATE_JITTER: f64 = 0.4;
const CONTINENT_JITTER: f64 = 0.3;

/// Radius of a continent as a share of the side of its cell: the least, and the addition by chance; and the width of
/// its edge, on the same scale. Chosen by eye.
const CONTINENT_RADIUS: (f64, f64) = (0.22, 0.3);
const CONTINENT_EDGE: f64 = 0.25;

/// Part of chance in the kind of a plate: small continents lie in the oceans, and bays in continents.
const KIND_CHANCE: f64 = 0.5;

/// Distances beyond the nearest plate up to which a plate counts, in sides of a plate: for what a place is made of, and
/// for the ranges where plates meet. Chosen by eye: a belt of ranges is 400 to 600 km wide on Earth's plates.
const BLENDED: f64 = 0.45;
const BELT: f64 = 0.5;

/// Wavelength of the bends of the borders between plates, and their greatest bend, as shares of a plate's side.
const BORDER_WAVE: f64 = 0.9;
const BORDER_BEND: f64 = 0.44;

/// Cells around a place whose plates can count there.
const CELLS: i64 = 2;

/// The greatest product of shares `a * a * b` that add up to 1: the belt beside an ocean is highest there.
const MOST_BESIDE: f64 = 4.0 / 27.0;

/// The plates of a world.
#[derive(Debug)]
pub struct Plates {
    seed: u64,
    continents: u64,
    /// Bends of the borders between plates, east and south.
    bends: [TurnedNoise; 2],
    /// Sides of the cells of plates and of continents, in grains.
    side: i64,
    continent_side: i64,
}

/// A plate, seen from a place.
#[derive(Clone, Copy, Debug)]
struct Plate {
    /// Its point, in sides of a plate from the corner of the place's cell.
    at: DVec2,
    /// Its crust: from -1, an ocean's, to 1, a continent's.
    kind: f64,
    /// The way it moves: up to 1 along each axis.
    moves: DVec2,
}

/// The plates around a place, blended.
#[derive(Clone, Copy, Debug, Default)]
pub struct Crust {
    /// The crust: from -1, an ocean's, to 1, a continent's.
    pub kind: f64,
    /// Strength of the range where plates push against each other, from 0.
    pub belt: f64,
    /// Strength of an arc of islands where two oceans' plates push against each other, from 0.
    pub arc: f64,
    /// Strength of the line of volcanoes that stands inland where a continent's plate rides over an ocean's, from 0.
    pub front: f64,
    /// Strength of the rift where continents part, from 0.
    pub rift: f64,
    /// The same, but of the narrow strip along the rift's middle alone, which has sunk between faults.
    pub graben: f64,
    /// Coordinate across the border between the plates, in sides of a plate: ranges run along its lines.
    pub across: f64,
}

impl Plates {
    /// Makes plates of these sides, in grains; with `is_old`, those of an earlier age, on the same continents.
    pub fn new(side: f64, continent_side: f64, is_old: bool, seed: u64) -> Plates {
        Plates {
            seed: hash::stream(seed, Stream::Plates.of(u64::from(is_old))),
            continents: hash::stream(seed, Stream::Continents),
            bends: [0, 1].map(|axis| {
                let seed = hash::stream(seed, Stream::PlateBends.of(2 * u64::from(is_old) + axis));
                TurnedNoise::new(BORDER_WAVE * side, 4, 0.5, seed)
            }),
            side: side.round().max(1.0) as i64,
            continent_side: continent_side.round().max(1.0) as i64,
        }
    }

    /// Returns the side of a plate's cell in grains.
    pub fn side(&self) -> f64 {
        self.side as f64
    }

    /// Returns how far a place lies within a continent: from below -1 far out to above 1 in the middle of a large one.
    fn continent(&self, at: Point) -> f64 {
        let (i, off_x) = split(at.x, self.continent_side);
        let (j, off_y) = split(at.y, self.continent_side);
        let here = DVec2::new(off_x, off_y);
        let cells = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj)));
        let inside = cells.map(|(di, dj)| {
            let luck = |part| hash::share(hash::lattice(hash::combine(self.continents, part), i + di, j + dj));
            let offset = DVec2::new(luck(0), luck(1)) - 0.5;
            let middle = DVec2::new(di as f64, dj as f64) + 0.5 + 2.0 * CONTINENT_JITTER * offset;
            let radius = CONTINENT_RADIUS.0 + CONTINENT_RADIUS.1 * luck(2);
            (radius - middle.distance(here)) / CONTINENT_EDGE
        });
        inside.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the plate of a cell, seen from the corner of another cell `(i, j)`.
    fn plate(&self, (i, j): (i64, i64), (di, dj): (i64, i64)) -> Plate {
        let luck = |part| hash::share(hash::lattice(hash::combine(self.seed, part), i + di, j + dj));
        let offset = DVec2::new(luck(0), luck(1)) - 0.5;
        let within = DVec2::splat(0.5) + 2.0 * PLATE_JITTER * offset;
        let corner = Point { x: (i + di) * self.side, y: (j + dj) * self.side };
        let inside = self.continent(corner.moved(within * self.side()));
        Plate {
            at: DVec2::new(di as f64, dj as f64) + within,
            kind: (inside + KIND_CHANCE * (luck(2) - 0.5)).clamp(-1.0, 1.0),
            moves: 2.0 * DVec2::new(luck(3), luck(4)) - 1.0,
        }
    }

    /// Returns the crust at places. Places of the same cell share its plates, so neighbours should follow each other.
    pub fn crust(&self, places: &[Point]) -> Vec<Crust> {
        let most = BORDER_BEND * self.side();
        let [east, south] = self.bends.each_ref().map(|bend| bend.at_all(places));
        let bent = places.iter().zip(east.into_iter().zip(south));
        let mut last: Option<((i64, i64), Vec<Plate>)> = None;
        let crust = |(at, (east, south)): (&Point, (f64, f64))| {
            let at = at.moved(DVec2::new(east, south) * most);
            let ((i, x), (j, y)) = (split(at.x, self.side), split(at.y, self.side));
            let plates =
                last.take().filter(|(cell, _)| *cell == (i, j)).map_or_else(|| self.around((i, j)), |same| same.1);
            let crust = blended(&plates, DVec2::new(x, y));
            last = Some(((i, j), plates));
            crust
        };
        bent.map(crust).collect()
    }

    /// Returns the plates that can count in a cell.
    fn around(&self, cell: (i64, i64)) -> Vec<Plate> {
        let cells = (-CELLS..=CELLS).flat_map(|dj| (-CELLS..=CELLS).map(move |di| (di, dj)));
        cells.map(|off| self.plate(cell, off)).collect()
    }
}

/// Returns the cell of a lattice in which a coordinate lies, and the coordinate within the cell, 0 to 1.
fn split(at: i64, side: i64) -> (i64, f64) {
    (at.div_euclid(side), at.rem_euclid(side) as f64 / side as f64)
}

/// Blends plates at a place.
fn blended(plates: &[Plate], here: DVec2) -> Crust {
    let distances: Vec<f64> = plates.iter().map(|plate| plate.at.distance(here)).collect();
    let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let share = |distance: f64, most: f64| {
        let left = (1.0 - (distance - nearest) / most).max(0.0);
        left * left
    };
    let near: Vec<(&Plate, f64)> =
        plates.iter().zip(distances).filter(|(_, distance)| *distance < nearest + BLENDED.max(BELT)).collect();
    let total = |most: f64| near.iter().map(|(_, distance)| share(*distance, most)).sum::<f64>();
    let (blend, belt) = (total(BLENDED), total(BELT));
    let mut crust = Crust {
        kind: near.iter().map(|(plate, distance)| plate.kind * share(*distance, BLENDED) / blend).sum(),
        ..Crust::default()
    };
    for (number, (one, to_one)) in near.iter().enumerate() {
        for (other, to_other) in &near[number + 1..] {
            let shares = [to_one, to_other].map(|distance| share(*distance, BELT) / belt);
            let apart = (other.at - one.at).length().max(1e-9);
            let pushed = (one.moves - other.moves).dot(other.at - one.at) / apart;
            crust.meet([one, other], shares, pushed);
            // The distance from the border, counted into the plate that comes first.
            let inside = (to_other * to_other - to_one * to_one) / (2.0 * apart);
            crust.across += 4.0 * shares[0] * shares[1] * inside;
        }
    }
    crust
}

impl Crust {
    /// Adds the border between two plates, by their shares of the place, which push against each other by `pushed`, or
    /// part if it is negative.
    fn meet(&mut self, plates: [&Plate; 2], [one, other]: [f64; 2], pushed: f64) {
        let land = plates.map(|plate| (2.0 * plate.kind + 0.5).clamp(0.0, 1.0));
        let (both, none) = (land[0] * land[1], (1.0 - land[0]) * (1.0 - land[1]));
        let border = 4.0 * one * other;
        // Beside an ocean the range stands on the continent, as wide as between two continents.
        let (inner, outer) = if land[0] > land[1] { (one, other) } else { (other, one) };
        let beside = inner * inner * outer / MOST_BESIDE;
        let push = pushed.clamp(0.0, 1.3);
        self.belt += push * (both * border * border.sqrt() + 0.9 * (1.0 - both - none) * beside * beside.sqrt());
        self.front += push * (1.0 - both - none) * (beside * beside) * (beside * beside);
        self.arc += push * none * (border * border) * (border * border);
        let pull = (-pushed - 0.15).clamp(0.0, 1.0) * both;
        let torn = border * border * border * border * border * border;
        let sunk = torn * torn * torn;
        self.rift += pull * torn;
        // 80 km wide on Earth.
        self.graben += pull * sunk * sunk;
    }
}
