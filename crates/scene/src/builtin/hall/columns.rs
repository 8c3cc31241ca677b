//! The hall's two rows of columns. Called by `hall` once.

use super::palette::Palette;
use super::{BEAM, GALLERY, NORTH_ROW, PARAPET, SOUTH_ROW, about, column_xs};
use crate::builtin::blocks::{Blocks, OPEN, Skin};
use crate::builtin::mesh::Builder;

/// Both rows: plinth, turned shaft, capital. The northern columns have two storeys.
pub(super) fn columns(blocks: &mut Blocks, builder: &mut Builder, palette: &Palette) {
    for x in column_xs() {
        let tall = Column {
            sides: 12,
            plinth: &[(0.0, 0.42, 0.42)],
            shaft: &[[0.37, 0.42], [0.37, 0.52], [0.30, 0.64], [0.26, 5.95], [0.34, 6.12]],
            capital: &[(6.12, 6.3, 0.38), (6.3, BEAM, 0.44)],
        };
        let lower = Column {
            sides: 12,
            plinth: &[(0.0, 0.25, 0.35)],
            shaft: &[[0.30, 0.25], [0.30, 0.33], [0.25, 0.41], [0.225, 2.32], [0.285, 2.44]],
            capital: &[(2.44, 2.58, 0.31), (2.58, 2.8, 0.36)],
        };
        let upper = Column {
            sides: 8,
            plinth: &[(GALLERY, PARAPET, 0.25)],
            shaft: &[[0.22, PARAPET], [0.185, 4.08], [0.16, 6.12], [0.215, 6.24]],
            capital: &[(6.24, BEAM, 0.26)],
        };
        tall.build(blocks, builder, palette.column, x, SOUTH_ROW);
        lower.build(blocks, builder, palette.column, x, NORTH_ROW);
        upper.build(blocks, builder, palette.column, x, NORTH_ROW);
    }
}

/// A column from the floor upwards.
struct Column<'a> {
    /// Flat sides of the shaft, a multiple of 4.
    sides: usize,
    /// Square blocks: from height, to height, half width.
    plinth: &'a [(f64, f64, f64)],
    /// Profile (radius, height) between plinth and capital.
    shaft: &'a [[f64; 2]],
    /// As `plinth`.
    capital: &'a [(f64, f64, f64)],
}

impl Column<'_> {
    fn build(&self, blocks: &mut Blocks, builder: &mut Builder, material: usize, x: f64, z: f64) {
        let stone = Skin::from(material);
        let [first, .., last] = self.shaft else { return };
        for &(bottom, top, half) in self.plinth {
            let skin = if top == first[1] { stone.top(OPEN) } else { stone };
            blocks.solid(about(x, half), [bottom, top], about(z, half), skin);
            if top == first[1] {
                builder.collar(material, [x, top, z], half, first[0], self.sides, true);
            }
        }
        builder.turned(material, x, z, self.sides, self.shaft);
        for &(bottom, top, half) in self.capital {
            let skin = if bottom == last[1] { stone.bottom(OPEN) } else { stone };
            blocks.solid(about(x, half), [bottom, top], about(z, half), skin);
            if bottom == last[1] {
                builder.collar(material, [x, bottom, z], half, last[0], self.sides, false);
            }
        }
    }
}
