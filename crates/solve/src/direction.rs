//! Directions in four bytes: octahedral coordinates of 16 bits each (Cigolle et al., "A survey of efficient
//! representations for independent unit vectors", JCGT 3(2), 2014). Wrong by less than √18/65535 rad (half a step in
//! x and y, both in z, on a vector that may be √3 too short), far below the width of any lobe that lives on patches.

use glam::DVec3;

const STEPS: f64 = 65_535.0;

/// The code of a unit vector.
#[inline]
pub(crate) fn pack(v: DVec3) -> u32 {
    let sum = v.x.abs() + v.y.abs() + v.z.abs();
    let (mut x, mut y) = (v.x / sum, v.y / sum);
    if v.z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    let code = |c: f64| ((0.5 * c + 0.5) * STEPS + 0.5) as u32;
    code(x) << 16 | code(y)
}

/// The unit vector of a code.
#[inline]
pub(crate) fn unpack(code: u32) -> DVec3 {
    let coordinate = |c: u32| f64::from(c) * (2.0 / STEPS) - 1.0;
    let (mut x, mut y) = (coordinate(code >> 16), coordinate(code & 0xffff));
    let z = 1.0 - x.abs() - y.abs();
    if z < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    DVec3::new(x, y, z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::{Stream, warp};

    #[test]
    fn directions_come_back() {
        let mut stream = Stream::new(8, 0, 0);
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|a| [a, -a]);
        let random = (0..100_000).map(|_| warp::uniform_sphere([stream.uniform(), stream.uniform()]));
        for v in axes.chain(random) {
            let back = unpack(pack(v));
            assert!((back - v).length() < 18f64.sqrt() / STEPS, "{v} came back as {back}");
        }
    }
}
