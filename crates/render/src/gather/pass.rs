//! How many camera rays each pixel gets.
//!
//! Rays come in batches of [`BATCH`], even among each other. After the first passes a pixel's share follows its noise:
//! for the least mean square of relative errors, rays go ∝ σ/(L + ε) (Neyman's allocation). Noise is that of the pixel
//! and its neighbours together, so that no pixel stops early because it happened to look even.

use rayon::prelude::*;

use super::Gather;
use crate::film::{PixelSums, Seen};

/// Camera rays of a batch.
pub(super) const BATCH: u32 = 4;
/// Batches of every pixel before noise decides.
const FIRST: u64 = 2;
/// The most batches of a pixel over those of the mean.
const MOST: f64 = 16.0;
/// The least.
const LEAST: f64 = 0.25;
/// Of the mean luminance, what is added to a pixel's where errors are relative.
const DARK: f64 = 0.05;
/// Neighbours to each side whose noise counts.
const AROUND: usize = 2;

impl Gather<'_> {
    /// Adds passes until there are about `samples` camera rays per pixel; results depend on the sequence of calls, not
    /// on threads.
    pub fn advance_to(&mut self, samples: f64) {
        let pixels = self.pixels.len().max(1) as f64;
        let wished = (samples * pixels / f64::from(BATCH)).ceil().max(pixels);
        let first = FIRST as f64 * pixels;
        let done = self.rays as f64 / f64::from(BATCH);
        if done < first || !self.options.adaptive {
            // Whole passes over all pixels.
            let even = if self.options.adaptive { wished.min(first) } else { wished };
            let each = ((even - done) / pixels).ceil().max(0.0) as u32;
            self.pass(&|_| each);
        }
        let done = self.rays as f64 / f64::from(BATCH);
        if self.options.adaptive && done < wished {
            let plan = self.plan(wished - done);
            self.pass(&|index| plan[index]);
        }
    }

    /// Batches for every pixel, about `budget` in all.
    fn plan(&self, budget: f64) -> Vec<u32> {
        let (width, height) = (self.options.width as usize, self.options.height as usize);
        let mean = self.pixels.iter().map(|p| p.radiance().luminance()).sum::<f64>() / self.pixels.len().max(1) as f64;
        let near = |index: usize, side: usize, end: usize| {
            index.saturating_sub(AROUND)..(index + AROUND + 1).min(end).max(side)
        };
        let noise: Vec<f64> = (0..self.pixels.len())
            .into_par_iter()
            .map(|index| {
                let (x, y) = (index % width, index / width);
                let (mut squares, mut luminance, mut count) = (0.0, 0.0, 0.0);
                for row in near(y, 0, height) {
                    for column in near(x, 0, width) {
                        let p = &self.pixels[row * width + column];
                        (squares, luminance, count) =
                            (squares + p.variance_of_batch(), luminance + p.radiance().luminance(), count + 1.0);
                    }
                }
                let relative = (squares / count).sqrt() / (luminance / count + DARK * mean).max(1e-300);
                if relative.is_finite() { relative } else { 0.0 }
            })
            .collect();
        let have: Vec<f64> = self.pixels.iter().map(|p| f64::from(p.rays() / BATCH)).collect();
        let total = have.iter().sum::<f64>() + budget;
        let mean_after = total / have.len().max(1) as f64;
        // Whoever has more than its due keeps it, and what others should get is less: bisection on the common factor.
        let due = |factor: f64, index: usize| {
            (factor * noise[index]).clamp(LEAST * mean_after, MOST * mean_after).max(have[index])
        };
        let sum = |factor: f64| (0..have.len()).map(|i| due(factor, i)).sum::<f64>();
        let largest = noise.iter().copied().fold(0.0, f64::max);
        let (mut low, mut high) = (0.0, if largest > 0.0 { MOST * mean_after / largest * 1e6 } else { 0.0 });
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if sum(middle) > total { high = middle } else { low = middle }
        }
        // What is left of a whole batch is carried on, so that the sum is right.
        let mut carried = 0.0;
        (0..have.len())
            .map(|i| {
                carried += due(high, i) - have[i];
                let batches = carried.floor().max(0.0);
                carried -= batches;
                batches as u32
            })
            .collect()
    }

    /// Shoots `batches` for every pixel.
    fn pass(&mut self, batches: &(dyn Fn(usize) -> u32 + Sync)) {
        let Self { estimator, camera, options, pixels, .. } = self;
        let width = options.width.max(1) as usize;
        pixels.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, sums) in row.iter_mut().enumerate() {
                let index = y * width + x;
                for _ in 0..batches(index) {
                    let first = sums.rays();
                    let mut batch = Seen::default();
                    for k in first..first.saturating_add(BATCH) {
                        estimator.add(camera, options, index, k, &mut batch);
                    }
                    sums.add(&batch);
                }
            }
        });
        self.rays = self.pixels.iter().map(|p: &PixelSums| u64::from(p.rays())).sum();
    }
}
