//! Labels of a map: collects the names and heights that could be written, and keeps those that there is room for.

use std::collections::{BTreeSet, HashMap};

use glam::DVec2;
use rayon::prelude::*;

use crate::area::Area;
use crate::features::sites::SiteFeature;
use crate::hash::{self, LabelDraw};
use crate::map::drawing::{Drawing, NamedRiver};
use crate::map::frame::MapFrame;
use crate::map::label::{self, Candidate, Rank, along_line, around_point, place};
use crate::map::plotter::{bounds, widened};
use crate::map::ranges::{CoarseLand, Range};
use crate::map::realms::NamedRealm;
use crate::map::scale::Scale;
use crate::map::style::{Colour, LabelStyle, LabelsStyle, Style};
use crate::map::summits::Summit;
use crate::map::symbols;
use crate::map::text::{Placed, Quad, Shaped, length, shape};
use crate::places::site::SiteClass;
use crate::stop::Stopped;
use crate::watch::Watch;

/// Largest extent of all places of a name together, in millimetres of paper. Places that would make it larger are left
/// out.
const LONGEST_MM: f64 = 30.0;

/// Largest number of places along a river that a repetition of its name may have.
const SHIFTS: u32 = 3;

/// Smallest lake whose name is written, in square millimetres of paper.
const LEAST_LAKE_MM2: f64 = 5.0;

/// Smallest gap between names, in millimetres.
const MARGIN_MM: f64 = 0.5;

/// Largest distance in millimetres from the middle of a symbol to the name beside it.
const BESIDE_MM: f64 = 2.0;

/// Side in millimetres of paper of the squares in which settlements and peaks are searched.
const CELL_MM: f64 = 20.0;

/// Distance along a river from one repetition of its name to the next, in millimetres of paper.
const REPEAT_MM: f64 = 110.0;

/// Distance from a river to the name of its valley, and from one repetition of that name to the next, in millimetres of
/// paper.
const VALLEY_GAP_MM: f64 = 2.2;
const VALLEY_REPEAT_MM: f64 = 200.0;

/// Largest width of the name of a realm, as a share of the largest extent of a name; and the least length of a realm that
/// has a name, as a share of the name's width.
const REALM_SHARE: f64 = 0.95;
const REALM_FIT: f64 = 0.8;

/// Largest scale denominators at which villages and hamlets have symbols and names.
const MOST_VILLAGES: f64 = 400_000.0;
const MOST_HAMLETS: f64 = 130_000.0;

/// A label: the text that a map shows for one feature.
#[derive(Clone, Debug)]
pub(super) struct Writing {
    pub text: Placed,
    pub colour: Colour,
    /// Kind of the feature, its name (empty if it has none), and its position in pixels.
    pub kind: &'static str,
    pub name: String,
    pub at: DVec2,
}

impl Writing {
    /// Returns the boxes that the text covers.
    pub fn boxes(&self) -> impl Iterator<Item = Quad> {
        self.text.boxes.iter().copied()
    }

    /// True if the feature is a peak, which a triangle marks.
    pub fn is_peak(&self) -> bool {
        self.kind == PEAK
    }
}

/// Returns the width in pixels of the margin around an area in which other labels may influence those of the area.
pub(super) fn pad(scale: Scale) -> usize {
    let longest = scale.pixels(LONGEST_MM);
    // Labels never lie further than `longest` from their feature.
    (label::pad_px(longest, scale.pixels(MARGIN_MM)) + longest) as usize + 1
}

/// Tells whether settlements of a class are drawn at a scale.
pub(super) fn is_drawn(class: SiteClass, scale: Scale) -> bool {
    match class {
        SiteClass::Town => true,
        SiteClass::Village => scale.denominator() <= MOST_VILLAGES,
        SiteClass::Hamlet => scale.denominator() <= MOST_HAMLETS,
    }
}

/// Functions that find the settlements and peaks in an area of pixels that could have a name. The search takes long, so
/// it is done only where the result matters.
pub(super) struct Finders<'a> {
    pub sites: &'a (dyn Fn(Area) -> Result<Vec<SiteFeature>, Stopped> + Sync),
    pub summits: &'a (dyn Fn(Area) -> Result<Vec<Summit>, Stopped> + Sync),
}

/// Chooses all labels of an area of pixels, given the water there and [around](pad), the land as seen from afar, and the
/// realms there and around. If there is a frame, no label crosses it. `watch` counts the squares that are searched.
pub(super) fn write(
    (style, scale): (&Style, Scale),
    drawing: &Drawing,
    (seen, realms): (Option<&CoarseLand<'_>>, &[NamedRealm]),
    finders: &Finders<'_>,
    area: Area,
    frame: Option<&MapFrame>,
    watch: &Watch,
) -> Result<Vec<Writing>, Stopped> {
    let mut writer = Writer { style, scale, frame, candidates: Vec::new(), obstacles: Vec::new() };
    writer.write_realms(realms);
    writer.write_ranges(&seen.map(|seen| seen.ranges(&watch.clock)).transpose()?.unwrap_or_default());
    writer.write_lakes(drawing);
    writer.write_rivers(drawing, seen);
    // The halo of a label may reach into the area although its letters do not.
    let visible = area.padded(scale.pixels(style.labels.halo_mm) as usize + 2);
    let is_seen = |boxes: &Vec<Quad>| visible.meets(bounds(boxes.iter().flatten()));
    let margin = scale.pixels(MARGIN_MM);
    // Every feature that may have a label over a given place has its middle within this distance of the place.
    let reach = scale.pixels(LONGEST_MM + BESIDE_MM) + margin;
    let side = scale.pixels(CELL_MM).ceil() as i64;
    let [mut sites, mut summits] = [KnownSquares::new(side), KnownSquares::new(side)];
    let mut near_sites = vec![widened(visible.edges(), reach)];
    let mut near_summits = near_sites.clone();
    loop {
        watch.clock.check()?;
        let new = (sites.missing(&near_sites), summits.missing(&near_summits));
        if new.0.is_empty() && new.1.is_empty() {
            break;
        }
        watch.begin("finding names", Some(((new.0.len() + new.1.len()) as u64, "squares")));
        let found = rayon::join(
            || find(&new.0, finders.sites, |site| scale.pixel(site.at), watch),
            || find(&new.1, finders.summits, |summit| scale.pixel(summit.at), watch),
        );
        writer.write_sites(&found.0?);
        writer.write_peaks(&found.1?);
        writer.leave_out_long();
        let concerned = label::concerned(&mut writer.candidates, &writer.obstacles, margin, |one| is_seen(&one.boxes));
        (near_sites, near_summits) = (Vec::new(), Vec::new());
        for candidate in concerned.into_iter().map(|index| &writer.candidates[index]) {
            let near = widened(bounds(candidate.boxes.iter().flatten()), reach);
            near_sites.push(near);
            // Peaks never displace labels of a class before theirs, so no peaks need to be known around those.
            if candidate.rank.class >= Class::Peak as u32 {
                near_summits.push(near);
            }
        }
    }
    let shown = place(writer.candidates, &writer.obstacles, margin);
    Ok(shown.into_iter().filter(|one| is_seen(&one.boxes)).map(|one| one.item).collect())
}

/// Squares of a map in which all features of one kind are known.
struct KnownSquares {
    side: i64,
    known: BTreeSet<[i64; 2]>,
}

impl KnownSquares {
    fn new(side: i64) -> KnownSquares {
        KnownSquares { side, known: BTreeSet::new() }
    }

    /// Returns the squares that meet some rectangles (west, north, east and south) and are not known yet, and marks
    /// them as known.
    fn missing(&mut self, rectangles: &[[f64; 4]]) -> Vec<Area> {
        let side = self.side;
        let span = |from: f64, to: f64| (from.floor() as i64).div_euclid(side)..=(to.ceil() as i64).div_euclid(side);
        let mut new = BTreeSet::new();
        for [west, north, east, south] in rectangles {
            let cells = span(*north, *south).flat_map(|row| span(*west, *east).map(move |column| [row, column]));
            new.extend(cells.filter(|cell| !self.known.contains(cell)));
        }
        self.known.extend(&new);
        new.into_iter()
            .map(|[row, column]| Area::new(column * side, row * side, side as usize, side as usize))
            .collect()
    }
}

/// Finds the features of some squares. Each feature counts only in the square that its position lies in, so none is
/// found twice.
fn find<T: Send>(
    squares: &[Area],
    find: &(dyn Fn(Area) -> Result<Vec<T>, Stopped> + Sync),
    place: impl Fn(&T) -> DVec2 + Sync,
    watch: &Watch,
) -> Result<Vec<T>, Stopped> {
    let of_square = |square: &Area| {
        let is_within = |thing: &T| {
            let [x, y] = place(thing).to_array().map(|at| at.floor() as i64);
            square.contains(&Area::new(x, y, 1, 1))
        };
        let found = find(*square)?.into_iter().filter(is_within).collect();
        watch.add(1);
        Ok(found)
    };
    let found = squares.par_iter().map(of_square).collect::<Result<Vec<Vec<T>>, Stopped>>()?;
    Ok(found.into_iter().flatten().collect())
}

struct Writer<'a> {
    style: &'a Style,
    scale: Scale,
    frame: Option<&'a MapFrame>,
    candidates: Vec<Candidate<Writing>>,
    obstacles: Vec<Quad>,
}

/// Kind of peaks.
const PEAK: &str = "peak";

/// Classes of labels in order of precedence, for where there is not room for all.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    /// Continents, oceans and so on, the larger first.
    Realm,
    /// Ranges lie so far apart that their names never meet. A range makes room only for symbols, and all other names
    /// make room for the range.
    Range,
    Town,
    Lake,
    Village,
    River,
    Peak,
    Valley,
    Hamlet,
}

impl Class {
    /// Returns the kind of the features, the style of their names, and their use of chance.
    fn of(self, labels: &LabelsStyle) -> (&'static str, LabelStyle, LabelDraw) {
        let [town, village, hamlet] = labels.places;
        match self {
            Class::Realm => ("realm", labels.range, LabelDraw::Realm),
            Class::Range => ("range", labels.range, LabelDraw::Range),
            Class::Town => (SiteClass::Town.name(), town, LabelDraw::Site),
            Class::Lake => ("lake", labels.lake, LabelDraw::Lake),
            Class::Village => (SiteClass::Village.name(), village, LabelDraw::Site),
            Class::River => ("river", labels.river, LabelDraw::River),
            Class::Peak => (PEAK, labels.peak, LabelDraw::Peak),
            Class::Valley => ("valley", labels.valley, LabelDraw::Valley),
            Class::Hamlet => (SiteClass::Hamlet.name(), hamlet, LabelDraw::Site),
        }
    }
}

impl Writer<'_> {
    /// Leaves out places that would make a name span more than [`pad`] assumes, together with the better places of the
    /// same name.
    fn leave_out_long(&mut self) {
        let longest = self.scale.pixels(LONGEST_MM);
        let mut spans: HashMap<u64, [f64; 4]> = HashMap::new();
        // The list holds the places of a name one after the other, the best first.
        self.candidates.retain(|candidate| {
            if candidate.rank.class == Class::Range as u32 {
                return true;
            }
            let [west, north, east, south] = bounds(candidate.boxes.iter().flatten());
            let span = spans.entry(candidate.rank.feature).or_insert([west, north, east, south]);
            let wider = [span[0].min(west), span[1].min(north), span[2].max(east), span[3].max(south)];
            let fits = wider[2] - wider[0] <= longest && wider[3] - wider[1] <= longest;
            if fits {
                *span = wider;
            }
            fits
        });
    }

    fn shaped(&self, text: &str, class: Class) -> Shaped {
        let (_, style, _) = class.of(&self.style.labels);
        let typeface = self.style.labels.typeface(style.face);
        shape(text, typeface, self.scale.pixels(style.size_mm) as f32, style.spacing as f32)
    }

    /// Adds a place for the label of a feature: its text there, the feature's name, and the feature's position. The
    /// feature is known by its class and `id`; the numbers are its weight and the number of the place.
    fn push(&mut self, class: Class, id: &[u64], order: (u64, u32), (text, name, at): (Placed, &str, DVec2)) {
        let (kind, style, _) = class.of(&self.style.labels);
        self.add(class, id, order, Writing { text, colour: style.colour, kind, name: name.to_owned(), at });
    }

    /// Adds a label, likewise.
    fn add(&mut self, class: Class, id: &[u64], (weight, place): (u64, u32), item: Writing) {
        let (_, _, draw) = class.of(&self.style.labels);
        // The triangle of a peak is shown only together with the peak's label.
        let mark = item.is_peak().then(|| square(item.at, symbols::peak_px(self.scale)));
        let mut boxes: Vec<Quad> = item.boxes().chain(mark).collect();
        if [Class::Realm, Class::Range].contains(&class) {
            // The gaps between the letters of something large also stay free of other labels.
            let gaps: Vec<Quad> = boxes.windows(2).map(|pair| between(&pair[0], &pair[1])).collect();
            boxes.extend(gaps);
        }
        // A place where the frame would cut the label is left out.
        if self.frame.is_none_or(|frame| frame.has_room(&boxes)) {
            let feature = hash::of([draw as u64].into_iter().chain(id.iter().copied()));
            let rank = Rank { class: class as u32, weight, feature, place };
            self.candidates.push(Candidate { rank, boxes, item });
        }
    }

    /// True if a feature's symbol lies on the map, so that the feature can have a name.
    fn shows(&self, at: DVec2) -> bool {
        self.frame.is_none_or(|frame| frame.shows(at))
    }

    fn write_realms(&mut self, realms: &[NamedRealm]) {
        for realm in realms {
            if !self.shows(realm.at) {
                continue;
            }
            let style = realm.lettering(&self.style.labels);
            let written = |size_mm: f64| {
                let typeface = self.style.labels.typeface(style.face);
                shape(&realm.text(), typeface, self.scale.pixels(size_mm) as f32, style.spacing as f32)
            };
            let whole = written(style.size_mm);
            // A long name is written smaller, so that it spans no more than other names may.
            let smaller = (REALM_SHARE * self.scale.pixels(LONGEST_MM) / whole.width).min(1.0);
            let name = if smaller < 1.0 { written(smaller * style.size_mm) } else { whole };
            if realm.longest_px < REALM_FIT * name.width {
                continue;
            }
            let line = 1.6 * name.x_height;
            for (place, down) in (0..).zip([0.0, -line, line]) {
                let start = realm.at + DVec2::new(-0.5 * name.width, 0.5 * name.x_height + down);
                let writing = Writing {
                    text: name.at(start, 0.0),
                    colour: style.colour,
                    kind: realm.kind.name(),
                    name: realm.name.clone(),
                    at: realm.at,
                };
                let id = [realm.kind as u64, realm.node[0] as u64, realm.node[1] as u64];
                self.add(Class::Realm, &id, (realm.area_km2 as u64, place), writing);
            }
        }
    }

    fn write_ranges(&mut self, ranges: &[Range]) {
        for range in ranges {
            for (index, placed) in (0..).zip(range.write(self.scale, &self.style.labels)) {
                let id = range.id.map(|at| at as u64);
                self.push(Class::Range, &id, (0, index), (placed, &range.name, range.top));
            }
        }
    }

    fn write_sites(&mut self, sites: &[SiteFeature]) {
        for site in sites {
            let at = self.scale.pixel(site.at);
            let radius = symbols::site_px(site.class, self.scale);
            self.obstacles.push(square(at, radius));
            if !self.shows(at) {
                continue;
            }
            let class = match site.class {
                SiteClass::Town => Class::Town,
                SiteClass::Village => Class::Village,
                SiteClass::Hamlet => Class::Hamlet,
            };
            let name = self.shaped(&site.name, class);
            let id = [site.id.i, site.id.j].map(|at| at as u64);
            for (index, start) in (0..).zip(around_point(at, radius + self.scale.pixels(0.5), &name)) {
                let label = (name.at(start, 0.0), &site.name[..], at);
                self.push(class, &id, (site.population.into(), index), label);
            }
        }
    }

    fn write_lakes(&mut self, drawing: &Drawing) {
        for lake in &drawing.lakes {
            let least_px = LEAST_LAKE_MM2 * self.scale.pixels_per_mm * self.scale.pixels_per_mm;
            let Some(text) = lake.name.as_ref().filter(|_| lake.area_px >= least_px) else { continue };
            let name = self.shaped(text, Class::Lake);
            // If the frame cuts the lake, the name goes with the part that is seen.
            let seen =
                self.frame.map(|frame| frame.part(lake.shape.bounds).map(|part| (part, lake.shape.widest(part))));
            let seen = seen.unwrap_or(Some((lake.shape.bounds, (lake.middle, lake.widest))));
            let Some(([west, north, east, south], (middle, widest))) = seen else { continue };
            let DVec2 { x, y } = middle;
            let mut places = Vec::new();
            // The name lies in a lake that is wide enough for it, and across a large lake. Beside a small lake there
            // are further places.
            let is_large = (east - west).max(south - north) > self.scale.pixels(LONGEST_MM);
            if is_large || widest >= 1.15 * name.width {
                places.push([x - 0.5 * name.width, y + 0.5 * name.x_height]);
            }
            if !is_large {
                let gap = self.scale.pixels(0.6);
                places.push([east + gap, y + 0.5 * name.x_height]);
                places.push([west - gap - name.width, y + 0.5 * name.x_height]);
                places.push([x - 0.5 * name.width, south + gap + name.ascent * 0.7]);
                places.push([x - 0.5 * name.width, north - gap]);
            }
            for (index, start) in (0..).zip(places.into_iter().map(DVec2::from)) {
                let label = (name.at(start, 0.0), &text[..], middle);
                self.push(Class::Lake, &[hash_of(&lake.id)], (lake.area_px as u64, index), label);
            }
        }
    }

    fn write_rivers(&mut self, drawing: &Drawing, seen: Option<&CoarseLand<'_>>) {
        for river in &drawing.named {
            self.write_along(river, &river.name, Class::River, |_| true);
            // The name of a valley follows the river as the river's own name does, but further from it.
            if let Some((valley, seen)) = river.valley.as_ref().zip(seen) {
                self.write_along(river, valley, Class::Valley, |at| seen.is_valley(at));
            }
        }
    }

    /// Adds the places of the name of a river or of its valley along the river, where it `fits`.
    fn write_along(&mut self, river: &NamedRiver, text: &str, class: Class, fits: impl Fn(DVec2) -> bool) {
        let name = self.shaped(text, class);
        let (gap_mm, repeat_mm, smooth) =
            if class == Class::Valley { (VALLEY_GAP_MM, VALLEY_REPEAT_MM, 2.5) } else { (0.55, REPEAT_MM, 1.0) };
        let lift = 0.5 * river.width + self.scale.pixels(gap_mm);
        let smooth_px = smooth * self.scale.pixels(class.of(&self.style.labels).1.size_mm);
        let repeat_px = self.scale.pixels(repeat_mm);
        let parts = self.frame.map(|frame| longest_parts(frame.parts(&river.line), repeat_px));
        let parts = parts.unwrap_or_else(|| vec![river.line.clone()]);
        let spots = parts.iter().map(|part| along_line(part, name.width, repeat_px, smooth_px));
        // The numbers of the repetitions go on from one part to the next.
        let spots = spots.scan(0, |before, mut spots| {
            let first = *before;
            for spot in &mut spots {
                spot.repetition += first;
                *before = (*before).max(spot.repetition + 1);
            }
            Some(spots)
        });
        for spot in spots.flatten() {
            let at = spot.line[spot.line.len() / 2];
            if spot.place >= SHIFTS || !fits(at) {
                continue;
            }
            let id = [hash_of(&river.id), spot.repetition.into()];
            // Above the line first, then below it.
            for (side, lift) in (0..).zip([lift, -lift - name.x_height]) {
                if let Some(placed) = name.along(&spot.line, spot.start, lift) {
                    let order = ((river.size * 1000.0) as u64, 2 * spot.place + side);
                    self.push(class, &id, order, (placed, text, at));
                }
            }
        }
    }

    fn write_peaks(&mut self, summits: &[Summit]) {
        for summit in summits {
            let at = self.scale.pixel(summit.at);
            if !self.shows(at) {
                continue;
            }
            let radius = symbols::peak_px(self.scale);
            let height = format!("{:.0}", summit.height_m);
            let text = summit.name.as_ref().map_or(height.clone(), |name| format!("{name} {height}"));
            let line = self.shaped(&text, Class::Peak);
            let id = summit.id.map(|at| at as u64);
            for (index, start) in (0..).zip(around_point(at, radius + self.scale.pixels(0.3), &line)) {
                let label = (line.at(start, 0.0), summit.name.as_deref().unwrap_or_default(), at);
                self.push(Class::Peak, &id, (summit.height_m.max(0.0) as u64, index), label);
            }
        }
    }
}

/// Returns those of the parts of a line on a map that may have a name: the longest, and all that are so long that the
/// name is repeated within them.
fn longest_parts(parts: Vec<Vec<DVec2>>, repeat_px: f64) -> Vec<Vec<DVec2>> {
    let longest = parts.iter().map(|part| length(part)).fold(0.0, f64::max);
    parts.into_iter().filter(|part| length(part) >= longest.min(repeat_px)).collect()
}

fn square(at: DVec2, half: f64) -> Quad {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|corner| at + half * DVec2::from(corner))
}

/// Returns a box from the middle of one box to the middle of the next, as high as the first.
fn between(one: &Quad, next: &Quad) -> Quad {
    let (from, to) = (one[0].midpoint(one[2]), next[0].midpoint(next[2]));
    let half = 0.5 * one[0].distance(one[3]);
    let aside = ((from - to) / from.distance(to).max(1e-9) * half).perp();
    [from + aside, to + aside, to - aside, from - aside]
}

/// Returns the hash of a text.
pub(super) fn hash_of(text: &str) -> u64 {
    hash::of(text.bytes().map(u64::from))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::Arc;

    use super::*;
    use crate::clock::Clock;
    use crate::features::landforms::{LAKES, PEAKS, valley_name};
    use crate::geography::realms::RealmKind;
    use crate::lines::LineKind;
    use crate::map::label::overlap;
    use crate::map::{Chart, Picture};
    use crate::preset::Preset;
    use crate::recipe::source::RecipeSources;
    use crate::world::World;

    #[test]
    fn all_kinds_have_names_and_none_overlaps_another() {
        let (_, mut preset) = Preset::load("alps").unwrap();
        // The expected kinds were found in the world of the bare seed; a country would make it another world.
        preset.country = None;
        let style = Style::load("topographic").unwrap();
        let scale = Scale { metres_per_pixel: 125.0, pixels_per_mm: 2.0 };
        let area = Area::new(-120, -140, 300, 280);
        let picture = Chart::new(&preset, Some(5), style, scale).unwrap().picture(area, &Clock::default()).unwrap();
        let kinds: BTreeSet<&str> = picture.writings().iter().map(|writing| writing.kind).collect();
        assert_eq!(kinds, BTreeSet::from(["lake", "peak", "range", "river", "town", "valley", "village"]));
        for (number, one) in picture.writings().iter().enumerate() {
            for other in &picture.writings()[..number] {
                let apart = |a: Quad| other.boxes().all(|b| !overlap(&a, &b, 0.0));
                assert!(one.boxes().all(apart), "{} and {}", one.name, other.name);
            }
        }
    }

    #[test]
    #[ignore = "slow for its own sake"]
    fn a_whole_world_has_names_of_what_is_large_the_same_in_all_windows() {
        let (_, preset) = Preset::load("world").unwrap();
        // Without waters, roads and settlements, which take minutes over so much land and are not looked at here.
        let text = "extends = \"topographic\"\n[water]\ndraw = false\n[roads]\ndraw = false\n[places]\ndraw = false";
        let style = RecipeSources::<Style>::parse("style.toml", text).unwrap().read_all().unwrap();
        let scale = Scale { metres_per_pixel: 12_000.0, pixels_per_mm: 2.0 };
        let chart = Chart::new(&preset, Some(3), style, scale).unwrap();
        let names = |area: Area| -> BTreeSet<(&'static str, String, [i64; 2])> {
            let picture = chart.picture(area, &Clock::default()).unwrap();
            let large = RealmKind::ALL.map(RealmKind::name);
            let writings = picture.writings().iter().filter(|writing| large.contains(&writing.kind));
            let is_inside = |writing: &&Writing| writing.boxes().all(|quad| is_within(area, &quad));
            writings
                .filter(is_inside)
                .map(|one| (one.kind, one.name.clone(), [one.at.x as i64, one.at.y as i64]))
                .collect()
        };
        let whole = Area::new(-250, -170, 500, 400);
        let all = names(whole);
        let kinds: BTreeSet<&str> = all.iter().map(|(kind, ..)| *kind).collect();
        assert!(kinds.len() >= 4 && kinds.contains("ocean") && kinds.contains("continent"), "{all:?}");
        let part = Area::new(-100, -120, 300, 250);
        let inner = names(part);
        assert!(inner.len() > 3 && inner.is_subset(&all), "{inner:?} of {all:?}");
    }

    /// A labelled feature, as a map of one scale shows it.
    #[derive(Debug)]
    struct Shown {
        denominator: f64,
        kind: &'static str,
        name: String,
        /// Text of the label.
        text: String,
        /// Position in metres east and north.
        at: DVec2,
    }

    /// Returns everything that has a label within some kilometres of a place, at some scales.
    fn shown(preset: &str, seed: u64, [east, north]: [f64; 2], km: f64, scales: &[f64]) -> (Arc<World>, Vec<Shown>) {
        let (_, preset) = Preset::load(preset).unwrap();
        let world = Chart::world(&preset, Some(seed)).unwrap();
        let mut shown = Vec::new();
        for &denominator in scales {
            let scale = Scale { metres_per_pixel: denominator / 2000.0, pixels_per_mm: 2.0 };
            let bounds = [east - km, north - km, east + km, north + km].map(|km| km * 1000.0);
            let style = "extends = \"topographic\"\n[roads]\ndraw = false";
            let style = RecipeSources::<Style>::parse("style.toml", style).unwrap().read_all().unwrap();
            let picture = Chart::of_world(&world, style, scale, &Clock::default())
                .unwrap()
                .picture(scale.pixels_of(bounds), &Clock::default())
                .unwrap();
            shown.extend(picture.writings().iter().filter(|writing| picture.shows(writing.at)).map(|writing| Shown {
                denominator,
                kind: writing.kind,
                name: writing.name.clone(),
                text: writing.text.text.to_string(),
                at: writing.at * DVec2::new(1.0, -1.0) * scale.metres_per_pixel,
            }));
        }
        (world, shown)
    }

    /// Checks that labels agree with the world at every scale: the same name, height and place.
    fn check_names(preset: &str, seed: u64, [east, north]: [f64; 2], km: f64, scales: &[f64]) {
        let (world, shown) = shown(preset, seed, [east, north], km, scales);
        let spacing_m = world.spacing_m();
        let [x, y] = [east, -north].map(|km| (km * 1000.0 / spacing_m) as i64);
        let area = Area::new(x, y, 1, 1).padded((1.5 * km * 1000.0 / spacing_m) as usize);
        let peaks = PEAKS.find(&world, &area, &Clock::default()).unwrap();
        let lakes = LAKES.find(&world, &area, &Clock::default()).unwrap();
        let rivers = world.lines_through(LineKind::River, &area, &Clock::default()).unwrap();
        let sites: Vec<SiteFeature> =
            world.sites(&area, &Clock::default()).unwrap().iter().map(|site| SiteFeature::new(&world, site)).collect();
        let off = |a: DVec2, b: [f64; 2]| a.distance(b.into());
        for one in &shown {
            // Metres of one millimetre of paper, the unit of the tolerances below: generalising moves lines.
            let drawn_m = one.denominator / 1000.0;
            let is_there = match one.kind {
                "peak" => peaks.iter().any(|peak| {
                    let height = format!("{:.0}", peak.height_m);
                    let text = peak.name.as_ref().map_or(height.clone(), |name| format!("{name} {height}"));
                    one.text == text && off(one.at, peak.at) < 1.0
                }),
                "lake" => lakes.iter().any(|lake| {
                    let near = |at: &[f64; 2]| off(one.at, *at) < lake.area_m2.sqrt() + 2.0 * drawn_m;
                    lake.name.as_ref() == Some(&one.name) && lake.rings[0].iter().any(near)
                }),
                "river" => rivers.iter().any(|river| {
                    let at = |point| river.place_from([0, 0], point);
                    let near = |at: [f64; 2]| off(one.at, [at[0] * spacing_m, -at[1] * spacing_m]) < 6.0 * drawn_m;
                    river.name.as_ref() == Some(&one.name) && river.points.iter().map(at).any(near)
                }),
                "town" | "village" | "hamlet" => sites
                    .iter()
                    .any(|site| site.class.name() == one.kind && site.name == one.name && off(one.at, site.at) < 1.0),
                "valley" => rivers.iter().any(|river| valley_name(&world, river).as_ref() == Some(&one.name)),
                // A range has the name of its highest peak, which lies on the range. At smaller scales that peak may
                // lie outside the area that is known here.
                "range" if 40.0 * drawn_m > 0.5e3 * km => true,
                "range" => peaks.iter().any(|peak| {
                    let [x, y] = [peak.at[0], -peak.at[1]].map(|at| (at / spacing_m).round() as i64);
                    let name = world.names().map(|names| names.range([x, y]));
                    name.as_ref() == Some(&one.name) && off(one.at, peak.at) < 40.0 * drawn_m
                }),
                kind => panic!("{kind} is no kind of a thing"),
            };
            assert!(is_there, "{preset} around {east},{north} has no such thing: {one:?}");
        }
        // Some peaks are shown at several scales and not only at the largest.
        let scales: BTreeSet<u64> =
            shown.iter().filter(|one| one.kind == "peak").map(|one| one.denominator as u64).collect();
        assert!(scales.len() > 2, "{preset} has peaks at {scales:?} alone");
    }

    #[test]
    #[ignore = "slow for its own sake"]
    fn a_thing_has_its_name_height_and_place_at_every_scale() {
        // Two places share the eight scales: each label is compared with the world, not with those of other scales.
        check_names("archipelago", 7, [6.0, -8.0], 10.0, &[63e3, 100e3, 250e3, 500e3]);
        check_names("alps", 9, [-31.0, 22.0], 10.0, &[45e3, 68e3, 150e3, 1e6]);
    }

    /// True if a box lies within an area of pixels.
    fn is_within(area: Area, quad: &Quad) -> bool {
        let [west, north, east, south] = area.edges();
        quad.iter().all(|at| (west..=east).contains(&at.x) && (north..=south).contains(&at.y))
    }

    #[test]
    #[ignore = "slow for its own sake"]
    fn no_name_is_cut_by_a_frame() {
        let mut cut = 0;
        for (preset, metres_per_pixel, area) in [
            ("alps", 125.0, Area::new(-120, -140, 300, 280)),
            ("fjords", 40.0, Area::new(900, -700, 320, 260)),
            ("plains", 20.0, Area::new(-450, 130, 300, 300)),
        ] {
            let (_, preset) = Preset::load(preset).unwrap();
            let style = "extends = \"topographic\"\n[roads]\ndraw = false";
            let style = RecipeSources::<Style>::parse("style.toml", style).unwrap().read_all().unwrap();
            let scale = Scale { metres_per_pixel, pixels_per_mm: 2.0 };
            let chart = Chart::new(&preset, Some(5), style, scale).unwrap();
            // Without a frame, the neighbouring picture shows the rest of a name that is cut at the edge.
            let is_cut = |writing: &&Writing| !writing.boxes().all(|quad| is_within(area, &quad));
            let open = chart.picture(area, &Clock::default()).unwrap();
            cut += open.writings().iter().filter(is_cut).count();
            let framed = chart.framed_picture(area, &Clock::default()).unwrap();
            let names = |picture: &Picture| -> BTreeSet<String> {
                picture
                    .writings()
                    .iter()
                    .filter(|writing| !is_cut(writing))
                    .map(|writing| writing.name.clone())
                    .collect()
            };
            for writing in framed.writings() {
                assert!(!is_cut(&writing), "{writing:?}");
                // A range is as large as its name and has no symbol, so its position may lie outside the map.
                if writing.kind == "range" {
                    continue;
                }
                assert!(area.meets(bounds([writing.at].iter())), "{writing:?}");
            }
            // A frame removes few of the names that lie within it.
            let kept = names(&open).intersection(&names(&framed)).count();
            assert!(4 * kept >= 3 * names(&open).len(), "{:?} and {:?}", names(&open), names(&framed));
        }
        assert!(cut > 3, "{cut} names are cut without frames, so that these show nothing");
    }
}
