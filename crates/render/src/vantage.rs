//! Points over surfaces that see each other or do not, although surfaces bend.

use glam::DVec3;
use twinray_scene::{PatchId, PatchScene};

/// Share of the rise between two points by which both are lifted: the chord of an arc runs below it by a part of that.
const BEND: f64 = 0.4;

/// A point over a surface.
#[derive(Clone, Copy, Debug)]
pub struct Vantage {
    /// On the surface.
    pub point: DVec3,
    normal: DVec3,
    /// How far it may be lifted: half of the way to what is above it. Sheets may lie closer to each other than they rise.
    clearance: f64,
}

impl Vantage {
    /// A point of `patch` with its display normal.
    pub fn new(scene: &PatchScene, patch: PatchId, point: DVec3, normal: DVec3) -> Self {
        let above = scene.trace_from(patch, point, normal);
        Self { point, normal, clearance: above.map_or(f64::INFINITY, |hit| 0.5 * hit.t) }
    }

    /// True if nothing is between two points that are lifted off their surfaces, by `lift` where these are plane.
    pub fn sees(&self, other: &Self, scene: &PatchScene, lift: f64) -> bool {
        let offset = other.point - self.point;
        let rise = offset.dot(self.normal).abs().max(offset.dot(other.normal).abs());
        let lifted = |v: &Self| v.point + v.normal * (lift + BEND * rise).min(v.clearance);
        scene.visible(lifted(self), self.normal, lifted(other), other.normal)
    }
}
