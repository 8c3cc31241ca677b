//! Rays of the solver that go on: through glass, by way of mirrors.
//!
//! At a surface with a specular part a ray goes on or stops, by probabilities that depend on the surface and the angle
//! alone. Whoever finds the same path from its other end makes the same choices, so that both directions carry the same
//! throughput, and their densities differ by the probabilities of stopping at either end. All cosines are of geometric
//! normals. Not here: pictures, which follow display normals and blur (render).

use glam::DVec3;

use crate::authored::{Material, Surface};
use crate::brdf::{Event, attenuated, mirrored};
use crate::bvh::SurfaceHit;
use crate::patch::{PatchId, PatchScene, Side};
use crate::rgb::Rgb;

/// Surfaces that a ray passes at most; what would go on is lost.
const MOST_PASSED: u32 = 16;

/// The most by which passing multiplies what a ray carries, stops at both ends included but not indices of refraction:
/// (16/15)¹⁶ · 16.
const LARGEST_FACTOR: f64 = 2.81 * 16.0;

/// What a ray meets in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// A patch, where it stops.
    Patch(PatchId),
    /// The absorbing back of a one-sided surface.
    Back,
    /// Nothing: the environment, if there is one.
    Sky,
    /// No end after very many surfaces.
    Lost,
}

/// Where a ray arrived after what it passed.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// What it met.
    pub end: End,
    /// Unit direction in which it arrived.
    pub direction: DVec3,
    /// Throughput over the probability of the choices to go on.
    pub factor: Rgb,
    /// Probability of having stopped at the end: 1 but for specular surfaces.
    pub stop: f64,
    /// Squared index of refraction where the ray started over that where it arrived. Radiance over the squared index is
    /// what is kept on the way, and so are densities.
    pub index_ratio: f64,
}

/// The inside of a body of glass.
#[derive(Clone, Copy, Debug)]
struct Body {
    ior: f64,
    attenuation: Rgb,
}

impl PatchScene {
    /// The most by which a ray of the solver multiplies what it carries beside its own density.
    pub fn largest_factor(&self) -> f64 {
        let index = |m: &Material| match (&m.surface, &m.transmission) {
            (Surface::MetallicRoughness { ior, .. }, Some(_)) => ior.max(1.5),
            _ => 1.5,
        };
        let largest = self.materials.iter().map(index).fold(1.5, f64::max);
        if self.has_specular() { LARGEST_FACTOR * largest * largest } else { 1.0 }
    }

    /// Probability that a ray that arrives on `patch` stops; `away` points to where it comes from.
    #[inline]
    pub fn stop_chance(&self, patch: PatchId, away: DVec3) -> f64 {
        if !self.has_specular() {
            return 1.0;
        }
        let scatter = self.scatter(patch);
        let Some(specular) = scatter.specular else { return 1.0 };
        let cosine = self.normal(patch).dot(away).max(0.0);
        let inside = self.side_of(patch) == Side::Back;
        specular.choices(cosine, inside, scatter.brdf.albedo(cosine).max_channel(), true).stop()
    }

    /// The share of the light that arrives on `patch` from `away` and goes on.
    pub fn passed_share(&self, patch: PatchId, away: DVec3) -> Rgb {
        let Some(specular) = self.specular(patch) else { return Rgb::BLACK };
        let inside = self.side_of(patch) == Side::Back;
        specular.passed(self.normal(patch).dot(away).max(0.0), inside)
    }

    /// Follows a ray from `point` on `start` (or from a free point) to where it stops. `random` gives uniform numbers
    /// in [0, 1), one for each specular surface.
    pub fn trace_through(
        &self,
        start: Option<PatchId>,
        point: DVec3,
        direction: DVec3,
        mut random: impl FnMut() -> f64,
    ) -> Arrival {
        let mut hit = match start {
            Some(patch) => self.trace_from(patch, point, direction),
            None => self.trace(point, direction),
        };
        let mut ray = Arrival { end: End::Lost, direction, factor: Rgb::WHITE, stop: 1.0, index_ratio: 1.0 };
        // The body that the ray is in, as far as its ends tell.
        let start = start.filter(|&p| self.has_specular() && self.side_of(p) == Side::Back);
        let mut medium = start.and_then(|p| self.body_of(self.triangle_of(p)));
        let mut first_index = None;
        for _ in 0..=MOST_PASSED {
            let Some(met) = hit else {
                // The sky is in the air, whatever the ray left last.
                let index: f64 = first_index.unwrap_or(1.0);
                return Arrival { end: End::Sky, index_ratio: index * index, ..ray };
            };
            let Some(patch) = self.patch_of(&met) else { return Arrival { end: End::Back, ..ray } };
            if !self.has_specular() {
                return Arrival { end: End::Patch(patch), ..ray };
            }
            let scatter = self.scatter(patch);
            let inside = met.side == Side::Back;
            let body = medium.or_else(|| self.body_of(met.triangle).filter(|_| inside));
            let index = body.map_or(1.0, |b| b.ior);
            ray.index_ratio = (*first_index.get_or_insert(index) / index).powi(2);
            if let Some(body) = body {
                ray.factor = ray.factor * attenuated(body.attenuation, met.t);
            }
            let Some(specular) = scatter.specular else { return Arrival { end: End::Patch(patch), ..ray } };
            let n = self.normal(patch);
            let cosine = -n.dot(ray.direction);
            if cosine <= 0.0 {
                // Only rounding brings a ray here: it runs along the surface.
                return ray;
            }
            let rest = scatter.brdf.albedo(cosine).max_channel();
            let choices = specular.choices(cosine, inside, rest, true);
            let (event, factor) = choices.choose(random());
            let away = -ray.direction;
            let next = match event {
                Event::Stop => return Arrival { end: End::Patch(patch), stop: choices.stop(), ..ray },
                Event::Reflect => mirrored(n, away),
                Event::Transmit => match specular.refract(n, away, inside) {
                    Some(next) => next,
                    None => return ray,
                },
            };
            let stays_inside = (event == Event::Transmit) != inside;
            medium = self.body_of(met.triangle).filter(|_| stays_inside);
            ray.factor = ray.factor * factor;
            ray.direction = next;
            let from = self.point_of(met.triangle, met.u, met.v);
            hit = match event {
                Event::Transmit => self.beyond(met.triangle, n, from, next),
                _ => self.leave(met.triangle, n, from, next),
            };
        }
        ray
    }

    /// The body that a triangle encloses, if light passes and bends.
    fn body_of(&self, triangle: u32) -> Option<Body> {
        let material = &self.materials[self.triangles[triangle as usize].material as usize];
        let volume = material.transmission.as_ref()?.volume?;
        let ior = if let Surface::MetallicRoughness { ior, .. } = material.surface { ior.max(1.0) } else { 1.5 };
        Some(Body { ior, attenuation: volume.attenuation })
    }

    /// What attenuates the way to a hit: the body that its back belongs to, or the one that the ray was left in.
    pub fn medium_before(&self, hit: &SurfaceHit, left_in: Option<Rgb>) -> Option<Rgb> {
        let own = || {
            let material = &self.materials[self.triangles[hit.triangle as usize].material as usize];
            let volume = material.transmission.as_ref().and_then(|t| t.volume);
            volume.map(|v| v.attenuation).filter(|a| hit.side == Side::Back && !a.is_black())
        };
        left_in.or_else(own)
    }
}
