//! One ray from one patch: a point, a direction, and what is met.

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene};

use crate::patch_radiance::Outgoing;

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub enum Far {
    /// A patch, on the side that scatters.
    Patch(PatchId),
    /// The absorbing back of a one-sided surface.
    Back,
    /// Nothing: the environment, if there is one.
    Sky,
}

/// Shoots a ray from `patch` with density ∝ λ(ω) cosθ over its points and directions. `None` if the choice of a
/// direction fell below the horizon: a ray that carries nothing.
///
/// `place` and `direction` are uniform in [0, 1)²; `redraw` gives more numbers where the patch has holes.
#[inline]
pub fn shoot(
    scene: &PatchScene,
    patch: PatchId,
    outgoing: &Outgoing,
    place: [f64; 2],
    direction: [f64; 2],
    redraw: impl FnMut() -> f64,
) -> Option<(DVec3, Far)> {
    let n = scene.normal(patch);
    let direction = outgoing.sample(n, direction)?;
    if n.dot(direction) <= 0.0 {
        return None;
    }
    let point = scene.sample_point(patch, place[0], place[1], redraw);
    let far = match scene.trace_from(patch, point, direction) {
        Some(hit) => scene.patch_of(&hit).map_or(Far::Back, Far::Patch),
        None => Far::Sky,
    };
    Some((direction, far))
}
