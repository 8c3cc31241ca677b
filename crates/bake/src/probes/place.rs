//! Which probes are in the open, and places nearby for those that are not.
//!
//! Rays from within a body meet the backs of its faces. A probe that sees too many of them, or is closed in all around, goes
//! to the nearest place in its own box that is better (Majercik et al., "Scaling probe-based real-time dynamic global
//! illumination for production", JCGT 10(2), 2021).

use glam::DVec3;
use twinray_scene::sample::{net_point, warp};
use twinray_scene::{PatchScene, Side};
use twinray_solve::Solution;

use super::grid::ProbeGrid;

/// Rays by which a place is judged,
const RAYS: u32 = 64;
/// and those after which one that sees nothing else than backs is given up.
const FIRST: u32 = 8;
/// Share of rays that meet dark backs, beyond which a place is within something.
const MOST_BACKS: f64 = 0.25;
/// Closed in: so large a share of rays ends nearer than this share of the box's shortest side.
const CLOSED: f64 = 0.9;
const NEAR: f64 = 0.15;
/// Share of the shortest side that a place must have free around it for a probe to go there.
const CLEAR: f64 = 0.04;
/// Places along each axis of a box that a probe may go to, and how far from the middle, in boxes.
const STEPS: i32 = 3;
const FARTHEST: f64 = 0.48;

/// Where a probe takes its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// World.
    pub point: DVec3,
    /// Share of rays that meet no dark back; 0 where there is no good place.
    pub validity: f64,
}

/// The place of a probe.
pub(super) fn place(patches: &PatchScene, solution: &Solution, grid: &ProbeGrid, probe: usize) -> Place {
    let cell = DVec3::from_array(grid.cell);
    let middle = grid.point(probe);
    let judge = |point: DVec3, clear: f64| -> Option<Place> {
        let validity = validity(patches, solution, point - patches.centre(), cell.min_element(), clear)?;
        Some(Place { point, validity })
    };
    judge(middle, 0.0)
        .or_else(|| places().iter().find_map(|&step| judge(middle + step * cell, CLEAR)))
        .unwrap_or(Place { point: middle, validity: 0.0 })
}

/// Places beside the middle of a box, in boxes, nearest first.
fn places() -> Vec<DVec3> {
    let range = -STEPS..=STEPS;
    let all = range.clone().flat_map(|z| {
        range.clone().flat_map({
            let range = range.clone();
            move |y| range.clone().map(move |x| [x, y, z])
        })
    });
    let mut steps: Vec<[i32; 3]> = all.filter(|s| *s != [0; 3]).collect();
    // Integers, so that equal distances keep their order.
    steps.sort_by_key(|s| s.iter().map(|c| c * c).sum::<i32>());
    steps.into_iter().map(|s| DVec3::from_array(s.map(f64::from)) * (FARTHEST / f64::from(STEPS))).collect()
}

/// Share of rays from a point (of the patch scene) that meet no dark back; `None` if it is within something, or nearer to
/// something than `clear`, as a share of `side`.
fn validity(patches: &PatchScene, solution: &Solution, point: DVec3, side: f64, clear: f64) -> Option<f64> {
    let (mut backs, mut near) = (0, 0);
    for index in 0..RAYS {
        let direction = warp::uniform_sphere(net_point(0x9B0B, index));
        if let Some(hit) = patches.trace(point, direction) {
            if hit.t < clear * side {
                return None;
            }
            // Two-sided walls have backs too, in whose dark no ray ever was.
            let light = patches.patch_of(&hit).map(|p| solution.irradiance(p));
            backs += u32::from(hit.side == Side::Back && light.is_none_or(|l| l.is_black()));
            near += u32::from(hit.t < NEAR * side);
        }
        if index + 1 == FIRST && backs == FIRST {
            return None;
        }
    }
    let share = |count: u32| f64::from(count) / f64::from(RAYS);
    (share(backs) <= MOST_BACKS && share(near) < CLOSED).then(|| 1.0 - share(backs))
}
