//! The stages that make land of segments, one after the other, and the areas that they read.

use super::Fluvial;
use super::breach;
use super::coast;
use super::detail::Detail;
use super::gullies::{self, Gullies};
use super::hillsides::Hillsides;
use super::ice_sheet;
use super::moraine;
use super::segment::{Reach, Segments};
use super::skerries::AreaSkerries;
use super::valley::{self, FillValleys, Valleys};
use super::warp::Displaced;
use super::water::{self, FillWater, ShownRivers};
use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::grain_point::Point;
use crate::land::Land;
use crate::simd::dispatch;
use crate::stop::Stopped;

/// Land with valleys and gullies only, before any other stage.
#[derive(Debug)]
struct Carved {
    nodes: Displaced,
    hillsides: Hillsides,
    valleys: Valleys,
}

impl Fluvial {
    /// Returns the gullies for a detail, if it has gullies.
    fn gullies(&self, detail: Detail) -> Option<&Gullies> {
        let doubled = (detail.step / self.stride).max(1).ilog2();
        self.gullies.get(doubled as usize).filter(|_| detail.gullies)
    }

    /// Returns the nodes whose warp is read to make those of an area.
    pub(super) fn around(&self, area: Area, detail: Detail) -> Area {
        let carved = Fluvial::carved(area, detail);
        let bare = self.gullies(detail).map_or(carved, |_| gullies::input(carved));
        valley::input(water::input(area).hull(&bare))
    }

    /// Returns the nodes whose valleys are read to make those of an area.
    fn around_valleys(&self, area: Area, detail: Detail) -> Area {
        let carved = Fluvial::carved(area, detail);
        valley::input(self.gullies(detail).map_or(carved, |_| gullies::valley_input(carved)))
    }

    /// Returns the nodes whose carved land is read to make those of an area.
    fn carved(area: Area, detail: Detail) -> Area {
        if detail.breaches { breach::input(area) } else { area }
    }

    /// Makes the land at the nodes of an area. `segments` holds at least the segments of channels around it.
    pub(super) fn land_of(
        &self,
        segments: &Segments,
        area: Area,
        detail: Detail,
        clock: &Clock,
    ) -> Result<Land, Stopped> {
        let carved = self.carve(segments, area, detail, clock)?;
        self.fill_in(segments, area, detail, carved, clock)
    }

    /// Makes valleys around an area of nodes, and carves gullies into their sides.
    fn carve(&self, segments: &Segments, area: Area, detail: Detail, clock: &Clock) -> Result<Carved, Stopped> {
        let nodes = clock.time(stage::WARP, || self.warp.fill(self.around(area, detail), detail.step))?;
        let hillsides = Hillsides::new(&self.fields, nodes.area, detail, self.reach(detail));
        let gullies = self.gullies(detail);
        let read_m = self.crest_read_m(gullies);
        let part = self.around_valleys(area, detail);
        let mut valleys =
            clock.time(stage::VALLEYS, || self.valleys(&nodes, part, &hillsides, segments, read_m, clock))??;
        if let Some(gullies) = gullies {
            clock.time(stage::GULLIES, || gullies.carve(&nodes, &hillsides, &mut valleys, clock))??;
        }
        Ok(Carved { nodes, hillsides, valleys })
    }

    /// Adds the stages after valleys and gullies: moraines, barriers, volcanoes, glaciers, coast, breaches,
    /// water, dunes, small forms and ice sheets.
    fn fill_in(
        &self,
        segments: &Segments,
        area: Area,
        detail: Detail,
        carved: Carved,
        clock: &Clock,
    ) -> Result<Land, Stopped> {
        let Carved { nodes, hillsides, mut valleys } = carved;
        if let Some(moraines) = &self.moraines {
            clock.time(stage::MORAINES, || moraines.raise(segments, &nodes, &mut valleys, clock))??;
        }
        if let Some(barriers) = &self.barriers {
            clock.time(stage::BARRIERS, || barriers.raise(segments, &nodes, &mut valleys, clock))??;
        }
        let mut raised_m = None;
        if let Some(cones) = &self.cones {
            raised_m = clock.time(stage::CONES, || cones.raise(segments, &nodes, &mut valleys, clock))??;
        }
        let mut ice_m = None;
        if let Some(glaciers) = &self.glaciers {
            ice_m = Some(clock.time(stage::GLACIERS, || glaciers.ice_m(segments, &nodes, &valleys, clock))??);
        }
        let coast_m = clock.time(stage::COAST, || {
            coast::heights(&self.fields, detail.is_far, &nodes, &hillsides, (&valleys.height_m, raised_m.as_deref()))
        })?;
        if detail.breaches {
            clock.time(stage::BREACHES, || self.breach(nodes.area, segments, coast_m.as_deref(), &mut valleys))?;
        }
        let mut land = clock
            .time(stage::WATER, || self.water(segments, &nodes, &valleys, coast_m.as_deref()).fill(area, clock))??;
        if let Some(dunes) = self.dunes.as_ref().filter(|_| hillsides.sand.any()) {
            clock.time(stage::DUNES, || dunes.raise(&self.fields, segments, &nodes, &mut land, clock))??;
        }
        if let Some(forms) = &self.ground_forms {
            let shape = || forms.shape(&self.fields, segments, &nodes, &mut land, clock);
            clock.time(stage::GROUND_FORMS, shape)??;
        }
        if let Some(water) = &mut land.water {
            water.ice_m = ice_m.map(|ice_m| ice_m.part(area));
        }
        clock.time(stage::ICE_SHEETS, || ice_sheet::bury(&self.fields, &nodes, &mut land))?;
        Ok(land)
    }

    /// Returns the segments of channels that can affect an area of nodes.
    pub(super) fn segments(&self, area: Area, detail: Detail, clock: &Clock) -> Result<Segments, Stopped> {
        let Detail { step, channels, .. } = detail;
        let origin = Point::at_vertex(area.x0 * step, area.y0 * step);
        self.network.segments(channels, self.warp.input(area, step), origin, self.reach(detail), clock)
    }

    /// Distance from a node within which channels are looked for.
    pub(super) fn reach(&self, Detail { channels, brook_cells, .. }: Detail) -> Reach {
        valley::reach_to(&self.fields, channels.levels, brook_cells)
    }

    /// Greatest rise in metres above the lowest valley side up to which gullies and moraines need to know the
    /// next-lowest side.
    pub(super) fn crest_read_m(&self, gullies: Option<&Gullies>) -> f32 {
        let steepest = self.fields.most_laws().hill_slope as f32;
        let by_moraines_m = self.moraines.as_ref().map_or(0.0, |_| moraine::CREST_READ_M);
        let by_gullies_m = gullies.map_or(0.0, |gullies| gullies.crest_read_m(steepest));
        by_gullies_m.max(by_moraines_m)
    }

    /// Makes the valleys at the nodes in `part`, given the hillsides at all nodes. The rise to the next-lowest valley
    /// side is exact up to `read_m` metres.
    pub(super) fn valleys(
        &self,
        nodes: &Displaced,
        part: Area,
        hillsides: &Hillsides,
        segments: &Segments,
        read_m: f32,
        clock: &Clock,
    ) -> Result<Valleys, Stopped> {
        let mut valleys = Valleys::with_len(nodes.area.len());
        let [east, south] = &nodes.metres;
        dispatch(FillValleys {
            fields: &self.fields,
            area: nodes.area,
            part,
            step: nodes.step,
            warp: [east, south],
            hillsides,
            read_m,
            segments,
            out: &mut valleys,
            clock,
        })?;
        Ok(valleys)
    }

    /// Cuts breaches, through which the hollows of carved land drain.
    fn breach(&self, area: Area, segments: &Segments, coast_m: Option<&[f32]>, valleys: &mut Valleys) {
        let Valleys { height_m, segment, .. } = valleys;
        let sea_m = self.fields.sea_level_m() as f32;
        let carved_m = height_m.clone();
        let with_coast_m = coast_m
            .map(|coast_m| carved_m.iter().zip(coast_m).map(|(land, coast)| land.min(*coast)).collect::<Vec<_>>());
        let surface_m = with_coast_m.as_ref().unwrap_or(&carved_m);
        // A lake is level, so no vertex of a lake is a pit.
        let is_lake =
            |at: usize| segments.all.get(segment[at] as usize).is_some_and(|own| (surface_m[at] as f64) < own.pool_m);
        let may_be_pit = |at: usize| surface_m[at] > sea_m && !is_lake(at);
        breach::breach(area, surface_m, may_be_pit, height_m);
    }

    /// Returns the skerries that can lie in an area of nodes `step` vertices apart, if the world has skerries.
    pub(super) fn skerries(&self, area: Area, step: i64) -> Option<AreaSkerries<'_>> {
        Some(self.skerries.as_ref()?.around(&self.fields, area, step))
    }

    /// Prepares the stage that cuts beds and fills in water at the nodes.
    pub(super) fn water<'a>(
        &'a self,
        segments: &'a Segments,
        nodes: &'a Displaced,
        valleys: &'a Valleys,
        coast_m: Option<&'a [f32]>,
    ) -> FillWater<'a> {
        let skerries = self.skerries(nodes.area, nodes.step);
        let rivers = ShownRivers {
            spacing_m: self.node_m() as f32,
            least_m3s: self.fields.spring_m3s(),
            least_area: self.detail.least_area,
            cuts_narrow: self.stride == 1,
        };
        FillWater::new((&self.fields, &self.lift), rivers, segments, nodes, valleys, coast_m, skerries)
    }
}
