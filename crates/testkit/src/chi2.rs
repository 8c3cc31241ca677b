//! Pearson's chi² test: observed counts against expected ones, and samplers of directions against densities.

use std::f64::consts::{PI, TAU};

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Outcome of a chi² test.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Σ (observed − expected)² / expected over the pooled cells.
    pub statistic: f64,
    /// Cells after pooling, minus one.
    pub degrees_of_freedom: f64,
    /// Probability of a statistic at least this large if the counts follow the expectation.
    pub p_value: f64,
}

/// Tests `observed` counts against `expected` ones (same length, same total). Cells with an expectation below
/// five are pooled, since the chi² approximation fails there.
///
/// # Panics
/// If the lengths differ, or if a count falls where nothing is expected.
pub fn test(observed: &[u64], expected: &[f64]) -> Outcome {
    assert_eq!(observed.len(), expected.len(), "observed and expected cells");
    let (mut statistic, mut cells) = (0.0, 0u32);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        assert!(e > 0.0 || o == 0, "{o} counts in a cell of zero expectation");
        if e < 5.0 {
            pooled_observed += o as f64;
            pooled_expected += e;
        } else {
            statistic += (o as f64 - e).powi(2) / e;
            cells += 1;
        }
    }
    if pooled_expected > 5.0 {
        statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected;
        cells += 1;
    }
    let degrees_of_freedom = f64::from(cells.max(2) - 1);
    let p_value = ChiSquared::new(degrees_of_freedom).expect("positive degrees of freedom").sf(statistic);
    Outcome { statistic, degrees_of_freedom, p_value }
}

/// Tests unit vectors against a density per solid angle on an equal-area grid of `rings` in z × `sectors` in
/// azimuth. `None` counts as a sample that the density does not cover (rejected below the horizon, say): the
/// density may then integrate to less than one, and the difference is a cell of its own.
pub fn sphere(
    samples: impl Iterator<Item = Option<[f64; 3]>>,
    density: impl Fn([f64; 3]) -> f64,
    rings: usize,
    sectors: usize,
) -> Outcome {
    let cells = 2 * rings * sectors;
    let mut observed = vec![0u64; cells + 1];
    for sample in samples {
        let cell = sample.map_or(cells, |[x, y, z]| {
            let ring = ((z * 0.5 + 0.5) * (2 * rings) as f64).clamp(0.0, (2 * rings - 1) as f64) as usize;
            let sector = ((y.atan2(x) / TAU + 0.5) * sectors as f64).clamp(0.0, (sectors - 1) as f64) as usize;
            ring * sectors + sector
        });
        observed[cell] += 1;
    }
    let total = observed.iter().sum::<u64>() as f64;
    let mut expected: Vec<f64> = (0..cells)
        .map(|cell| {
            let (ring, sector) = ((cell / sectors) as f64, (cell % sectors) as f64);
            let (z0, phi0) = (ring / rings as f64 - 1.0, sector / sectors as f64 * TAU - PI);
            total * integrate(&density, z0, 1.0 / rings as f64, phi0, TAU / sectors as f64)
        })
        .collect();
    let covered: f64 = expected.iter().sum();
    expected.push((total - covered).max(0.0));
    if observed[cells] == 0 {
        // Nothing was rejected: the leftover is the quadrature's own error, not a cell.
        assert!((total - covered).abs() < 2e-3 * total, "the density integrates to {}", covered / total);
        expected[cells] = 0.0;
    }
    test(&observed, &expected)
}

/// Midpoint rule with 32 × 32 points over one cell of (z, azimuth).
fn integrate(density: &impl Fn([f64; 3]) -> f64, z0: f64, dz: f64, phi0: f64, dphi: f64) -> f64 {
    const N: usize = 32;
    let mut sum = 0.0;
    for i in 0..N {
        let z = z0 + (i as f64 + 0.5) / N as f64 * dz;
        let r = (1.0 - z * z).max(0.0).sqrt();
        for j in 0..N {
            let phi = phi0 + (j as f64 + 0.5) / N as f64 * dphi;
            sum += density([r * phi.cos(), r * phi.sin(), z]);
        }
    }
    sum * dz * dphi / (N * N) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_expectation_is_noticed() {
        assert!(test(&[100, 100, 100], &[100.0, 100.0, 100.0]).p_value > 0.99);
        assert!(test(&[150, 100, 50], &[100.0, 100.0, 100.0]).p_value < 1e-6);
    }
}
