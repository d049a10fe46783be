//! Maps of a made-up land, tested from outside.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;

use rusqlite::Connection;

use super::*;

/// Fractal value noise around zero, with an amplitude of about one.
fn noise(x: f64, y: f64) -> f64 {
    let corner = |x: i64, y: i64| {
        let mixed = (x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B)).wrapping_mul(0x2545_F491_4F6C_DD1D);
        ((mixed ^ (mixed >> 29)) & 0xFFFF) as f64 / 32_768.0 - 1.0
    };
    let octave = |x: f64, y: f64| {
        let (column, row) = (x.floor(), y.floor());
        let smooth = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        let (u, v) = (smooth(x - column), smooth(y - row));
        let at = |dx, dy| corner(column as i64 + dx, row as i64 + dy);
        let (north, south) = (at(0, 0) * (1.0 - u) + at(1, 0) * u, at(0, 1) * (1.0 - u) + at(1, 1) * u);
        north * (1.0 - v) + south * v
    };
    (0..6).map(|level| octave(x * f64::from(1 << level), y * f64::from(1 << level)) / 1.9_f64.powi(level)).sum()
}

/// Height of the land: hills, and a sea below 0 m.
fn height_m(east_m: f64, south_m: f64) -> f32 {
    (noise(east_m / 13_000.0 + 0.3, south_m / 13_000.0 + 0.6) * 1100.0 + 350.0) as f32
}

/// Calls `pixel` for the centre of each pixel, with metres east and south.
fn each_pixel<T>(view: &View, pixel: impl Fn(f64, f64) -> T) -> Vec<T> {
    let middle = |at: i64| (at as f64 + 0.5) * view.pixel_m;
    view.pixels.vertices().map(|(x, y)| pixel(middle(x), middle(y))).collect()
}

fn heights(view: &View) -> Vec<f32> {
    each_pixel(view, height_m)
}

/// Brightness under light from the north-west, 0 to 1.
fn shade(view: &View, east_m: f64, south_m: f64) -> f32 {
    let here = height_m(east_m, south_m).max(0.0);
    let east = height_m(east_m + view.pixel_m, south_m).max(0.0) - here;
    let south = height_m(east_m, south_m + view.pixel_m).max(0.0) - here;
    let (east, south) = (east / view.pixel_m as f32 * 3.0, south / view.pixel_m as f32 * 3.0);
    ((east + south + 1.4) / (2.0 * (1.0 + east * east + south * south).sqrt())).clamp(0.0, 1.0)
}

fn map(view: &View) -> Vec<u8> {
    const TINTS: [(f32, [f32; 3]); 6] = [
        (-1500.0, [112.0, 152.0, 190.0]),
        (-1.0, [178.0, 208.0, 226.0]),
        (0.0, [186.0, 208.0, 160.0]),
        (500.0, [228.0, 222.0, 180.0]),
        (1200.0, [206.0, 178.0, 146.0]),
        (1900.0, [250.0, 250.0, 250.0]),
    ];
    let colour = |east_m: f64, south_m: f64| {
        let height_m = height_m(east_m, south_m).clamp(-1499.0, 1899.0);
        let upper = TINTS.iter().position(|(from, _)| height_m < *from).unwrap();
        let ((low, dark), (high, light)) = (TINTS[upper - 1], TINTS[upper]);
        let t = (height_m - low) / (high - low);
        let shade = 0.45 + 0.75 * shade(view, east_m, south_m);
        [0, 1, 2].map(|channel| ((dark[channel] * (1.0 - t) + light[channel] * t) * shade).min(255.0) as u8)
    };
    each_pixel(view, colour).concat()
}

fn hillshade(view: &View) -> Vec<u8> {
    each_pixel(view, |east_m, south_m| [(60.0 + 195.0 * shade(view, east_m, south_m)) as u8; 3]).concat()
}

const FEATURES: [Feature; 8] = [
    feature("Sarnbruck", "town", -2_000.0, 3_500.0, 1),
    feature("Öberfurt", "village", 9_000.0, 7_200.0, 3),
    feature("Unterfurt", "village", 9_900.0, 5_100.0, 3),
    feature("Grauhorn", "peak", -12_000.0, 9_000.0, 2),
    feature("Lange Welle", "river", 4_000.0, -6_000.0, 4),
    feature("Steinfurt", "town", -16_000.0, -8_000.0, 1),
    feature("", "peak", 0.0, 0.0, 0),
    feature("Furtsee", "lake", 15_500.0, -9_500.0, 2),
];

const fn feature(name: &'static str, kind: &'static str, east_m: f64, north_m: f64, rank: u8) -> Feature<'static> {
    Feature { name, kind, east_m, north_m, rank }
}

const ALL: Choice = Choice { encoding: TileEncoding::WebP, dense: true, folder: true, mbtiles: true, pmtiles: true };

/// Writes the made-up land between `[west, south, east, north]`.
fn written(folder: &Path, bounds_m: [f64; 4], finest_m: f64, choice: Choice) -> (Pyramid, Written) {
    let [west_m, south_m, east_m, north_m] = bounds_m;
    let pyramid = Pyramid::new(Bounds { west_m, south_m, east_m, north_m }, finest_m).unwrap();
    let meta = Meta {
        name: "Made-up <land>".into(),
        description: "Value noise, six octaves".into(),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    let layers = [
        WebLayer { name: "map", title: "Map", paint: &|view| Ok(map(view)) },
        WebLayer { name: "hillshade", title: "Relief", paint: &|view| Ok(hillshade(view)) },
    ];
    let content = MapContent {
        prepare: &|_| Ok(()),
        layers: &layers,
        heights: Some(&|view| Ok(heights(view))),
        features: &FEATURES,
    };
    let written = write(folder, &pyramid, &meta, choice, &content, &Watch::default()).unwrap();
    (pyramid, written)
}

/// Returns all files below a folder with their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn add(top: &Path, folder: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                add(top, &path, found);
            } else {
                let name = path.strip_prefix(top).unwrap().to_str().unwrap().replace('\\', "/");
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    add(folder, folder, &mut found);
    found
}

fn decoded(webp: &[u8]) -> Vec<u8> {
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(webp)).unwrap();
    let mut rgb = vec![0; decoder.output_buffer_size().unwrap()];
    decoder.read_image(&mut rgb).unwrap();
    rgb
}

#[test]
fn tiles_are_the_pixels_that_their_places_say() {
    let folder = tempfile::tempdir().unwrap();
    let (pyramid, written) = written(folder.path(), [-3000.0, -2000.0, 2500.0, 3100.0], 10.0, ALL);
    let files = files(folder.path());
    assert_eq!((pyramid.zooms(), pyramid.tiles()), (12..=14, 4 + 4 + 12));
    // Two layers at two scales, and terrain; the heights; five archives in two formats; the list; and the page with two
    // scripts.
    assert_eq!((written.pictures, files.len()), (5 * 20, 6 * 20 + 5 * 2 + 4));
    assert_eq!(written.files.len(), 5 * 2 + 4);
    let listed: Vec<(&str, &str)> =
        str::from_utf8(&files[LISTING]).unwrap().lines().map(|line| line.split_once("  ").unwrap()).collect();
    assert_eq!(listed.len(), 6 * 20);
    assert!(listed.iter().all(|(hash, name)| blake3::hash(&files[*name]).to_hex().as_str() == *hash));
    let page = str::from_utf8(&files["index.html"]).unwrap();
    assert!(page.contains("const terrane = ") && page.matches("</script>").count() == 3, "the page has its program");
    for zoom in pyramid.zooms() {
        for (x, y) in pyramid.places(zoom).vertices() {
            let pixels = pyramid.world_pixels(zoom, Area::new(x, y, 1, 1));
            let view = View { zoom, scale: 1, pixel_m: pyramid.pixel_m(zoom), pixels };
            let tile = |layer: &str, mark: &str| decoded(&files[&format!("{layer}/{zoom}/{x}/{y}{mark}.webp")]);
            let colours: Vec<u8> = heights(&view).into_iter().flat_map(terrain_rgb).collect();
            assert!(tile("terrain", "") == colours, "{zoom}/{x}/{y}");
            let twice = [pixels.x0, pixels.y0, pixels.x1, pixels.y1].map(|edge| 2 * edge);
            let pixels = Area { x0: twice[0], y0: twice[1], x1: twice[2], y1: twice[3] };
            let view = View { zoom, scale: 2, pixel_m: pyramid.pixel_m(zoom) / 2.0, pixels };
            assert!(tile("hillshade", "@2x") == hillshade(&view), "{zoom}/{x}/{y}");
            // A pixel of the other scale is the mean of four of these.
            let (dense, width) = (map(&view), view.pixels.width());
            for (index, pixel) in tile("map", "").chunks_exact(3).enumerate() {
                let (x, y) = (index % (width / 2) * 2, index / (width / 2) * 2);
                let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| &dense[3 * (y * width + x)..]);
                let mean = [0, 1, 2].map(|channel| (four.map(|of| u32::from(of[channel])).iter().sum::<u32>() + 2) / 4);
                assert!(pixel.iter().map(|channel| u32::from(*channel)).eq(mean), "{zoom}/{x}/{y}");
            }
        }
    }
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let map = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bounds_m = [1e7, -2e6, 1e7 + 5000.0, -2e6 + 2500.0];
        let (_, written) = pool.install(|| written(folder.path(), bounds_m, 8.0, Choice { dense: false, ..ALL }));
        (files(folder.path()), written)
    };
    let one = map(1);
    assert!(map(3) == one);
}

#[test]
fn archives_hold_what_the_folder_holds() {
    let folder = tempfile::tempdir().unwrap();
    let (pyramid, _) = written(folder.path(), [-9000.0, -9000.0, 9000.0, 9000.0], 30.0, Choice { dense: false, ..ALL });
    let files = files(folder.path());
    let database = Connection::open(folder.path().join("map.mbtiles")).unwrap();
    let mut tiles = database.prepare("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles").unwrap();
    let tiles = tiles.query_map((), |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))).unwrap();
    let tiles: Vec<(u8, u32, u32, Vec<u8>)> = tiles.map(Result::unwrap).collect();
    assert_eq!(tiles.len() as u64, pyramid.tiles());
    for (zoom, x, row, bytes) in tiles {
        let y = (1 << zoom) - 1 - row;
        assert!(bytes == files[&format!("map/{zoom}/{x}/{y}.webp")], "{zoom}/{x}/{y}");
    }
    let archive = &files["map.pmtiles"];
    assert_eq!(archive[..8], *b"PMTiles\x03");
    let number = |at: usize| u64::from_le_bytes(archive[at..at + 8].try_into().unwrap());
    let (addressed, clustered) = (number(72), archive[96]);
    assert_eq!((addressed, clustered), (pyramid.tiles(), 1));
    // Tiles follow one another in the order in which they were drawn.
    let data = &archive[number(56) as usize..][..number(64) as usize];
    let drawn = pyramid.zooms().flat_map(|zoom| pyramid.blocks(zoom)).flat_map(|block| block.tiles());
    let drawn: Vec<u8> =
        drawn.flat_map(|at| &files[&format!("map/{}/{}/{}.webp", at.zoom, at.x, at.y)]).copied().collect();
    assert!(data == drawn);
}

#[test]
fn dense_tiles_of_mbtiles_are_cut_into_those_of_the_next_zoom() {
    let folder = tempfile::tempdir().unwrap();
    let (pyramid, _) = written(folder.path(), [-3000.0, -2000.0, 2500.0, 3100.0], 20.0, ALL);
    let files = files(folder.path());
    let database = Connection::open(folder.path().join("map@2x.mbtiles")).unwrap();
    let told = |name: &str| {
        let query = "SELECT value FROM metadata WHERE name = ?";
        database.query_row(query, [name], |row| row.get::<_, String>(0)).unwrap()
    };
    assert_eq!(
        [told("minzoom"), told("maxzoom")],
        [pyramid.min_zoom() + 1, pyramid.max_zoom() + 1].map(|zoom| zoom.to_string())
    );
    let ground: serde_json::Value = serde_json::from_str(&told("json")).unwrap();
    let ground = &ground["terrane"];
    let finest_m = pyramid.pixel_m(pyramid.max_zoom()) / 2.0;
    assert_eq!((&ground["tile_px"], &ground["finest_m"]), (&256.into(), &finest_m.into()));
    let mut tiles = database.prepare("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles").unwrap();
    let tiles = tiles.query_map((), |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))).unwrap();
    let tiles: Vec<(u8, u32, u32, Vec<u8>)> = tiles.map(Result::unwrap).collect();
    assert_eq!(tiles.len() as u64, 4 * pyramid.tiles());
    for (zoom, x, row, bytes) in tiles {
        let y = (1 << zoom) - 1 - row;
        let dense = decoded(&files[&format!("map/{}/{}/{}@2x.webp", zoom - 1, x / 2, y / 2)]);
        let [left, top] = [x, y].map(|at| at as usize % 2 * 256);
        let quarter = (top..top + 256).flat_map(|line| &dense[3 * (line * 512 + left)..][..3 * 256]);
        assert!(quarter.eq(&decoded(&bytes)), "{zoom}/{x}/{y}");
    }
}

#[test]
fn equal_tiles_are_stored_once() {
    let folder = tempfile::tempdir().unwrap();
    let pyramid = Pyramid::new(Bounds { west_m: 0.0, south_m: 0.0, east_m: 4096.0, north_m: 4096.0 }, 1.0).unwrap();
    let meta = Meta { name: String::new(), description: String::new(), version: String::new() };
    let layers = [WebLayer { name: "sea", title: "Sea", paint: &|view| Ok([9, 99, 199].repeat(view.pixels.len())) }];
    let content = MapContent { prepare: &|_| Ok(()), layers: &layers, heights: None, features: &[] };
    let choice = Choice { folder: false, dense: false, encoding: TileEncoding::Png, ..ALL };
    write(folder.path(), &pyramid, &meta, choice, &content, &Watch::default()).unwrap();
    let database = Connection::open(folder.path().join("sea.mbtiles")).unwrap();
    let count =
        |table: &str| database.query_row(&format!("SELECT count(*) FROM {table}"), (), |row| row.get::<_, i64>(0));
    assert_eq!((count("tiles").unwrap(), count("images").unwrap()), (pyramid.tiles() as i64, 1));
    let archive = fs::read(folder.path().join("sea.pmtiles")).unwrap();
    let number = |at: usize| u64::from_le_bytes(archive[at..at + 8].try_into().unwrap());
    assert_eq!([72, 88].map(number), [pyramid.tiles(), 1]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "no folder was asked for");
}

#[test]
fn a_map_that_fails_has_no_page_and_no_archive() {
    let folder = tempfile::tempdir().unwrap();
    let choice = Choice { dense: false, ..ALL };
    let (pyramid, _) = written(folder.path(), [0.0, 0.0, 3000.0, 3000.0], 10.0, choice);
    let meta = Meta { name: String::new(), description: String::new(), version: String::new() };
    let paint = |view: &View| if view.zoom < pyramid.max_zoom() { Ok(map(view)) } else { Err(Error::Interrupted) };
    let layers = [WebLayer { name: "other", title: "Other", paint: &paint }];
    let content = MapContent { prepare: &|_| Ok(()), layers: &layers, heights: None, features: &[] };
    let failed = write(folder.path(), &pyramid, &meta, choice, &content, &Watch::default()).unwrap_err();
    assert!(matches!(failed, Error::Interrupted));
    let files = files(folder.path());
    assert!(!files.contains_key("index.html") && files.contains_key("map.js"), "the page of the map before is gone");
    assert!(!files.keys().any(|name| name.starts_with("other.") || name.contains(".part")), "{:?}", files.keys());
}
