//! A block of tiles, which one task works on: its sums, and what it has learnt of the lamps.
//!
//! Which lamps light a place, and how much of them gets there, is learnt from the shadow rays themselves, pass by pass.
//! A block learns alone and in order, so that threads change nothing.

use glam::DVec3;
use twinray_scene::sample::PixelSample;

use super::sample::Estimator;
use super::tile::{PIXELS, SIDE, Tile, TilePixel};
use crate::direct::Shadows;
use crate::film::Crop;
use crate::lights::{Choice, Lights};
use crate::sums::{PixelSums, Seen};

/// Pixels along a side of a block.
pub(super) const EDGE: usize = 4 * SIDE;
/// Camera rays of a batch.
pub(super) const BATCH: u32 = 4;
/// Places where tiles may lie against their block.
const PLACES: u32 = (SIDE * SIDE) as u32;
/// Offsets of tiles to the left and upwards, in an order that leaves no two alike neighbours.
const OFFSETS: [usize; SIDE] = [0, 2, 1, 3];
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
    batches: u32,
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
            batches: 0,
        }
    }

    /// Sums of a pixel of the film that lies in the block.
    pub fn pixel(&self, x: usize, y: usize) -> &PixelSums {
        &self.sums[(y - self.y) * EDGE + x - self.x]
    }

    /// Batches so far, the same for every pixel.
    pub fn batches(&self) -> u32 {
        self.batches
    }

    /// Shoots so many batches; `ray` gives a camera ray of a pixel.
    pub fn shoot(
        &mut self,
        estimator: &Estimator,
        seed: u64,
        batches: u32,
        ray: impl Fn(usize, usize, &mut PixelSample) -> Option<(DVec3, DVec3)>,
    ) {
        let learnt = self.learnt(&estimator.lights);
        let shadows = match &learnt {
            Some(choice) => Shadows { choice, candidates: 1 },
            None => estimator.shadows(),
        };
        for _ in 0..batches {
            self.batch(estimator, seed, shadows, &ray);
            self.batches += 1;
        }
    }

    /// One batch. Tiles lie elsewhere each time, or what neighbours share would show as squares.
    fn batch(
        &mut self,
        estimator: &Estimator,
        seed: u64,
        shadows: Shadows,
        ray: impl Fn(usize, usize, &mut PixelSample) -> Option<(DVec3, DVec3)>,
    ) {
        let place = (self.batches % PLACES) as usize;
        let [left, above] = [place & 3, place >> 2].map(|k| OFFSETS[k]);
        let tiles = EDGE / SIDE + 1;
        for t in 0..tiles * tiles {
            let (column, row) = (t % tiles, t / tiles);
            let pixels: Vec<TilePixel> = (0..PIXELS)
                .filter_map(|slot| {
                    let x = (column * SIDE + slot % SIDE).checked_sub(left).filter(|x| *x < EDGE)? + self.x;
                    let y = (row * SIDE + slot / SIDE).checked_sub(above).filter(|y| *y < EDGE)? + self.y;
                    self.window.holds(x, y).then(|| TilePixel { x, y, number: (y * self.width + x) as u64, slot })
                })
                .collect();
            if pixels.is_empty() {
                continue;
            }
            // Tiles in one place are a sequence of their own.
            let number = ((self.y * self.width + self.x) as u64) << 16 | (place * tiles * tiles + t) as u64;
            let tile = Tile { number, pixels: &pixels, seed, first: self.batches / PLACES * BATCH };
            let mut seen = [Seen::default(); PIXELS];
            for k in 0..BATCH {
                let (given, lessons) = (&mut self.given, &mut self.lessons);
                let learn = |lamp: usize, light: f64| {
                    given[lamp] += light;
                    *lessons += 1;
                };
                let ray = |p: &TilePixel, numbers: &mut _| ray(p.x, p.y, numbers);
                tile.sample(estimator, self.batches * BATCH + k, k, shadows, ray, &mut seen, learn);
            }
            for (p, seen) in pixels.iter().zip(&seen) {
                self.sums[(p.y - self.y) * EDGE + p.x - self.x].add(seen);
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
