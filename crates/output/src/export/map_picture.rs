//! A map as a file: PNG or WebP with a world file by which GIS places it, PDF or SVG.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::area::Area;
use crate::error::Error;
use crate::export::Bytes;
use crate::export::folder::free_bytes;
use crate::export::georeference::Georeference;
use crate::export::limit::Limit;
use crate::export::pdf::Pdf;
use crate::export::svg::Svg;
use crate::file::{PartFile, make_folder, remove, write_whole};
use crate::map::Chart;
use crate::map::scale::Scale;
use crate::map::sheet::Sheet;
use crate::stop;
use crate::watch::Watch;

/// Pixels a side that a WebP picture can have.
const MOST_WEBP: usize = 16_383;

/// Bytes that a PNG takes beside its pixels, of each row and of all.
const ROW_BYTES: u64 = 64;
const HEAD_BYTES: u64 = 1 << 16;

/// Bytes of pixels that are packed at once.
const PACKED_AT_ONCE: usize = 1 << 20;

/// A map that is to be written.
#[derive(Debug)]
pub struct MapPicture {
    path: PathBuf,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Png,
    WebP,
    Pdf,
    Svg,
}

/// What a map says of itself in its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texts {
    /// The name of the map.
    pub title: String,
    /// How to draw it again.
    pub description: String,
    /// The program and its version.
    pub software: String,
}

impl MapPicture {
    /// A picture of so many pixels at a path, whose ending says how it is written.
    ///
    /// # Errors
    /// When the ending is none that is known, when there is a file already that may not be replaced, or when there is not
    /// enough room for the picture.
    pub fn new(path: &Path, (width, height): (usize, usize), overwrite: bool) -> Result<MapPicture, Error> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let kind = match ending.as_str() {
            "png" => Kind::Png,
            "webp" => Kind::WebP,
            "pdf" => Kind::Pdf,
            "svg" => Kind::Svg,
            _ => {
                return Err(Error::Option {
                    message: format!("{}: expected a name that ends with .png, .webp, .pdf or .svg", path.display()),
                    hint: "the ending says how the map is written".into(),
                });
            }
        };
        if kind == Kind::WebP && width.max(height) > MOST_WEBP {
            return Err(Error::Option {
                message: format!(
                    "a WebP picture has at most {MOST_WEBP} pixels a side, and this has {width} x {height}"
                ),
                hint: "write a .png, or fewer pixels".into(),
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
        let picture = MapPicture { path: path.to_path_buf(), kind };
        picture.check_room(width as u64, height as u64)?;
        Ok(picture)
    }

    /// Whether there is memory and disk for so many pixels.
    fn check_room(&self, width: u64, height: u64) -> Result<(), Error> {
        // Text of six bits a letter.
        let stretch = if self.kind == Kind::Svg { 4 } else { 3 };
        let disk_bytes = (width * stretch + ROW_BYTES) * height + HEAD_BYTES;
        let rows = if self.kind == Kind::Png { Chart::STRIP as u64 } else { height };
        // A strip and the blocks that it is made of; what the land remembers.
        let memory_bytes = width * rows * 8 + Chart::REMEMBERED as u64;
        let needs = format!(
            "a map of {width} x {height} pixels may take {} of memory and {} of disk",
            Bytes(memory_bytes),
            Bytes(disk_bytes)
        );
        let hint = "draw a smaller part, or at a smaller scale";
        if let Some(limit) = Limit::now(1).filter(|limit| limit.left_bytes < memory_bytes) {
            let left = Bytes(limit.left_bytes);
            return Err(Error::Option {
                message: format!("{needs}, and {left} are left by {}", limit.source),
                hint: hint.into(),
            });
        }
        match free_bytes(&self.path).filter(|free| *free < disk_bytes) {
            Some(free) => Err(Error::Option {
                message: format!("{needs}, and {} of disk are free", Bytes(free)),
                hint: hint.into(),
            }),
            None => Ok(()),
        }
    }

    /// Makes its folder ready, so that nothing is drawn in vain.
    ///
    /// # Errors
    /// When there can be no file.
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
        // A file that is begun and dropped shows that one can be written here.
        PartFile::create(self.path.clone()).map(drop).map_err(unwritable)
    }

    /// Writes a sheet, what it says of itself, and its world file. `watch` counts the rows of pixels that are drawn.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn write(&self, sheet: &Sheet<'_>, scale: Scale, texts: &Texts, watch: &Watch) -> Result<(), Error> {
        self.prepare()?;
        // Lines that are drawn as such need no world file: no GIS places these by one.
        let world_file = match self.kind {
            Kind::Png => self.path.with_extension("pgw"),
            Kind::WebP => self.path.with_extension("wpw"),
            Kind::Pdf => {
                let mut pdf = Pdf::create(self.path.clone())?;
                let mut page = pdf.page(0, sheet.page(), scale);
                sheet.plot(&mut page, watch)?;
                page.finish()?;
                return pdf.finish(&texts.title, &texts.description, &texts.software).map(drop);
            }
            Kind::Svg => {
                let (page, path) = (sheet.page(), self.path.clone());
                let mut svg = Svg::create(path, page, scale, &texts.title, &texts.description)?;
                sheet.plot(&mut svg, watch)?;
                return svg.finish().map(drop);
            }
        };
        let mut file = PartFile::create(self.path.clone())?;
        if self.kind == Kind::Png {
            self.write_png(&mut file, sheet, scale, texts, watch)?;
        } else {
            let area = sheet.page();
            let mut pixels = Vec::with_capacity(area.len() * 3);
            sheet.strips(|strip| {
                pixels.extend_from_slice(strip);
                count(strip, area, watch);
                Ok::<_, Error>(())
            })?;
            let (width, height) = (area.width() as u32, area.height() as u32);
            let encoded = stop::wait_for(move || {
                let mut bytes = Vec::new();
                let encoder = image_webp::WebPEncoder::new(&mut bytes);
                encoder.encode(&pixels, width, height, image_webp::ColorType::Rgb8).map(|()| bytes)
            });
            let bytes = encoded.map_err(|error| Error::io(&self.path)(std::io::Error::other(error)))?;
            file.write_all(&bytes).map_err(Error::io(&self.path))?;
        }
        // An old one would place the new picture wrongly, were this the end.
        remove(&world_file)?;
        file.finish()?;
        write_world_file(world_file, sheet.page(), scale)
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
        // To try all filters on each row takes a fifth of the time that a map takes.
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
        sheet.strips(|strip| {
            count(strip, area, watch);
            // A strip of a wide map takes long to pack.
            strip.chunks(PACKED_AT_ONCE).try_for_each(|part| {
                stop::check();
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

/// Says where a map lies.
fn write_world_file(path: PathBuf, page: Area, scale: Scale) -> Result<(), Error> {
    let spacing_m = scale.metres_per_pixel;
    let [east, south] = [page.x0, page.y0].map(|at| (at as f64 + 0.5) * spacing_m);
    let place = Georeference { first_m: [east, -south], spacing_m };
    write_whole(path, place.world_file().as_bytes()).map(drop)
}
