//! The final gather: a picture whose last bounce is traced, and all bounces before it come from a solution.
//!
//! A camera ray goes through mirrors and glass to the first surface that scatters. There, light straight from what emits
//! is found by shadow rays and by a ray of the BRDF, weighed by the balance heuristic; the same ray brings what the
//! solution knows of the light at its far end, and lobes met there are followed further. Where it is too short for
//! patches to look even, its end is a point like the first. No patch is seen directly: shadows and textures are sharp,
//! and only light of two bounces and more is as smooth as patches are.
//! `sample` follows one camera ray; `tile` lets neighbours share what their gather rays find; `places` learn which lamps
//! light them, and with `guide` from where light comes; `spread` gives to many what was too much for one; `pass` decides how many rays each place gets. `irradiance` asks at points of surfaces instead,
//! `radiance` at points in free space.

mod guide;
mod irradiance;
mod pass;
mod places;
mod radiance;
mod sample;
mod spread;
mod tile;

use twinray_scene::{Camera, PatchScene, Rgb};
use twinray_solve::Solution;

use crate::film::{Crop, Film};
use crate::picture::Picture;
use crate::sums::{self, PixelSums};
use places::Places;
use sample::Estimator;

pub use irradiance::IrradianceGather;
pub use radiance::RadianceGather;

/// Settings of a gather.
#[derive(Clone, Copy, Debug)]
pub struct GatherOptions {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The part of the film that is wanted; all of it without. A part alone is as good as it is in the whole picture, but
    /// not to the bit: neighbours share their rays, and noise decides where rays go.
    pub crop: Option<Crop>,
    /// Seed of every random number.
    pub seed: u64,
    /// Whether pixels with more noise get more camera rays.
    pub adaptive: bool,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, crop: None, seed: 1, adaptive: true }
    }
}

/// A picture that gets better with every pass.
pub struct Gather<'a> {
    estimator: Estimator<'a>,
    camera: Camera,
    film: Film,
    seed: u64,
    adaptive: bool,
    /// Row by row of the window.
    pixels: Vec<PixelSums>,
    places: Places,
    /// Batches so far.
    batches: u32,
    /// Camera rays so far.
    rays: u64,
}

impl<'a> Gather<'a> {
    /// A black picture of `solution`.
    pub fn new(scene: &'a PatchScene, solution: &'a Solution, camera: &Camera, options: &GatherOptions) -> Self {
        let film = Film::new(options.width, options.height, options.crop);
        let estimator = Estimator::new(scene, solution);
        let places = Places::new(film.window, &estimator.lights);
        let pixels = vec![PixelSums::default(); film.len()];
        let (seed, adaptive) = (options.seed, options.adaptive);
        Self { estimator, camera: camera.clone(), film, seed, adaptive, pixels, places, batches: 0, rays: 0 }
    }

    /// Camera rays per pixel so far, mean.
    pub fn samples(&self) -> f64 {
        self.rays as f64 / self.pixels.len().max(1) as f64
    }

    /// Camera rays so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        sums::picture(self.given(&self.shares()), self.film.window.width)
    }

    /// The part of every pixel that is emitted where it is seen, or reflected straight from what emits; linear radiance.
    pub fn direct(&self) -> Vec<[f32; 3]> {
        self.given(&self.shares()).map(|p| (p.lights() + p.direct()).to_f32()).collect()
    }

    /// All other light of every pixel, linear radiance.
    pub fn indirect(&self) -> Vec<[f32; 3]> {
        self.given(&self.shares()).map(|p| (p.radiance() - p.lights() - p.direct()).to_f32()).collect()
    }

    /// Variance of every pixel's luminance, `[height, width]`: the square of its standard error; infinite before the
    /// second batch of rays.
    pub fn variance(&self) -> Vec<f32> {
        self.pixels.iter().map(|p| p.variance() as f32).collect()
    }

    /// Relative RMS error of the pixels' luminance by their noise, √(Σ variance / Σ 𝓛²), over pixels that no light
    /// covers; over all pixels if there are no others. Infinite before the second batch; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        sums::relative_error(&self.pixels)
    }

    /// Camera rays that were dropped because their radiance was not finite; 0 unless something is wrong.
    pub fn invalid(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.invalid())).sum()
    }

    /// What pixels get of what is too much for others.
    fn shares(&self) -> Vec<[Rgb; 2]> {
        spread::spread(&self.pixels, self.film.window.width as usize)
    }

    /// Sums of the pixels with their shares.
    fn given<'s>(&'s self, shares: &'s [[Rgb; 2]]) -> impl ExactSizeIterator<Item = PixelSums> + Clone + 's {
        self.pixels.iter().zip(shares).map(|(pixel, share)| pixel.with(*share))
    }

    /// Sums of a pixel of the window.
    fn sums_of(&self, x: usize, y: usize) -> &PixelSums {
        &self.pixels[y * self.film.window.width as usize + x]
    }
}
