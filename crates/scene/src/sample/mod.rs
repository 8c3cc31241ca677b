//! Numbers for Monte Carlo: counter-based streams, a scrambled Sobol sequence, warps and tables to directions.
//!
//! Everything is a pure function of (seed, index), so that no thread count, batch or resume can change a
//! result. Not here: what is sampled with them (brdf, solve).

pub mod pixel;
pub mod sobol;
pub mod stream;
pub mod table;
pub mod warp;

pub use pixel::{PixelSample, net_point};
pub use sobol::{Sobol, SobolBlock};
pub use stream::Stream;
pub use table::SphereTable;
