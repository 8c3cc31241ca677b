//! Gauss-Legendre quadrature for means over sensors, and quantiles of Student's t for verdicts.

use std::f64::consts::PI;

use crate::factors::Range;

/// Nodes in [0, 1] with weights that sum to 1, exact for polynomials of degree 2n − 1.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let count = n as f64;
    (0..n)
        .map(|i| {
            // Newton's method on the Legendre polynomial from Tricomi's estimate of its root.
            let mut x = libm::cos(PI * (i as f64 + 0.75) / (count + 0.5));
            let mut slope = 1.0;
            for _ in 0..50 {
                let (mut before, mut p) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
                }
                slope = count * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Mean of `f` over the rectangle x × y with n × n Gauss points.
pub fn mean(x: Range, y: Range, n: usize, f: impl Fn(f64, f64) -> f64) -> f64 {
    let nodes = gauss(n);
    let at = |range: Range, s: f64| range[0] + (range[1] - range[0]) * s;
    nodes
        .iter()
        .flat_map(|&a| nodes.iter().map(move |&b| (a, b)))
        .fold(0.0, |sum, ((s, ws), (t, wt))| sum + ws * wt * f(at(x, s), at(y, t)))
}

/// The t beyond which a Student variable of `freedom` degrees lies with probability `alpha`, both sides counted.
/// By bisection on the integral of the density, which Simpson's rule does to 1e-9 here.
pub fn student_quantile(alpha: f64, freedom: f64) -> f64 {
    let scale = libm::exp(libm::lgamma(0.5 * (freedom + 1.0)) - libm::lgamma(0.5 * freedom)) / (freedom * PI).sqrt();
    let density = |t: f64| scale * libm::pow(1.0 + t * t / freedom, -0.5 * (freedom + 1.0));
    let inside = |t: f64| {
        let n = 2000;
        let h = t / f64::from(n);
        let odd: f64 = (0..n / 2).map(|i| density(h * f64::from(2 * i + 1))).sum();
        let even: f64 = (1..n / 2).map(|i| density(h * f64::from(2 * i))).sum();
        2.0 * h / 3.0 * (density(0.0) + 4.0 * odd + 2.0 * even + density(t))
    };
    let (mut low, mut high) = (0.0, 200.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 1.0 - inside(middle) > alpha { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        let sum: f64 = gauss(4).iter().map(|(x, w)| w * x.powi(7)).sum();
        assert!((sum - 0.125).abs() < 1e-14);
        assert!((mean([1.0, 3.0], [0.0, 2.0], 3, |x, y| x * x * y) - 13.0 / 3.0).abs() < 1e-13);
    }

    #[test]
    fn quantiles_of_the_table() {
        // Tables of Student's t, two-sided.
        for (alpha, freedom, t) in [(0.05, 15.0, 2.1314), (0.01, 7.0, 3.4995), (0.001, 30.0, 3.6460)] {
            assert!((student_quantile(alpha, freedom) - t).abs() < 1e-4);
        }
    }
}
