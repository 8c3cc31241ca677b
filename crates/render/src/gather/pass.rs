//! How many camera rays each block gets.
//!
//! After the first passes a block's share follows its noise: for the least mean square of relative errors, rays go
//! ∝ σ/(L + ε) (Neyman's allocation). Noise is that of the block and its neighbours together, so that none stops early
//! because it happened to look even.

use rayon::prelude::*;
use twinray_scene::sample::PixelSample;

use super::block::{BATCH, Block};
use super::{Gather, Grid};
use crate::film::tent;

/// Batches of every block before noise decides.
const FIRST: u64 = 2;
/// The most batches of a block over those of the mean.
const MOST: f64 = 16.0;
/// The least.
const LEAST: f64 = 0.25;
/// Of the mean luminance, what is added to a block's where errors are relative.
const DARK: f64 = 0.05;

/// What is known of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    pixels: f64,
    luminance: f64,
    /// Variance of a batch's mean.
    variance: f64,
    batches: f64,
}

impl Known {
    fn of(block: &Block) -> Self {
        let wanted = || block.sums.iter().filter(|p| p.rays() > 0);
        let pixels = wanted().count() as f64;
        Self {
            pixels,
            luminance: wanted().map(|p| p.radiance().luminance()).sum::<f64>() / pixels,
            variance: wanted().map(|p| p.variance_of_batch()).sum::<f64>() / pixels,
            batches: f64::from(block.batches()),
        }
    }
}

impl Gather<'_> {
    /// Adds passes until there are about `samples` camera rays per pixel; results depend on the sequence of calls, not
    /// on threads.
    pub fn advance_to(&mut self, samples: f64) {
        let pixels = self.pixel_count().max(1) as f64;
        let per_pixel = |rays: u64| rays as f64 / pixels / f64::from(BATCH);
        let wished = (samples / f64::from(BATCH)).max(1.0);
        let done = per_pixel(self.rays);
        if done < FIRST as f64 || !self.adaptive {
            // Whole passes over all blocks.
            let even = if self.adaptive { wished.min(FIRST as f64) } else { wished };
            // One at a time: blocks learn from each.
            for _ in 0..(even - done).ceil().max(0.0) as u64 {
                self.pass(&|_| 1);
            }
        }
        let done = per_pixel(self.rays);
        if self.adaptive && done < wished {
            let plan = self.plan((wished - done) * pixels);
            self.pass(&|block| plan[block]);
        }
    }

    /// Batches for every block, about `budget` batches of pixels in all.
    fn plan(&self, budget: f64) -> Vec<u32> {
        let Grid { columns, rows, .. } = self.grid();
        let known: Vec<Known> = self.blocks.par_iter().map(Known::of).collect();
        let total_pixels: f64 = known.iter().map(|k| k.pixels).sum();
        let mean = known.iter().map(|k| k.pixels * k.luminance).sum::<f64>() / total_pixels.max(1.0);
        let near = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
        let noise: Vec<f64> = (0..known.len())
            .map(|t| {
                let around = near(t / columns, rows).flat_map(|y| near(t % columns, columns).map(move |x| (x, y)));
                let (variance, luminance, count) = around.fold((0.0, 0.0, 0.0), |(v, l, n), (x, y)| {
                    let k = &known[y * columns + x];
                    (v + k.variance, l + k.luminance, n + 1.0)
                });
                let relative = (variance / count).sqrt() / (luminance / count + DARK * mean).max(1e-300);
                if relative.is_finite() { relative } else { 0.0 }
            })
            .collect();
        let total = known.iter().map(|k| k.pixels * k.batches).sum::<f64>() + budget;
        let after = total / total_pixels.max(1.0);
        // Whoever has more than its due keeps it, and what others should get is less: bisection on the common factor.
        let due = |factor: f64, t: usize| (factor * noise[t]).clamp(LEAST * after, MOST * after).max(known[t].batches);
        let sum = |factor: f64| (0..known.len()).map(|t| known[t].pixels * due(factor, t)).sum::<f64>();
        let smallest = noise.iter().copied().filter(|n| *n > 0.0).fold(f64::INFINITY, f64::min);
        let (mut low, mut high) = (0.0, if smallest.is_finite() { MOST * after / smallest } else { 0.0 });
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if sum(middle) > total { high = middle } else { low = middle }
        }
        // What is left of a whole batch is carried on, so that the sum is right.
        let mut carried = 0.0;
        (0..known.len())
            .map(|t| {
                carried += due(high, t) - known[t].batches;
                let batches = carried.floor().max(0.0);
                carried -= batches;
                batches as u32
            })
            .collect()
    }

    /// Shoots so many batches for every block.
    fn pass(&mut self, batches: &(dyn Fn(usize) -> u32 + Sync)) {
        let Self { estimator, camera, film, seed, blocks, .. } = self;
        blocks.par_iter_mut().enumerate().for_each(|(number, block)| {
            let ray = |x: usize, y: usize, numbers: &mut PixelSample| {
                let (place, lens) = (numbers.pair().map(tent), numbers.pair());
                film.ray(camera, [x as u32, y as u32], place, lens)
            };
            block.shoot(estimator, *seed, batches(number), ray);
        });
        self.rays = self.blocks.iter().flat_map(|b| &b.sums).map(|p| u64::from(p.rays())).sum();
    }
}
