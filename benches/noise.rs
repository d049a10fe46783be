//! Noise side by side with two well-known crates: nanoseconds a vertex at every instruction set, as in docs/speed.md.
//!
//! `cargo bench --bench noise`. One thread, 8 octaves with the thesis' parameters, vertices 1 m apart. All contestants take
//! turns, and each is given its best round, so that a busy machine slows none of them alone.

use std::hint::black_box;
use std::time::Instant;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use noise::{MultiFractal, NoiseFn, RidgedMulti, Simplex};
use terrane::area::Area;
use terrane::noise::{Fractal, FractalKind, FractalSpec};
use terrane::simd::Level;

/// A tile of the thesis with both its edges.
const SIDE: i64 = 257;
const VERTICES: usize = (SIDE * SIDE) as usize;
const AREA: Area = Area::new(1024, -3072, SIDE as usize, SIDE as usize);
const ROUNDS: usize = 60;

/// Something that fills a tile with noise, and the nanoseconds a vertex of its best round.
struct Contestant<'a> {
    name: String,
    work: Work<'a>,
    best_ns: f64,
}

/// Fills the tile's rows.
type Work<'a> = Box<dyn FnMut(&mut [f32]) + 'a>;

fn main() {
    let spec = |kind| FractalSpec { kind, octaves: 8, wavelength_m: 1400.0, lacunarity: 2.5, h: 2.0 };
    let ridged = Fractal::new(&spec(FractalKind::Ridged { offset: 1.0, gain: 2.0 }), 1.0, 1);
    let fbm = Fractal::new(&spec(FractalKind::Fbm), 1.0, 1);
    let warp_m: Vec<f32> = (0..VERTICES).map(|vertex| (vertex % 977) as f32 * 0.1).collect();

    let mut lite = FastNoiseLite::with_seed(1);
    lite.set_noise_type(Some(NoiseType::OpenSimplex2));
    lite.set_fractal_type(Some(FractalType::Ridged));
    lite.set_fractal_octaves(Some(8));
    lite.set_fractal_lacunarity(Some(2.5));
    lite.set_frequency(Some(1.0 / 1400.0));
    let multi = RidgedMulti::<Simplex>::new(1).set_octaves(8).set_lacunarity(2.5).set_frequency(1.0 / 1400.0);

    let mut contestants = vec![
        by_vertex("fastnoise-lite 1.1", |x, y| lite.get_noise_2d(x as f32, y as f32)),
        by_vertex("noise 0.9", |x, y| multi.get([x as f64, y as f64]) as f32),
    ];
    for level in Level::available() {
        let mut add = |what: &str, work: Work<'static>| {
            contestants.push(Contestant { name: format!("{what} {}", level.name()), work, best_ns: f64::INFINITY });
        };
        let (ridged, fbm, warped, warp_m) = (ridged.clone(), fbm.clone(), ridged.clone(), warp_m.clone());
        add("ridged", Box::new(move |out| ridged.fill_at(level, AREA, None, out)));
        add("fbm", Box::new(move |out| fbm.fill_at(level, AREA, None, out)));
        add("warped", Box::new(move |out| warped.fill_at(level, AREA, Some([&warp_m, &warp_m]), out)));
    }
    let mut out = vec![0.0; VERTICES];
    for _ in 0..ROUNDS {
        for contestant in &mut contestants {
            let start = Instant::now();
            (contestant.work)(black_box(&mut out));
            let spent_ns = start.elapsed().as_secs_f64() * 1e9 / VERTICES as f64;
            contestant.best_ns = contestant.best_ns.min(spent_ns);
        }
    }
    let best_ns =
        |name: &str| contestants.iter().find(|contestant| contestant.name == name).expect("it has taken part").best_ns;
    let (lite_ns, multi_ns) = (best_ns("fastnoise-lite 1.1"), best_ns("noise 0.9"));
    println!("| ridged, 8 octaves | ns a vertex | times fastnoise-lite | times noise | fBm | warped ridged |");
    println!("|---|---|---|---|---|---|");
    println!("| fastnoise-lite 1.1 | {lite_ns:.1} | 1 | {:.1} | | |", multi_ns / lite_ns);
    println!("| noise 0.9 | {multi_ns:.1} | {:.1} | 1 | | |", lite_ns / multi_ns);
    for level in Level::available() {
        let ns = |what: &str| best_ns(&format!("{what} {}", level.name()));
        let ridged_ns = ns("ridged");
        println!(
            "| terrane, {} | {ridged_ns:.2} | {:.1} | {:.1} | {:.2} | {:.2} |",
            level.name(),
            lite_ns / ridged_ns,
            multi_ns / ridged_ns,
            ns("fbm"),
            ns("warped")
        );
    }
}

fn by_vertex<'a>(name: &str, at: impl Fn(i64, i64) -> f32 + 'a) -> Contestant<'a> {
    let work = move |out: &mut [f32]| {
        for (row, y) in out.chunks_exact_mut(SIDE as usize).zip(AREA.y0..) {
            for (value, x) in row.iter_mut().zip(AREA.x0..) {
                *value = at(x, y);
            }
        }
    };
    Contestant { name: name.to_owned(), work: Box::new(work), best_ns: f64::INFINITY }
}
