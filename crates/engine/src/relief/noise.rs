//! Relief of noise: the height of any vertex as a sum of fractals.

use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::grid::Grid;
use crate::hash::{self, Stream, StreamNumber};
#[cfg(feature = "gpu")]
use crate::noise::Fractal;
use crate::noise::FractalSpec;
use crate::recipe::mask::Mask;
use crate::relief::curve::Curve;
use crate::relief::settings::{LandMask, NoiseTerm, WarpSettings};
use crate::relief::strided::StridedFractal;
use crate::stop::Stopped;

/// Relief of noise: fractal terms, added up at warped positions, and lowered to the sea floor where there is no land.
///
/// Heights are a pure function of the vertex: they need no pad, and have the same bits in whatever area they are
/// computed.
#[derive(Debug)]
pub struct NoiseRelief {
    pub(super) warp: Option<WarpField>,
    pub(super) terms: Vec<Term>,
    pub(super) land: Option<(Share, f32)>,
    range_m: (f32, f32),
}

#[derive(Debug)]
pub(super) struct WarpField {
    pub east: StridedFractal,
    pub south: StridedFractal,
    pub distance_m: f32,
}

#[derive(Debug)]
pub(super) struct Term {
    pub fractal: StridedFractal,
    pub curve: Option<Curve>,
    pub height_m: f32,
    pub base_m: f32,
    pub mask: Option<Share>,
}

/// A mask, ready for evaluation: `scale` and `shift` map its noise from `from..to` to 0..1.
#[derive(Debug)]
pub(super) struct Share {
    pub noise: StridedFractal,
    pub scale: f32,
    pub shift: f32,
}

impl NoiseRelief {
    /// Makes a relief of one fractal alone, or of zero, multiplied by `height_m`.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_fractal(fractal: Option<&Fractal>, height_m: f32) -> NoiseRelief {
        let fractal = StridedFractal::of(fractal.cloned());
        let range_m = fractal.bounds();
        let term = Term { fractal, curve: None, height_m, base_m: 0.0, mask: None };
        NoiseRelief { warp: None, terms: vec![term], land: None, range_m }
    }

    /// Makes the relief of checked settings with all defaults filled in, at the nodes of a stride; `spacing_m` is the
    /// distance in metres between vertices.
    pub(crate) fn new(
        terms: &[NoiseTerm],
        warp: Option<&WarpSettings>,
        land: Option<&LandMask>,
        (spacing_m, stride): (f64, Stride),
        seed: u64,
    ) -> NoiseRelief {
        let fractal = |spec: &FractalSpec, stream: StreamNumber| {
            StridedFractal::new(spec, spacing_m, stride, hash::stream(seed, stream))
        };
        let share = |mask: &Mask, stream| {
            let scale = (1.0 / (mask.to - mask.from)) as f32;
            let noise = fractal(&mask.fractal(), stream);
            Share { noise, scale, shift: -(mask.from as f32) * scale }
        };
        let warp = warp.map(|warp| {
            let spec = warp.fractal();
            WarpField {
                east: fractal(&spec, Stream::NoiseWarpEast.into()),
                south: fractal(&spec, Stream::NoiseWarpSouth.into()),
                distance_m: warp.distance_m as f32,
            }
        });
        let term = |(index, term): (u64, &NoiseTerm)| Term {
            fractal: fractal(&term.fractal(), Stream::NoiseTerm.of(index)),
            curve: term.curve.as_deref().map(Curve::new),
            height_m: term.height_m as f32,
            base_m: term.base_m as f32,
            mask: term.mask.as_ref().map(|mask| share(mask, Stream::NoiseTermMask.of(index))),
        };
        let terms: Vec<Term> = (0..).zip(terms).map(term).collect();
        let land = land.map(|land| (share(&land.mask, Stream::NoiseLand.into()), land.floor_m as f32));
        let range_m = proved_range(&terms, land.as_ref().map(|(_, floor_m)| *floor_m));
        NoiseRelief { warp, terms, land, range_m }
    }

    /// Returns bounds that no height leaves, whatever the vertex: (lowest, highest) in metres.
    ///
    /// They follow from the bounds of each term, of its curve and of the sea floor, and include rounding errors.
    pub fn range_m(&self) -> (f32, f32) {
        self.range_m
    }

    /// Returns the heights in metres at all vertices of `area`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn heights(&self, area: Area, clock: &Clock) -> Result<Grid<f32>, Stopped> {
        let mut heights = Grid::filled(area, 0.0);
        // Computed in bands that fit into the second-level cache, whatever the size of the tile.
        const BAND_VERTICES: usize = 1 << 16;
        let rows = (BAND_VERTICES / area.width().max(1)).max(1);
        let mut scratch = BandScratch::default();
        for (band, out) in heights.values_mut().chunks_mut(rows * area.width().max(1)).enumerate() {
            clock.check()?;
            let y0 = area.y0 + (band * rows) as i64;
            let band = Area { y0, y1: y0 + (out.len() / area.width()) as i64, ..area };
            self.fill_band(band, &mut scratch, out);
        }
        Ok(heights)
    }

    fn fill_band(&self, band: Area, scratch: &mut BandScratch, out: &mut [f32]) {
        let BandScratch { east, south, value, share } = scratch;
        for buffer in [&mut *east, south, value, share] {
            buffer.resize(out.len(), 0.0);
        }
        // Displacements of the positions at which the noise is evaluated.
        let warp = self.warp.as_ref().map(|warp| {
            for (fractal, displacement) in [(&warp.east, &mut *east), (&warp.south, &mut *south)] {
                fractal.fill(band, None, displacement);
                for metres in displacement {
                    *metres *= warp.distance_m;
                }
            }
            [&east[..], &south[..]]
        });
        let read = |fractal: &StridedFractal, to: &mut [f32]| fractal.fill(band, warp, to);
        // The land's relief: all terms, each multiplied by its mask.
        for (index, term) in self.terms.iter().enumerate() {
            read(&term.fractal, value);
            if let Some(curve) = &term.curve {
                curve.apply(value);
            }
            for value in &mut *value {
                *value = *value * term.height_m + term.base_m;
            }
            if let Some(mask) = &term.mask {
                read(&mask.noise, share);
                mask.ease(share);
                value.iter_mut().zip(&*share).for_each(|(value, share)| *value *= share);
            }
            match index {
                0 => out.copy_from_slice(value),
                _ => out.iter_mut().zip(&*value).for_each(|(height, value)| *height += value),
            }
        }
        // The sea floor, where there is no land.
        if let Some((mask, floor_m)) = &self.land {
            read(&mask.noise, share);
            mask.ease(share);
            out.iter_mut().zip(&*share).for_each(|(height, share)| *height = floor_m + (*height - floor_m) * share);
        }
    }
}

/// Buffers of one band.
#[derive(Default)]
struct BandScratch {
    east: Vec<f32>,
    south: Vec<f32>,
    value: Vec<f32>,
    share: Vec<f32>,
}

impl Share {
    /// Converts noise to shares: 0 at `from`, 1 at `to`, smooth between.
    fn ease(&self, noise: &mut [f32]) {
        for value in noise {
            let t = (*value * self.scale + self.shift).clamp(0.0, 1.0);
            *value = t * t * (3.0 - 2.0 * t);
        }
    }
}

/// Returns an interval that contains every possible sum of the terms, and the sea floor.
fn proved_range(terms: &[Term], floor_m: Option<f32>) -> (f32, f32) {
    let (mut low, mut high, mut magnitude) = (0.0, 0.0, 0.0);
    for term in terms {
        let (from, to) = match &term.curve {
            Some(curve) => curve.bounds(),
            None => term.fractal.bounds(),
        };
        let ends = [from, to].map(|value| value as f64 * term.height_m as f64 + term.base_m as f64);
        // A mask scales the term by 0 to 1, so 0 is within its reach too.
        let masked = if term.mask.is_some() { 0.0 } else { ends[0] };
        low += ends[0].min(ends[1]).min(masked);
        high += ends[0].max(ends[1]).max(masked);
        magnitude += ends[0].abs().max(ends[1].abs());
    }
    if let Some(floor_m) = floor_m {
        low = f64::min(low, floor_m as f64);
        high = f64::max(high, floor_m as f64);
        magnitude += floor_m.abs() as f64;
    }
    // After the fractals, whose bounds include their own rounding, fewer than 64 f32 operations follow, each with an
    // error of at most half an ulp (2^-24).
    let margin = magnitude * 64.0 / (1 << 24) as f64;
    let outward = |bound: f64, limit: fn(f32) -> f32| limit(bound as f32);
    let (low, high) = (outward(low - margin, f32::next_down), outward(high + margin, f32::next_up));
    // Even a perfectly flat world needs a range for the encoding of its heights.
    if high - low < 1.0 { (low - 0.5, high + 0.5) } else { (low, high) }
}
