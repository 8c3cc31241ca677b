//! Light from infinitely far away, as a source of rays: radiance, sampling, density.
//!
//! A ray of the environment comes through a disc across its direction, as wide as the scene's bounding sphere.
//! In the measure of lines (solid angle × area across), its density is pmf · pdf(ω)/(πR²), which is what makes
//! rays from the sky and rays that escape to it two techniques for one pair of points.

use std::f64::consts::PI;

use glam::DVec3;

use crate::authored::Environment;
use crate::geom::Frame;
use crate::rgb::Rgb;
use crate::sample::warp;

/// An environment around a scene of a known size.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    environment: Environment,
    radius: f64,
}

impl EnvironmentLight {
    /// The environment around the sphere of `radius` about the origin.
    pub fn new(environment: Environment, radius: f64) -> Self {
        Self { environment, radius }
    }

    /// What the author wrote.
    pub(crate) fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Radiance that arrives from direction `towards` (unit, away from the scene).
    #[inline]
    pub fn radiance(&self, _towards: DVec3) -> Rgb {
        let Environment::Uniform(radiance) = self.environment;
        radiance
    }

    /// Power through the bounding sphere, W: ∫ L dω · πR².
    pub fn power(&self) -> Rgb {
        let Environment::Uniform(radiance) = self.environment;
        radiance * (4.0 * PI * PI * self.radius * self.radius)
    }

    /// Density of [`EnvironmentLight::sample_direction`] per solid angle.
    #[inline]
    pub fn pdf_direction(&self, _towards: DVec3) -> f64 {
        1.0 / (4.0 * PI)
    }

    /// A direction away from the scene, about proportional to radiance.
    #[inline]
    pub fn sample_direction(&self, u: [f64; 2]) -> DVec3 {
        warp::uniform_sphere(u)
    }

    /// Density of lines per (solid angle × area across): [`EnvironmentLight::sample_line`].
    #[inline]
    pub fn pdf_line(&self, towards: DVec3) -> f64 {
        self.pdf_direction(towards) / (PI * self.radius * self.radius)
    }

    /// Origin on the far disc and direction (into the scene) of a line.
    #[inline]
    pub fn sample_line(&self, direction: [f64; 2], disc: [f64; 2]) -> (DVec3, DVec3) {
        let towards = self.sample_direction(direction);
        let frame = Frame::from_normal(towards);
        let [x, y] = warp::uniform_disc(disc);
        // A little beyond the sphere, so that no surface touches the start.
        let origin = (frame.x * x + frame.y * y + towards * 1.001) * self.radius;
        (origin, -towards)
    }
}
