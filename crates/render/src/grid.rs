//! Which patches are near a point: a uniform grid over cell centres.

use std::collections::HashMap;

use glam::{DVec3, IVec3};
use twinray_scene::PatchId;

/// Patches by the grid cube of their centre.
#[derive(Debug)]
pub struct Grid {
    edge: f64,
    /// Patches sorted by cube.
    patches: Vec<PatchId>,
    /// Range of `patches` in each occupied cube.
    cubes: HashMap<IVec3, (u32, u32)>,
}

impl Grid {
    /// A grid of cubes of the given edge over `centres` (one for each patch, in order).
    pub fn new(edge: f64, centres: &[DVec3]) -> Self {
        let cube = |p: DVec3| (p / edge).floor().as_ivec3();
        let mut patches: Vec<PatchId> = (0..centres.len() as u32).map(PatchId).collect();
        patches.sort_by_key(|p| (cube(centres[p.index()]).to_array(), *p));
        let mut cubes = HashMap::new();
        for (i, p) in patches.iter().enumerate() {
            let range = cubes.entry(cube(centres[p.index()])).or_insert((i as u32, i as u32));
            range.1 = i as u32 + 1;
        }
        Self { edge, patches, cubes }
    }

    /// All patches whose centre may lie within `radius` of `point`, in an order that depends on the scene alone.
    pub fn near(&self, point: DVec3, radius: f64) -> impl Iterator<Item = PatchId> {
        let low = ((point - radius) / self.edge).floor().as_ivec3();
        let high = ((point + radius) / self.edge).floor().as_ivec3();
        let cubes = (low.x..=high.x)
            .flat_map(move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| IVec3::new(x, y, z))));
        cubes.filter_map(|c| self.cubes.get(&c)).flat_map(|&(a, b)| &self.patches[a as usize..b as usize]).copied()
    }
}
