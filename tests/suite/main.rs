//! All integration tests in one binary, so that they link once: a file a subject.

mod agents;
mod architecture;
mod cli;
mod far;
mod features;
mod fluvial;
mod golden;
mod meshes;
mod places;
mod presets;
mod profiles;
mod range;
mod seams;
mod simd;
mod vector;
mod walker;
mod water;
