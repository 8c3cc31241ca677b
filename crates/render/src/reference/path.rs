//! The estimator: reflected radiance of a point, by one path with a shadow ray at every vertex.
//!
//! Light that arrives straight from what emits is found in two ways, by a shadow ray and by the path itself, weighed
//! by the balance heuristic (E. Veach and L. J. Guibas, "Optimally combining sampling techniques for Monte Carlo
//! rendering", SIGGRAPH 1995). Normals are geometric, as in the solver's transport. One-sided backs absorb.

use glam::DVec3;
use twinray_scene::brdf::Brdf;
use twinray_scene::sample::Stream;
use twinray_scene::{PatchId, PatchScene, Rgb, SurfaceHit};

use crate::lights::Lights;

/// How light straight from what emits is found. All three have the same mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Technique {
    /// By shadow rays and by the path itself, balanced.
    #[default]
    Both,
    /// By shadow rays alone.
    Lights,
    /// By the path alone.
    Path,
}

impl Technique {
    /// Weights of a shadow ray and of a path's end in a direction, from the densities of the two.
    fn weights(self, light: f64, path: f64) -> [f64; 2] {
        match self {
            Technique::Both => [light / (light + path), path / (light + path)],
            Technique::Lights => [1.0, 0.0],
            Technique::Path => [0.0, 1.0],
        }
    }
}

/// Bounces before chance may end a path: the first ones bring most light and are few.
const SURE_BOUNCES: u32 = 3;

/// The most with which a path may survive a bounce. Paths end even where albedos are 1, after a thousand bounces on
/// average. Survival must stay above the square of a closed room's albedo, or the variance is infinite; readers
/// bring albedos to .98 at most, so this limit is not met there.
const MOST_SURVIVAL: f64 = 0.999;

/// A point of a surface that scatters.
pub(super) struct Vertex {
    pub patch: PatchId,
    pub point: DVec3,
    pub normal: DVec3,
    pub brdf: Brdf,
}

impl Vertex {
    /// The vertex where a ray met `patch`: its material at the very point.
    pub fn of_hit(scene: &PatchScene, hit: &SurfaceHit, patch: PatchId) -> Self {
        Self {
            patch,
            point: scene.point_of(hit.triangle, hit.u, hit.v),
            normal: scene.normal(patch),
            brdf: scene.brdf_of(hit.triangle, scene.color_at(hit.triangle, hit.u, hit.v)),
        }
    }
}

/// Follows paths through a scene.
pub(super) struct PathTracer<'a> {
    pub scene: &'a PatchScene,
    lights: Lights<'a>,
    technique: Technique,
}

impl<'a> PathTracer<'a> {
    pub fn new(scene: &'a PatchScene, technique: Technique) -> Self {
        Self { scene, lights: Lights::new(scene), technique }
    }

    /// One unbiased sample of the radiance that `vertex` reflects towards `wo`, after any number of bounces.
    pub fn reflected(&self, mut vertex: Vertex, mut wo: DVec3, random: &mut Stream) -> Rgb {
        let (mut radiance, mut throughput) = (Rgb::BLACK, Rgb::WHITE);
        for bounce in 1u32.. {
            radiance += throughput * self.shadow_ray(&vertex, wo, random);
            let Vertex { patch, point, normal, brdf } = &vertex;
            let Some(wi) = brdf.sample(*normal, wo, [random.uniform(), random.uniform()]) else { break };
            let (cosine, density) = (normal.dot(wi), brdf.pdf(*normal, wo, wi));
            if !(cosine > 0.0 && density > 0.0) {
                break;
            }
            throughput = throughput * brdf.eval(*normal, wi, wo) * (cosine / density);
            if throughput.is_black() {
                break;
            }
            let Some(hit) = self.scene.trace_from(*patch, *point, wi) else {
                if let Some(sky) = self.scene.environment() {
                    let [_, weight] = self.technique.weights(self.lights.sky_density(wi), density);
                    radiance += throughput * sky.radiance(wi) * weight;
                }
                break;
            };
            let Some(there) = self.scene.patch_of(&hit) else { break };
            let next = Vertex::of_hit(self.scene, &hit, there);
            let emitted = self.scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            if !emitted.is_black() {
                let [_, weight] = self.technique.weights(self.lights.density(*point, there, next.point), density);
                radiance += throughput * emitted * weight;
            }
            if bounce >= SURE_BOUNCES {
                let survival = throughput.max_channel().min(MOST_SURVIVAL);
                if random.uniform() >= survival {
                    break;
                }
                throughput *= 1.0 / survival;
            }
            (vertex, wo) = (next, -wi);
        }
        radiance
    }

    /// What one shadow ray says of the light that comes straight from an emitter or the sky.
    fn shadow_ray(&self, vertex: &Vertex, wo: DVec3, random: &mut Stream) -> Rgb {
        if self.technique == Technique::Path {
            return Rgb::BLACK;
        }
        let Vertex { patch, point, normal, brdf } = vertex;
        let Some(light) = self.lights.sample(*point, random) else { return Rgb::BLACK };
        let cosine = normal.dot(light.towards);
        if cosine <= 0.0 || light.radiance.is_black() {
            return Rgb::BLACK;
        }
        let free = match light.end {
            Some((end, normal_there)) => self.scene.visible(*point, *normal, end, normal_there),
            None => self.scene.trace_from(*patch, *point, light.towards).is_none(),
        };
        if !free {
            return Rgb::BLACK;
        }
        let [weight, _] = self.technique.weights(light.density, brdf.pdf(*normal, wo, light.towards));
        light.radiance * brdf.eval(*normal, light.towards, wo) * (cosine * weight / light.density)
    }
}
