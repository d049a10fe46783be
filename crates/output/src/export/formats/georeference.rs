//! Georeferences: the position of files in the world, in the terms of GIS.
//!
//! All files of a world lie on one plane: metres east and north of the world's origin, which is nowhere on the Earth.
//! GIS calls such a plane an engineering coordinate reference system, and overlays files of the same one without a
//! transformation.

/// The plane of a world, as a coordinate reference system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plane {
    name: String,
}

impl Plane {
    /// Names the plane after the world's preset and seed.
    pub fn new(preset_name: &str, seed: u64) -> Plane {
        // GeoTIFF names are ASCII and are separated by `|`; the other characters have meanings in WKT or XML. The name
        // is the same in all files.
        let plain = |letter: char| match letter {
            '|' | '"' | '<' | '>' | '&' => '_',
            ' '..='~' => letter,
            _ => '_',
        };
        let preset_name: String = preset_name.chars().map(plain).collect();
        Plane { name: format!("terrane {preset_name}, seed {seed}") }
    }

    /// Name of the plane, in ASCII.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the plane's definition in well-known text, version 2 (ISO 19162).
    pub fn wkt2(&self) -> String {
        let name = &self.name;
        format!(
            "ENGCRS[\"{name}\",EDATUM[\"{name}\"],CS[Cartesian,2],AXIS[\"(E)\",east,ORDER[1],LENGTHUNIT[\"metre\",1]],\
             AXIS[\"(N)\",north,ORDER[2],LENGTHUNIT[\"metre\",1]]]"
        )
    }

    /// Returns the plane's definition in well-known text, version 1 (OGC 01-009), for programs that know no other.
    pub fn wkt1(&self) -> String {
        let name = &self.name;
        format!(
            "LOCAL_CS[\"{name}\",LOCAL_DATUM[\"{name}\",32767],UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]"
        )
    }
}

/// The position of a raster's pixels in the world; rows go from north to south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Georeference {
    /// Centre of the first pixel: metres east and north of the world's origin.
    pub first_m: [f64; 2],
    /// Metres from pixel to pixel.
    pub spacing_m: f64,
}

impl Georeference {
    /// Places a raster whose pixels are vertices: the first pixel is vertex `[x, y]`, counted east and south of the
    /// origin.
    pub fn of_vertices([x, y]: [i64; 2], spacing_m: f64) -> Georeference {
        // Not `-y`, which would make 0.0 a -0.0.
        Georeference { first_m: [x as f64 * spacing_m, 0.0 - y as f64 * spacing_m], spacing_m }
    }

    /// Returns the text of a world file: the size of pixels, and the centre of the first one.
    pub fn world_file(&self) -> String {
        let Georeference { first_m: [east, north], spacing_m } = self;
        format!("{spacing_m}\n0\n0\n-{spacing_m}\n{east}\n{north}\n")
    }

    /// Returns the north-western corner of the first pixel, which is GDAL's reference point.
    pub fn corner_m(&self) -> [f64; 2] {
        let [east, north] = self.first_m;
        [east - self.spacing_m / 2.0, north + self.spacing_m / 2.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_whatever_presets_are_called() {
        let plane = Plane::new("b\u{e4}r|\"a\"\n", 7);
        assert_eq!(plane.name(), "terrane b_r__a__, seed 7");
        assert_eq!(plane.wkt2().matches('"').count(), 12);
    }

    #[test]
    fn a_world_file_has_the_middle_of_the_first_pixel() {
        let raster = Georeference::of_vertices([0, -3], 2.5);
        assert_eq!(raster.world_file(), "2.5\n0\n0\n-2.5\n0\n7.5\n");
        assert_eq!(raster.corner_m(), [-1.25, 8.75]);
        assert_eq!(Georeference::of_vertices([-4, 0], 1.0).world_file(), "1\n0\n0\n-1\n-4\n0\n");
    }
}
