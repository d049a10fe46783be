//! SVG: a page with lines as lines, text as text and the ground as a picture.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::area::Area;
use crate::error::Error;
use crate::export::raster::writer::{Sample, png_bytes};
use crate::file::{Finished, PartFile};
use crate::map::plotter::{Page, Pen, Plotter, Shape, bounds};
use crate::map::scale::Scale;
use crate::map::style::Colour;
use crate::map::text::{Face, Placed};

/// A page under way, whose text is written as it is made.
pub(crate) struct Svg {
    file: PartFile,
    text: String,
    area: Area,
    /// What is seen of it.
    clip: Option<Area>,
    picture: Option<(Area, Vec<u8>)>,
    /// What was refused, which shows at the end.
    refused: Option<Error>,
}

/// Bytes of text that are kept before they are written.
const KEPT: usize = 1 << 16;

impl Svg {
    /// Begins a page of an area of pixels that will be at `path`.
    ///
    /// # Errors
    /// When the file cannot be begun.
    pub fn create(path: PathBuf, area: Area, scale: Scale, title: &str, description: &str) -> Result<Svg, Error> {
        let file = PartFile::create(path)?;
        let (width, height) = (area.width(), area.height());
        let [width_mm, height_mm] = [width, height].map(|pixels| pixels as f64 / scale.pixels_per_mm);
        let text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
             width=\"{width_mm:.3}mm\" height=\"{height_mm:.3}mm\" viewBox=\"0 0 {width} {height}\">\n\
             <title>{}</title>\n<desc>{}</desc>\n\
             <g stroke-linejoin=\"round\" font-family=\"'Libertinus Serif', 'Linux Libertine', Georgia, serif\">\n",
            escaped(title),
            escaped(description)
        );
        Ok(Svg { file, text, area, clip: None, picture: None, refused: None })
    }

    /// Ends the page.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn finish(mut self) -> Result<Finished, Error> {
        self.text += "</g>\n</svg>\n";
        self.flush(0);
        self.refused.map_or_else(|| self.file.finish(), Err)
    }

    fn flush(&mut self, kept: usize) {
        if self.text.len() > kept && self.refused.is_none() {
            let written = self.file.write_all(self.text.as_bytes());
            self.refused = written.map_err(Error::io(self.file.path())).err();
            self.text.clear();
        }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [Short; 2] {
        [Short(x - self.area.x0 as f64), Short(y - self.area.y0 as f64)]
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.text.write_fmt(element).expect("memory takes everything");
        self.flush(KEPT);
    }

    /// The lines as the data of a path.
    fn path(&self, lines: &[Vec<[f64; 2]>]) -> String {
        let mut path = String::new();
        for line in lines {
            let closes = line.len() > 2 && line[0] == line[line.len() - 1];
            for (index, point) in line[..line.len() - usize::from(closes)].iter().enumerate() {
                let [x, y] = self.at(*point);
                let letter = if index == 0 { "M" } else { "L" };
                write!(path, "{letter}{x} {y}").expect("memory takes everything");
            }
            if closes {
                path.push('Z');
            }
        }
        path
    }

    /// A text whose letters stand each at its place, painted as `paint` says.
    fn letters(&mut self, text: &Placed, paint: &str) {
        if text.glyphs.is_empty() || !self.sees(bounds(text.boxes.iter().flatten())) {
            return;
        }
        // One place and turn a character: of those that one glyph stands for, the first has it.
        let mut places: [String; 3] = Default::default();
        let mut starts: Vec<(usize, [f64; 2], f64)> = Vec::new();
        for glyph in &text.glyphs {
            if starts.last().is_none_or(|last| last.0 != glyph.text.start) {
                starts.push((glyph.text.start, glyph.at, glyph.angle().to_degrees()));
            }
        }
        let [cos, sin] = text.glyphs[0].along;
        let is_straight = text.glyphs.iter().all(|glyph| glyph.along == [cos, sin]);
        let [x, y] = self.at(starts[0].1);
        let turn = if is_straight && starts[0].2 != 0.0 {
            format!(" transform=\"rotate({} {x} {y})\"", Short(starts[0].2))
        } else {
            String::new()
        };
        if is_straight {
            for (_, at, _) in &starts {
                let from = starts[0].1;
                let along = (at[0] - from[0]) * cos + (at[1] - from[1]) * sin;
                write!(places[0], "{} ", Short(x.0 + along)).expect("memory takes everything");
            }
            places[1] = y.to_string();
        } else {
            for (_, at, degrees) in &starts {
                let [x, y] = self.at(*at);
                for (place, value) in places.iter_mut().zip([x, y, Short(*degrees)]) {
                    write!(place, "{value} ").expect("memory takes everything");
                }
            }
        }
        let rotate = if is_straight { String::new() } else { format!(" rotate=\"{}\"", places[2].trim_end()) };
        let weight = match text.face {
            Face::Regular | Face::Italic => "",
            Face::Semibold | Face::SemiboldItalic => " font-weight=\"600\"",
            Face::Bold | Face::BoldItalic => " font-weight=\"700\"",
        };
        let style = match text.face {
            Face::Italic | Face::SemiboldItalic | Face::BoldItalic => " font-style=\"italic\"",
            Face::Regular | Face::Semibold | Face::Bold => "",
        };
        self.add(format_args!(
            "<text x=\"{}\" y=\"{}\"{rotate}{turn} font-size=\"{}\"{weight}{style} {paint}>{}</text>\n",
            places[0].trim_end(),
            places[1].trim_end(),
            Short(text.size_px),
            escaped(&text.text)
        ));
    }
}

/// A number with two digits behind the point at most.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.2}", self.0);
        let text = text.trim_end_matches('0').trim_end_matches('.');
        f.write_str(if text == "-0" { "0" } else { text })
    }
}

/// A text with what XML means something by written otherwise.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Plotter for Svg {
    fn area(&self) -> Area {
        self.clip.unwrap_or(self.area)
    }

    fn fill(&mut self, shape: &Shape, colour: Colour) {
        if self.sees(shape.bounds) {
            let path = self.path(&shape.lines);
            self.add(format_args!("<path fill=\"{colour}\" fill-rule=\"evenodd\" d=\"{path}\"/>\n"));
        }
    }

    fn stroke(&mut self, lines: &[Vec<[f64; 2]>], pen: &Pen) {
        if pen.width <= 0.0 {
            return;
        }
        let path = self.path(lines);
        let opacity = if pen.opacity < 1.0 {
            format!(" stroke-opacity=\"{}\"", Short(f64::from(pen.opacity)))
        } else {
            String::new()
        };
        let ends = match pen.dash {
            Some([on, off]) => format!(" stroke-dasharray=\"{} {}\"", Short(f64::from(on)), Short(f64::from(off))),
            None => " stroke-linecap=\"round\"".to_owned(),
        };
        let (colour, width) = (pen.colour, Short(f64::from(pen.width)));
        self.add(format_args!(
            "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"{opacity}{ends} d=\"{path}\"/>\n"
        ));
    }

    fn write(&mut self, text: &Placed, colour: Colour) {
        self.letters(text, &format!("fill=\"{colour}\""));
    }

    fn surround(&mut self, text: &Placed, pen: &Pen) {
        if pen.width > 0.0 {
            let (colour, width, opacity) = (pen.colour, Short(f64::from(pen.width)), Short(f64::from(pen.opacity)));
            let paint = format!(
                "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" aria-hidden=\"true\""
            );
            self.letters(text, &paint);
        }
    }

    fn dot(&mut self, at: [f64; 2], radius: f64, colour: Colour) {
        let [x, y] = self.at(at);
        self.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" fill=\"{colour}\"/>\n", Short(radius)));
    }
}

impl Page for Svg {
    fn clip(&mut self, part: Area) {
        self.clip = Some(part);
        let [x, y] = self.at([part.x0 as f64, part.y0 as f64]);
        let (width, height) = (part.width(), part.height());
        self.add(format_args!(
            "<clipPath id=\"map\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>\n\
             <g clip-path=\"url(#map)\">\n"
        ));
        self.picture = Some((part, Vec::with_capacity(part.len() * 3)));
    }

    fn add_rows(&mut self, pixels: &[u8]) -> Result<(), Error> {
        let (_, rows) = self.picture.as_mut().expect("a picture was begun");
        rows.extend_from_slice(pixels);
        Ok(())
    }

    fn end_picture(&mut self) -> Result<(), Error> {
        let (part, pixels) = self.picture.take().expect("a picture was begun");
        let [x, y] = self.at([part.x0 as f64, part.y0 as f64]);
        let png = png_bytes(Sample::Rgb8, (part.width() as u32, part.height() as u32), true, &pixels);
        let data = STANDARD.encode(png);
        self.add(format_args!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{}\" height=\"{}\" xlink:href=\"data:image/png;base64,{data}\"/>\n",
            part.width(),
            part.height()
        ));
        Ok(())
    }

    fn open(&mut self) {
        self.clip = None;
        self.add(format_args!("</g>\n"));
    }
}
