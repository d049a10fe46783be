//! Tests of settlements and roads on a synthetic land: hills, lakes in their hollows, rivers in their valleys.

use std::collections::BTreeMap;
use std::sync::{LazyLock, OnceLock};

use super::*;
use crate::clock::Clock;
use crate::fluvial::survey::{RiverPiece, Sampling, Survey};
use crate::grid::Grid;
use crate::hash;
use crate::land::WaterKind;
use crate::lines::{Built, FIXED, LineId, LinePoint, Structure, StructureKind};
use crate::places::fixed::FixedSegment;

/// An endless land with the same features at any spacing of vertices.
#[expect(clippy::struct_field_names, reason = "the unit is a part of the name")]
struct TestLand {
    spacing_m: f64,
    /// Scale of the hills' heights in metres.
    relief_m: f64,
    /// Metres by which the reported levels of rivers are too high.
    lifted_m: f64,
    /// Depth in metres of narrow gullies that run south, high over the rivers; ridges if negative.
    gully_m: f64,
}

/// Metres from one river to the next, length in metres of a river piece, and metres from a river to the edge of its
/// valley.
const RIVERS_M: f64 = 8000.0;
const PIECE_M: f64 = 64.0;
const VALLEY_M: f64 = 900.0;

/// Metres from one pool of a river to the next, and metres by which a pool is wider than the river's line says, on
/// either side.
const POOLS_M: f64 = 1500.0;
const POOL_M: f64 = 30.0;

/// Metres from one gully to the next, and from a gully's middle to its rim.
const GULLIES_M: f64 = 700.0;
const GULLY_M: f64 = 24.0;

/// Heights in metres of the sea, of lakes and of rivers.
const SEA_M: f64 = 0.0;
const LAKE_M: f64 = 120.0;
const RIVER_M: f64 = 130.0;

impl TestLand {
    fn vertices(&self, metres: f64) -> i64 {
        (metres / self.spacing_m) as i64
    }

    /// Returns smooth noise, 0 to 1.
    fn noise(&self, at: [i64; 2], wave_m: f64, number: u64) -> f64 {
        let wave = self.vertices(wave_m);
        let cell = at.map(|at| at.div_euclid(wave));
        let [east, south] = at.map(|at| {
            let share = at.rem_euclid(wave) as f64 / wave as f64;
            share * share * (3.0 - 2.0 * share)
        });
        let value = |dx: i64, dy: i64| hash::share(hash::lattice(hash::combine(5, number), cell[0] + dx, cell[1] + dy));
        let north = value(0, 0) + (value(1, 0) - value(0, 0)) * east;
        let below = value(0, 1) + (value(1, 1) - value(0, 1)) * east;
        north + (below - north) * south
    }

    /// Returns smooth noise along a line, 0 to 1.
    fn bends(&self, x: i64, wave_m: f64, band: i64) -> f64 {
        let wave = self.vertices(wave_m);
        let (cell, share) = (x.div_euclid(wave), x.rem_euclid(wave) as f64 / wave as f64);
        let value = |i: i64| hash::share(hash::lattice(hash::combine(5, wave as u64), i, band));
        let [a, b] = [value(cell), value(cell + 1)];
        a + (b - a) * (share * share * (3.0 - 2.0 * share))
    }

    /// Returns the row of a river at a column.
    fn river_y(&self, band: i64, x: i64) -> i64 {
        let off_m = self.bends(x, 5000.0, band) * 3000.0 + self.bends(x, 700.0, band) * 500.0;
        band * self.vertices(RIVERS_M) + self.vertices(off_m)
    }

    /// Returns the width of a river in metres. Every third river is a brook.
    fn river_width_m(band: i64) -> f64 {
        [6.0, 35.0, 2.5][band.rem_euclid(3) as usize]
    }

    /// Returns the distance in metres to the middle of the nearest river, measured along a column, and the number of
    /// that river.
    fn river(&self, [x, y]: [i64; 2]) -> (f64, i64) {
        let band = y.div_euclid(self.vertices(RIVERS_M));
        let far = |band: i64| ((y - self.river_y(band, x)).abs() as f64 * self.spacing_m, band);
        (band - 1..=band + 1).map(far).min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are three")
    }

    fn height_m(&self, at: [i64; 2]) -> f64 {
        let height_m = self.height_by(at, self.river(at));
        let across_m = (at[0].rem_euclid(self.vertices(GULLIES_M)) as f64 * self.spacing_m - GULLIES_M / 2.0).abs();
        let share = (1.0 - across_m / GULLY_M).max(0.0) * ((height_m - 150.0) / 50.0).clamp(0.0, 1.0);
        height_m - share * self.gully_m
    }

    fn height_by(&self, at: [i64; 2], (river_m, band): (f64, i64)) -> f64 {
        let near = (1.0 - river_m / VALLEY_M).max(0.0);
        let near = near * near * (3.0 - 2.0 * near);
        let hills = 0.6 * self.noise(at, 7000.0, 1) + 0.27 * self.noise(at, 2300.0, 2);
        let hills = hills + 0.09 * self.noise(at, 900.0, 3) + 0.04 * self.noise(at, 300.0, 4);
        let hills_m = (hills - 0.25) * self.relief_m;
        let floor_m = match river_m < Self::river_width_m(band) / 2.0 {
            true => RIVER_M - 1.0,
            false => RIVER_M + 1.0 + river_m * 0.01,
        };
        hills_m + (floor_m - hills_m) * near
    }

    /// Returns the metres by which rivers at a column are wider, on either side, than their lines say.
    fn pool_m(&self, x: i64) -> f64 {
        let middle = (x.rem_euclid(self.vertices(POOLS_M)) as f64 * self.spacing_m - POOLS_M / 2.0).abs();
        if middle < POOLS_M / 12.0 { POOL_M } else { 0.0 }
    }

    fn water(&self, at: [i64; 2]) -> WaterKind {
        let (river_m, band) = self.river(at);
        match self.height_by(at, (river_m, band)) {
            _ if river_m < Self::river_width_m(band) / 2.0 + self.pool_m(at[0]) => WaterKind::River,
            height_m if height_m < SEA_M => WaterKind::Sea,
            height_m if height_m < LAKE_M => WaterKind::Lake,
            _ => WaterKind::Dry,
        }
    }
}

impl Survey for TestLand {
    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32> {
        sampled(x0, y0, sampling.step, cols, rows, |at| self.height_m(at) as f32)
    }

    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind> {
        sampled(x0, y0, sampling.step, cols, rows, |at| self.water(at))
    }

    fn rivers(&self, area: &Area) -> Vec<RiverPiece> {
        let piece = self.vertices(PIECE_M).max(1);
        let band = |y: i64| y.div_euclid(self.vertices(RIVERS_M));
        let mut pieces = Vec::new();
        for band in band(area.y0) - 1..=band(area.y1) {
            for x in (area.x0.div_euclid(piece)..=area.x1.div_euclid(piece)).map(|number| number * piece) {
                let ends = [x, x + piece].map(|x| [x, self.river_y(band, x)]);
                let (low, high) = (ends[0][1].min(ends[1][1]), ends[0][1].max(ends[1][1]));
                if low < area.y1 && high >= area.y0 {
                    let [from, to] = ends.map(|at| at.map(|at| at * FIXED));
                    let width_m = Self::river_width_m(band) as f32;
                    pieces.push(RiverPiece { from, to, width_m, level_m: [(RIVER_M + self.lifted_m) as f32; 2] });
                }
            }
        }
        pieces
    }
}

fn sampled<T>(x0: i64, y0: i64, step: i64, cols: usize, rows: usize, at: impl Fn([i64; 2]) -> T) -> Vec<T> {
    let vertex = |index: usize| [x0 + (index % cols) as i64 * step, y0 + (index / cols) as i64 * step];
    (0..cols * rows).map(|index| at(vertex(index))).collect()
}

const SPACING_M: f64 = 2.0;

fn land() -> TestLand {
    TestLand { spacing_m: SPACING_M, relief_m: 1300.0, lifted_m: 0.0, gully_m: 0.0 }
}

fn places() -> Places {
    Places::new(&PlacesSettings::default(), SPACING_M, 7, None).expect("the defaults are sound")
}

/// An area of 20 x 20 km.
fn wide() -> Area {
    Area::new(-5000, 3000, 10_000, 10_000)
}

/// An area of 8 x 8 km with a brook and a lake.
fn near() -> Area {
    Area::new(1000, 5000, 4000, 4000)
}

/// Land for planners whom nobody stops.
fn planned(survey: &dyn Survey) -> Surveyed<'_> {
    static CLOCK: LazyLock<Clock> = LazyLock::new(Clock::default);
    Surveyed { survey, clock: &CLOCK }
}

/// All roads of the wide area, built once for all tests that look at roads.
fn roads() -> &'static [Arc<Line>] {
    static ROADS: OnceLock<Vec<Arc<Line>>> = OnceLock::new();
    ROADS.get_or_init(|| places().roads(planned(&land()), &wide()).unwrap())
}

#[test]
fn windows_agree_whatever_was_asked_before() {
    let land = land();
    // `other` hardly caches anything.
    let forgetful = Places { sites: Memory::new(10_000), roads: Memory::new(1), ..places() };
    let (one, other, third) = (places(), forgetful, places());
    let [west, east] = [near(), Area { x0: 2500, x1: 6500, ..near() }];
    // `one` is asked for the west first, `other` for the east after an area far off, `third` by four threads.
    let from_west = [one.roads(planned(&land), &west).unwrap(), one.roads(planned(&land), &east).unwrap()];
    other.roads(planned(&land), &Area::new(9000, 9000, 300, 300)).unwrap();
    let east_first = other.roads(planned(&land), &east).unwrap();
    let from_east = [other.roads(planned(&land), &west).unwrap(), east_first];
    assert_eq!(from_west, from_east);
    let parts: Vec<Area> = (0..4).map(|n| Area { x0: 2500 + n * 1000, x1: 3500 + n * 1000, ..east }).collect();
    let in_parts = std::thread::scope(|scope| {
        let asked: Vec<_> =
            parts.iter().map(|part| scope.spawn(|| third.roads(planned(&land), part).unwrap())).collect();
        asked.into_iter().flat_map(|thread| thread.join().expect("no thread panics")).collect::<Vec<_>>()
    });
    let by_id: BTreeMap<_, _> = in_parts.into_iter().map(|road| (road.id, road)).collect();
    assert_eq!(by_id.into_values().collect::<Vec<_>>(), from_west[1]);
    assert!(from_west[1].len() > 5, "{} roads", from_west[1].len());
    assert_eq!(one.sites(planned(&land), &west).unwrap(), third.sites(planned(&land), &west).unwrap());
    let union = Area { x0: 1000, x1: 6500, ..near() };
    let seen: BTreeMap<_, _> = [west, east]
        .iter()
        .flat_map(|area| one.sites(planned(&land), area).unwrap())
        .map(|site| (site.id, site))
        .collect();
    assert_eq!(seen.into_values().collect::<Vec<_>>(), third.sites(planned(&land), &union).unwrap());
}

#[test]
fn what_lies_in_a_part_is_what_the_whole_has_there() {
    let (land, part) = (land(), Area::new(2000, 8000, 2000, 2000));
    let inside: Vec<_> = roads().iter().filter(|road| road.concerns(&part)).cloned().collect();
    assert_eq!(places().roads(planned(&land), &part).unwrap(), inside);
    assert!(!inside.is_empty());
}

/// The search for roads skips pairs of cells whose positions are too far apart. A site beside its positions would have
/// roads in some windows and none in others.
#[test]
fn all_sites_stand_on_the_positions_of_their_cells() {
    for (spacing_m, site_m) in [(SPACING_M, 2000.0), (SPACING_M, 2500.0), (20.0, 2500.0), (7.0, 1300.0)] {
        let land = TestLand { spacing_m, ..land() };
        let places = Places::new(&PlacesSettings { site_m, ..PlacesSettings::default() }, spacing_m, 5, None).unwrap();
        let mut seen = 0;
        for (i, j) in (0..12).flat_map(|j| (0..12).map(move |i| (i, j))) {
            let id = SiteId { i, j };
            let Some(seat) = places.seat(planned(&land), id).unwrap() else { continue };
            seen += 1;
            assert!(places.positions(id).contains(&seat.area()), "{seat:?} at {spacing_m} m, {site_m} m");
        }
        assert!(seen > 20, "{seen} sites");
    }
}

#[test]
fn settlements_stand_on_dry_and_even_land() {
    let (land, places) = (land(), places());
    let sites = places.sites(planned(&land), &Area::new(-20_000, -20_000, 40_000, 40_000)).unwrap();
    assert!((150..=400).contains(&sites.len()), "{} of 400 cells are settled", sites.len());
    assert!(sites.is_sorted_by_key(|site| site.id));
    for site in &sites {
        assert_eq!(places.cell(site.at), site.id);
        assert_eq!(land.water(site.at), WaterKind::Dry);
        assert_eq!(land.height_m(site.at) as f32, site.height_m);
        let edge = |(far_m, band): (f64, i64)| far_m - TestLand::river_width_m(band) / 2.0;
        assert!(edge(land.river(site.at)) > 30.0, "{site:?}");
        assert!(site.height_m <= 2500.0 && site.population >= 20);
    }
    let count = |class| sites.iter().filter(|site| site.class == class).count();
    let classes = [SiteClass::Hamlet, SiteClass::Village, SiteClass::Town].map(count);
    assert!(classes.iter().all(|count| *count > 10), "{classes:?}");
}

/// A plain where a river flows east through the middle of each site cell and a brook joins it there from the north.
/// Land within [`FLOODED_M`] of the river is no higher than its surface.
struct Confluences;

const FLOODED_M: f64 = 150.0;

impl Confluences {
    /// Side of a site cell in vertices, and half of it.
    const SIDE: i64 = 1984;
    const MIDDLE: i64 = Self::SIDE / 2;
}

impl Survey for Confluences {
    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32> {
        let height_m = |[_, y]: [i64; 2]| {
            let river_m = (y.rem_euclid(Self::SIDE) - Self::MIDDLE).abs() as f64 * SPACING_M;
            if river_m < FLOODED_M { 100.0 } else { 103.0 }
        };
        sampled(x0, y0, sampling.step, cols, rows, height_m)
    }

    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind> {
        sampled(x0, y0, sampling.step, cols, rows, |_| WaterKind::Dry)
    }

    fn rivers(&self, area: &Area) -> Vec<RiverPiece> {
        let cells = |from: i64, to: i64| from.div_euclid(Self::SIDE)..=to.div_euclid(Self::SIDE);
        let mut pieces = Vec::new();
        for j in cells(area.y0, area.y1) {
            for i in cells(area.x0, area.x1) {
                let at = |x: i64, y: i64| [(i * Self::SIDE + x) * FIXED, (j * Self::SIDE + y) * FIXED];
                let meeting = at(Self::MIDDLE, Self::MIDDLE);
                let piece = |from, to, width_m| RiverPiece { from, to, width_m, level_m: [100.0; 2] };
                pieces.push(piece(at(0, Self::MIDDLE), meeting, 10.0));
                pieces.push(piece(meeting, at(Self::SIDE, Self::MIDDLE), 12.0));
                pieces.push(piece(at(Self::MIDDLE, Self::MIDDLE / 4), meeting, 6.0));
            }
        }
        pieces
    }
}

#[test]
fn settlements_stand_where_rivers_meet_and_above_their_floods() {
    let places = places();
    assert_eq!(places.site_side(), Confluences::SIDE);
    let sites = places.sites(planned(&Confluences), &Area::new(-20_000, -20_000, 40_000, 40_000)).unwrap();
    let from_meeting_m = |site: &Arc<Site>| {
        let off = site.at.map(|at| (at.rem_euclid(Confluences::SIDE) - Confluences::MIDDLE) as f64 * SPACING_M);
        assert!(off[1].abs() >= FLOODED_M, "{site:?} is flooded");
        crate::geometry::length(off)
    };
    let near = sites.iter().map(from_meeting_m).filter(|far_m| *far_m < 500.0).count();
    assert!(near * 10 > sites.len() * 7, "{near} of {} settlements lie near a confluence", sites.len());
}

/// Returns the class of a road as an index of lists of three.
fn class(road: &Line) -> usize {
    road.class.expect("a road between settlements has a class") as usize
}

/// Returns the places of a road's points in 1/256 vertex.
fn places_of(road: &Line) -> Vec<[i64; 2]> {
    road.points.iter().map(|point| road.fixed(point)).collect()
}

/// Returns the vertices around a place at which the land under a road is sampled.
fn asked(at: [i64; 2]) -> [[i64; 2]; 4] {
    let side = places().plans.fine.scale.fine;
    let [x, y] = at.map(|at| at.div_euclid(side * FIXED) * side);
    [[x, y], [x + side, y], [x, y + side], [x + side, y + side]]
}

/// Returns the places and levels of all points of roads that lie on the ground.
fn on_ground(roads: &[Arc<Line>]) -> impl Iterator<Item = ([i64; 2], f64)> {
    roads.iter().flat_map(|road| {
        let points = road.points.iter().enumerate().filter(|(index, _)| road.carrier(*index).is_none());
        points.map(|(_, point)| (road.fixed(point), point.level_m))
    })
}

#[test]
fn roads_are_never_too_steep_and_end_at_their_sites_or_on_other_roads() {
    let (land, settings, places) = (land(), PlacesSettings::default(), places());
    let mut joined = 0;
    assert!(roads().len() > 30);
    assert!(roads().is_sorted_by(|a, b| a.id < b.id));
    for road in roads() {
        let LineId::Road { from, to, .. } = road.id else { panic!("{} is no road", road.id) };
        assert!(from < to);
        let most = settings.max_grade[class(road)];
        assert!(road.max_grade() <= most);
        let at = places_of(road);
        for (pair, ends) in road.points.windows(2).zip(at.windows(2)) {
            let piece_m = FixedSegment { from: ends[0], to: ends[1] }.length_m(SPACING_M);
            assert!((pair[1].level_m - pair[0].level_m).abs() <= most * piece_m, "{} {pair:?}", road.id);
        }
        for (id, index) in [(from, 0), (to, at.len() - 1)] {
            let site = places.site(planned(&land), id).unwrap().expect("a road leads to a site");
            let level_m = road.points[index].level_m;
            if at[index] == site.at.map(|at| at * FIXED) {
                assert_eq!(level_m as f32, site.height_m);
            } else if wide().contains(&Area::new(at[index][0].div_euclid(FIXED), at[index][1].div_euclid(FIXED), 1, 1))
            {
                // Another road has cut it there. Near the edge of the area that road may be missing, so only ends
                // inside are checked.
                let (off_m, other) = nearest(road, at[index]).expect("another road is there");
                assert!(off_m <= 2.0 * SPACING_M / FIXED as f64, "{} ends {off_m} m from {}", road.id, other.id);
                joined += 1;
            }
        }
    }
    assert!(joined > 10, "{joined} ends lie on other roads");
}

/// Returns the nearest of the other roads whose bounds hold a place, and the distance to it in metres.
fn nearest(road: &Line, at: [i64; 2]) -> Option<(f64, &'static Line)> {
    let far_m = |other: &Line| {
        let ways = places_of(other);
        let squares = ways.array_windows().map(|[from, to]| FixedSegment { from: *from, to: *to }.distance2(at));
        squares.fold(f64::INFINITY, f64::min).sqrt() * SPACING_M / FIXED as f64
    };
    let vertex = at.map(|at| at.div_euclid(FIXED));
    let is_near = |other: &&Line| other.bounds.contains(&Area::new(vertex[0], vertex[1], 1, 1));
    let others = roads().iter().map(AsRef::as_ref).filter(|other: &&Line| other.id != road.id && is_near(other));
    others.map(|other| (far_m(other), other)).min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn no_road_lies_on_another_or_crosses_itself() {
    let (mut points, mut doubled) = (0, 0);
    for road in roads() {
        let at = places_of(road);
        for (index, place) in at.iter().enumerate().filter(|(index, _)| road.carrier(*index).is_none()) {
            points += 1;
            let Some((far_m, other)) = nearest(road, *place) else { continue };
            let is_over = other.structures.iter().any(|structure| structure.kind != StructureKind::Ford);
            doubled += usize::from(far_m < road.points[index].half_width_m + other.points[0].half_width_m && !is_over);
        }
        for (first, [a, b]) in at.array_windows().enumerate() {
            let piece = FixedSegment { from: *a, to: *b };
            let mut others = at.array_windows().skip(first + 2);
            let crosses = others.any(|[from, to]| piece.crosses(&FixedSegment { from: *from, to: *to }));
            assert!(!crosses, "{} crosses itself at {a:?}", road.id);
        }
    }
    assert!(doubled * 100 <= points * 3, "{doubled} of {points} points lie on another road");
    assert!(roads().iter().any(|road| road.id != road.course), "some road is cut");
}

#[test]
fn wide_roads_that_touch_are_one_however_near_the_nodes_of_the_plan_are() {
    // The search for other roads must reach further than a step of the plan: 16 metres here, while these roads touch
    // within 52 metres.
    let settings = PlacesSettings { site_m: 1000.0, width_m: [50.0; 3], ..PlacesSettings::default() };
    let scale = PlanScale::new(settings.site_m, SPACING_M);
    let mut higher = roads()[0].as_ref().clone();
    higher.structures.clear();
    for point in &mut higher.points {
        point.half_width_m = 25.0;
    }
    let mut beside = higher.clone();
    beside.origin[0] += 22;
    assert!(junction::parts(&beside, &[Arc::new(higher)], &scale, &settings).is_empty());
}

#[test]
fn a_tunnel_that_comes_out_at_the_ford_of_another_road_ends_before_the_water() {
    let settings = PlacesSettings::default();
    let scale = PlanScale::new(settings.site_m, SPACING_M);
    let mut higher = roads()[0].as_ref().clone();
    let middle = higher.points.len() / 2;
    higher.structures = vec![Structure { kind: StructureKind::Ford, first: middle - 8, last: middle + 8 }];
    // A road of the same length, in a tunnel all the way, at right angles across the ford.
    let mut bored = higher.clone();
    let [x, y] = higher.points[middle].place;
    for point in &mut bored.points {
        point.place = [x - (point.place[1] - y), y + (point.place[0] - x)];
        point.level_m = higher.points[middle].level_m;
    }
    bored.structures = vec![Structure { kind: StructureKind::Tunnel, first: 0, last: bored.points.len() - 1 }];
    let parts = junction::parts(&bored, &[Arc::new(higher)], &scale, &settings);
    let [before, after] = &parts[..] else { panic!("{} parts", parts.len()) };
    for (part, at_ford) in [(before, before.points.len() - 1), (after, 0)] {
        let beside = at_ford.abs_diff(1).min(part.points.len() - 2);
        assert_eq!([at_ford, beside].map(|at| part.carrier(at)), [Some(StructureKind::Ford); 2], "{}", part.id);
        assert_eq!(part.carrier(part.points.len() / 2), Some(StructureKind::Tunnel), "{}", part.id);
    }
}

#[test]
fn a_road_that_is_cut_still_leads_from_one_site_to_the_other() {
    // Roads of which one ends on the other belong to the same net.
    let roads: Vec<&Line> = roads().iter().map(AsRef::as_ref).collect();
    let mut net: Vec<usize> = (0..roads.len()).collect();
    let places: Vec<Vec<[i64; 2]>> = roads.iter().map(|road| places_of(road)).collect();
    for (one, at) in places.iter().enumerate() {
        for end in [at[0], at[at.len() - 1]] {
            for (other, way) in places.iter().enumerate().filter(|(other, _)| *other != one) {
                let square = way
                    .array_windows()
                    .map(|[from, to]| FixedSegment { from: *from, to: *to }.distance2(end))
                    .fold(f64::INFINITY, f64::min);
                if square <= 8.0 {
                    let (old, new) = (net[other], net[one]);
                    net.iter_mut().filter(|of| **of == old).for_each(|of| *of = new);
                }
            }
        }
    }
    let mut cut = BTreeMap::new();
    for (number, road) in roads.iter().enumerate().filter(|(_, road)| wide().contains(&road.bounds)) {
        cut.entry(road.course).or_insert_with(Vec::new).push(net[number]);
    }
    let several = cut.values().filter(|nets| nets.len() > 1).count();
    assert!(several > 0, "some road has several parts");
    for (course, nets) in cut {
        assert!(nets.iter().all(|of| *of == nets[0]), "the parts of {course} are not joined");
    }
}

#[test]
fn roads_follow_the_land() {
    let land = land();
    let vertex = |at: [i64; 2]| at.map(|at| (at + FIXED / 2).div_euclid(FIXED));
    let mut off_m: Vec<f64> = on_ground(roads()).map(|(at, level_m)| level_m - land.height_m(vertex(at))).collect();
    off_m.sort_by(f64::total_cmp);
    // Higher fills become bridges, deeper cuts become tunnels.
    let (cut_m, fill_m) = (-off_m[0], off_m[off_m.len() - 1]);
    assert!(fill_m < 12.5 && cut_m < 25.5, "fills of {fill_m} m and cuts of {cut_m} m");
    off_m.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let nearly_all_m = off_m[off_m.len() * 99 / 100].abs();
    assert!(nearly_all_m < 3.0, "99 of 100 points lie within {nearly_all_m} m");
}

#[test]
fn roads_keep_to_their_corridors() {
    let (settings, places, land) = (PlacesSettings::default(), places(), land());
    let builder = RoadBuilder { settings: &settings, seed: 7, plans: &places.plans, land: planned(&land) };
    let mut kept = 0;
    for (a, b) in places.edges(planned(&land), &[near()]).unwrap() {
        let Some(corridor) = builder.corridor(&a, &b).unwrap() else { continue };
        let Some(road) = builder.road(&a, &b, &corridor).unwrap() else { continue };
        for at in places_of(&road) {
            let low = places.plans.fine.scale.node(at.map(|at| at.div_euclid(FIXED)));
            let high = low.map(|at| at + 1);
            assert!(corridor.may_touch(low, high, 0), "{} at {at:?}", road.id);
        }
        // No road is built for an area that the corridor does not reach.
        let far = Area::new(road.bounds.x0 - 3000, road.bounds.y0 - 3000, 100, 100);
        let road_in = |area: Area| places.road(planned(&land), &a, &b, &[area]).unwrap();
        assert!(road_in(far).is_none() && road_in(road.bounds).is_some());
        kept += 1;
    }
    assert!(kept > 5, "{kept} roads");
}

#[test]
fn curves_are_as_wide_as_their_class_asks() {
    let settings = PlacesSettings::default();
    for road in roads() {
        let least_m = settings.radius_m[class(road)];
        let at = places_of(road);
        let is_site = |end: [i64; 2]| end.iter().all(|at| at.rem_euclid(places().plans.fine.scale.step * FIXED) == 0);
        // The turn into another road may be sharper than the class allows, so ends on other roads are left out.
        let (first, last) = (usize::from(!is_site(at[0])), usize::from(!is_site(at[at.len() - 1])));
        let radius_m = sharpest_m(&at[first..at.len() - last]);
        // A curve of pieces 8 m long deviates a little from its circle.
        assert!(radius_m >= least_m * 0.9, "{} {radius_m}", road.id);
    }
}

/// Returns the smallest radius in metres of all circles through three consecutive points.
fn sharpest_m(at: &[[i64; 2]]) -> f64 {
    let radius_m = |[a, b, c]: &[[i64; 2]; 3]| {
        let length_m = |(from, to): (&[i64; 2], &[i64; 2])| FixedSegment { from: *from, to: *to }.length_m(SPACING_M);
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(length_m);
        let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let twice_m2 = cross.abs() as f64 * (SPACING_M / FIXED as f64) * (SPACING_M / FIXED as f64);
        ab * bc * ca / (2.0 * twice_m2)
    };
    at.array_windows().map(radius_m).fold(f64::INFINITY, f64::min)
}

#[test]
fn roads_keep_out_of_lakes_and_are_carried_over_rivers() {
    let land = land();
    let (mut fords, mut bridges) = (0, 0);
    for road in roads() {
        let pieces = land.rivers(&road.bounds);
        let at = places_of(road);
        for (index, at) in at.iter().enumerate() {
            let vertex = at.map(|at| (at + FIXED / 2).div_euclid(FIXED));
            let water = land.water(vertex);
            if water.is_open() {
                assert_eq!(road.carrier(index), Some(StructureKind::Bridge), "{} {vertex:?}", road.id);
            }
            // The builder samples the water only every few metres.
            let step = places().plans.fine.scale.fine;
            let nearest = at.map(|at| (at + step * FIXED / 2).div_euclid(step * FIXED) * step);
            let is_wet = land.water(nearest) == WaterKind::River;
            assert!(!is_wet || road.carrier(index).is_some(), "{} is in a river at {vertex:?}", road.id);
        }
        let crosses = |ends: &[[i64; 2]]| {
            let relative = |at: [i64; 2]| [at[0] - ends[0][0], at[1] - ends[0][1]];
            pieces.iter().any(|piece| {
                let (from, to) = (relative(piece.from), relative(piece.to));
                FixedSegment { from, to }.crosses(&FixedSegment { from: [0, 0], to: relative(ends[1]) })
            })
        };
        for (pair, carrier) in at.windows(2).zip(road.carriers()) {
            assert!(carrier.is_some() || !crosses(pair), "{} {pair:?}", road.id);
        }
        for structure in &road.structures {
            let (first, last) = (structure.first, structure.last);
            let wet = at[first..=last].iter().any(|at| asked(*at).iter().any(|at| land.water(*at).is_open()));
            let points = &road.points[first..=last];
            let is_high = |point: &LinePoint| {
                let lowest_m =
                    asked(road.fixed(point)).map(|at| land.height_m(at)).into_iter().fold(f64::INFINITY, f64::min);
                point.level_m - lowest_m > 12.0
            };
            let is_viaduct = points.iter().any(is_high);
            assert!(wet || is_viaduct || at[first..=last].windows(2).any(crosses), "{} {structure:?}", road.id);
            if structure.kind == StructureKind::Ford {
                fords += 1;
                assert!(points.iter().all(|point| point.level_m < RIVER_M));
            } else {
                bridges += 1;
                assert!(wet || points.iter().all(|point| point.level_m > RIVER_M));
            }
        }
    }
    assert!(fords > 2 && bridges > 5, "{fords} fords, {bridges} bridges");
}

#[test]
fn bridges_rest_on_the_banks_however_high_a_river_is_told_to_be() {
    let land = TestLand { lifted_m: 100.0, ..land() };
    let roads = places().roads(planned(&land), &near()).unwrap();
    assert!(roads.iter().map(|road| road.structures.len()).sum::<usize>() > 3);
    for (road, point) in roads.iter().flat_map(|road| road.points.iter().map(move |point| (road, point))) {
        let land_m = land.height_m(road.fixed(point).map(|at| (at + FIXED / 2).div_euclid(FIXED)));
        assert!(point.level_m - land_m < 20.0, "{} {point:?} {land_m}", road.id);
    }
}

#[test]
fn gullies_are_bridged_and_ridges_bored_through() {
    for (gully_m, kind) in [(40.0, StructureKind::Bridge), (-70.0, StructureKind::Tunnel)] {
        let land = TestLand { gully_m, ..land() };
        let roads = places().roads(planned(&land), &near()).unwrap();
        let (mut carried, mut off_m) = (0, [0.0_f64; 2]);
        let points = |road: &Arc<Line>| {
            let point =
                |index: usize| (road.fixed(&road.points[index]), road.points[index].level_m, road.carrier(index));
            (0..road.points.len()).map(point).collect::<Vec<_>>()
        };
        for (at, level_m, carrier) in roads.iter().flat_map(points) {
            let corners = asked(at).map(|at| land.height_m(at));
            let above_m = level_m - corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let under_m = corners.into_iter().fold(f64::INFINITY, f64::min) - level_m;
            if carrier.is_none() {
                off_m = [off_m[0].max(above_m), off_m[1].max(under_m)];
            }
            carried += usize::from(carrier == Some(kind) && above_m.max(under_m) > 10.0);
        }
        assert!(off_m[0] <= 12.0 && off_m[1] <= 25.0, "{gully_m} m: fills and cuts of {off_m:?} m");
        assert!(carried > 5, "{gully_m} m: {carried} points of {kind:?}");
    }
}

#[test]
fn far_from_the_origin_there_are_places_too() {
    let (land, places) = (land(), places());
    let area = Area::new(10_000_000_000, -10_000_000_000, 6000, 6000);
    let (sites, roads) = (places.sites(planned(&land), &area).unwrap(), places.roads(planned(&land), &area).unwrap());
    assert!(!sites.is_empty() && !roads.is_empty());
    assert!(sites.iter().all(|site| places.cell(site.at) == site.id));
    let near = area.padded(places.reach() as usize);
    assert!(roads.iter().all(|road| near.contains(&road.bounds)), "no road is longer than the reach");
}

#[test]
fn any_spacing_has_roads_within_their_grades() {
    let settings = PlacesSettings::default();
    for spacing_m in [0.3, 25.0, 100.0] {
        let land = TestLand { spacing_m, ..land() };
        let places = Places::new(&settings, spacing_m, 7, None).expect("the defaults are sound");
        let vertices = |metres: f64| (metres / spacing_m) as i64;
        let side = vertices(8000.0) as usize;
        let roads = places.roads(planned(&land), &Area::new(vertices(2000.0), vertices(10_000.0), side, side)).unwrap();
        assert!(roads.len() > 5, "{} roads with {spacing_m} m", roads.len());
        for road in roads {
            assert!(road.max_grade() <= settings.max_grade[class(&road)]);
            let vertex = |at: [i64; 2]| at.map(|at| at.div_euclid(FIXED));
            assert!(on_ground(&[road]).all(|(at, _)| !land.water(vertex(at)).is_open()));
        }
    }
}

#[test]
fn steep_land_has_roads_that_wind() {
    let straight_m = |road: &Line| {
        let at = places_of(road);
        FixedSegment { from: at[0], to: at[at.len() - 1] }.length_m(SPACING_M)
    };
    let steep = TestLand { relief_m: 2400.0, ..land() };
    let roads = places().roads(planned(&steep), &near()).unwrap();
    assert!(!roads.is_empty());
    assert!(roads.iter().any(|road| road.length_m() > 1.3 * straight_m(road)), "a switchback at least");
}

/// Land that rises evenly to the south, by so many metres a metre.
struct Slope(f64);

impl Survey for Slope {
    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32> {
        sampled(x0, y0, sampling.step, cols, rows, |[_, y]| (1000.0 + self.0 * SPACING_M * y as f64) as f32)
    }

    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind> {
        sampled(x0, y0, sampling.step, cols, rows, |_| WaterKind::Dry)
    }

    fn rivers(&self, _: &Area) -> Vec<RiverPiece> {
        Vec::new()
    }
}

#[test]
fn a_side_too_steep_for_a_straight_road_is_climbed_by_hairpins() {
    let (settings, places, slope) = (PlacesSettings::default(), places(), Slope(0.35));
    let site = |number: i64| {
        let at = [number * 10, number * 30].map(|at| at * places.plans.fine.scale.step);
        let id = SiteId { i: 0, j: number };
        Seat::new(id, at, SiteClass::Hamlet, 50)
    };
    let builder = RoadBuilder { settings: &settings, seed: 7, plans: &places.plans, land: planned(&slope) };
    let corridor = builder.corridor(&site(0), &site(1)).unwrap().expect("there is no water");
    let road = builder.road(&site(0), &site(1), &corridor).unwrap().expect("hairpins climb it");
    let at = places_of(&road);
    let eastward: Vec<bool> = at.windows(2).map(|ends| ends[1][0] > ends[0][0]).collect();
    let turns = eastward.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(turns >= 4, "{turns} hairpins");
    assert!(road.max_grade() <= settings.max_grade[class(&road)] && road.structures.is_empty());
    for (point, at) in road.points.iter().zip(&at) {
        let off_m = point.level_m
            - slope.heights_m(0, 0, Sampling::whole(1), 1, 1)[0] as f64
            - 0.35 * SPACING_M * at[1] as f64 / FIXED as f64;
        assert!(off_m.abs() <= 8.0, "{off_m} m off the land at {at:?}");
    }
    let radius_m = sharpest_m(&at);
    assert!(radius_m >= settings.radius_m[class(&road)] * 0.9, "{radius_m} m");
}

/// Level land on both sides of a strait that runs east, so many metres wide.
struct Strait(f64);

impl Survey for Strait {
    fn heights_m(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<f32> {
        sampled(x0, y0, sampling.step, cols, rows, |_| 10.0)
    }

    fn waters(&self, x0: i64, y0: i64, sampling: Sampling, cols: usize, rows: usize) -> Vec<WaterKind> {
        sampled(x0, y0, sampling.step, cols, rows, |[_, y]| match (y as f64 * SPACING_M).abs() < self.0 / 2.0 {
            true => WaterKind::Sea,
            false => WaterKind::Dry,
        })
    }

    fn rivers(&self, _: &Area) -> Vec<RiverPiece> {
        Vec::new()
    }
}

#[test]
fn a_strait_is_bridged_or_has_no_corridor() {
    let settings = PlacesSettings::default();
    let most_m = settings.bridge_m.into_iter().fold(0.0, f64::max);
    for (width_m, is_bridged) in [(0.95 * most_m, true), (4.0 * most_m + 1000.0, false)] {
        let (places, strait) = (places(), Strait(width_m));
        let seat = |row: i64| {
            let at = [0, row * 20].map(|at| at * places.plans.coarse.scale.step);
            Seat::new(SiteId { i: 0, j: row }, at, SiteClass::Town, 3000)
        };
        let builder = RoadBuilder { settings: &settings, seed: 7, plans: &places.plans, land: planned(&strait) };
        let (a, b) = (seat(-1), seat(1));
        let road = builder.corridor(&a, &b).unwrap().map(|corridor| builder.road(&a, &b, &corridor).unwrap());
        assert_eq!(road.is_some(), is_bridged, "a corridor over {width_m} m");
        let is_bridge = |line: Line| line.structures.iter().any(|structure| structure.kind == StructureKind::Bridge);
        assert!(road.is_none_or(|road| road.is_some_and(is_bridge)), "{width_m} m");
    }
}

#[test]
fn beds_agree_where_areas_overlap_and_end_at_their_reach() {
    let land = land();
    // An area around the middle of a road with a bridge, so that it has all kinds of pieces.
    let is_bridged =
        |road: &&Arc<Line>| road.structures.iter().any(|structure| structure.kind == StructureKind::Bridge);
    let road = roads().iter().find(is_bridged).expect("some road has a bridge");
    let middle = road.structures[0].middle(road).map(|at| at.div_euclid(FIXED));
    let whole = Area::new(middle[0] - 200, middle[1] - 200, 400, 400);
    let part = Area::new(middle[0] - 57, middle[1] - 200, 111, 321);
    let built = |area: Area, reversed: bool| {
        let mut chosen: Vec<&Line> = roads().iter().map(AsRef::as_ref).collect();
        if reversed {
            chosen.reverse();
        }
        let bare = land.heights_m(area.x0, area.y0, Sampling::whole(1), area.width(), area.height());
        let mut heights = Grid::filled(area, 0.0);
        heights.values_mut().copy_from_slice(&bare);
        let mut built = Built::blank(area);
        for road in chosen {
            built.add(road);
        }
        built.shape(&mut heights);
        (bare, heights, built)
    };
    let ((bare, wide, wide_built), (_, small, small_built)) = (built(whole, false), built(part, true));
    let (mut changed, mut paved) = (0, 0);
    for (x, y) in part.vertices() {
        assert_eq!(wide.at(x, y).to_bits(), small.at(x, y).to_bits());
        assert_eq!(wide_built.share.at(x, y).to_bits(), small_built.share.at(x, y).to_bits());
    }
    let fixed = |x: i64, y: i64| [x * FIXED, y * FIXED];
    for (index, (x, y)) in whole.vertices().enumerate() {
        // Metres beyond the reach of the road, and whether its nearest piece is a bridge.
        let beyond = |road: &Line| {
            let far = |([from, to], carrier): ([&LinePoint; 2], Option<StructureKind>)| {
                let [from, to] = [from, to].map(|point| {
                    let at = road.fixed(point);
                    [at[0] - x * FIXED, at[1] - y * FIXED]
                });
                let parts = FixedSegment { from, to }.distance2([0, 0]).sqrt();
                let reach_m = road.points[0].half_width_m + PlacesSettings::default().bank_m;
                (parts * SPACING_M / FIXED as f64 - reach_m, carrier == Some(StructureKind::Bridge))
            };
            let pieces = road.pieces().zip(road.carriers()).map(far);
            pieces.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a road has pieces")
        };
        let is_changed = wide.at(x, y).to_bits() != bare[index].to_bits();
        changed += usize::from(is_changed);
        paved += usize::from(wide_built.share.at(x, y) > 0.5);
        if is_changed {
            let near = roads().iter().filter(|road| road.concerns(&Area::new(x, y, 1, 1)));
            let reached = near.map(|road| beyond(road)).any(|(beyond_m, spanned)| beyond_m < 1e-3 && !spanned);
            assert!(reached, "{:?}", fixed(x, y));
        }
    }
    assert!(changed > 500 && paved > 100, "{changed} vertices changed, {paved} paved");
}
