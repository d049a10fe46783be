//! An atlas as files: one picture per sheet, and one document of all sheets.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::area::Area;
use crate::device::LandMaker;
use crate::error::Error;
use crate::export::formats::map_picture::{MapPicture, Texts};
use crate::export::formats::pdf::Pdf;
use crate::export::plan::memory::told;
use crate::map::Chart;
use crate::map::atlas::{Gazetteer, Layout};
use crate::map::plotter::Lettering;
use crate::map::scale::Scale;
use crate::map::sheet::{Captions, Sheet, thousands};
use crate::map::style::Style;
use crate::watch::Watch;
use crate::world::World;

/// File names in an atlas's folder: the document, and the picture of the index sheet.
const DOCUMENT: &str = "atlas.pdf";
const INDEX: &str = "index.png";

/// An atlas that is to be written.
#[derive(Debug)]
pub struct AtlasFiles {
    folder: PathBuf,
    layout: Layout,
    has_pictures: bool,
    has_document: bool,
    overwrite: bool,
}

/// The result of writing an atlas.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenAtlas {
    /// The files, the index first.
    pub files: Vec<PathBuf>,
    /// Number of names in the gazetteer.
    pub names: usize,
    /// The letters that the fonts lack: the atlas shows a box for each.
    pub missing: BTreeSet<char>,
}

impl AtlasFiles {
    /// Plans the files of an atlas in a folder.
    ///
    /// # Errors
    /// When a file is there already that may not be replaced, or when there is not enough room.
    pub fn new(
        folder: &Path,
        layout: Layout,
        has_pictures: bool,
        has_document: bool,
        overwrite: bool,
    ) -> Result<AtlasFiles, Error> {
        let files = AtlasFiles { folder: folder.to_owned(), layout, has_pictures, has_document, overwrite };
        let sheets = files.layout.sheets().map(|place| format!("{}.png", Layout::name(place)));
        let pictures = sheets.chain([INDEX.to_owned()]).filter(|_| has_pictures);
        let map = files.layout.map([0, 0]);
        for name in pictures.chain(has_document.then(|| DOCUMENT.to_owned())) {
            MapPicture::new(&folder.join(name), (map.width(), map.height()), overwrite)?;
        }
        Ok(files)
    }

    /// Returns the most memory in bytes that writing takes on so many threads: for the sheets, and for the index, whose
    /// land stays in memory.
    pub fn memory_bytes(&self, world: &World, threads: usize) -> u64 {
        let (index_scale, index) = self.layout.index();
        let sheet = self.layout.map([0, 0]);
        let of = |scale: Scale, map: Area, threads: usize| {
            let rows = if self.has_document { map.height() } else { Chart::STRIP };
            Chart::memory(world, scale, [map.width(), map.height()], rows, threads)
        };
        let [[one, land], [other, others]] = [of(index_scale, index, 0), of(self.layout.scale(), sheet, threads)];
        told(threads, one.saturating_add(other), land.saturating_add(others).min(Chart::REMEMBERED as u64))
    }

    /// Draws and writes all of a [world](Chart::world), whose land `maker` makes: the index, the sheets and the
    /// gazetteer. Each sheet has `captions`, with its own title and neighbours; the files say `texts` of themselves.
    /// `watch` counts the sheets.
    ///
    /// # Errors
    /// When `maker` fails, or the disk refuses.
    pub fn write(
        &self,
        world: &Arc<World>,
        maker: impl Fn(&World) -> Result<Arc<dyn LandMaker>, Error>,
        style: &Style,
        captions: &Captions,
        texts: &Texts,
        watch: &Watch,
    ) -> Result<WrittenAtlas, Error> {
        let chart_of = |scale| Chart::made_by(&maker, world, style.clone(), scale, &watch.clock);
        let layout = &self.layout;
        let (files, missing) = (Vec::new(), BTreeSet::new());
        // The caller's watch counts whole sheets, so the pictures get their own.
        let of_pictures = Watch::stopped_by(watch.clock.stop());
        let mut book = Book { atlas: self, texts, pdf: None, pages: 0, files, missing, watch: of_pictures };
        let (scale, map) = layout.index();
        let index = book.path(INDEX);
        // Prepared before anything is drawn, so that a folder that cannot be written to is an error at once.
        MapPicture::new(&index, (map.width(), map.height()), true)?.prepare()?;
        if self.has_document {
            book.pdf = Some(Pdf::create(book.path(DOCUMENT))?);
        }
        let mut gazetteer = Gazetteer::default();
        let chart = chart_of(scale)?;
        let subtitle = format!("index of sheets, 1 : {}", thousands(scale.denominator()));
        let captions_of_index = Captions { subtitle, overlay: None, ..captions.clone() };
        let picture = Sheet::picture(&chart, map, &captions.furniture, watch)?;
        watch.begin("drawing the index", None);
        // All sheets have the same size, whatever their legends explain.
        let page = Sheet::area(map, (style, scale), &captions_of_index);
        let mut sheet = Sheet::on_page(&picture, &captions_of_index, page);
        layout.add_frames(&mut sheet);
        let links = layout.frames().into_iter().zip(1..).map(|((frame, _), page)| (edges(frame), page)).collect();
        book.add(&sheet, scale, INDEX, "Index", links)?;
        drop(picture);
        watch.begin("drawing sheets", Some((layout.sheets().count() as u64, "sheets")));
        let chart = chart_of(layout.scale())?;
        for place in layout.sheets() {
            let name = Layout::name(place);
            let captions = Captions {
                title: format!("{} {name}", captions.title),
                neighbours: layout.neighbours(place),
                ..captions.clone()
            };
            let picture = Sheet::picture(&chart, layout.map(place), &captions.furniture, &book.watch)?;
            gazetteer.add(place, &picture);
            let page = Sheet::area(picture.area(), (style, layout.scale()), &captions);
            let sheet = Sheet::on_page(&picture, &captions, page);
            book.add(&sheet, layout.scale(), &format!("{name}.png"), &format!("Sheet {name}"), Vec::new())?;
            watch.add(1);
        }
        let page_of = |place: [u32; 2]| 1 + layout.sheets().position(|other| other == place).expect("it is a sheet");
        watch.begin("writing the gazetteer", None);
        for (number, page) in gazetteer.pages(layout, style).iter().enumerate() {
            let sheet = page.sheet(layout, style);
            let links = page.links.iter().map(|(part, place)| (*part, page_of(*place))).collect();
            let title = if number == 0 { "Gazetteer" } else { "" };
            book.add(&sheet, layout.scale(), &format!("gazetteer-{}.png", number + 1), title, links)?;
        }
        let Book { pdf, mut files, missing, .. } = book;
        if let Some(pdf) = pdf {
            pdf.finish(&texts.title, &texts.description, &texts.software)?;
            files.push(self.folder.join(DOCUMENT));
        }
        Ok(WrittenAtlas { files, names: gazetteer.len(), missing })
    }
}

/// Returns the edges of an area: west, north, east and south.
fn edges(area: Area) -> [f64; 4] {
    [area.x0, area.y0, area.x1, area.y1].map(|at| at as f64)
}

/// An atlas under way, which is written page by page.
struct Book<'a> {
    atlas: &'a AtlasFiles,
    texts: &'a Texts,
    pdf: Option<Pdf>,
    pages: usize,
    files: Vec<PathBuf>,
    missing: BTreeSet<char>,
    watch: Watch,
}

impl Book<'_> {
    fn path(&self, name: &str) -> PathBuf {
        self.atlas.folder.join(name)
    }

    /// Adds a sheet as a picture and as a page, with links from parts of it to pages.
    fn add(
        &mut self,
        sheet: &Sheet,
        scale: Scale,
        name: &str,
        bookmark: &str,
        links: Vec<([f64; 4], usize)>,
    ) -> Result<(), Error> {
        self.missing.extend(sheet.missing_letters());
        if self.atlas.has_pictures {
            let path = self.path(name);
            let page = sheet.page();
            // The number of the gazetteer's sheets is not known earlier, so their files are checked here.
            let file = MapPicture::new(&path, (page.width(), page.height()), self.atlas.overwrite)?;
            file.write(sheet, scale, self.texts, &self.watch)?;
            self.files.push(path);
        }
        if let Some(pdf) = &mut self.pdf {
            let mut page = pdf.page(self.pages, sheet.page(), scale, Lettering::Text);
            sheet.plot(&mut page, &self.watch)?;
            for (part, target) in links {
                page.link(part, target);
            }
            page.finish()?;
            if !bookmark.is_empty() {
                pdf.bookmark(bookmark, self.pages);
            }
            self.pages += 1;
        }
        Ok(())
    }
}
