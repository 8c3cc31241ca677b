//! A block of tiles, which one task works on: its sums, and what it has learnt of the lamps.
//!
//! Which lamps light a place, and how much of them gets there, is learnt from the shadow rays themselves, pass by pass.
//! A block learns alone and in order, so that threads change nothing.

use glam::DVec3;
use twinray_scene::sample::PixelSample;

use super::sample::Estimator;
use super::tile::{PIXELS, SIDE, Tile};
use crate::direct::Shadows;
use crate::film::Crop;
use crate::lights::{Choice, Lights};
use crate::sums::{PixelSums, Seen};

/// Tiles along a side of a block.
pub(super) const TILES: usize = 4;
/// Pixels along a side of a block.
pub(super) const EDGE: usize = TILES * SIDE;
/// Camera rays of a batch.
pub(super) const BATCH: u32 = 4;
/// Shadow rays before a block trusts what it has learnt.
const LESSONS: u64 = 512;
/// The share of shadow rays that go by power all the same: what was overlooked is found.
const BY_POWER: f64 = 0.2;

/// A part of the film.
pub(super) struct Block {
    /// First pixel.
    pub x: usize,
    pub y: usize,
    /// The pixels that are wanted.
    window: Crop,
    /// Pixels in a row of the whole film.
    width: usize,
    /// Sums, `EDGE` to a row.
    pub sums: Vec<PixelSums>,
    /// Σ of the light that each lamp gave, and the number of shadow rays.
    given: Vec<f64>,
    lessons: u64,
}

impl Block {
    /// The block whose first pixel is (`x`, `y`).
    pub fn new((x, y): (usize, usize), window: Crop, width: usize, lights: &Lights) -> Self {
        Self {
            x,
            y,
            window,
            width,
            sums: vec![PixelSums::default(); EDGE * EDGE],
            given: vec![0.0; lights.len()],
            lessons: 0,
        }
    }

    /// Sums of a pixel of the film that lies in the block.
    pub fn pixel(&self, x: usize, y: usize) -> &PixelSums {
        &self.sums[(y - self.y) * EDGE + x - self.x]
    }

    /// Shoots so many batches for each tile, `TILES` to a row.
    pub fn shoot(
        &mut self,
        estimator: &Estimator,
        seed: u64,
        batches: impl Fn(usize, usize) -> u32,
        ray: impl Fn(usize, usize, &mut PixelSample) -> Option<(DVec3, DVec3)>,
    ) {
        let learnt = self.learnt(&estimator.lights);
        let shadows = match &learnt {
            Some(choice) => Shadows { choice, candidates: 1 },
            None => estimator.shadows(),
        };
        let (width, window) = (self.width, self.window);
        let tiles_in_row = width.div_ceil(SIDE) as u64;
        let within = |at: usize, first: u32, count: u32| at >= first as usize && at < first as usize + count as usize;
        for t in 0..TILES * TILES {
            let (x0, y0) = (self.x + t % TILES * SIDE, self.y + t / TILES * SIDE);
            let places: Vec<(usize, usize)> = (0..PIXELS)
                .map(|slot| (x0 + slot % SIDE, y0 + slot / SIDE))
                .filter(|&(x, y)| within(x, window.x, window.width) && within(y, window.y, window.height))
                .collect();
            let Some(&(first_x, first_y)) = places.first() else { continue };
            let pixels: Vec<(u64, usize)> =
                places.iter().map(|&(x, y)| ((y * width + x) as u64, (y - y0) * SIDE + x - x0)).collect();
            let number = (y0 / SIDE) as u64 * tiles_in_row + (x0 / SIDE) as u64;
            let tile = Tile { number, pixels: &pixels, seed };
            for _ in 0..batches(x0 / SIDE, y0 / SIDE) {
                let first = self.pixel(first_x, first_y).rays();
                let mut seen = [Seen::default(); PIXELS];
                for k in first..first.saturating_add(BATCH) {
                    let (given, lessons) = (&mut self.given, &mut self.lessons);
                    let learn = |lamp: usize, light: f64| {
                        given[lamp] += light;
                        *lessons += 1;
                    };
                    let ray = |n: usize, numbers: &mut _| ray(places[n].0, places[n].1, numbers);
                    tile.sample(estimator, k, shadows, ray, &mut seen, learn);
                }
                for (&(x, y), seen) in places.iter().zip(&seen) {
                    self.sums[(y - self.y) * EDGE + x - self.x].add(seen);
                }
            }
        }
    }

    /// The choice of lamps after what was learnt so far.
    fn learnt(&self, lights: &Lights) -> Option<Choice> {
        let total: f64 = self.given.iter().sum();
        if self.lessons < LESSONS || !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let power = lights.by_power();
        let weight =
            |(lamp, given): (usize, &f64)| BY_POWER * power.probability(lamp) + (1.0 - BY_POWER) * given / total;
        Choice::new(&self.given.iter().enumerate().map(weight).collect::<Vec<f64>>())
    }
}
