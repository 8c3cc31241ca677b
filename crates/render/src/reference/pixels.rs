//! Pictures by path tracing: every pixel is the mean of independent paths, with its variance.
//!
//! Rays are spread over a pixel as `picture` spreads them, and pass one-sided backs as there. Colour, emission and
//! exposure are kept as there too, so that both kinds of pictures are shown alike.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchScene, Rgb};

use super::path::{PathTracer, Technique};
use crate::picture::{Picture, first_side, tent};
use crate::sums::{self, PixelSums, Seen};
use crate::vertex::{Look, Vertex};

/// Settings of [`super::picture`].
#[derive(Clone, Copy, Debug)]
pub struct PathPictureOptions {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Paths per pixel.
    pub samples: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// How lamps and sky are found.
    pub technique: Technique,
}

impl Default for PathPictureOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, samples: 64, seed: 1, technique: Technique::default() }
    }
}

/// Purpose of the streams of random numbers.
const PIXELS: u64 = 0x9A7B_0001;

/// A picture that gets better with every pass over all of its pixels.
pub struct PixelTracer<'a> {
    tracer: PathTracer<'a>,
    camera: Camera,
    options: PathPictureOptions,
    pixels: Vec<PixelSums>,
    samples: u32,
}

impl<'a> PixelTracer<'a> {
    /// A black picture; `options.samples` is left to [`PixelTracer::advance`].
    pub fn new(scene: &'a PatchScene, camera: &Camera, options: &PathPictureOptions) -> Self {
        let count = options.width as usize * options.height as usize;
        let tracer = PathTracer::new(scene, options.technique);
        Self {
            tracer,
            camera: camera.clone(),
            options: *options,
            pixels: vec![PixelSums::default(); count],
            samples: 0,
        }
    }

    /// Paths per pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Adds `samples` paths to every pixel; how many at a time changes no bit of the sums.
    pub fn advance(&mut self, samples: u32) {
        let Self { tracer, camera, options, pixels, .. } = self;
        let (first, end) = (self.samples, self.samples.saturating_add(samples));
        pixels.par_iter_mut().enumerate().for_each(|(index, sums)| {
            for k in first..end {
                let mut random = Stream::new(options.seed, PIXELS, (index as u64) << 32 | u64::from(k));
                let ray = film_ray(camera, options, index, &mut random);
                sums.add(&path(tracer, ray.0, ray.1, &mut random));
            }
        });
        self.samples = end;
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        sums::picture(&self.pixels, self.options.width)
    }

    /// Variance of every pixel's luminance, `[height, width]`: the square of its standard error; infinite before the
    /// second path.
    pub fn variance(&self) -> Vec<f32> {
        self.pixels.iter().map(|p| p.variance() as f32).collect()
    }

    /// Relative RMS error of the pixels' luminance, √(Σ variance / Σ 𝓛²), over pixels that no light covers; over all
    /// pixels if there are no others. Infinite before the second path; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        sums::relative_error(&self.pixels)
    }

    /// Paths that were dropped because their radiance was not finite; 0 unless something is wrong.
    pub fn invalid(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.invalid())).sum()
    }
}

/// What the path of one camera ray, given in world space, brings.
fn path(tracer: &PathTracer, origin: DVec3, direction: DVec3, random: &mut Stream) -> Seen {
    let scene = tracer.scene;
    let mut seen = Seen { rays: 1, ..Seen::default() };
    let Some((hit, patch)) = first_side(scene, origin - scene.centre(), direction) else {
        seen.empty = 1;
        seen.lights = scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction));
        return Seen { radiance: seen.lights, covered: u32::from(!seen.lights.is_black()), ..seen };
    };
    let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
    let vertex = Vertex::new(scene, &hit, patch, -direction, Look::Display);
    let found = tracer.follow(vertex, -direction, random);
    let lights = emitted + found.seen;
    if !(lights + found.reflected).is_finite() {
        return Seen { invalid: 1, ..seen };
    }
    if lights.is_black() {
        (seen.unlit, seen.unlit_luminance) = (1, found.reflected.luminance());
    }
    Seen { radiance: lights + found.reflected, lights, covered: u32::from(!lights.is_black()), ..seen }
}

/// Camera ray through an independent point of a pixel's filter.
fn film_ray(camera: &Camera, options: &PathPictureOptions, index: usize, random: &mut Stream) -> (DVec3, DVec3) {
    let (width, height) = (f64::from(options.width), f64::from(options.height));
    let (x, y) = (index % options.width as usize, index / options.width as usize);
    let [dx, dy] = [tent(random.uniform()), tent(random.uniform())];
    camera.ray((x as f64 + dx) / width, (y as f64 + dy) / height, width / height)
}
