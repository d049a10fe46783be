//! What the thesis measured, to stand beside what is measured here.

/// A row of the thesis' tables: milliseconds an expansion on a Core i7-2600K and a GeForce GTX 460.
///
/// Source: Grelsson (2014), tables 6.3, 6.4 and 7.2.
#[derive(Clone, Copy, Debug)]
pub struct ThesisRow {
    /// Vertices a tile side.
    pub tile_cells: u32,
    /// On the CPU, with agents.
    pub cpu_ms: f64,
    /// On the CPU, without agents.
    pub cpu_without_agents_ms: f64,
    /// On the GPU, with agents.
    pub gpu_ms: f64,
    /// On the GPU, without agents.
    pub gpu_without_agents_ms: f64,
    /// Its t-test of CPU against GPU.
    pub p: f64,
}

impl ThesisRow {
    /// The row of a tile size; `None` for one that the thesis did not measure.
    pub fn of(tile_cells: u32) -> Option<&'static ThesisRow> {
        THESIS.iter().find(|row| row.tile_cells == tile_cells)
    }
}

/// All of the thesis' rows.
pub const THESIS: &[ThesisRow] = &[
    ThesisRow {
        tile_cells: 64,
        cpu_ms: 19.08,
        cpu_without_agents_ms: 6.786,
        gpu_ms: 14.63,
        gpu_without_agents_ms: 6.932,
        p: 3.5e-24,
    },
    ThesisRow {
        tile_cells: 128,
        cpu_ms: 56.17,
        cpu_without_agents_ms: 40.29,
        gpu_ms: 35.14,
        gpu_without_agents_ms: 22.43,
        p: 5.3e-64,
    },
    ThesisRow {
        tile_cells: 256,
        cpu_ms: 145.5,
        cpu_without_agents_ms: 121.35,
        gpu_ms: 74.26,
        gpu_without_agents_ms: 53.52,
        p: 1.2e-98,
    },
    ThesisRow {
        tile_cells: 512,
        cpu_ms: 536.0,
        cpu_without_agents_ms: 457.3,
        gpu_ms: 249.8,
        gpu_without_agents_ms: 179.4,
        p: 2.1e-73,
    },
];

/// Frames a second that the thesis asks for, and the milliseconds that a frame may then take (its table 7.1).
pub const FRAME_RATES: [(u32, f64); 3] = [(15, 67.0), (30, 33.0), (60, 17.0)];
