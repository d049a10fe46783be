//! Hillsides: the slopes of the land between valleys, sampled at coarse nodes and interpolated between them.

use super::brook_relief::{Rest, RestLaw};
use super::detail::Detail;
use super::fields::Fields;
use super::laws::Laws;
use super::segment::Reach;
use super::valley::InRows;
use crate::area::Area;
use crate::grain_point::Point;
use crate::grid::{corners, spline_between_corners};
use crate::simd::Simd;

/// Values at nodes.
#[derive(Debug)]
pub enum NodeValues {
    /// One value for all nodes.
    Same(f32),
    /// A value for each node.
    Each(Vec<f32>),
}

impl NodeValues {
    /// Returns the values of a number of nodes from one on.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S, first: usize) -> S::F32 {
        match self {
            NodeValues::Same(value) => simd.splat(*value),
            NodeValues::Each(values) => simd.load(&values[first..]),
        }
    }

    /// True if any value is not 0.
    pub fn any(&self) -> bool {
        match self {
            NodeValues::Same(value) => *value != 0.0,
            NodeValues::Each(values) => values.iter().any(|value| *value != 0.0),
        }
    }

    /// Returns the values of nodes in rows.
    #[inline(always)]
    pub fn load_rows<S: Simd>(&self, simd: S, lanes: InRows) -> S::F32 {
        match self {
            NodeValues::Same(value) => simd.splat(*value),
            NodeValues::Each(values) => lanes.load(simd, values),
        }
    }
}

/// The hillsides between valleys, at nodes.
#[derive(Debug)]
pub struct Hillsides {
    /// Distances from a node within which channels are looked for.
    pub reach: Reach,
    /// Slopes of the hillsides.
    pub slope: Vec<f32>,
    /// Metres of height by which crests are rounded off.
    pub crest_m: NodeValues,
    /// Depths of gullies and of rills, and the roughness, each as a share of the greatest of all places.
    pub gullies: NodeValues,
    pub rills: NodeValues,
    pub roughness: NodeValues,
    /// Sand; see [`Laws::sand`].
    pub sand: NodeValues,
    /// The mean effect of finer channels, if there are more levels than those that are asked for.
    pub rest: Option<Rest>,
}

impl Hillsides {
    /// Returns the hillsides at the nodes of an area, where channels matter within `reach`.
    pub(super) fn new(fields: &Fields, area: Area, detail: Detail, reach: Reach) -> Hillsides {
        let (step, levels) = (detail.slope_step / detail.step, detail.channels.levels);
        let coarse = detail.slope_step;
        // A bilinear surface would show its squares where rock changes the slope from one to the next.
        let between = |values: &[f32]| spline_between_corners(area, step, values);
        let corners = corners(area, step).padded(1).vertices().map(|(x, y)| Point::at_vertex(x * coarse, y * coarse));
        let laws = fields.all_laws(&corners.collect::<Vec<_>>());
        let table = |of: &dyn Fn(&Laws) -> f64| between(&laws.iter().map(|laws| of(laws) as f32).collect::<Vec<_>>());
        let law = |laws: &Laws| RestLaw::new(fields, laws, levels);
        let rest = || Rest { slope: table(&|laws| law(laws).slope), height_m: table(&|laws| law(laws).height_m) };
        let [least, most] = [fields.least_laws(), fields.most_laws()];
        // Where a law is the same everywhere, there is nothing to interpolate.
        let values = |of: &dyn Fn(&Laws) -> f64| match of(least) == of(most) {
            true => NodeValues::Same(of(most) as f32),
            false => NodeValues::Each(table(of)),
        };
        let share = |of: fn(&Laws) -> f64| match detail.gullies && of(most) > 0.0 {
            true => values(&|laws| of(laws) / of(most)),
            false => NodeValues::Same(0.0),
        };
        Hillsides {
            reach,
            slope: table(&|laws| laws.hill_slope),
            crest_m: values(&|laws| laws.crest_m),
            gullies: share(|laws| laws.gullies),
            rills: share(|laws| laws.rills),
            roughness: share(|laws| laws.roughness),
            sand: values(&|laws| laws.sand),
            rest: (levels < fields.levels()).then(rest),
        }
    }
}
