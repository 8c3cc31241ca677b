//! Cameras that move because the file says so: tracks of keys for places and turns, along a chain of nodes.
//!
//! Plain data, as precise as it was written: what turns about what turns has no shorter form. Only cameras move; light knows
//! nothing of it. Filled by the readers of `twinray-format`; who wants pictures asks for poses.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::camera::Camera;

/// The motion of one camera.
#[derive(Clone, Debug)]
pub struct CameraAnimation {
    /// Name of the animation.
    pub name: String,
    /// Index into `Scene::cameras`.
    pub camera: usize,
    /// From the world down to the camera: their product is its place.
    pub joints: Vec<Joint>,
}

/// A step from one space to the next.
#[derive(Clone, Debug)]
pub enum Joint {
    /// One that does not change.
    Fixed(DAffine3),
    /// One that moves.
    Moving(MovingJoint),
}

/// A step that moves.
#[derive(Clone, Debug)]
pub struct MovingJoint {
    /// What it is without a track.
    pub rest: DAffine3,
    /// Its scale, before it is turned.
    pub scale: DVec3,
    /// Where it is.
    pub translation: Option<Arc<Track<3>>>,
    /// How it is turned: quaternions x, y, z, w.
    pub rotation: Option<Arc<Track<4>>>,
}

/// Values at times, and what is in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<const N: usize> {
    /// Seconds, strictly increasing, at least one.
    pub times: Vec<f32>,
    /// One a time; of a cubic spline three: the slope before it, the value, the slope after it.
    pub values: Vec<[f32; N]>,
    /// What is in between.
    pub interpolation: Interpolation,
}

/// What is between two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The first.
    Step,
    /// Even motion from one to the other; of rotations on the shorter arc.
    Linear,
    /// A cubic with the slopes that the keys give.
    Cubic,
}

/// A place on a track.
enum At<const N: usize> {
    Key([f64; N]),
    Between([f64; N], [f64; N], f64),
}

impl<const N: usize> Track<N> {
    fn value(&self, i: usize) -> [f64; N] {
        self.values.get(i).map_or([0.0; N], |v| v.map(f64::from))
    }

    fn find(&self, time: f64) -> At<N> {
        let cubic = self.interpolation == Interpolation::Cubic;
        let key = |i: usize| self.value(if cubic { 3 * i + 1 } else { i });
        let after = self.times.partition_point(|&t| f64::from(t) <= time);
        let Some(i) = after.checked_sub(1) else { return At::Key(key(0)) };
        if after == self.times.len() || self.interpolation == Interpolation::Step {
            return At::Key(key(i));
        }
        let (start, end) = (f64::from(self.times[i]), f64::from(self.times[after]));
        let (h, u) = (end - start, (time - start) / (end - start));
        if !cubic {
            return At::Between(key(i), key(after), u);
        }
        // glTF 2.0, appendix C.5: slopes are per second.
        let (uu, uuu) = (u * u, u * u * u);
        let (a, m, n, b) = (key(i), self.value(3 * i + 2), self.value(3 * after), key(after));
        At::Key(std::array::from_fn(|c| {
            (2.0 * uuu - 3.0 * uu + 1.0) * a[c]
                + h * (uuu - 2.0 * uu + u) * m[c]
                + (3.0 * uu - 2.0 * uuu) * b[c]
                + h * (uuu - uu) * n[c]
        }))
    }

    /// First and last time, seconds.
    pub fn span(&self) -> [f64; 2] {
        [self.times.first(), self.times.last()].map(|t| t.copied().map_or(0.0, f64::from))
    }
}

impl Track<3> {
    /// The place at a time; the first before it, the last after it.
    pub fn at(&self, time: f64) -> DVec3 {
        match self.find(time) {
            At::Key(value) => DVec3::from_array(value),
            At::Between(a, b, u) => {
                let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
                a + (b - a) * u
            }
        }
    }
}

impl Track<4> {
    /// The turn at a time, of unit length.
    pub fn at(&self, time: f64) -> DQuat {
        let unit = |q: [f64; 4]| {
            let (q, length) = (DQuat::from_array(q), DQuat::from_array(q).length());
            if length > 0.0 && length.is_finite() { q / length } else { DQuat::IDENTITY }
        };
        match self.find(time) {
            At::Key(value) => unit(value),
            At::Between(a, b, u) => slerp(unit(a), unit(b), u),
        }
    }
}

/// On the shorter arc, at even speed. With `libm`, for the same bits on every platform.
fn slerp(a: DQuat, b: DQuat, u: f64) -> DQuat {
    let dot = a.dot(b);
    let b = if dot < 0.0 { -b } else { b };
    let angle = libm::acos(dot.abs().min(1.0));
    let sine = libm::sin(angle);
    // Of nearly equal turns the arc is the chord.
    let [wa, wb] = match sine > 1e-6 {
        true => [libm::sin((1.0 - u) * angle) / sine, libm::sin(u * angle) / sine],
        false => [1.0 - u, u],
    };
    (a * wa + b * wb).normalize()
}

impl MovingJoint {
    fn at(&self, time: f64) -> DAffine3 {
        let translation = self.translation.as_ref().map_or(self.rest.translation, |t| t.at(time));
        let matrix3 = self.rotation.as_ref().map_or(self.rest.matrix3, |rotation| {
            DMat3::from_quat(rotation.at(time)) * DMat3::from_diagonal(self.scale)
        });
        DAffine3 { matrix3, translation }
    }
}

impl CameraAnimation {
    /// First and last time of its keys, seconds.
    pub fn span(&self) -> [f64; 2] {
        let mut span: Option<[f64; 2]> = None;
        let mut add = |[start, end]: [f64; 2]| {
            span = Some(span.map_or([start, end], |[s, e]| [s.min(start), e.max(end)]));
        };
        for joint in &self.joints {
            let Joint::Moving(joint) = joint else { continue };
            joint.translation.iter().for_each(|track| add(track.span()));
            joint.rotation.iter().for_each(|track| add(track.span()));
        }
        span.unwrap_or([0.0; 2])
    }

    /// The camera at a time: `camera` is it at rest.
    pub fn at(&self, camera: &Camera, time: f64) -> Camera {
        let to_world = self.joints.iter().fold(DAffine3::IDENTITY, |to_world, joint| match joint {
            Joint::Fixed(step) => to_world * *step,
            Joint::Moving(joint) => to_world * joint.at(time),
        });
        let axis = |v: DVec3| (to_world.matrix3 * v).normalize_or_zero();
        Camera { eye: to_world.translation, forward: axis(-DVec3::Z), up: axis(DVec3::Y), ..camera.clone() }
    }

    /// Moves in a world whose lengths are `factor` times as long.
    pub fn scale_lengths(&mut self, factor: f64) {
        self.joints.insert(0, Joint::Fixed(DAffine3::from_scale(DVec3::splat(factor))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn turns(interpolation: Interpolation, values: Vec<[f32; 4]>) -> Track<4> {
        Track { times: vec![1.0, 3.0], values, interpolation }
    }

    #[test]
    fn turns_are_even_and_take_the_shorter_arc() {
        let quarter = DQuat::from_rotation_y(FRAC_PI_2).as_quat().to_array();
        for sign in [1.0, -1.0] {
            let track = turns(Interpolation::Linear, vec![[0.0, 0.0, 0.0, 1.0], quarter.map(|c| sign * c)]);
            for (time, angle) in
                [(0.0, 0.0), (1.0, 0.0), (1.5, PI / 8.0), (2.0, PI / 4.0), (3.0, FRAC_PI_2), (7.0, FRAC_PI_2)]
            {
                let looks = track.at(time) * DVec3::Z;
                let expected = DVec3::new(libm::sin(angle), 0.0, libm::cos(angle));
                assert!((looks - expected).length() < 1e-7, "{time}: {looks}, expected {expected}");
            }
        }
        let still = turns(Interpolation::Linear, vec![quarter, quarter]);
        assert!(((still.at(2.2) * DVec3::Z) - DVec3::X).length() < 1e-7);
        let step = turns(Interpolation::Step, vec![[0.0, 0.0, 0.0, 1.0], quarter]);
        assert_eq!(step.at(2.9), DQuat::IDENTITY);
    }

    /// A cubic that is t³ − t over [−1, 2] is met exactly.
    #[test]
    fn cubics_are_exact() {
        let (cubic, slope) = (|t: f32| t * t * t - t, |t: f32| 3.0 * t * t - 1.0);
        let times = vec![-1.0, 0.5, 2.0];
        let values = times.iter().flat_map(|&t| [[slope(t); 3], [cubic(t); 3], [slope(t); 3]]).collect();
        let track = Track { times, values, interpolation: Interpolation::Cubic };
        for t in [-1.0, -0.3, 0.0, 0.5, 0.9, 1.7, 2.0] {
            let expected = t * t * t - t;
            assert!((track.at(t) - DVec3::splat(expected)).length() < 1e-6, "{t}: {}", track.at(t));
        }
    }

    /// A camera 2 m from a mast that turns: it stands on a circle and looks at the mast.
    #[test]
    fn a_camera_on_a_turning_mast() {
        let turn = |angle: f64| DQuat::from_rotation_y(angle).as_quat().to_array();
        let rotation = Track {
            times: vec![0.0, 1.0],
            values: vec![turn(0.0), turn(FRAC_PI_2)],
            interpolation: Interpolation::Linear,
        };
        let mast = MovingJoint {
            rest: DAffine3::IDENTITY,
            scale: DVec3::ONE,
            translation: None,
            rotation: Some(rotation.into()),
        };
        let arm = Joint::Fixed(DAffine3::from_translation(DVec3::new(0.0, 0.0, 2.0)));
        let mut animation = CameraAnimation { name: "round".into(), camera: 0, joints: vec![Joint::Moving(mast), arm] };
        let rest = Camera::look_at("c", DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, DVec3::Y, 40.0);
        assert_eq!(animation.span(), [0.0, 1.0]);
        for metres in [1.0, 0.01] {
            animation.scale_lengths(metres);
            for t in [0.0, 0.25, 0.6, 1.0] {
                let camera = animation.at(&rest, t);
                let (sine, cosine) = libm::sincos(FRAC_PI_2 * t);
                let out = DVec3::new(sine, 0.0, cosine);
                assert!(
                    (camera.eye - out * 2.0 * metres).length() < 1e-6 && (camera.forward + out).length() < 1e-6,
                    "{t}"
                );
                assert!((camera.up - DVec3::Y).length() < 1e-12 && camera.projection == rest.projection);
            }
        }
    }
}
