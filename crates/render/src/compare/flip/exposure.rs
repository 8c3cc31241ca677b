//! What HDR-ꟻLIP adds: a tone curve, and which exposures are worth looking at.

use twinray_scene::Rgb;

/// The curve of HDR, §3: Narkowicz's fit of ACES ("ACES Filmic Tone Mapping Curve", 2015) of 0.6 times the light,
/// (A x² + B x)/(C x² + D x + E), clipped at 1.
const A: f64 = 0.6 * 0.6 * 2.51;
const B: f64 = 0.6 * 0.03;
const C: f64 = 0.6 * 0.6 * 2.43;
const D: f64 = 0.6 * 0.59;
const E: f64 = 0.14;

/// Exposed light to a linear display value in [0, 1].
pub(super) fn tone(x: f64) -> f64 {
    let x = x.max(0.0);
    // Beyond any light the quotient of two infinities would be no number.
    if x > 1e100 { 1.0 } else { ((A * x + B) * x / ((C * x + D) * x + E)).clamp(0.0, 1.0) }
}

/// The display value that the brightest and the median pixel are brought to (HDR, §3.1).
const TARGET: f64 = 0.85;

/// Exposures in stops, from the one that shows the reference's brightest pixel to the one that shows its median, at
/// steps of about one stop. HDR, §3.1.
///
/// Where half of the reference is black, the paper's median is 0 and its exposure infinite: then the median of all
/// other pixels stands for it.
pub(super) fn exposures(reference: &[[f32; 3]]) -> Vec<f64> {
    let mut luminances: Vec<f64> = reference.iter().map(|c| Rgb::from_f32(*c).luminance()).collect();
    luminances.sort_by(f64::total_cmp);
    let brightest = luminances.last().copied().filter(|l| *l > 0.0).unwrap_or(1.0);
    let mut median = luminances.get(luminances.len() / 2).copied().unwrap_or(brightest);
    if median <= 0.0 {
        let lit = &luminances[luminances.partition_point(|l| *l <= 0.0)..];
        median = lit.get(lit.len() / 2).copied().unwrap_or(brightest);
    }
    // tone(x) = TARGET: the positive root of a x² + b x + c.
    let (a, b, c) = (A - TARGET * C, B - TARGET * D, -TARGET * E);
    let x = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let (start, stop) = (libm::log2(x / brightest), libm::log2(x / median.max(brightest * WIDEST)));
    let count = ((stop - start).ceil() as usize).max(2);
    let step = (stop - start) / (count - 1) as f64;
    (0..count).map(|i| start + step * i as f64).collect()
}

/// No picture takes more than 40 exposures.
const WIDEST: f64 = 1.0 / (1u64 << 40) as f64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_bring_the_brightest_and_the_median_to_the_target() {
        let pixels: Vec<[f32; 3]> = (1..=101).map(|i| [i as f32 * i as f32; 3]).collect();
        let stops = exposures(&pixels);
        let shown = |stops: f64, x: f64| tone(x * libm::exp2(stops));
        assert!((shown(stops[0], 101.0 * 101.0) - TARGET).abs() < 1e-9);
        assert!((shown(stops[stops.len() - 1], 51.0 * 51.0) - TARGET).abs() < 1e-9);
        assert_eq!(stops.len(), 2);
    }

    #[test]
    fn dark_pictures_have_sensible_exposures() {
        assert!(exposures(&[[0.0; 3]; 5]).iter().all(|s| s.is_finite()));
        // A grey object on black, as exposed without the black.
        let mut pixels = vec![[0.0; 3]; 80];
        pixels.extend([[0.5; 3], [1.0; 3], [2.0; 3]]);
        assert_eq!(exposures(&pixels), exposures(&[[0.5; 3], [1.0; 3], [2.0; 3]]));
        assert!(exposures(&[[1e30; 3], [1e-30; 3], [1e-30; 3]]).len() <= 40);
    }
}
