//! A camera that moves through keys: smooth, and never beyond what its keys say.
//!
//! Places follow centripetal Catmull-Rom curves (E. Catmull, R. Rom, "A class of local interpolating splines", 1974; that the
//! centripetal ones have neither cusps nor loops: C. Yuksel, S. Schaefer, J. Keyser, "On the parameterization of
//! Catmull-Rom curves", SPM 2009). Such a curve has a shape but no clock, and one that is simply stretched over the time between two keys
//! changes its speed with a jerk at each of them: here the length of the way is a monotone cubic of the time (F. N. Fritsch,
//! J. Butland, "A method for constructing local monotone piecewise cubic interpolants", SIAM J. Sci. Stat. Comput. 5, 1984).
//! Directions, angles and distances are such cubics themselves. Not here: how keys are written down, which times are pictures.

use glam::DVec3;

use crate::camera::{Camera, Projection};

/// Where a camera is at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraKey {
    /// Seconds.
    pub time: f64,
    /// The camera.
    pub camera: Camera,
    /// The point it looks at, if that is known, world space.
    pub target: Option<DVec3>,
    /// Distance that is sharp where there is a lens, metres, if that is known.
    pub focus: Option<f64>,
}

/// The way of a camera.
#[derive(Clone, Debug)]
pub struct CameraPath {
    keys: Vec<CameraKey>,
    linear: bool,
    eyes: Curve,
    /// Where all keys have a target, it moves by a curve of its own, so that one that stays is looked at all the time.
    targets: Option<Curve>,
}

/// Chords that stand for a curve between two keys when its length is told: enough that speeds look even.
const PIECES: usize = 64;

impl CameraPath {
    /// The way through `keys`, whose times increase; straight from key to key if it is `linear`.
    ///
    /// # Panics
    /// Without a key.
    pub fn new(keys: Vec<CameraKey>, linear: bool) -> Self {
        assert!(!keys.is_empty(), "a path needs a key");
        let eyes = Curve::new(keys.iter().map(|k| k.camera.eye).collect(), linear);
        let targets: Option<Vec<DVec3>> = keys.iter().map(|k| k.target).collect();
        let targets = targets.map(|points| Curve::new(points, linear));
        Self { keys, linear, eyes, targets }
    }

    /// The keys.
    pub fn keys(&self) -> &[CameraKey] {
        &self.keys
    }

    /// The camera at a time: exactly a key at its time, the first key before it and the last one after it.
    pub fn at(&self, time: f64) -> CameraKey {
        let after = self.keys.partition_point(|k| k.time <= time);
        let Some(i) = after.checked_sub(1) else { return CameraKey { time, ..self.keys[0].clone() } };
        let key = &self.keys[i];
        if key.time == time || after == self.keys.len() {
            return CameraKey { time, ..key.clone() };
        }
        let number = |value: &dyn Fn(usize) -> f64| self.number(i, time, value);
        let vector = |value: &dyn Fn(usize) -> DVec3| {
            DVec3::new(number(&|k| value(k).x), number(&|k| value(k).y), number(&|k| value(k).z))
        };
        let along = |curve: &Curve| curve.at(i, number(&|k| curve.lengths[k]));
        let eye = along(&self.eyes);
        let target = self.targets.as_ref().map(along);
        let forward = match target {
            Some(target) => target - eye,
            None => vector(&|k| self.keys[k].camera.forward.normalize_or_zero()),
        };
        let up = vector(&|k| self.keys[k].camera.up.normalize_or_zero());
        let projection = match (key.camera.projection, self.keys[after].camera.projection) {
            (Projection::Perspective { .. }, Projection::Perspective { .. }) => {
                Projection::Perspective { vertical_fov: number(&|k| extent(&self.keys[k].camera)) }
            }
            (Projection::Orthographic { .. }, Projection::Orthographic { .. }) => {
                Projection::Orthographic { half_height: number(&|k| extent(&self.keys[k].camera)) }
            }
            (before, _) => before,
        };
        let has_focus = self.keys.iter().all(|k| k.focus.is_some());
        let focus = has_focus.then(|| number(&|k| self.keys[k].focus.unwrap_or_default()));
        CameraKey { time, camera: Camera { eye, forward, up, projection, ..key.camera.clone() }, target, focus }
    }

    /// A number of the keys at a time between key `i` and the next.
    fn number(&self, i: usize, time: f64, value: &dyn Fn(usize) -> f64) -> f64 {
        let step = |k: usize| self.keys[k + 1].time - self.keys[k].time;
        let slope = |k: usize| (value(k + 1) - value(k)) / step(k);
        let (h, u) = (step(i), (time - self.keys[i].time) / step(i));
        if self.linear {
            return value(i) + (value(i + 1) - value(i)) * u;
        }
        // At the ends as fast as in the middle of what follows.
        let speed = |k: usize| match (k.checked_sub(1), k + 1 < self.keys.len()) {
            (Some(before), true) => mean_slope([step(before), step(k)], [slope(before), slope(k)]),
            (Some(before), false) => slope(before),
            (None, _) => slope(k),
        };
        hermite(u, value(i), h * speed(i), h * speed(i + 1), value(i + 1))
    }
}

/// The number of a projection: an angle in radians, or metres.
fn extent(camera: &Camera) -> f64 {
    match camera.projection {
        Projection::Perspective { vertical_fov } => vertical_fov,
        Projection::Orthographic { half_height } => half_height,
        Projection::Fisheye { angle } => angle,
        Projection::Panorama => 0.0,
    }
}

/// Slope between two steps of lengths `h` and slopes `d` that lets neither overshoot: a weighted harmonic mean, and 0 at a turn.
fn mean_slope(h: [f64; 2], d: [f64; 2]) -> f64 {
    if d[0] * d[1] <= 0.0 {
        return 0.0;
    }
    let w = [2.0 * h[1] + h[0], h[1] + 2.0 * h[0]];
    (w[0] + w[1]) / (w[0] / d[0] + w[1] / d[1])
}

/// The cubic from `a` to `b` over [0, 1] with slopes `m` and `n` at its ends.
fn hermite<T>(u: f64, a: T, m: T, n: T, b: T) -> T
where
    T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
{
    let (uu, uuu) = (u * u, u * u * u);
    a * (2.0 * uuu - 3.0 * uu + 1.0) + m * (uuu - 2.0 * uu + u) + n * (uuu - uu) + b * (3.0 * uu - 2.0 * uuu)
}

/// A curve through points, by the length of the way.
#[derive(Clone, Debug)]
struct Curve {
    points: Vec<DVec3>,
    linear: bool,
    /// Of the way from the first point to each.
    lengths: Vec<f64>,
}

impl Curve {
    fn new(points: Vec<DVec3>, linear: bool) -> Self {
        let mut curve = Self { points, linear, lengths: vec![0.0] };
        for i in 1..curve.points.len() {
            let length = curve.walk(i - 1, f64::INFINITY).1;
            curve.lengths.push(curve.lengths[i - 1] + length);
        }
        curve
    }

    /// The point between point `i` and the next that is so far from the first, along the way.
    fn at(&self, i: usize, length: f64) -> DVec3 {
        self.walk(i, length - self.lengths[i]).0
    }

    /// Walks so far from point `i`, at most to the next; and how far that was.
    fn walk(&self, i: usize, length: f64) -> (DVec3, f64) {
        let pieces = if self.linear { 1 } else { PIECES };
        let tangents = self.tangents(i);
        let (mut place, mut walked) = (self.points[i], 0.0);
        for k in 1..=pieces {
            let next = self.between(i, tangents, k as f64 / pieces as f64);
            let piece = (next - place).length();
            if walked + piece > length {
                // A chord is a little shorter than its arc: from the curve's own point, or the way would have corners.
                let u = (k as f64 - 1.0 + (length - walked).max(0.0) / piece) / pieces as f64;
                return (self.between(i, tangents, u), length);
            }
            (place, walked) = (next, walked + piece);
        }
        (place, walked)
    }

    fn between(&self, i: usize, [m, n]: [DVec3; 2], u: f64) -> DVec3 {
        let (a, b) = (self.points[i], self.points[i + 1]);
        if self.linear { a + (b - a) * u } else { hermite(u, a, m, n, b) }
    }

    /// Tangents at point `i` and at the next for the piece in between, whose parameter runs over [0, 1].
    fn tangents(&self, i: usize) -> [DVec3; 2] {
        let (a, b) = (self.points[i], self.points[i + 1]);
        let along = b - a;
        let d = knot(along);
        // At an end, and beside a rest, the curve starts straight ahead.
        let outer = |from: Option<DVec3>, to: Option<DVec3>| {
            let step = match (from, to) {
                (Some(p), _) => a - p,
                (_, Some(p)) => p - b,
                (None, None) => return along,
            };
            let e = knot(step);
            if e == 0.0 || d == 0.0 {
                return along;
            }
            // d/du at the shared point of the parabola through three points whose knots are d and e apart.
            (step / e - (step + along) / (d + e) + along / d) * d
        };
        let before = i.checked_sub(1).map(|k| self.points[k]);
        let after = self.points.get(i + 2).copied();
        [outer(before, None), outer(None, after)]
    }
}

/// How far the knots of a step are apart: the root of its length, which is what is centripetal.
fn knot(step: DVec3) -> f64 {
    step.length().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f64, eye: [f64; 3], target: [f64; 3], fov: f64) -> CameraKey {
        let (eye, target) = (DVec3::from_array(eye), DVec3::from_array(target));
        let camera = Camera::look_at("k", eye, target, DVec3::Y, fov);
        CameraKey { time, camera, target: Some(target), focus: Some(fov) }
    }

    fn corner(linear: bool) -> CameraPath {
        let keys = [
            key(0.0, [0.0, 0.0, 0.0], [0.0, 0.0, -5.0], 40.0),
            key(1.0, [4.0, 0.0, 0.0], [0.0, 0.0, -5.0], 50.0),
            key(1.5, [4.0, 0.0, 1.0], [0.0, 0.0, -5.0], 50.0),
            key(4.0, [4.0, 3.0, 9.0], [0.0, 0.0, -5.0], 30.0),
        ];
        CameraPath::new(keys.into(), linear)
    }

    #[test]
    fn keys_are_met_exactly_and_nothing_is_beyond_the_ends() {
        for path in [corner(false), corner(true)] {
            for key in path.keys() {
                assert_eq!(path.at(key.time), *key);
            }
            assert_eq!(path.at(-3.0).camera, path.keys()[0].camera);
            assert_eq!(path.at(9.0).camera, path.keys()[3].camera);
        }
        let alone = CameraPath::new(vec![key(2.0, [1.0, 0.0, 0.0], [0.0; 3], 40.0)], false);
        assert!([0.0, 2.0, 5.0].iter().all(|&t| alone.at(t).camera == alone.keys()[0].camera));
    }

    #[test]
    fn linear_is_linear() {
        let path = corner(true);
        let half = path.at(0.5);
        assert_eq!(half.camera.eye, DVec3::new(2.0, 0.0, 0.0));
        assert_eq!(half.camera.forward, DVec3::new(-2.0, 0.0, -5.0));
        assert!((extent(&half.camera).to_degrees() - 45.0).abs() < 1e-12 && (half.focus.unwrap() - 45.0).abs() < 1e-12);
    }

    /// What stays is looked at all the time, angles stay between those of their keys, and the eye between its first and last.
    #[test]
    fn nothing_overshoots() {
        let path = corner(false);
        for i in 0..=400 {
            let at = path.at(f64::from(i) * 0.01);
            let target = at.camera.eye + at.camera.forward;
            assert!((target - DVec3::new(0.0, 0.0, -5.0)).length() < 1e-12, "{target}");
            let segment = path.keys().partition_point(|k| k.time <= at.time).min(3);
            let (a, b) = (extent(&path.keys()[segment - 1].camera), extent(&path.keys()[segment].camera));
            let fov = extent(&at.camera);
            assert!(fov >= a.min(b) - 1e-12 && fov <= a.max(b) + 1e-12, "{} at {}", fov.to_degrees(), at.time);
            let eye = at.camera.eye;
            // A bend may go a little wide, as a car does, but not before the first and not beyond the last key.
            assert!(
                eye.x >= 0.0 && eye.x < 4.5 && eye.z > -0.5 && eye.z <= 9.0 + 1e-12 && eye.y <= 3.0 + 1e-12,
                "{eye}"
            );
        }
    }

    /// Neither the place nor its velocity jumps, though steps are of very different length and duration.
    #[test]
    fn motion_has_no_jerks() {
        let path = corner(false);
        let h = 1e-4;
        let velocity = |t: f64| (path.at(t + h).camera.eye - path.at(t).camera.eye) / h;
        for key in &path.keys()[1..3] {
            let (before, after) = (velocity(key.time - 2.0 * h), velocity(key.time + h));
            assert!((before - after).length() < 0.05 * before.length(), "{before} and {after} at {}", key.time);
        }
        // Along a straight line in even steps the speed is even.
        let even = (0..4).map(|i| key(f64::from(i), [3.0 * f64::from(i), 0.0, 0.0], [0.0, 0.0, -1.0], 40.0)).collect();
        let even = CameraPath::new(even, false);
        for i in 0..=30 {
            let t = f64::from(i) * 0.1;
            assert!((even.at(t).camera.eye - DVec3::new(3.0 * t, 0.0, 0.0)).length() < 1e-9, "at {t}");
        }
    }

    #[test]
    fn a_camera_may_rest() {
        let still = [1.0, 2.0, 3.0];
        let keys = vec![
            key(0.0, [0.0; 3], [0.0, 0.0, -1.0], 40.0),
            key(1.0, still, [0.0, 0.0, -1.0], 40.0),
            key(2.0, still, [1.0, 0.0, -1.0], 40.0),
            key(3.0, [9.0, 0.0, 0.0], [1.0, 0.0, -1.0], 40.0),
        ];
        let path = CameraPath::new(keys, false);
        assert!((0..=10).all(|i| path.at(1.0 + 0.1 * f64::from(i)).camera.eye == DVec3::from_array(still)));
        assert!((0..=30).all(|i| path.at(0.1 * f64::from(i)).camera.eye.is_finite()));
    }

    /// Without targets directions turn evenly.
    #[test]
    fn directions_turn() {
        let mut keys =
            vec![key(0.0, [0.0; 3], [0.0, 0.0, -7.0], 40.0), key(1.0, [1.0, 0.0, 0.0], [3.0, 0.0, 0.0], 40.0)];
        keys.iter_mut().for_each(|k| k.target = None);
        let path = CameraPath::new(keys, false);
        let half = path.at(0.5).camera.axes()[2];
        assert!((half - DVec3::new(1.0, 0.0, -1.0).normalize()).length() < 1e-12, "{half}");
    }
}
