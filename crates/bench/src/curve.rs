//! Error over rays and seconds, and where it crosses a target.

use serde_json::{Value, json};

use crate::results::Reader;

/// A look at a solve in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Rays so far.
    pub rays: f64,
    /// Seconds of the solver alone.
    pub seconds: f64,
    /// Relative error.
    pub error: f64,
}

/// How a crossing is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// Between two looks.
    Measured,
    /// The first look was better already: an upper bound.
    AtMost,
    /// Beyond the last look, by the slope of the last ones.
    Extrapolated,
}

/// Where the error crosses a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Rays it takes.
    pub rays: f64,
    /// Seconds it takes.
    pub seconds: f64,
    /// How that is known.
    pub known: Known,
}

/// Looks behind the slope of an extrapolation.
const LAST: usize = 5;

/// Rays and seconds at which the error falls to `target`. Interpolated in logarithms; beyond the last look error ∝
/// rays^slope with the slope of the last five looks, and seconds at the pace of the last two. `None` if the error does not fall.
pub fn crossing(points: &[Point], target: f64) -> Option<Crossing> {
    let (first, last) = (points.first()?, points.last()?);
    if first.error <= target {
        return Some(Crossing { rays: first.rays, seconds: first.seconds, known: Known::AtMost });
    }
    let pairs = points.windows(2);
    if let Some([a, b]) = pairs.map(|p| [p[0], p[1]]).find(|[_, b]| b.error <= target) {
        // An error that the reference's noise hides is 0: its logarithm is not needed to more than this.
        let share = libm::log(a.error / target) / libm::log(a.error / b.error.max(1e-3 * target));
        let between = |x: f64, y: f64| x * libm::pow(y / x, share);
        let (rays, seconds) = (between(a.rays, b.rays), between(a.seconds, b.seconds));
        return Some(Crossing { rays, seconds, known: Known::Measured });
    }
    let tail = &points[points.len().saturating_sub(LAST)..];
    let slope = slope(tail);
    if tail.len() < 2 || slope.is_nan() || slope > -0.05 {
        return None;
    }
    let rays = last.rays * libm::pow(target / last.error, 1.0 / slope);
    let before = &tail[tail.len() - 2];
    let pace = (last.seconds - before.seconds) / (last.rays - before.rays);
    Some(Crossing { rays, seconds: last.seconds + pace * (rays - last.rays), known: Known::Extrapolated })
}

/// Exponent of the least-squares fit error ∝ rays^slope.
pub fn slope(points: &[Point]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|p| (libm::log(p.rays), libm::log(p.error))).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

/// To be stored.
pub fn json(points: &[Point]) -> Value {
    points.iter().map(|p| json!({"rays": p.rays, "seconds": p.seconds, "error": p.error})).collect()
}

/// What [`json()`] stored.
pub fn read(stored: &Reader) -> Result<Vec<Point>, String> {
    let point = |p: &Reader| {
        let number = |key| p.get(key)?.number();
        Ok(Point { rays: number("rays")?, seconds: number("seconds")?, error: number("error")? })
    };
    stored.items()?.iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error rays^-0.6, a million rays a second after a tenth of a second.
    fn law(rays: &[f64]) -> Vec<Point> {
        let at = |&rays: &f64| Point { rays, seconds: 0.1 + 1e-6 * rays, error: libm::pow(rays, -0.6) };
        rays.iter().map(at).collect()
    }

    #[test]
    fn crossings_follow_a_law() {
        let points = law(&[1e3, 1e4, 2e4, 4e4]);
        let within = crossing(&points, libm::pow(15e3, -0.6)).unwrap();
        assert!((within.rays / 15e3 - 1.0).abs() < 1e-9 && within.known == Known::Measured);
        let beyond = crossing(&points, libm::pow(1e6, -0.6)).unwrap();
        assert!((beyond.rays / 1e6 - 1.0).abs() < 1e-9 && beyond.known == Known::Extrapolated);
        assert!((beyond.seconds - 1.1).abs() < 1e-9);
        assert_eq!(crossing(&points, 0.5).unwrap().known, Known::AtMost);
        assert!((slope(&points) + 0.6).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_fall_crosses_nothing() {
        let flat = [1e3, 1e4, 1e5].map(|rays| Point { rays, seconds: rays, error: 0.2 });
        assert_eq!(crossing(&flat, 0.1), None);
        assert_eq!(crossing(&[], 0.1), None);
        assert_eq!(crossing(&flat[..1], 0.1), None);
    }

    #[test]
    fn points_are_stored_to_the_bit() {
        let points = law(&[1e3, 3e3]);
        assert_eq!(read(&Reader::new(&json(&points))), Ok(points));
    }
}
