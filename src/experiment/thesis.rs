//! Results of the thesis, to stand beside those of this experiment.

use crate::experiment::{Configuration, Engine, Method, Step};

/// A row of the thesis' tables: milliseconds of an expansion on a Core i7-2600K and a GeForce GTX 460.
///
/// Source: Grelsson (2014), tables 6.1 to 6.4 and 7.2.
#[derive(Clone, Copy, Debug)]
pub struct ThesisRow {
    /// Vertices a tile side.
    pub tile_cells: u32,
    /// On the CPU, with agents.
    pub cpu_ms: f64,
    /// On the CPU, without agents.
    pub cpu_without_agents_ms: f64,
    /// On the GPU, with agents, in groups of 8 x 8, 16 x 16 and 32 x 32 threads.
    pub gpu_groups_ms: [f64; 3],
    /// On the GPU, without agents.
    pub gpu_without_agents_ms: f64,
    /// p value of the thesis' t-test of CPU against GPU.
    pub p: f64,
}

impl ThesisRow {
    /// Returns the row of a tile size; `None` for a size that the thesis did not measure.
    pub fn of(tile_cells: u32) -> Option<&'static ThesisRow> {
        THESIS.iter().find(|row| row.tile_cells == tile_cells)
    }

    /// Returns the milliseconds on the GPU, with agents, in groups of the fastest size.
    pub fn gpu_ms(&self) -> f64 {
        self.gpu_groups_ms.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the thesis' result for a similar configuration; `None` where the terrain expands in another way than in
    /// the thesis.
    pub(super) fn milliseconds(&self, configuration: Configuration) -> Option<f64> {
        if (configuration.layers, configuration.step) != (1, Step::All) {
            return None;
        }
        let milliseconds = match (configuration.method, configuration.engine) {
            (Method::Agents, Engine::Cpu) => self.cpu_ms,
            (Method::Agents, Engine::Gpu { group_side }) => match group_side {
                8 => self.gpu_groups_ms[0],
                16 => self.gpu_groups_ms[1],
                _ => self.gpu_groups_ms[2],
            },
            (_, Engine::Cpu) => self.cpu_without_agents_ms,
            (_, Engine::Gpu { .. }) => self.gpu_without_agents_ms,
        };
        Some(milliseconds)
    }
}

/// All rows of the thesis.
pub const THESIS: &[ThesisRow] = &[
    ThesisRow {
        tile_cells: 64,
        cpu_ms: 19.08,
        cpu_without_agents_ms: 6.786,
        gpu_groups_ms: [14.63, 15.51, 14.91],
        gpu_without_agents_ms: 6.932,
        p: 3.5e-24,
    },
    ThesisRow {
        tile_cells: 128,
        cpu_ms: 56.17,
        cpu_without_agents_ms: 40.29,
        gpu_groups_ms: [35.14, 35.96, 36.63],
        gpu_without_agents_ms: 22.43,
        p: 5.3e-64,
    },
    ThesisRow {
        tile_cells: 256,
        cpu_ms: 145.5,
        cpu_without_agents_ms: 121.3,
        gpu_groups_ms: [75.79, 74.92, 74.26],
        gpu_without_agents_ms: 53.52,
        p: 1.2e-98,
    },
    ThesisRow {
        tile_cells: 512,
        cpu_ms: 536.0,
        cpu_without_agents_ms: 457.3,
        gpu_groups_ms: [252.4, 249.8, 252.0],
        gpu_without_agents_ms: 179.4,
        p: 2.1e-73,
    },
];

/// Frame rates, in frames a second, that the thesis asks for, each with the milliseconds that a frame may then take
/// (its table 7.1).
pub const FRAME_RATES: [(u32, f64); 3] = [(15, 67.0), (30, 33.0), (60, 17.0)];
