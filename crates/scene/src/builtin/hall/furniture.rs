//! What stands in the hall. Called by `hall` once.

use super::palette::Palette;
use super::{GALLERY, SOUTH_ROW, about};
use crate::builtin::blocks::{Blocks, OPEN, Skin};
use crate::builtin::mesh::Builder;

/// Benches and trees between the southern columns, a reception desk, a lounge under the gallery.
pub(super) fn furniture(blocks: &mut Blocks, builder: &mut Builder, palette: &Palette) {
    for x in [7.5, 13.5, 19.5] {
        bench(blocks, palette, x, SOUTH_ROW, 0.0);
    }
    bench(blocks, palette, 7.5, 11.3, GALLERY);
    bench(blocks, palette, 13.5, 11.3, GALLERY);

    for (x, z, floor) in [
        (4.5, SOUTH_ROW, palette.inlay),
        (10.5, SOUTH_ROW, palette.inlay),
        (16.5, SOUTH_ROW, palette.inlay),
        (23.2, 4.2, palette.floor),
        (23.2, 7.6, palette.floor),
    ] {
        tree(blocks, builder, palette, x, z, floor);
    }

    // The reception desk: a body on a set-back foot, a counter in front, a lower work top behind.
    blocks.solid([5.3, 7.7], [0.0, 0.1], [6.86, 7.54], palette.metal);
    blocks.solid([5.2, 7.8], [0.1, 1.06], [6.8, 7.0], palette.oak);
    blocks.solid([5.2, 7.8], [0.1, 0.74], [7.0, 7.6], palette.oak);
    blocks.solid([5.14, 7.86], [1.06, 1.12], [6.74, 7.1], palette.column);

    // Two sofas and a low table.
    blocks.solid([3.4, 5.6], [0.0, 0.42], [11.1, 11.9], palette.cushion);
    blocks.solid([3.4, 5.6], [0.42, 0.82], [11.7, 11.9], palette.cushion);
    blocks.solid([1.2, 2.0], [0.0, 0.42], [9.6, 11.2], palette.cushion);
    blocks.solid([1.2, 1.4], [0.42, 0.82], [9.6, 11.2], palette.cushion);
    blocks.solid([3.6, 4.8], [0.30, 0.36], [9.9, 10.6], palette.oak);
    for x in [3.7, 4.64] {
        blocks.solid([x, x + 0.06], [0.0, 0.30], [9.98, 10.52], palette.metal);
    }
}

/// A seat on two blocks of stone.
fn bench(blocks: &mut Blocks, palette: &Palette, x: f64, z: f64, floor: f64) {
    blocks.solid(about(x, 0.9), [floor + 0.38, floor + 0.45], about(z, 0.23), palette.oak);
    for foot in [x - 0.65, x + 0.65] {
        blocks.solid(about(foot, 0.07), [floor, floor + 0.38], about(z, 0.19), palette.stair);
    }
}

/// A small tree in a round pot, its foot cut out of the `floor`.
fn tree(blocks: &mut Blocks, builder: &mut Builder, palette: &Palette, x: f64, z: f64, floor: usize) {
    const SIDES: usize = 8;
    let (radius, half) = (0.24, 0.36);
    blocks.solid(about(x, half), [-1.0, 0.0], about(z, half), Skin::from(floor).top(OPEN));
    builder.collar(floor, [x, 0.0, z], half, radius, SIDES, true);
    let parts: [(usize, &[[f64; 2]]); 4] = [
        (palette.pot, &[[radius, 0.0], [0.33, 0.55], [0.29, 0.55], [0.28, 0.48]]),
        (palette.soil, &[[0.28, 0.48], [0.035, 0.48]]),
        (palette.bark, &[[0.035, 0.48], [0.025, 1.05]]),
        (
            palette.leaves,
            &[[0.025, 1.05], [0.26, 1.10], [0.42, 1.30], [0.44, 1.50], [0.34, 1.75], [0.18, 1.90], [0.0, 1.95]],
        ),
    ];
    for (material, profile) in parts {
        builder.turned(material, x, z, SIDES, profile);
    }
}
