//! A room whose walls are cut as modelling programs cut them when nobody looks: a few large faces, and thousands of tiny
//! ones. Logarithms of areas scatter by 2. It shows what becomes of patches that hardly any ray hits.

use glam::DVec3;

use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;
use crate::rgb::Rgb;
use crate::sample::Stream;

/// Width, height and depth, metres.
const ROOM: [f64; 3] = [4.0, 2.6, 5.0];
/// Cuts of a wall, one after the other: 2^8 rectangles, of two triangles each.
const CUTS: u32 = 8;
/// What a cut leaves on its smaller side. ln(r) is one of two values, half of ln((1 − r)/r) from their mean: with
/// r = 0.196 that is 0.706, and over eight cuts the deviations add up to √8 · 0.706 = 2.0.
const SMALLER_SIDE: f64 = 0.196;

/// A closed room of 4 × 2.6 × 5 m, albedo 0.5, lit by a lamp of 1 × 1 m in its ceiling, or `glowing` by itself like walls
/// that only send on what they got (a furnace, of radiosity 2π everywhere); one patch a triangle, unless a budget cuts further.
pub fn uneven(glowing: bool) -> Scene {
    let mut builder = Builder::new(if glowing { "uneven-glowing" } else { "uneven" });
    let (wall, lamp) = if glowing { (1.0, 1.0) } else { (0.0, 20.0) };
    let [wall, lamp] = [("wall", wall), ("lamp", lamp)].map(|(n, l)| builder.lamp(n, Rgb::grey(0.5), Rgb::grey(l)));
    let mut random = Stream::new(2003, 0, 0);
    let [w, h, d] = ROOM;
    // Origin and sides of every wall; across × up points into the room.
    let walls = [
        ([0.0, 0.0, 0.0], [0.0, 0.0, d], [w, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [w, 0.0, 0.0], [0.0, h, 0.0]),
        ([w, 0.0, d], [-w, 0.0, 0.0], [0.0, h, 0.0]),
        ([0.0, 0.0, d], [0.0, 0.0, -d], [0.0, h, 0.0]),
        ([w, 0.0, 0.0], [0.0, 0.0, d], [0.0, h, 0.0]),
    ];
    for (origin, across, up) in walls {
        let place = [origin, across, up].map(DVec3::from_array);
        cut(&mut builder, wall, place, [0.0, 0.0, 1.0, 1.0], CUTS, &mut random);
    }
    // The ceiling around the lamp, four strips of it.
    let ceiling = [[0.0, h, 0.0], [w, 0.0, 0.0], [0.0, 0.0, d]].map(DVec3::from_array);
    let (x0, x1, z0, z1) = (1.5 / w, 2.5 / w, 2.0 / d, 3.0 / d);
    for strip in [[0.0, 0.0, x0, 1.0], [x1, 0.0, 1.0, 1.0], [x0, 0.0, x1, z0], [x0, z1, x1, 1.0]] {
        cut(&mut builder, wall, ceiling, strip, CUTS - 2, &mut random);
    }
    builder.polygon(lamp, &corners(ceiling, [x0, z0, x1, z1]));

    let camera = Camera::look_at("main", DVec3::new(3.6, 1.6, 4.6), DVec3::new(0.6, 1.0, 0.0), DVec3::Y, 70.0);
    let mut scene = builder.finish(vec![Camera { aspect: Some(4.0 / 3.0), ..camera }]);
    scene.suggested_patches = Some(1);
    scene
}

/// Cuts the rectangle `[x0, y0, x1, y1]` (of a wall's sides) across its longer side, again and again.
fn cut(
    builder: &mut Builder,
    material: usize,
    wall: [DVec3; 3],
    [x0, y0, x1, y1]: [f64; 4],
    cuts: u32,
    random: &mut Stream,
) {
    if cuts == 0 {
        builder.polygon(material, &corners(wall, [x0, y0, x1, y1]));
        return;
    }
    let part = if random.uniform() < 0.5 { SMALLER_SIDE } else { 1.0 - SMALLER_SIDE };
    let [_, across, up] = wall;
    let [first, second] = if across.length() * (x1 - x0) > up.length() * (y1 - y0) {
        let x = x0 + part * (x1 - x0);
        [[x0, y0, x, y1], [x, y0, x1, y1]]
    } else {
        let y = y0 + part * (y1 - y0);
        [[x0, y0, x1, y], [x0, y, x1, y1]]
    };
    cut(builder, material, wall, first, cuts - 1, random);
    cut(builder, material, wall, second, cuts - 1, random);
}

fn corners([origin, across, up]: [DVec3; 3], [x0, y0, x1, y1]: [f64; 4]) -> [[f64; 3]; 4] {
    [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| (origin + across * x + up * y).to_array())
}
