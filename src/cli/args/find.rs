//! Arguments of `find`.

use clap::Args;

use super::shared::{RunOptions, WorldArguments};
use super::values::{parse_kilometres, parse_numbers};

#[derive(Args)]
pub struct FindArguments {
    #[command(flatten)]
    pub world: WorldArguments,
    /// Queries: lake, peak, river, place, hamlet, village or town; on river, on lake or on sea; >, >=, <, <= or = a
    /// number of m2, ha, km2, m, km, m3/s or people. In a whole world also continent, ocean, sea, bay, island, desert,
    /// plain, range or volcano, and biome = the letters of a climate, on coast.
    #[arg(required = true, value_name = "QUERY")]
    #[arg(
        long_help = "What to find, each as one argument: a thing, perhaps what it is on, and any number of bounds.\n\n  thing   lake, peak, river, place (any settlement), hamlet, village or town; or many: lakes\n  on      on river, on lake or on sea\n  bound   >, >=, <, <= or = and a number with its unit; = is as nearly as the number says\n  units   of lakes m2, ha, km2 (area), m, km (height); of peaks m, km; of rivers m, km (length), m3/s;\n          of settlements people, m, km (height); without a unit km2, m, km and people\n\n  \"lake > 2 km2\", \"lakes > 20000 m2 < 40 ha\", \"peak >= 3500 m\", \"river > 50 m3/s\", \"river > 30 km\",\n  \"town on river\", \"village on lake > 300 people\", \"hamlets on sea\", \"place\"\n\nIn a world with a geography also what is large, by its area, volcanoes by their height above their foot, and places\nwith a climate by its letters:\n\n  thing   continent, ocean, sea, bay, island, desert, plain, range or volcano; or biome = and letters of Köppen\n          and Geiger, such as Csb, or BW for all deserts, perhaps on coast\n\n  \"desert > 10000 km2\", \"island > 500 km2\", \"sea\", \"volcano > 1500 m\", \"biome = Csb\" coast"
    )]
    pub queries: Vec<String>,
    /// The place to search from, in kilometres east and north of the origin.
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true, value_parser = parse_numbers::<2>)]
    pub near: [f64; 2],
    /// Search radius around that place, in kilometres [default: 200km; 5000km for what only a whole world has].
    #[arg(long, value_name = "KM", allow_hyphen_values = true, value_parser = parse_kilometres)]
    pub radius: Option<f64>,
    /// Largest number of results per query.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub limit: u32,
    #[command(flatten)]
    pub run: RunOptions,
}
