//! How the octaves of a fractal are added up: one type a kind.

use crate::simd::Simd;

/// What a vertex carries from octave to octave.
#[derive(Clone, Copy)]
pub(super) struct State<S: Simd> {
    /// The sum (or product) so far.
    pub value: S::F32,
    /// What the next octave counts for.
    pub weight: S::F32,
}

/// The numbers of one octave that its fold needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoldStep {
    /// What the noise was multiplied by already, in its gradients, which costs nothing.
    pub noise_scale: f64,
    /// The kind's offset, in the units of the scaled noise.
    pub offset: f32,
    /// What the octave counts for, if that is not in `noise_scale`.
    pub amplitude: f32,
}

/// A kind of fractal. `noise` is scaled by [`FoldStep::noise_scale`].
pub(super) trait Fold {
    /// The state after octave 0.
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> State<S>;
    /// The state after a further octave.
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: State<S>) -> State<S>;
}

/// Fractal Brownian motion: the plain sum. Noise scaled by the amplitude.
pub(super) struct Fbm;

impl Fold for Fbm {
    #[inline(always)]
    fn first<S: Simd>(_: S, _: &FoldStep, noise: S::F32) -> State<S> {
        // Nothing reads the weight of this kind: what is at hand costs nothing.
        State { value: noise, weight: noise }
    }

    #[inline(always)]
    fn next<S: Simd>(_: S, _: &FoldStep, noise: S::F32, state: State<S>) -> State<S> {
        State { value: state.value + noise, weight: state.weight }
    }
}

/// Ridged multifractal: `signal = (offset - |noise|)^2 weight`, and the next weight is `clamp(gain signal, 0, 1)`.
///
/// Noise and offset scaled by sqrt(gain), so that the square is `gain signal` at once; the amplitude is divided by gain.
pub(super) struct Ridged;

impl Fold for Ridged {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> State<S> {
        let ridge = simd.splat(step.offset) - simd.abs(noise);
        let signal = ridge * ridge;
        State { value: signal * simd.splat(step.amplitude), weight: simd.min(signal, simd.splat(1.0)) }
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: State<S>) -> State<S> {
        let ridge = simd.splat(step.offset) - simd.abs(noise);
        let signal = ridge * ridge * state.weight;
        State {
            value: state.value + signal * simd.splat(step.amplitude),
            // Never negative: a square times a weight.
            weight: simd.min(signal, simd.splat(1.0)),
        }
    }
}

/// Hybrid multifractal: `signal = (noise + offset) amplitude` counts as much as all signals before it, at most once.
/// Noise and offset scaled by the amplitude.
pub(super) struct Hybrid;

impl Fold for Hybrid {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> State<S> {
        lifted(simd, step, noise)
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: State<S>) -> State<S> {
        // Cut where it is read, since `lifted` leaves the first one as it is.
        let weight = simd.min(state.weight, simd.splat(1.0));
        let signal = weight * (noise + simd.splat(step.offset));
        State { value: state.value + signal, weight: signal }
    }
}

/// Heterogeneous terrain: an octave adds in proportion to the height so far. Noise and offset scaled by the amplitude.
pub(super) struct Hetero;

impl Fold for Hetero {
    #[inline(always)]
    fn first<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> State<S> {
        lifted(simd, step, noise)
    }

    #[inline(always)]
    fn next<S: Simd>(simd: S, step: &FoldStep, noise: S::F32, state: State<S>) -> State<S> {
        let signal = noise + simd.splat(step.offset);
        State { value: state.value + signal * state.value, weight: state.weight }
    }
}

/// The first octave of the two fractals that begin with the noise itself, lifted by the offset.
#[inline(always)]
fn lifted<S: Simd>(simd: S, step: &FoldStep, noise: S::F32) -> State<S> {
    let value = noise + simd.splat(step.offset);
    State { value, weight: value }
}
