//! Pixels that share their gather rays.
//!
//! Neighbouring pixels see points of one surface, and what one's gather ray found lights the others nearly as well: each
//! takes the far ends of all, weighed by the balance heuristic over all of their densities (Bekaert, Sbert, Halton,
//! "Accelerating path tracing by re-using paths", EGWR 2002). Far ends must be far away against the tile, for what lies
//! between is looked at from one of the points alone; nearer ones serve their own pixel only. Light straight from
//! lamps, textures and normals stay each pixel's own. Gather directions are even over a tile and its samples.

use glam::DVec3;
use twinray_scene::Rgb;
use twinray_scene::sample::stream::mix;
use twinray_scene::sample::{PixelSample, net_point};

use super::guide::Guide;
use super::places::Lesson;
use super::sample::{Estimator, Gathered, Point, Sight};
use crate::direct::Shadows;
use crate::sums::Seen;

/// Pixels along a side of a tile.
pub(super) const SIDE: usize = 4;
/// Pixels of a tile.
pub(super) const PIXELS: usize = SIDE * SIDE;
/// More squares of pixels than a row of a film has.
const MOST_SQUARES: u64 = 1 << 32;
/// Far ends count as far from so many times the distance between the points that share them.
const FAR: f64 = 4.0;
/// So many times what is usual at a pixel, a gather ray may bring to it at least; what is beyond is for all around.
const BRIGHT: f64 = 4.0;
/// As the pixel's rays become more, each may bring this part of what is usual for all of them: none ever shows as a dot, and
/// in the limit nothing is given away.
const BRIGHT_SHARE: f64 = 1.0 / 16.0;
/// Light straight from what emits may be so many times more: most shadow rays bring nothing in half shadow, and others much.
const BRIGHTER: f64 = 4.0;
/// So many times what is expected of all gather rays of a point, one may bring to all pixels together. What is beyond is lost.
const MOST: f64 = 256.0;
/// Cosine between normals of points that share.
const SAME_NORMAL: f64 = 0.85;
/// Rise over run of points that share.
const SAME_PLANE: f64 = 0.2;

/// A pixel's sample while its tile is at work.
#[derive(Clone, Copy, Debug, Default)]
struct Work<'g> {
    sight: Sight<'g>,
    /// The camera sees nothing there; exposure must not take that for darkness.
    is_outside: bool,
    gathered: Option<Gathered>,
    direct: Rgb,
    indirect: Rgb,
    /// What was too much for one pixel: of direct and of indirect light.
    excess: [Rgb; 2],
    /// What a gather ray may bring, luminance.
    bound: f64,
}

/// What is known of a pixel before its sample.
#[derive(Clone, Copy)]
pub(super) struct Known<'s> {
    pub shadows: Shadows<'s>,
    pub guide: Option<&'s Guide>,
    /// What a gather ray brings is usually so many times what is expected,
    pub usual: f64,
    /// or so much luminance, whichever is more.
    pub least_usual: f64,
}

/// The pixels of a tile: their rays, and where sums go.
pub(super) struct Tile<'t> {
    pub pixels: &'t [TilePixel],
    pub seed: u64,
}

/// A pixel of a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct TilePixel {
    /// Column and row in the window, and the number on the whole film.
    pub x: usize,
    pub y: usize,
    pub number: u64,
    /// The place of the film that it belongs to, as those count who learn.
    pub place: usize,
}

impl Tile<'_> {
    /// Sample `k` of a batch for every pixel, which had so many `before`: `ray` gives a camera ray of the world. Adds to
    /// `seen`; `learn` is told what which lamp gave.
    pub fn sample<'s>(
        &self,
        estimator: &Estimator,
        before: &[u32],
        k: u32,
        known: impl Fn(&TilePixel) -> Known<'s>,
        ray: impl Fn(&TilePixel, &mut PixelSample) -> Option<(DVec3, DVec3)>,
        seen: &mut [Seen],
        mut learn: impl FnMut(&TilePixel, Lesson),
    ) {
        let mut work = [Work::default(); PIXELS];
        for (n, pixel) in self.pixels.iter().enumerate() {
            let mut numbers = PixelSample::new(self.seed, pixel.number, before[n] + k);
            let Known { shadows, guide, usual, least_usual } = known(pixel);
            // Where the camera sees nothing, as beyond a fisheye's circle, the pixel stays black.
            let work = &mut work[n];
            let Some((origin, direction)) = ray(pixel, &mut numbers) else {
                work.is_outside = true;
                continue;
            };
            work.sight = estimator.look(origin, direction, guide, &mut numbers);
            let Some(point) = &work.sight.point else { continue };
            let usual = (usual * point.expected.luminance()).max(least_usual);
            work.bound = usual * BRIGHT.max(BRIGHT_SHARE * f64::from(before[n] + k));
            let (light, lamp) = estimator.lit(point, shadows, &mut numbers);
            work.direct = light;
            if let Some(lamp) = lamp {
                learn(pixel, Lesson::Lamp(lamp, light.luminance()));
            }
            // Wherever tiles lie now, a pixel's directions are those of one square of pixels: its own are even in any case.
            let square = (pixel.y / SIDE) as u64 * MOST_SQUARES + (pixel.x / SIDE) as u64;
            let slot = pixel.y % SIDE * SIDE + pixel.x % SIDE;
            let u = net_point(mix(self.seed ^ mix(square)), dealt(before[n] + k, slot));
            work.gathered = estimator.gather(point, u, shadows, &mut numbers);
            let Some(Gathered { lamp, emitted, direction, density, scattered, other }) = work.gathered else {
                learn(pixel, Lesson::Reflected(light.luminance(), point.expected.luminance()));
                continue;
            };
            let factor = reflected(point, direction);
            // What the BRDF's own ray found of a lamp is a lesson too: the rest of what it gives here.
            if let Some(lamp) = lamp {
                learn(pixel, Lesson::Lamp(lamp, (factor * emitted).luminance() / density));
            }
            let all = emitted + other + scattered.map_or(Rgb::BLACK, |(radiance, _, _)| radiance);
            let brought = (factor * all).luminance() / density;
            learn(pixel, Lesson::Direction(direction, brought * brought * density));
            learn(pixel, Lesson::Reflected(brought + light.luminance(), point.expected.luminance()));
        }
        self.share(&mut work);
        for (work, seen) in work.iter_mut().zip(seen) {
            work.bound_direct();
            add(work, seen);
        }
    }

    /// Turns what was gathered into light that reaches the eye.
    fn share(&self, work: &mut [Work<'_>; PIXELS]) {
        let mut open: u32 = (1 << self.pixels.len()) - 1;
        while open != 0 {
            let leader = open.trailing_zeros() as usize;
            open &= !(1 << leader);
            let Some(point) = work[leader].sight.point else { continue };
            let (mut group, mut reach) = (1u32 << leader, 0.0f64);
            for n in (0..self.pixels.len()).filter(|n| open >> n & 1 == 1) {
                let Some(other) = &work[n].sight.point else { continue };
                let offset = other.vertex.point - point.vertex.point;
                let rise = offset.dot(point.vertex.geometric).abs().max(offset.dot(other.vertex.geometric).abs());
                let alike = point.vertex.normal.dot(other.vertex.normal) > SAME_NORMAL;
                if alike && rise <= SAME_PLANE * offset.length() {
                    group |= 1 << n;
                    reach = reach.max(offset.length());
                }
            }
            open &= !group;
            collect(work, group, reach);
        }
    }
}

/// The point of a square's sequence that sample `k` of the pixel in `slot` gets: each sample's sixteen points are an even
/// set, and so are a pixel's own points of sixteen samples.
///
/// The low four bits of the index decide the first digits of the first coordinate, and those of the second together with
/// the next four bits, which are k's: so both A and A + 1 must be invertible where the low bits are slot + A·k over GF(2).
/// Multiplication by an element of GF(16) other than 0 and 1 is such a map.
fn dealt(k: u32, slot: usize) -> u32 {
    let low = k & 15;
    let turned = (low << 1 ^ if low & 8 != 0 { 0b1_0011 } else { 0 }) & 15;
    k << 4 | (slot as u32 ^ turned)
}

/// Members of a group, given as bits.
fn members(group: u32) -> impl Iterator<Item = usize> + Clone {
    (0..PIXELS).filter(move |n| group >> n & 1 == 1)
}

/// Gives every member of a group what the gather rays of all found; points are at most `reach` from each other.
fn collect(work: &mut [Work<'_>; PIXELS], group: u32, reach: f64) {
    for i in members(group) {
        let (Some(point), Some(gathered)) = (work[i].sight.point, work[i].gathered) else { continue };
        let Gathered { direction, density, emitted, scattered, other, .. } = gathered;
        let own = reflected(&point, direction) / density;
        work[i].direct += own * emitted;
        work[i].take(own * other, 1.0);
        let Some((radiance, end, normal)) = scattered else { continue };
        let nearest = |n: usize| work[n].sight.point.map_or(f64::INFINITY, |p| p.vertex.point.distance(end));
        let is_far = members(group).map(nearest).fold(f64::INFINITY, f64::min) > FAR * reach;
        if !is_far || group.count_ones() == 1 {
            work[i].take(own * radiance, 1.0);
            continue;
        }
        if radiance.is_black() {
            continue;
        }
        // A ray that many share shows as a square, but none of them has much of it.
        let part = 1.0 / f64::from(group.count_ones()).sqrt();
        let (mut gives, mut densities) = ([Rgb::BLACK; PIXELS], 0.0);
        for j in members(group) {
            let Some(point) = &work[j].sight.point else { continue };
            let offset = end - point.vertex.point;
            let squared = offset.length_squared();
            let direction = offset / squared.sqrt();
            let geometry = -normal.dot(direction) / squared;
            if geometry <= 0.0 || point.vertex.geometric.dot(direction) <= 0.0 {
                continue;
            }
            densities += geometry * point.aim.pdf(direction);
            gives[j] = reflected(point, direction) * geometry;
        }
        if densities > 0.0 {
            for j in members(group) {
                work[j].take(gives[j] * radiance / densities, part);
            }
        }
    }
}

impl Work<'_> {
    /// Takes what a gather ray brings: all of it if it is no more than `part` of the bound, and the rest is for many.
    fn take(&mut self, light: Rgb, part: f64) {
        let (luminance, bound) = (light.luminance(), part * self.bound);
        if luminance <= bound {
            self.indirect += light;
            return;
        }
        let most = MOST * self.sight.point.map_or(0.0, |p| p.expected.luminance());
        let kept = light * (bound / luminance);
        self.indirect += kept;
        self.excess[1] += light * (luminance.min(most).max(bound) / luminance) - kept;
    }

    /// Leaves to the pixel as much of its direct light as may be its own.
    fn bound_direct(&mut self) {
        let (luminance, bound) = (self.direct.luminance(), BRIGHTER * self.bound);
        if luminance > bound {
            let kept = self.direct * (bound / luminance);
            self.excess[0] += self.direct - kept;
            self.direct = kept;
        }
    }
}

/// Factor of what a point reflects to the eye of the radiance from `direction`: throughput · f_r · cosine.
fn reflected(point: &Point, direction: DVec3) -> Rgb {
    let cosine = point.vertex.normal.dot(direction).max(0.0);
    point.throughput * point.aim.eval(direction) * cosine
}

/// Adds a pixel's sample to its sums.
fn add(work: &Work, seen: &mut Seen) {
    seen.rays += 1;
    if work.is_outside {
        return;
    }
    seen.empty += u32::from(work.sight.empty);
    let lights = work.sight.lights;
    let radiance = lights + work.direct + work.indirect;
    if !radiance.is_finite() {
        seen.invalid += 1;
        return;
    }
    seen.radiance += radiance;
    seen.direct += work.direct;
    (0..2).for_each(|k| seen.excess[k] += work.excess[k]);
    seen.excess_squares += (work.excess[0] + work.excess[1]).luminance().powi(2);
    seen.expected += work.sight.point.map_or(Rgb::BLACK, |p| p.expected);
    seen.lights += lights;
    if !lights.is_black() {
        seen.covered += 1;
    } else if !work.sight.empty {
        seen.unlit += 1;
        seen.unlit_luminance += radiance.luminance();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sixteen samples of a pixel, and the sixteen pixels of a sample, lie one in each sixteenth of both coordinates.
    #[test]
    fn points_are_dealt_out_evenly() {
        let even = |points: Vec<[f64; 2]>| {
            for c in 0..2 {
                let mut cells: Vec<usize> = points.iter().map(|p| (16.0 * p[c]) as usize).collect();
                cells.sort_unstable();
                assert_eq!(cells, (0..16).collect::<Vec<_>>(), "coordinate {c}");
            }
        };
        for key in 0..20 {
            for fixed in 0..16 {
                even((0..16).map(|k| net_point(key, dealt(k + 48, fixed))).collect());
                even((0..16).map(|slot| net_point(key, dealt(fixed as u32, slot))).collect());
            }
        }
    }
}
