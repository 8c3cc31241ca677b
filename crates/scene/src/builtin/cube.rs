//! The unit cube whose floor glows: a closed room with tabulated mean radiosities.

use std::f64::consts::PI;

use glam::DVec3;

use super::blocks::{Blocks, Skin};
use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// The inside of the unit cube; every face reflects `albedo`, the floor (y = 0) emits radiosity 1.
///
/// Mean radiosities at albedo 0.5: floor 1.10433, ceiling 0.17122, each side 0.18111; at 0.8: 1.58740, 0.66099,
/// 0.68790. The six means add up to 1 / (1 − albedo).
pub fn cube(albedo: f64) -> Scene {
    let mut builder = Builder::new("cube");
    let floor = builder.lamp("floor", Rgb::grey(albedo), Rgb::grey(1.0 / PI));
    let ceiling = builder.matte("ceiling", Rgb::grey(albedo));
    let side = builder.matte("side", Rgb::grey(albedo));

    let mut blocks = Blocks::default();
    let outside = [-0.1, 1.1];
    blocks.solid(outside, outside, outside, side);
    blocks.solid(outside, [-0.1, 0.0], outside, Skin::from(side).top(floor));
    blocks.solid(outside, [1.0, 1.1], outside, Skin::from(side).bottom(ceiling));
    blocks.air([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]);
    blocks.emit(&mut builder);

    let (eye, target) = (DVec3::new(0.5, 0.5, 0.98), DVec3::new(0.5, 0.48, 0.0));
    let camera = Camera::look_at("main", eye, target, DVec3::Y, 80.0);
    builder.finish(vec![Camera { aspect: Some(1.0), ..camera }])
}
