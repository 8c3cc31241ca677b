//! Two unit squares face to face: one form factor, nothing else.

use std::f64::consts::PI;

use glam::DVec3;

use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// Two directly opposed unit squares `distance` metres apart; the lower one emits radiosity 1, neither reflects.
///
/// The upper one receives as many watts as their form factor: 0.4152532836 at distance 0.5, 0.1998248957 at 1,
/// 0.0685895888 at 2.
pub fn plates(distance: f64) -> Scene {
    let mut builder = Builder::new("plates");
    let emitter = builder.lamp("emitter", Rgb::BLACK, Rgb::grey(1.0 / PI));
    let receiver = builder.matte("receiver", Rgb::BLACK);
    builder.polygon(emitter, &[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
    let top = |x, z| [x, distance, z];
    builder.polygon(receiver, &[top(0.0, 0.0), top(1.0, 0.0), top(1.0, 1.0), top(0.0, 1.0)]);

    // From the side, half way up: both fronts are seen at a slant.
    let centre = DVec3::new(0.5, 0.5 * distance, 0.5);
    let eye = centre + DVec3::new(-0.8, 0.0, 1.4) * (0.55 + 0.5 * distance);
    let camera = Camera::look_at("main", eye, centre, DVec3::Y, 60.0);
    builder.finish(vec![Camera { aspect: Some(1.0), ..camera }])
}
