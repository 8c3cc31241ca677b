//! An entrance hall in the spirit of the paper's own scene: columns, a gallery, stairs, a polished stone floor.
//!
//! 24 × 12 × 7.5 m along x, z and y. The nave lies between two rows of columns; the southern row (z = 3.2) rises to
//! the ceiling, the northern one (z = 8.9) carries the gallery and stands on it again. Lamps are in nit.

mod columns;
mod furniture;
mod palette;
mod stairs;

use glam::DVec3;

use self::columns::columns;
use self::furniture::furniture;
use self::palette::Palette;
use self::stairs::{LANDING, stairs};
use super::blocks::{Blocks, Skin};
use super::mesh::Builder;
use crate::authored::Scene;
use crate::camera::Camera;

/// Number of patches of the paper's scene.
const PAPER_PATCHES: usize = 78_443;

const LENGTH: f64 = 24.0;
const WIDTH: f64 = 12.0;
const HEIGHT: f64 = 7.5;
/// Eight bays with a pair of columns at each border.
const BAY: f64 = 3.0;
const BAYS: usize = 8;
/// z of both rows of columns.
const SOUTH_ROW: f64 = 3.2;
const NORTH_ROW: f64 = 8.9;
/// Underside of the beams that the columns carry.
const BEAM: f64 = 6.6;

/// The gallery: its floor, the top of its parapet and of its handrail, its front.
const GALLERY: f64 = 3.4;
const PARAPET: f64 = 3.95;
const HANDRAIL: f64 = 4.4;
const HANDRAIL_DEPTH: f64 = 0.08;
const FRONT: [f64; 2] = [8.4, 8.5];
/// Underside of the slab.
const SOFFIT: f64 = 3.15;

/// The hall with its glossy floor.
pub fn hall() -> Scene {
    hall_with(true)
}

/// The hall; `glossy` makes the floor polished stone instead of a matte one of the same base colour.
///
/// Named `hall` or `hall-diffuse`. Cameras: `main` from one end at eye height, `gallery` from the gallery down. The
/// lamps emit 58 klm.
pub fn hall_with(glossy: bool) -> Scene {
    let mut builder = Builder::new(if glossy { "hall" } else { "hall-diffuse" });
    let palette = Palette::new(&mut builder, glossy);
    let mut blocks = Blocks::default();
    shell(&mut blocks, &palette);
    windows_and_doors(&mut blocks, &palette);
    gallery(&mut blocks, &palette);
    columns(&mut blocks, &mut builder, &palette);
    stairs(&mut blocks, &mut builder, &palette);
    lamps(&mut blocks, &palette);
    furniture(&mut blocks, &mut builder, &palette);
    blocks.emit(&mut builder);

    let cameras = [
        ("main", DVec3::new(0.5, 1.7, 5.5), DVec3::new(12.0, 2.7, 6.0), 58.0),
        ("gallery", DVec3::new(3.8, 5.1, 8.75), DVec3::new(12.0, 1.5, 4.9), 60.0),
    ];
    let cameras = cameras.map(|(name, eye, target, vertical_fov_degrees)| {
        let camera = Camera::look_at(name, eye, target, DVec3::Y, vertical_fov_degrees);
        Camera { aspect: Some(16.0 / 9.0), ..camera }
    });
    Scene { suggested_patches: Some(PAPER_PATCHES), ..builder.finish(cameras.into()) }
}

/// x of the columns.
fn column_xs() -> impl Iterator<Item = f64> {
    (1..BAYS).map(|i| BAY * i as f64)
}

/// x of the middle of each bay.
fn bay_xs() -> impl Iterator<Item = f64> {
    (0..BAYS).map(|i| BAY * (i as f64 + 0.5))
}

/// The interval of half width `half` about `centre`.
fn about(centre: f64, half: f64) -> [f64; 2] {
    [centre - half, centre + half]
}

/// Walls, floor with its inlaid bands, ceiling with its beams, pilasters.
fn shell(blocks: &mut Blocks, palette: &Palette) {
    let (outer_x, outer_z) = ([-1.0, LENGTH + 1.0], [-1.0, WIDTH + 1.0]);
    blocks.solid(outer_x, [-1.0, HEIGHT + 1.0], outer_z, palette.plaster);
    blocks.solid([LENGTH, LENGTH + 1.0], [0.0, HEIGHT], outer_z, palette.terracotta);
    blocks.solid(outer_x, [0.0, 0.15], outer_z, palette.skirting);
    blocks.solid(outer_x, [GALLERY, GALLERY + 0.15], [NORTH_ROW, WIDTH + 1.0], palette.skirting);
    blocks.solid(outer_x, [-1.0, 0.0], outer_z, palette.floor);
    blocks.solid(outer_x, [-1.0, 0.0], about(SOUTH_ROW, 0.45), palette.inlay);
    blocks.solid(outer_x, [-1.0, 0.0], about(NORTH_ROW, 0.45), palette.inlay);
    blocks.solid(outer_x, [HEIGHT, HEIGHT + 1.0], outer_z, palette.ceiling);
    blocks.air([0.0, LENGTH], [0.0, HEIGHT], [0.0, WIDTH]);

    // Beams along both rows and, shallower, across; they leave coffers between them.
    for row in [SOUTH_ROW, NORTH_ROW] {
        blocks.solid([0.0, LENGTH], [BEAM, HEIGHT], about(row, 0.3), palette.ceiling);
    }
    for x in column_xs() {
        for z in [[0.0, SOUTH_ROW - 0.3], [SOUTH_ROW + 0.3, NORTH_ROW - 0.3], [NORTH_ROW + 0.3, WIDTH]] {
            blocks.solid(about(x, 0.2), [BEAM + 0.2, HEIGHT], z, palette.ceiling);
        }
        blocks.solid(about(x, 0.3), [0.0, BEAM + 0.2], [0.0, 0.12], palette.plaster);
        blocks.solid(about(x, 0.34), [BEAM, BEAM + 0.2], [0.0, 0.16], palette.plaster);
    }
}

/// Recesses in the walls: light panels behind mullions high in the south wall, doors below and at both ends.
fn windows_and_doors(blocks: &mut Blocks, palette: &Palette) {
    for x in bay_xs() {
        let (sill, lintel, back) = (4.4, 6.0, -0.3);
        blocks.air(about(x, 0.45), [sill, lintel], [back, 0.0]);
        blocks.solid(about(x, 0.45), [sill, lintel], [back - 0.1, back], palette.window);
        blocks.solid(about(x, 0.025), [sill, lintel], [back, back + 0.06], palette.metal);
        blocks.solid(about(x, 0.45), [5.2, 5.25], [back, back + 0.06], palette.metal);
    }
    // A ledge under the panels, between the pilasters.
    for i in 0..BAYS {
        let left = if i == 0 { 0.0 } else { BAY * i as f64 + 0.3 };
        let right = if i + 1 == BAYS { LENGTH } else { BAY * (i as f64 + 1.0) - 0.3 };
        blocks.solid([left, right], [4.05, 4.2], [0.0, 0.1], palette.column);
    }

    // South and north doors: a recess, a leaf at its back.
    for (x, floor) in [(4.5, 0.0), (13.5, 0.0), (19.5, 0.0)] {
        blocks.air(about(x, 0.55), [floor, floor + 2.3], [-0.2, 0.0]);
        blocks.solid(about(x, 0.55), [floor, floor + 2.3], [-0.3, -0.2], palette.oak);
    }
    for (x, floor) in [(7.5, 0.0), (16.5, 0.0), (4.5, GALLERY), (10.5, GALLERY), (16.5, GALLERY), (22.5, GALLERY)] {
        blocks.air(about(x, 0.5), [floor, floor + 2.1], [WIDTH, WIDTH + 0.2]);
        blocks.solid(about(x, 0.5), [floor, floor + 2.1], [WIDTH + 0.2, WIDTH + 0.3], palette.oak);
    }

    // A double door in a stone frame at the far end, one above it on the gallery, one behind the main camera.
    let door_z = [4.9, 6.9];
    blocks.solid([LENGTH - 0.08, LENGTH], [0.0, 2.95], [door_z[0] - 0.25, door_z[1] + 0.25], palette.column);
    blocks.air([LENGTH - 0.08, LENGTH + 0.3], [0.0, 2.7], door_z);
    blocks.solid([LENGTH + 0.3, LENGTH + 0.4], [0.0, 2.7], door_z, palette.oak);
    blocks.solid([LENGTH + 0.27, LENGTH + 0.3], [0.0, 2.7], about(5.9, 0.03), palette.metal);
    blocks.air([LENGTH, LENGTH + 0.25], [GALLERY, GALLERY + 2.1], about(10.4, 0.5));
    blocks.solid([LENGTH + 0.25, LENGTH + 0.35], [GALLERY, GALLERY + 2.1], about(10.4, 0.5), palette.oak);
    blocks.air([-0.3, 0.0], [0.0, 2.7], door_z);
    blocks.solid([-0.4, -0.3], [0.0, 2.7], door_z, palette.oak);
}

/// The gallery: slab, beams, parapet, posts and handrail, with an opening at the landing of the stairs.
fn gallery(blocks: &mut Blocks, palette: &Palette) {
    let length = [0.0, LENGTH];
    blocks.solid(length, [SOFFIT, GALLERY], [FRONT[1], WIDTH], Skin::from(palette.plaster).top(palette.boards));
    blocks.solid(length, [2.8, SOFFIT], about(NORTH_ROW, 0.3), palette.plaster);
    for x in column_xs() {
        blocks.solid(about(x, 0.15), [2.9, SOFFIT], [NORTH_ROW + 0.3, WIDTH], palette.plaster);
    }
    blocks.solid(length, [SOFFIT - 0.1, PARAPET], FRONT, palette.parapet);

    let posts = (0..40).map(|i| 0.3 + 0.6 * f64::from(i));
    let rail = [FRONT[0] + 0.01, FRONT[1] - 0.01];
    for x in posts {
        blocks.solid(about(x, 0.015), [PARAPET, HANDRAIL - HANDRAIL_DEPTH], about(8.45, 0.015), palette.metal);
    }
    blocks.solid(length, [HANDRAIL - HANDRAIL_DEPTH, HANDRAIL], rail, palette.oak);

    // The opening, with its boards on the level of the gallery.
    let opening = [LANDING[0] + 0.1, LANDING[1] - 0.1];
    blocks.air(opening, [GALLERY, HANDRAIL], FRONT);
    blocks.solid(opening, [SOFFIT, GALLERY], FRONT, Skin::from(palette.parapet).top(palette.boards));
}

/// Panels in the coffers, downlights under the gallery, sconces on the south wall.
fn lamps(blocks: &mut Blocks, palette: &Palette) {
    for x in bay_xs() {
        let recess = [HEIGHT, HEIGHT + 0.12];
        blocks.air(about(x, 0.2), recess, about(6.05, 0.7));
        blocks.solid(about(x, 0.2), [recess[1], recess[1] + 0.1], about(6.05, 0.7), palette.panel);
        let recess = [SOFFIT, SOFFIT + 0.06];
        blocks.air(about(x, 0.2), recess, about(10.6, 0.2));
        blocks.solid(about(x, 0.2), [recess[1], recess[1] + 0.05], about(10.6, 0.2), palette.downlight);
    }
    for x in [1.5, 7.5, 10.5, 16.5, 22.5] {
        let body = Skin::from(palette.sconce).top(palette.metal).bottom(palette.metal);
        blocks.solid(about(x, 0.1), [2.1, 2.5], [0.0, 0.1], body);
    }
}
