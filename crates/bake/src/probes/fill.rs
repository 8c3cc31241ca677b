//! Light for probes within bodies, for viewers that interpolate without asking what sees what: that of the probes on their
//! own side, never from across a wall.

use glam::DVec3;
use rayon::prelude::*;
use twinray_scene::{PatchScene, Side};

use super::grid::{ProbeGrid, neighbours};
use super::harmonics::Harmonics;
use super::place::Place;

/// Cosine between normals of faces that are the same side of a body.
const SAME: f64 = 0.5;

/// A neighbour that a probe may have light from.
struct Source {
    probe: usize,
    weight: f32,
    /// Metres to the face through which it is seen, and that face's normal; 0 and none within the same body.
    exit: f64,
    normal: DVec3,
}

/// Fills probes that have no light, ring by ring from those that have; where nothing is near they stay black.
pub(super) fn fill(patches: &PatchScene, grid: &ProbeGrid, places: &[Place], radiance: &mut [Harmonics]) {
    let mut lit: Vec<bool> = places.iter().map(|p| p.validity > 0.0).collect();
    let mut waiting: Vec<usize> = (0..lit.len()).filter(|&i| !lit[i]).collect();
    while !waiting.is_empty() {
        let found: Vec<(usize, Harmonics)> = waiting
            .par_iter()
            .filter_map(|&probe| {
                let sources: Vec<Source> = neighbours()
                    .iter()
                    .filter_map(|&step| {
                        let other = grid.neighbour(probe, step).filter(|&other| lit[other])?;
                        source(patches, probe, other, places)
                    })
                    .collect();
                mixed(&sources, radiance).map(|light| (probe, light))
            })
            .collect();
        if found.is_empty() {
            return;
        }
        for (probe, light) in found {
            radiance[probe] = light;
            lit[probe] = true;
        }
        waiting.retain(|&i| !lit[i]);
    }
}

/// What `other` is to a probe within a body: seen through one face of that body from within, or within it too.
fn source(patches: &PatchScene, probe: usize, other: usize, places: &[Place]) -> Option<Source> {
    let (from, way) = (places[probe].point - patches.centre(), places[other].point - places[probe].point);
    let weight = (1.0 / way.length()) as f32;
    let first = patches.trace(from, way).filter(|hit| hit.t < 1.0);
    let Some(hit) = first else {
        // No face in between: both are within, or this one is closed in by its surroundings without being within them.
        return Some(Source { probe: other, weight, exit: 0.0, normal: DVec3::ZERO });
    };
    if hit.side != Side::Back || places[other].validity == 0.0 {
        return None;
    }
    let [a, b, c] = patches.corners(hit.triangle);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let point = patches.point_of(hit.triangle, hit.u, hit.v);
    let rest = patches.beyond(hit.triangle, -normal * normal.dot(way).signum(), point, way);
    let is_free = rest.is_none_or(|next| hit.t + next.t >= 1.0);
    is_free.then(|| Source { probe: other, weight, exit: hit.t * way.length(), normal })
}

/// The mean of the sources on the nearest side.
fn mixed(sources: &[Source], radiance: &[Harmonics]) -> Option<Harmonics> {
    let nearest = sources.iter().min_by(|a, b| a.exit.total_cmp(&b.exit))?;
    let same = |s: &&Source| s.exit == nearest.exit || s.normal.dot(nearest.normal) > SAME;
    let total: f32 = sources.iter().filter(same).map(|s| s.weight).sum();
    let mut light = Harmonics::default();
    sources.iter().filter(same).for_each(|s| light.add(&radiance[s.probe], s.weight / total));
    Some(light)
}
