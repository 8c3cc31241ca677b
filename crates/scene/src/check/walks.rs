//! Where light gets: diffuse walks from what cameras see and from what emits, and how they end.
//!
//! Only places that such walks reach count: what is inside of furniture sees backs, and nobody minds.

use glam::DVec3;
use rayon::prelude::*;

use super::subject::Subject;
use crate::bvh::SurfaceHit;
use crate::camera::Camera;
use crate::geom::Frame;
use crate::patch::{PatchId, Side};
use crate::sample::{Stream, warp};

/// Walks from each camera, and from all that emits.
const WALKS: u64 = 16_384;
/// Cameras of a path have many positions; the first ones tell enough.
const CAMERAS: usize = 8;
const BOUNCES: usize = 8;
const PURPOSE: u64 = 0xD0C;

/// One thing that a ray of a walk met.
pub struct Step {
    /// Whence the ray came: a point above a surface; `None` for rays of cameras.
    pub from: Option<(PatchId, DVec3)>,
    pub direction: DVec3,
    /// `None` where it escaped.
    pub hit: Option<SurfaceHit>,
}

/// All steps of all walks, in their order.
pub struct Walks(pub Vec<Step>);

impl Walks {
    pub fn new(subject: &Subject, cameras: &[Camera]) -> Self {
        let patches = subject.patches;
        let emitters: Vec<PatchId> = patches.patches().filter(|&p| !patches.emission(p).is_black()).collect();
        let cameras = &cameras[..cameras.len().min(CAMERAS)];
        let starts = cameras.len() as u64 + u64::from(!emitters.is_empty());
        let walks: Vec<Vec<Step>> = (0..starts * WALKS)
            .into_par_iter()
            .map(|number| {
                let mut random = Stream::new(0, PURPOSE, number);
                let mut steps = Vec::new();
                match cameras.get((number / WALKS) as usize) {
                    Some(camera) => {
                        let [x, y] = [random.uniform(), random.uniform()];
                        let Some((eye, direction)) = camera.ray(x, y, camera.aspect.unwrap_or(4.0 / 3.0), [0.0; 2])
                        else {
                            return steps;
                        };
                        let hit = patches.trace(eye - patches.centre(), direction);
                        steps.push(Step { from: None, direction, hit });
                    }
                    None => {
                        let index = (random.uniform() * emitters.len() as f64) as usize;
                        leave(subject, emitters[index.min(emitters.len() - 1)], None, &mut random, &mut steps);
                    }
                }
                walk(subject, &mut random, &mut steps);
                steps
            })
            .collect();
        Self(walks.into_iter().flatten().collect())
    }
}

/// Leaves a patch: from anywhere on it, or from a point.
fn leave(subject: &Subject, patch: PatchId, at: Option<DVec3>, random: &mut Stream, steps: &mut Vec<Step>) {
    let patches = subject.patches;
    let point = at.unwrap_or_else(|| {
        let [s, t] = [random.uniform(), random.uniform()];
        patches.sample_point(patch, s, t, || random.uniform())
    });
    let local = warp::cosine_hemisphere([random.uniform(), random.uniform()]);
    let direction = Frame::from_normal(patches.normal(patch)).to_world(local);
    steps.push(Step { from: Some((patch, point)), direction, hit: patches.trace_from(patch, point, direction) });
}

/// Goes on until light would end, or for some bounces.
fn walk(subject: &Subject, random: &mut Stream, steps: &mut Vec<Step>) {
    let patches = subject.patches;
    for _ in 0..BOUNCES {
        let Some(&Step { direction, hit: Some(hit), .. }) = steps.last() else { return };
        let Some(patch) = patches.patch_of(&hit) else { return };
        let point = patches.point_of(hit.triangle, hit.u, hit.v);
        if patches.material(patch).transmission.is_some() {
            let normal = patches.normal(patch);
            // Through glass without bending: enough to know where light gets.
            let next = patches.beyond(hit.triangle, normal, point, direction);
            steps.push(Step { from: Some((patch, point)), direction, hit: next });
        } else {
            leave(subject, patch, Some(point), random, steps);
        }
    }
}

/// Hits of one-sided surfaces on their backs, where light ends.
pub fn is_back(subject: &Subject, hit: &SurfaceHit) -> bool {
    hit.side == Side::Back && subject.is_one_sided(hit.triangle)
}
