//! What a comparison is: rows of expected and measured values with a verdict, in cases with their story.
//!
//! The rule of every statistical row: measured is the mean over independent replicas (seeds), its standard error comes
//! from their scatter, and |measured − expected| may be t·error + what the model is known to differ by. A row whose
//! allowance exceeds its stated resolution proves nothing and fails too.

use crate::quadrature::student_quantile;

/// Probability that a right program fails one statistical row.
pub const FALSE_ALARM: f64 = 1e-5;

/// How much work a case does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Divides the rays of every solve; resolutions grow as its root.
    pub divide: u64,
}

impl Effort {
    /// What `docs/validation.md` is made with.
    pub const DOCUMENT: Self = Self { divide: 1 };
    /// What the tests run with.
    pub const TEST: Self = Self { divide: 16 };

    /// Rays of a solve that has `rays` in the document.
    pub fn rays(self, rays: u64) -> u64 {
        rays / self.divide
    }

    /// All values of a parameter in the document; in tests every third, beginning with the second.
    pub fn thin<T: Copy>(self, all: &[T]) -> Vec<T> {
        let (first, step) = if self == Self::DOCUMENT { (0, 1) } else { (1, 3) };
        all.iter().copied().skip(first).step_by(step).collect()
    }

    /// A resolution that is `resolution` in the document.
    pub fn resolution(self, resolution: f64) -> f64 {
        resolution * (self.divide as f64).sqrt()
    }
}

/// One comparison.
#[derive(Clone, Debug)]
pub struct Row {
    /// What is compared.
    pub name: String,
    /// The truth, or the bound of an "at most".
    pub expected: f64,
    /// What the solver says.
    pub measured: f64,
    /// Standard error of `measured`, 0 if it has none.
    pub error: f64,
    /// Largest |measured − expected| that passes.
    pub allowed: f64,
    /// Largest `allowed` / expected at which the row still says something.
    pub resolution: f64,
    /// True if only too large a value is wrong.
    pub at_most: bool,
}

impl Row {
    /// A mean of independent replicas against a value. `model` is the absolute difference between what is solved and
    /// what the value describes (facets, patches), known beforehand; `resolution` is relative.
    pub fn statistical(name: impl Into<String>, expected: f64, replicas: &[f64], model: f64, resolution: f64) -> Self {
        let n = replicas.len() as f64;
        let measured = replicas.iter().sum::<f64>() / n;
        let variance = replicas.iter().map(|x| (x - measured).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        // Irradiance is stored in single precision: 1e-6 is some of its steps, all rounded one way.
        let allowed = student_quantile(FALSE_ALARM, n - 1.0) * error + model + 1e-6 * expected.abs();
        Self { name: name.into(), expected, measured, error, allowed, resolution, at_most: false }
    }

    /// As [`Row::statistical`], where the expected value has a standard error of its own.
    pub fn compared(
        name: impl Into<String>,
        (expected, its_error): (f64, f64),
        replicas: &[f64],
        model: f64,
        resolution: f64,
    ) -> Self {
        let row = Self::statistical(name, expected, replicas, model, resolution);
        // Its error is that of many independent samples, hence normal: Student with no end of degrees of freedom.
        let (own, other) = (row.allowed - model, student_quantile(FALSE_ALARM, 1e6) * its_error);
        let (allowed, error) = (own.hypot(other) + model, row.error.hypot(its_error));
        Self { error, allowed, ..row }
    }

    /// A value that has no noise, or whose tolerance was derived beforehand.
    pub fn fixed(name: impl Into<String>, expected: f64, measured: f64, allowed: f64) -> Self {
        let resolution = f64::INFINITY;
        Self { name: name.into(), expected, measured, error: 0.0, allowed, resolution, at_most: false }
    }

    /// A value that must not exceed a bound.
    pub fn at_most(name: impl Into<String>, bound: f64, measured: f64) -> Self {
        Self { at_most: true, ..Self::fixed(name, bound, measured, 0.0) }
    }

    /// The verdict. A measured value that is not a number fails.
    pub fn passes(&self) -> bool {
        let difference =
            if self.at_most { self.measured - self.expected } else { (self.measured - self.expected).abs() };
        difference <= self.allowed && self.allowed <= self.resolution * self.expected.abs()
    }
}

/// Rows of one kind, with what a reader must know to judge them.
#[derive(Clone, Debug)]
pub struct Case {
    /// Heading.
    pub title: &'static str,
    /// What was compared with what, with which settings, and why a difference may be expected.
    pub story: String,
    /// Name and unit of the compared quantity.
    pub quantity: &'static str,
    /// The comparisons.
    pub rows: Vec<Row>,
}

impl Case {
    /// Rows that fail, in words; empty if all is well.
    pub fn faults(&self) -> Vec<String> {
        let wrong = self.rows.iter().filter(|r| !r.passes());
        wrong.map(|r| format!("{}: {r:?}", self.title)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts() {
        let samples: Vec<f64> = (0..16).map(|k| 1.0 + 0.01 * f64::from(k % 3 - 1)).collect();
        assert!(Row::statistical("", 1.0, &samples, 0.0, 0.1).passes());
        assert!(!Row::statistical("", 1.2, &samples, 0.0, 0.1).passes(), "a wrong value");
        assert!(Row::statistical("", 1.2, &samples, 0.2, 0.25).passes(), "a known difference");
        assert!(!Row::statistical("", 1.0, &samples, 0.0, 0.001).passes(), "a row that resolves nothing");
        assert!(!Row::statistical("", 1.0, &[f64::NAN; 6], 0.0, 0.1).passes(), "not a number");
        assert!(Row::at_most("", 1.0, -5.0).passes() && !Row::at_most("", 1.0, 1.1).passes());
    }
}
