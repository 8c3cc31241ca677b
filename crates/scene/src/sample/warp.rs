//! Maps from the unit square to directions and points, each beside its density.
//!
//! Local frames have the surface normal as +Z. Transcendental functions come from `libm`, so that every
//! processor computes the same bits.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

/// Sine and cosine of `u` turns, 0 ≤ u ≤ 1. The quadrant is taken off here, where it is exact and costs nothing, so that the
/// library need not reduce the angle.
#[inline]
fn sincos_of_turn(u: f64) -> (f64, f64) {
    let quarters = 4.0 * u;
    let nearest = (quarters + 0.5) as u32;
    let (sin, cos) = libm::sincos((quarters - f64::from(nearest)) * FRAC_PI_2);
    match nearest & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Cosine-weighted direction about +Z; density cosθ/π per solid angle.
#[inline]
pub fn cosine_hemisphere(u: [f64; 2]) -> DVec3 {
    let (sin, cos) = sincos_of_turn(u[1]);
    let r = u[0].sqrt();
    DVec3::new(r * cos, r * sin, (1.0 - u[0]).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`], sr⁻¹.
#[inline]
pub fn cosine_hemisphere_pdf(cosine: f64) -> f64 {
    cosine.max(0.0) / PI
}

/// Uniform direction on the unit sphere; density 1/(4π).
#[inline]
pub fn uniform_sphere(u: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sincos_of_turn(u[1]);
    DVec3::new(r * cos, r * sin, z)
}

/// Uniform point on the unit disc; density 1/π per area.
#[inline]
pub fn uniform_disc(u: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = sincos_of_turn(u[1]);
    let r = u[0].sqrt();
    [r * cos, r * sin]
}

/// Uniform barycentric weights of vertices 1 and 2 of a triangle (fold of the unit square, which keeps strata).
#[inline]
pub fn uniform_triangle(u: [f64; 2]) -> [f64; 2] {
    if u[0] + u[1] <= 1.0 { u } else { [1.0 - u[0], 1.0 - u[1]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Stream;
    use std::f64::consts::TAU;
    use twinray_testkit::chi2;

    #[test]
    fn sines_and_cosines_of_turns() {
        for k in 0..=1000 {
            let u = f64::from(k) / 1000.0;
            let ((sin, cos), angle) = (sincos_of_turn(u), TAU * u);
            assert!((sin - angle.sin()).abs() < 1e-15 && (cos - angle.cos()).abs() < 1e-15, "{u}");
        }
    }

    #[test]
    fn cosine_hemisphere_matches_its_density() {
        let mut stream = Stream::new(11, 0, 0);
        let samples = (0..200_000).map(|_| {
            let d = cosine_hemisphere([stream.uniform(), stream.uniform()]);
            Some([d.x, d.y, d.z])
        });
        let result = chi2::sphere(samples, |d| cosine_hemisphere_pdf(d[2]), 10, 20);
        assert!(result.p_value > 0.01, "{result:?}");
    }

    #[test]
    fn uniform_sphere_matches_its_density() {
        let mut stream = Stream::new(12, 0, 0);
        let samples = (0..200_000).map(|_| {
            let d = uniform_sphere([stream.uniform(), stream.uniform()]);
            Some([d.x, d.y, d.z])
        });
        let result = chi2::sphere(samples, |_| 1.0 / (4.0 * PI), 10, 20);
        assert!(result.p_value > 0.01, "{result:?}");
    }

    #[test]
    fn triangle_and_disc_are_uniform() {
        let mut stream = Stream::new(13, 0, 0);
        let (mut triangle, mut disc) = (vec![0u64; 64], vec![0u64; 64]);
        for _ in 0..200_000 {
            let [u, v] = uniform_triangle([stream.uniform(), stream.uniform()]);
            // 8 x 8 congruent cells by index arithmetic.
            let (i, j) = ((u * 8.0) as usize, (v * 8.0) as usize);
            let upper = usize::from(u * 8.0 - i as f64 + v * 8.0 - j as f64 > 1.0);
            triangle[j * (16 - j) + 2 * i + upper] += 1;
            let [x, y] = uniform_disc([stream.uniform(), stream.uniform()]);
            let ring = ((x * x + y * y) * 8.0) as usize;
            let sector = ((y.atan2(x) / TAU + 0.5) * 8.0).min(7.0) as usize;
            disc[8 * ring.min(7) + sector] += 1;
        }
        let expected = vec![200_000.0 / 64.0; 64];
        assert!(chi2::test(&triangle, &expected).p_value > 0.01);
        assert!(chi2::test(&disc, &expected).p_value > 0.01);
    }
}
