//! Plants: the species, or groups of species that look alike, that trees, shrubs and grass are in each biome.
//!
//! Each biome has a short list for each kind of growth, with the share of each plant in it: common plants of such places
//! on Earth, one for many that look like it. Heights are those of grown plants. Shares are rough, and from no source.

use crate::geography::biome::Biome::{
    self, Af, Am, Aw, BSh, BSk, BWh, BWk, Cfa, Cfb, Cfc, Csa, Csb, Csc, Cwa, Cwb, Cwc, Dfa, Dfb, Dfc, Dfd, Dsa, Dsb,
    Dsc, Dsd, Dwa, Dwb, Dwc, Dwd, EF, ET,
};
use crate::tile::Growth;

/// A plant, or a loose rock, of which an artist has a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    /// The name in files: lower-case words with hyphens.
    pub name: &'static str,
    /// Heights in metres of the lowest and of the highest one.
    pub heights_m: [f64; 2],
}

/// Plants that grow together, each with its share; the shares of a list add up to 100.
type Mix = &'static [(Plant, u32)];

const fn plant(name: &'static str, low_m: f64, high_m: f64) -> Plant {
    Plant { name, heights_m: [low_m, high_m] }
}

/// What grows in a world without a geography, in the order of [`Growth::ALL`].
const ANY: [Plant; 4] =
    [plant("tree", 8.0, 20.0), plant("shrub", 0.5, 2.5), plant("grass", 0.2, 0.8), plant("rock", 0.3, 1.5)];

// Trees.
const RAIN_FOREST_TREE: Plant = plant("rain-forest-tree", 20.0, 45.0);
const PALM: Plant = plant("palm", 8.0, 20.0);
const TEAK: Plant = plant("teak", 15.0, 30.0);
const ACACIA: Plant = plant("acacia", 4.0, 12.0);
const BAOBAB: Plant = plant("baobab", 8.0, 18.0);
const LAUREL: Plant = plant("laurel", 10.0, 22.0);
const OLIVE: Plant = plant("olive", 3.0, 9.0);
const CORK_OAK: Plant = plant("cork-oak", 6.0, 15.0);
const STONE_PINE: Plant = plant("stone-pine", 8.0, 20.0);
const OAK: Plant = plant("oak", 14.0, 30.0);
const BEECH: Plant = plant("beech", 18.0, 35.0);
const MAPLE: Plant = plant("maple", 12.0, 28.0);
const POPLAR: Plant = plant("poplar", 10.0, 25.0);
const BIRCH: Plant = plant("birch", 8.0, 20.0);
const MOUNTAIN_BIRCH: Plant = plant("mountain-birch", 2.0, 7.0);
const PINE: Plant = plant("pine", 12.0, 30.0);
const DWARF_PINE: Plant = plant("dwarf-pine", 0.8, 3.0);
const SPRUCE: Plant = plant("spruce", 12.0, 32.0);
const FIR: Plant = plant("fir", 12.0, 35.0);
const LARCH: Plant = plant("larch", 8.0, 25.0);
const JUNIPER_TREE: Plant = plant("juniper-tree", 3.0, 9.0);
const SAXAUL: Plant = plant("saxaul", 2.0, 6.0);

// Shrubs.
const TREE_FERN: Plant = plant("tree-fern", 2.0, 6.0);
const BAMBOO: Plant = plant("bamboo", 3.0, 8.0);
const THORN_SHRUB: Plant = plant("thorn-shrub", 0.8, 3.0);
const CACTUS: Plant = plant("cactus", 0.5, 5.0);
const SALTBUSH: Plant = plant("saltbush", 0.3, 1.5);
const SAGEBRUSH: Plant = plant("sagebrush", 0.4, 1.5);
const MAQUIS: Plant = plant("maquis", 0.8, 3.0);
const ROCKROSE: Plant = plant("rockrose", 0.4, 1.5);
const BROOM: Plant = plant("broom", 0.6, 2.0);
const HAZEL: Plant = plant("hazel", 2.0, 6.0);
const RHODODENDRON: Plant = plant("rhododendron", 0.8, 4.0);
const HEATHER: Plant = plant("heather", 0.2, 0.7);
const BILBERRY: Plant = plant("bilberry", 0.2, 0.5);
const JUNIPER: Plant = plant("juniper", 0.5, 3.0);
const DWARF_BIRCH: Plant = plant("dwarf-birch", 0.2, 1.0);
const DWARF_WILLOW: Plant = plant("dwarf-willow", 0.1, 0.5);

// Grass and herbs.
const FERN: Plant = plant("fern", 0.4, 1.5);
const SAVANNA_GRASS: Plant = plant("savanna-grass", 0.6, 2.5);
const BUNCH_GRASS: Plant = plant("bunch-grass", 0.3, 0.9);
const DESERT_GRASS: Plant = plant("desert-grass", 0.1, 0.5);
const STEPPE_GRASS: Plant = plant("steppe-grass", 0.2, 0.8);
const PRAIRIE_GRASS: Plant = plant("prairie-grass", 0.5, 1.8);
const DRY_GRASS: Plant = plant("dry-grass", 0.2, 0.8);
const MEADOW_GRASS: Plant = plant("meadow-grass", 0.2, 0.9);
const MOOR_GRASS: Plant = plant("moor-grass", 0.2, 0.8);
const SEDGE: Plant = plant("sedge", 0.1, 0.5);
const COTTON_GRASS: Plant = plant("cotton-grass", 0.2, 0.5);
const LICHEN: Plant = plant("lichen", 0.02, 0.1);

fn trees(biome: Biome) -> Mix {
    match biome {
        Af => &[(RAIN_FOREST_TREE, 85), (PALM, 15)],
        Am => &[(RAIN_FOREST_TREE, 50), (TEAK, 35), (PALM, 15)],
        Aw => &[(ACACIA, 75), (TEAK, 12), (BAOBAB, 5), (PALM, 8)],
        BWh => &[(ACACIA, 70), (PALM, 30)],
        BWk => &[(SAXAUL, 90), (POPLAR, 10)],
        BSh => &[(ACACIA, 90), (BAOBAB, 10)],
        BSk => &[(POPLAR, 60), (JUNIPER_TREE, 40)],
        Csa => &[(OLIVE, 35), (CORK_OAK, 35), (STONE_PINE, 30)],
        Csb => &[(CORK_OAK, 30), (OAK, 30), (PINE, 40)],
        Csc => &[(PINE, 60), (JUNIPER_TREE, 40)],
        Cwa => &[(LAUREL, 60), (OAK, 20), (PINE, 20)],
        Cwb => &[(OAK, 45), (PINE, 40), (LAUREL, 15)],
        Cwc => &[(PINE, 50), (JUNIPER_TREE, 50)],
        Cfa => &[(OAK, 45), (LAUREL, 30), (PINE, 25)],
        Cfb => &[(BEECH, 45), (OAK, 40), (BIRCH, 15)],
        Cfc => &[(BIRCH, 70), (MOUNTAIN_BIRCH, 30)],
        Dsa => &[(OAK, 60), (JUNIPER_TREE, 40)],
        Dsb => &[(PINE, 60), (JUNIPER_TREE, 25), (OAK, 15)],
        Dwa | Dfa => &[(OAK, 55), (MAPLE, 35), (PINE, 10)],
        Dwb => &[(OAK, 25), (BIRCH, 30), (PINE, 30), (LARCH, 15)],
        Dfb => &[(SPRUCE, 35), (PINE, 25), (BIRCH, 20), (OAK, 12), (MAPLE, 8)],
        Dsc | Dfc => &[(SPRUCE, 55), (PINE, 20), (FIR, 12), (BIRCH, 13)],
        Dwc => &[(LARCH, 65), (PINE, 25), (BIRCH, 10)],
        Dsd | Dwd | Dfd => &[(LARCH, 95), (DWARF_PINE, 5)],
        ET | EF => &[(MOUNTAIN_BIRCH, 60), (DWARF_PINE, 40)],
    }
}

fn shrubs(biome: Biome) -> Mix {
    match biome {
        Af => &[(TREE_FERN, 70), (BAMBOO, 30)],
        Am => &[(BAMBOO, 60), (TREE_FERN, 40)],
        Aw => &[(THORN_SHRUB, 100)],
        BWh => &[(THORN_SHRUB, 50), (CACTUS, 35), (SALTBUSH, 15)],
        BWk => &[(SALTBUSH, 60), (SAXAUL, 40)],
        BSh => &[(THORN_SHRUB, 75), (CACTUS, 25)],
        BSk => &[(SAGEBRUSH, 100)],
        Csa => &[(MAQUIS, 65), (ROCKROSE, 35)],
        Csb | Dsa => &[(MAQUIS, 40), (ROCKROSE, 20), (BROOM, 40)],
        Csc | Dsb => &[(JUNIPER, 60), (BROOM, 40)],
        Cwa => &[(BAMBOO, 50), (RHODODENDRON, 50)],
        Cwb => &[(RHODODENDRON, 70), (BROOM, 30)],
        Cwc => &[(JUNIPER, 60), (RHODODENDRON, 40)],
        Cfa => &[(RHODODENDRON, 60), (HAZEL, 40)],
        Cfb => &[(HAZEL, 70), (BROOM, 30)],
        Cfc => &[(HEATHER, 80), (JUNIPER, 20)],
        Dwa | Dwb | Dfa | Dfb => &[(HAZEL, 70), (JUNIPER, 30)],
        Dsc | Dwc | Dfc => &[(BILBERRY, 55), (JUNIPER, 25), (DWARF_BIRCH, 20)],
        Dsd | Dwd | Dfd => &[(DWARF_BIRCH, 60), (BILBERRY, 40)],
        ET => &[(DWARF_BIRCH, 40), (DWARF_WILLOW, 30), (HEATHER, 30)],
        EF => &[(DWARF_WILLOW, 100)],
    }
}

fn grasses(biome: Biome) -> Mix {
    match biome {
        Af | Am => &[(FERN, 100)],
        Aw => &[(SAVANNA_GRASS, 100)],
        BWh | BWk => &[(DESERT_GRASS, 100)],
        BSh => &[(SAVANNA_GRASS, 40), (BUNCH_GRASS, 60)],
        BSk => &[(STEPPE_GRASS, 100)],
        Csa | Csb | Dsa | Dsb => &[(DRY_GRASS, 100)],
        Csc | Cwc => &[(BUNCH_GRASS, 100)],
        Cwa => &[(MEADOW_GRASS, 60), (FERN, 40)],
        Cwb => &[(BUNCH_GRASS, 50), (MEADOW_GRASS, 50)],
        Cfa | Cfb | Dwb | Dfb => &[(MEADOW_GRASS, 80), (FERN, 20)],
        Cfc => &[(MOOR_GRASS, 80), (COTTON_GRASS, 20)],
        Dwa | Dfa => &[(PRAIRIE_GRASS, 60), (MEADOW_GRASS, 40)],
        Dsc | Dwc | Dfc => &[(MOOR_GRASS, 50), (SEDGE, 50)],
        Dsd | Dwd | Dfd => &[(LICHEN, 50), (SEDGE, 50)],
        ET => &[(SEDGE, 45), (COTTON_GRASS, 20), (LICHEN, 35)],
        EF => &[(LICHEN, 100)],
    }
}

impl Plant {
    /// Returns what a kind of growth is in a world without a geography: it has the name of the kind.
    pub const fn any(growth: Growth) -> Plant {
        ANY[growth as usize]
    }

    /// Returns a plant of a biome, by a share of chance from 0 up to 1. Loose rocks are rocks everywhere.
    pub fn of(growth: Growth, biome: Biome, chance: f64) -> Plant {
        let mix = match growth {
            Growth::Tree => trees(biome),
            Growth::Shrub => shrubs(biome),
            Growth::Grass => grasses(biome),
            Growth::Rock => return Plant::any(Growth::Rock),
        };
        let mut sum = 0;
        let found = mix.iter().find(|(_, share)| {
            sum += share;
            chance * 100.0 < f64::from(sum)
        });
        found.expect("shares add up to 100").0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_biome_has_whole_lists() {
        for biome in Biome::all() {
            for mix in [trees(biome), shrubs(biome), grasses(biome)] {
                assert_eq!(mix.iter().map(|(_, share)| share).sum::<u32>(), 100, "{biome:?}: {mix:?}");
                for (Plant { name, heights_m: [low, high] }, _) in mix {
                    assert!(0.0 < *low && low < high && *high < 50.0, "{name}");
                    assert!(name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-'), "{name}");
                }
            }
        }
    }

    #[test]
    fn taiga_has_conifers_and_no_palms() {
        let names = |biome| -> Vec<&str> {
            (0..1000).map(|n| Plant::of(Growth::Tree, biome, f64::from(n) / 1000.0).name).collect()
        };
        for biome in [Dfc, Dfd, Dwc, Dsd] {
            let names = names(biome);
            let conifers = names.iter().filter(|name| ["spruce", "larch", "fir", "pine"].contains(name)).count();
            assert!(conifers > 800 && !names.contains(&"palm"), "{biome:?}: {conifers}");
        }
        assert!(names(Af).contains(&"palm"));
    }
}
