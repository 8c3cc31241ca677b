//! Pictures by path tracing: every pixel is the mean of independent paths, with its variance.
//!
//! Rays are spread over a pixel as `picture` spreads them, and pass one-sided backs as there. Colour, emission and
//! exposure are kept as there too, so that both kinds of pictures are shown alike.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchScene, Rgb};

use super::path::{PathTracer, Technique};
use crate::film::{Crop, Film, tent};
use crate::picture::{Picture, first_side};
use crate::sums::{self, PixelSums, Seen};
use crate::vertex::{Look, Vertex};

/// Settings of [`super::picture`].
#[derive(Clone, Copy, Debug)]
pub struct PathPictureOptions {
    /// Pixels in a row of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part of the film that is wanted, within it; `None` for all of it.
    pub crop: Option<Crop>,
    /// Paths per pixel.
    pub samples: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// How lamps and sky are found.
    pub technique: Technique,
}

impl Default for PathPictureOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, crop: None, samples: 64, seed: 1, technique: Technique::default() }
    }
}

/// Purpose of the streams of random numbers.
const PIXELS: u64 = 0x9A7B_0001;

/// A picture that gets better with every pass over all of its pixels.
pub struct PixelTracer<'a> {
    tracer: PathTracer<'a>,
    camera: Camera,
    film: Film,
    seed: u64,
    pixels: Vec<PixelSums>,
    samples: u32,
}

impl<'a> PixelTracer<'a> {
    /// A black picture; `options.samples` is left to [`PixelTracer::advance`].
    ///
    /// # Panics
    /// If the crop is not within the film.
    pub fn new(scene: &'a PatchScene, camera: &Camera, options: &PathPictureOptions) -> Self {
        let film = Film::new(options.width, options.height, options.crop);
        let tracer = PathTracer::new(scene, options.technique);
        Self {
            tracer,
            camera: camera.clone(),
            film,
            seed: options.seed,
            pixels: vec![PixelSums::default(); film.len()],
            samples: 0,
        }
    }

    /// Paths per pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Adds `samples` paths to every pixel; how many at a time changes no bit of the sums.
    pub fn advance(&mut self, samples: u32) {
        let Self { tracer, camera, film, seed, pixels, .. } = self;
        let (first, end) = (self.samples, self.samples.saturating_add(samples));
        pixels.par_iter_mut().enumerate().for_each(|(index, sums)| {
            let at = film.place(index);
            for k in first..end {
                let mut random = Stream::new(*seed, PIXELS, film.number(at) << 32 | u64::from(k));
                let [dx, dy] = [tent(random.uniform()), tent(random.uniform())];
                let lens = if camera.lens.is_some() { [random.uniform(), random.uniform()] } else { [0.0; 2] };
                sums.add(&match film.ray(camera, at, [dx, dy], lens) {
                    Some((origin, direction)) => path(tracer, origin, direction, &mut random),
                    None => Seen { rays: 1, ..Seen::default() },
                });
            }
        });
        self.samples = end;
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        sums::picture(self.pixels.iter().copied(), self.film.window.width)
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
