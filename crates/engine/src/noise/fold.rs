//! Folds: the ways in which the octaves of a fractal are added up, one type for each kind.

use crate::simd::Simd;

/// The state of a vertex between two octaves.
#[derive(Clone, Copy)]
pub(super) struct OctaveState<S: Simd> {
    /// The sum (or product) so far.
    pub value: S::F32,
    /// The weight of the next octave.
    pub weight: S::F32,
}

/// Constants of one octave that the fold of its kind needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoldStep {
    /// Factor of the noise. It is multiplied into the gradients, where it costs nothing per vertex.
    pub noise_scale: f64,
    /// The kind's offset, in the units of the scaled noise.
    pub offset: f32,
    /// Amplitude of the octave; 1 if `noise_scale` contains it already.
    pub amplitude: f32,
}

/// A kind of fractal. `noise` is scaled by [`FoldStep::noise_scale`].
pub(super) trait Fold {
    /// Returns the state after octave 0.
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> OctaveState<S>;
    /// Returns the state after a further octave.
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: OctaveState<S>) -> OctaveState<S>;
}

/// Fractal Brownian motion: the plain sum. The noise is scaled by the amplitude.
pub(super) struct Fbm;

impl Fold for Fbm {
    #[inline(always)]
    fn first<S: Simd>(_: S, _: &FoldStep, noise: S::F32) -> OctaveState<S> {
        // This kind never reads the weight, so any value will do: the noise is at hand.
        OctaveState { value: noise, weight: noise }
    }

    #[inline(always)]
    fn next<S: Simd>(_: S, _: &FoldStep, noise: S::F32, state: OctaveState<S>) -> OctaveState<S> {
        OctaveState { value: state.value + noise, weight: state.weight }
    }
}

/// Ridged multifractal: `signal = (offset - |noise|)^2 weight`, and the next weight is `clamp(gain signal, 0, 1)`.
///
/// Noise and offset are scaled by sqrt(gain), so that the square is `gain signal` at once; the amplitude is divided by
/// gain.
pub(super) struct Ridged;

impl Fold for Ridged {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> OctaveState<S> {
        let ridge = simd.splat(step.offset) - simd.abs(noise);
        let signal = ridge * ridge;
        OctaveState { value: signal * simd.splat(step.amplitude), weight: simd.min(signal, simd.splat(1.0)) }
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: OctaveState<S>) -> OctaveState<S> {
        let ridge = simd.splat(step.offset) - simd.abs(noise);
        let signal = ridge * ridge * state.weight;
        OctaveState {
            value: state.value + signal * simd.splat(step.amplitude),
            // The signal is a square times a weight, so it is never negative.
            weight: simd.min(signal, simd.splat(1.0)),
        }
    }
}

/// Hybrid multifractal: each `signal = (noise + offset) amplitude` is multiplied by the weighted signal of the octave
/// before, limited to 1. Noise and offset are scaled by the amplitude.
pub(super) struct Hybrid;

impl Fold for Hybrid {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> OctaveState<S> {
        lifted(simd, step, noise)
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: OctaveState<S>) -> OctaveState<S> {
        // The weight is limited here, where it is read, since `lifted` does not limit the weight after the first
        // octave.
        let weight = simd.min(state.weight, simd.splat(1.0));
        let signal = weight * (noise + simd.splat(step.offset));
        OctaveState { value: state.value + signal, weight: signal }
    }
}

/// Heterogeneous terrain: an octave adds in proportion to the height so far. Noise and offset are scaled by the
/// amplitude.
pub(super) struct Hetero;

impl Fold for Hetero {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> OctaveState<S> {
        lifted(simd, step, noise)
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: OctaveState<S>) -> OctaveState<S> {
        let signal = noise + simd.splat(step.offset);
        OctaveState { value: state.value + signal * state.value, weight: state.weight }
    }
}

/// Returns the state after the first octave of hybrid and heterogeneous fractals: the noise, lifted by the offset.
#[inline(always)]
fn lifted<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> OctaveState<S> {
    let value = noise + simd.splat(step.offset);
    OctaveState { value, weight: value }
}
