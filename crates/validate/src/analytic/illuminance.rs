//! Direct illuminance under simple emitters of luminance 1.

use std::f64::consts::PI;

use glam::DVec3;

use crate::case::{Case, Effort, Row};
use crate::factors::point_to_polygon;
use crate::rig::{Rectangle, Rig, sensor_params};
use crate::shapes::{Body, disc, icosphere};

/// Squares, a disc and a sphere over a sensor of 2 cm.
pub fn direct(effort: Effort) -> Case {
    let sensor = Rectangle::new([-0.01, 0.0, -0.01], [0.0, 0.0, 0.02], [0.02, 0.0, 0.0]);
    let mut rows = Vec::new();
    let mut add = |name: String, lamp: Body, expected: f64, model: f64| {
        let mut rig = Rig::default();
        let (emitter, receiver) = (rig.group(), rig.group());
        // Radiance 1 is exitance π.
        let (glowing, black) = (rig.material(0.0, PI), rig.material(0.0, 0.0));
        rig.triangles(emitter, glowing, &lamp.positions, &lamp.triangles);
        // As many patches as the lamp has, so that gather rays start there.
        rig.rectangle(receiver, black, &sensor, [24, 24]);
        let measured = rig.measure(&sensor_params(600), effort.rays(1 << 20));
        let resolution = effort.resolution(6e-3) + model;
        rows.push(Row::statistical(name, expected, &measured[receiver], model * expected, resolution));
    };
    for height in [1.0, 2.0, 3.0] {
        let square = Rectangle::new([-0.5, height, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let lamp = Body { positions: square.polygon(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let expected = PI * sensor.mean(4, |p, n| point_to_polygon(p, n, &square.polygon()));
        add(format!("square 1 × 1 m, height {height} m"), lamp, expected, 0.0);
    }
    // On the axis; a centimetre beside it changes the fifth digit, and a polygon of equal area the sixth.
    add("disc of radius 1 m, height 2 m".to_owned(), disc(1.0, 2.0, 128).flipped(), PI / 5.0, 1e-4);
    let mut ball = icosphere(0.5, 4);
    ball.positions.iter_mut().for_each(|p| *p += DVec3::Y * 2.0);
    // Facets lack 0.12 % of the sphere's surface, hence (its outline likewise) of what is seen of it.
    add("sphere of radius 0.5 m, centre at 2 m".to_owned(), ball, PI * 0.0625, 2.0 * 0.0012);
    Case {
        title: "Direct illuminance",
        story: "A sensor of 2 × 2 cm straight under a Lambertian emitter of luminance 1 cd/m². Closed forms: Lambert's contour \
                integral; πR²/(R²+h²); π(r/d)². The disc is a polygon of 128 sides (0.01 % allowed), the sphere has 5120 facets \
                (0.24 % allowed, twice the surface they lack). 2²⁰ rays, sensor settings."
            .to_owned(),
        quantity: "illuminance, lx",
        rows,
    }
}
