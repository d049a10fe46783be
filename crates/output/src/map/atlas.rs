//! Atlases: sheets of one scale that overlap a little, an index of them, and a gazetteer of the names on them.

use std::collections::{BTreeMap, BTreeSet};

use crate::area::Area;
use crate::error::Error;
use crate::map::chart::Picture;
use crate::map::font::Face;
use crate::map::scale::Scale;
use crate::map::sheet::{Furniture, Sheet, grid_km};
use crate::map::style::Style;
use crate::map::text::shape;

/// Largest numbers of rows and columns. Rows are named by letters, columns by numbers of two digits.
const MOST_ROWS: u32 = 26;
const MOST_COLUMNS: u32 = 99;

/// Measures of a page of the gazetteer in millimetres: its margin, the width of a column, the gap between columns, the
/// line spacing, and the height of the head.
const MARGIN_MM: f64 = 16.0;
const COLUMN_MM: f64 = 62.0;
const GAP_MM: f64 = 6.0;
const LINE_MM: f64 = 3.9;
const HEAD_MM: f64 = 14.0;

/// Font sizes of the gazetteer and of its head, in millimetres.
const SIZE_MM: f64 = 2.9;
const HEAD_SIZE_MM: f64 = 7.5;

/// Layout of the sheets of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    scale: Scale,
    columns: u32,
    rows: u32,
    /// Size of a page in pixels.
    page: [i64; 2],
    /// Size in pixels of the map on each sheet, and the distance from one map to the next.
    map: [i64; 2],
    step: [i64; 2],
    /// North-western pixel of the first map.
    corner: [i64; 2],
}

impl Layout {
    /// Lays out columns and rows of sheets around a place in metres east and north. The size of the paper and the
    /// overlap of neighbouring maps are in millimetres. `furniture` stands around each map.
    ///
    /// # Errors
    /// When there are no sheets or too many, or the paper has no room for a map.
    pub fn new(
        scale: Scale,
        [columns, rows]: [u32; 2],
        paper_mm: [f64; 2],
        overlap_mm: f64,
        middle_m: [f64; 2],
        (style, furniture): (&Style, &BTreeSet<Furniture>),
    ) -> Result<Layout, Error> {
        let refuse = |message: String, hint: &str| Err(Error::Option { message, hint: hint.into() });
        if !(1..=MOST_COLUMNS).contains(&columns) || !(1..=MOST_ROWS).contains(&rows) {
            return refuse(
                format!(
                    "an atlas has 1 to {MOST_COLUMNS} columns and 1 to {MOST_ROWS} rows of sheets, not {columns} x {rows}"
                ),
                "give fewer sheets, or a smaller scale",
            );
        }
        let page = paper_mm.map(|mm| scale.pixels(mm).round() as i64);
        let [west, north, east, south] = Sheet::margins((style, scale), page[0], furniture);
        let map = [page[0] - west - east, page[1] - north - south];
        let overlap = scale.pixels(overlap_mm).round() as i64;
        let step = map.map(|pixels| pixels - overlap);
        if step.iter().zip(map).any(|(step, map)| *step < map / 2 || *step < 1) {
            return refuse(
                format!(
                    "paper of {} x {} mm has no room for a map that overlaps by {overlap_mm} mm",
                    paper_mm[0], paper_mm[1]
                ),
                "give larger paper, a smaller --overlap, or a --furniture without the legend",
            );
        }
        let size = [columns, rows].map(i64::from);
        let whole = [0, 1].map(|axis| step[axis] * (size[axis] - 1) + map[axis]);
        let middle = scale.pixel(middle_m).to_array().map(|at| at.round() as i64);
        let corner = [0, 1].map(|axis| middle[axis] - whole[axis] / 2);
        Ok(Layout { scale, columns, rows, page, map, step, corner })
    }

    /// Returns the columns and rows of such sheets that cover a rectangle of a size in metres.
    pub fn covering(&self, size_m: [f64; 2]) -> [u32; 2] {
        [0, 1].map(|axis| {
            let pixels = (size_m[axis] / self.scale.metres_per_pixel).ceil() as i64;
            let others = ((pixels - self.map[axis]).max(0) as u64).div_ceil(self.step[axis] as u64);
            u32::try_from(others).map_or(u32::MAX, |others| others.saturating_add(1))
        })
    }

    /// Returns the scale of the sheets.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// Returns the column and the row of each sheet, row by row.
    pub fn sheets(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let columns = self.columns;
        (0..self.rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
    }

    /// Returns the name of a sheet: a letter for its row, a number for its column.
    pub fn name([column, row]: [u32; 2]) -> String {
        format!("{}{}", char::from(b'A' + row as u8), column + 1)
    }

    /// Returns the names of the sheets to the north, east, south and west of a sheet, where there are any.
    pub fn neighbours(&self, [column, row]: [u32; 2]) -> [Option<String>; 4] {
        let known = |column: Option<u32>, row: Option<u32>| {
            let place = [column.filter(|at| *at < self.columns)?, row.filter(|at| *at < self.rows)?];
            Some(Layout::name(place))
        };
        [
            known(Some(column), row.checked_sub(1)),
            known(Some(column + 1), Some(row)),
            known(Some(column), Some(row + 1)),
            known(column.checked_sub(1), Some(row)),
        ]
    }

    /// Returns the pixels of the map on a sheet.
    pub fn map(&self, [column, row]: [u32; 2]) -> Area {
        let at = [column, row].map(i64::from);
        let [x, y] = [0, 1].map(|axis| self.corner[axis] + at[axis] * self.step[axis]);
        Area::new(x, y, self.map[0] as usize, self.map[1] as usize)
    }

    /// Returns the map of the index: the scale at which all sheets fit on one sheet, and the pixels of that map.
    pub fn index(&self) -> (Scale, Area) {
        let last = self.map([self.columns - 1, self.rows - 1]);
        let whole = self.map([0, 0]).hull(&last);
        let times = (whole.width() as f64 / self.map[0] as f64).max(whole.height() as f64 / self.map[1] as f64);
        // Leave a little room around the sheets, and take a round scale.
        let least = times * 1.06 * self.scale.denominator();
        let power = libm::pow(10.0, libm::floor(libm::log10(least)) - 1.0);
        let denominator = libm::ceil(least / (5.0 * power)) * 5.0 * power;
        let per_pixel = denominator / 1000.0 / self.scale.pixels_per_mm;
        let scale = Scale { metres_per_pixel: per_pixel, ..self.scale };
        let middle = [whole.x0 + whole.x1, whole.y0 + whole.y1]
            .map(|sum| sum as f64 * 0.5 * self.scale.metres_per_pixel / per_pixel);
        let [x, y] = [0, 1].map(|axis| middle[axis].round() as i64 - self.map[axis] / 2);
        (scale, Area::new(x, y, self.map[0] as usize, self.map[1] as usize))
    }

    /// Returns the frames of all sheets on the index, with their names.
    pub fn frames(&self) -> Vec<(Area, String)> {
        let (scale, _) = self.index();
        let share = self.scale.metres_per_pixel / scale.metres_per_pixel;
        let at = |pixel: i64| (pixel as f64 * share).round() as i64;
        self.sheets()
            .map(|place| {
                let Area { x0, y0, x1, y1 } = self.map(place);
                (Area { x0: at(x0), y0: at(y0), x1: at(x1), y1: at(y1) }, Layout::name(place))
            })
            .collect()
    }

    /// Draws the frames of all sheets on the sheet of the index.
    pub fn add_frames(&self, sheet: &mut Sheet) {
        sheet.add_frames(&self.frames());
    }
}

/// The names on the sheets of an atlas, and the places of each name.
#[derive(Clone, Debug, Default)]
pub struct Gazetteer {
    /// Places of each name. The key is the name in small letters, the name itself and its kind. A place is a sheet and
    /// a square of its grid, given by the kilometres east and north of the square's south-western corner.
    entries: BTreeMap<(String, String, &'static str), SheetSquares>,
}

/// Sheets by column and row, each with a square of its grid.
type SheetSquares = BTreeSet<([u32; 2], [i64; 2])>;

/// A page of the gazetteer.
#[derive(Debug)]
pub struct GazetteerPage {
    lines: Vec<(String, Face, f64, [f64; 2], f64)>,
    /// Parts of the page, in pixels from its corner, each with the sheet that it refers to.
    pub links: Vec<([f64; 4], [u32; 2])>,
}

impl Gazetteer {
    /// Adds all names that are written on a sheet.
    pub fn add(&mut self, place: [u32; 2], picture: &Picture) {
        let scale = picture.chart().scale();
        let grid_m = grid_km(scale) * 1000.0;
        for (kind, name, [x, y]) in picture.names() {
            let square = [x, -y].map(|at| (at * scale.metres_per_pixel / grid_m).floor());
            let square = square.map(|at| (at * grid_m / 1000.0).round() as i64);
            let key = (name.to_lowercase(), name.to_owned(), kind);
            self.entries.entry(key).or_default().insert((place, square));
        }
    }

    /// Returns the number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True if there is no name on any sheet.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns the pages that all names take on the paper of an atlas.
    pub fn pages(&self, layout: &Layout, style: &Style) -> Vec<GazetteerPage> {
        let scale = layout.scale;
        let paper = layout.page.map(|pixels| pixels as f64 / scale.pixels_per_mm);
        let columns = (((paper[0] - 2.0 * MARGIN_MM + GAP_MM) / (COLUMN_MM + GAP_MM)).floor() as usize).max(1);
        let rows = (((paper[1] - 2.0 * MARGIN_MM - HEAD_MM) / LINE_MM).floor() as usize).max(1);
        let entries: Vec<_> = self.entries.iter().collect();
        let mut pages = Vec::new();
        for (number, entries) in entries.chunks(columns * rows).enumerate() {
            let mut page = GazetteerPage { lines: Vec::new(), links: Vec::new() };
            let head = if number == 0 { "Gazetteer" } else { "Gazetteer, continued" };
            page.lines.push((head.into(), Face::Semibold, HEAD_SIZE_MM, [MARGIN_MM, MARGIN_MM + 5.0], 0.0));
            let about = "sheet, and kilometres east and north of the corner of the grid's square";
            page.lines.push((about.into(), Face::Italic, SIZE_MM, [paper[0] - MARGIN_MM, MARGIN_MM + 5.0], 1.0));
            for (index, ((_, name, kind), places)) in entries.iter().enumerate() {
                let x = MARGIN_MM + (index / rows) as f64 * (COLUMN_MM + GAP_MM);
                let y = MARGIN_MM + HEAD_MM + (index % rows) as f64 * LINE_MM;
                page.add_entry((style, scale), [x, y], name, kind, places);
            }
            pages.push(page);
        }
        pages
    }
}

impl GazetteerPage {
    fn add_entry(
        &mut self,
        (style, scale): (&Style, Scale),
        [x, y]: [f64; 2],
        name: &str,
        kind: &str,
        places: &SheetSquares,
    ) {
        let width = |text: &str, face: Face| {
            let text = shape(text, style.labels.typeface(face), scale.pixels(SIZE_MM) as f32, 0.0);
            text.width / scale.pixels_per_mm
        };
        let of = format!("{name} ");
        let named = width(&of, Face::Semibold);
        self.lines.push((of, Face::Semibold, SIZE_MM, [x, y], 0.0));
        self.lines.push((kind.to_owned(), Face::Italic, SIZE_MM, [x + named, y], 0.0));
        let room = COLUMN_MM - named - width(kind, Face::Italic) - 2.0;
        // Set references from the right, as many as there is room for: long rivers are on many sheets.
        let mut right = x + COLUMN_MM;
        let mut left = room;
        let refer = |(place, square): &([u32; 2], [i64; 2])| {
            (*place, format!("{} {},{}", Layout::name(*place), square[0], square[1]))
        };
        let mut refs: Vec<([u32; 2], String)> = places.iter().map(refer).collect();
        refs.dedup_by_key(|(place, _)| *place);
        let fitting = refs
            .iter()
            .take_while(|(_, text)| {
                left -= width(text, Face::Regular) + 2.0;
                left > -2.0
            })
            .count()
            .max(1);
        for (place, text) in refs[..fitting.min(refs.len())].iter().rev() {
            let wide = width(text, Face::Regular);
            self.lines.push((text.clone(), Face::Regular, SIZE_MM, [right, y], 1.0));
            let part = [right - wide, y - SIZE_MM, right, y + 0.3 * SIZE_MM].map(|mm| scale.pixels(mm));
            self.links.push((part, *place));
            right -= wide + 2.0;
        }
    }

    /// Returns the page as a sheet.
    pub fn sheet<'a>(&self, layout: &Layout, style: &'a Style) -> Sheet<'a> {
        let page = Area::new(0, 0, layout.page[0] as usize, layout.page[1] as usize);
        Sheet::of_text(style, layout.scale, page, &self.lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_overlap_and_know_their_neighbours() {
        let (style, scale) = (Style::load("atlas").unwrap(), Scale { metres_per_pixel: 10.0, pixels_per_mm: 5.0 });
        let layout =
            Layout::new(scale, [3, 2], [297.0, 210.0], 10.0, [1000.0, 2000.0], (&style, &Furniture::ALL.into()))
                .unwrap();
        let names: Vec<String> = layout.sheets().map(Layout::name).collect();
        assert_eq!(names, ["A1", "A2", "A3", "B1", "B2", "B3"]);
        let [first, second] = [[0, 0], [1, 0]].map(|place| layout.map(place));
        assert_eq!(first.x1 - second.x0, 50, "10 mm");
        assert_eq!(layout.neighbours([1, 0]), [None, Some("A3".into()), Some("B2".into()), Some("A1".into())]);
        // All sheets lie around the middle, and on the index.
        let whole = first.hull(&layout.map([2, 1]));
        assert!((whole.x0 + whole.x1 - 200).abs() <= 1 && (whole.y0 + whole.y1 + 400).abs() <= 1);
        let (index, map) = layout.index();
        assert!(index.metres_per_pixel > scale.metres_per_pixel);
        assert!(layout.frames().iter().all(|(frame, _)| map.contains(frame)));
    }

    #[test]
    fn what_has_no_room_is_refused() {
        let (style, scale) = (Style::load("atlas").unwrap(), Scale { metres_per_pixel: 10.0, pixels_per_mm: 5.0 });
        let all = Furniture::ALL.into();
        let refused = |sheets, paper, overlap| {
            Layout::new(scale, sheets, paper, overlap, [0.0; 2], (&style, &all)).unwrap_err().to_string()
        };
        assert!(refused([0, 1], [297.0, 210.0], 10.0).contains("0 x 1"));
        assert!(refused([1, 27], [297.0, 210.0], 10.0).contains("1 x 27"));
        assert!(refused([1, 1], [40.0, 30.0], 10.0).contains("no room"));
        assert!(refused([1, 1], [297.0, 210.0], 200.0).contains("overlaps by 200"));
        // Small paper has room for a map with furniture, but not with a legend of everything that a map can show.
        let small = |furniture: &[Furniture]| {
            Layout::new(scale, [1, 1], [80.0; 2], 10.0, [0.0; 2], (&style, &furniture.iter().copied().collect()))
        };
        assert!(small(&[Furniture::Legend]).unwrap_err().to_string().contains("no room"));
        assert!(small(&[Furniture::Title, Furniture::Grid, Furniture::Scale]).is_ok());
    }
}
