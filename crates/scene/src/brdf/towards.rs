//! A BRDF seen from one direction: what that direction alone decides is computed once.
//!
//! Pictures ask the BRDF of one point, seen from one eye, about many directions of light.

use glam::DVec3;

use super::Brdf;
use crate::geom::Frame;
use crate::rgb::Rgb;
use crate::sample::warp;

/// A BRDF, its normal and the direction to the eye.
#[derive(Clone, Copy, Debug)]
pub struct Towards {
    brdf: Brdf,
    n: DVec3,
    wo: DVec3,
    /// Probability with which the lobe is sampled.
    share: f64,
    /// Of a base under a coat, all but what the direction of light decides.
    base: Rgb,
    /// Whether the lobe is all there is.
    is_lobe: bool,
}

impl Brdf {
    /// The BRDF as it is seen from `wo`.
    pub fn towards(&self, n: DVec3, wo: DVec3) -> Towards {
        let cosine = n.dot(wo);
        let base = if let Brdf::Ggx(g) = self { g.base_towards(cosine.max(0.0)) } else { Rgb::BLACK };
        let share = if self.is_glossy() { self.lobe_share(cosine) } else { 0.0 };
        Towards { brdf: *self, n, wo, share, base, is_lobe: false }
    }

    /// The lobe alone, as it is seen from `wo`.
    pub fn lobe_towards(&self, n: DVec3, wo: DVec3) -> Towards {
        let share = if self.is_glossy() { 1.0 } else { 0.0 };
        Towards { brdf: *self, n, wo, share, base: Rgb::BLACK, is_lobe: true }
    }
}

impl Towards {
    /// Probability with which [`Towards::sample`] samples the lobe.
    pub fn lobe_share(&self) -> f64 {
        self.share
    }

    /// As [`Brdf::eval`], or [`Brdf::lobe_eval`].
    #[inline]
    pub fn eval(&self, wi: DVec3) -> Rgb {
        let ci = self.n.dot(wi);
        match &self.brdf {
            _ if ci <= 0.0 || self.n.dot(self.wo) <= 0.0 => Rgb::BLACK,
            _ if self.is_lobe => self.brdf.lobe_eval(self.n, wi, self.wo),
            Brdf::Ggx(g) => self.base * g.base_under(ci) + self.brdf.lobe_eval(self.n, wi, self.wo),
            _ => self.brdf.eval(self.n, wi, self.wo),
        }
    }

    /// As [`Brdf::sample`].
    pub fn sample(&self, u: [f64; 2]) -> Option<DVec3> {
        if u[0] < self.share {
            return self.brdf.lobe_sample(self.n, self.wo, [u[0] / self.share, u[1]]);
        }
        let local = warp::cosine_hemisphere([(u[0] - self.share) / (1.0 - self.share), u[1]]);
        Some(Frame::from_normal(self.n).to_world(local))
    }

    /// As [`Brdf::pdf`].
    #[inline]
    pub fn pdf(&self, wi: DVec3) -> f64 {
        let cosine = warp::cosine_hemisphere_pdf(self.n.dot(wi));
        if self.share == 0.0 {
            return cosine;
        }
        self.share * self.brdf.lobe_pdf(self.n, self.wo, wi) + (1.0 - self.share) * cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Ggx, Phong};
    use crate::sample::Stream;

    #[test]
    fn it_is_the_brdf() {
        let brdfs = [
            Brdf::Lambertian { reflectance: Rgb::grey(0.4) },
            Brdf::Ggx(Ggx::new(Rgb::new(0.9, 0.5, 0.2), 0.3, 0.3, 1.0, Rgb::WHITE, 1.5)),
            Brdf::Ggx(Ggx::new(Rgb::new(0.9, 0.5, 0.2), 0.0, 0.05, 1.0, Rgb::WHITE, 1.5).sharp()),
            Brdf::Phong(Phong::new(Rgb::grey(0.4), Rgb::grey(0.3), 40.0)),
        ];
        let mut random = Stream::new(5, 0, 0);
        let mut direction = || warp::uniform_sphere([random.uniform(), random.uniform()]);
        for brdf in brdfs {
            for _ in 0..300 {
                let (n, wo, wi) = (DVec3::Y, direction(), direction());
                let wo = DVec3::new(wo.x, wo.y.abs(), wo.z);
                let towards = brdf.towards(n, wo);
                assert!((towards.eval(wi) - brdf.eval(n, wi, wo)).map(f64::abs).max_channel() < 1e-9);
                assert!((towards.pdf(wi) - brdf.pdf(n, wo, wi)).abs() < 1e-9 * (1.0 + towards.pdf(wi)));
                let u = [wi.x.abs(), wi.z.abs()];
                assert_eq!(towards.sample(u), brdf.sample(n, wo, u));
            }
        }
    }
}
