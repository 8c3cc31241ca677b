//! How many camera rays each tile gets.
//!
//! After the first passes a tile's share follows its noise: for the least mean square of relative errors, rays go
//! ∝ σ/(L + ε) (Neyman's allocation). Noise is that of the tile and its neighbours together, so that none stops early
//! because it happened to look even.

use rayon::prelude::*;
use twinray_scene::sample::PixelSample;

use super::block::{BATCH, Block};
use super::tile::SIDE;
use super::{Gather, Grid};
use crate::film::tent;

/// Batches of every tile before noise decides.
const FIRST: u64 = 2;
/// The most batches of a tile over those of the mean.
const MOST: f64 = 16.0;
/// The least.
const LEAST: f64 = 0.25;
/// Of the mean luminance, what is added to a tile's where errors are relative.
const DARK: f64 = 0.05;

/// What is known of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    pixels: f64,
    luminance: f64,
    /// Variance of a batch's mean.
    variance: f64,
    batches: f64,
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
            // Whole passes over all tiles.
            let even = if self.adaptive { wished.min(FIRST as f64) } else { wished };
            // One at a time: blocks learn from each.
            for _ in 0..(even - done).ceil().max(0.0) as u64 {
                self.pass(&|_| 1);
            }
        }
        let done = per_pixel(self.rays);
        if self.adaptive && done < wished {
            let plan = self.plan((wished - done) * pixels);
            self.pass(&|tile| plan[tile]);
        }
    }

    /// Batches for every tile, about `budget` batches of pixels in all.
    fn plan(&self, budget: f64) -> Vec<u32> {
        let Grid { columns, rows, .. } = self.tiles();
        let known: Vec<Known> = (0..columns * rows).into_par_iter().map(|t| self.known(t)).collect();
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

    /// What is known of a tile.
    fn known(&self, tile: usize) -> Known {
        let (grid, window) = (self.tiles(), &self.film.window);
        let pixels = |square: usize, first: u32, count: u32| {
            let (first, end) = (first as usize, (first + count) as usize);
            (square * SIDE).max(first)..((square + 1) * SIDE).min(end)
        };
        let mut known = Known::default();
        for y in pixels(grid.row + tile / grid.columns, window.y, window.height) {
            for x in pixels(grid.column + tile % grid.columns, window.x, window.width) {
                let p = self.pixel(x, y);
                known.pixels += 1.0;
                known.luminance += p.radiance().luminance();
                known.variance += p.variance_of_batch();
                known.batches = f64::from(p.rays() / BATCH);
            }
        }
        known.luminance /= known.pixels;
        known.variance /= known.pixels;
        known
    }

    /// Shoots so many batches for every tile.
    fn pass(&mut self, batches: &(dyn Fn(usize) -> u32 + Sync)) {
        let grid = self.tiles();
        let Self { estimator, camera, film, seed, blocks, .. } = self;
        blocks.par_iter_mut().for_each(|block: &mut Block| {
            let ray = |x: usize, y: usize, numbers: &mut PixelSample| {
                let (place, lens) = (numbers.pair().map(tent), numbers.pair());
                film.ray(camera, [x as u32, y as u32], place, lens)
            };
            block.shoot(estimator, *seed, |column, row| batches(grid.index(column, row)), ray);
        });
        self.rays = self.pixels().iter().map(|p| u64::from(p.rays())).sum();
    }
}
