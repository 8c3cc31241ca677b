//! Smooth light from patch means: what stands between cells and the eye.
//!
//! At a point x, irradiance is a weighted mean over nearby cells of the same surface: a compact kernel of the
//! distance, times the cell's area and visible share, faded out where normals turn or a step leads off the tangent
//! plane. Only cells that the point's own cell can see take part, so that nothing passes a wall. The weights vary
//! continuously with x: no facets. Cells are looked at when a pixel first needs them.

use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::{PatchId, PatchScene, Rgb, Side, SurfaceHit};
use twinray_solve::Solution;

use crate::grid::Grid;

/// Radius of the kernel over the side of a typical cell: about ten cells share a point.
const RADIUS: f64 = 1.9;
/// Where triangles are smaller than cells, the kernel shrinks to about so many.
const CELLS_IN_KERNEL: usize = 40;
/// The most neighbours of a cell: those within the kernel of any of its points.
const MOST_NEIGHBOURS: usize = 96;
/// Cosine between normals below which surfaces are not the same.
const SAME_NORMAL: f64 = 0.8;
/// Rise over run off the tangent plane beyond which surfaces are not the same.
const SAME_PLANE: f64 = 0.35;
/// Points at which a suspicious cell is tested for what covers it.
const COVER_TESTS: u32 = 24;
/// Cells of which less than this share is free say too little of their light.
const LEAST_SHARE: f64 = 0.2;

/// What the display needs to know of a cell.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// A free point of the cell: its centre, unless something stands on that.
    origin: DVec3,
    normal: DVec3,
    /// Share of the cell that its origin can see: the rest gets no light and would show as a dark rim.
    share: f64,
    radius: f64,
}

/// Reconstructed light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Smooth {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Radiance of the lobe towards the observer: of direct light, and of all other light.
    pub lobe: [Rgb; 2],
}

/// Reconstruction over all cells of a scene.
#[derive(Debug)]
pub struct Reconstruction<'a> {
    scene: &'a PatchScene,
    solution: &'a Solution,
    centres: Vec<DVec3>,
    typical_size: f64,
    grid: Grid,
    cells: Vec<OnceLock<Cell>>,
    neighbours: Vec<OnceLock<Box<[PatchId]>>>,
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
            cells: (0..scene.len()).map(|_| OnceLock::new()).collect(),
            neighbours: (0..scene.len()).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Light at a hit on `patch`, smooth across cells.
    pub fn smooth(&self, patch: PatchId, hit: &SurfaceHit) -> Smooth {
        let x = self.scene.point_of(hit.triangle, hit.u, hit.v);
        let n = self.scene.shading_normal(hit.triangle, hit.side, hit.u, hit.v);
        let glossy = self.scene.is_glossy(patch);
        let material = self.scene.material(patch) as *const _;
        let mut sum = Smooth { irradiance: Rgb::BLACK, lobe: [Rgb::BLACK; 2] };
        let (mut total, mut lobe_total) = (0.0, 0.0);
        for &other in self.neighbours(patch) {
            let cell = self.cell(other);
            let offset = cell.origin - x;
            let distance_squared = offset.length_squared();
            let kernel = 1.0 - distance_squared / (cell.radius * cell.radius);
            if kernel <= 0.0 {
                continue;
            }
            let rise = offset.dot(cell.normal).abs().max(offset.dot(n).abs()) / distance_squared.sqrt().max(1e-12);
            let plane = fade(SAME_PLANE - rise, 0.15);
            let turn = fade(n.dot(cell.normal) - SAME_NORMAL, 0.5 * (1.0 - SAME_NORMAL));
            // A cell that is half covered says less, and says it with the error of its share.
            let trust = self.scene.area(other) * cell.share * cell.share * cell.share;
            let weight = kernel * kernel * plane * turn * trust;
            sum.irradiance += self.solution.irradiance(other) * (weight / cell.share);
            total += weight;
            if glossy
                && let Some(lobe) = self.solution.observed_lobe(other)
                && std::ptr::eq(self.scene.material(other), material)
            {
                sum.lobe[0] += lobe[0] * (weight / cell.share);
                sum.lobe[1] += lobe[1] * (weight / cell.share);
                lobe_total += weight;
            }
        }
        let own = self.flat(patch);
        let irradiance = if total > 0.0 { sum.irradiance / total } else { own.irradiance };
        let lobe = if lobe_total > 0.0 { sum.lobe.map(|l| l / lobe_total) } else { own.lobe };
        Smooth { irradiance, lobe }
    }

    /// Light of the patch itself.
    pub fn flat(&self, patch: PatchId) -> Smooth {
        Smooth {
            irradiance: self.solution.irradiance(patch),
            lobe: self.solution.observed_lobe(patch).unwrap_or([Rgb::BLACK; 2]),
        }
    }

    fn neighbours(&self, patch: PatchId) -> &[PatchId] {
        self.neighbours[patch.index()].get_or_init(|| {
            let here = self.cell(patch);
            let reach = here.radius + 1.2 * self.typical_size.max(self.scene.area(patch).sqrt());
            let mut near = self.same_surface(patch, reach);
            near.truncate(MOST_NEIGHBOURS);
            near.retain(|&other| {
                self.cell(other).share >= LEAST_SHARE
                    && (other == patch || self.sees(here.origin, here.normal, other, self.cell(other).origin))
            });
            near.into_boxed_slice()
        })
    }

    /// Cells within `reach` whose normals and places fit the surface of `patch`, nearest first.
    fn same_surface(&self, patch: PatchId, reach: f64) -> Vec<PatchId> {
        let (x, n) = (self.centres[patch.index()], self.normal(patch));
        let mut found: Vec<(f64, PatchId)> = self
            .grid
            .near(x, reach)
            .filter_map(|other| {
                let offset = self.centres[other.index()] - x;
                let (distance, normal) = (offset.length(), self.normal(other));
                let rise = offset.dot(normal).abs().max(offset.dot(n).abs());
                let fits =
                    distance <= reach && n.dot(normal) > SAME_NORMAL - 0.1 && rise <= 1.5 * SAME_PLANE * distance;
                fits.then_some((distance, other))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, p)| p).collect()
    }

    /// True if a point over a surface sees a point of another cell, both lifted a little: on curved surfaces the
    /// chord runs below the surface by a part of the rise.
    fn sees(&self, from: DVec3, normal: DVec3, other: PatchId, to: DVec3) -> bool {
        let there = self.normal(other);
        let offset = to - from;
        let rise = offset.dot(normal).abs().max(offset.dot(there).abs());
        let lift = 0.03 * self.typical_size + 0.3 * rise;
        self.scene.visible(from + normal * lift, normal, to + there * lift, there)
    }

    fn cell(&self, patch: PatchId) -> &Cell {
        self.cells[patch.index()].get_or_init(|| {
            let centre = self.centres[patch.index()];
            let normal = self.normal(patch);
            let widest = RADIUS * self.typical_size.max(self.scene.area(patch).sqrt());
            let near = self.same_surface(patch, widest);
            let radius = near.get(CELLS_IN_KERNEL).map_or(widest, |p| self.centres[p.index()].distance(centre));
            let whole = Cell { origin: centre, normal, share: 1.0, radius };
            let witnesses: Vec<PatchId> = near.into_iter().filter(|&p| p != patch).take(12).collect();
            let seen_from = |point: DVec3| {
                witnesses.iter().filter(|&&w| self.sees(point, normal, w, self.centres[w.index()])).count()
            };
            let corners = (1..=4).map(|k| self.spread_point(patch, k));
            if !self.covered(patch, centre)
                && seen_from(centre) * 6 >= witnesses.len() * 5
                && corners.into_iter().all(|c| !self.covered(patch, c) && self.sees(centre, normal, patch, c))
            {
                return whole;
            }
            // Something stands on the cell: look from the point that sees most of its neighbours.
            let points: Vec<DVec3> = (0..COVER_TESTS).map(|k| self.spread_point(patch, k)).collect();
            let free: Vec<DVec3> = points.iter().copied().filter(|&p| !self.covered(patch, p)).collect();
            let best = free.iter().copied().map(|p| (seen_from(p), p)).reduce(|a, b| if b.0 > a.0 { b } else { a });
            let Some((_, origin)) = best else { return Cell { share: 0.0, ..whole } };
            let seen = free.iter().filter(|&&p| p == origin || self.sees(origin, normal, patch, p)).count();
            Cell { origin, share: seen as f64 / points.len() as f64, ..whole }
        })
    }

    /// True if nothing can light the point: along the normal it meets a back, or something that touches it.
    fn covered(&self, patch: PatchId, point: DVec3) -> bool {
        let scene = self.scene;
        scene.trace_from(patch, point, scene.normal(patch)).is_some_and(|hit| {
            hit.t < 0.02 * self.typical_size || (hit.side == Side::Back && scene.patch_of(&hit).is_none())
        })
    }

    fn spread_point(&self, patch: PatchId, k: u32) -> DVec3 {
        let place = |step: f64| (f64::from(k) * step + 0.5).fract();
        self.scene.cell_point(patch, place(0.754_877_666), place(0.569_840_29))
    }

    /// Vertex normals at the cell's centre: a hit's own are interpolated the same way.
    fn normal(&self, patch: PatchId) -> DVec3 {
        let [u, v] = self.scene.cell_place(patch);
        self.scene.shading_normal(self.scene.triangle_of(patch), self.scene.side_of(patch), u, v)
    }
}

/// 0 below zero, 1 above `width`, smooth between.
fn fade(x: f64, width: f64) -> f64 {
    let t = (x / width).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
