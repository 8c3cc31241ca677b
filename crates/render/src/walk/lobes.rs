//! What arrives at a glossy place from all directions, in spherical harmonics of degree 2 and less.
//!
//! Radiance of the hemisphere, mirrored below the surface so that it has no step at the horizon, which few harmonics
//! could not follow. Gathered by rays from the place; light straight from what emits is kept apart, as if it came from one
//! blurred direction: lamps are too bright for harmonics, which would smear them over half of the sky. Sums go on over
//! solutions. Basis: Ramamoorthi and Hanrahan, "An efficient representation for irradiance
//! environment maps" (SIGGRAPH 2001), whose convolution the viewer does with the lobe in place of the cosine.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::geom::Frame;
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb};
use twinray_solve::Solution;

use super::nodes::{Nodes, Place};
use crate::lights::Lights;

/// Number of harmonics.
pub const BASIS: usize = 9;

/// Rays into the hemisphere of a place in one round.
const RAYS: u32 = 48;
/// Shadow rays of a place in one round.
const SHADOW_RAYS: u32 = 16;
/// Of the rays, so many are no lamps; what is so many times brighter than these in the mean is one.
const MOST_RAYS: usize = 36;
const BRIGHT: f64 = 3.0;
/// Panes that a ray passes.
const MOST_PANES: u32 = 8;

/// Real spherical harmonics of degree 0, 1, 2 in direction `d`, a unit vector: Y00; Y1 of y, z, x; Y2 of xy, yz,
/// 3z² − 1, xz, x² − y².
pub fn basis(d: DVec3) -> [f64; BASIS] {
    [
        0.282_094_791_773_878_1,
        0.488_602_511_902_919_9 * d.y,
        0.488_602_511_902_919_9 * d.z,
        0.488_602_511_902_919_9 * d.x,
        1.092_548_430_592_079_2 * d.x * d.y,
        1.092_548_430_592_079_2 * d.y * d.z,
        0.315_391_565_252_520_05 * (3.0 * d.z * d.z - 1.0),
        1.092_548_430_592_079_2 * d.x * d.z,
        0.546_274_215_296_039_6 * (d.x * d.x - d.y * d.y),
    ]
}

/// What arrives at a place, or sums of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    /// Factors of the harmonics, of light from surfaces.
    pub radiance: [Rgb; BASIS],
    /// Radiance over all directions, of light straight from what emits, W·m⁻²: without a cosine.
    pub lamps: Rgb,
    /// The same luminance times its direction.
    pub towards: DVec3,
}

impl Moments {
    const NONE: Self = Self { radiance: [Rgb::BLACK; BASIS], lamps: Rgb::BLACK, towards: DVec3::ZERO };

    fn scaled(&self, by: f64) -> Self {
        Self { radiance: self.radiance.map(|m| m * by), lamps: self.lamps * by, towards: self.towards * by }
    }

    fn add(&mut self, other: &Self) {
        self.radiance.iter_mut().zip(other.radiance).for_each(|(s, m)| *s += m);
        self.lamps += other.lamps;
        self.towards += other.towards;
    }
}

/// Moments of all glossy nodes, summed up over rounds.
#[derive(Debug, Default)]
pub(crate) struct Lobes {
    sums: Vec<Moments>,
    weight: f64,
    rounds: u64,
}

impl Lobes {
    /// Gathers once more from `solution`, which counts with `weight`.
    pub fn gather(&mut self, scene: &PatchScene, lights: &Lights, nodes: &Nodes, solution: &Solution, weight: f64) {
        let places = &nodes.places[..nodes.glossy_nodes];
        self.sums.resize(places.len(), Moments::NONE);
        let round = self.rounds;
        let gathered = self.sums.par_iter_mut().zip(places).enumerate();
        gathered.for_each(|(index, (sum, place))| {
            let mut random = Stream::new(round, 0x10BE5, index as u64);
            sum.add(&moments(scene, lights, solution, place, &mut random).scaled(weight));
        });
        self.weight += weight;
        self.rounds += 1;
    }

    /// Mean moments per glossy node.
    pub fn means(&self) -> impl Iterator<Item = Moments> + '_ {
        self.sums.iter().map(|sum| sum.scaled(1.0 / self.weight))
    }
}

/// One round's moments at a place.
fn moments(scene: &PatchScene, lights: &Lights, solution: &Solution, place: &Place, random: &mut Stream) -> Moments {
    let hit = &place.hit;
    let point = scene.point_of(hit.triangle, hit.u, hit.v);
    let front = scene.normal(place.patch);
    let normal = scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v);
    let frame = Frame::from_normal(front);
    let mut sum = Moments::NONE;
    let add = |sum: &mut Moments, direction: DVec3, radiance: Rgb| {
        // The mirror image makes the other half of the sphere.
        let below = direction - 2.0 * normal.dot(direction) * normal;
        let (a, b) = (basis(direction), basis(below));
        for (k, s) in sum.radiance.iter_mut().enumerate() {
            *s += radiance * (a[k] + b[k]);
        }
    };
    // A golden lattice, shifted for each place and round.
    let shift = [random.uniform(), random.uniform()];
    let ray_density = f64::from(RAYS) / TAU;
    let met = Met { scene, lights, solution, ray_density };
    let mut emitted = Vec::new();
    let rays: Vec<(DVec3, Rgb)> = (0..RAYS)
        .map(|k| {
            let z = ((f64::from(k) + shift[0]) / f64::from(RAYS)).fract();
            let angle = TAU * (f64::from(k) * 0.618_033_988_749_895 + shift[1]);
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = libm::sincos(angle);
            let direction = frame.to_world(DVec3::new(radius * cos, radius * sin, z));
            let [reflected, shining] = met.towards(place.patch, point, direction);
            if !shining.is_black() {
                emitted.push((direction, shining / ray_density));
            }
            (direction, reflected)
        })
        .collect();
    let mut luminances: Vec<f64> = rays.iter().map(|(_, radiance)| radiance.luminance()).collect();
    luminances.sort_by(f64::total_cmp);
    // What is much brighter than most of the rest is a lamp to the eye: a door that opens to a sunlit room.
    let most = &luminances[..MOST_RAYS];
    let limit = BRIGHT * most.iter().sum::<f64>() / MOST_RAYS as f64;
    for (direction, radiance) in rays {
        let radiance = radiance * (TAU / f64::from(RAYS));
        let luminance = radiance.luminance();
        let kept = (limit * TAU / f64::from(RAYS) / luminance.max(f64::MIN_POSITIVE)).min(1.0);
        add(&mut sum, direction, radiance * kept);
        sum.lamps += radiance * (1.0 - kept);
        sum.towards += direction * (luminance * (1.0 - kept));
    }
    for (direction, arriving) in emitted {
        sum.lamps += arriving;
        sum.towards += direction * arriving.luminance();
    }
    for _ in 0..SHADOW_RAYS {
        let (choice, at) = (random.uniform(), [random.uniform(), random.uniform()]);
        let Some(light) = lights.sample(point, choice, at) else { continue };
        if front.dot(light.towards) <= 0.0 {
            continue;
        }
        let seen = match light.end {
            Some((end, normal_there)) => scene.transmittance(point, front, end, normal_there),
            None => scene.transmittance_from_sky(place.patch, point, light.towards),
        };
        // The balance heuristic over rays that find what emits by themselves; they never find what has no area.
        let others = if light.is_sharp { 0.0 } else { ray_density };
        let arriving = light.radiance * seen / (light.density * f64::from(SHADOW_RAYS) + others);
        sum.lamps += arriving;
        sum.towards += light.towards * arriving.luminance();
    }
    sum
}

/// What rays of a place meet.
struct Met<'a> {
    scene: &'a PatchScene,
    lights: &'a Lights<'a>,
    solution: &'a Solution,
    /// Of the place's rays, per solid angle.
    ray_density: f64,
}

impl Met<'_> {
    /// Radiance that arrives at `point` from `direction`: of what surfaces reflect; and of what emits, weighed by the
    /// balance heuristic against shadow rays.
    fn towards(&self, patch: PatchId, point: DVec3, direction: DVec3) -> [Rgb; 2] {
        let scene = self.scene;
        let weight = |density: f64| self.ray_density / (self.ray_density + f64::from(SHADOW_RAYS) * density);
        let (mut hit, mut origin, mut through) = (scene.trace_from(patch, point, direction), point, Rgb::WHITE);
        for _ in 0..MOST_PANES {
            let Some(met) = hit else {
                let sky = scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction));
                return [Rgb::BLACK, through * sky * weight(self.lights.sky_density(direction))];
            };
            let there = scene.patch_of(&met);
            let passing = there.and_then(|p| scene.specular(p));
            if let Some(p) = there {
                let emitted = scene.emission_at(met.triangle, met.side, met.u, met.v);
                let scatter = scene.scatter(p);
                let [mirrored, transmitted] = passing.map_or([Rgb::BLACK; 2], |s| s.throughput(0.5, false));
                if !emitted.is_black() || transmitted.is_black() {
                    // Mirrors, as if they were matte: their patches know what arrives.
                    let albedo = scatter.brdf.mean_albedo() + mirrored;
                    let reflected = through * self.solution.irradiance(p) * albedo / std::f64::consts::PI;
                    let density = self.lights.density(point, p, scene.point_of(met.triangle, met.u, met.v));
                    return [reflected, through * emitted * weight(density)];
                }
                through = through * transmitted;
            }
            // On through panes; and the back of a one-sided surface is not there for eyes.
            let normal = there.map_or(-direction, |p| scene.normal(p));
            let before = if normal.dot(direction) > 0.0 { -normal } else { normal };
            origin += direction * met.t;
            hit = scene.beyond(met.triangle, before, origin, direction);
        }
        [Rgb::BLACK; 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::warp;

    #[test]
    fn harmonics_are_orthonormal() {
        let mut random = Stream::new(1, 2, 3);
        let mut sum = [[0.0; BASIS]; BASIS];
        const N: u32 = 200_000;
        for _ in 0..N {
            let u = [random.uniform(), random.uniform()];
            let hemisphere = warp::cosine_hemisphere(u);
            // Uniform over the sphere by its height.
            let z = 2.0 * random.uniform() - 1.0;
            let r = (1.0 - z * z).sqrt();
            let flat = DVec3::new(hemisphere.x, hemisphere.y, 0.0).normalize_or(DVec3::X) * r;
            let y = basis(DVec3::new(flat.x, flat.y, z));
            for (i, row) in sum.iter_mut().enumerate() {
                row.iter_mut()
                    .enumerate()
                    .for_each(|(j, s)| *s += y[i] * y[j] * 4.0 * std::f64::consts::PI / f64::from(N));
            }
        }
        for (i, row) in sum.iter().enumerate() {
            for (j, s) in row.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                // Standard deviation of a mean of products of at most 2.2 in size: below .006.
                assert!((s - expected).abs() < 0.025, "{i}, {j}: {s}");
            }
        }
    }
}
