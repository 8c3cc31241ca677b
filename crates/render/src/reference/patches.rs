//! Irradiance of patches by path tracing: every patch is the mean of independent paths from random points of it.
//!
//! Irradiance is π times what a white Lambertian surface would reflect in the patch's place, so that the estimator
//! is that of the pictures.

use std::f64::consts::PI;

use rayon::prelude::*;
use twinray_scene::brdf::{Brdf, Scatter};
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb};
use twinray_solve::PatchLight;

use super::path::{PathTracer, Technique};
use crate::vertex::Vertex;

/// Purpose of the streams of random numbers.
const PATCHES: u64 = 0x9A7B_0002;

/// Irradiance of all patches, better with every pass.
pub struct PatchTracer<'a> {
    tracer: PathTracer<'a>,
    seed: u64,
    sums: Vec<PatchSums>,
    paths: u32,
}

/// Sums over the paths of one patch.
#[derive(Clone, Copy, Debug, Default)]
struct PatchSums {
    irradiance: Rgb,
    /// Of squared luminance.
    squares: f64,
    invalid: u32,
}

impl<'a> PatchTracer<'a> {
    /// No paths yet.
    pub fn new(scene: &'a PatchScene, seed: u64, technique: Technique) -> Self {
        let sums = vec![PatchSums::default(); scene.len()];
        Self { tracer: PathTracer::new(scene, technique), seed, sums, paths: 0 }
    }

    /// Paths per patch so far.
    pub fn paths_per_patch(&self) -> u32 {
        self.paths
    }

    /// Adds `paths` to every patch; how many at a time changes no bit of the sums.
    pub fn advance(&mut self, paths: u32) {
        let Self { tracer, seed, sums, .. } = self;
        let (first, end) = (self.paths, self.paths.saturating_add(paths));
        sums.par_iter_mut().enumerate().for_each(|(index, sums)| {
            for k in first..end {
                let mut random = Stream::new(*seed, PATCHES, (index as u64) << 32 | u64::from(k));
                let irradiance = arriving(tracer, PatchId(index as u32), &mut random);
                if !irradiance.is_finite() {
                    sums.invalid += 1;
                    continue;
                }
                sums.irradiance += irradiance;
                sums.squares += irradiance.luminance().powi(2);
            }
        });
        self.paths = end;
    }

    /// Irradiance so far; `hits` are the paths, and standard errors are infinite before the second.
    pub fn light(&self) -> PatchLight {
        let scene = self.tracer.scene;
        let n = f64::from(self.paths.max(1));
        PatchLight {
            area: scene.patches().map(|p| scene.area(p)).collect(),
            emits: scene.patches().map(|p| !scene.emission(p).is_black()).collect(),
            irradiance: self.sums.iter().map(|s| (s.irradiance / n).to_f32()).collect(),
            standard_error: self.sums.iter().map(|s| s.variance(self.paths).sqrt() as f32).collect(),
            hits: vec![self.paths; scene.len()],
        }
    }

    /// Relative RMS error √(ΣA·variance / ΣA·𝓛(E)²) over the patches that do not emit; over all if every one does.
    /// Infinite before the second path; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        let scene = self.tracer.scene;
        let n = f64::from(self.paths.max(1));
        let over = |emitters: bool| {
            let which = scene.patches().filter(|&p| emitters || scene.emission(p).is_black());
            which.fold((0.0, 0.0), |(variance, square), p| {
                let (area, sums) = (scene.area(p), &self.sums[p.index()]);
                let luminance = sums.irradiance.luminance() / n;
                (variance + area * sums.variance(self.paths), square + area * luminance * luminance)
            })
        };
        let plain = over(false);
        let (variance, square) = if plain.1 > 0.0 { plain } else { over(true) };
        super::relative_error(variance, square, self.paths)
    }

    /// Paths that were dropped because their irradiance was not finite; 0 unless something is wrong.
    pub fn invalid(&self) -> u64 {
        self.sums.iter().map(|s| u64::from(s.invalid)).sum()
    }
}

impl PatchSums {
    fn variance(&self, paths: u32) -> f64 {
        super::variance_of_mean(self.irradiance.luminance(), self.squares, paths)
    }
}

/// One sample of the mean irradiance of a patch.
fn arriving(tracer: &PathTracer, patch: PatchId, random: &mut Stream) -> Rgb {
    let scene = tracer.scene;
    let [s, t] = [random.uniform(), random.uniform()];
    let [u, v] = scene.sample_place(patch, s, t, || random.uniform());
    let normal = scene.normal(patch);
    let point = scene.point_of(scene.triangle_of(patch), u, v);
    let white = Brdf::Lambertian { reflectance: Rgb::WHITE };
    let scatter = Scatter { brdf: white, specular: None };
    tracer
        .follow(
            Vertex { patch, point, geometric: normal, normal, scatter, inside: false, is_clear: false },
            normal,
            random,
        )
        .reflected
        * PI
}
