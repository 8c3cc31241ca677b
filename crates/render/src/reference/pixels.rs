//! Pictures by path tracing: every pixel is the mean of independent paths, with its variance.
//!
//! Rays are spread over a pixel as `picture` spreads them, and pass one-sided backs as there. Colour, emission and
//! exposure are kept as there too, so that both kinds of pictures are shown alike.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::sample::Stream;
use twinray_scene::{Camera, PatchScene, Rgb};

use super::path::{PathTracer, Technique, Vertex};
use crate::image::Image;
use crate::picture::{Picture, first_side, tent};

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

/// Pixels along a side of the tiles whose logarithms count for automatic exposure: small against what a picture
/// shows, large against its noise.
const TILE: usize = 4;

/// A picture that gets better with every pass over all of its pixels.
pub struct PixelTracer<'a> {
    tracer: PathTracer<'a>,
    camera: Camera,
    options: PathPictureOptions,
    pixels: Vec<PixelSums>,
    samples: u32,
}

/// Sums over the paths of one pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    radiance: Rgb,
    /// Of squared luminance.
    squares: f64,
    /// The part that comes straight from emitters and sky, and the rays that met some.
    lights: Rgb,
    covered: u32,
    /// Rays that met surfaces without emission, and the luminance of these.
    unlit: u32,
    unlit_luminance: f64,
    empty: u32,
    invalid: u32,
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
                sums.add(tracer, ray.0, ray.1, &mut random);
            }
        });
        self.samples = end;
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        let n = f64::from(self.samples.max(1));
        let empty: f64 = self.pixels.iter().map(|p| f64::from(p.empty)).sum();
        let lights = |p: &PixelSums| ((p.lights / n).to_f32(), (f64::from(p.covered) / n) as f32);
        Picture {
            image: Image {
                width: self.options.width,
                height: self.options.height,
                pixels: self.pixels.iter().map(|p| (p.radiance / n).to_f32()).collect(),
            },
            lights: self.pixels.iter().map(lights).collect(),
            log2_luminance: self.log2_luminance(),
            empty: empty / (n * self.pixels.len().max(1) as f64),
        }
    }

    /// Mean of log₂ luminance for automatic exposure, where camera rays met surfaces without emission. The logarithm is
    /// that of tiles: of single paths, or of pixels of a few, it would be darker by all of their noise.
    fn log2_luminance(&self) -> Option<f64> {
        let width = self.options.width as usize;
        let columns = width.div_ceil(TILE);
        let mut tiles = vec![(0.0, 0.0); columns * (self.options.height as usize).div_ceil(TILE)];
        for (index, p) in self.pixels.iter().enumerate() {
            let tile = &mut tiles[index / width / TILE * columns + index % width / TILE];
            tile.0 += f64::from(p.unlit);
            tile.1 += p.unlit_luminance;
        }
        let lit = tiles.iter().filter(|(_, luminance)| *luminance > 0.0);
        let (rays, sum) = lit.fold((0.0, 0.0), |(rays, sum), (n, l)| (rays + n, sum + n * libm::log2(l / n)));
        (rays > 0.0).then(|| sum / rays)
    }

    /// Variance of every pixel's luminance, `[height, width]`: the square of its standard error; infinite before the
    /// second path.
    pub fn variance(&self) -> Vec<f32> {
        self.pixels.iter().map(|p| p.variance(self.samples) as f32).collect()
    }

    /// Relative RMS error of the pixels' luminance, √(Σ variance / Σ 𝓛²), over pixels that no light covers; over all
    /// pixels if there are no others. Infinite before the second path; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        let over = |which: &dyn Fn(&PixelSums) -> bool| {
            let n = f64::from(self.samples.max(1));
            self.pixels.iter().filter(|p| which(p)).fold((0.0, 0.0), |(variance, square), p| {
                (variance + p.variance(self.samples), square + (p.radiance.luminance() / n).powi(2))
            })
        };
        let plain = over(&|p| p.covered == 0);
        let (variance, square) = if plain.1 > 0.0 { plain } else { over(&|_| true) };
        super::relative_error(variance, square, self.samples)
    }

    /// Paths that were dropped because their radiance was not finite; 0 unless something is wrong.
    pub fn invalid(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.invalid)).sum()
    }
}

impl PixelSums {
    /// Adds the path of one camera ray, given in world space.
    fn add(&mut self, tracer: &PathTracer, origin: DVec3, direction: DVec3, random: &mut Stream) {
        let scene = tracer.scene;
        let (reflected, direct) = match first_side(scene, origin - scene.centre(), direction) {
            None => {
                self.empty += 1;
                (Rgb::BLACK, scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction)))
            }
            Some((hit, patch)) => {
                let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
                let reflected = tracer.reflected(Vertex::of_hit(scene, &hit, patch), -direction, random);
                if !reflected.is_finite() {
                    self.invalid += 1;
                    return;
                }
                if emitted.is_black() {
                    self.unlit += 1;
                    self.unlit_luminance += reflected.luminance();
                }
                (reflected, emitted)
            }
        };
        self.radiance += reflected + direct;
        self.squares += (reflected + direct).luminance().powi(2);
        self.lights += direct;
        self.covered += u32::from(!direct.is_black());
    }

    fn variance(&self, samples: u32) -> f64 {
        super::variance_of_mean(self.radiance.luminance(), self.squares, samples)
    }
}

/// Camera ray through an independent point of a pixel's filter.
fn film_ray(camera: &Camera, options: &PathPictureOptions, index: usize, random: &mut Stream) -> (DVec3, DVec3) {
    let (width, height) = (f64::from(options.width), f64::from(options.height));
    let (x, y) = (index % options.width as usize, index / options.width as usize);
    let [dx, dy] = [tent(random.uniform()), tent(random.uniform())];
    camera.ray((x as f64 + dx) / width, (y as f64 + dy) / height, width / height)
}
