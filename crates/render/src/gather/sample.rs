//! What one camera ray of a gather sees.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::brdf::attenuated;
use twinray_scene::sample::PixelSample;
use twinray_scene::{Camera, PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use super::GatherOptions;
use crate::direct::{Part, direct};
use crate::film::Seen;
use crate::lights::Lights;
use crate::picture::{first_side, tent};
use crate::reconstruct::Reconstruction;
use crate::vertex::{Look, Step, Vertex};

/// A gather ray shorter than so many sides of the cell that it meets is not trusted to see it as even.
const SHORT: f64 = 2.0;
/// Points that scatter before a path ends in any case.
const MOST_SCATTERED: u32 = 5;
/// Surfaces that a path meets at most.
const MOST_MET: u32 = 32;
/// Densities per solid angle above which a ray tells single cells apart, and is shown them smoothed.
const NARROW: f64 = 3.0;
/// Pairs of numbers that each met surface may draw.
const PAIRS: u64 = 64;

/// Makes samples of a picture.
pub(super) struct Estimator<'a> {
    scene: &'a PatchScene,
    solution: &'a Solution,
    reconstruction: Reconstruction<'a>,
    lights: Lights<'a>,
    candidates: u32,
}

/// Where a path last scattered.
#[derive(Clone, Copy)]
struct Scattered {
    point: DVec3,
    /// Density of the direction in which it went on.
    density: f64,
    /// Way since then.
    distance: f64,
    /// Whether a shadow ray from there may have found what is met next.
    lit: bool,
}

impl<'a> Estimator<'a> {
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        let lights = Lights::new(scene);
        let candidates = lights.candidates();
        Self { scene, solution, reconstruction: Reconstruction::new(scene, solution), lights, candidates }
    }

    /// Adds camera ray `k` of a pixel.
    pub fn add(&self, camera: &Camera, options: &GatherOptions, pixel: usize, k: u32, seen: &mut Seen) {
        let scene = self.scene;
        let mut numbers = PixelSample::new(options.seed, pixel as u64, k);
        let (width, height) = (f64::from(options.width), f64::from(options.height));
        let (x, y) = (pixel % options.width as usize, pixel / options.width as usize);
        let [dx, dy] = numbers.pair().map(tent);
        let aspect = width / height;
        let (origin, direction) = camera.ray((x as f64 + dx) / width, (y as f64 + dy) / height, aspect);
        seen.rays += 1;
        let Some((hit, patch)) = first_side(scene, origin - scene.centre(), direction) else {
            seen.empty += 1;
            let sky = scene.environment().map_or(Rgb::BLACK, |e| e.radiance(direction));
            seen.radiance += sky;
            seen.lights += sky;
            seen.covered += u32::from(!sky.is_black());
            return;
        };
        let found = self.follow(hit, patch, direction, &mut numbers);
        let radiance = found.lights + found.direct + found.indirect;
        if !radiance.is_finite() {
            seen.invalid += 1;
            return;
        }
        seen.radiance += radiance;
        seen.direct += found.direct;
        seen.lights += found.lights;
        if found.lights.is_black() {
            seen.unlit += 1;
            seen.unlit_luminance += radiance.luminance();
        } else {
            seen.covered += 1;
        }
    }

    /// Follows the path that begins with a camera ray along `direction`, which met `patch`.
    fn follow(&self, first: SurfaceHit, patch: PatchId, direction: DVec3, numbers: &mut PixelSample) -> Found {
        let scene = self.scene;
        let (mut hit, mut patch, mut direction) = (first, patch, direction);
        let (mut found, mut throughput) = (Found::default(), Rgb::WHITE);
        let mut scattered: Option<Scattered> = None;
        let (mut count, mut medium) = (0, None);
        for met in 0..MOST_MET {
            numbers.jump(PAIRS * u64::from(met + 1));
            let wo = -direction;
            if let Some(coefficient) = scene.medium_before(&hit, medium) {
                throughput = throughput * attenuated(coefficient, hit.t);
            }
            // Behind a wide spread of directions only means count.
            let look = match scattered {
                None => Look::Display,
                Some(s) if s.density > NARROW => Look::Plain,
                Some(_) => Look::Patch,
            };
            let vertex = Vertex::new(scene, &hit, patch, wo, look);
            let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            if !emitted.is_black() {
                let weight = self.weight(&scattered, |s| self.lights.density(s.point, patch, vertex.point));
                found.add(throughput * emitted * weight, scattered.is_none(), count);
            }
            let event = numbers.pair();
            let (next, side) = match vertex.step(wo, event[0], || numbers.pair()) {
                Step::End => break,
                Step::On(way) => {
                    throughput = throughput * way.factor;
                    if let Some(s) = &mut scattered {
                        s.lit &= way.straight;
                    }
                    medium = way.medium;
                    (way.direction, way.side)
                }
                Step::Scatter(factor) => {
                    throughput *= factor;
                    let Some(part) =
                        self.part(&vertex, &hit, wo, &scattered, count, &mut throughput, event[1], &mut found)
                    else {
                        break;
                    };
                    let Some(next) = self.scatter(&vertex, wo, part, numbers, &mut throughput, &mut found, count)
                    else {
                        break;
                    };
                    count += 1;
                    medium = None;
                    let density = part.pdf(&vertex.scatter.brdf, vertex.normal, wo, next);
                    scattered = Some(Scattered { point: vertex.point, density, distance: 0.0, lit: true });
                    (next, vertex.geometric)
                }
            };
            if throughput.is_black() {
                break;
            }
            let triangle = scene.triangle_of(vertex.patch);
            let Some(there) = scene.leave(triangle, side, vertex.point, next) else {
                if let Some(sky) = scene.environment() {
                    let weight = self.weight(&scattered, |_| self.lights.sky_density(next));
                    found.add(throughput * sky.radiance(next) * weight, scattered.is_none(), count);
                }
                break;
            };
            let Some(patch_there) = scene.patch_of(&there) else { break };
            if let Some(s) = &mut scattered {
                s.distance += there.t;
            }
            (hit, patch, direction) = (there, patch_there, next);
        }
        found
    }

    /// Weight of what a path met that a shadow ray of density `light` could have found.
    fn weight(&self, scattered: &Option<Scattered>, light: impl Fn(&Scattered) -> f64) -> f64 {
        match scattered {
            Some(s) if s.lit => s.density / (s.density + f64::from(self.candidates) * light(s)),
            _ => 1.0,
        }
    }

    /// Which part of the BRDF is to be traced at a point that scatters: all of it where no patch may be seen. Elsewhere
    /// the base's reflection is taken from the solution, and the lobe's is traced, with the probability of its share.
    fn part(
        &self,
        vertex: &Vertex,
        hit: &SurfaceHit,
        wo: DVec3,
        scattered: &Option<Scattered>,
        count: u32,
        throughput: &mut Rgb,
        u: f64,
        found: &mut Found,
    ) -> Option<Part> {
        let last = count >= MOST_SCATTERED;
        let Some(before) = scattered else { return Some(Part::Whole) };
        let side = self.scene.cell_area(vertex.patch).sqrt();
        if before.distance < SHORT * side && !last {
            return Some(Part::Whole);
        }
        let brdf = &vertex.scatter.brdf;
        let cosine = vertex.normal.dot(wo).max(0.0);
        let irradiance = if before.density > NARROW {
            self.reconstruction.smooth(vertex.patch, hit).irradiance
        } else {
            self.solution.irradiance(vertex.patch)
        };
        let lobe = brdf.lobe_albedo(cosine);
        let base = brdf.base_reflectance(cosine);
        let read = if last { base + lobe } else { base };
        found.indirect += *throughput * irradiance * read / PI;
        if last || lobe.is_black() {
            return None;
        }
        let survival = (*throughput * lobe).max_channel().clamp(0.05, 1.0);
        *throughput *= 1.0 / survival;
        (u < survival).then_some(Part::Lobe)
    }

    /// Light straight from what emits, and the direction in which the path goes on.
    fn scatter(
        &self,
        vertex: &Vertex,
        wo: DVec3,
        part: Part,
        numbers: &mut PixelSample,
        throughput: &mut Rgb,
        found: &mut Found,
        count: u32,
    ) -> Option<DVec3> {
        let u = numbers.pair();
        let light = direct(self.scene, &self.lights, vertex, wo, part, self.candidates, || numbers.pair());
        found.add(*throughput * light, false, count + 1);
        let Vertex { geometric, normal, scatter, .. } = vertex;
        let next = part.sample(&scatter.brdf, *normal, wo, u)?;
        let (cosine, density) = (normal.dot(next), part.pdf(&scatter.brdf, *normal, wo, next));
        if !(cosine > 0.0 && density > 0.0 && geometric.dot(next) > 0.0) {
            return None;
        }
        *throughput = *throughput * part.eval(&scatter.brdf, *normal, next, wo) * (cosine / density);
        Some(next)
    }
}

/// What a path brought.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// What emits and was seen, in mirrors and through glass too.
    lights: Rgb,
    /// What the first point that scatters reflects of light straight from what emits.
    direct: Rgb,
    /// All other.
    indirect: Rgb,
}

impl Found {
    /// Adds light that was met after `count` points that scattered.
    fn add(&mut self, light: Rgb, seen: bool, count: u32) {
        let to = match (seen, count) {
            (true, _) => &mut self.lights,
            (false, 1) => &mut self.direct,
            _ => &mut self.indirect,
        };
        *to += light;
    }
}
