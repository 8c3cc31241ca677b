//! Measures that look at each pixel alone: RMSE, relMSE, PSNR.

use twinray_scene::Rgb;

/// Root of the mean squared difference over pixels and channels, in the unit of the values.
///
/// Both arrays are `[pixels]`.
///
/// # Panics
/// If they differ in length.
pub fn rmse(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(test, reference, |a, b| (a - b) * (a - b)).sqrt()
}

/// Mean over pixels and channels of (a − b)²/(b² + ε) with ε = 0.01 Y², where Y is the reference's mean luminance.
///
/// The usual constant ε = 0.01 supposes pictures of about unit brightness. Here units are physical, and a lamp ten
/// times as strong must not change the result: ε follows the reference. Both arrays are `[pixels]`.
///
/// # Panics
/// If they differ in length.
pub fn relative_mse(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let sum: f64 = reference.iter().map(|b| Rgb::from_f32(*b).luminance()).sum();
    let brightness = sum / reference.len().max(1) as f64;
    let epsilon = 0.01 * brightness * brightness;
    // Where the reference is black throughout, any light is infinitely too much, but no light is no error.
    mean(test, reference, |a, b| if a == b { 0.0 } else { (a - b) * (a - b) / (b * b + epsilon) })
}

/// Peak signal-to-noise ratio of display values in [0, 1], dB: −20 log₁₀ of their RMSE; infinite for equal pictures.
///
/// Both arrays are `[pixels]`.
///
/// # Panics
/// If they differ in length.
pub fn psnr(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    -20.0 * libm::log10(rmse(test, reference))
}

fn mean(test: &[[f32; 3]], reference: &[[f32; 3]], measure: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(test.len(), reference.len(), "pictures of different size");
    let channels = test.iter().flatten().zip(reference.iter().flatten());
    let sum: f64 = channels.map(|(a, b)| measure(f64::from(*a), f64::from(*b))).sum();
    sum / (3 * test.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_of_known_pictures() {
        let reference = [[0.5; 3], [1.0; 3]];
        let test = [[0.6, 0.5, 0.5], [1.0, 1.0, 0.8]];
        // Squares .01 and .04 over six channels.
        assert!((rmse(&test, &reference) - (0.05f64 / 6.0).sqrt()).abs() < 1e-7);
        // Mean luminance .75: ε = .005625.
        let expected = (0.01 / (0.25 + 0.005625) + 0.04 / (1.0 + 0.005625)) / 6.0;
        assert!((relative_mse(&test, &reference) - expected).abs() < 1e-8);
        assert!((psnr(&test, &reference) - 20.791_8).abs() < 1e-3);
    }

    #[test]
    fn brightness_does_not_change_the_relative_error() {
        let scale = |pixels: [[f32; 3]; 2], s: f32| pixels.map(|p| p.map(|c| c * s));
        let (reference, test) = ([[0.5; 3], [1.0, 0.2, 0.0]], [[0.6; 3], [1.0, 0.3, 0.1]]);
        let [one, other] = [1.0, 1024.0].map(|s| relative_mse(&scale(test, s), &scale(reference, s)));
        assert!((one - other).abs() < 1e-12 * one);
    }

    #[test]
    fn equal_pictures_do_not_differ_and_black_ones_do_not_fail() {
        let (black, grey) = ([[0.0; 3]; 4], [[0.5; 3]; 4]);
        for same in [black, grey] {
            assert_eq!((rmse(&same, &same), relative_mse(&same, &same)), (0.0, 0.0));
            assert_eq!(psnr(&same, &same), f64::INFINITY);
        }
        assert_eq!(relative_mse(&grey, &black), f64::INFINITY);
    }
}
