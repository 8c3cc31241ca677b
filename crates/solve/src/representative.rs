//! One remembered sample of a patch's incoming light: acceptance, rejection, scale (paper §2.1).
//!
//! The sequence I(n) of irradiances is mostly zero and sometimes large. It is replaced by a sequence of stored
//! samples, each scaled to the same luminance: C/l · I, where l = 𝓛(I·Δa) and C is the mean of l over all
//! iterations, zeros included. The mean stays right because a sample stays in proportion to its l.
//!
//! Δa is the albedo of |Δf_r|. Any positive weight keeps the mean right, so we take the lobe's albedo, to which
//! it is proportional up to the part that the lobe shares with the constant; the whole albedo if there is no main
//! part.

use glam::DVec3;
use twinray_scene::Rgb;

/// The stored (I(m), ω_m) of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub struct Representative {
    /// I(m), W·m⁻²; used only scaled, as C/l · I.
    pub irradiance: Rgb,
    /// ω_m, unit vector away from the surface.
    pub wi: DVec3,
    /// 𝓛(I(m)·Δa) of the stored irradiance; 0 before the first sample.
    pub importance: f64,
    /// What the stored sample is compared with: its own l, or the l of all samples of its wave.
    pub rival: f64,
}

impl Representative {
    /// Offers a new sample of weight `rival`; `u` is uniform in [0, 1). Samples without weight change nothing
    /// (the paper's zero samples are ignored), so a patch that is missed keeps what it has.
    ///
    /// Returns whether it was accepted.
    pub fn offer(&mut self, irradiance: Rgb, wi: DVec3, importance: f64, rival: f64, u: f64) -> bool {
        if importance <= 0.0 || u * self.rival >= rival {
            return false;
        }
        *self = Self { irradiance, wi, importance, rival };
        true
    }

    /// C/l · I for a mean importance C: the irradiance that the stored sample stands for.
    #[inline]
    pub fn scaled(&self, mean_importance: f64) -> Rgb {
        if self.importance > 0.0 { self.irradiance * (mean_importance / self.importance) } else { Rgb::BLACK }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::Stream;

    /// The time average of the stored, scaled samples equals the mean of the samples themselves, direction by
    /// direction; with the second division by n that the paper prints, it vanishes.
    #[test]
    fn the_time_average_is_the_mean_of_the_samples() {
        let mut stream = Stream::new(4, 0, 0);
        let mut stored = Representative::default();
        let n = 400_000;
        let (mut sum_importance, mut direct, mut averaged) = (0.0, [0.0; 4], [0.0; 4]);
        for k in 1..=n {
            // Nine samples of ten are zero; the others differ in size and direction, large ones rare.
            if stream.uniform() < 0.1 {
                let direction = (stream.uniform() * 4.0) as usize;
                let size = (1.0 + direction as f64) / (0.05 + stream.uniform());
                let wi = DVec3::new(direction as f64, 0.0, 0.0);
                sum_importance += size;
                direct[direction] += size;
                stored.offer(Rgb::grey(size), wi, size, size, stream.uniform());
            }
            let scaled = stored.scaled(sum_importance / f64::from(k));
            averaged[stored.wi.x as usize] += scaled.g;
        }
        for d in 0..4 {
            let ratio = averaged[d] / direct[d];
            // 40 000 samples in a chain with some rejection: 2 % is more than four standard errors.
            assert!((ratio - 1.0).abs() < 0.02, "direction {d}: {ratio}");
        }
    }

    #[test]
    fn zero_samples_are_ignored() {
        let mut stored = Representative::default();
        assert!(stored.offer(Rgb::WHITE, DVec3::X, 1.0, 1.0, 0.999));
        assert!(!stored.offer(Rgb::BLACK, DVec3::Y, 0.0, 0.0, 0.0));
        assert_eq!(stored.wi, DVec3::X);
    }
}
