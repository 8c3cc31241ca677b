//! The hall's stairs: a flight, its two sloping walls, the landing. Called by `hall` once.

use super::palette::Palette;
use super::{FRONT, GALLERY, HANDRAIL, HANDRAIL_DEPTH, SOFFIT};
use crate::builtin::blocks::{Blocks, OPEN, Skin};
use crate::builtin::mesh::Builder;

/// The stairs: 20 risers along x up to the landing; walls at both sides.
const RISERS: usize = 20;
const RISER: f64 = 0.17;
const TREAD: f64 = 0.29;
pub(super) const LANDING: [f64; 2] = [15.6, 17.2];
const STAIR_START: f64 = LANDING[0] - TREAD * (RISERS - 1) as f64;
const STAIR_WALLS: [[f64; 2]; 2] = [[6.75, 6.85], [8.1, 8.2]];

/// The flight along the gallery's front, its two sloping walls, and the landing that joins it to the gallery.
pub(super) fn stairs(blocks: &mut Blocks, builder: &mut Builder, palette: &Palette) {
    let [outer, inner] = STAIR_WALLS;
    for step in 0..RISERS - 1 {
        let left = STAIR_START + TREAD * step as f64;
        let top = RISER * (step + 1) as f64;
        blocks.solid([left, left + TREAD], [0.0, top], [outer[1], inner[0]], palette.stair);
    }
    for wall in STAIR_WALLS {
        // A newel as high as the sloping wall is at its foot; the wall itself is drawn by hand.
        let newel = [STAIR_START - 0.16, STAIR_START];
        blocks.solid(newel, [0.0, wall_top(0)], [wall[0] - 0.03, wall[1] + 0.03], palette.oak);
        blocks.solid([STAIR_START, LANDING[0]], [0.0, HANDRAIL], wall, OPEN);
        sloping_wall(builder, palette, wall);
    }

    // Landing and its parapets; the last one closes the gap between the inner wall and the gallery.
    let slab = Skin::from(palette.plaster).top(palette.boards);
    blocks.solid(LANDING, [SOFFIT, GALLERY], [outer[0], FRONT[0]], slab);
    let parapets = [
        (LANDING, outer),
        ([LANDING[1] - 0.1, LANDING[1]], [outer[1], FRONT[0]]),
        ([LANDING[0], LANDING[0] + 0.1], [inner[0], FRONT[0]]),
    ];
    for (x, z) in parapets {
        blocks.solid(x, [SOFFIT - 0.1, HANDRAIL - HANDRAIL_DEPTH], z, palette.parapet);
        blocks.solid(x, [HANDRAIL - HANDRAIL_DEPTH, HANDRAIL], z, palette.oak);
    }
    blocks.solid([LANDING[1] - 0.3, LANDING[1]], [0.0, SOFFIT - 0.1], [outer[0], outer[0] + 0.3], palette.column);
}

/// Height of a sloping wall above the front of step `step`.
fn wall_top(step: usize) -> f64 {
    HANDRAIL - GALLERY + RISER * (step + 1) as f64
}

/// A wall beside the stairs whose top, an oak rail, follows the steps; cut at every step, so that no edge meets a
/// slanted one half way, where single precision would leave a gap.
fn sloping_wall(builder: &mut Builder, palette: &Palette, wall: [f64; 2]) {
    let on_outer_side = wall == STAIR_WALLS[0];
    for step in 0..RISERS - 1 {
        let x = [STAIR_START + TREAD * step as f64, STAIR_START + TREAD * (step + 1) as f64];
        let top = [wall_top(step), wall_top(step + 1)];
        let rail = top.map(|y| y - HANDRAIL_DEPTH);
        let tread = RISER * (step + 1) as f64;
        for (z, towards_stairs) in [(wall[0], !on_outer_side), (wall[1], on_outer_side)] {
            let foot = if towards_stairs { tread } else { 0.0 };
            let bands = [(palette.parapet, [foot, foot], rail), (palette.oak, rail, top)];
            for (material, low, high) in bands {
                let mut corners = [[x[0], low[0], z], [x[1], low[1], z], [x[1], high[1], z], [x[0], high[0], z]];
                if z == wall[0] {
                    corners.reverse();
                }
                builder.polygon(material, &corners);
            }
        }
        let ridge = |i: usize, z: f64| [x[i], top[i], z];
        let corners = [ridge(0, wall[0]), ridge(0, wall[1]), ridge(1, wall[1]), ridge(1, wall[0])];
        builder.polygon(palette.oak, &corners);
    }
    // The end under the landing.
    let (x, top) = (LANDING[0], SOFFIT - 0.1);
    let corners = [[x, 0.0, wall[0]], [x, top, wall[0]], [x, top, wall[1]], [x, 0.0, wall[1]]];
    builder.polygon(palette.parapet, &corners);
}
