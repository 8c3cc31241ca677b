//! The final gather: a picture whose last bounce is traced, and all bounces before it come from a solution.
//!
//! A camera ray goes through mirrors and glass to the first surface that scatters. There, light straight from what emits
//! is found by shadow rays and by a ray of the BRDF, weighed by the balance heuristic; the same ray brings what the
//! solution knows of the light at its far end, and lobes met there are followed further. Where it is too short for
//! patches to look even, its end is a point like the first. No patch is seen directly: shadows and textures are sharp,
//! and only light of two bounces and more is as smooth as patches are.
//! `sample` follows one camera ray; `tile` lets neighbours share what their gather rays find; `block` is the work of one
//! task and learns which lamps matter there; `pass` decides how many rays each tile gets.

mod block;
mod pass;
mod sample;
mod tile;

use twinray_scene::{Camera, PatchScene};
use twinray_solve::Solution;

use crate::picture::Picture;
use crate::sums::{self, PixelSums};
use block::{Block, EDGE};
use sample::Estimator;
use tile::SIDE;

/// Settings of a gather.
#[derive(Clone, Copy, Debug)]
pub struct GatherOptions {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// Whether pixels with more noise get more camera rays.
    pub adaptive: bool,
}

impl Default for GatherOptions {
    fn default() -> Self {
        Self { width: 640, height: 480, seed: 1, adaptive: true }
    }
}

/// A picture that gets better with every pass.
pub struct Gather<'a> {
    estimator: Estimator<'a>,
    camera: Camera,
    options: GatherOptions,
    /// Row by row.
    blocks: Vec<Block>,
    /// Camera rays so far.
    rays: u64,
}

impl<'a> Gather<'a> {
    /// A black picture of `solution`.
    pub fn new(scene: &'a PatchScene, solution: &'a Solution, camera: &Camera, options: &GatherOptions) -> Self {
        let film = (options.width as usize, options.height as usize);
        let estimator = Estimator::new(scene, solution);
        let blocks = (0..film.1.div_ceil(EDGE))
            .flat_map(|y| (0..film.0.div_ceil(EDGE)).map(move |x| (x * EDGE, y * EDGE)))
            .map(|(x, y)| Block::new(x, y, film, &estimator.lights))
            .collect();
        Self { estimator, camera: camera.clone(), options: *options, blocks, rays: 0 }
    }

    /// Camera rays per pixel so far, mean.
    pub fn samples(&self) -> f64 {
        self.rays as f64 / self.pixel_count().max(1) as f64
    }

    /// Camera rays so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        sums::picture(&self.pixels(), self.options.width)
    }

    /// The part of the picture that surfaces reflect of light straight from what emits, in every pixel, linear radiance.
    pub fn direct(&self) -> Vec<[f32; 3]> {
        self.pixels().iter().map(|p| p.direct().to_f32()).collect()
    }

    /// Variance of every pixel's luminance, `[height, width]`: the square of its standard error; infinite before the
    /// second batch of rays.
    pub fn variance(&self) -> Vec<f32> {
        self.pixels().iter().map(|p| p.variance() as f32).collect()
    }

    /// Relative RMS error of the pixels' luminance by their noise, √(Σ variance / Σ 𝓛²), over pixels that no light
    /// covers; over all pixels if there are no others. Infinite before the second batch; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        sums::relative_error(&self.pixels())
    }

    /// Camera rays that were dropped because their radiance was not finite; 0 unless something is wrong.
    pub fn invalid(&self) -> u64 {
        self.pixels().iter().map(|p| u64::from(p.invalid())).sum()
    }

    fn pixel_count(&self) -> usize {
        self.options.width as usize * self.options.height as usize
    }

    /// Columns and rows of tiles.
    fn tiles(&self) -> (usize, usize) {
        ((self.options.width as usize).div_ceil(SIDE), (self.options.height as usize).div_ceil(SIDE))
    }

    /// The block that holds a pixel.
    fn block(&self, x: usize, y: usize) -> &Block {
        &self.blocks[y / EDGE * (self.options.width as usize).div_ceil(EDGE) + x / EDGE]
    }

    /// Sums of all pixels, row by row.
    fn pixels(&self) -> Vec<PixelSums> {
        let (width, height) = (self.options.width as usize, self.options.height as usize);
        (0..height).flat_map(|y| (0..width).map(move |x| *self.block(x, y).pixel(x, y))).collect()
    }
}
