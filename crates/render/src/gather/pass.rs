//! Camera rays by the pass: how many each place of the film gets, and the tiles that they are shot in.
//!
//! After the first passes a place's share follows its noise: for the least mean square of relative errors, rays go
//! ∝ σ/(L + ε) (Neyman's allocation). Noise is that of the place and its neighbours together, so that none stops early
//! because it happened to look even.

use std::ops::Range;

use rayon::prelude::*;
use twinray_scene::sample::PixelSample;
use twinray_scene::sample::stream::mix;

use super::Gather;
use super::places::{EDGE, Lesson, Lessons};
use super::tile::{Known, PIXELS, SIDE, Tile, TilePixel};
use crate::film::tent;
use crate::sums::{PixelSums, Seen};

/// Camera rays of a batch.
const BATCH: u32 = 4;
/// Batches of every pixel before noise decides.
const FIRST: u64 = 2;
/// The most batches of a pixel over those of the mean.
const MOST: f64 = 16.0;
/// The least.
const LEAST: f64 = 0.25;
/// Of the mean luminance, what is added to a place's where errors are relative.
const DARK: f64 = 0.05;
/// Batches that only learn.
const LEARNING: u32 = 2;
/// Lamps among which nothing need be learnt before.
const FEW_LAMPS: usize = 8;
/// Keeps the numbers of these batches apart.
const LESSONS: u64 = 0x1E55_0115;
/// Where tiles begin, batch after batch, or what neighbours share would show as squares: offsets to the left and upwards, in
/// an order that leaves no two alike neighbours.
const OFFSETS: [usize; SIDE] = [0, 2, 1, 3];

/// What is known of a place.
#[derive(Clone, Copy, Debug, Default)]
struct Noise {
    pixels: f64,
    luminance: f64,
    /// Variance of a batch's mean.
    variance: f64,
    batches: f64,
}

/// Rows of the window that share tiles, with their sums.
struct Band<'a> {
    rows: Range<usize>,
    sums: &'a mut [PixelSums],
}

impl Gather<'_> {
    /// Adds passes until there are about `samples` camera rays per pixel; results depend on the sequence of calls, not
    /// on threads.
    pub fn advance_to(&mut self, samples: f64) {
        let pixels = self.pixels.len().max(1) as f64;
        let per_pixel = |rays: u64| rays as f64 / pixels / f64::from(BATCH);
        let wished = (samples / f64::from(BATCH)).max(1.0);
        if self.batches == 0 {
            self.learn();
        }
        let done = per_pixel(self.rays);
        if done < FIRST as f64 || !self.adaptive {
            // Whole passes, one batch at a time: places learn from each.
            let even = if self.adaptive { wished.min(FIRST as f64) } else { wished };
            let all = vec![1; self.places.size().0 * self.places.size().1];
            for _ in 0..(even - done).ceil().max(0.0) as u64 {
                self.pass(&all);
            }
        }
        let done = per_pixel(self.rays);
        if self.adaptive && done < wished {
            let plan = self.plan((wished - done) * pixels);
            self.pass(&plan);
        }
    }

    /// Learns which lamps light which place, where there are many. What these rays saw is forgotten: they looked for lamps
    /// nearly everywhere, and their noise would stay in the picture.
    fn learn(&mut self) {
        if self.estimator.lights.len() <= FEW_LAMPS {
            return;
        }
        let all = vec![1; self.places.size().0 * self.places.size().1];
        let seed = self.seed;
        // Numbers of their own: what is learnt must not know what it is used for.
        self.seed = mix(seed ^ LESSONS);
        (0..LEARNING).for_each(|_| self.pass(&all));
        self.seed = seed;
        self.pixels.iter_mut().for_each(|p| *p = PixelSums::default());
        self.rays = 0;
    }

    /// Batches for every place, about `budget` batches of pixels in all.
    fn plan(&self, budget: f64) -> Vec<u32> {
        let (columns, rows) = self.places.size();
        let known: Vec<Noise> = (0..columns * rows).into_par_iter().map(|place| self.known(place)).collect();
        let total_pixels: f64 = known.iter().map(|k| k.pixels).sum();
        let mean = known.iter().map(|k| k.pixels * k.luminance).sum::<f64>() / total_pixels.max(1.0);
        let near = |i: usize, end: usize| i.saturating_sub(1)..(i + 2).min(end);
        let noise: Vec<f64> = (0..known.len())
            .map(|t| {
                let around = near(t / columns, rows).flat_map(|y| near(t % columns, columns).map(move |x| (x, y)));
                // The place itself counts as much as all around it.
                let (variance, luminance, count) = around.fold((0.0, 0.0, 0.0), |(v, l, n), (x, y)| {
                    let other = y * columns + x;
                    let (k, weight) = (&known[other], if other == t { 8.0 } else { 1.0 });
                    (v + weight * k.variance, l + weight * k.luminance, n + weight)
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
        let mut plan: Vec<u32> = (0..known.len())
            .map(|t| {
                carried += (due(high, t) - known[t].batches) * known[t].pixels;
                let batches = (carried / known[t].pixels).floor().max(0.0);
                carried -= batches * known[t].pixels;
                batches as u32
            })
            .collect();
        // A wish for a little more is never in vain: whoever waits for it would wait for ever.
        if noise.iter().all(|n| *n == 0.0) {
            return vec![1; known.len()];
        }
        if plan.iter().all(|n| *n == 0) {
            let most_due = (0..known.len()).max_by(|&a, &b| {
                let missing = |t: usize| due(high, t) - known[t].batches;
                missing(a).total_cmp(&missing(b)).then(b.cmp(&a))
            });
            most_due.into_iter().for_each(|t| plan[t] = 1);
        }
        plan
    }

    /// What is known of a place.
    fn known(&self, place: usize) -> Noise {
        let [columns, rows] = self.places.pixels(place);
        let mut known = Noise::default();
        for p in rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| self.sums_of(x, y)) {
            known.pixels += 1.0;
            known.luminance += p.radiance().luminance();
            known.variance += p.variance_of_batch();
            known.batches = f64::from(p.rays() / BATCH);
        }
        known.luminance /= known.pixels;
        known.variance /= known.pixels;
        known
    }

    /// Shoots so many batches in every place.
    fn pass(&mut self, batches: &[u32]) {
        for round in 0..batches.iter().copied().max().unwrap_or(0) {
            let is_open = |place: usize| batches[place] > round;
            self.batch(&is_open);
            self.batches += 1;
        }
        self.places.conclude(&self.estimator.lights);
        self.rays = self.pixels.iter().map(|p| u64::from(p.rays())).sum();
    }

    /// One batch in the places that are open.
    fn batch(&mut self, is_open: &(dyn Fn(usize) -> bool + Sync)) {
        let lie = (self.batches % (SIDE * SIDE) as u32) as usize;
        let [left, above] = [OFFSETS[lie % SIDE], OFFSETS[(lie / SIDE + lie) % SIDE]];
        let width = self.film.window.width as usize;
        let mut pixels = std::mem::take(&mut self.pixels);
        let this = &*self;
        let lessons: Vec<(usize, Lessons)> = bands(&mut pixels, width, above)
            .into_par_iter()
            .enumerate()
            .map(|(number, band)| this.shoot(band, number == 0, left, is_open))
            .collect();
        self.pixels = pixels;
        for (row, lessons) in &lessons {
            self.places.learn(*row, lessons);
        }
    }

    /// Shoots the batch of a band; returns what was learnt, and of which row of places on.
    fn shoot(
        &self,
        band: Band,
        is_first: bool,
        left: usize,
        is_open: &(dyn Fn(usize) -> bool + Sync),
    ) -> (usize, Lessons) {
        let Band { rows, sums } = band;
        let window = &self.film.window;
        let width = window.width as usize;
        let rows_of_places = rows.start / EDGE..(rows.end - 1) / EDGE + 1;
        let first_place = self.places.of(0, rows.start);
        let mut lessons = self.places.lessons_of(rows_of_places.clone());
        let by_power = self.estimator.shadows();
        // A band may be lower than a tile is; its first tile may be narrower.
        let first_row = SIDE - rows.len().min(SIDE);
        for column in 0..(width + left).div_ceil(SIDE) {
            let pixels: Vec<TilePixel> = (0..PIXELS)
                .filter_map(|slot| {
                    let x = (column * SIDE + slot % SIDE).checked_sub(left).filter(|x| *x < width)?;
                    let y = rows.start + (slot / SIDE).checked_sub(if is_first { first_row } else { 0 })?;
                    let place = (y < rows.end).then(|| self.places.of(x, y)).filter(|p| is_open(*p))?;
                    let at = [window.x + x as u32, window.y + y as u32];
                    Some(TilePixel { x, y, number: self.film.number(at), place: place - first_place })
                })
                .collect();
            if pixels.is_empty() {
                continue;
            }
            let tile = Tile { pixels: &pixels, seed: self.seed };
            let mut seen = [Seen::default(); PIXELS];
            let sums_of = |p: &TilePixel| (p.y - rows.start) * width + p.x;
            let sums_before = &*sums;
            let before: Vec<u32> = pixels.iter().map(|p| sums[sums_of(p)].rays()).collect();
            let ray = |p: &TilePixel, numbers: &mut PixelSample| {
                let (offset, lens) = (numbers.pair().map(tent), numbers.pair());
                let at = [window.x + p.x as u32, window.y + p.y as u32];
                self.film.ray(&self.camera, at, offset, lens)
            };
            let known = |p: &TilePixel| {
                let place = first_place + p.place;
                let sums = &sums_before[sums_of(p)];
                Known {
                    shadows: self.places.shadows(place, by_power),
                    guide: self.places.guide(place),
                    usual: self.places.usual(place),
                    least_usual: {
                        let [direct, indirect] = sums.excess();
                        (sums.radiance() + direct + indirect - sums.lights()).luminance()
                    },
                }
            };
            for k in 0..BATCH {
                let learn = |p: &TilePixel, lesson: Lesson| lessons.add(p.place, lesson);
                tile.sample(&self.estimator, &before, k, known, ray, &mut seen, learn);
            }
            for (p, seen) in pixels.iter().zip(&seen) {
                sums[sums_of(p)].add(seen);
            }
        }
        (rows_of_places.start, lessons)
    }
}

/// Cuts the rows of a window into bands as high as a tile; the first is lower by `above` rows.
fn bands(pixels: &mut [PixelSums], width: usize, above: usize) -> Vec<Band<'_>> {
    let (mut rest, mut row, mut bands) = (pixels, 0, Vec::new());
    while !rest.is_empty() {
        let height = if row == 0 { SIDE - above } else { SIDE };
        let (sums, others) = rest.split_at_mut((height * width).min(rest.len()));
        let end = row + sums.len() / width;
        bands.push(Band { rows: row..end, sums });
        (rest, row) = (others, end);
    }
    bands
}
