//! Light from infinitely far away, as a source of rays: radiance, sampling, density.
//!
//! A ray of the environment comes through a disc across its direction, as wide as the scene's bounding sphere.
//! In the measure of lines (solid angle × area across), its density is pmf · pdf(ω)/(πR²), which is what makes
//! rays from the sky and rays that escape to it two techniques for one pair of points. Directions of maps and skies
//! come from a table (`sample::table`), the sun's from its disc, each with a probability of its own.

mod map;
mod sky;
pub mod solar;

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::authored::Environment;
use crate::geom::Frame;
use crate::rgb::Rgb;
use crate::sample::warp;

use map::MapLight;
use sky::SkyLight;

/// An environment around a scene of a known size.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    environment: Environment,
    radius: f64,
    body: Body,
    sun: Option<Sun>,
}

/// Everything but the sun.
#[derive(Clone, Debug)]
enum Body {
    Uniform(Rgb),
    Map(MapLight),
    Sky(Box<SkyLight>),
}

/// The sun's disc.
#[derive(Clone, Copy, Debug)]
struct Sun {
    towards: DVec3,
    radiance: Rgb,
    /// Probability with which a direction is one of the disc.
    share: f64,
}

/// The sun's share of directions: by what it gives, but so that neither is forgotten where the other does not get in.
const SUN_SHARES: [f64; 2] = [0.1, 0.6];

impl EnvironmentLight {
    /// The environment around the sphere of `radius` about the origin.
    pub fn new(environment: Environment, radius: f64) -> Self {
        let (body, sun) = match &environment {
            Environment::Uniform(radiance) => (Body::Uniform(*radiance), None),
            Environment::Map(map) => (Body::Map(MapLight::new(map)), None),
            Environment::Sky(sky) => (Body::Sky(Box::new(SkyLight::new(sky))), sky.sun.map(|e| (sky.towards_sun, e))),
        };
        let flux = body.integral().luminance();
        let sun = sun.filter(|(_, illuminance)| illuminance.luminance() > 0.0).map(|(towards, illuminance)| {
            let [least, most] = SUN_SHARES;
            let share = illuminance.luminance() / (illuminance.luminance() + flux);
            let share = if flux > 0.0 { share.clamp(least, most) } else { 1.0 };
            Sun { towards, radiance: illuminance / solar::DISC_SOLID_ANGLE, share }
        });
        Self { environment, radius, body, sun }
    }

    /// What the author wrote.
    pub(crate) fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Radiance that arrives from direction `towards` (unit, away from the scene).
    #[inline]
    pub fn radiance(&self, towards: DVec3) -> Rgb {
        let sky = match &self.body {
            Body::Uniform(radiance) => *radiance,
            Body::Map(map) => map.radiance(towards),
            Body::Sky(sky) => sky.radiance(towards),
        };
        match &self.sun {
            Some(sun) if sun.covers(towards) => sky + sun.radiance,
            _ => sky,
        }
    }

    /// Power through the bounding sphere, W: ∫ L dω · πR².
    pub fn power(&self) -> Rgb {
        let sun = self.sun.map_or(Rgb::BLACK, |sun| sun.radiance * solar::DISC_SOLID_ANGLE);
        (self.body.integral() + sun) * self.across()
    }

    /// No ray carries more luminance than this, W: a bound of 𝓛(radiance) / [`EnvironmentLight::pdf_line`].
    pub fn largest_power(&self) -> f64 {
        let body = match &self.body {
            Body::Uniform(radiance) => 4.0 * PI * radiance.luminance(),
            Body::Map(map) => map.largest_estimate(),
            Body::Sky(sky) => sky.largest_estimate(),
        };
        // (a + b)/(c + d) is at most the larger of a/c and b/d.
        let largest = match &self.sun {
            Some(sun) if sun.share < 1.0 => {
                (body / (1.0 - sun.share)).max(sun.radiance.luminance() * solar::DISC_SOLID_ANGLE / sun.share)
            }
            Some(sun) => sun.radiance.luminance() * solar::DISC_SOLID_ANGLE,
            None => body,
        };
        largest * self.across()
    }

    /// Density of [`EnvironmentLight::sample_direction`] per solid angle.
    #[inline]
    pub fn pdf_direction(&self, towards: DVec3) -> f64 {
        let share = self.sun.map_or(0.0, |sun| sun.share);
        let body = if share < 1.0 { (1.0 - share) * self.body.pdf(towards) } else { 0.0 };
        match &self.sun {
            Some(sun) if sun.covers(towards) => body + share / solar::DISC_SOLID_ANGLE,
            _ => body,
        }
    }

    /// A direction away from the scene, about proportional to radiance.
    #[inline]
    pub fn sample_direction(&self, [mut choice, other]: [f64; 2]) -> DVec3 {
        if let Some(sun) = &self.sun {
            if choice < sun.share {
                return sun.sample([choice / sun.share, other]);
            }
            choice = ((choice - sun.share) / (1.0 - sun.share)).min(1.0 - f64::EPSILON);
        }
        match &self.body {
            Body::Uniform(_) => warp::uniform_sphere([choice, other]),
            Body::Map(map) => map.sample([choice, other]),
            Body::Sky(sky) => sky.sample([choice, other]),
        }
    }

    /// Density of lines per (solid angle × area across): [`EnvironmentLight::sample_line`].
    #[inline]
    pub fn pdf_line(&self, towards: DVec3) -> f64 {
        self.pdf_direction(towards) / self.across()
    }

    /// Origin on the far disc and direction (into the scene) of a line.
    #[inline]
    pub fn sample_line(&self, direction: [f64; 2], disc: [f64; 2]) -> (DVec3, DVec3) {
        let towards = self.sample_direction(direction);
        (far_disc(towards, self.radius, disc), -towards)
    }

    /// Area of the disc, m².
    fn across(&self) -> f64 {
        PI * self.radius * self.radius
    }
}

/// A point on the disc through which everything comes in that arrives from `towards` at the sphere of `radius` about the
/// origin; uniform by area.
#[inline]
pub(crate) fn far_disc(towards: DVec3, radius: f64, u: [f64; 2]) -> DVec3 {
    let frame = Frame::from_normal(towards);
    let [x, y] = warp::uniform_disc(u);
    // A little beyond the sphere, so that no surface touches the start.
    (frame.x * x + frame.y * y + towards * 1.001) * radius
}

impl Body {
    /// ∫ L dω.
    fn integral(&self) -> Rgb {
        match self {
            Body::Uniform(radiance) => *radiance * (4.0 * PI),
            Body::Map(map) => map.integral(),
            Body::Sky(sky) => sky.integral(),
        }
    }

    #[inline]
    fn pdf(&self, towards: DVec3) -> f64 {
        match self {
            Body::Uniform(_) => 1.0 / (4.0 * PI),
            Body::Map(map) => map.pdf(towards),
            Body::Sky(sky) => sky.pdf(towards),
        }
    }
}

impl Sun {
    #[inline]
    fn covers(&self, towards: DVec3) -> bool {
        towards.dot(self.towards) >= solar::DISC_COSINE
    }

    #[inline]
    fn sample(&self, u: [f64; 2]) -> DVec3 {
        // A hair within the disc, so that rounding leads none of them out of it.
        let cosine = 1.0 - (1.0 - 1e-9) * u[0] * (1.0 - solar::DISC_COSINE);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (sin, cos) = libm::sincos(TAU * u[1]);
        Frame::from_normal(self.towards).to_world(DVec3::new(sine * cos, sine * sin, cosine))
    }
}

/// A direction's place in tables: cosine of the angle from +Y, and turns around it, 0.5 in +X and more towards +Z.
#[inline]
fn place_of(towards: DVec3) -> [f64; 2] {
    let turn = libm::atan2(towards.z, towards.x) / TAU + 0.5;
    [towards.y.clamp(-1.0, 1.0), if turn < 1.0 { turn } else { 0.0 }]
}

/// The direction of a place in tables.
#[inline]
fn direction_of([cosine, turn]: [f64; 2]) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * (turn - 0.5));
    DVec3::new(sine * cos, cosine, sine * sin)
}

#[cfg(test)]
mod tests;
