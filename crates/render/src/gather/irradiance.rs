//! Irradiance at any point by rays that gather what a solution knows: bakes at the resolution of their texels.

use std::ops::Range;

use twinray_scene::brdf::{Brdf, Scatter};
use twinray_scene::sample::PixelSample;
use twinray_scene::{PatchId, PatchScene, Rgb, SurfaceHit};
use twinray_solve::Solution;

use super::guide::Aim;
use super::sample::{Estimator, Point};
use crate::vertex::Vertex;

/// Gathers irradiance.
pub struct IrradianceGather<'a> {
    estimator: Estimator<'a>,
    scene: &'a PatchScene,
}

impl<'a> IrradianceGather<'a> {
    /// Of the light of `solution`.
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        Self { estimator: Estimator::new(scene, solution), scene }
    }

    /// Irradiance, W·m⁻² (or lux), at a hit on `patch`: the mean of some rays, each with a shadow ray. `seed` and `key` choose
    /// a sequence, of which these are the rays of the given numbers: points that are averaged share one, and are even together.
    pub fn at(&self, patch: PatchId, hit: &SurfaceHit, rays: Range<u32>, seed: u64, key: u64) -> Rgb {
        let scene = self.scene;
        let geometric = scene.normal(patch);
        let normal = scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v);
        // What a white Lambertian surface sends out is its irradiance over π.
        let scatter = Scatter { brdf: Brdf::Lambertian { reflectance: Rgb::WHITE }, specular: None };
        let vertex = Vertex {
            patch,
            point: scene.point_of(hit.triangle, hit.u, hit.v),
            geometric,
            normal,
            scatter,
            inside: false,
            is_clear: false,
        };
        let brdf = scatter.brdf.towards(normal, normal);
        let point = Point { vertex, aim: Aim { brdf, guide: None }, throughput: Rgb::WHITE, expected: Rgb::BLACK };
        let shadows = self.estimator.shadows();
        let mut sum = Rgb::BLACK;
        let count = rays.len().max(1) as f64;
        for index in rays {
            let mut numbers = PixelSample::new(seed, key, index);
            sum += self.estimator.lit(&point, shadows, &mut numbers).0;
            numbers.jump(0);
            let u = numbers.pair();
            if let Some(g) = self.estimator.gather(&point, u, shadows, &mut numbers) {
                let scattered = g.scattered.map_or(Rgb::BLACK, |s| s.0);
                sum +=
                    brdf.eval(g.direction) * (normal.dot(g.direction) / g.density) * (g.emitted + scattered + g.other);
            }
        }
        sum * (std::f64::consts::PI / count)
    }
}
