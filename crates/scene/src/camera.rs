//! Where pictures are taken from: a pose, a projection, and the ray of a point on the film.
//!
//! Not here: choosing a camera for a scene that has none (`complete`), films and pixels (render).

use std::f64::consts::PI;

use glam::DVec3;

use crate::sample::warp;

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
    /// What blurs whatever is out of focus; `None`, and every projection but the perspective one, has a pinhole.
    pub lens: Option<Lens>,
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
    /// All directions, equirectangular: longitude runs along the film, 360° with `forward` in the middle, and latitude
    /// down it, 180° from `up` on. A film twice as wide as high has square pixels.
    Panorama,
    /// Equidistant fisheye: the angle to `forward` grows with the distance from the middle of the film. The picture is the
    /// largest circle on the film; nothing is seen outside it.
    Fisheye {
        /// Full angle across the circle, radians; up to 2π.
        angle: f64,
    },
}

/// A thin lens: what lies in the plane of focus is sharp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, metres.
    pub radius: f64,
    /// Distance of the plane of focus along `forward`, metres.
    pub focus: f64,
}

/// Height of the film of a full-frame camera, metres (ISO 1007: 36 mm × 24 mm).
const FULL_FRAME_HEIGHT: f64 = 0.024;

impl Lens {
    /// The lens of a full-frame camera that has this vertical field of view (radians) and f-number: its aperture is the
    /// focal length over twice the f-number.
    pub fn full_frame(vertical_fov: f64, f_number: f64, focus: f64) -> Self {
        let focal_length = 0.5 * FULL_FRAME_HEIGHT / libm::tan(0.5 * vertical_fov);
        Self { radius: 0.5 * focal_length / f_number, focus }
    }
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
            lens: None,
            aspect: None,
        }
    }

    /// Right, up and forward unit vectors. A degenerate `up` is replaced by any perpendicular.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = self.forward.normalize_or(-DVec3::Z);
        let right = forward.cross(self.up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        [right, right.cross(forward), forward]
    }

    /// The same place and heading, with level horizon: `up` is upright, and `forward` its part across it. Panoramas are
    /// expected so, whatever the camera looked at.
    pub fn levelled(&self, up: DVec3) -> Self {
        let up = up.normalize_or(DVec3::Y);
        let along = self.forward.reject_from_normalized(up);
        let down = self.forward.length();
        // Straight up or down there is no heading; the upper edge of the picture gives one.
        let heading = if along.length() > 1e-9 * down { along } else { self.axes()[1].reject_from_normalized(up) };
        Self { forward: heading.try_normalize().unwrap_or_else(|| up.any_orthonormal_vector()), up, ..self.clone() }
    }

    /// Origin and unit direction of the ray through film point (`x`, `y`), each in [0, 1] from the upper left and a
    /// little beyond, on a film of the given width over height, and through point `lens` of the aperture: a point of the
    /// unit square, which is spread evenly over the disc, (0, 0) in its middle. `None` outside a fisheye's circle, where
    /// the film is black.
    pub fn ray(&self, x: f64, y: f64, aspect: f64, lens: [f64; 2]) -> Option<(DVec3, DVec3)> {
        let [right, up, forward] = self.axes();
        let (sx, sy) = ((2.0 * x - 1.0) * aspect, 1.0 - 2.0 * y);
        let ray = match self.projection {
            Projection::Perspective { vertical_fov } => {
                let t = libm::tan(0.5 * vertical_fov);
                // To the plane of focus at distance 1.
                let direction = forward + right * (sx * t) + up * (sy * t);
                match self.lens {
                    None => (self.eye, direction.normalize()),
                    Some(Lens { radius, focus }) => {
                        let [lx, ly] = warp::uniform_disc(lens);
                        let offset = (right * lx + up * ly) * radius;
                        (self.eye + offset, (direction * focus - offset).normalize())
                    }
                }
            }
            Projection::Orthographic { half_height } => {
                (self.eye + right * (sx * half_height) + up * (sy * half_height), forward)
            }
            Projection::Panorama => {
                let (longitude, latitude) = ((2.0 * x - 1.0) * PI, (0.5 - y) * PI);
                let along = forward * libm::cos(longitude) + right * libm::sin(longitude);
                (self.eye, (along * libm::cos(latitude) + up * libm::sin(latitude)).normalize())
            }
            Projection::Fisheye { angle } => {
                let half_circle = aspect.min(1.0);
                let (sx, sy) = (sx / half_circle, sy / half_circle);
                let r = libm::hypot(sx, sy);
                if r > 1.0 {
                    return None;
                }
                let theta = 0.5 * angle * r;
                let across = if r > 0.0 { (right * sx + up * sy) / r } else { DVec3::ZERO };
                (self.eye, (forward * libm::cos(theta) + across * libm::sin(theta)).normalize())
            }
        };
        Some(ray)
    }

    /// How deep a point of the world lies: along `forward` before the eye, as compositing programs expect; for panoramas
    /// and fisheyes, which have no plane of film, the distance from the eye.
    pub fn depth(&self, point: DVec3) -> f64 {
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => (point - self.eye).dot(self.axes()[2]),
            Projection::Panorama | Projection::Fisheye { .. } => (point - self.eye).length(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIDDLE: [f64; 2] = [0.0; 2];

    fn looking_along_z(projection: Projection) -> Camera {
        Camera { projection, ..Camera::look_at("c", DVec3::ZERO, -DVec3::Z, DVec3::Y, 90.0) }
    }

    #[track_caller]
    fn sees(camera: &Camera, [x, y, aspect]: [f64; 3], expected: DVec3) {
        let (_, direction) = camera.ray(x, y, aspect, MIDDLE).expect("a ray");
        let difference = (direction - expected.normalize()).length();
        assert!(difference < 1e-14, "({x}, {y}): {direction}, expected {expected}");
    }

    #[test]
    fn the_film_is_right_way_up() {
        let camera = Camera::look_at("c", DVec3::ZERO, -DVec3::Z, DVec3::Y, 90.0);
        sees(&camera, [0.5, 0.5, 1.0], -DVec3::Z);
        sees(&camera, [0.0, 0.0, 1.0], DVec3::new(-1.0, 1.0, -1.0));
    }

    #[test]
    fn panoramas_see_all_around() {
        let camera = looking_along_z(Projection::Panorama);
        sees(&camera, [0.5, 0.5, 2.0], -DVec3::Z);
        sees(&camera, [0.75, 0.5, 2.0], DVec3::X);
        sees(&camera, [0.25, 0.5, 2.0], -DVec3::X);
        sees(&camera, [0.0, 0.5, 2.0], DVec3::Z);
        sees(&camera, [0.3, 0.0, 2.0], DVec3::Y);
        sees(&camera, [0.5, 0.75, 2.0], DVec3::new(0.0, -1.0, -1.0));
        // The samples of the outermost pixels lie a little beside the film: there is the other side.
        let past = camera.ray(1.01, 0.5, 2.0, MIDDLE).unwrap().1;
        assert!((past - camera.ray(0.01, 0.5, 2.0, MIDDLE).unwrap().1).length() < 1e-14);
    }

    #[test]
    fn a_fisheye_measures_angles() {
        let camera = looking_along_z(Projection::Fisheye { angle: PI });
        sees(&camera, [0.5, 0.5, 1.0], -DVec3::Z);
        sees(&camera, [1.0, 0.5, 1.0], DVec3::X);
        sees(&camera, [0.5, 0.25, 1.0], DVec3::new(0.0, 1.0, -1.0));
        assert_eq!(camera.ray(0.1, 0.1, 1.0, MIDDLE), None);
        // The circle is as high as a wide film and as wide as a high one.
        sees(&camera, [0.75, 0.5, 2.0], DVec3::X);
        assert_eq!(camera.ray(0.76, 0.5, 2.0, MIDDLE), None);
        sees(&camera, [0.5, 0.25, 0.5], DVec3::Y);
        assert_eq!(camera.ray(0.5, 0.24, 0.5, MIDDLE), None);
    }

    #[test]
    fn all_of_a_lens_sees_the_same_point_in_focus() {
        let pinhole = Camera::look_at("c", DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 1.5, 0.0), DVec3::Y, 60.0);
        let lens = Lens { radius: 0.1, focus: 2.5 };
        let camera = Camera { lens: Some(lens), ..pinhole.clone() };
        let forward = camera.axes()[2];
        for (x, y) in [(0.5, 0.5), (0.1, 0.8), (1.0, 0.0)] {
            let (eye, direction) = pinhole.ray(x, y, 1.5, MIDDLE).unwrap();
            let point = eye + direction * (lens.focus / direction.dot(forward));
            for u in [MIDDLE, [0.5, 0.3], [1.0, 0.9]] {
                let (origin, direction) = camera.ray(x, y, 1.5, u).unwrap();
                let from_eye = origin - eye;
                assert!(from_eye.length() <= lens.radius * (1.0 + 1e-12) && from_eye.dot(forward).abs() < 1e-12);
                assert!((point - origin).cross(direction).length() < 1e-12, "{u:?} misses");
            }
        }
        assert!((camera.depth(pinhole.eye + forward * 2.5 + camera.axes()[0]) - 2.5).abs() < 1e-12);
    }

    /// A 50 mm lens sees 26.99° of 24 mm; at f/2 its aperture is 25 mm wide.
    #[test]
    fn f_numbers_are_those_of_full_frame() {
        let lens = Lens::full_frame(26.991_f64.to_radians(), 2.0, 3.0);
        assert!((lens.radius - 0.0125).abs() < 1e-6, "{}", lens.radius);
    }

    #[test]
    fn levelled_cameras_have_level_horizons() {
        let camera = Camera::look_at("c", DVec3::ZERO, DVec3::new(1.0, -2.0, 0.0), DVec3::new(0.2, 1.0, 0.5), 50.0);
        let level = camera.levelled(DVec3::Y);
        assert!((level.axes()[1] - DVec3::Y).length() < 1e-15 && (level.axes()[2] - DVec3::X).length() < 1e-15);
        let down = Camera::look_at("c", DVec3::ZERO, -DVec3::Y, DVec3::Z, 50.0).levelled(DVec3::Y);
        assert!((down.axes()[2] - DVec3::Z).length() < 1e-15, "the upper edge of the picture is ahead");
    }
}
