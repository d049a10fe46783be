//! Worlds: checked presets with a seed, from which any tile can be made.

use std::sync::Arc;

use crate::agents::order_free::Agents;
use crate::area::{Area, Stride};
use crate::clock::Clock;
use crate::error::Error;
use crate::fluvial::Fluvial;
use crate::fluvial::landforms::Landforms;
use crate::fluvial::landforms::coast::Coast;
use crate::fluvial::landforms::lakes::Lake;
use crate::fluvial::landforms::peaks::Peak;
use crate::fluvial::survey::Surveyed;
use crate::geography::Geography;
use crate::grain_point::GRAINS;
use crate::lines::{ChannelId, LakeId, LineKind, Lines, SiteId};
use crate::memory::{Budget, Remembers, Usage};
use crate::names::Names;
use crate::names::cultures::Cultures;
use crate::places::Places;
use crate::places::site::Site;
use crate::preset::Preset;
use crate::relief::{NoiseRelief, Relief};
use crate::stop::Stopped;

/// A world, ready to be baked: each of its tiles is a pure function of the world and of the tile's place.
#[derive(Debug)]
pub struct World {
    preset: Preset,
    seed: u64,
    /// The seed of every random choice: the world's seed with the preset's country mixed in.
    chance: u64,
    stride: Stride,
    tile_cells: u32,
    relief: Relief,
    agents: Agents,
    places: Option<Places>,
    names: Option<Names>,
    landforms: Landforms,
    budget: Option<Arc<Budget>>,
}

impl World {
    /// Makes the world of a preset, with the preset's own seed unless another is given.
    ///
    /// # Errors
    /// When the preset has an error, such as a value out of its range.
    pub fn new(preset: Preset, seed: Option<u64>) -> Result<World, Error> {
        World::strided(preset, seed, Stride::ONE)
    }

    /// Makes the world of a preset at the nodes of a stride. Tiles, areas and lines are counted in nodes, and the
    /// spacing is the distance from one node to the next.
    ///
    /// Detail too small for the nodes enters as its mean. Strides of two vertices and more have no settlements, no
    /// roads, and no lines of agents.
    ///
    /// # Errors
    /// When the preset has an error, such as a value out of its range.
    pub fn strided(mut preset: Preset, seed: Option<u64>, stride: Stride) -> Result<World, Error> {
        preset.fill_defaults();
        preset.check()?;
        let seed = seed.unwrap_or(preset.seed);
        let chance = preset.chance(seed);
        let Preset { spacing_m, sea_level_m, .. } = preset;
        let metres_a_grain = spacing_m / GRAINS as f64;
        let shape = |settings| Arc::new(Geography::new(settings, metres_a_grain, chance));
        let geography = preset.geography.as_ref().map(shape);
        let cultures = geography.iter().cloned().map(|it| Arc::new(Cultures::new(it, metres_a_grain, chance))).next();
        let places = World::settled(&preset, chance, cultures)?;
        let names = places.as_ref().map(|places| places.names().clone());
        let grow =
            |settings| Fluvial::new(settings, geography, (spacing_m, stride), sea_level_m, chance, names.clone());
        let fluvial = preset.fluvial.as_ref().map(grow);
        Ok(World::grown(preset, seed, stride, fluvial, places, names))
    }

    /// Returns the same world at the nodes of another stride, with the tile size of the preset. The two worlds share
    /// one memory of channels, so each knows the channels that the other has found.
    #[must_use]
    pub fn at_stride(&self, stride: Stride) -> World {
        self.regrown(stride, |fluvial| fluvial)
    }

    /// Does the same as [`World::at_stride`], for a picture that has to be ready soon and is replaced later: fluvial
    /// land is coarser than its nodes could show.
    #[must_use]
    pub fn sketch_at_stride(&self, stride: Stride) -> World {
        self.regrown(stride, Fluvial::sketched)
    }

    fn regrown(&self, stride: Stride, change: impl FnOnce(Fluvial) -> Fluvial) -> World {
        let World { preset, seed, chance, names, .. } = self;
        let fluvial = self.relief.fluvial().map(|fluvial| fluvial.at_stride(stride)).map(change);
        let cultures = names.as_ref().and_then(Names::cultures).cloned();
        let places = World::settled(preset, *chance, cultures).expect("this world was made of the same settings");
        let world = World::grown(preset.clone(), *seed, stride, fluvial, places, names.clone());
        match &self.budget {
            Some(budget) => world.within(budget),
            None => world,
        }
    }

    /// Returns the settlements and roads of a preset, if it has any, with the peoples of its geography.
    fn settled(preset: &Preset, chance: u64, cultures: Option<Arc<Cultures>>) -> Result<Option<Places>, Error> {
        let settle = |settings| Places::new(settings, preset.spacing_m, chance, cultures);
        preset.places.as_ref().map(settle).transpose()
    }

    /// Builds the world of a checked preset at the nodes of a stride, given its fluvial relief if it has one.
    fn grown(
        preset: Preset,
        seed: u64,
        stride: Stride,
        fluvial: Option<Fluvial>,
        places: Option<Places>,
        names: Option<Names>,
    ) -> World {
        let chance = preset.chance(seed);
        let Preset { spacing_m, sea_level_m, tile_cells, .. } = preset;
        let relief = fluvial.map(Arc::new).map_or_else(
            || {
                let (warp, land) = (preset.warp.as_ref(), preset.land.as_ref());
                Relief::Noise(Arc::new(NoiseRelief::new(&preset.noise, warp, land, (spacing_m, stride), chance)))
            },
            Relief::Fluvial,
        );
        let is_whole = stride == Stride::ONE;
        let places = places.filter(|_| is_whole);
        let agents = (preset.rivers.as_ref().filter(|_| is_whole), preset.roads.as_ref().filter(|_| is_whole));
        let agents = Agents::new(agents, tile_cells, spacing_m, sea_level_m, preset.ground.slope_scale, chance);
        World {
            preset,
            seed,
            chance,
            stride,
            tile_cells,
            relief,
            agents,
            places,
            names,
            landforms: Landforms::default(),
            budget: None,
        }
    }

    /// Returns warnings about settings that are allowed but probably not meant, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let ((min_m, max_m), preset) = (self.height_range_m(), &self.preset);
        let Some(sea_m) = preset.sea_level_m else { return Vec::new() };
        let sentence = match &preset.fluvial {
            // The land's ceiling is a height above 0 m, which does not sink with the sea.
            Some(fluvial) if sea_m < -fluvial.ceiling_m => format!(
                "the sea at {sea_m} m lies so far below ceiling_m = {} that heights of 16 bits are {:.2} m apart; a higher \
                 sea_level_m wastes less",
                fluvial.ceiling_m,
                (max_m - min_m) / 65535.0,
            ),
            None if sea_m <= min_m as f64 => {
                format!("nothing is as low as the sea at {sea_m} m: all heights exceed {min_m} m")
            }
            None if sea_m >= max_m as f64 => format!("all is under the sea at {sea_m} m: no height exceeds {max_m} m"),
            _ => return Vec::new(),
        };
        vec![sentence]
    }

    /// Returns the preset, with every default filled in.
    pub fn preset(&self) -> &Preset {
        &self.preset
    }

    /// Returns the seed in use as it was given, for display.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the seed of every random choice, from which all [streams](crate::hash::stream) are derived:
    /// [`Preset::chance`].
    pub fn chance(&self) -> u64 {
        self.chance
    }

    /// Returns the stride of the world's nodes: 1 if they are all vertices.
    pub fn stride(&self) -> Stride {
        self.stride
    }

    /// Returns the geography of a whole world; none in a world whose preset holds everywhere.
    pub fn geography(&self) -> Option<&Arc<Geography>> {
        self.relief.fluvial()?.fields().geography()
    }

    /// Returns the metres between neighbouring nodes: the preset's spacing, times the stride.
    pub fn spacing_m(&self) -> f64 {
        self.preset.spacing_m * self.stride.vertices() as f64
    }

    /// Returns the number of cells a tile side.
    pub fn tile_cells(&self) -> u32 {
        self.tile_cells
    }

    /// Returns the same world with tiles of so many cells a side.
    #[must_use]
    pub fn with_tile_cells(self, tile_cells: u32) -> World {
        World { tile_cells, ..self }
    }

    /// Returns the same world with its memories limited by a budget, which others may share. The worlds at other
    /// strides that are made from it share the budget too. Values that are forgotten are computed again, with the same
    /// result.
    #[must_use]
    pub fn within(self, budget: &Arc<Budget>) -> World {
        self.memories().into_iter().for_each(|memory| memory.share(budget));
        World { budget: Some(Arc::clone(budget)), ..self }
    }

    /// Returns the budget that limits this world's memories, if it shares one.
    pub fn budget(&self) -> Option<&Arc<Budget>> {
        self.budget.as_ref()
    }

    /// Returns the relief, the source of the heights: noise, or fluvial with rivers and the land between them.
    pub fn relief(&self) -> &Relief {
        &self.relief
    }
}

#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
impl World {
    /// Returns all rivers and roads that lie on `area` or may affect one of its vertices, each whole, sorted by id.
    pub fn lines(&self, area: &Area, clock: &Clock) -> Result<Lines, Stopped> {
        let Some(land) = self.relief.fluvial() else { return self.agents.touching(&self.relief, area, clock) };
        let Some(places) = &self.places else { return land.rivers(area, clock) };
        // Each takes one thread, and a single tile has no other work.
        let (rivers, roads) =
            rayon::join(|| land.rivers(area, clock), || places.roads(Surveyed { survey: land, clock }, area));
        // Ids of rivers are less than those of roads.
        let mut lines = rivers?;
        lines.extend(roads?);
        Ok(lines)
    }

    /// Returns all lines of a kind that touch the rectangle spanned by the outer vertices of an area, each whole,
    /// sorted by id.
    pub fn lines_through(&self, kind: LineKind, area: &Area, clock: &Clock) -> Result<Lines, Stopped> {
        let mut lines = match (self.relief.fluvial(), kind, &self.places) {
            (Some(land), LineKind::River, _) => return land.rivers(area, clock),
            (Some(land), LineKind::Road, Some(places)) => places.roads(Surveyed { survey: land, clock }, area)?,
            (Some(_), LineKind::Road, None) => Lines::new(),
            (None, ..) => self.agents.touching(&self.relief, area, clock)?,
        };
        lines.retain(|line| line.kind == kind && line.touches(area));
        Ok(lines)
    }

    /// Returns all lakes of a fluvial world that touch `area`, each whole, sorted by id.
    pub fn lakes(&self, area: &Area, clock: &Clock) -> Result<Vec<Arc<Lake>>, Stopped> {
        self.wide_lakes(area, 0.0, clock)
    }

    /// Returns the same lakes, but only of the levels on which some are at least so wide: `least_half_width_m` is half
    /// the width in metres. Where most lakes are narrow this saves most of the work.
    pub fn wide_lakes(&self, area: &Area, least_half_width_m: f64, clock: &Clock) -> Result<Vec<Arc<Lake>>, Stopped> {
        self.fluvial(|fluvial| self.landforms.lakes(fluvial, area, least_half_width_m, clock))
    }

    /// Returns all pieces of coast of a fluvial world that touch `area`, each whole, sorted by id.
    pub fn coasts(&self, area: &Area, clock: &Clock) -> Result<Vec<Arc<Coast>>, Stopped> {
        self.fluvial(|fluvial| self.landforms.coasts(fluvial, area, clock))
    }

    /// Returns all peaks of a fluvial world on vertices of `area`, sorted by id.
    pub fn peaks(&self, area: &Area, clock: &Clock) -> Result<Vec<Peak>, Stopped> {
        self.fluvial(|fluvial| self.landforms.peaks(fluvial, area, clock))
    }

    /// Returns the lake of an id, if there is one.
    pub fn lake(&self, id: LakeId, clock: &Clock) -> Result<Option<Arc<Lake>>, Stopped> {
        self.fluvial(|fluvial| self.landforms.lake(fluvial, id, clock))
    }

    /// Returns the rivers of the course that begins in a channel, from its spring to its end; none if no course begins
    /// there.
    pub fn rivers_from(&self, top: ChannelId, clock: &Clock) -> Result<Lines, Stopped> {
        self.fluvial(|fluvial| fluvial.rivers_from(top, clock))
    }

    /// Returns the peak of a cell, if it has one.
    pub fn peak(&self, cell: (i64, i64), clock: &Clock) -> Result<Option<Peak>, Stopped> {
        self.fluvial(|fluvial| self.landforms.peak(fluvial, cell, clock))
    }

    /// Returns the peak of the high ground around a vertex of a fluvial world, if one is near. It is one of
    /// [all](World::peaks).
    pub fn peak_above(&self, at: [i64; 2], clock: &Clock) -> Result<Option<Peak>, Stopped> {
        self.fluvial(|fluvial| self.landforms.peak_above(fluvial, at, clock))
    }

    /// Returns the results of `find` in fluvial land, or nothing in a world of noise.
    fn fluvial<T: Default>(&self, find: impl FnOnce(&Fluvial) -> Result<T, Stopped>) -> Result<T, Stopped> {
        self.relief.fluvial().map_or_else(|| Ok(T::default()), find)
    }

    /// Returns all settlements on vertices of `area`, sorted by id; none in a world without places.
    pub fn sites(&self, area: &Area, clock: &Clock) -> Result<Vec<Arc<Site>>, Stopped> {
        self.settled_land(clock, |places, ground| places.sites(ground, area))
    }

    /// Returns the settlement of a site cell, if it has one; none in a world without places.
    pub fn site(&self, id: SiteId, clock: &Clock) -> Result<Option<Arc<Site>>, Stopped> {
        self.settled_land(clock, |places, ground| places.site(ground, id))
    }

    /// Returns the first town of a square of `side` x `side` site cells, given by its column and row among such
    /// squares, if it has one; none in a world without places.
    pub fn chief_site(&self, square: [i64; 2], side: i64, clock: &Clock) -> Result<Option<Arc<Site>>, Stopped> {
        self.settled_land(clock, |places, ground| places.chief(ground, square, side))
    }

    /// Returns the results of `find` in land with places, or nothing.
    fn settled_land<T: Default>(
        &self,
        clock: &Clock,
        find: impl FnOnce(&Places, Surveyed<'_>) -> Result<T, Stopped>,
    ) -> Result<T, Stopped> {
        let settled = self.places.as_ref().zip(self.relief.fluvial());
        settled.map_or_else(|| Ok(T::default()), |(places, land)| find(places, Surveyed { survey: land, clock }))
    }
}

impl World {
    /// Returns the settlements and roads of this world, and the memories of both.
    pub fn places(&self) -> Option<&Places> {
        self.places.as_ref()
    }

    /// Returns the names of this world's features; none in a world without places.
    pub fn names(&self) -> Option<&Names> {
        self.names.as_ref()
    }

    /// Enlarges the memories to what it takes to bake a region of so many columns row by row.
    pub fn prepare_for(&self, cols: u64) {
        self.agents.prepare_for(cols);
    }

    /// Returns the largest number of bytes that this world's memories may hold while a region of so many columns is
    /// baked.
    pub fn memory_bytes(&self, cols: u64) -> u64 {
        self.prepare_for(cols);
        self.usages().iter().map(|usage| usage.most as u64).sum()
    }

    /// Returns the number of bytes that this world's memories hold.
    pub fn remembered_bytes(&self) -> u64 {
        self.usages().iter().map(|usage| usage.held as u64).sum()
    }

    /// Returns the memory use of each memory, of all stages.
    pub fn usages(&self) -> Vec<Usage> {
        self.memories().into_iter().map(Remembers::usage).collect()
    }

    /// The memories of all stages.
    fn memories(&self) -> Vec<&dyn Remembers> {
        let relief = self.relief.fluvial().map(Fluvial::memories).unwrap_or_default();
        let places = self.places.as_ref().map(Places::memories).unwrap_or_default();
        let features = self.relief.fluvial().map(|_| self.landforms.memories()).unwrap_or_default();
        [relief, self.agents.memories(), places, features].concat()
    }

    /// Returns the approximate number of vertices around an area that are planned in order to make the area.
    pub fn planned_around(&self) -> i64 {
        // The surroundings ask in turn for their own surroundings: measured on bakes of 1 x 1 to 16 x 16 tiles of alps.
        const IN_TURN: f64 = 1.25;
        let trunks =
            self.relief.fluvial().map_or(0, |fluvial| 2 * fluvial.fields().side(0) / GRAINS / self.stride.vertices());
        let places = self.places.as_ref().map_or(0, Places::reach);
        ((IN_TURN * trunks.max(places) as f64) as i64).max(self.agents.reach())
    }

    /// Returns the number of vertices around an area that need as much planning as the area itself. Further away less
    /// and less is planned. Roads take longest, and they lead only to the next settlement.
    pub fn planned_whole_around(&self) -> i64 {
        // Measured on shards of 2 x 2 to 16 x 16 tiles of alps.
        const SITES: f64 = 1.2;
        match &self.places {
            Some(places) => ((SITES * places.site_side() as f64) as i64).max(self.agents.reach()),
            None => self.planned_around(),
        }
    }

    /// Returns bounds in metres, (lowest, highest), that no height of this world can leave. 16-bit heights are encoded
    /// in this range.
    ///
    /// The bounds are those of the relief, less the depth to which rivers cut into its lowest ground.
    pub fn height_range_m(&self) -> (f32, f32) {
        let (min_m, max_m) = self.relief.range_m();
        // A river's floor lies at most its depth below some height of the land; a thousandth more allows for rounding.
        let depth_m = self.preset.rivers.as_ref().map_or(0.0, |rivers| rivers.depth_m[1] * 1.001);
        (min_m - depth_m as f32, max_m)
    }
}
