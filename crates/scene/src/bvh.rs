//! Rays through a patch scene: the only file that knows the ray kernel.
//!
//! Offsets against hitting one's own surface live here, so that nobody else has to think of them.

use glam::DVec3;
use twinray_rays::{NO_TRIANGLE, Ray};

use crate::authored::Opacity;
use crate::patch::{PatchId, PatchScene, Side};

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// The triangle.
    pub triangle: u32,
    /// The side that was met.
    pub side: Side,
    /// Barycentric weight of vertex 1.
    pub u: f64,
    /// Barycentric weight of vertex 2.
    pub v: f64,
    /// Distance in units of the direction's length.
    pub t: f64,
}

impl PatchScene {
    /// The first surface that a ray from a free point (a camera, the sky) meets.
    pub fn trace(&self, origin: DVec3, direction: DVec3) -> Option<SurfaceHit> {
        self.closest(origin, direction, NO_TRIANGLE)
    }

    /// The first surface that a ray from `point` on `patch` meets; the ray leaves on the patch's side.
    #[inline]
    pub fn trace_from(&self, patch: PatchId, point: DVec3, direction: DVec3) -> Option<SurfaceHit> {
        self.closest(lifted(point, self.normal(patch)), direction, self.triangle_of(patch))
    }

    /// The patch of a hit; `None` on the absorbing back of a one-sided surface.
    #[inline]
    pub fn patch_of(&self, hit: &SurfaceHit) -> Option<PatchId> {
        self.patch_at(hit.triangle, hit.side, hit.u, hit.v)
    }

    /// True if the open segment between two points above surfaces is free. The points are lifted along the given
    /// unit normals by the distance that rounding asks for.
    pub fn visible(&self, a: DVec3, normal_a: DVec3, b: DVec3, normal_b: DVec3) -> bool {
        let (from, to) = (lifted(a, normal_a), lifted(b, normal_b));
        let d = to - from;
        let ray = Ray { t_max: 1.0, ..kernel_ray(from, d, NO_TRIANGLE) };
        if self.has_holes() {
            self.kernel.closest_hit_where(&ray, |h| self.accept(h)).is_none()
        } else {
            !self.kernel.occluded(&ray)
        }
    }

    #[inline]
    fn closest(&self, origin: DVec3, direction: DVec3, skip: u32) -> Option<SurfaceHit> {
        let ray = kernel_ray(origin, direction, skip);
        let hit = if self.has_holes() {
            self.kernel.closest_hit_where(&ray, |h| self.accept(h))
        } else {
            self.kernel.closest_hit(&ray)
        }?;
        Some(SurfaceHit {
            triangle: hit.triangle,
            side: if hit.front { Side::Front } else { Side::Back },
            u: f64::from(hit.u),
            v: f64::from(hit.v),
            t: f64::from(hit.t),
        })
    }

    fn has_holes(&self) -> bool {
        self.materials.iter().any(|m| m.opacity != Opacity::Opaque)
    }

    fn accept(&self, hit: &twinray_rays::Hit) -> bool {
        let material = self.triangles[hit.triangle as usize].material as usize;
        self.materials[material].opacity == Opacity::Opaque
            || self.is_present(hit.triangle, f64::from(hit.u), f64::from(hit.v))
    }
}

fn kernel_ray(origin: DVec3, direction: DVec3, skip: u32) -> Ray {
    Ray { origin: origin.as_vec3().to_array(), direction: direction.as_vec3().to_array(), t_max: f32::INFINITY, skip }
}

/// A point moved off its surface by a few units in the last place of single precision, in which the kernel
/// works: enough that a coplanar neighbour cannot be met from behind, and far below a millimetre indoors.
#[inline]
fn lifted(point: DVec3, normal: DVec3) -> DVec3 {
    let scale = point.abs().max_element().max(1e-3);
    point + normal * (scale * (1.0 / (1u64 << 20) as f64))
}
