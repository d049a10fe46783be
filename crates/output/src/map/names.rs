//! Names and heights on a map: what could be written where, and what there is room for.

use std::collections::{BTreeSet, HashMap};

use rayon::prelude::*;

use crate::area::Area;
use crate::features::sites::SiteFeature;
use crate::geometry::length;
use crate::hash;
use crate::map::drawing::{Drawing, NamedRiver};
use crate::map::label::{self, Candidate, Rank, along_line, around_point, place};
use crate::map::plotter::bounds;
use crate::map::ranges::Seen;
use crate::map::scale::Scale;
use crate::map::style::{LabelStyle, Style};
use crate::map::summits::Summit;
use crate::map::symbols;
use crate::map::text::{Placed, Quad, Shaped, shape};
use crate::places::site::SiteClass;

/// Millimetres that all places of a name together span at most: a longer name has fewer places.
const LONGEST_MM: f64 = 30.0;

/// Places along a river that a repetition of its name may have.
const SHIFTS: u32 = 3;

/// Square millimetres of paper that a lake has at least whose name is written.
const LEAST_LAKE_MM2: f64 = 5.0;

/// Millimetres between names.
const MARGIN_MM: f64 = 0.5;

/// Millimetres from the middle of a symbol to the name beside it at most, with the symbol.
const BESIDE_MM: f64 = 2.0;

/// Millimetres of paper of the squares in which settlements and peaks are looked for.
const CELL_MM: f64 = 20.0;

/// Millimetres of paper from a river's name to the next along it.
const REPEAT_MM: f64 = 110.0;

/// Millimetres of paper from a river to the name of its valley, and from that to the next along it.
const VALLEY_GAP_MM: f64 = 2.2;
const VALLEY_REPEAT_MM: f64 = 200.0;

/// Scales, as second numbers, from which on villages and hamlets have no name, nor symbol.
const MOST_VILLAGES: f64 = 400_000.0;
const MOST_HAMLETS: f64 = 130_000.0;

/// Something that is written on a map.
#[derive(Clone, Debug)]
pub(super) struct Writing {
    pub texts: Vec<Placed>,
    pub style: LabelStyle,
    /// The middle of a peak that is marked with it.
    pub peak: Option<[f64; 2]>,
    /// What it is that has the name, its name, if it has one, and where it is.
    pub kind: &'static str,
    pub name: String,
    pub at: [f64; 2],
}

impl Writing {
    /// What it covers.
    pub fn boxes(&self) -> impl Iterator<Item = Quad> {
        self.texts.iter().flat_map(|text| text.boxes.iter().copied())
    }
}

/// Pixels around an area in which what could be written has a say in what is written there.
pub(super) fn pad(scale: Scale) -> usize {
    let longest = scale.pixels(LONGEST_MM);
    // No name is written further than that from what it belongs to.
    (label::pad_px(longest, scale.pixels(MARGIN_MM)) + longest) as usize + 1
}

/// Whether a settlement of a class is drawn at a scale.
pub(super) fn is_drawn(class: SiteClass, scale: Scale) -> bool {
    match class {
        SiteClass::Town => true,
        SiteClass::Village => scale.denominator() <= MOST_VILLAGES,
        SiteClass::Hamlet => scale.denominator() <= MOST_HAMLETS,
    }
}

/// Where settlements and peaks are found that could have a name, in an area of pixels. It takes long, so they are asked for
/// where they matter alone.
pub(super) struct Finders<'a> {
    pub sites: &'a (dyn Fn(Area) -> Vec<SiteFeature> + Sync),
    pub summits: &'a (dyn Fn(Area) -> Vec<Summit> + Sync),
}

/// All that is written in an area of pixels, given the water there and [around](pad), and the land from afar.
pub(super) fn write(
    (style, scale): (&Style, Scale),
    drawing: &Drawing,
    seen: Option<&Seen<'_>>,
    finders: &Finders<'_>,
    area: Area,
) -> Vec<Writing> {
    let mut writer = Writer { style, scale, candidates: Vec::new(), obstacles: Vec::new() };
    writer.write_ranges(seen);
    writer.write_lakes(drawing);
    writer.write_rivers(drawing, seen);
    // What is around the letters may be seen where they are not.
    let visible = area.padded(scale.pixels(style.labels.halo_mm) as usize + 2);
    let is_seen = |boxes: &Vec<Quad>| visible.meets(bounds(boxes.iter().flatten()));
    let margin = scale.pixels(MARGIN_MM);
    // What belongs to a place that may matter has its middle within it.
    let reach = scale.pixels(LONGEST_MM + BESIDE_MM) + margin;
    let side = scale.pixels(CELL_MM).ceil() as i64;
    let [mut sites, mut summits] = [Cells::new(side), Cells::new(side)];
    let [west, north, east, south] = [visible.x0, visible.y0, visible.x1, visible.y1].map(|at| at as f64);
    let mut near_sites = vec![[west - reach, north - reach, east + reach, south + reach]];
    let mut near_summits = near_sites.clone();
    loop {
        let new = (sites.missing(&near_sites), summits.missing(&near_summits));
        if new.0.is_empty() && new.1.is_empty() {
            break;
        }
        let found = rayon::join(
            || find(&new.0, finders.sites, |site| scale.pixel(site.at)),
            || find(&new.1, finders.summits, |summit| scale.pixel(summit.at)),
        );
        writer.write_sites(&found.0);
        writer.write_peaks(&found.1);
        writer.leave_out_long();
        let concerned = label::concerned(&mut writer.candidates, &writer.obstacles, margin, |one| is_seen(&one.boxes));
        (near_sites, near_summits) = (Vec::new(), Vec::new());
        for candidate in concerned.into_iter().map(|index| &writer.candidates[index]) {
            let [west, north, east, south] = bounds(candidate.boxes.iter().flatten());
            let near = [west - reach, north - reach, east + reach, south + reach];
            near_sites.push(near);
            // No peak takes the place of what comes before peaks.
            if candidate.rank.class >= Class::Peak as u32 {
                near_summits.push(near);
            }
        }
    }
    let shown = place(writer.candidates, &writer.obstacles, margin);
    shown.into_iter().filter(|one| is_seen(&one.boxes)).map(|one| one.item).collect()
}

/// Squares of a map in which all of a kind has been found.
struct Cells {
    side: i64,
    known: BTreeSet<[i64; 2]>,
}

impl Cells {
    fn new(side: i64) -> Cells {
        Cells { side, known: BTreeSet::new() }
    }

    /// The squares of some rectangles (west, north, east and south) that were not known, and are from now on.
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

/// All that is found in some squares, each thing in the one that its place lies in.
fn find<T: Send>(
    squares: &[Area],
    find: &(dyn Fn(Area) -> Vec<T> + Sync),
    place: impl Fn(&T) -> [f64; 2] + Sync,
) -> Vec<T> {
    let of_square = |square: &Area| {
        let is_within = |thing: &T| {
            let [x, y] = place(thing).map(|at| at.floor() as i64);
            square.contains(&Area::new(x, y, 1, 1))
        };
        find(*square).into_iter().filter(is_within).collect::<Vec<T>>()
    };
    squares.par_iter().map(of_square).collect::<Vec<_>>().into_iter().flatten().collect()
}

struct Writer<'a> {
    style: &'a Style,
    scale: Scale,
    candidates: Vec<Candidate<Writing>>,
    obstacles: Vec<Quad>,
}

/// What comes first where there is not room for all.
#[derive(Clone, Copy)]
enum Class {
    /// Ranges are so far apart that they never meet: each makes room for symbols alone, and all other names for it.
    Range,
    Town,
    Lake,
    Village,
    River,
    Peak,
    Valley,
    Hamlet,
}

/// What is written along rivers.
struct Along {
    class: Class,
    name: &'static str,
    /// Tells its names from all others.
    number: i64,
}

impl Writer<'_> {
    /// Leaves out places of names that, with the better ones of the same name, would matter further away than [`pad`] says.
    fn leave_out_long(&mut self) {
        let longest = self.scale.pixels(LONGEST_MM);
        let mut spans: HashMap<u64, [f64; 4]> = HashMap::new();
        // Places of a name come one after the other, the best first.
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

    fn shaped(&self, text: &str, style: &LabelStyle) -> Shaped {
        shape(text, style.face, self.scale.pixels(style.size_mm) as f32, style.spacing as f32)
    }

    fn push(&mut self, class: Class, (weight, feature, place): (u64, u64, u32), item: Writing) {
        // A peak's mark goes with its height.
        let mark = item.peak.map(|at| square(at, symbols::peak_px(self.scale)));
        let boxes = item.boxes().chain(mark).collect();
        let rank = Rank { class: class as u32, weight, feature, place };
        self.candidates.push(Candidate { rank, boxes, item });
    }

    fn write_ranges(&mut self, seen: Option<&Seen<'_>>) {
        let style = self.style.labels.range;
        for range in seen.iter().flat_map(|seen| seen.ranges()) {
            let feature = number(&[6, range.id[0], range.id[1]]);
            for (index, placed) in (0..).zip(range.write(self.scale, &style)) {
                let (texts, name) = (vec![placed], range.name.clone());
                let item = Writing { texts, style, peak: None, kind: "range", name, at: range.top };
                // Between its letters too there is no room for what has a name of its own.
                let letters: Vec<Quad> = item.boxes().collect();
                self.push(Class::Range, (0, feature, index), item);
                let candidate = self.candidates.last_mut().expect("one was pushed");
                candidate.boxes.extend(letters.windows(2).map(|pair| between(&pair[0], &pair[1])));
            }
        }
    }

    fn write_sites(&mut self, sites: &[SiteFeature]) {
        for site in sites {
            let at = self.scale.pixel(site.at);
            let radius = symbols::site_px(site.class, self.scale);
            self.obstacles.push(square(at, radius));
            let (class, style) = match site.class {
                SiteClass::Town => (Class::Town, self.style.labels.places[0]),
                SiteClass::Village => (Class::Village, self.style.labels.places[1]),
                SiteClass::Hamlet => (Class::Hamlet, self.style.labels.places[2]),
            };
            let name = self.shaped(&site.name, &style);
            let feature = number(&[1, site.id.i, site.id.j]);
            let radius = radius + self.scale.pixels(0.5);
            for (index, start) in (0..).zip(around_point(at, radius, &name)) {
                let order = (u64::from(site.population), feature, index);
                let (kind, name, text) = (site.class.name(), site.name.clone(), name.at(start, 0.0));
                self.push(class, order, Writing { texts: vec![text], style, peak: None, kind, name, at });
            }
        }
    }

    fn write_lakes(&mut self, drawing: &Drawing) {
        let style = self.style.labels.lake;
        for lake in &drawing.lakes {
            let least_px = LEAST_LAKE_MM2 * self.scale.pixels_per_mm * self.scale.pixels_per_mm;
            let Some(text) = lake.name.as_ref().filter(|_| lake.area_px >= least_px) else { continue };
            let name = self.shaped(text, &style);
            let feature = number(&[2, hash_of(&lake.id) as i64]);
            let [x, y] = lake.middle;
            let mut places = Vec::new();
            let [west, north, east, south] = lake.shape.bounds;
            // In a lake that is wide enough, and across one that is large; beside a small one.
            let is_large = (east - west).max(south - north) > self.scale.pixels(LONGEST_MM);
            if is_large || lake.widest >= 1.15 * name.width {
                places.push([x - 0.5 * name.width, y + 0.5 * name.x_height]);
            }
            if !is_large {
                let gap = self.scale.pixels(0.6);
                places.push([east + gap, y + 0.5 * name.x_height]);
                places.push([west - gap - name.width, y + 0.5 * name.x_height]);
                places.push([x - 0.5 * name.width, south + gap + name.ascent * 0.7]);
                places.push([x - 0.5 * name.width, north - gap]);
            }
            for (index, start) in (0..).zip(places) {
                let order = (lake.area_px as u64, feature, index);
                let (texts, name) = (vec![name.at(start, 0.0)], text.clone());
                let item = Writing { texts, style, peak: None, kind: "lake", name, at: lake.middle };
                self.push(Class::Lake, order, item);
            }
        }
    }

    fn write_rivers(&mut self, drawing: &Drawing, seen: Option<&Seen<'_>>) {
        for river in &drawing.named {
            let kind = Along { class: Class::River, name: "river", number: 3 };
            let style = self.style.labels.river;
            self.write_along(river, &river.name, &style, kind, |_| true);
            // A valley is written as its river is, and further from it.
            if let Some((valley, seen)) = river.valley.as_ref().zip(seen) {
                let kind = Along { class: Class::Valley, name: "valley", number: 5 };
                let style = self.style.labels.valley;
                self.write_along(river, valley, &style, kind, |at| seen.is_valley(at));
            }
        }
    }

    /// A name along a river, where it `fits`.
    fn write_along(
        &mut self,
        river: &NamedRiver,
        text: &str,
        style: &LabelStyle,
        Along { class, name: kind, number: stream }: Along,
        fits: impl Fn([f64; 2]) -> bool,
    ) {
        let name = self.shaped(text, style);
        let is_valley = matches!(class, Class::Valley);
        let (gap_mm, repeat_mm, smooth) =
            if is_valley { (VALLEY_GAP_MM, VALLEY_REPEAT_MM, 2.5) } else { (0.55, REPEAT_MM, 1.0) };
        let lift = 0.5 * river.width + self.scale.pixels(gap_mm);
        let smooth_px = smooth * self.scale.pixels(style.size_mm);
        for spot in along_line(&river.line, name.width, self.scale.pixels(repeat_mm), smooth_px) {
            let at = spot.line[spot.line.len() / 2];
            if spot.place >= SHIFTS || !fits(at) {
                continue;
            }
            let feature = number(&[stream, hash_of(&river.id) as i64, i64::from(spot.repetition)]);
            // Above the line first, or else below it.
            for (side, lift) in (0..).zip([lift, -lift - name.x_height]) {
                if let Some(placed) = name.along(&spot.line, spot.start, lift) {
                    let order = ((river.discharge_m3s * 1000.0) as u64, feature, 2 * spot.place + side);
                    let (texts, name) = (vec![placed], text.to_owned());
                    self.push(class, order, Writing { texts, style: *style, peak: None, kind, name, at });
                }
            }
        }
    }

    fn write_peaks(&mut self, summits: &[Summit]) {
        let style = self.style.labels.peak;
        for summit in summits {
            let at = self.scale.pixel(summit.at);
            let radius = symbols::peak_px(self.scale);
            let height = format!("{:.0}", summit.height_m);
            let text = summit.name.as_ref().map_or(height.clone(), |name| format!("{name} {height}"));
            let line = self.shaped(&text, &style);
            let feature = number(&[4, summit.id[0], summit.id[1]]);
            for (index, start) in (0..).zip(around_point(at, radius + self.scale.pixels(0.3), &line)) {
                let name = summit.name.clone().unwrap_or_default();
                let texts = vec![line.at(start, 0.0)];
                let item = Writing { texts, style, peak: Some(at), kind: "peak", name, at };
                self.push(Class::Peak, (summit.height_m.max(0.0) as u64, feature, index), item);
            }
        }
    }
}

fn square([x, y]: [f64; 2], half: f64) -> Quad {
    [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
}

/// A box from the middle of a box to that of the next, as high as the first.
fn between(one: &Quad, next: &Quad) -> Quad {
    let middle = |quad: &Quad| [0, 1].map(|axis| 0.5 * (quad[0][axis] + quad[2][axis]));
    let (from, to) = (middle(one), middle(next));
    let half = 0.5 * length([one[3][0] - one[0][0], one[3][1] - one[0][1]]);
    let long = length([to[0] - from[0], to[1] - from[1]]).max(1e-9);
    let [east, south] = [0, 1].map(|axis| (to[axis] - from[axis]) / long * half);
    [(from, 1.0), (to, 1.0), (to, -1.0), (from, -1.0)].map(|([x, y], side)| [x + side * south, y - side * east])
}

/// What tells a thing from others: mixed from its numbers.
fn number(parts: &[i64]) -> u64 {
    parts.iter().fold(0, |number, part| hash::mix(number ^ *part as u64))
}

/// A number that tells a text from others.
pub(super) fn hash_of(text: &str) -> u64 {
    text.bytes().fold(0, |number, byte| hash::mix(number ^ u64::from(byte)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::map::Chart;
    use crate::map::label::overlap;
    use crate::preset::Preset;

    #[test]
    fn all_kinds_have_names_and_none_overlaps_another() {
        let (_, preset) = Preset::load("alps").unwrap();
        let style = Style::load("topographic").unwrap();
        let scale = Scale { metres_per_pixel: 125.0, pixels_per_mm: 2.0 };
        let area = Area::new(-120, -140, 300, 280);
        let picture = Chart::new(&preset, Some(5), style, scale).unwrap().picture(area);
        let kinds: BTreeSet<&str> = picture.writings().iter().map(|writing| writing.kind).collect();
        assert_eq!(kinds, BTreeSet::from(["lake", "peak", "range", "river", "town", "valley", "village"]));
        for (number, one) in picture.writings().iter().enumerate() {
            for other in &picture.writings()[..number] {
                let apart = |a: Quad| other.boxes().all(|b| !overlap(&a, &b, 0.0));
                assert!(one.boxes().all(apart), "{} and {}", one.name, other.name);
            }
        }
    }
}
