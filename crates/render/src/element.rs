//! Display elements: patches, pooled where triangles are much smaller than the patches one asked for.
//!
//! A tiny triangle is met by few rays, and its own mean is noise. Tiny patches of one surface within a cube of
//! about a patch's size are pooled into one element; everything else is an element of its own.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::{PatchId, PatchScene, Rgb};
use twinray_solve::Solution;

use crate::grid::Grid;
use crate::vantage::Vantage;

/// Patches below this share of the typical side are pooled,
const SMALL: f64 = 0.6;
/// within cubes of this share of it,
const CUBE: f64 = 0.8;
/// if their normals agree to this cosine,
const SAME_NORMAL: f64 = 0.9;
/// and they lie in a plane up to this share of it.
const SAME_PLANE: f64 = 0.2;
/// Height of the line of sight between them, over the typical side.
const LIFT: f64 = 0.02;

/// A patch, or small patches pooled.
#[derive(Clone, Copy, Debug)]
pub struct Element {
    /// The patch that stands for it: the member nearest to the middle.
    pub patch: PatchId,
    /// Centre of that patch.
    pub centre: DVec3,
    /// Display normal there.
    pub normal: DVec3,
    /// Area of all members, m².
    pub area: f64,
    /// Their mean irradiance.
    pub irradiance: Rgb,
    /// Their mean lobe towards the observer, see [`Solution::observed_lobe`].
    pub lobe: Option<[Rgb; 2]>,
}

/// All elements, and which one each patch belongs to.
#[derive(Debug)]
pub struct Elements {
    /// In the order of their patches.
    pub list: Vec<Element>,
    /// Per patch.
    pub of_patch: Vec<u32>,
    /// Side of a typical element, metres.
    pub typical_size: f64,
}

impl Elements {
    /// Pools the patches of a scene. O(K).
    pub fn new(scene: &PatchScene) -> Self {
        let patches: Vec<PatchId> = scene.patches().collect();
        let places: Vec<(DVec3, DVec3)> =
            patches.par_iter().map(|&p| (scene.cell_centre(p), display_normal(scene, p))).collect();
        let typical_size = (scene.total_area() / scene.len() as f64).sqrt();
        let is_small = |p: &PatchId| scene.area(*p) < (SMALL * typical_size).powi(2);
        let small: Vec<PatchId> = patches.iter().copied().filter(is_small).collect();
        let centres: Vec<DVec3> = small.iter().map(|p| places[p.index()].0).collect();
        let grid = Grid::new(CUBE * typical_size, &centres);

        // Greedy within each cube: a patch joins the first pool whose founder it fits.
        let mut founder: HashMap<PatchId, PatchId> = HashMap::new();
        for cube in grid.cubes() {
            let mut founders: Vec<(PatchId, Vantage)> = Vec::new();
            for p in cube.iter().map(|&k| small[k as usize]) {
                let (centre, normal) = places[p.index()];
                let here = Vantage::new(scene, p, centre, normal);
                let fits = |(f, there): &&(PatchId, Vantage)| {
                    let (c, n) = places[f.index()];
                    let rise = (centre - c).dot(n).abs().max((centre - c).dot(normal).abs());
                    n.dot(normal) > SAME_NORMAL
                        && rise < SAME_PLANE * typical_size
                        && std::ptr::eq(scene.material(p), scene.material(*f))
                        // Layers of cloth lie as close as neighbours do: only what sees the founder is of its layer.
                        && there.sees(&here, scene, LIFT * typical_size)
                };
                match founders.iter().find(fits) {
                    Some(&(f, _)) => drop(founder.insert(p, f)),
                    None => founders.push((p, here)),
                }
            }
        }

        let mut of_patch = vec![0; patches.len()];
        let mut pools: Vec<Vec<PatchId>> = Vec::new();
        let mut number: HashMap<PatchId, u32> = HashMap::new();
        for &p in &patches {
            // Founders have the lowest index of their pool, so they come first.
            match founder.get(&p) {
                Some(f) => {
                    of_patch[p.index()] = number[f];
                    pools[number[f] as usize].push(p);
                }
                None => {
                    of_patch[p.index()] = pools.len() as u32;
                    if is_small(&p) {
                        number.insert(p, pools.len() as u32);
                    }
                    pools.push(vec![p]);
                }
            }
        }
        let list = pools.par_iter().map(|pool| pooled(scene, &places, pool)).collect();
        Self { list, of_patch, typical_size }
    }

    /// Gives every element the mean light of its patches. O(K).
    pub fn light(&mut self, scene: &PatchScene, solution: &Solution) {
        for element in &mut self.list {
            element.irradiance = Rgb::BLACK;
            element.lobe = solution.observed_lobe(element.patch).map(|_| [Rgb::BLACK; 2]);
        }
        for patch in scene.patches() {
            let element = &mut self.list[self.of_patch[patch.index()] as usize];
            let share = scene.area(patch) / element.area;
            element.irradiance += solution.irradiance(patch) * share;
            if let (Some(sum), Some(lobe)) = (&mut element.lobe, solution.observed_lobe(patch)) {
                sum[0] += lobe[0] * share;
                sum[1] += lobe[1] * share;
            }
        }
    }
}

/// Small patches as one element, dark.
fn pooled(scene: &PatchScene, places: &[(DVec3, DVec3)], pool: &[PatchId]) -> Element {
    let area: f64 = pool.iter().map(|&p| scene.area(p)).sum();
    let middle = pool.iter().map(|p| places[p.index()].0 * scene.area(*p)).sum::<DVec3>() / area;
    let distance = |p: &PatchId| places[p.index()].0.distance_squared(middle);
    let patch = pool.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(pool[0]);
    let (centre, normal) = places[patch.index()];
    Element { patch, centre, normal, area, irradiance: Rgb::BLACK, lobe: None }
}

/// Vertex normals at a cell's centre: a hit's own are interpolated the same way.
fn display_normal(scene: &PatchScene, patch: PatchId) -> DVec3 {
    let [u, v] = scene.cell_place(patch);
    scene.shading_normal(scene.triangle_of(patch), scene.side_of(patch), u, v)
}
