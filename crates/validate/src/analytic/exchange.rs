//! Form factors: one surface emits radiosity 1, nothing reflects, and irradiance is the factor.

use glam::DVec3;

use crate::case::{Case, Effort, Row};
use crate::factors::{coaxial_discs, opposed_rectangles, perpendicular_rectangles, point_to_polygon};
use crate::rig::{Group, Rectangle, Rig, sensor_params};
use crate::shapes::disc;

/// Mean irradiance of the receiver: F(receiver → emitter).
fn measure(effort: Effort, build: impl Fn(&mut Rig, Group, usize, Group, usize)) -> Vec<f64> {
    let mut rig = Rig::default();
    let (emitter, receiver) = (rig.group(), rig.group());
    let (lamp, black) = (rig.material(0.0, 1.0), rig.material(0.0, 0.0));
    build(&mut rig, emitter, lamp, receiver, black);
    rig.measure(&sensor_params(500), effort.rays(1 << 19))[receiver].to_vec()
}

/// Rectangles and discs.
pub fn form_factors(effort: Effort) -> Case {
    let mut rows = Vec::new();
    // What fraction F of the rays finds the other surface, so noise grows as 1/√F.
    let resolution = |factor: f64| effort.resolution(8e-3 * (0.1 / factor).sqrt().max(1.0));
    for distance in [0.5, 1.0, 2.0, 5.0] {
        let replicas = measure(effort, |rig, emitter, lamp, receiver, black| {
            let square = Rectangle::new([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
            rig.rectangle(emitter, lamp, &square, [1, 1]);
            let above = Rectangle { corner: DVec3::Y * distance, ..square.flipped() };
            rig.rectangle(receiver, black, &above, [4, 4]);
        });
        let expected = opposed_rectangles(1.0, 1.0, distance);
        rows.push(Row::statistical(
            format!("unit squares, opposed, distance {distance}"),
            expected,
            &replicas,
            0.0,
            resolution(expected),
        ));
    }
    let unit = [0.0, 1.0];
    for (name, depth, height, gap) in [
        ("unit squares, perpendicular, common edge", 1.0, 1.0, 0.0),
        ("floor 1 × 1 to wall 2 high, common edge", 1.0, 2.0, 0.0),
        ("floor 2 deep to wall 1 high, common edge", 2.0, 1.0, 0.0),
        ("unit squares, perpendicular, 0.5 from the common line", 1.0, 1.0, 0.5),
        ("unit squares, perpendicular, 2 from the common line", 1.0, 1.0, 2.0),
    ] {
        let replicas = measure(effort, |rig, emitter, lamp, receiver, black| {
            // The floor is y = 0, seen from above; the wall is x = 0, seen from +x.
            let floor = Rectangle::new([gap, 0.0, 0.0], [0.0, 0.0, 1.0], [depth, 0.0, 0.0]);
            let wall = Rectangle::new([0.0; 3], [0.0, height, 0.0], [0.0, 0.0, 1.0]);
            rig.rectangle(emitter, lamp, &wall, [1, 1]);
            rig.rectangle(receiver, black, &floor, [4, 4]);
        });
        let expected = perpendicular_rectangles([gap, gap + depth], unit, [0.0, height], unit);
        rows.push(Row::statistical(name, expected, &replicas, 0.0, resolution(expected)));
    }
    for (from, to, distance) in [(1.0, 1.0, 1.0), (1.0, 2.0, 1.0), (0.5, 1.0, 2.0)] {
        let replicas = measure(effort, |rig, emitter, lamp, receiver, black| {
            let (below, above) = (disc(to, 0.0, 128), disc(from, distance, 128).flipped());
            rig.triangles(emitter, lamp, &below.positions, &below.triangles);
            rig.triangles(receiver, black, &above.positions, &above.triangles);
        });
        let expected = coaxial_discs(from, to, distance);
        // Polygons of 128 sides and equal area: their rims are off by ±(π/128)²/6 = 1e-4 of the radius, to either side.
        rows.push(Row::statistical(
            format!("coaxial discs, radii {from} → {to}, distance {distance}"),
            expected,
            &replicas,
            1e-4 * expected,
            resolution(expected),
        ));
    }
    Case {
        title: "Form factors between surfaces",
        story: "One surface emits radiosity 1, nothing reflects: the mean irradiance of the other is the form factor from it to the \
                emitter. Closed forms of the textbooks, each held against quadrature in a unit test. Discs are polygons of 128 sides \
                and equal area (0.01 % allowed). 2¹⁹ rays, sensor settings."
            .to_owned(),
        quantity: "form factor",
        rows,
    }
}

/// Elements of 2 cm before rectangles; the expectation is the mean of the point formula over the element.
pub fn points(effort: Effort) -> Case {
    let side = 0.02;
    let square = Rectangle::new([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let wall = Rectangle::new([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let up = |x: f64, z: f64| Rectangle::new([x, 0.0, z], [0.0, 0.0, side], [side, 0.0, 0.0]);
    let tilted =
        Rectangle { corner: DVec3::new(0.4, 0.2, 0.4), u: DVec3::Z * side, v: DVec3::new(0.6, 0.8, 0.0) * side };
    let mut rows = Vec::new();
    for (name, lamp, sensor) in [
        ("below the corner of a parallel unit square, distance 1", square, up(0.0, 0.0)),
        ("below the centre of a parallel unit square, distance 1", square, up(0.49, 0.49)),
        ("before a perpendicular unit square, distance 1", wall, up(0.0, 0.0)),
        ("tilted under a unit square", square, tilted),
    ] {
        let replicas = measure(effort, |rig, emitter, glowing, receiver, black| {
            rig.rectangle(emitter, glowing, &lamp, [1, 1]);
            rig.rectangle(receiver, black, &sensor, [4, 4]);
        });
        let expected = sensor.mean(4, |p, n| point_to_polygon(p, n, &lamp.polygon()));
        rows.push(Row::statistical(name, expected, &replicas, 0.0, effort.resolution(6e-3)));
    }
    Case {
        title: "Configuration factors from points",
        story: "Sensors of 2 × 2 cm before a unit square that emits radiosity 1; nothing reflects. Expected is Lambert's contour \
                integral, averaged over the sensor. 2¹⁹ rays, sensor settings."
            .to_owned(),
        quantity: "configuration factor",
        rows,
    }
}
