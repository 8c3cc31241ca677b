//! The colour spaces of ꟻLIP: opponent channels for the eye's filter, CIELAB with Hunt's effect for distances.
//!
//! All of them follow from the primaries and the white of Rec. 709, as do the two matrices.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};

/// Achromatic, red–green and blue–yellow: Y C_x C_z, linear in light (LDR, §4.1.1).
pub(super) type Opponent = [f64; 3];

/// Linear Rec. 709 to CIE XYZ: columns are the primaries, scaled so that they add up to the white of D65.
static TO_XYZ: LazyLock<DMat3> = LazyLock::new(|| {
    let xyz = |x: f64, y: f64| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let primaries = DMat3::from_cols(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
    primaries * DMat3::from_diagonal(primaries.inverse() * xyz(0.3127, 0.3290))
});
static FROM_XYZ: LazyLock<DMat3> = LazyLock::new(|| TO_XYZ.inverse());
static WHITE: LazyLock<DVec3> = LazyLock::new(|| *TO_XYZ * DVec3::ONE);

/// Linear Rec. 709 to opponent channels.
pub(super) fn opponent(linear: [f64; 3]) -> Opponent {
    let [x, y, z] = (*TO_XYZ * DVec3::from_array(linear) / *WHITE).to_array();
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Opponent channels to linear Rec. 709.
pub(super) fn linear_from_opponent([y, cx, cz]: Opponent) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let xyz = DVec3::new(y + cx / 500.0, y, y - cz / 200.0) * *WHITE;
    (*FROM_XYZ * xyz).to_array()
}

/// Linear Rec. 709 to L*, and a* and b* scaled by 0.01 L*: dark colours look less colourful (Hunt; LDR, §4.1.2).
pub(super) fn hunt_lab(linear: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = (*TO_XYZ * DVec3::from_array(linear) / *WHITE).to_array().map(lab_curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

fn lab_curve(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { libm::cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// City-block distance of lightness and Euclidean distance of hue and chroma, which suits large differences better
/// than ΔE* does (Abasi, Amani Tehran and Fairchild 2020; LDR, §4.1.3).
pub(super) fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + libm::hypot(a[1] - b[1], a[2] - b[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_agree_with_what_is_known_of_them() {
        let luminance = TO_XYZ.row(1);
        // IEC 61966-2-1 rounds to four digits.
        assert!((luminance - DVec3::new(0.2126, 0.7152, 0.0722)).abs().max_element() < 5e-5);
        assert!((opponent([1.0; 3])[0] - 100.0).abs() < 1e-12);
        assert!(opponent([0.3; 3])[1].abs() + opponent([0.3; 3])[2].abs() < 1e-12);
        let color = [0.1, 0.7, 0.4];
        let back = linear_from_opponent(opponent(color));
        assert!((0..3).all(|c| (back[c] - color[c]).abs() < 1e-12));
        // L* of 18 % grey is 49.5.
        assert!((hunt_lab([0.18; 3])[0] - 49.496).abs() < 1e-3);
    }
}
