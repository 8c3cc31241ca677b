//! How far a probe sees towards its neighbours: what keeps its light on its own side of walls.

use glam::DVec3;
use twinray_scene::PatchScene;

use super::grid::{NEIGHBOURS, ProbeGrid, neighbours};

/// Of a probe whose light was taken at `from`, in the direction to each neighbour: the distance between probes over
/// what is free from there. 0 where nothing is met, be it behind the neighbour.
///
/// As reciprocals, since the reciprocal of the distance to a plane is linear in the direction: interpolated between
/// neighbours, they are exact for a wall.
pub(super) fn nearness(patches: &PatchScene, grid: &ProbeGrid, from: DVec3) -> [f32; NEIGHBOURS] {
    let (from, cell) = (from - patches.centre(), DVec3::from_array(grid.cell));
    // Beyond the grid's rims too: walls are there most often.
    neighbours().map(|step| {
        let way = DVec3::from_array(step.map(f64::from)) * cell;
        patches.trace(from, way).map_or(0.0, |hit| (1.0 / hit.t.max(1e-3)) as f32)
    })
}
