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
#[derive(Clone, Debug)]
struct Cell {
    normal: DVec3,
    radius: f64,
    /// The free parts of the cell: one, unless something stands on it; none if all is covered.
    parts: Vec<Part>,
}

/// A part of a cell whose points see each other. A cell that passes under a wall has one on either side, and light
/// must not pass from the one to the other.
#[derive(Clone, Copy, Debug)]
struct Part {
    origin: DVec3,
    /// Its share of the cell: the covered rest gets no light, and would show as a dark rim.
    share: f64,
}

/// A part of another cell.
type Neighbour = (PatchId, u8);

/// Reconstructed light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Smooth {
    /// Irradiance, W·m⁻².
    pub irradiance: Rgb,
    /// Radiance of the lobe towards the observer: of direct light, and of all other light.
    pub lobe: [Rgb; 2],
}

/// How far a cell's light reaches.
#[derive(Clone, Copy)]
enum Kernel {
    /// Each cell's own radius.
    Cells,
    /// A common radius.
    Wide(f64),
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
    /// Per cell and part.
    neighbours: Vec<OnceLock<Vec<Box<[Neighbour]>>>>,
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
        let parts = &self.cell(patch).parts;
        let part = match parts.len() {
            0 => None,
            1 => Some(0),
            _ => parts.iter().position(|p| self.sees(x, n, patch, p.origin)),
        };
        let near = part.and_then(|part| self.mean(patch, x, n, &self.neighbours(patch)[part], Kernel::Cells));
        // A sliver that its own cell does not know: ask the nearest cells that the point itself can see.
        near.or_else(|| {
            let reach = 3.0 * self.cell(patch).radius;
            let mut list = self.visible_from(x, n, self.same_surface(patch, reach), None);
            list.truncate(8);
            self.mean(patch, x, n, &list, Kernel::Wide(reach))
        })
        .unwrap_or_else(|| self.flat(patch))
    }

    /// Weighted mean over neighbours; `None` if none has a weight.
    fn mean(&self, patch: PatchId, x: DVec3, n: DVec3, neighbours: &[Neighbour], kernel: Kernel) -> Option<Smooth> {
        let glossy = self.scene.is_glossy(patch);
        let material = self.scene.material(patch) as *const _;
        let mut sum = Smooth { irradiance: Rgb::BLACK, lobe: [Rgb::BLACK; 2] };
        let (mut total, mut lobe_total) = (0.0, 0.0);
        for &(other, part) in neighbours {
            let cell = self.cell(other);
            let Part { origin, share } = cell.parts[usize::from(part)];
            let radius = if let Kernel::Wide(reach) = kernel { reach } else { cell.radius };
            let offset = origin - x;
            let distance_squared = offset.length_squared();
            let closeness = 1.0 - distance_squared / (radius * radius);
            if closeness <= 0.0 {
                continue;
            }
            let rise = offset.dot(cell.normal).abs().max(offset.dot(n).abs()) / distance_squared.sqrt().max(1e-12);
            let plane = fade(SAME_PLANE - rise, 0.15);
            let turn = fade(n.dot(cell.normal) - SAME_NORMAL, 0.5 * (1.0 - SAME_NORMAL));
            // A cell that is half covered says less, and says it with the error of its share.
            let trust = self.scene.area(other) * share * share * share;
            let weight = closeness * closeness * plane * turn * trust;
            sum.irradiance += self.solution.irradiance(other) * (weight / share);
            total += weight;
            if glossy
                && let Some(lobe) = self.solution.observed_lobe(other)
                && std::ptr::eq(self.scene.material(other), material)
            {
                sum.lobe[0] += lobe[0] * (weight / share);
                sum.lobe[1] += lobe[1] * (weight / share);
                lobe_total += weight;
            }
        }
        let lobe = if lobe_total > 0.0 { sum.lobe.map(|l| l / lobe_total) } else { self.flat(patch).lobe };
        (total > 0.0).then(|| Smooth { irradiance: sum.irradiance / total, lobe })
    }

    /// Light of the patch itself.
    pub fn flat(&self, patch: PatchId) -> Smooth {
        Smooth {
            irradiance: self.solution.irradiance(patch),
            lobe: self.solution.observed_lobe(patch).unwrap_or([Rgb::BLACK; 2]),
        }
    }

    /// Neighbours of each part of a cell.
    fn neighbours(&self, patch: PatchId) -> &[Box<[Neighbour]>] {
        self.neighbours[patch.index()].get_or_init(|| {
            let here = self.cell(patch);
            let reach = here.radius + 1.2 * self.typical_size.max(self.scene.area(patch).sqrt());
            let mut near = self.same_surface(patch, reach);
            near.truncate(MOST_NEIGHBOURS);
            let of = |(k, part): (usize, &Part)| {
                self.visible_from(part.origin, here.normal, near.clone(), Some((patch, k as u8))).into_boxed_slice()
            };
            here.parts.iter().enumerate().map(of).collect()
        })
    }

    /// The first part of each cell that a point sees, cells of which too little is free left out. `own` is the part
    /// that the point belongs to.
    fn visible_from(&self, x: DVec3, n: DVec3, cells: Vec<PatchId>, own: Option<Neighbour>) -> Vec<Neighbour> {
        let visible = |other: PatchId| {
            let parts = &self.cell(other).parts;
            let part = match own {
                Some((patch, part)) if patch == other => Some(usize::from(part)),
                _ => parts.iter().position(|p| p.share >= LEAST_SHARE && self.sees(x, n, other, p.origin)),
            };
            part.filter(|&k| parts[k].share >= LEAST_SHARE).map(|k| (other, k as u8))
        };
        cells.into_iter().filter_map(visible).collect()
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
            let whole = Part { origin: centre, share: 1.0 };
            let witnesses: Vec<PatchId> = near.into_iter().filter(|&p| p != patch).take(12).collect();
            let seen = witnesses.iter().filter(|&&w| self.sees(centre, normal, w, self.centres[w.index()])).count();
            let mut corners = (1..=4).map(|k| self.spread_point(patch, k));
            let free = |p: DVec3| !self.covered(patch, p);
            if free(centre)
                && seen * 6 >= witnesses.len() * 5
                && corners.all(|c| free(c) && self.sees(centre, normal, patch, c))
            {
                return Cell { normal, radius, parts: vec![whole] };
            }
            // Something stands on the cell: gather its free points into parts that see each other.
            let mut points: Vec<DVec3> = (0..COVER_TESTS).map(|k| self.spread_point(patch, k)).filter(|&p| free(p)).collect();
            let mut parts = Vec::new();
            while let Some(&first) = points.first() {
                let (group, rest): (Vec<DVec3>, Vec<DVec3>) =
                    points.iter().partition(|&&p| p == first || self.sees(first, normal, patch, p));
                let middle = group.iter().sum::<DVec3>() / group.len() as f64;
                let from_middle = |p: &DVec3| p.distance_squared(middle);
                let origin = group.iter().copied().min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)));
                let share = group.len() as f64 / f64::from(COVER_TESTS);
                parts.push(Part { origin: origin.unwrap_or(first), share });
                points = rest;
            }
            Cell { normal, radius, parts }
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
