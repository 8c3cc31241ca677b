//! The heart: one ray, two transfers (paper §1 and §2).
//!
//! A ray joins y and x. `Endpoint` is what each end brings: its radiance towards the other, and the density λ
//! with which a ray is started there in that direction, per unit of the geometry term:
//! p(y→x) = λ_y · G(x, y). G stands in every transfer and in every density, so it cancels here.
//! Deposits are A · irradiance in W: their mean over rays is the power that arrives on the patch.

use twinray_scene::Rgb;

use crate::params::Estimator;

/// One end of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Endpoint {
    /// L towards the other end, W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// λ = pmf · pdf(ω) / (A cosθ), really sampled, sr⁻¹·m⁻²; 0 where no ray can start.
    pub density: f64,
}

impl Endpoint {
    /// The same where a ray that starts here stops at its far end with probability `stop`, and might have gone on.
    #[inline]
    pub fn stopping(self, stop: f64) -> Self {
        Self { density: self.density * stop, ..self }
    }
}

impl Endpoint {
    /// The same as it is seen from the other end, where the squared index of refraction is 1/`ratio` times that here.
    #[inline]
    pub fn seen_through(self, ratio: f64) -> Self {
        Self { radiance: self.radiance * ratio, density: self.density * ratio }
    }
}

/// Deposits on both ends of one ray.
#[derive(Clone, Copy, Debug)]
pub struct Deposits {
    /// On the end that was hit: the forward estimator's.
    pub on_hit: Rgb,
    /// On the end that shot: the backward estimator's.
    pub on_shooter: Rgb,
}

/// What a ray that was started at `shooter` deposits on either end.
///
/// Balance heuristic: every transfer is divided by the *sum* of the densities with which its pair of points can be
/// found, since one ray is one sample of both techniques. (The paper's text divides by the average; that form goes
/// with averaging the two techniques instead of adding them. Errata: `docs/paper.md`.)
#[inline]
pub fn transfer(estimator: Estimator, shooter: &Endpoint, hit: &Endpoint) -> Deposits {
    match estimator {
        Estimator::Balance => {
            let weight = 1.0 / (shooter.density + hit.density);
            Deposits { on_hit: shooter.radiance * weight, on_shooter: hit.radiance * weight }
        }
        Estimator::Forward => Deposits { on_hit: shooter.radiance / shooter.density, on_shooter: Rgb::BLACK },
        Estimator::Backward => Deposits { on_hit: Rgb::BLACK, on_shooter: hit.radiance / shooter.density },
        Estimator::Equal => {
            let weight = 0.5 / shooter.density;
            Deposits { on_hit: shooter.radiance * weight, on_shooter: hit.radiance * weight }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With rays shot by power alone from diffuse patches, λ = 𝓛(L)/P, and the luminances of the two deposits of
    /// every ray sum to exactly P: each ray carries the whole power.
    #[test]
    fn the_deposits_of_a_ray_carry_the_whole_power() {
        let power = 123.0;
        for k in 0..1000 {
            let color = |a: f64| Rgb::new((a * 0.37).fract(), (a * 0.73).fract() * 10.0, (a * 0.11).fract());
            let end = |a: f64| Endpoint { radiance: color(a), density: color(a).luminance() / power };
            let d = transfer(Estimator::Balance, &end(f64::from(k) + 0.5), &end(f64::from(k) * 1.7 + 0.2));
            let sum = (d.on_hit + d.on_shooter).luminance();
            assert!((sum / power - 1.0).abs() < 1e-12, "{sum}");
        }
    }

    /// For any densities: Σ deposits · (λ_y + λ_x) = L_y + L_x.
    #[test]
    fn deposits_times_densities_are_the_radiances() {
        let y = Endpoint { radiance: Rgb::new(1.0, 2.0, 3.0), density: 0.3 };
        let x = Endpoint { radiance: Rgb::new(0.1, 0.0, 5.0), density: 0.7 };
        let d = transfer(Estimator::Balance, &y, &x);
        let sum = (d.on_hit + d.on_shooter) * (y.density + x.density);
        let expected = y.radiance + x.radiance;
        assert!((sum - expected).map(f64::abs).max_channel() < 1e-12);
    }
}
