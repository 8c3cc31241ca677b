//! Where pictures are taken from: a pose, a projection, and the ray of a point on the film.
//!
//! Not here: choosing a camera for a scene that has none (`default_view`), films and pixels (render).

use glam::DVec3;

/// A camera in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name for `--camera NAME`.
    pub name: String,
    /// Position, metres.
    pub eye: DVec3,
    /// Viewing direction, not necessarily of unit length.
    pub forward: DVec3,
    /// Roughly upwards; need not be perpendicular to `forward`.
    pub up: DVec3,
    /// Projection.
    pub projection: Projection,
    /// Width over height that the author had in mind, if any.
    pub aspect: Option<f64>,
}

/// How film points become directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole with a vertical field of view, radians.
    Perspective {
        /// Full vertical angle, radians.
        vertical_fov: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Half of the film's height in the world, metres.
        half_height: f64,
    },
}

impl Camera {
    /// A perspective camera at `eye` looking at `target`.
    pub fn look_at(name: &str, eye: DVec3, target: DVec3, up: DVec3, vertical_fov_degrees: f64) -> Self {
        Self {
            name: name.to_owned(),
            eye,
            forward: target - eye,
            up,
            projection: Projection::Perspective { vertical_fov: vertical_fov_degrees.to_radians() },
            aspect: None,
        }
    }

    /// Right, up and forward unit vectors. A degenerate `up` is replaced by any perpendicular.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = self.forward.normalize_or(-DVec3::Z);
        let right = forward.cross(self.up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        [right, right.cross(forward), forward]
    }

    /// Origin and unit direction of the ray through film point (`x`, `y`), each in [0, 1] from the upper left,
    /// on a film of the given width over height.
    pub fn ray(&self, x: f64, y: f64, aspect: f64) -> (DVec3, DVec3) {
        let [right, up, forward] = self.axes();
        let (sx, sy) = ((2.0 * x - 1.0) * aspect, 1.0 - 2.0 * y);
        match self.projection {
            Projection::Perspective { vertical_fov } => {
                let t = libm::tan(0.5 * vertical_fov);
                (self.eye, (forward + right * (sx * t) + up * (sy * t)).normalize())
            }
            Projection::Orthographic { half_height } => {
                (self.eye + right * (sx * half_height) + up * (sy * half_height), forward)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_film_is_right_way_up() {
        let camera = Camera::look_at("c", DVec3::ZERO, -DVec3::Z, DVec3::Y, 90.0);
        let (_, centre) = camera.ray(0.5, 0.5, 1.0);
        assert!((centre + DVec3::Z).length() < 1e-15);
        let (_, upper_left) = camera.ray(0.0, 0.0, 1.0);
        assert!((upper_left - DVec3::new(-1.0, 1.0, -1.0).normalize()).length() < 1e-15);
    }
}
