//! The maps of open worlds at their zoom levels, from which tiles are drawn.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, OnceLock};

use crate::clock::Clock;
use crate::error::Error;
use crate::explore::tile_address::{Stage, pixel_m};
use crate::explore::worlds::Opened;
use crate::map::Chart;
use crate::map::scale::Scale;
use crate::map::style::Style;

/// Largest number of levels that are kept, where each stage counts as a level. A level remembers its land
/// ([`Chart::REMEMBERED`]) and what is planned on it.
const MOST: usize = 4;

/// Pixels in a millimetre on screens, by which lines and letters get their size.
const PIXELS_A_MM: f64 = 96.0 / 25.4;

/// The maps of a level in the styles that were asked for. They share their land.
#[derive(Default)]
struct ChartsByStyle(Mutex<BTreeMap<&'static str, Arc<OnceLock<Arc<Chart>>>>>);

/// The kept levels, most recently used first.
#[derive(Default)]
pub(super) struct Charts(Mutex<VecDeque<(Key, Arc<ChartsByStyle>)>>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Key {
    world: blake3::Hash,
    stage: Stage,
    zoom: u8,
    is_dense: bool,
}

impl Charts {
    /// Returns the map of a world at a zoom level.
    ///
    /// # Errors
    /// When there is no such style, the world lacks what it shows, or `clock` stops the work.
    pub fn chart(
        &self,
        opened: &Opened,
        (zoom, is_dense): (u8, bool),
        style: &'static str,
        stage: Stage,
        clock: &Clock,
    ) -> Result<Arc<Chart>, Error> {
        let level = self.level(Key { world: opened.digest, stage, zoom, is_dense });
        let (slot, other) = {
            let mut styles = level.0.lock().expect("no thread panics while it looks for a style");
            let other = styles.values().find_map(|slot| slot.get().cloned());
            (styles.entry(style).or_default().clone(), other)
        };
        if let Some(chart) = slot.get() {
            return Ok(chart.clone());
        }
        let mut drawn = Style::load(style)?;
        drawn.check_for(&opened.world)?;
        if stage != Stage::Full {
            // Glances and drafts leave out what must be planned on all the land around, and what is written around it.
            drawn.contours.draw = false;
            drawn.roads.draw = false;
            drawn.places.draw = false;
            drawn.labels.draw = false;
        }
        let dense = if is_dense { 2.0 } else { 1.0 };
        let metres_per_pixel = pixel_m(opened.world.spacing_m(), zoom) / dense;
        let scale = Scale { metres_per_pixel, pixels_per_mm: PIXELS_A_MM * dense };
        let chart = match (other, stage.halvings()) {
            (Some(other), _) => other.in_style(drawn, clock)?,
            (None, Some(halvings)) => Chart::sketch(&opened.world, drawn, scale, halvings, clock)?,
            (None, None) => Chart::of_world(&opened.world, drawn, scale, clock)?,
        };
        // Two threads may have made the same chart at once: one of them is dropped.
        Ok(slot.get_or_init(|| chart).clone())
    }

    fn level(&self, key: Key) -> Arc<ChartsByStyle> {
        let mut kept = self.0.lock().expect("no thread panics while it looks for a level");
        let at = kept.iter().position(|(known, _)| *known == key);
        let level = at.and_then(|at| kept.remove(at)).map_or_else(Arc::default, |(_, level)| level);
        kept.push_front((key, level.clone()));
        kept.truncate(MOST);
        level
    }
}
