//! A map as a file: PDF or SVG, or PNG or WebP with two sidecar files that georeference it. A world file gives its
//! place, and an `.aux.xml` also its coordinate system.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::area::Area;
use crate::error::Error;
use crate::export::Bytes;
use crate::export::formats::georeference::{Georeference, Plane};
use crate::export::formats::pdf::{Pdf, user_unit};
use crate::export::formats::raster::auxiliary::auxiliary_of_map;
use crate::export::formats::raster::writer::MOST_PNG;
use crate::export::formats::svg::Svg;
use crate::export::plan::memory::told;
use crate::file::{PartFile, free_bytes, make_folder, remove, write_whole};
use crate::map::Chart;
use crate::map::plotter::Lettering;
use crate::map::scale::Scale;
use crate::map::sheet::Sheet;
use crate::watch::Watch;
use crate::world::World;

/// Hint for a map or an atlas that takes more memory or disk than there is.
pub const SMALLER: &str = "draw a smaller part, or at a smaller scale";

/// Largest width and height of a WebP picture in pixels.
const MOST_WEBP: usize = 16_383;

/// Bytes that a PNG takes besides its pixels: for each row, and for the whole file.
const ROW_BYTES: u64 = 64;
const HEAD_BYTES: u64 = 1 << 16;

/// Bytes of pixels that are compressed between two checks for a stop.
const PACKED_AT_ONCE: usize = 1 << 20;

/// A map that is to be written to a file.
#[derive(Debug)]
pub struct MapPicture {
    path: PathBuf,
    kind: MapFormat,
    lettering: Lettering,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum MapFormat {
    Png,
    WebP,
    Pdf,
    Svg,
}

/// Metadata of a map's file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texts {
    /// The name of the map.
    pub title: String,
    /// Description of the map, with the way to draw it again.
    pub description: String,
    /// The program and its version.
    pub software: String,
    /// The name of the preset and the seed of the world on the map.
    pub world: (String, u64),
}

impl MapPicture {
    /// Prepares a picture of the given pixel size at a path, whose ending chooses the format.
    ///
    /// # Errors
    /// When the ending is not known, when the picture is too large for the format, when a file exists and may not be
    /// replaced, or when the disk is too small for the picture.
    pub fn new(path: &Path, (width, height): (usize, usize), overwrite: bool) -> Result<MapPicture, Error> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let kind = match ending.as_str() {
            "png" => MapFormat::Png,
            "webp" => MapFormat::WebP,
            "pdf" => MapFormat::Pdf,
            "svg" => MapFormat::Svg,
            _ => {
                return Err(Error::Option {
                    message: format!("{}: expected a name that ends with .png, .webp, .pdf or .svg", path.display()),
                    hint: "the ending says how the map is written".into(),
                });
            }
        };
        let (most, called, instead) = match kind {
            MapFormat::Png => (MOST_PNG as usize, "PNG", ".pdf"),
            MapFormat::WebP => (MOST_WEBP, "WebP", ".png"),
            MapFormat::Pdf | MapFormat::Svg => (usize::MAX, "", ""),
        };
        if width.max(height) > most {
            return Err(Error::Option {
                message: format!(
                    "a {called} picture has at most {most} pixels a side, and this has {width} x {height}"
                ),
                hint: format!("write a {instead}, or fewer pixels"),
            });
        }
        let refuse =
            |message: String, hint: &str| Err(Error::Output { path: path.to_path_buf(), message, hint: hint.into() });
        if path.is_dir() {
            return refuse("is a folder".into(), "name a file with --out");
        }
        if path.exists() && !overwrite {
            return refuse("is there already".into(), "give --overwrite to replace it, or another --out");
        }
        let lettering = if kind == MapFormat::Svg { Lettering::Outlines } else { Lettering::Text };
        let picture = MapPicture { path: path.to_path_buf(), kind, lettering };
        picture.check_beside(overwrite)?;
        picture.check_room(width as u64, height as u64)?;
        Ok(picture)
    }

    /// Sets how letters are written. The default is text in PDF, whose readers all use embedded fonts, and outlines in
    /// SVG, of whose readers only browsers use them.
    ///
    /// # Errors
    /// When the picture is one of pixels.
    pub fn lettered(self, lettering: Lettering) -> Result<MapPicture, Error> {
        match self.kind {
            MapFormat::Pdf | MapFormat::Svg => Ok(MapPicture { lettering, ..self }),
            MapFormat::Png | MapFormat::WebP => Err(Error::Option {
                message: format!("{}: letters of a picture are pixels, neither text nor outlines", self.path.display()),
                hint: "leave out --text, or write a .pdf or .svg".into(),
            }),
        }
    }

    /// Returns warnings for users who look at a page of this size.
    pub fn warnings(&self, page: Area, scale: Scale) -> Vec<String> {
        let size_mm = [page.width(), page.height()].map(|pixels| pixels as f64 / scale.pixels_per_mm);
        if self.kind != MapFormat::Pdf || user_unit(size_mm) == 1.0 {
            return Vec::new();
        }
        let [width_m, height_m] = size_mm.map(|mm| mm / 1000.0);
        vec![format!(
            "the page of {width_m:.1} x {height_m:.1} m is larger than the 5.08 m that PDF counts in points: its unit is {} \
             points, and readers that do not know of units show it as much smaller",
            user_unit(size_mm)
        )]
    }

    /// Returns the path of the world file, by which GIS places a picture. PDF and SVG have none, since a world file
    /// places only pictures of pixels.
    fn world_file(&self) -> Option<PathBuf> {
        let letters = match self.kind {
            MapFormat::Png => "pgw",
            MapFormat::WebP => "wpw",
            MapFormat::Pdf | MapFormat::Svg => return None,
        };
        // The world file's ending is in capitals if the picture's is: in small letters it would belong to another
        // picture.
        let ending = self.path.extension().unwrap_or_default().to_string_lossy();
        let is_upper = ending.chars().all(|letter| letter.is_ascii_uppercase());
        Some(self.path.with_extension(if is_upper { letters.to_uppercase() } else { letters.to_owned() }))
    }

    /// Checks that the two sidecar files may be written, and that no other file differs from the picture or its world
    /// file in capitals alone: readers look for a world file in small letters and in capitals.
    fn check_beside(&self, overwrite: bool) -> Result<(), Error> {
        let Some(world_file) = self.world_file() else { return Ok(()) };
        let refuse = |path: PathBuf, message: &str, hint: &str| {
            Err(Error::Output { path, message: message.into(), hint: hint.into() })
        };
        for beside in [&world_file, &self.auxiliary()] {
            if beside.exists() && !overwrite {
                let hint = "give --overwrite to replace it, or another --out";
                return refuse(beside.clone(), "is there already, and a file of that name places this map", hint);
            }
        }
        let same_but_for_case = |own: &Path, other: &Path| {
            let ending = |path: &Path| path.extension().unwrap_or_default().to_ascii_lowercase();
            own.file_stem() == other.file_stem() && ending(own) == ending(other) && own.file_name() != other.file_name()
        };
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let other = entry.path();
            let is_beside = [&self.path, &world_file].into_iter().any(|own| same_but_for_case(own, &other));
            // On a file system that ignores capitals, the file found is the picture or its world file itself.
            let is_own = || {
                [&self.path, &world_file].into_iter().any(|own| own.canonicalize().ok() == other.canonicalize().ok())
            };
            if is_beside && !is_own() {
                let message =
                    "differs from this map, or from its world file, in capitals alone, and GIS takes one for the other";
                return refuse(other, message, "choose another name with --out");
            }
        }
        Ok(())
    }

    /// Returns the largest number of bytes of memory that a map of a world takes at a scale, with these pixels and
    /// threads.
    pub fn memory_bytes(&self, world: &World, scale: Scale, (width, height): (usize, usize), threads: usize) -> u64 {
        let rows = if matches!(self.kind, MapFormat::Png | MapFormat::Svg) { Chart::STRIP } else { height };
        let [working_bytes, remembered_bytes] = Chart::memory(world, scale, [width, height], rows, threads);
        told(threads, working_bytes, remembered_bytes)
    }

    /// Checks that the disk has room for these pixels.
    fn check_room(&self, width: u64, height: u64) -> Result<(), Error> {
        // SVG holds pixels in base64: four letters for the three bytes of a pixel.
        let stretch = if self.kind == MapFormat::Svg { 4 } else { 3 };
        let disk_bytes = (width * stretch + ROW_BYTES) * height + HEAD_BYTES;
        let needs = format!("a map of {width} x {height} pixels may take {} of disk", Bytes(disk_bytes));
        match free_bytes(&self.path).filter(|free| *free < disk_bytes) {
            Some(free) => Err(Error::Option {
                message: format!("{needs}, and {} of disk are free", Bytes(free)),
                hint: SMALLER.into(),
            }),
            None => Ok(()),
        }
    }

    /// Makes the folder of the file and checks that the file can be written, so that nothing is drawn in vain.
    ///
    /// # Errors
    /// When the folder or the file cannot be made.
    pub fn prepare(&self) -> Result<(), Error> {
        let unwritable = |error: Error| match error {
            Error::Io { source, .. } => Error::Output {
                path: self.path.clone(),
                message: format!("cannot be written: {source}"),
                hint: "choose another file with --out".into(),
            },
            other => other,
        };
        if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            make_folder(folder).map_err(unwritable)?;
        }
        // Begin a file and drop it, to see that files can be written here.
        PartFile::create(self.path.clone()).map(drop).map_err(unwritable)
    }

    /// Writes a sheet with its metadata, and the sidecar files of a picture. `watch` counts the rows of pixels that are
    /// drawn.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, sheet: &Sheet<'_>, scale: Scale, texts: &Texts, watch: &Watch) -> Result<(), Error> {
        self.prepare()?;
        match self.kind {
            MapFormat::Png | MapFormat::WebP => {}
            MapFormat::Pdf => {
                let mut pdf = Pdf::create(self.path.clone())?;
                let mut page = pdf.page(0, sheet.page(), scale, self.lettering);
                sheet.plot(&mut page, watch)?;
                page.finish()?;
                return pdf.finish(&texts.title, &texts.description, &texts.software).map(drop);
            }
            MapFormat::Svg => {
                let (page, path) = (sheet.page(), self.path.clone());
                let mut svg = Svg::create(path, page, scale, self.lettering, (&texts.title, &texts.description))?;
                sheet.plot(&mut svg, watch)?;
                return svg.finish().map(drop);
            }
        }
        let mut file = PartFile::create(self.path.clone())?;
        if self.kind == MapFormat::Png {
            self.write_png(&mut file, sheet, scale, texts, watch)?;
        } else {
            let area = sheet.page();
            let mut pixels = Vec::with_capacity(area.len() * 3);
            sheet.strips(&watch.clock, |strip| {
                pixels.extend_from_slice(strip);
                count(strip, area, watch);
                Ok::<_, Error>(())
            })?;
            let (width, height) = (area.width() as u32, area.height() as u32);
            let encoded = watch.clock.stop().wait_for(move || {
                let mut bytes = Vec::new();
                let encoder = image_webp::WebPEncoder::new(&mut bytes);
                encoder.encode(&pixels, width, height, image_webp::ColorType::Rgb8).map(|()| bytes)
            })?;
            let bytes = encoded.map_err(|error| Error::io(&self.path)(std::io::Error::other(error)))?;
            file.write_all(&bytes).map_err(Error::io(&self.path))?;
        }
        let world_file = self.world_file().expect("pictures of pixels have one");
        // Remove old sidecar files first: they would place the new picture wrongly if the program ended before it wrote
        // new ones.
        let auxiliary = self.auxiliary();
        remove(&world_file)?;
        remove(&auxiliary)?;
        file.finish()?;
        let place = place(sheet.page(), scale);
        let (preset_name, seed) = &texts.world;
        let text = auxiliary_of_map(&Plane::new(preset_name, *seed), place);
        write_whole(world_file, place.world_file().as_bytes())?;
        write_whole(auxiliary, text.as_bytes()).map(drop)
    }

    /// Returns the path of the `.aux.xml`, which tells GDAL the picture's place and coordinate system.
    fn auxiliary(&self) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(".aux.xml");
        name.into()
    }

    fn write_png(
        &self,
        file: &mut PartFile,
        sheet: &Sheet<'_>,
        scale: Scale,
        texts: &Texts,
        watch: &Watch,
    ) -> Result<(), Error> {
        let refuse = |error: png::EncodingError| Error::io(&self.path)(std::io::Error::other(error));
        let area = sheet.page();
        let mut encoder = png::Encoder::new(file, area.width() as u32, area.height() as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        // Trying all filters on each row would take a fifth of the time of a map.
        encoder.set_filter(png::Filter::Up);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let dots = (scale.pixels_per_mm * 1000.0).round() as u32;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: dots, yppu: dots, unit: png::Unit::Meter }));
        let texts = [("Title", &texts.title), ("Description", &texts.description), ("Software", &texts.software)];
        for (keyword, text) in texts {
            encoder.add_itxt_chunk(keyword.to_owned(), text.clone()).map_err(refuse)?;
        }
        let mut writer = encoder.write_header().map_err(refuse)?;
        let mut stream = writer.stream_writer().map_err(refuse)?;
        sheet.strips(&watch.clock, |strip| {
            count(strip, area, watch);
            // A strip of a wide map takes long to compress.
            strip.chunks(PACKED_AT_ONCE).try_for_each(|part| {
                watch.clock.check()?;
                stream.write_all(part).map_err(Error::io(&self.path))
            })
        })?;
        stream.finish().map_err(refuse)
    }
}

/// Counts the rows of a strip of pixels.
fn count(strip: &[u8], page: Area, watch: &Watch) {
    watch.add((strip.len() / (3 * page.width())) as u64);
}

/// Returns the place of a map in the world.
fn place(page: Area, scale: Scale) -> Georeference {
    let spacing_m = scale.metres_per_pixel;
    let [east, south] = [page.x0, page.y0].map(|at| (at as f64 + 0.5) * spacing_m);
    Georeference { first_m: [east, -south], spacing_m }
}
