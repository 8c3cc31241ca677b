//! All light that arrives at a point in free space, as estimates with their directions: what probes are made of.

use std::f64::consts::PI;

use glam::DVec3;
use twinray_scene::sample::{PixelSample, warp};
use twinray_scene::{PatchScene, Rgb};
use twinray_solve::Solution;

use super::sample::Estimator;
use crate::direct::weights;

/// Density per solid angle of rays that are even over all directions.
const EVEN: f64 = 1.0 / (4.0 * PI);

/// Gathers radiance in free space.
pub struct RadianceGather<'a> {
    estimator: Estimator<'a>,
    scene: &'a PatchScene,
}

impl<'a> RadianceGather<'a> {
    /// Of the light of `solution`.
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        Self { estimator: Estimator::new(scene, solution), scene }
    }

    /// Calls `each` with directions and estimates such that the sum of f(direction) · estimate has the mean ∫ f L dω, whatever
    /// the function f: L is the radiance that arrives at `point` (in the coordinates of the patch scene), W·sr⁻¹·m⁻² or nit.
    ///
    /// `rays` go out evenly over the sphere, each with a shadow ray; both are weighed against each other, so that lamps are not
    /// found by chance. Without `punctual`, light straight from lights without area is left out. `seed` and `key`, which names
    /// the point, choose the rays.
    pub fn over_sphere(
        &self,
        point: DVec3,
        rays: u32,
        punctual: bool,
        seed: u64,
        key: u64,
        mut each: impl FnMut(DVec3, Rgb),
    ) {
        let count = f64::from(rays.max(1));
        for index in 0..rays.max(1) {
            let mut numbers = PixelSample::new(seed, key, index);
            let direction = warp::uniform_sphere(numbers.pair());
            let arriving = self.estimator.arriving(point, direction, EVEN, &mut numbers);
            if !arriving.is_black() {
                each(direction, arriving / (EVEN * count));
            }
            if let Some((towards, light)) = self.lit(point, punctual, &mut numbers) {
                each(towards, light / count);
            }
        }
    }

    /// One shadow ray: its direction, and radiance over density. Chosen among candidates as `direct` does, here without a
    /// surface.
    fn lit(&self, point: DVec3, punctual: bool, numbers: &mut PixelSample) -> Option<(DVec3, Rgb)> {
        Estimator::jump_to_shadow_rays(numbers);
        let candidates = self.estimator.shadows().candidates;
        let (mut sum, mut chosen) = (0.0, None);
        let mut pick = numbers.single();
        for _ in 0..candidates {
            let ([choice, _], place) = (numbers.pair(), numbers.pair());
            let Some(light) = self.estimator.lights.sample(point, choice, place) else { continue };
            if light.is_sharp && !punctual {
                continue;
            }
            let density = f64::from(candidates) * light.density;
            let gives = light.radiance * (weights(density, EVEN)[0] / density);
            let luminance = gives.luminance();
            if luminance > 0.0 {
                sum += luminance;
                let probability = luminance / sum;
                if pick < probability {
                    chosen = Some((gives / luminance, light));
                    pick /= probability;
                } else {
                    pick = (pick - probability) / (1.0 - probability);
                }
            }
        }
        let (gives, light) = chosen?;
        let seen = match light.end {
            Some((end, normal)) => self.scene.transmittance(point, DVec3::ZERO, end, normal),
            None => self.scene.transmittance_from_sky_to(point, light.towards),
        };
        (!seen.is_black()).then(|| (light.towards, gives * seen * sum))
    }
}
