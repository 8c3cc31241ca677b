//! Bi-directional rays in global illumination: patches in, solution out.
//!
//! The method of Kelemen, Benedek, Szirmay-Kalos and Szécsi (WSCG 2003) and what goes past it. Each ray starts at
//! a patch chosen by its power and carries light both ways; `docs/paper.md` maps the paper's formulas to this
//! crate's functions. No file, clock, terminal or window is known here.
//!
//! ```
//! use twinray_scene::{builtin, PatchOptions, PatchScene};
//! use twinray_solve::{Params, Solver};
//!
//! let scene = PatchScene::new(&builtin::cornell(false), PatchOptions::default()).unwrap();
//! let mut solver = Solver::new(&scene, Params::default_preset(1), None).unwrap();
//! solver.run(1_000_000);
//! assert!(solver.solution().balance().residual().abs() < 0.01);
//! ```

mod direction;
mod error_bars;
mod estimate;
mod fixed;
mod frozen;
mod glossy;
mod iterate;
mod merge;
mod observer;
mod params;
mod patch_light;
mod patch_radiance;
mod peers;
pub mod record;
mod replicas;
mod representative;
pub mod select;
mod sequential;
mod shoot;
mod solution;
mod source;
mod stage;
mod strategies;
mod sums;
mod tally;
pub mod transfer;
mod wave;
mod waves;

pub use estimate::{Demand, solving_bytes, state_bytes};
pub use iterate::Solver;
pub use merge::merge;
pub use observer::Observer;
pub use params::{Estimator, Params, Representation, Schedule, SolveError};
pub use patch_light::PatchLight;
pub use peers::Peers;
pub use record::{Record, RecordError};
pub use solution::{PowerBalance, Solution};
pub use source::PackedRepresentative;
pub use stage::Stage;
pub use strategies::Shares;
pub use tally::Tally;
