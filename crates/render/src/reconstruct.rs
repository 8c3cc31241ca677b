//! Smooth light from patch means: what stands between cells and the eye.
//!
//! At a point x, irradiance is a weighted mean over nearby cells of the same surface: a compact kernel of the
//! distance, times the cell's area and visible share, faded out where normals turn or a step leads off the tangent
//! plane. Only cells that the point's own cell can see take part, so that nothing passes a wall. The weights vary
//! continuously with x: no facets. Neighbours are found once per cell, when a pixel first needs them.

use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::{PatchId, PatchScene, Rgb, Side, SurfaceHit};
use twinray_solve::Solution;

use crate::grid::Grid;

/// Radius of the kernel over the side of a typical cell: about ten cells share a point.
const RADIUS: f64 = 1.9;
/// Cosine between normals below which surfaces are not the same.
const SAME_NORMAL: f64 = 0.8;
/// Rise over run off the tangent plane beyond which surfaces are not the same.
const SAME_PLANE: f64 = 0.35;
/// The most neighbours of a cell: the nearest are kept where triangles are smaller than cells.
const MOST_NEIGHBOURS: usize = 48;
/// Points at which a cell is tested for what covers it.
const COVER_TESTS: u32 = 8;

/// A neighbour of a cell, itself included.
#[derive(Clone, Copy, Debug)]
struct Neighbour {
    centre: DVec3,
    normal: DVec3,
    radius_squared: f64,
    weight: f64,
    irradiance: Rgb,
    /// Radiance of the lobe to the eye, where the material is the same.
    lobe: Option<Rgb>,
}

/// Reconstructed light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Smooth {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Radiance of the lobe towards the observer.
    pub lobe: Rgb,
}

/// Reconstruction over all cells of a scene.
#[derive(Debug)]
pub struct Reconstruction<'a> {
    scene: &'a PatchScene,
    solution: &'a Solution,
    centres: Vec<DVec3>,
    typical_size: f64,
    grid: Grid,
    neighbours: Vec<OnceLock<Box<[Neighbour]>>>,
    visible_share: Vec<OnceLock<f64>>,
}

impl<'a> Reconstruction<'a> {
    /// Prepares the search for neighbours. O(K log K).
    pub fn new(scene: &'a PatchScene, solution: &'a Solution) -> Self {
        let centres: Vec<DVec3> =
            (0..scene.len() as u32).into_par_iter().map(|p| scene.cell_centre(PatchId(p))).collect();
        let typical_size = (scene.total_area() / scene.len() as f64).sqrt();
        Self {
            scene,
            solution,
            grid: Grid::new(RADIUS * typical_size, &centres),
            centres,
            typical_size,
            neighbours: (0..scene.len()).map(|_| OnceLock::new()).collect(),
            visible_share: (0..scene.len()).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Light at a hit on `patch`, smooth across cells.
    pub fn smooth(&self, patch: PatchId, hit: &SurfaceHit) -> Smooth {
        let x = self.scene.point_of(hit.triangle, hit.u, hit.v);
        let n = self.scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v);
        let (mut irradiance, mut lobe) = (Rgb::BLACK, Rgb::BLACK);
        let (mut total, mut lobe_total) = (0.0, 0.0);
        for d in self.neighbours(patch) {
            let offset = d.centre - x;
            let distance_squared = offset.length_squared();
            let kernel = 1.0 - distance_squared / d.radius_squared;
            if kernel <= 0.0 {
                continue;
            }
            let rise = offset.dot(d.normal).abs().max(offset.dot(n).abs()) / distance_squared.sqrt().max(1e-12);
            let plane = fade(SAME_PLANE - rise, 0.15);
            let turn = fade(n.dot(d.normal) - SAME_NORMAL, 0.5 * (1.0 - SAME_NORMAL));
            let weight = kernel * kernel * plane * turn * d.weight;
            irradiance += d.irradiance * weight;
            total += weight;
            if let Some(l) = d.lobe {
                lobe += l * weight;
                lobe_total += weight;
            }
        }
        if total <= 1e-12 {
            return self.flat(patch);
        }
        let lobe = if lobe_total > 0.0 { lobe / lobe_total } else { self.flat(patch).lobe };
        Smooth { irradiance: irradiance / total, lobe }
    }

    /// Light of the patch itself.
    pub fn flat(&self, patch: PatchId) -> Smooth {
        Smooth {
            irradiance: self.solution.irradiance(patch),
            lobe: self.solution.observed_lobe(patch).unwrap_or(Rgb::BLACK),
        }
    }

    fn neighbours(&self, patch: PatchId) -> &[Neighbour] {
        self.neighbours[patch.index()].get_or_init(|| self.find_neighbours(patch))
    }

    fn find_neighbours(&self, patch: PatchId) -> Box<[Neighbour]> {
        let scene = self.scene;
        let (x, n, shading) = (self.centres[patch.index()], scene.normal(patch), self.normal_at_centre(patch));
        // The kernel reaches as far as its cells are large; a point may be a cell's size away from its centre.
        let reach = (RADIUS + 1.2) * self.typical_size.max(scene.area(patch).sqrt());
        let material = scene.material(patch) as *const _;
        let mut found: Vec<(f64, PatchId)> = Vec::new();
        for other in self.grid.near(x, reach) {
            let offset = self.centres[other.index()] - x;
            let distance = offset.length();
            let normal = self.normal_at_centre(other);
            let rise = offset.dot(normal).abs().max(offset.dot(shading).abs());
            if distance > reach || shading.dot(normal) < SAME_NORMAL - 0.1 || rise > 1.5 * SAME_PLANE * distance {
                continue;
            }
            found.push((distance, other));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(MOST_NEIGHBOURS);
        let mut list: Vec<Neighbour> = found
            .into_iter()
            .filter_map(|(_, other)| {
                let centre = self.centres[other.index()];
                // Look from a little above the surface: on curved ones the chord runs below it.
                let lift = 0.05 * self.typical_size;
                let (from, to) = (x + shading * lift, centre + self.normal_at_centre(other) * lift);
                if other != patch && !scene.visible(from, n, to, scene.normal(other)) {
                    return None;
                }
                let share = self.visible_share(other);
                if share < 0.25 {
                    return None;
                }
                let same_material = std::ptr::eq(scene.material(other), material);
                let area = scene.area(other);
                Some(Neighbour {
                    centre,
                    normal: self.normal_at_centre(other),
                    radius_squared: (RADIUS * self.typical_size.max(area.sqrt())).powi(2),
                    weight: area * share * share,
                    irradiance: self.solution.irradiance(other) / share,
                    lobe: self.solution.observed_lobe(other).filter(|_| same_material).map(|l| l / share),
                })
            })
            .collect();
        list.shrink_to_fit();
        list.into_boxed_slice()
    }

    fn normal_at_centre(&self, patch: PatchId) -> DVec3 {
        // Vertex normals at the cell's centre; the hit's own are interpolated the same way.
        let scene = self.scene;
        let [u, v] = scene.cell_place(patch);
        scene.shading_normal(scene.triangle_of(patch), scene.side_of(patch), u, v)
    }

    /// The share of a cell that nothing stands on: rays along the normal that meet no back and nothing close by.
    /// The rest of the cell gets no light and would show as a dark rim.
    fn visible_share(&self, patch: PatchId) -> f64 {
        *self.visible_share[patch.index()].get_or_init(|| {
            let scene = self.scene;
            let (n, touching) = (scene.normal(patch), 0.02 * self.typical_size);
            let mut free = 0;
            for k in 0..COVER_TESTS {
                let (s, t) =
                    ((f64::from(k) * 0.754_877_666 + 0.5).fract(), (f64::from(k) * 0.569_840_29 + 0.5).fract());
                let point = scene.cell_point(patch, s, t);
                let covered = scene
                    .trace_from(patch, point, n)
                    .is_some_and(|hit| hit.t < touching || (hit.side == Side::Back && scene.patch_of(&hit).is_none()));
                free += u32::from(!covered);
            }
            f64::from(free) / f64::from(COVER_TESTS)
        })
    }
}

/// 0 below zero, 1 above `width`, smooth between.
fn fade(x: f64, width: f64) -> f64 {
    let t = (x / width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
