//! The cones of volcanoes, which rise upon land that valleys have shaped: craters, ravines, lava flows, cinder cones.
//!
//! A cone raises the land by a function of the offset from its volcano's middle, but by nothing at the bed of a channel
//! with water. All channels within its foot are dry, so this concerns a river that leaves a caldera, and others that
//! come near. Every part of a cone falls away from its middle, but for the rims of craters, and each crater has a gap:
//! water stands nowhere on it.
//!
//! To judge the numbers chosen by eye, look at hillshades of volcanoes, 20 km wide.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec2;

use super::fields::Fields;
use super::segment::{Segment, Segments};
use super::stamp::{self, Stamp};
use super::valley::Valleys;
use super::volcanoes::{CinderCone, LavaFlow, Volcano, VolcanoKind};
use super::warp::Displaced;
use crate::area::Area;
use crate::clock::Clock;
use crate::geometry::{LineSegment, lerp, smooth};
use crate::grain_point::{Point, padded};
use crate::hash::{self, Stream};
use crate::noise::point_noise::{PointField, PointNoise};
use crate::stop::Stopped;

/// Slope of the walls of craters and calderas.
pub const WALL: f64 = 0.62;

/// Mean slope of the walls of a shield's crater, which is shallow.
const SHIELD_WALL: f64 = 0.16;

/// Slope of the sides of cinder cones, the radius of their craters as a share of that of their foot, and the height
/// above the foot, as a multiple of the slope, of the top without a crater.
const CINDER_SLOPE: f64 = 0.56;
const CINDER_RIM: f64 = 0.3;

/// Greatest share of the radius by which the foot is nearer in some directions than in others.
const LOBES: f64 = 0.12;
const LOBE_COUNT: f64 = 4.0;

/// The ravines around a cone in three sets: their number, about; the share of the foot's distance from which on they
/// are cut, and on which they deepen; and their depth as a share of that of the first.
const RAVINES: [[f64; 4]; 3] = [[8.0, 0.06, 0.4, 1.0], [21.0, 0.2, 0.3, 0.7], [47.0, 0.4, 0.25, 0.4]];

/// Waves around a cone of the beginning of its ravines, and the greatest part of chance in it.
const STARTS: (f64, f64) = (13.0, 0.3);

/// Depths of the ravines of the youngest and of the oldest cones, as shares of the height above the foot.
const RAVINE_DEPTHS: [f64; 2] = [0.05, 0.3];

/// Half width of ravines of the youngest and of the oldest cones, in values of the noise whose zeros they follow.
const RAVINE_HALF: [f64; 2] = [0.13, 0.34];

/// Wavelength in metres of the bends of ravines and flows, and the greatest bend as a share of the distance from the
/// middle.
const BEND_WAVE_M: f64 = 2400.0;
const BEND: f64 = 0.07;

/// Slope of the floor of a crater's gap, and the length over which it falls, in radii of the rim.
const GAP_SLOPE: f64 = 0.06;
const GAP_RIMS: f64 = 3.0;

/// Distance from the bed of a channel with water over which a cone fades, in heights of the cone.
const BANKS: f64 = 1.7;

/// Least half width in vertices of the bed of a channel, which cones leave free.
const BED: f64 = 3.0;

/// Half width in vertices of the floor of the gorge in which a river leaves a caldera.
const GORGE: f64 = 6.0;

/// Width of the rim of a lava flow as a share of its half width, and the height of its levees above its middle, as a
/// share of its height.
const FLOW_EDGE: f64 = 0.25;
const LEVEES: f64 = 0.35;

/// Units of the plane of noise in a metre, and on the circle of directions' radius.
const UNITS: f64 = 16.0;
const WAVE_UNITS: i64 = 1 << 12;

/// The cones of a world's volcanoes.
#[derive(Debug)]
pub struct VolcanicCones {
    fields: Arc<Fields>,
    /// Noise by direction, of which each cone takes a circle: the outline of its foot and its ravines.
    around: PointNoise,
    /// Bends of all that runs down a cone, east and south.
    bends: [PointNoise; 2],
}

/// A cone, with the course of the river that leaves it, in metres from its middle, as far as the river is known.
struct Cone {
    volcano: Volcano,
    outlet: Vec<LineSegment>,
}

impl Stamp for Cone {
    fn reach(&self) -> (Point, f64) {
        (self.volcano.middle, self.volcano.radius_m)
    }
}

/// Returns the course of the river that leaves a caldera; nothing for other volcanoes. A part of it that is unknown is
/// further away than its valley's side reaches, which is further than any cone fades.
fn outlet_of(segments: &Segments, volcano: &Volcano, metres_a_grain: f64) -> Vec<LineSegment> {
    if volcano.kind != VolcanoKind::Caldera {
        return Vec::new();
    }
    let id = (0, volcano.node.0, volcano.node.1);
    let own = segments.all.iter().filter(|segment| segments.channels[segment.channel as usize].id == id);
    let origin = segments.origin.from(volcano.middle);
    let line = |segment: &Segment| {
        let [from, along] = [origin + segment.from, segment.along].map(|way| (way * metres_a_grain).into());
        LineSegment { from, along }
    };
    own.map(line).collect()
}

/// Returns the depth of a crater's floor below its rim, and the height above this floor of a bowl with this rim, at an
/// offset from its middle: the bowl is open towards its gap.
fn bowl_m(off: DVec2, rim_m: f64, gap: DVec2, wall: f64) -> [f64; 2] {
    let floor_m = 0.3 * rim_m;
    let along_m = off.dot(gap);
    let depth_m = wall * (rim_m - floor_m);
    let from_m = if along_m > 0.0 { gap.perp_dot(off).abs() } else { off.length() };
    let floor_m = floor_m * (1.0 - 0.6 * smooth(along_m / rim_m));
    // The gap ends where the side of the cone has come down to it, and falls no further.
    [depth_m, wall * (from_m - floor_m).max(0.0) - GAP_SLOPE * along_m.clamp(0.0, GAP_RIMS * rim_m)]
}

impl CinderCone {
    /// Returns the height in metres of the cone at an offset from its volcano's middle.
    fn height_m(&self, off: DVec2) -> f64 {
        let off = off - self.off;
        let square = off.length_squared();
        if square >= self.radius_m * self.radius_m {
            return 0.0;
        }
        let side_m = CINDER_SLOPE * (self.radius_m - square.sqrt());
        let rim_m = CINDER_RIM * self.radius_m;
        let [depth_m, above_m] = bowl_m(off, rim_m, self.gap, WALL);
        let top_m = CINDER_SLOPE * (self.radius_m - rim_m);
        side_m.min(top_m - depth_m + above_m).max(0.0)
    }
}

impl LavaFlow {
    /// Returns the height in metres of the flow at an offset from its volcano's middle, whose foot is `radius_m` away.
    fn height_m(&self, off: DVec2, radius_m: f64) -> f64 {
        let along_m = off.dot(self.down);
        let [start_m, end_m] = self.ends.map(|end| end * radius_m);
        if along_m <= start_m || along_m >= end_m {
            return 0.0;
        }
        // It widens downwards, and its end is round.
        let come = (along_m - start_m) / (end_m - start_m);
        let left_m = end_m - along_m;
        let half_m = self.half_m * (0.35 + 0.65 * come);
        let round = (left_m / half_m).min(1.0);
        let half_m = half_m * (round * (2.0 - round)).sqrt();
        let inside = 1.0 - self.down.perp_dot(off).abs() / half_m.max(1.0);
        if inside <= 0.0 {
            return 0.0;
        }
        let edge = inside / FLOW_EDGE;
        let levee = 1.0 + LEVEES * smooth(edge) * (1.0 - smooth((edge - 1.0) / 1.5)) * (1.0 - come);
        self.height_m * smooth(edge) * levee * smooth(come / 0.15)
    }
}

/// A place on a cone, by its distance from the middle.
struct ConePlace {
    /// Metres east and south from the middle, bent as all is bent that runs down.
    off: DVec2,
    /// Distance in metres from the middle, and as a share of the foot's distance.
    distance_m: f64,
    share: f64,
    /// Depth of ravines, as a share of the greatest.
    ravine: f64,
}

impl VolcanicCones {
    /// Returns the cones of a world with these fields; `None` if it has none.
    pub fn new(fields: &Arc<Fields>, seed: u64) -> Option<VolcanicCones> {
        let noise =
            |wave, octaves, part| PointNoise::new(wave, octaves, hash::stream(seed, Stream::VolcanoShape.of(part)));
        let bend = |part| noise((BEND_WAVE_M * UNITS) as i64, 2, part);
        fields.geography().is_some().then(|| VolcanicCones {
            fields: Arc::clone(fields),
            around: noise(WAVE_UNITS, 1, 0),
            bends: [bend(1), bend(2)],
        })
    }

    /// Raises the land at an area's nodes by the cones of volcanoes. Returns the metres at each node; `None` if no
    /// volcano is near.
    pub fn raise(
        &self,
        segments: &Segments,
        nodes: &Displaced,
        valleys: &mut Valleys,
        clock: &Clock,
    ) -> Result<Option<Vec<f32>>, Stopped> {
        let fields = &self.fields;
        let outlet =
            |volcano: Volcano| Cone { outlet: outlet_of(segments, &volcano, fields.metres_a_grain()), volcano };
        let cones: Vec<Cone> = self.around(nodes).into_iter().map(outlet).collect();
        if cones.is_empty() {
            return Ok(None);
        }
        let mut all_m = vec![0.0; nodes.area.len()];
        stamp::nodes_of((fields, clock), &cones, nodes, |index, vertex, near| {
            for Cone { volcano, outlet } in near {
                let off = stamp::off_m(fields, nodes, index, vertex, volcano.middle);
                let raised_m = self.raised_m(volcano, off);
                if raised_m != 0.0 {
                    let share = self.share(segments, valleys, index, raised_m).min(self.beside(outlet, off, raised_m));
                    all_m[index] += (raised_m * share) as f32;
                }
            }
        })?;
        for (height_m, raised_m) in valleys.height_m.iter_mut().zip(&all_m) {
            *height_m += raised_m;
        }
        Ok(Some(all_m))
    }

    /// Returns the volcanoes whose cones come near an area of nodes.
    fn around(&self, nodes: &Displaced) -> Vec<Volcano> {
        let Area { x0, y0, x1, y1 } = nodes.area;
        let [low, high] = [[x0, y0], [x1, y1]].map(|[x, y]| Point::at_vertex(x * nodes.step, y * nodes.step));
        // No cone is wider than the distance between trunks, and no node is displaced by as much.
        let most = 2.0 * self.fields.side(0) as f64;
        self.fields.volcanoes_in(padded([low, high], most))
    }

    /// Returns the share of a cone's height that a node gets: 0 at the bed of a channel with water.
    fn share(&self, segments: &Segments, valleys: &Valleys, index: usize, height_m: f64) -> f64 {
        let Some(own) = segments.all.get(valleys.segment[index] as usize) else { return 1.0 };
        let share = valleys.share[index] as f64;
        if !self.fields.holds_water(lerp(own.discharge_m3s, share)) {
            return 1.0;
        }
        let river_m = lerp(own.river, share) * self.fields.metres_a_grain();
        let dry_m = valleys.distance_m[index] as f64 - river_m.max(BED * self.fields.spacing_m());
        smooth(dry_m / (BANKS * height_m.max(1.0)))
    }

    /// Returns the share of a cone's height that is left beside the river that leaves a caldera.
    fn beside(&self, outlet: &[LineSegment], off: DVec2, height_m: f64) -> f64 {
        let away_m = outlet.iter().map(|line| line.distance(off.into())).fold(f64::INFINITY, f64::min);
        smooth((away_m - GORGE * self.fields.spacing_m()) / (BANKS * height_m.max(1.0)))
    }

    /// Returns the metres by which a volcano raises the land at an offset in metres from its middle.
    fn raised_m(&self, volcano: &Volcano, off: DVec2) -> f64 {
        if off.length_squared() >= volcano.radius_m * volcano.radius_m {
            return 0.0;
        }
        let place = self.place(volcano, off);
        if place.share >= 1.0 {
            return 0.0;
        }
        let left = 1.0 - place.share;
        let body_m = match volcano.kind {
            VolcanoKind::Caldera => ring_m(volcano, &place),
            VolcanoKind::CinderField => volcano.height_m * left * left,
            _ => cone_m(volcano, &place),
        };
        let flow_m = volcano.flows.iter().map(|flow| flow.height_m(place.off, volcano.radius_m)).fold(0.0, f64::max);
        let cinder_m = volcano.cinder_cones.iter().map(|cone| cone.height_m(off)).fold(0.0, f64::max);
        // All fades towards the foot, so that flows and cones that lie there end with it.
        body_m + (flow_m + cinder_m) * smooth(left / 0.06)
    }

    /// Returns a place on a volcano, at an offset in metres from its middle.
    fn place(&self, volcano: &Volcano, off: DVec2) -> ConePlace {
        let shift = Point { x: (volcano.seed & 0xFF_FFFF) as i64, y: (volcano.seed >> 24 & 0xFF_FFFF) as i64 };
        let at = shift.moved(off * UNITS);
        let distance_m = off.length();
        let bent = DVec2::new(self.bends[0].at(at), self.bends[1].at(at)) * (BEND * distance_m);
        let off = off + bent;
        let towards = off / off.length().max(1e-3);
        // The noise on a circle on which so many waves have room.
        let circle = |waves: f64, part: i64| {
            let place = Point { x: shift.x, y: shift.y + (part << 26) };
            self.around.at(place.moved(towards * (waves * WAVE_UNITS as f64 / TAU)))
        };
        let foot = 1.0 - LOBES * (0.5 + 0.5 * circle(LOBE_COUNT, 0)).clamp(0.0, 1.0);
        let share = distance_m / (volcano.radius_m * foot);
        let half = lerp([RAVINE_HALF[0], RAVINE_HALF[1] - RAVINE_HALF[0]], volcano.age);
        let late = STARTS.1 * (0.3 + circle(STARTS.0, 1)).clamp(0.0, 1.0);
        let cut = |(part, [waves, from, over, depth]): (i64, [f64; 4])| {
            let deep = smooth((share - from - late) / over);
            depth * deep * (1.0 - circle(waves, part).abs() / half).max(0.0)
        };
        let ravine = (2..).zip(RAVINES).map(cut).fold(0.0, f64::max);
        ConePlace { off, distance_m, share, ravine }
    }
}

/// Returns the depth of ravines at a place, as a share of the height above the foot.
fn ravine_depth(volcano: &Volcano, place: &ConePlace) -> f64 {
    lerp([RAVINE_DEPTHS[0], RAVINE_DEPTHS[1] - RAVINE_DEPTHS[0]], volcano.age) * place.ravine
}

/// Returns the height in metres of a cone with a crater.
fn cone_m(volcano: &Volcano, place: &ConePlace) -> f64 {
    let (steep, wall) = match volcano.kind {
        VolcanoKind::Shield => (0.0, SHIELD_WALL),
        _ => (0.15, WALL),
    };
    // Steeper and steeper upwards; a shield is a little rounded on top.
    let profile = |share: f64| {
        let left = (1.0 - share).max(0.0);
        left * left * (1.0 - steep + steep * left)
    };
    let rim = profile(volcano.rim);
    let depth = ravine_depth(volcano, place);
    let side_m = volcano.height_m * profile(place.share) * (1.0 - depth);
    let [depth_m, above_m] = bowl_m(place.off, volcano.rim * volcano.radius_m, volcano.gap, wall);
    side_m.min(volcano.height_m * rim - depth_m + above_m)
}

/// Returns the height in metres of a caldera's walls.
fn ring_m(volcano: &Volcano, place: &ConePlace) -> f64 {
    let inside_m = volcano.rim * volcano.radius_m - place.distance_m;
    if inside_m > 0.0 {
        return (volcano.height_m - WALL * inside_m).max(0.0);
    }
    let left = ((1.0 - place.share) / (1.0 - volcano.rim)).clamp(0.0, 1.0);
    let beyond = smooth(-inside_m / (0.25 * volcano.radius_m));
    volcano.height_m * left * left * (1.0 - ravine_depth(volcano, place) * beyond)
}
