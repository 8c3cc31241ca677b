//! How far two results are apart: pictures by pixel and by eye, solutions patch by patch.
//!
//! Lives here: the measures, and the picture of where two pictures differ. Not here: which results to compare, what
//! is too much (the caller), files. In every pair the second is the reference. Equal results differ by exactly 0.

pub mod flip;
mod pixels;
mod solutions;

pub use flip::FlipMap;
pub use pixels::{psnr, relative_mse, rmse};
pub use solutions::{LightDifference, PatchDifference, ZScores, solutions};
