//! The laws of the land at one place: values from which slopes follow. They differ from place to place, over kilometres
//! and more.

use super::fields::Fields;
use super::settings::FluvialSettings;
use crate::grain_point::Point;
use crate::noise::point_noise::PointField;

/// The laws of the land at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laws {
    /// Slope of hillsides.
    pub hill_slope: f64,
    /// Slope of a river that drains one cell of the trunk lattice, if nothing keeps it gentler.
    pub bed_slope: f64,
    /// Slope that no river exceeds, as a share of the slope of hillsides.
    pub channel_slope: f64,
}

impl Laws {
    /// Returns the least and the greatest value of each law over all places of a land with these settings.
    pub fn bounds(settings: &FluvialSettings) -> [Laws; 2] {
        let [low, high] = settings.hill_slope;
        let everywhere = Laws { hill_slope: 0.0, bed_slope: 0.0, channel_slope: settings.channel_slope };
        let bound = |hill_slope, uplift| Laws { hill_slope, bed_slope: settings.trunk_slope * uplift, ..everywhere };
        [bound(low.min(high), settings.uplift.least), bound(low.max(high), 1.0)]
    }

    /// Returns the slope of a river, by the area that it drains, in cells of the trunk lattice.
    pub fn river_slope(&self, area: f64) -> f64 {
        let slope = self.bed_slope / area.sqrt();
        // Stay below a fixed share of the hill slope; otherwise hillsides could not rise from the channel.
        slope / (1.0 + slope / self.steepest_river())
    }

    /// Returns the slope that no river exceeds.
    pub fn steepest_river(&self) -> f64 {
        self.channel_slope * self.hill_slope
    }
}

impl Fields {
    /// Returns the laws at a point.
    pub fn laws(&self, at: Point) -> Laws {
        self.laws_by(self.uplift.at(at))
    }

    /// Returns the [laws](Fields::laws) at any number of points, for callers that know all points beforehand.
    pub fn all_laws(&self, points: &[Point]) -> Vec<Laws> {
        self.uplift.at_all(points).into_iter().map(|noise| self.laws_by(noise)).collect()
    }

    /// Returns the laws where the uplift's noise has this value: the land rises at a rate from `uplift.least` to 1.
    fn laws_by(&self, noise: f64) -> Laws {
        let FluvialSettings { uplift, hill_slope: [low, high], trunk_slope, .. } = self.settings();
        let t = ((noise - uplift.mask.from) / (uplift.mask.to - uplift.mask.from)).clamp(0.0, 1.0);
        let uplift = uplift.least + (1.0 - uplift.least) * t * t * (3.0 - 2.0 * t);
        Laws { hill_slope: low + (high - low) * uplift, bed_slope: trunk_slope * uplift, ..*self.most_laws() }
    }
}
