//! Means with standard errors, and tests of whether two of them agree.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Mean and standard error of independent samples.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    /// Sample mean.
    pub value: f64,
    /// Standard error of the mean.
    pub error: f64,
}

impl Mean {
    /// Mean and standard error of `samples` (at least two).
    pub fn of(samples: &[f64]) -> Self {
        let n = samples.len() as f64;
        let value = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|s| (s - value).powi(2)).sum::<f64>() / (n - 1.0);
        Self { value, error: (variance / n).sqrt() }
    }

    /// Two-sided p-value of the hypothesis that the true mean is `value`.
    pub fn p_equals(&self, value: f64) -> f64 {
        two_sided((self.value - value) / self.error.max(f64::MIN_POSITIVE))
    }

    /// Two-sided p-value of the hypothesis that two means agree (Welch's statistic, normal approximation).
    pub fn p_agrees(&self, other: &Mean) -> f64 {
        let error = self.error.hypot(other.error).max(f64::MIN_POSITIVE);
        two_sided((self.value - other.value) / error)
    }
}

/// Probability of a standard normal at least as far from zero as `z`.
pub fn two_sided(z: f64) -> f64 {
    2.0 * Normal::new(0.0, 1.0).expect("standard normal").sf(z.abs())
}

/// Two-sided p-value of Student's statistic: a deviation in units of an error that was estimated with so many degrees
/// of freedom.
pub fn student(t: f64, degrees_of_freedom: f64) -> f64 {
    2.0 * StudentsT::new(0.0, 1.0, degrees_of_freedom).expect("positive degrees of freedom").sf(t.abs())
}

/// Probability that the smallest of `tests` independent p-values is at most `smallest` by chance (Šidák 1967).
pub fn sidak(smallest: f64, tests: usize) -> f64 {
    -f64::exp_m1(tests as f64 * f64::ln_1p(-smallest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_sided_matches_the_table() {
        assert!((two_sided(1.959964) - 0.05).abs() < 1e-6);
    }

    #[test]
    fn student_and_sidak_match_the_table() {
        assert!((student(2.0, 60.0) - 0.05).abs() < 1e-4);
        assert!((sidak(0.05, 2) - 0.0975).abs() < 1e-12);
        assert!((sidak(1e-12, 1000) / 1e-9 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn distinct_means_are_told_apart() {
        let a = Mean::of(&[1.0, 1.1, 0.9, 1.0]);
        assert!(a.p_equals(1.0) > 0.9 && a.p_equals(2.0) < 1e-6);
        assert!(a.p_agrees(&Mean { value: 1.02, error: 0.05 }) > 0.5);
    }
}
