//! A plain path tracer: the independent truth that solutions are compared with.
//!
//! It shares scene, materials and rays with the solver, and no transport: light is followed from where it is seen
//! back to where it comes from, as in J. T. Kajiya, "The rendering equation", SIGGRAPH 1986. `path` is the estimator;
//! `lights` chooses points of lamps and sky; `pixels` and `patches` average it over pixels and over patches. Every
//! sample has random numbers of its own, so that means have exact standard errors. Simple before fast: whoever wants
//! speed solves. Not here: smoothing, and the light of patches, which the reference must not know.

mod patches;
mod path;
mod pixels;

use twinray_scene::{Camera, PatchScene};
use twinray_solve::PatchLight;

pub use patches::PatchTracer;
pub use path::Technique;
pub use pixels::{PathPictureOptions, PixelTracer};

use crate::picture::Picture;

/// Settings of [`irradiance`].
#[derive(Clone, Copy, Debug)]
pub struct IrradianceOptions {
    /// Paths that start on each patch.
    pub paths_per_patch: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// How lamps and sky are found.
    pub technique: Technique,
}

impl Default for IrradianceOptions {
    fn default() -> Self {
        Self { paths_per_patch: 256, seed: 1, technique: Technique::default() }
    }
}

/// A picture by path tracing, with the variance of every pixel's luminance: the square of its standard error,
/// `[height, width]`, infinite with a single sample.
pub fn picture(scene: &PatchScene, camera: &Camera, options: &PathPictureOptions) -> (Picture, Vec<f32>) {
    let mut tracer = PixelTracer::new(scene, camera, options);
    tracer.advance(options.samples);
    (tracer.picture(), tracer.variance())
}

/// Mean irradiance of every patch by path tracing, with standard errors; `hits` are the paths.
pub fn irradiance(scene: &PatchScene, options: &IrradianceOptions) -> PatchLight {
    let mut tracer = PatchTracer::new(scene, options.seed, options.technique);
    tracer.advance(options.paths_per_patch);
    tracer.light()
}

/// Variance of a mean of `n` independent samples from their sum and the sum of their squares; infinite below two.
fn variance_of_mean(sum: f64, squares: f64, n: u32) -> f64 {
    if n < 2 {
        return f64::INFINITY;
    }
    let n = f64::from(n);
    // Rounding may leave less than nothing where all samples are equal.
    (squares - sum * sum / n).max(0.0) / (n * (n - 1.0))
}

/// √(Σ variance / Σ square) after `n` samples; what is wholly dark has no error.
fn relative_error(variance: f64, square: f64, n: u32) -> f64 {
    match (n < 2, square > 0.0) {
        (true, _) => f64::INFINITY,
        (false, true) => (variance / square).sqrt(),
        (false, false) => 0.0,
    }
}
