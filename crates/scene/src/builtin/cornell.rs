//! The Cornell box: the measured geometry and reflectances of the Cornell Program of Computer Graphics.
//!
//! Two things differ from the measurement: the lamp fills its hole in the ceiling instead of hanging below it, and
//! the floor is cut around the boxes, so that no surface is covered. In metres; the light shines along −y.

use glam::DVec3;

use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;

/// The measured spectra under a flat illuminant, as linear Rec. 709.
const WHITE: Rgb = Rgb::new(0.7377445, 0.7361428, 0.7372505);
const RED: Rgb = Rgb::new(0.4717856, 0.0470278, 0.0488661);
const GREEN: Rgb = Rgb::new(0.0876281, 0.3982883, 0.0843277);
/// The lamp: its reflectance and its radiance.
const LAMP: (Rgb, Rgb) = (Rgb::grey(0.78), Rgb::new(17.1984, 11.4732, 3.0576));

/// Height of the ceiling, millimetres.
const HEIGHT: f64 = 548.8;

/// Outlines (x, z) in millimetres, each in the same turning sense.
type Outline = [[f64; 2]; 4];
const FLOOR: Outline = [[0.0, 0.0], [552.8, 0.0], [549.6, 559.2], [0.0, 559.2]];
const CEILING: Outline = [[0.0, 0.0], [556.0, 0.0], [556.0, 559.2], [0.0, 559.2]];
const LAMP_OUTLINE: Outline = [[213.0, 227.0], [343.0, 227.0], [343.0, 332.0], [213.0, 332.0]];
const SHORT_BOX: Outline = [[130.0, 65.0], [290.0, 114.0], [240.0, 272.0], [82.0, 225.0]];
const TALL_BOX: Outline = [[423.0, 247.0], [472.0, 406.0], [314.0, 456.0], [265.0, 296.0]];

/// Delaunay triangulation of the floor without the boxes' footprints, indices into `FLOOR`, `SHORT_BOX`, `TALL_BOX`
/// in a row. A table, because it adds no vertex: walls, boxes and floor share their corners exactly.
const FLOOR_TRIANGLES: [[usize; 3]; 14] = [
    [0, 1, 4],
    [0, 7, 3],
    [0, 4, 7],
    [1, 2, 9],
    [1, 5, 4],
    [1, 8, 5],
    [1, 9, 8],
    [2, 3, 10],
    [2, 10, 9],
    [3, 7, 6],
    [3, 6, 11],
    [3, 11, 10],
    [6, 5, 11],
    [5, 8, 11],
];

/// The Cornell box; `closed` adds a white front wall and puts the camera inside.
///
/// The lamp emits (0.737514, 0.492002, 0.131119) W. Open, light leaves through the front, where the original camera
/// stands, 0.8 m before the box.
pub fn cornell(closed: bool) -> Scene {
    let mut builder = Builder::new(if closed { "cornell-closed" } else { "cornell" });
    let white = builder.matte("white", WHITE);
    let red = builder.matte("red", RED);
    let green = builder.matte("green", GREEN);
    let boxes = builder.matte("box", WHITE);
    let lamp = builder.lamp("lamp", LAMP.0, LAMP.1);

    // Floor and boxes.
    let floor_corners = [FLOOR, SHORT_BOX, TALL_BOX].concat();
    for [a, b, c] in FLOOR_TRIANGLES {
        builder.polygon(white, &[a, c, b].map(|i| at(floor_corners[i], 0.0)));
    }
    for (outline, height) in [(SHORT_BOX, 165.0), (TALL_BOX, 330.0)] {
        builder.polygon(boxes, &[3, 2, 1, 0].map(|i| at(outline[i], height)));
        for i in 0..4 {
            let (a, b) = (outline[i], outline[(i + 1) % 4]);
            builder.polygon(boxes, &[at(b, 0.0), at(a, 0.0), at(a, height), at(b, height)]);
        }
    }

    // Ceiling around the lamp.
    for i in 0..4 {
        let next = (i + 1) % 4;
        let ring = [CEILING[i], CEILING[next], LAMP_OUTLINE[next], LAMP_OUTLINE[i]];
        builder.polygon(white, &ring.map(|p| at(p, HEIGHT)));
    }
    builder.polygon(lamp, &LAMP_OUTLINE.map(|p| at(p, HEIGHT)));

    // Walls: the front, red on the left of the picture (+x), the back, green.
    for (i, material) in [(0, white), (1, red), (2, white), (3, green)] {
        if i > 0 || closed {
            let next = (i + 1) % 4;
            let wall = [at(FLOOR[i], 0.0), at(FLOOR[next], 0.0), at(CEILING[next], HEIGHT), at(CEILING[i], HEIGHT)];
            builder.polygon(material, &wall);
        }
    }

    let (eye_z, vertical_fov_degrees) = if closed { (0.004, 94.0) } else { (-0.8, 39.307_7) };
    let eye = DVec3::new(0.278, 0.273, eye_z);
    let camera = Camera::look_at("main", eye, eye + DVec3::Z, DVec3::Y, vertical_fov_degrees);
    // Enough for soft shadows; more patches would only share the same rays.
    Scene { suggested_patches: Some(40_000), ..builder.finish(vec![Camera { aspect: Some(1.0), ..camera }]) }
}

/// A point of an outline at height `y`, in metres.
fn at([x, z]: [f64; 2], y: f64) -> [f64; 3] {
    [x, y, z].map(|millimetres| millimetres / 1000.0)
}
