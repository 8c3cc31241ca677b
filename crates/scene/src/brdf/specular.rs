//! What a surface does besides scattering by its BRDF: mirror reflection, and light that passes.
//!
//! Rays of the solver go on through both. A ray that was traced from either end must have made the same choices with the
//! same probabilities, so they depend on the angle outside of the body alone; there Schlick's term is taken for both ways.
//! Radiance over the squared index of refraction is kept across a surface, and bodies are closed: what a ray carries
//! does not change by refraction. Rough transmission is blurred in pictures alone.
//! Source: glTF 2.0 appendix B, `KHR_materials_transmission`, `KHR_materials_volume`.

use glam::DVec3;

use super::{Ggx, table::schlick};
use crate::authored::Volume;
use crate::geom::Frame;
use crate::rgb::Rgb;

/// The smallest probability with which a ray stops at a surface: even mirrors learn what arrives at them.
const LEAST_STOP: f64 = 1.0 / 16.0;

/// Mirror reflection and transmission of one place.
#[derive(Clone, Copy, Debug)]
pub struct Specular {
    /// Reflectance of the mirror at normal and at grazing incidence.
    pub(super) mirror: [Rgb; 2],
    /// What the coat over the transmitting base reflects; `None` without a coat.
    pub(super) coat: Option<Ggx>,
    /// Share of the base that transmits times its colour.
    pub(super) transmittance: Rgb,
    pub(super) ior: f64,
    pub(super) volume: Option<Volume>,
    /// α of the microfacets that transmit.
    pub(super) alpha: f64,
}

/// What a ray does at a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// It goes on in the mirror direction.
    Reflect,
    /// It goes on beyond the surface.
    Transmit,
    /// It ends: the surface scatters by its BRDF.
    Stop,
}

/// Probabilities of the events, and what a ray is multiplied by that goes on: throughput over probability.
#[derive(Clone, Copy, Debug)]
pub struct Choices {
    reflect: (f64, Rgb),
    transmit: (f64, Rgb),
}

impl Choices {
    /// Probability of stopping.
    pub fn stop(&self) -> f64 {
        1.0 - self.reflect.0 - self.transmit.0
    }

    /// The event for a uniform number, and the factor on what the ray carries; 1 over the probability for a stop.
    pub fn choose(&self, u: f64) -> (Event, Rgb) {
        if u < self.reflect.0 {
            (Event::Reflect, self.reflect.1)
        } else if u - self.reflect.0 < self.transmit.0 {
            (Event::Transmit, self.transmit.1)
        } else {
            (Event::Stop, Rgb::grey(1.0 / self.stop()))
        }
    }
}

impl Specular {
    /// Cosine outside of the body for one inside; `None` where all is reflected.
    fn outside(&self, cosine: f64, inside: bool) -> Option<f64> {
        if !(inside && self.volume.is_some()) {
            return Some(cosine);
        }
        let squared = 1.0 - self.ior * self.ior * (1.0 - cosine * cosine);
        (squared > 0.0).then(|| squared.sqrt())
    }

    /// Mirror reflectance and transmittance for light at the given cosine, from `inside` the body or from outside.
    pub fn throughput(&self, cosine: f64, inside: bool) -> [Rgb; 2] {
        let Some(outside) = self.outside(cosine, inside) else {
            // All that the BRDF beside does not scatter: a rough body still has its lobe there.
            let total = self.coat.map_or(self.transmittance, |g| (Rgb::WHITE - g.albedo(cosine)).map(|c| c.max(0.0)));
            return [total, Rgb::BLACK];
        };
        let reflected = self.mirror[0].lerp(self.mirror[1], schlick(outside));
        let coat = self.coat.map_or(0.0, |g| g.coat_albedo(outside));
        let transmitted = self.transmittance * (1.0 - coat);
        let room = self.room(outside, (reflected + transmitted).max_channel());
        [reflected * room, transmitted * room]
    }

    /// What has to be taken from the light that goes on, lest a body gives more than it gets: within it, the BRDF beside
    /// is that of another angle. For both ways the same, so that they stay reciprocal.
    fn room(&self, outside: f64, going: f64) -> f64 {
        let (Some(coat), Some(_)) = (self.coat, self.volume) else { return 1.0 };
        let within = (1.0 - (1.0 - outside * outside) / (self.ior * self.ior)).max(0.0).sqrt();
        let scattered = coat.albedo(within).max_channel();
        if going + scattered > 1.0 { ((1.0 - scattered) / going).max(0.0) } else { 1.0 }
    }

    /// Both together: the share of arriving light that goes on.
    pub fn passed(&self, cosine: f64, inside: bool) -> Rgb {
        let [reflected, transmitted] = self.throughput(cosine, inside);
        reflected + transmitted
    }

    /// Probabilities by what each event is worth, where the rest of the surface reflects `rest`; for the solver's rays,
    /// which learn of every surface, or for a picture's, which stop only where there is something to see.
    pub fn choices(&self, cosine: f64, inside: bool, rest: f64, for_solver: bool) -> Choices {
        let throughput = self.throughput(cosine, inside);
        let worth = throughput.map(Rgb::max_channel);
        let total = worth[0] + worth[1] + rest;
        let least = if for_solver { LEAST_STOP } else { 0.0 };
        let stop = if total > 0.0 { (rest / total).max(least) } else { 1.0 };
        let going = worth[0] + worth[1];
        let [reflect, transmit] = [0, 1].map(|k| {
            let probability = if going > 0.0 { (1.0 - stop) * worth[k] / going } else { 0.0 };
            (probability, if probability > 0.0 { throughput[k] / probability } else { Rgb::BLACK })
        });
        Choices { reflect, transmit }
    }

    /// The direction beyond the surface for light seen in direction `wo`, both away from it; `n` is a unit normal on
    /// the side of `wo`. `None` where all is reflected.
    pub fn refract(&self, n: DVec3, wo: DVec3, inside: bool) -> Option<DVec3> {
        if self.volume.is_none() {
            return Some(-wo);
        }
        let cosine = n.dot(wo);
        let eta = if inside { self.ior } else { 1.0 / self.ior };
        let squared = 1.0 - eta * eta * (1.0 - cosine * cosine);
        (squared > 0.0).then(|| (-wo * eta + n * (eta * cosine - squared.sqrt())).normalize())
    }

    /// Like [`Specular::refract`], blurred by the roughness, with the share that its microfacets let through. Thin
    /// panes blur as their reflection does, beyond the surface.
    pub fn refract_rough(&self, n: DVec3, wo: DVec3, inside: bool, u: [f64; 2]) -> Option<(DVec3, f64)> {
        if self.alpha == 0.0 {
            return Some((self.refract(n, wo, inside)?, 1.0));
        }
        let frame = Frame::from_normal(n);
        let local = frame.to_local(wo);
        let h = super::ggx::visible_normal(local, self.alpha, u);
        let out = match self.volume {
            Some(_) => self.refract(h, local, inside)?,
            None => {
                let mirrored = 2.0 * local.dot(h) * h - local;
                DVec3::new(mirrored.x, mirrored.y, -mirrored.z)
            }
        };
        if out.z >= 0.0 {
            return None;
        }
        // G2/G1 with both cosines taken as positive: what visible normals leave to weigh.
        let weight = super::ggx::masking_ratio(local.z, -out.z, self.alpha).min(1.0);
        Some((frame.to_world(out), weight))
    }

    /// True if light goes straight through, unbent and sharp: shadow rays may follow it.
    pub fn is_pane(&self) -> bool {
        self.volume.is_none() && self.alpha == 0.0 && self.transmits()
    }

    /// True if light passes sharply, bent or not.
    pub fn is_clear(&self) -> bool {
        self.alpha == 0.0 && self.transmits()
    }

    /// How much longer the bent way within a body is than the straight one would be between the same parallel faces, for
    /// light of this cosine outside.
    pub fn stretch(&self, cosine: f64) -> f64 {
        let inside = (1.0 - (1.0 - cosine * cosine) / (self.ior * self.ior)).max(0.0).sqrt();
        cosine / inside
    }

    /// True if any light passes beyond the surface.
    pub fn transmits(&self) -> bool {
        !self.transmittance.is_black()
    }

    /// What radiance is multiplied by that is seen through the surface, from `inside` the body or from outside: the
    /// squared ratio of the indices of refraction.
    pub fn radiance_ratio(&self, inside: bool) -> f64 {
        match (self.volume, inside) {
            (None, _) => 1.0,
            (Some(_), true) => self.ior * self.ior,
            (Some(_), false) => 1.0 / (self.ior * self.ior),
        }
    }

    /// What the body attenuates by, 1/m.
    pub fn attenuation(&self) -> Option<Rgb> {
        self.volume.map(|v| v.attenuation).filter(|a| !a.is_black())
    }
}

/// exp(−coefficient · distance), per channel.
pub fn attenuated(coefficient: Rgb, distance: f64) -> Rgb {
    coefficient.map(|c| libm::exp(-c * distance))
}

/// The mirror direction of `wo` about `n`.
#[inline]
pub fn mirrored(n: DVec3, wo: DVec3) -> DVec3 {
    (2.0 * n.dot(wo) * n - wo).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::{Brdf, Detail, Passing, Scatter};
    use super::*;

    fn glass(volume: Option<Volume>) -> Specular {
        let coat = Ggx::new(Rgb::WHITE, 0.0, 0.0, 1.0, Rgb::WHITE, 1.5);
        Specular {
            mirror: [Rgb::grey(0.04), Rgb::WHITE],
            coat: Some(coat.without(1.0).sharp()),
            transmittance: Rgb::WHITE,
            ior: 1.5,
            volume,
            alpha: 0.0,
        }
    }

    #[test]
    fn refraction_is_reversible_and_both_ways_make_the_same_choices() {
        let g = glass(Some(Volume { attenuation: Rgb::BLACK }));
        let n = DVec3::Z;
        for k in 1..90 {
            let angle = f64::from(k).to_radians();
            let wo = DVec3::new(angle.sin(), 0.0, angle.cos());
            let inside = g.refract(n, wo, false).unwrap();
            // Snell: sin θ = 1.5 sin θ'.
            assert!((wo.x.abs() - 1.5 * inside.x.abs()).abs() < 1e-12);
            let back = g.refract(-n, inside, true).unwrap();
            assert!((back - wo).length() < 1e-9, "{k}");
            let (a, b) = (g.throughput(wo.z, false), g.throughput(-inside.z, true));
            assert!((a[0] - b[0]).max_channel().abs() < 1e-9 && (a[1] - b[1]).max_channel().abs() < 1e-9);
            assert!((a[0] + a[1] - Rgb::WHITE).map(f64::abs).max_channel() < 1e-12, "clear glass keeps all light");
        }
        // Beyond the critical angle, 41.8°, all is reflected.
        assert_eq!(g.refract(-n, DVec3::new(0.7, 0.0, -(1.0f64 - 0.49).sqrt()), true), None);
        assert_eq!(g.throughput(0.7, true), [Rgb::WHITE, Rgb::BLACK]);
    }

    /// From within and from outside, beyond the critical angle and before it: what goes on and what is scattered are
    /// no more than what arrives, however rough the body and whatever share of it transmits.
    #[test]
    fn bodies_create_no_light() {
        let volume = Some(Volume { attenuation: Rgb::BLACK });
        for roughness in [0.0, 0.05, 0.2, 0.5, 1.0] {
            for share in [0.3, 1.0] {
                let ggx = Brdf::Ggx(Ggx::new(Rgb::WHITE, 0.0, roughness, 1.0, Rgb::WHITE, 1.5));
                let lambertian = Brdf::Lambertian { reflectance: Rgb::WHITE };
                for (brdf, detail) in [(ggx, Detail::Patches), (ggx, Detail::Picture), (lambertian, Detail::Patches)] {
                    let passing = Passing { share, color: Rgb::WHITE, ior: 1.5, volume };
                    let scatter = Scatter::new(brdf, Some(passing), detail);
                    let specular = scatter.specular.expect("light passes");
                    for k in 1..=100 {
                        let cosine = f64::from(k) / 100.0;
                        for inside in [false, true] {
                            let sum = specular.passed(cosine, inside) + scatter.brdf.albedo(cosine);
                            // The albedo's table is interpolated.
                            let text =
                                format!("roughness {roughness}, share {share}, cosine {cosine}, {inside}: {sum:?}");
                            assert!(sum.max_channel() < 1.0 + 0.004, "{text}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn choices_keep_the_mean() {
        let g = glass(None);
        for for_solver in [true, false] {
            let choices = g.choices(0.3, false, 0.2, for_solver);
            let mut sum = [Rgb::BLACK; 3];
            let n = 100_000;
            for k in 0..n {
                let (event, factor) = choices.choose((f64::from(k) + 0.5) / f64::from(n));
                sum[event as usize] += factor / f64::from(n);
            }
            let [reflected, transmitted] = g.throughput(0.3, false);
            for (got, expected) in sum.into_iter().zip([reflected, transmitted, Rgb::WHITE]) {
                assert!((got - expected).map(f64::abs).max_channel() < 1e-3, "{got:?} {expected:?}");
            }
        }
    }
}
