//! One ray from one patch: a point, a direction, and what is met.

use glam::DVec3;
use twinray_scene::passing::{Arrival, End};
use twinray_scene::{PatchId, PatchScene};

use crate::patch_radiance::Outgoing;

/// A ray.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// Unit direction in which it left its patch.
    pub direction: DVec3,
    /// Where it arrived.
    pub arrival: Arrival,
    /// Probability with which the same path from its other end would have stopped here.
    pub stop: f64,
}

/// Shoots a ray from `patch` with density ∝ λ(ω) cosθ over its points and directions. `None` if the choice of a
/// direction fell below the horizon: a ray that carries nothing.
///
/// `place` and `direction` are uniform in [0, 1)²; `redraw` gives more numbers where the patch has holes, and for
/// surfaces where the ray may go on.
#[inline]
pub fn shoot(
    scene: &PatchScene,
    patch: PatchId,
    outgoing: &Outgoing,
    place: [f64; 2],
    direction: [f64; 2],
    mut redraw: impl FnMut() -> f64,
) -> Option<Shot> {
    let n = scene.normal(patch);
    let direction = outgoing.sample(n, direction)?;
    if n.dot(direction) <= 0.0 {
        return None;
    }
    let point = scene.sample_point(patch, place[0], place[1], &mut redraw);
    let arrival = scene.trace_through(Some(patch), point, direction, redraw);
    let stop = if arrival.end == End::Back { 1.0 } else { scene.stop_chance(patch, direction) };
    Some(Shot { direction, arrival, stop })
}
