//! Rasters and maps of climate, rock and uplift: what the geography says of each place, and refused where there is none.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::LazyLock;

use terrane::area::{Area, Region, Stride, TileId};
use terrane::clock::Clock;
use terrane::export::{Export, Mode, Output, Plan};
use terrane::geography::biome::Biome;
use terrane::geography::climate::PlaceClimate;
use terrane::geography::lithology::Lithology;
use terrane::grain_point::{GRAINS, Point};
use terrane::land::WaterKind;
use terrane::map::Chart;
use terrane::map::scale::Scale;
use terrane::map::style::Style;
use terrane::preset::Preset;
use terrane::recipe::source::RecipeSources;
use terrane::tile::{Grows, Growth, Instance, Tile, TileView, instances};
use terrane::watch::Watch;
use terrane::world::World;

/// A whole world with small tiles.
fn whole() -> &'static World {
    static WORLD: LazyLock<World> = LazyLock::new(|| {
        let (_, mut preset) = Preset::load("world").unwrap();
        (preset.tile_cells, preset.places) = (64, None);
        World::new(preset, None).unwrap()
    });
    &WORLD
}

/// Returns the tile of a coast: the first from the origin to the east with both land and sea.
fn coast() -> TileId {
    static COAST: LazyLock<TileId> = LazyLock::new(|| {
        let fields = whole().relief().fluvial().unwrap().fields();
        // In tiles: first 20 km, then a tile at a time.
        let is_land = |x: i64| fields.inland_m(Point::at_vertex(x * 64, 32)) > 0.0;
        let far = (1..100_000).find(|n| is_land(n * 32) != is_land(0)).unwrap() * 32;
        let near = (far - 32..=far).find(|x| is_land(*x) != is_land(0)).unwrap();
        let both = |id: &TileId| {
            let tile = Tile::new(whole(), *id);
            let view = TileView::new(&tile, whole());
            let seas = tile.area().vertices().filter(|(x, y)| view.lake_or_sea(*x, *y) == WaterKind::Sea).count();
            (200..tile.area().len() - 200).contains(&seas)
        };
        let around = (0..40).flat_map(|n| [near + n, near - n]).map(|x| TileId { x, y: 0 });
        around.into_iter().find(both).expect("the shore is near that of the lowstand")
    });
    *COAST
}

#[test]
fn neighbours_agree_on_climate_and_uplift() {
    let world = whole();
    for at in [TileId { x: -1, y: -1 }, TileId { x: 1_000_000_000, y: -1_000_000_000 }] {
        let row = |id: TileId, y: i64| {
            let tile = Tile::new(world, id);
            let view = TileView::new(&tile, world);
            let Area { x0, .. } = tile.area();
            let row = Area::new(x0, y, 65, 1);
            let numbers = view.climates(row).into_iter().zip(view.uplifts(row));
            numbers.map(|((climate, height_m), uplift)| (climate, height_m.to_bits(), uplift)).collect::<Vec<_>>()
        };
        let y = at.y * 64;
        let (here, east, north) =
            (row(at, y), row(TileId { x: at.x + 1, ..at }, y), row(TileId { y: at.y - 1, ..at }, y));
        assert_eq!(here, north);
        assert_eq!(here[64], east[0]);
    }
}

#[test]
fn the_rasters_hold_the_climate_and_the_uplift_of_each_vertex() {
    let (world, id) = (whole(), coast());
    let folder = tempfile::tempdir().unwrap();
    let region = Region::new(id, 1, 1, world.tile_cells()).unwrap();
    let exports = "climate,climate-tiles,climate-geotiff,rock,rock-geotiff,uplift,uplift-geotiff";
    let plan = Plan::new(world, "world", region, Export::parse_list(exports).unwrap()).unwrap();
    let cost = plan.cost(2);
    plan.run(&Output::prepare(folder.path(), Mode::New, &plan, &cost).unwrap(), &Watch::default()).unwrap();
    let [temperatures, rains, seasons, dips, uplifts] =
        ["climate/temperature.png", "climate/rain.png", "climate/season.png", "rock/dip.png", "uplift/uplift.png"]
            .map(|name| samples(&folder.path().join(name), png::ColorType::Grayscale).0);
    let (biomes, palette) = samples(&folder.path().join("climate/biome.png"), png::ColorType::Indexed);
    assert_eq!(samples(&folder.path().join("climate/biome_x0_y0.png"), png::ColorType::Indexed).0, biomes);
    let (rocks, rock_colours) = samples(&folder.path().join("rock/rock.png"), png::ColorType::Indexed);
    let tile = Tile::new(world, id);
    let view = TileView::new(&tile, world);
    let mut seas = 0;
    for (index, (x, y)) in tile.area().vertices().enumerate() {
        let (geography, place) = (world.geography().unwrap(), Point::at_vertex(x, y));
        let setting = geography.settings_at(&[place])[0];
        let height_m = f64::from(tile.heights().at(x, y)).max(0.0);
        let near =
            |grey: u8, value: f64| assert!((f64::from(grey) - value).abs() < 0.51, "{grey} at {x}, {y}: {value}");
        near(temperatures[index], 128.0 + 2.0 * setting.climate.temperature_c(height_m));
        near(rains[index], setting.climate.rain_mm_a_year() / 20.0);
        near(seasons[index], setting.climate.summer_share() * 255.0);
        near(dips[index], geography.beds_lie(place, &setting.land).dip_deg / 90.0 * 255.0);
        near(uplifts[index], setting.land.uplift * 255.0);
        let number = usize::from(biomes[index]);
        if view.lake_or_sea(x, y) == WaterKind::Sea {
            assert_eq!((number, rocks[index]), (0, 0));
            seas += 1;
            continue;
        }
        let biome = setting.climate.biome(height_m);
        assert_eq!(Biome::all().nth(number - 1), Some(biome));
        assert_eq!(palette[3 * number..][..3], biome.colour());
        let rock = Lithology::of(&setting);
        assert_eq!(Lithology::all().nth(usize::from(rocks[index]) - 1), Some(rock));
        assert_eq!(rock_colours[3 * usize::from(rocks[index])..][..3], rock.colour());
    }
    assert!(seas > 0 && seas < tile.area().len(), "{seas} vertices of sea");
    let auxiliary = std::fs::read_to_string(folder.path().join("climate/biome.png.aux.xml")).unwrap();
    assert!(auxiliary.contains("<Category>sea</Category>") && auxiliary.contains("<Category>Cfb oceanic forest"));
}

#[test]
fn a_world_without_a_geography_has_no_climate() {
    let world = World::new(Preset::load("alps").unwrap().1, None).unwrap();
    let region = Region::new(TileId { x: 0, y: 0 }, 1, 1, world.tile_cells()).unwrap();
    for name in ["climate", "climate-tiles", "rock-geotiff", "uplift"] {
        let error = Plan::new(&world, "alps", region, Export::parse_list(name).unwrap()).err().unwrap();
        assert_eq!(error.exit_code(), 2);
        let said = format!("{error}; {}", error.hint().unwrap());
        assert!([name, "no geography", "[geography]", "world", "height"].iter().all(|it| said.contains(it)), "{said}");
        let others = said.split_once("exports for this one").unwrap().1;
        assert!(!others.contains("climate"), "{others}");
    }
}

/// Returns the samples of an 8-bit PNG with one channel of that kind, and its palette, which may be empty.
fn samples(path: &Path, kind: png::ColorType) -> (Vec<u8>, Vec<u8>) {
    let mut decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().unwrap();
    let mut samples = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut samples).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (kind, png::BitDepth::Eight));
    let palette = reader.info().palette.as_deref().map_or(Vec::new(), <[u8]>::to_vec);
    (samples, palette)
}

/// Checks that a map in a style has the colour of each pixel's class, and more than one class.
fn has_the_colours_of<Class: Ord + Debug>(
    style: &str,
    class: impl Fn(Point, f64) -> Class,
    colour: fn(&Class) -> [u8; 3],
) {
    let (_, preset) = Preset::load("world").unwrap();
    // Without light, so that the colours are bare.
    let text = format!(
        "extends = \"{style}\"\n[relief]\nstrength = 0\nhighlight = 0\ntexture = 0\n[water]\ndraw = false\n\
         [labels]\ndraw = false\n[places]\ndraw = false"
    );
    let style = RecipeSources::<Style>::parse("bare.toml", &text).unwrap().read_all().unwrap();
    let scale = Scale { metres_per_pixel: 2000.0, pixels_per_mm: 4.0 };
    let chart = Chart::new(&preset, None, style, scale).unwrap();
    // The ranges along a coast west of the origin.
    let area = Area::new(-1620, -440, 120, 80);
    let clock = Clock::default();
    let pixels = chart.picture(area, &clock).unwrap().pixels(area, &clock).unwrap();
    let heights = chart.heights_m(area, &clock).unwrap();
    let (mut seen, mut others) = (BTreeMap::new(), 0);
    for (index, (x, y)) in area.vertices().enumerate().filter(|(index, _)| heights[*index] > 100.0) {
        let [x, y] = [x, y].map(|pixel| (pixel * 200 + 100) * GRAINS);
        let class = class(Point { x, y }, f64::from(heights[index]));
        let drawn = &pixels[3 * index..][..3];
        let off = drawn.iter().zip(colour(&class)).map(|(drawn, own)| drawn.abs_diff(own)).max().unwrap();
        *seen.entry(class).or_insert(0) += 1;
        others += usize::from(off > 1);
    }
    // At borders of classes the height in the middle of a pixel may be another than that of the land around.
    let all: usize = seen.values().sum();
    assert!(
        seen.len() > 1 && all > 1000 && others * 20 < all,
        "{others} of {all} pixels have others' colours: {seen:?}"
    );
}

#[test]
fn a_map_in_the_style_climate_has_the_colours_of_the_biomes() {
    let geography = whole().geography().unwrap();
    has_the_colours_of("climate", |at, height_m| geography.climates(&[at])[0].biome(height_m), |biome| biome.colour());
}

#[test]
fn a_map_in_the_style_geology_has_the_colours_of_the_rocks() {
    let geography = whole().geography().unwrap();
    has_the_colours_of("geology", |at, _| Lithology::of(&geography.settings_at(&[at])[0]), |rock| rock.colour());
}

#[test]
fn a_world_without_a_geography_has_no_map_of_its_climate_or_rock() {
    let scale = Scale { metres_per_pixel: 100.0, pixels_per_mm: 4.0 };
    for style in ["climate", "geology"] {
        let alps = Preset::load("alps").unwrap().1;
        let error = Chart::new(&alps, None, Style::load(style).unwrap(), scale).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.hint().unwrap().contains("world"), "{error}");
    }
}

#[test]
fn salt_pans_are_white_on_maps() {
    let (_, preset) = Preset::load("world").unwrap();
    let text = "extends = \"topographic\"\n[labels]\ndraw = false\n[places]\ndraw = false\n[contours]\ndraw = false";
    let style = RecipeSources::<Style>::parse("bare.toml", text).unwrap().read_all().unwrap();
    let colours = [style.water.pan, style.water.fill].map(|colour| colour.0);
    let scale = Scale { metres_per_pixel: 100.0, pixels_per_mm: 4.0 };
    let chart = Chart::new(&Preset { places: None, ..preset }, None, style, scale).unwrap();
    // A pan in a desert, 54 km2 large.
    let (area, clock) = (Area::new(18_330, 23_820, 48, 48), Clock::default());
    let pixels = chart.picture(area, &clock).unwrap().pixels(area, &clock).unwrap();
    let [pan, lake] = colours.map(|colour| pixels.chunks_exact(3).filter(|pixel| **pixel == colour).count());
    assert!(pan > 500 && lake == 0, "{pan} pixels of a pan and {lake} of a lake");
}

/// Lowlands are green where it is moist, and tan in deserts.
#[test]
fn lowlands_of_deserts_are_not_green_on_maps() {
    let (_, preset) = Preset::load("world").unwrap();
    let text = "extends = \"atlas\"\n[labels]\ndraw = false\n[places]\ndraw = false\n[contours]\ndraw = false\n\
                [water]\ndraw = false";
    let style = RecipeSources::<Style>::parse("bare.toml", text).unwrap().read_all().unwrap();
    let scale = Scale { metres_per_pixel: 4000.0, pixels_per_mm: 4.0 };
    let chart = Chart::new(&Preset { places: None, ..preset }, None, style, scale).unwrap();
    let green = |[x, y]: [i64; 2]| {
        let (area, clock) = (Area::new(x / 400, y / 400, 8, 8), Clock::default());
        let pixels = chart.picture(area, &clock).unwrap().pixels(area, &clock).unwrap();
        let sum = |channel| pixels.iter().skip(channel).step_by(3).map(|value| i64::from(*value)).sum::<i64>();
        sum(1) - sum(0)
    };
    let drought = |climate: &PlaceClimate, height_m: f64| climate.drought(height_m);
    let by_drought = plains(drought);
    let (moist, dry) = (by_drought[0], by_drought[by_drought.len() - 1]);
    assert!(green(moist) > 0 && green(dry) < 0, "{} at {moist:?}, {} at {dry:?}", green(moist), green(dry));
}

#[test]
fn nodes_of_a_stride_have_the_climates_of_their_vertices() {
    let coarse = whole().at_stride(Stride::ONE.twice().twice());
    let tile = Tile::new(&coarse, TileId { x: 3, y: -2 });
    let Area { x0, y0, .. } = tile.area();
    let row = TileView::new(&tile, &coarse).climates(Area::new(x0, y0, 5, 1));
    let places: Vec<Point> = (x0..x0 + 5).map(|x| Point::at_vertex(4 * x, 4 * y0)).collect();
    let climates: Vec<_> = row.into_iter().map(|(climate, _)| climate).collect();
    assert_eq!(climates, whole().geography().unwrap().climates(&places));
}

/// Returns vertices on plains within the land, 250 km from each other, in the order of their scores, which follow from
/// the climate and the planned height in metres.
fn plains(score: fn(&PlaceClimate, f64) -> f64) -> Vec<[i64; 2]> {
    let places: Vec<[i64; 2]> = Area::new(-24, -20, 49, 61).vertices().map(|(x, y)| [x * 25_000, y * 25_000]).collect();
    let points: Vec<Point> = places.iter().map(|[x, y]| Point::at_vertex(*x, *y)).collect();
    let settings = whole().geography().unwrap().settings_at(&points);
    let plains = places.into_iter().zip(settings).filter(|(_, at)| at.land.continent > 0.1 && at.land.uplift < 0.05);
    let mut scored: Vec<(f64, [i64; 2])> =
        plains.map(|(place, at)| (score(&at.climate, at.land.planned_m()), place)).collect();
    scored.sort_by(|one, other| one.0.total_cmp(&other.0));
    scored.into_iter().map(|(_, place)| place).collect()
}

/// Returns what stands on a tile.
fn standing(world: &World, id: TileId) -> Vec<Instance> {
    instances(world, &Grows::new(world), &Tile::new(world, id))
}

#[test]
fn plants_are_those_of_the_place() {
    let taiga = plains(|climate, height_m| match climate.biome(height_m) {
        Biome::Dfc | Biome::Dwc => (climate.temperature_c(height_m) - 1.0).abs(),
        _ => f64::INFINITY,
    });
    let ids = taiga.iter().take(8).map(|[x, y]| TileId { x: x.div_euclid(64), y: y.div_euclid(64) });
    let is_wooded = |found: &[Instance]| found.iter().filter(|it| it.growth == Growth::Tree).count() > 200;
    let (id, found) =
        ids.map(|id| (id, standing(whole(), id))).find(|(_, found)| is_wooded(found)).expect("taiga has woods");
    let trees: Vec<&Instance> = found.iter().filter(|it| it.growth == Growth::Tree).collect();
    let conifers = trees.iter().filter(|it| ["spruce", "fir", "pine", "larch"].contains(&it.plant.name)).count();
    assert!(conifers * 10 > trees.len() * 6, "{conifers} of {} trees are conifers", trees.len());
    assert!(found.iter().all(|it| !["palm", "acacia", "olive", "cactus"].contains(&it.plant.name)));
    for it in &found {
        let [low, high] = it.plant.heights_m;
        assert!((low..=high).contains(&it.tall_m()), "{it:?}");
    }
    // The same plants in the same places of smaller tiles.
    let (_, mut preset) = Preset::load("world").unwrap();
    (preset.tile_cells, preset.places) = (32, None);
    let small = World::new(preset, None).unwrap();
    let east_south = standing(&small, TileId { x: 2 * id.x + 1, y: 2 * id.y + 1 });
    let moved: Vec<Instance> =
        east_south.into_iter().map(|it| Instance { place: it.place.map(|at| at + 32.0), ..it }).collect();
    let own: Vec<Instance> = found.into_iter().filter(|it| it.place.iter().all(|at| *at >= 32.0)).collect();
    assert_eq!(moved, own);
}

#[test]
fn from_space_a_desert_is_red_and_yellow_and_a_rain_forest_dark_green() {
    let (_, preset) = Preset::load("world").unwrap();
    // Without light, so that the colours are bare.
    let text = "extends = \"satellite\"\n[relief]\nstrength = 0\nhighlight = 0\ntexture = 0\n[water]\ndraw = false";
    let style = RecipeSources::<Style>::parse("bare.toml", text).unwrap().read_all().unwrap();
    let scale = Scale { metres_per_pixel: 1000.0, pixels_per_mm: 4.0 };
    let chart = Chart::new(&preset, None, style, scale).unwrap();
    let mean = |[x, y]: [i64; 2]| {
        let area = Area::new(x / 100 - 12, y / 100 - 12, 24, 24);
        let clock = Clock::default();
        let pixels = chart.picture(area, &clock).unwrap().pixels(area, &clock).unwrap();
        [0, 1, 2].map(|channel| {
            let sum: u32 = pixels.iter().skip(channel).step_by(3).map(|value| u32::from(*value)).sum();
            sum / area.len() as u32
        })
    };
    let desert = plains(|climate, height_m| match climate.biome(height_m) {
        Biome::BWh => -climate.drought(height_m),
        _ => f64::INFINITY,
    });
    let [red, green, blue] = mean(desert[0]);
    assert!(red > 120 && red > green + 10 && green > blue + 10, "a desert has {red}, {green}, {blue}");
    let forest = plains(|climate, height_m| match climate.biome(height_m) {
        Biome::Af => climate.drought(height_m),
        _ => f64::INFINITY,
    });
    let [red, green, blue] = mean(forest[0]);
    assert!(green > red + 10 && green > blue + 10 && green < 100, "a rain forest has {red}, {green}, {blue}");
}

#[test]
fn without_a_geography_colours_do_not_differ_by_climate() {
    let (_, preset) = Preset::load("alps").unwrap();
    let area = Area::new(0, 0, 32, 32);
    let pixels = [0.0, 1.0].map(|by_climate| {
        let mut style = Style::load("satellite").unwrap();
        style.cover.by_climate = by_climate;
        let scale = Scale { metres_per_pixel: 100.0, pixels_per_mm: 4.0 };
        let (chart, clock) = (Chart::new(&preset, None, style, scale).unwrap(), Clock::default());
        chart.picture(area, &clock).unwrap().pixels(area, &clock).unwrap()
    });
    assert_eq!(pixels[0], pixels[1]);
}
