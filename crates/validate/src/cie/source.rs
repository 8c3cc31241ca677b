//! Case 5.3: illuminance from a rectangular Lambertian source.

use std::f64::consts::PI;

use crate::case::{Case, Effort, Row};
use crate::factors::point_to_polygon;
use crate::rig::{Rectangle, Rig, sensor_params};

/// Tiles on the floor and on a wall under a source of 2 × 1 m.
pub fn area_source(effort: Effort) -> Case {
    let source = Rectangle::new([1.0, 3.0, 1.5], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let floor = |x: f64, z: f64| Rectangle::new([x, 0.0, z], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0]);
    let wall = |y: f64, z: f64| Rectangle::new([0.0, y, z], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]);
    let tiles = [
        ("floor, under the middle", floor(1.75, 1.75)),
        ("floor, under a corner", floor(0.75, 1.25)),
        ("floor, corner of the room", floor(0.0, 0.0)),
        ("wall, 0.5 m above the floor", wall(0.5, 1.75)),
        ("wall, 1.5 m", wall(1.5, 1.75)),
        ("wall, 2.5 m, corner of the room", wall(2.5, 0.0)),
    ];
    let mut rig = Rig::default();
    let (emitter, glowing, black) = (rig.group(), rig.material(0.0, 1000.0 * PI), rig.material(0.0, 0.0));
    rig.rectangle(emitter, glowing, &source, [1, 1]);
    let groups = tiles.map(|(_, tile)| {
        let group = rig.group();
        rig.rectangle(group, black, &tile, [4, 4]);
        group
    });
    let measured = rig.measure(&sensor_params(1000), effort.rays(1 << 21));
    let rows = tiles.iter().zip(groups).map(|((name, tile), group)| {
        let expected = 1000.0 * PI * tile.mean(6, |p, n| point_to_polygon(p, n, &source.polygon()));
        Row::statistical(*name, expected, &measured[group], 0.0, effort.resolution(3e-2))
    });
    Case {
        title: "Case 5.3, area source",
        story: "A Lambertian source of 2 × 1 m and 1000 cd/m² in the ceiling, 3 m above the floor; black tiles of 0.5 × 0.5 m on the \
                floor and on a wall. Expected: the contour integral (sum of corner factors), averaged over each tile. 2²¹ rays, \
                sensor settings."
            .to_owned(),
        quantity: "illuminance, lx",
        rows: rows.collect(),
    }
}
