//! What a straight line of sight lets through: nothing beyond surfaces, a part beyond clear panes.
//!
//! Panes do not bend light, so that shadow rays may follow it through them. Not here: bodies of glass, behind which only
//! paths that are bent find light.

use glam::DVec3;

use crate::brdf::Detail;
use crate::bvh::SurfaceHit;
use crate::patch::{PatchId, PatchScene, Side};
use crate::rgb::Rgb;

/// Panes behind each other that are looked through.
const MOST_PANES: u32 = 16;

impl PatchScene {
    /// The share of light that passes the open segment between two points above surfaces: 0 or 1 but for panes. The
    /// points are lifted along the given unit normals as in [`PatchScene::visible`].
    pub fn transmittance(&self, a: DVec3, normal_a: DVec3, b: DVec3, normal_b: DVec3) -> Rgb {
        if !self.has_panes() {
            return if self.visible(a, normal_a, b, normal_b) { Rgb::WHITE } else { Rgb::BLACK };
        }
        let [from, to] = [self.lifted(a, normal_a), self.lifted(b, normal_b)];
        let direction = to - from;
        self.through_panes(from, direction, self.trace(from, direction), 1.0)
    }

    /// The share of light that reaches `point` on `patch` from infinitely far away in direction `towards`.
    pub fn transmittance_from_sky(&self, patch: PatchId, point: DVec3, towards: DVec3) -> Rgb {
        let hit = self.trace_from(patch, point, towards);
        if !self.has_panes() {
            return if hit.is_none() { Rgb::WHITE } else { Rgb::BLACK };
        }
        self.through_panes(point, towards, hit, f64::INFINITY)
    }

    /// What panes let through up to parameter `end` of a ray whose first hit is known.
    fn through_panes(&self, origin: DVec3, direction: DVec3, first: Option<SurfaceHit>, end: f64) -> Rgb {
        let length = direction.length();
        let (mut share, mut hit, mut gone) = (Rgb::WHITE, first, 0.0);
        for _ in 0..MOST_PANES {
            let Some(met) = hit.filter(|h| gone + h.t < end) else { return share };
            let Some(passed) = self.pane_transmittance(&met, direction / length) else { return Rgb::BLACK };
            share = share * passed;
            if share.is_black() {
                return Rgb::BLACK;
            }
            gone += met.t;
            let front = self.triangles[met.triangle as usize].normal;
            let before = if front.dot(direction) > 0.0 { -front } else { front };
            hit = self.beyond(met.triangle, before, origin + direction * gone, direction);
        }
        Rgb::BLACK
    }

    /// What a pane lets through of light along `direction`; `None` if it is none.
    fn pane_transmittance(&self, hit: &SurfaceHit, direction: DVec3) -> Option<Rgb> {
        let triangle = &self.triangles[hit.triangle as usize];
        self.materials[triangle.material as usize].transmission.as_ref()?;
        let specular = self.scatter_at(hit, Detail::Picture).specular.filter(|s| s.is_pane())?;
        let cosine = triangle.normal.dot(direction).abs();
        Some(specular.throughput(cosine, hit.side == Side::Back)[1])
    }
}
