//! Small geometry that everyone shares: orthonormal frames and triangle areas.
//!
//! Not here: intersection (the ray kernel), subdivision (`cells`).

use glam::DVec3;

/// An orthonormal frame whose third axis is a surface normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Tangent.
    pub x: DVec3,
    /// Bitangent.
    pub y: DVec3,
    /// Normal.
    pub z: DVec3,
}

impl Frame {
    /// A frame around the unit vector `normal` (Duff et al., "Building an orthonormal basis, revisited",
    /// JCGT 6(1), 2017: no branch that fails near the poles).
    #[inline]
    pub fn from_normal(normal: DVec3) -> Self {
        let sign = 1f64.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            x: DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            y: DVec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            z: normal,
        }
    }

    /// From local to world.
    #[inline]
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// From world to local.
    #[inline]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }
}

/// `(b − a) × (c − a)`: twice the area, along the front side's normal.
#[inline]
pub fn area_vector_2(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{Stream, warp};

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let mut stream = Stream::new(5, 0, 0);
        for _ in 0..1000 {
            let n = warp::uniform_sphere([stream.uniform(), stream.uniform()]);
            let f = Frame::from_normal(n);
            assert!((f.x.cross(f.y) - f.z).length() < 1e-14);
            assert!((f.x.length() - 1.0).abs() < 1e-14);
            assert!((f.to_local(f.to_world(DVec3::new(1.0, 2.0, 3.0))) - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-13);
        }
    }
}
