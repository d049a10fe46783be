//! The imprint: the effect of all lines together on an area of land.
//!
//! It has one part for each kind of [`Bed`] that changes the land. The order of lines does not matter.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::built::Built;
use crate::lines::drain;
use crate::lines::dug::Dug;
use crate::lines::trodden::Trodden;
use crate::lines::{Bed, Line};

/// The effect of all lines together on the vertices of an area.
#[derive(Clone, Debug)]
pub struct Imprint {
    area: Area,
    built: Option<Built>,
    trodden: Option<Trodden>,
    dug: Option<Dug>,
}

impl Imprint {
    /// Returns the effect of `lines` on land with such bare heights, and with such water if it is known; `None` if they
    /// have none.
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

    /// Returns the effect of agents' `lines` as computed by a GPU kernel that has shaped the land already: metres of
    /// the cut, and shares of sand, water and dirt.
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

    /// Creates an imprint without effect on `area`.
    pub(crate) fn blank(area: Area) -> Imprint {
        Imprint { area, built: None, trodden: None, dug: None }
    }

    fn is_blank(&self) -> bool {
        self.built.is_none() && self.trodden.is_none() && self.dug.is_none()
    }

    /// Returns the area of bare land that must be known to shape an area.
    pub fn input(area: Area) -> Area {
        drain::input(area)
    }

    /// Shapes the heights of bare land: built roads cut and fill it, drains cut through the dams that result if the
    /// water is known, trodden roads level it, and dug rivers cut through all. Near the border some drains are missing,
    /// which is why [`input`](Imprint::input) is larger than the area that is asked for.
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

    /// Returns the effect on a part of the area, which must lie within it.
    #[must_use]
    pub fn part(&self, area: Area) -> Imprint {
        Imprint {
            area,
            built: self.built.as_ref().map(|built| built.part(area)),
            trodden: self.trodden.as_ref().map(|trodden| trodden.part(area)),
            dug: self.dug.as_ref().map(|dug| dug.part(area)),
        }
    }

    /// Returns the area that the imprint covers.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Returns the effect of built roads, if there are any.
    pub fn built(&self) -> Option<&Built> {
        self.built.as_ref()
    }

    /// Returns the effect of trodden roads, if there are any.
    pub fn trodden(&self) -> Option<&Trodden> {
        self.trodden.as_ref()
    }

    /// Returns the effect of dug rivers, if there are any.
    pub fn dug(&self) -> Option<&Dug> {
        self.dug.as_ref()
    }

    /// Returns the share of river sand at each vertex, 0 to 1, if there are dug rivers.
    pub fn sand(&self) -> Option<&Grid<f32>> {
        self.dug.as_ref().map(|dug| &dug.sand)
    }

    /// Returns the shares of road dirt at each vertex, 0 to 1: one grid for trodden roads, one for built roads.
    pub fn dirt(&self) -> impl Iterator<Item = &Grid<f32>> {
        let trodden = self.trodden.as_ref().map(|trodden| &trodden.dirt);
        trodden.into_iter().chain(self.built.as_ref().map(|built| &built.share))
    }

    /// Adds the effect of the dug and trodden lines of another imprint, whose area is a part of this one's.
    pub(crate) fn merge(&mut self, other: &Imprint) {
        if let Some(dug) = &other.dug {
            self.dug.get_or_insert_with(|| Dug::blank(self.area)).merge(dug);
        }
        if let Some(trodden) = &other.trodden {
            self.trodden.get_or_insert_with(|| Trodden::blank(self.area)).merge(trodden);
        }
    }

    /// Reduces the effect of dug and trodden lines on a vertex to a share.
    pub(crate) fn weaken(&mut self, x: i64, y: i64, share: f32) {
        if let Some(dug) = &mut self.dug {
            dug.weaken(x, y, share);
        }
        if let Some(trodden) = &mut self.trodden {
            trodden.weaken(x, y, share);
        }
    }
}
