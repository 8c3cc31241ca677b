//! Cases 5.4 and 5.9: a black room under a uniform sky with an opening in its roof.

use std::f64::consts::PI;

use twinray::solve::{Params, Shares};

use crate::case::{Case, Effort, Row};
use crate::factors::point_to_polygon;
use crate::rig::{Group, Rectangle, Rig, sensor_params};

/// Luminance of the sky, cd/m².
const SKY: f64 = 1000.0;
const WIDTH: f64 = 4.0;
const HEIGHT: f64 = 3.0;
/// Sensors stand so far before floor and walls.
const GAP: f64 = 0.01;

/// Floor, walls and a roof with a square opening of side `a`; the opening is returned.
fn room(rig: &mut Rig, group: Group, material: usize, a: f64) -> Rectangle {
    let (w, h) = (WIDTH + 2.0 * GAP, HEIGHT + GAP);
    let o = [-GAP; 3];
    let far = [WIDTH + GAP, -GAP, -GAP];
    let faces = [
        Rectangle::new(o, [0.0, 0.0, w], [w, 0.0, 0.0]),
        Rectangle::new(o, [0.0, h, 0.0], [0.0, 0.0, w]),
        Rectangle::new(far, [0.0, 0.0, w], [0.0, h, 0.0]),
        Rectangle::new(o, [w, 0.0, 0.0], [0.0, h, 0.0]),
        Rectangle::new([-GAP, -GAP, WIDTH + GAP], [0.0, h, 0.0], [w, 0.0, 0.0]),
    ];
    faces.iter().for_each(|face| rig.rectangle(group, material, face, [1, 1]));
    let roof = Rectangle::new([-GAP, HEIGHT, -GAP], [w, 0.0, 0.0], [0.0, 0.0, w]);
    let share = [0.5 - 0.5 * a / w, 0.5 + 0.5 * a / w];
    let (around, hole) = roof.around(share, share);
    around.iter().for_each(|part| rig.rectangle(group, material, part, [1, 1]));
    hole
}

/// Case 5.4: what enters arrives, all of it.
pub fn flux(effort: Effort) -> Case {
    let mut rows = Vec::new();
    for a in [1.0, 2.0, 3.5] {
        let mut rig = Rig::default();
        let (walls, black) = (rig.group(), rig.material(0.0, 0.0));
        let opening = room(&mut rig, walls, black, a);
        rig.sky(SKY);
        // Without reflection there is nothing that a warm start could know.
        let params = Params { warm_start: 0.0, shares: Some(Shares::even(0.6, 0.3)), ..Params::default_preset(1300) };
        let measured = rig.measure(&params, effort.rays(1 << 20));
        let area = rig.areas()[walls];
        let flux: Vec<f64> = measured[walls].iter().map(|e| e * area).collect();
        let expected = PI * SKY * opening.area();
        let name = format!("opening {a} × {a} m");
        rows.push(Row::statistical(&name, expected, &flux, 0.0, effort.resolution(2.5e-2)));
        // Not a mean over noise: each ray's own books must close.
        let worst = measured.balances().iter().map(|b| b.residual().abs()).fold(0.0, f64::max);
        rows.push(Row::at_most(format!("{name}: share unaccounted for, at most"), 1e-6, worst));
        let lost = measured.balances().iter().map(|b| b.lost_share()).fold(0.0, f64::max);
        rows.push(Row::at_most(format!("{name}: share lost on backs, at most"), 1e-6, lost));
    }
    Case {
        title: "Case 5.4, luminous flux conservation",
        story: "A black room of 4 × 4 × 3 m with an opening in its thin roof under a uniform sky of 1000 cd/m². The flux through the \
                opening is πLA; all of it must arrive on the inner surfaces, with 0 % loss. The other rows \
                ask each solve's own balance: what came in, less what was absorbed, escaped or met a back. 2²⁰ rays, default preset without warm \
                start, gather share 0.6."
            .to_owned(),
        quantity: "flux, lm",
        rows,
    }
}

/// Case 5.9: sky component on floor and wall.
pub fn sky_component(effort: Effort) -> Case {
    let floor = |x: f64, z: f64| Rectangle::new([x, 0.0, z], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0]);
    let wall = |y: f64| Rectangle::new([0.0, y, 1.75], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]);
    let tiles = [
        ("floor, middle", floor(1.75, 1.75)),
        ("floor, corner", floor(0.0, 0.0)),
        ("wall, 0.5 m", wall(0.5)),
        ("wall, 2 m", wall(2.0)),
    ];
    let mut rows = Vec::new();
    for a in [1.0, 4.0] {
        let mut rig = Rig::default();
        let (walls, black) = (rig.group(), rig.material(0.0, 0.0));
        let opening = room(&mut rig, walls, black, a).polygon();
        rig.sky(SKY);
        let groups = tiles.map(|(_, tile)| {
            let group = rig.group();
            rig.rectangle(group, black, &tile, [8, 8]);
            group
        });
        let measured = rig.measure(&sensor_params(1400), effort.rays(1 << 21));
        for ((name, tile), group) in tiles.iter().zip(groups) {
            let expected = PI * SKY * tile.mean(6, |p, n| point_to_polygon(p, n, &opening));
            let name = format!("opening {a} × {a} m: {name}");
            rows.push(Row::statistical(name, expected, &measured[group], 0.0, effort.resolution(2.5e-2)));
        }
    }
    Case {
        title: "Case 5.9, sky component under an unglazed roof opening",
        story: "The room of 5.4 with tiles of 0.5 × 0.5 m on floor and wall. Expected: πL times the contour integral of the opening, \
                averaged over the tile. 2²¹ rays, sensor settings."
            .to_owned(),
        quantity: "illuminance, lx",
        rows,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn factors_of_the_roof_openings() {
        // Sum of four corner factors, by hand.
        for (a, centre, corner) in [(1.0, 0.0341068, 0.0308294), (4.0, 0.3576847, 0.1718214)] {
            let square = Rectangle::new([-0.5 * a, 3.0, -0.5 * a], [a, 0.0, 0.0], [0.0, 0.0, a]).polygon();
            assert!((point_to_polygon(DVec3::ZERO, DVec3::Y, &square) - centre).abs() < 1e-7);
            let below = DVec3::new(0.5 * a, 0.0, 0.5 * a);
            assert!((point_to_polygon(below, DVec3::Y, &square) - corner).abs() < 1e-7);
        }
    }
}
