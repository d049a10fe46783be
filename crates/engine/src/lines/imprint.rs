//! The imprint: what all lines together do to an area of land.
//!
//! Its parts are one for each way in which lines are made ([`Bed`]); the order of lines does not matter.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::built::Built;
use crate::lines::drain;
use crate::lines::dug::Dug;
use crate::lines::trodden::Trodden;
use crate::lines::{Bed, Line};

/// What all lines together do to the vertices of an area.
#[derive(Clone, Debug)]
pub struct Imprint {
    area: Area,
    built: Option<Built>,
    trodden: Option<Trodden>,
    dug: Option<Dug>,
}

impl Imprint {
    /// What `lines` do to the bare heights of land, and the water on it if that is known; `None` where they do nothing.
    pub fn new<'a>(
        heights: &Grid<f32>,
        water: Option<&Water>,
        lines: impl IntoIterator<Item = &'a Line>,
    ) -> Option<Imprint> {
        let area = heights.area();
        let mut imprint = Imprint::blank(area);
        for line in lines.into_iter().filter(|line| line.bounds.common(&area).is_some()) {
            match line.bed {
                Bed::Natural => {}
                Bed::Dug { .. } => imprint.dug.get_or_insert_with(|| Dug::blank(area)).add(line, heights),
                Bed::Trodden { .. } => imprint.trodden.get_or_insert_with(|| Trodden::blank(area)).add(line),
                Bed::Built { .. } => imprint.built.get_or_insert_with(|| Built::blank(area)).add(line),
            }
        }
        if let (Some(built), Some(water)) = (&mut imprint.built, water) {
            built.spare(water);
        }
        (!imprint.is_blank()).then_some(imprint)
    }

    /// What a kernel elsewhere has computed that agents' `lines` do, once the land is shaped: metres that are cut, and shares of sand,
    /// water and dirt.
    #[cfg(feature = "gpu")]
    pub(crate) fn of_planes<'a>(
        [cut_m, sand, water, dirt]: [Grid<f32>; 4],
        lines: impl IntoIterator<Item = &'a Line>,
    ) -> Imprint {
        let area = cut_m.area();
        let (mut is_dug, mut is_trodden) = (false, false);
        for line in lines.into_iter().filter(|line| line.bounds.common(&area).is_some()) {
            is_dug |= matches!(line.bed, Bed::Dug { .. });
            is_trodden |= matches!(line.bed, Bed::Trodden { .. });
        }
        Imprint {
            area,
            built: None,
            trodden: is_trodden.then(|| Trodden::of_dirt(dirt)),
            dug: is_dug.then_some(Dug { cut_m, sand, water }),
        }
    }

    /// Nothing done to `area`.
    pub(crate) fn blank(area: Area) -> Imprint {
        Imprint { area, built: None, trodden: None, dug: None }
    }

    fn is_blank(&self) -> bool {
        self.built.is_none() && self.trodden.is_none() && self.dug.is_none()
    }

    /// The area of bare land that must be known to shape an area.
    pub fn input(area: Area) -> Area {
        drain::input(area)
    }

    /// Shapes the heights of bare land: roads cut and fill it, and what they dam is drained; others are levelled; rivers cut through all.
    /// Of drains some are missing near the border, where [`input`](Imprint::input) has more than is asked for.
    pub fn shape(&self, heights: &mut Grid<f32>, water: Option<&Water>) {
        if let Some(built) = &self.built {
            let bare = heights.clone();
            built.shape(heights);
            if let Some(water) = water {
                let wet: Vec<bool> = water.kind.values().iter().map(|kind| *kind != WaterKind::Dry).collect();
                drain::drain(&bare, &wet, heights);
            }
        }
        if let Some(trodden) = &self.trodden {
            trodden.shape(heights);
        }
        if let Some(dug) = &self.dug {
            dug.shape(heights);
        }
    }

    /// What is done to a part of the area, which must be within it.
    #[must_use]
    pub fn part(&self, area: Area) -> Imprint {
        Imprint {
            area,
            built: self.built.as_ref().map(|built| built.part(area)),
            trodden: self.trodden.as_ref().map(|trodden| trodden.part(area)),
            dug: self.dug.as_ref().map(|dug| dug.part(area)),
        }
    }

    /// The vertices that it covers.
    pub fn area(&self) -> Area {
        self.area
    }

    /// What built roads do, if there are any.
    pub fn built(&self) -> Option<&Built> {
        self.built.as_ref()
    }

    /// What trodden roads do, if there are any.
    pub fn trodden(&self) -> Option<&Trodden> {
        self.trodden.as_ref()
    }

    /// What dug rivers do, if there are any.
    pub fn dug(&self) -> Option<&Dug> {
        self.dug.as_ref()
    }

    /// Share of sand by a river at each vertex, 0 to 1, if any river brings it.
    pub fn sand(&self) -> Option<&Grid<f32>> {
        self.dug.as_ref().map(|dug| &dug.sand)
    }

    /// Shares of dirt by roads at each vertex, 0 to 1: of trodden ones and of built ones.
    pub fn dirt(&self) -> impl Iterator<Item = &Grid<f32>> {
        let trodden = self.trodden.as_ref().map(|trodden| &trodden.dirt);
        trodden.into_iter().chain(self.built.as_ref().map(|built| &built.share))
    }

    /// Adds what another imprint of dug and trodden lines does to a part of this one's area.
    pub(crate) fn merge(&mut self, other: &Imprint) {
        if let Some(dug) = &other.dug {
            self.dug.get_or_insert_with(|| Dug::blank(self.area)).merge(dug);
        }
        if let Some(trodden) = &other.trodden {
            self.trodden.get_or_insert_with(|| Trodden::blank(self.area)).merge(trodden);
        }
    }

    /// Does only a share of it to a vertex, of what dug and trodden lines do.
    pub(crate) fn weaken(&mut self, x: i64, y: i64, share: f32) {
        if let Some(dug) = &mut self.dug {
            dug.weaken(x, y, share);
        }
        if let Some(trodden) = &mut self.trodden {
            trodden.weaken(x, y, share);
        }
    }
}
