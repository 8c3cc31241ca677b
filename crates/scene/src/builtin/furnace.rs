//! A furnace: a closed room with a box in it, every surface with the same albedo and the same emission.
//!
//! Radiosity is emission / (1 − albedo) everywhere, whatever the geometry: any leak or bias shows.

use std::f64::consts::PI;

use glam::DVec3;

use super::blocks::Blocks;
use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// A room of 3 × 2.4 × 2 m with a box standing in it; all surfaces reflect `albedo` and emit the radiosity
/// `emission` (W·m⁻², radiance `emission`/π).
pub fn furnace(albedo: f64, emission: f64) -> Scene {
    let mut builder = Builder::new("furnace");
    let wall = builder.lamp("wall", Rgb::grey(albedo), Rgb::grey(emission / PI));
    let block = builder.lamp("box", Rgb::grey(albedo), Rgb::grey(emission / PI));

    let mut blocks = Blocks::default();
    blocks.solid([-0.1, 3.1], [-0.1, 2.5], [-0.1, 2.1], wall);
    blocks.air([0.0, 3.0], [0.0, 2.4], [0.0, 2.0]);
    blocks.solid([1.3, 2.1], [0.0, 1.2], [0.5, 1.1], block);
    blocks.emit(&mut builder);

    let (eye, target) = (DVec3::new(0.2, 1.7, 1.8), DVec3::new(1.9, 0.8, 0.7));
    let camera = Camera::look_at("main", eye, target, DVec3::Y, 60.0);
    builder.finish(vec![Camera { aspect: Some(1.0), ..camera }])
}
