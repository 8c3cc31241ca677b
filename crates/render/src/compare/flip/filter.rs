//! Convolutions of ꟻLIP: the eye's contrast sensitivity, and detectors of edges and points.
//!
//! All kernels are sums of products of one in x and one in y, so each pass is along a line. Beyond the border the
//! outermost pixel goes on.

use std::f64::consts::PI;

use rayon::prelude::*;

/// Three planes `[height × width]`.
pub(super) struct Planes(pub [Vec<f32>; 3]);

impl Planes {
    /// Planes of pixels, each through `f`.
    pub fn map(pixels: &[[f32; 3]], f: impl Fn([f32; 3]) -> [f64; 3] + Sync) -> Self {
        Self::split(pixels.par_iter().map(|c| f(*c).map(|v| v as f32)).collect())
    }

    /// Each pixel through `f`.
    pub fn map_each(&self, f: impl Fn([f64; 3]) -> [f64; 3] + Sync) -> Self {
        Self::split((0..self.0[0].len()).into_par_iter().map(|i| f(self.at(i)).map(|v| v as f32)).collect())
    }

    /// Pixel `i`.
    pub fn at(&self, i: usize) -> [f64; 3] {
        [0, 1, 2].map(|c| f64::from(self.0[c][i]))
    }

    fn split(pixels: Vec<[f32; 3]>) -> Self {
        Self([0, 1, 2].map(|c| pixels.iter().map(|p| p[c]).collect()))
    }
}

/// A kernel along a line, of odd length, its middle on the pixel.
type Kernel = Vec<f64>;

fn kernel(radius: usize, f: impl Fn(f64) -> f64) -> Kernel {
    (0..=2 * radius).map(|i| f(i as f64 - radius as f64)).collect()
}

/// `kernel`, its positive part scaled to 1 and its negative part to −1.
fn normalised(kernel: Kernel) -> Kernel {
    let (up, down) = kernel.iter().fold((0.0, 0.0), |(u, d), k| (u + k.max(0.0), d - k.min(0.0)));
    kernel
        .into_iter()
        .map(|k| {
            if k > 0.0 {
                k / up
            } else if k < 0.0 {
                k / down
            } else {
                0.0
            }
        })
        .collect()
}

/// `plane` convolved with `along_x` × `along_y`.
fn convolve(plane: &[f32], (width, height): (usize, usize), along_x: &Kernel, along_y: &Kernel) -> Vec<f32> {
    if plane.is_empty() {
        return Vec::new();
    }
    let mut rows = vec![0.0f32; plane.len()];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let source = &plane[y * width..(y + 1) * width];
        for (x, out) in row.iter_mut().enumerate() {
            *out = weighted(along_x, x, width, |i| source[i]);
        }
    });
    let mut out = vec![0.0f32; plane.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = weighted(along_y, y, height, |i| rows[i * width + x]);
        }
    });
    out
}

/// Sum of the kernel times the values around place `at` of a line of `length`.
fn weighted(kernel: &Kernel, at: usize, length: usize, value: impl Fn(usize) -> f32) -> f32 {
    let radius = kernel.len() / 2;
    let place = |k: usize| (at + k).saturating_sub(radius).min(length - 1);
    kernel.iter().enumerate().map(|(k, w)| w * f64::from(value(place(k)))).sum::<f64>() as f32
}

/// Contrast sensitivity: each opponent channel blurred as the eye blurs it.
pub(super) struct Spatial {
    /// Per channel: Gaussians with their weights, which add up to 1.
    channels: [Vec<(f64, Kernel)>; 3],
}

/// Contrast sensitivity functions as sums of Gaussians Σ a √(π/b) exp(−π²x²/b), x in degrees: pairs (a, b) for the
/// achromatic, the red–green and the blue–yellow channel (LDR, §4.1.1, table 1).
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

impl Spatial {
    pub fn new(pixels_per_degree: f64) -> Self {
        // Three standard deviations of the widest Gaussian.
        let widest = SENSITIVITY.iter().copied().flatten().map(|(_, b)| *b).fold(0.0, f64::max);
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
        let channels = SENSITIVITY.map(|terms| {
            let gaussian = |b: f64| {
                let raw = kernel(radius, |x| libm::exp(-(PI * x / pixels_per_degree).powi(2) / b));
                (raw.iter().sum::<f64>(), normalised(raw))
            };
            let parts: Vec<_> = terms
                .iter()
                .map(|(a, b)| {
                    let (sum, kernel) = gaussian(*b);
                    // In two dimensions the Gaussian's sum is the square of its sum along a line.
                    (a * (PI / b).sqrt() * sum * sum, kernel)
                })
                .collect();
            let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
            parts.into_iter().map(|(weight, kernel)| (weight / total, kernel)).collect()
        });
        Self { channels }
    }

    pub fn apply(&self, picture: &Planes, size: (usize, usize)) -> Planes {
        Planes([0, 1, 2].map(|c| {
            let mut sum = vec![0.0f32; picture.0[c].len()];
            for (weight, kernel) in &self.channels[c] {
                let blurred = convolve(&picture.0[c], size, kernel, kernel);
                sum.iter_mut().zip(blurred).for_each(|(s, b)| *s += (weight * f64::from(b)) as f32);
            }
            sum
        }))
    }
}

/// Detectors of edges and points, as wide as the eye's most sensitive frequency asks. LDR, §4.2.
pub(super) struct Features {
    smooth: Kernel,
    edge: Kernel,
    point: Kernel,
}

/// Width of a detected feature, degrees (LDR, §4.2).
const FEATURE_WIDTH: f64 = 0.082;

impl Features {
    pub fn new(pixels_per_degree: f64) -> Self {
        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as usize;
        let gaussian = |x: f64| libm::exp(-x * x / (2.0 * sigma * sigma));
        Self {
            smooth: normalised(kernel(radius, gaussian)),
            edge: normalised(kernel(radius, |x| -x * gaussian(x))),
            point: normalised(kernel(radius, |x| (x * x / (sigma * sigma) - 1.0) * gaussian(x))),
        }
    }

    /// Strengths of edge and point at every pixel of the achromatic channel.
    pub fn apply(&self, achromatic: &[f32], size: (usize, usize)) -> Vec<[f32; 2]> {
        let grey: Vec<f32> = achromatic.iter().map(|y| (y + 16.0) / 116.0).collect();
        let strength = |detector: &Kernel| -> Vec<f32> {
            let across = convolve(&grey, size, detector, &self.smooth);
            let down = convolve(&grey, size, &self.smooth, detector);
            across.iter().zip(down).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        strength(&self.edge).into_iter().zip(strength(&self.point)).map(|(e, p)| [e, p]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blurring_keeps_an_even_picture_and_detectors_see_nothing_there() {
        let even = Planes([vec![0.3; 35], vec![-0.2; 35], vec![0.1; 35]]);
        let blurred = Spatial::new(67.0).apply(&even, (7, 5));
        for c in 0..3 {
            assert!(blurred.0[c].iter().all(|v| (v - even.0[c][0]).abs() < 1e-6));
        }
        for [edge, point] in Features::new(67.0).apply(&even.0[0], (7, 5)) {
            assert!(edge < 1e-6 && point < 1e-6);
        }
    }

    /// A step from black to white is an edge of strength 1: one half of the detector, which sums to 1, lies on white.
    #[test]
    fn a_step_is_an_edge() {
        let plane: Vec<f32> = (0..61 * 3).map(|i| if i % 61 < 30 { -16.0 } else { 100.0 }).collect();
        let features = Features::new(67.0).apply(&plane, (61, 3));
        let strongest = (0..61).max_by(|a, b| features[*a][0].total_cmp(&features[*b][0])).unwrap();
        assert!((29..=30).contains(&strongest), "{strongest}");
        assert!((0.9..1.01).contains(&features[strongest][0]), "{}", features[strongest][0]);
        assert!(features[5][0] < 1e-6);
    }
}
