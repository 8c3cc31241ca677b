//! The estimator: reflected radiance of a point, by one path with a shadow ray at every vertex.
//!
//! Light that arrives straight from what emits is found in two ways, by a shadow ray and by the path itself, weighed
//! by the balance heuristic (E. Veach and L. J. Guibas, "Optimally combining sampling techniques for Monte Carlo
//! rendering", SIGGRAPH 1995). Behind mirrors and bodies of glass the path alone finds it; clear panes are no
//! obstacle to shadow rays. Normals are geometric, as in the solver's transport, but for what a camera sees. One-sided
//! backs absorb.

use glam::DVec3;
use twinray_scene::brdf::attenuated;
use twinray_scene::sample::Stream;
use twinray_scene::{PatchScene, Rgb};

use crate::direct::is_straight;
use crate::lights::Lights;
use crate::vertex::{Look, Step, Vertex};

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

/// Follows paths through a scene.
pub(super) struct PathTracer<'a> {
    pub scene: &'a PatchScene,
    lights: Lights<'a>,
    technique: Technique,
}

/// What a path brought.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// What emits and was seen in mirrors and through glass.
    pub seen: Rgb,
    /// What was reflected on the way.
    pub reflected: Rgb,
}

impl<'a> PathTracer<'a> {
    pub fn new(scene: &'a PatchScene, technique: Technique) -> Self {
        Self { scene, lights: Lights::new(scene), technique }
    }

    /// One unbiased sample of the radiance that `vertex` sends towards `wo` beside what it emits itself, after any number
    /// of bounces.
    pub fn follow(&self, mut vertex: Vertex, mut wo: DVec3, random: &mut Stream) -> Found {
        let scene = self.scene;
        let (mut found, mut throughput) = (Found::default(), Rgb::WHITE);
        // The last point that scattered, the direction from there and its density.
        let mut scattered: Option<(DVec3, DVec3, f64)> = None;
        // Whether a shadow ray from there may have found what is met next.
        let mut lit = false;
        let mut look = Look::Display;
        for bounce in 1u32.. {
            let (direction, beyond, medium) =
                match vertex.step(wo, random.uniform(), || [random.uniform(), random.uniform()]) {
                    Step::End => break,
                    Step::On(way) => {
                        throughput = throughput * way.factor;
                        lit &= way.clear;
                        (way.direction, way.beyond, way.medium)
                    }
                    Step::Scatter(factor) => {
                        throughput *= factor;
                        found.reflected += throughput * self.shadow_ray(&vertex, wo, random);
                        let Vertex { point, geometric, normal, scatter, .. } = &vertex;
                        let u = [random.uniform(), random.uniform()];
                        let Some(wi) = scatter.brdf.sample(*normal, wo, u) else { break };
                        let (cosine, density) = (normal.dot(wi), scatter.brdf.pdf(*normal, wo, wi));
                        if !(cosine > 0.0 && density > 0.0 && geometric.dot(wi) > 0.0) {
                            break;
                        }
                        throughput = throughput * scatter.brdf.eval(*normal, wi, wo) * (cosine / density);
                        (scattered, lit, look) = (Some((*point, wi, density)), true, Look::Plain);
                        (wi, false, None)
                    }
                };
            if throughput.is_black() {
                break;
            }
            let weight = |light: &dyn Fn(DVec3) -> f64| match scattered {
                Some((point, heading, density)) if lit && is_straight(heading, direction) => {
                    self.technique.weights(light(point), density)[1]
                }
                // Whoever looks through shadow rays alone would miss what only paths find.
                _ => 1.0,
            };
            let Some(hit) = vertex.next(scene, beyond, direction) else {
                if let Some(sky) = scene.environment() {
                    let light = throughput * sky.radiance(direction) * weight(&|_| self.lights.sky_density(direction));
                    found.add(light, scattered.is_none());
                }
                break;
            };
            let Some(there) = scene.patch_of(&hit) else { break };
            if let Some(coefficient) = scene.medium_before(&hit, medium) {
                throughput = throughput * attenuated(coefficient, hit.t);
            }
            let next = Vertex::new(scene, &hit, there, -direction, look);
            let emitted = scene.emission_at(hit.triangle, hit.side, hit.u, hit.v);
            if !emitted.is_black() {
                let light = throughput * emitted * weight(&|point| self.lights.density(point, there, next.point));
                found.add(light, scattered.is_none());
            }
            if bounce >= SURE_BOUNCES {
                let survival = throughput.max_channel().min(MOST_SURVIVAL);
                if random.uniform() >= survival {
                    break;
                }
                throughput *= 1.0 / survival;
            }
            (vertex, wo) = (next, -direction);
        }
        found
    }

    /// What one shadow ray says of the light that comes straight from an emitter or the sky.
    fn shadow_ray(&self, vertex: &Vertex, wo: DVec3, random: &mut Stream) -> Rgb {
        // Lights without area are found by shadow rays or not at all.
        let sharp_only = self.technique == Technique::Path;
        if sharp_only && self.scene.lights().is_empty() {
            return Rgb::BLACK;
        }
        let Vertex { patch, point, geometric, normal, scatter, .. } = vertex;
        let [choice, s, t] = std::array::from_fn(|_| random.uniform());
        let Some(light) = self.lights.sample(*point, choice, [s, t]) else { return Rgb::BLACK };
        let cosine = normal.dot(light.towards);
        let unseen = cosine <= 0.0 || geometric.dot(light.towards) <= 0.0 || light.radiance.is_black();
        if unseen || (sharp_only && !light.is_sharp) {
            return Rgb::BLACK;
        }
        let passed = match light.end {
            Some((end, normal_there)) => self.scene.transmittance(*point, *geometric, end, normal_there),
            None => self.scene.transmittance_from_sky(*patch, *point, light.towards),
        };
        if passed.is_black() {
            return Rgb::BLACK;
        }
        let weight = match light.is_sharp {
            true => 1.0,
            false => self.technique.weights(light.density, scatter.brdf.pdf(*normal, wo, light.towards))[0],
        };
        light.radiance * passed * scatter.brdf.eval(*normal, light.towards, wo) * (cosine * weight / light.density)
    }
}

impl Found {
    fn add(&mut self, light: Rgb, seen: bool) {
        *(if seen { &mut self.seen } else { &mut self.reflected }) += light;
    }
}
