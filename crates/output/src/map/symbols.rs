//! Symbols of settlements and peaks, on maps and in their legends.

use glam::DVec2;

use crate::map::plotter::{Plotter, Shape};
use crate::map::scale::Scale;
use crate::map::style::{Colour, Style};
use crate::places::site::SiteClass;

/// Radius of a settlement's symbol in pixels.
pub(super) fn site_px(class: SiteClass, scale: Scale) -> f64 {
    scale.pixels(match class {
        SiteClass::Hamlet => 0.42,
        SiteClass::Village => 0.6,
        SiteClass::Town => 0.85,
    })
}

/// Draws a settlement: a ring, with a dot inside for a town.
pub(super) fn draw_site(plotter: &mut dyn Plotter, at: DVec2, class: SiteClass, scale: Scale, style: &Style) {
    let radius = site_px(class, scale);
    plotter.dot(at, radius, style.places.colour);
    plotter.dot(at, radius - scale.pixels(0.2), style.places.fill);
    if class == SiteClass::Town {
        plotter.dot(at, radius - scale.pixels(0.45), style.places.colour);
    }
}

/// Half of the width and height of a peak's symbol, in pixels.
pub(super) fn peak_px(scale: Scale) -> f64 {
    scale.pixels(0.6)
}

/// Draws a peak: a triangle.
pub(super) fn draw_peak(plotter: &mut dyn Plotter, at: DVec2, scale: Scale, colour: Colour) {
    let half = peak_px(scale);
    let corners = [[-half, 0.5 * half], [0.0, -half], [half, 0.5 * half], [-half, 0.5 * half]];
    let ring = corners.map(|corner| at + DVec2::from(corner)).into();
    plotter.fill(&Shape::new(vec![ring]), colour);
}
