//! The light at one point: factors of nine real spherical harmonics, and the irradiance that follows from them.
//!
//! Convention of Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment maps" (SIGGRAPH
//! 2001): orthonormal, without the sign of Condon and Shortley, in the order 1; y, z, x; xy, yz, 3z² − 1, xz, x² − y².

use std::f64::consts::PI;

use glam::DVec3;
use twinray_render::walk::basis;
use twinray_scene::Rgb;

/// Number of harmonics: degrees 0, 1, 2.
pub const HARMONICS: usize = 9;

/// What a cosine lobe makes of the harmonics of each degree (ibid., equation 8).
const COSINE: [f64; HARMONICS] = {
    let (a, b, c) = (PI, 2.0 * PI / 3.0, PI / 4.0);
    [a, b, b, b, c, c, c, c, c]
};

/// Radiance from all directions, W·sr⁻¹·m⁻² (or nit), as factors of harmonics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics(pub [[f32; 3]; HARMONICS]);

impl Harmonics {
    pub(crate) fn from_rgb(factors: [Rgb; HARMONICS]) -> Self {
        // What is no number would spoil whatever is interpolated with it.
        Self(factors.map(|f| if f.is_finite() { f.to_f32() } else { [0.0; 3] }))
    }

    /// Irradiance, W·m⁻² (or lux), on a surface with this unit normal. Never negative: beside a small bright lamp the nine
    /// harmonics go below zero on surfaces that face away.
    pub fn irradiance(&self, normal: DVec3) -> Rgb {
        let basis = basis(normal);
        let sum: Rgb = (0..HARMONICS).map(|k| Rgb::from_f32(self.0[k]) * (COSINE[k] * basis[k])).sum();
        sum.map(|c| c.max(0.0))
    }

    /// Sum of both, the other weighed.
    pub(crate) fn add(&mut self, other: &Self, weight: f32) {
        for (a, b) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
            *a += weight * b;
        }
    }
}
