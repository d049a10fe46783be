//! The lift: the change of heights by layers of rock and by the ceiling. It is strictly increasing, so it makes no
//! pits. Layers begin at the sea's level, so the lift moves no shores.
//!
//! To judge the numbers chosen by eye, look at the cliffs of `canyon`.

use super::fields::Fields;
use super::settings::Strata;
use crate::hash::{self, Stream};

/// The lift of a world.
#[derive(Clone, Debug)]
pub struct Lift {
    strata: Option<Strata>,
    seed: u64,
    /// Height in metres at which the lowest layer begins: the level of the sea, whose floor has no layers.
    datum_m: f64,
    /// Height in metres up to which the ceiling changes nothing.
    knee_m: f64,
    /// Metres from the knee to the ceiling.
    room_m: f64,
}

/// Least share of a layer's full cliff. Chance varies the cliffs, so that no two layers are alike. Chosen by eye.
const LEAST_CLIFF: f64 = 0.4;

impl Lift {
    /// Makes the lift of a world with these fields.
    pub fn new(fields: &Fields, seed: u64) -> Lift {
        let settings = fields.settings();
        let knee_m = settings.knee * settings.ceiling_m;
        let room_m = settings.ceiling_m - knee_m;
        Lift {
            strata: settings.strata.clone(),
            seed: hash::stream(seed, Stream::Strata),
            datum_m: fields.datum_m(),
            knee_m,
            room_m,
        }
    }

    /// Returns the height in metres after layers and ceiling.
    pub fn at(&self, height_m: f64) -> f64 {
        let layered_m = match &self.strata {
            Some(strata) if height_m > self.datum_m => {
                let layers = (height_m - self.datum_m) / strata.thickness_m;
                let layer = layers.floor();
                let within = layers - layer;
                let luck = hash::share(hash::lattice(self.seed, layer as i64, 0));
                let cliff = strata.cliff * (LEAST_CLIFF + (1.0 - LEAST_CLIFF) * luck);
                // A gentle bench below, and the steep cliff above it; together they are as high as the layer is thick.
                let bench = 1.0 - cliff / strata.steepness;
                let risen = if within < bench {
                    within * ((1.0 - cliff) / bench)
                } else {
                    (1.0 - cliff) + (within - bench) * strata.steepness
                };
                self.datum_m + (layer + risen) * strata.thickness_m
            }
            _ => height_m,
        };
        // A hyperbola that leaves the knee with slope 1 and approaches the ceiling at infinity.
        let over = layered_m - self.knee_m;
        if over <= 0.0 { layered_m } else { self.knee_m + over / (1.0 + over / self.room_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_and_ceiling_keep_the_order_of_heights() {
        for name in ["alps", "canyon"] {
            let fields = Fields::of_preset(name, 1, |_| {});
            let lift = Lift::new(&fields, 1);
            let heights: Vec<f64> = (-1000..20_000).map(|half| lift.at(half as f64 / 2.0)).collect();
            assert!(heights.windows(2).all(|pair| pair[0] < pair[1]), "{name}");
            assert!(heights[heights.len() - 1] < fields.settings().ceiling_m, "{name}");
        }
    }
}
