//! Where files lie in the world, in the words of GIS.
//!
//! All of a world lie on one plane: metres east and north of its origin, which is nowhere on the Earth. GIS calls that an
//! engineering reference system; what has the same one is laid over each other as it is.

/// The plane of a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plane {
    name: String,
}

impl Plane {
    /// The plane of the world of a preset and a seed.
    pub fn new(preset_name: &str, seed: u64) -> Plane {
        // GeoTIFF has names in ASCII, and parts them with a stroke; the name is to be the same in all files.
        let plain = |letter: char| match letter {
            '|' | '"' | '<' | '>' | '&' => '_',
            ' '..='~' => letter,
            _ => '_',
        };
        let preset_name: String = preset_name.chars().map(plain).collect();
        Plane { name: format!("terrane {preset_name}, seed {seed}") }
    }

    /// Its name, in ASCII.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its definition in well-known text, version 2 (ISO 19162).
    pub fn wkt2(&self) -> String {
        let name = &self.name;
        format!(
            "ENGCRS[\"{name}\",EDATUM[\"{name}\"],CS[Cartesian,2],AXIS[\"(E)\",east,ORDER[1],LENGTHUNIT[\"metre\",1]],\
             AXIS[\"(N)\",north,ORDER[2],LENGTHUNIT[\"metre\",1]]]"
        )
    }

    /// The same in version 1 (OGC 01-009), for what knows no other.
    pub fn wkt1(&self) -> String {
        let name = &self.name;
        format!(
            "LOCAL_CS[\"{name}\",LOCAL_DATUM[\"{name}\",32767],UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]"
        )
    }
}

/// Where the pixels of a raster lie, rows from north to south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Georeference {
    /// Metres east and north of the world's origin of the middle of the first pixel.
    pub first_m: [f64; 2],
    /// Metres from pixel to pixel.
    pub spacing_m: f64,
}

impl Georeference {
    /// A raster whose pixels are vertices, the first of them so many east and south of the origin.
    pub fn of_vertices([x, y]: [i64; 2], spacing_m: f64) -> Georeference {
        // Not the negative, which has a zero of its own.
        Georeference { first_m: [x as f64 * spacing_m, 0.0 - y as f64 * spacing_m], spacing_m }
    }

    /// The text of a world file: how large pixels are, and where the middle of the first one lies.
    pub fn world_file(&self) -> String {
        let Georeference { first_m: [east, north], spacing_m } = self;
        format!("{spacing_m}\n0\n0\n-{spacing_m}\n{east}\n{north}\n")
    }

    /// The north-western corner of the first pixel, from which GDAL counts.
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
