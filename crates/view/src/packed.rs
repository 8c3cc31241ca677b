//! Numbers in few bytes, as graphics processors read them.

use glam::DVec3;

/// Bits of a mantissa, and what is added to an exponent.
const MANTISSA: i32 = 9;
const BIAS: i32 = 15;
/// The largest value: 511/512 · 2¹⁶.
pub const LARGEST: f32 = 65_408.0;

/// Three numbers from 0 to [`LARGEST`] with a common exponent, as `RGB9_E5` has them (OpenGL ES 3.0, 3.8.3.2).
pub fn rgb9e5(color: [f32; 3]) -> u32 {
    let [r, g, b] = color.map(|c| if c > 0.0 { c.min(LARGEST) } else { 0.0 });
    let most = r.max(g).max(b);
    if most <= 0.0 {
        return 0;
    }
    // The exponent of the largest, that of subnormal numbers at least; rounding may carry into the next.
    let floor = (most.to_bits() >> 23) as i32 - 127;
    let mut exponent = floor.max(-BIAS - 1) + 1 + BIAS;
    let unit = |exponent: i32| f64::from(exponent - BIAS - MANTISSA).exp2();
    if (f64::from(most) / unit(exponent) + 0.5).floor() >= 512.0 {
        exponent += 1;
    }
    let mantissa = |c: f32| ((f64::from(c) / unit(exponent) + 0.5).floor() as u32).min(511);
    mantissa(r) | mantissa(g) << 9 | mantissa(b) << 18 | (exponent as u32) << 27
}

/// A unit vector in the two numbers of an octahedron, each in [−1, 1] (Meyer et al., "On floating-point normal vectors",
/// EGSR 2010).
pub fn octahedral(d: DVec3) -> [f64; 2] {
    let n = d / (d.x.abs() + d.y.abs() + d.z.abs());
    if n.z >= 0.0 {
        return [n.x, n.y];
    }
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    [(1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y)]
}

/// A number in [−1, 1] in sixteen bits.
pub fn snorm16(x: f64) -> i16 {
    (x.clamp(-1.0, 1.0) * 32767.0).round() as i16
}

/// A number in [−1, 1] in eight bits.
pub fn snorm8(x: f64) -> i8 {
    (x.clamp(-1.0, 1.0) * 127.0).round() as i8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(bits: u32) -> [f64; 3] {
        let unit = f64::from((bits >> 27) as i32 - BIAS - MANTISSA).exp2();
        [0, 9, 18].map(|shift| f64::from(bits >> shift & 511) * unit)
    }

    #[test]
    fn colours_come_back() {
        for color in
            [[1.0, 0.5, 0.25], [65_408.0, 0.0, 1.0], [3e-5, 1e-5, 0.0], [511.5, 511.4, 1.0], [0.999_9, 0.3, 0.7]]
        {
            let found = unpacked(rgb9e5(color));
            let most = color.iter().fold(0.0_f32, |m, c| m.max(*c));
            for (f, c) in found.iter().zip(color) {
                // Half a step of a mantissa of nine bits.
                assert!((f - f64::from(c)).abs() <= f64::from(most) / 511.0 * 1.001, "{color:?}: {found:?}");
            }
        }
        assert_eq!(rgb9e5([0.0; 3]), 0);
        assert_eq!(rgb9e5([-1.0, f32::NAN, 0.0]), 0);
        assert_eq!(unpacked(rgb9e5([f32::INFINITY; 3])), [65_408.0; 3]);
    }

    #[test]
    fn directions_come_back() {
        for d in [DVec3::X, -DVec3::Z, DVec3::new(-0.3, 0.2, -0.9).normalize(), DVec3::new(0.3, -0.8, 0.1).normalize()]
        {
            let [x, y] = octahedral(d);
            let z = 1.0 - x.abs() - y.abs();
            let t = (-z).max(0.0);
            let back = DVec3::new(x - t.copysign(x), y - t.copysign(y), z).normalize();
            assert!(back.distance(d) < 1e-12, "{d}: {back}");
        }
    }
}
