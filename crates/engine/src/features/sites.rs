//! Settlements as features.

use std::sync::Arc;

use crate::area::Area;
use crate::clock::Clock;
use crate::features::layer::{Column, GeometryType, Layer, ValueKind, point};
use crate::features::lines::roads_through;
use crate::features::plane::metres;
use crate::lines::{LineId, SiteId};
use crate::places::site::{Site, SiteClass};
use crate::stop::Stopped;
use crate::world::World;

/// A settlement.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteFeature {
    /// Identifier, unique in the world.
    pub id: SiteId,
    /// Name on maps.
    pub name: String,
    /// Size class.
    pub class: SiteClass,
    /// Number of inhabitants.
    pub population: u32,
    /// Height of the land in metres.
    pub height_m: f32,
    /// Position in metres east and north.
    pub at: [f64; 2],
}

/// The layer of the settlements in an area, and of those outside it to which roads of the area lead.
pub static SITES: Layer<Arc<Site>, SiteFeature> = Layer {
    name: "sites",
    about: "settlements, also those elsewhere that the roads of the region lead to; metres",
    shape: GeometryType::Point,
    columns: &[
        Column::new("id", ValueKind::Text, |site| site.id.to_string().into()),
        Column::new("name", ValueKind::Text, |site| site.name.clone().into()),
        Column::new("class", ValueKind::Text, |site| site.class.name().into()),
        Column::new("population", ValueKind::Integer, |site| i64::from(site.population).into()),
        Column::new("height_m", ValueKind::Real32, |site| site.height_m.into()),
    ],
    sources,
    key: |site| site.id.to_string().into(),
    feature: |world, site, _| Ok(SiteFeature::new(world, site)),
    lines: |site| point(site.at),
};

impl SiteFeature {
    /// Makes the feature of a settlement.
    pub fn new(world: &World, site: &Site) -> SiteFeature {
        SiteFeature {
            id: site.id,
            name: site.name.clone(),
            class: site.class,
            population: site.population,
            height_m: site.height_m,
            at: metres(site.at.map(|at| at as f64), world.spacing_m()),
        }
    }
}

fn sources(world: &World, area: &Area, clock: &Clock) -> Result<Vec<Arc<Site>>, Stopped> {
    let mut sites = world.sites(area, clock)?;
    // Without the ends of roads, a road could refer to a settlement that is in no table.
    for road in roads_through(world, area, clock)? {
        let LineId::Road { from, to, .. } = road.id else { continue };
        sites.extend(world.site(from, clock)?.into_iter().chain(world.site(to, clock)?));
    }
    Ok(sites)
}
