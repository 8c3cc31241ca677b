//! Two rooms joined by a door, a lamp in one of them: what reaches the other has come through the door.

use glam::DVec3;

use super::blocks::{Blocks, Skin};
use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// Height of both rooms.
const HEIGHT: f64 = 2.8;
/// Both rooms reach from 0 to this z.
const DEPTH: f64 = 5.0;
/// The lit room, the wall between the rooms, and the dark room along x.
const LIT: [f64; 2] = [0.0, 4.0];
const BETWEEN: [f64; 2] = [4.0, 4.15];
const DARK: [f64; 2] = [4.15, 8.15];
/// The door: its z range and its height.
const DOOR: [f64; 2] = [1.5, 2.4];
const DOOR_HEIGHT: f64 = 2.0;

/// Two rooms of 4 × 5 × 2.8 m with a door of 0.9 × 2.0 m between them; a ceiling lamp of 1.2 × 1.2 m and 2000 nit
/// (9.05 klm) in one, the camera in the other.
pub fn doorway() -> Scene {
    let mut builder = Builder::new("doorway");
    let ceiling = builder.matte("ceiling", Rgb::grey(0.78));
    let cream = builder.matte("cream wall", Rgb::new(0.76, 0.71, 0.60));
    let ochre = builder.matte("ochre wall", Rgb::new(0.68, 0.45, 0.18));
    let blue = builder.matte("blue wall", Rgb::new(0.42, 0.52, 0.62));
    let white = builder.matte("white wall", Rgb::new(0.74, 0.74, 0.72));
    let boards = builder.matte("floorboards", Rgb::new(0.46, 0.31, 0.19));
    let tiles = builder.matte("tiles", Rgb::new(0.48, 0.47, 0.45));
    let frame = builder.matte("door frame", Rgb::new(0.72, 0.70, 0.66));
    let oak = builder.matte("oak", Rgb::new(0.52, 0.36, 0.20));
    let fabric = builder.matte("fabric", Rgb::new(0.55, 0.16, 0.13));
    let lacquer = builder.matte("lacquer", Rgb::new(0.70, 0.70, 0.68));
    // 2000 nit of a warm white of luminance 1.
    let warm = Rgb::new(1.12, 0.99, 0.745_67);
    let lamp = builder.lamp("lamp", Rgb::grey(0.6), warm * (2000.0 / warm.luminance()));

    let mut blocks = Blocks::default();
    let (low, high) = ([-0.2, 0.0], [HEIGHT, HEIGHT + 0.2]);
    let all = [-0.2, DEPTH + 0.2];

    // The rooms' shells: walls, then floor and ceiling, then the air.
    blocks.solid([-0.2, BETWEEN[1]], [-0.2, HEIGHT + 0.2], all, cream);
    blocks.solid([-0.2, LIT[0]], [0.0, HEIGHT], all, ochre);
    blocks.solid([BETWEEN[0], BETWEEN[1]], [0.0, HEIGHT], all, Skin::from(cream).right(blue));
    blocks.solid([BETWEEN[1], DARK[1] + 0.2], [-0.2, HEIGHT + 0.2], all, white);
    blocks.solid([DARK[1], DARK[1] + 0.2], [0.0, HEIGHT], all, blue);
    blocks.solid([-0.2, BETWEEN[0]], low, all, tiles);
    blocks.solid([BETWEEN[0], BETWEEN[1]], low, all, oak);
    blocks.solid([BETWEEN[1], DARK[1] + 0.2], low, all, boards);
    blocks.solid([-0.2, DARK[1] + 0.2], high, all, ceiling);
    blocks.solid([1.4, 2.6], high, [1.9, 3.1], Skin::from(ceiling).bottom(lamp));
    blocks.air(LIT, [0.0, HEIGHT], [0.0, DEPTH]);
    blocks.air(DARK, [0.0, HEIGHT], [0.0, DEPTH]);

    // The door: a frame that stands out by two centimetres on both sides, then the opening.
    let frame_x = [BETWEEN[0] - 0.02, BETWEEN[1] + 0.02];
    blocks.solid(frame_x, [0.0, DOOR_HEIGHT + 0.08], [DOOR[0] - 0.08, DOOR[1] + 0.08], frame);
    blocks.air(frame_x, [0.0, DOOR_HEIGHT], DOOR);

    // The lit room: a table with legs, a cupboard, a stool.
    blocks.solid([0.9, 2.3], [0.70, 0.75], [3.3, 4.2], oak);
    for (x, z) in [(0.95, 3.35), (2.18, 3.35), (0.95, 4.08), (2.18, 4.08)] {
        blocks.solid([x, x + 0.07], [0.0, 0.70], [z, z + 0.07], oak);
    }
    blocks.solid([1.3, 1.7], [0.0, 0.45], [2.65, 3.05], fabric);
    blocks.solid([0.0, 0.55], [0.0, 1.9], [0.4, 1.9], lacquer);

    // The dark room: shelves beside the door, a sofa, a low table before it.
    let shelves = ([4.15, 4.5], [3.2, 4.8]);
    blocks.solid(shelves.0, [0.0, 1.8], shelves.1, lacquer);
    for i in 0..4 {
        let y = 0.06 + 0.435 * f64::from(i);
        blocks.air([4.18, 4.5], [y, y + 0.40], [3.24, 4.76]);
    }
    blocks.solid([4.2, 4.42], [0.06, 0.36], [3.3, 3.75], oak);
    blocks.solid([4.2, 4.44], [0.93, 1.20], [3.9, 4.3], fabric);
    blocks.solid([6.1, 8.0], [0.0, 0.42], [0.1, 0.95], fabric);
    blocks.solid([6.1, 8.0], [0.42, 0.80], [0.1, 0.32], fabric);
    blocks.solid([6.1, 6.29], [0.42, 0.60], [0.32, 0.95], fabric);
    blocks.solid([7.81, 8.0], [0.42, 0.60], [0.32, 0.95], fabric);
    blocks.solid([6.5, 7.5], [0.32, 0.38], [1.4, 2.0], oak);
    for x in [6.58, 7.36] {
        blocks.solid([x, x + 0.06], [0.0, 0.32], [1.45, 1.95], oak);
    }
    blocks.emit(&mut builder);

    let (eye, target) = (DVec3::new(7.9, 1.6, 4.6), DVec3::new(4.6, 0.95, 1.7));
    let camera = Camera::look_at("main", eye, target, DVec3::Y, 56.0);
    // Enough for soft shadows; more patches would only share the same rays.
    Scene { suggested_patches: Some(40_000), ..builder.finish(vec![Camera { aspect: Some(4.0 / 3.0), ..camera }]) }
}
