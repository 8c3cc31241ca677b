//! Rays through a patch scene: the only file that knows the ray kernel.
//!
//! Offsets against hitting one's own surface live here, so that nobody else has to think of them.

use glam::DVec3;
use twinray_rays::{Hit, NO_TRIANGLE, Ray};

use crate::authored::Opacity;
use crate::geom::area_vector_2;
use crate::patch::{PatchId, PatchScene, Side, Triangle};

/// Distance by which rays start above their surface, relative to the largest coordinate: eight units in the last
/// place.
const LIFT: f64 = 1.0 / (1u64 << 20) as f64;

/// How far, relative to its largest coordinate, rounding can move a triangle's plane: the sheared vertices of the
/// kernel are wrong by at most 12 units of 2⁻²⁴ (`ray.rs` of `rays` derives six relative to a distance that is twice
/// the coordinate), the lift is sixteen.
const PLANE: f64 = 28.0 / (1u64 << 24) as f64;

/// Hits lower than this above a patch's plane, relative to the scene's radius, are looked at twice.
const LOW: f64 = 1.0 / (1u64 << 16) as f64;

/// How far apart the two sides of one sheet may be: the rounding of vertices alone.
const SHEET: f64 = 4.0 / (1u64 << 24) as f64;

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
        self.leave(self.triangle_of(patch), self.normal(patch), point, direction)
    }

    /// The first surface that a ray from `point` on the triangle `own` meets; `normal` is the triangle's, on the side to
    /// which the ray leaves.
    #[inline]
    pub fn leave(&self, own: u32, normal: DVec3, point: DVec3, direction: DVec3) -> Option<SurfaceHit> {
        let origin = self.lifted(point, normal);
        let hit = self.closest(origin, direction, own)?;
        // How high above the patch's plane the hit is; only the lowest can be neighbours in that plane.
        let height = |t: f64| (origin - point).dot(normal) + t * direction.dot(normal);
        if height(hit.t) > LOW * self.radius() {
            return Some(hit);
        }
        let above = |triangle, t| !self.is_in_plane(own, point, triangle, height(t));
        if above(hit.triangle, hit.t) {
            return Some(hit);
        }
        let ray = kernel_ray(origin, direction, own);
        let other = |h: &Hit| self.accept(h) && above(h.triangle, f64::from(h.t));
        self.kernel.closest_hit_where(&ray, other).map(|h| surface_hit(&h))
    }

    /// True if `triangle`, met low above a `point` of the triangle `own`, lies in the same plane and was met by
    /// rounding alone.
    ///
    /// The kernel sees vertices relative to the origin of the ray in single precision: a plane is known to some units
    /// in the last place of its *farthest* vertex, which no fixed lift covers without being too high elsewhere. At such
    /// angles not even the side that was met is certain, nor where; the way the triangles face is. What faces the other
    /// way may be the far side of a thin gap: only if it is no farther than vertices are rounded is it the back of
    /// the same sheet.
    #[cold]
    fn is_in_plane(&self, own: u32, point: DVec3, triangle: u32, height: f64) -> bool {
        let (own, other) = (&self.triangles[own as usize], &self.triangles[triangle as usize]);
        let corners = |t: &Triangle| [0, 1, 2].map(|i| t.vertex(i));
        let largest = |m: f64, v: DVec3| m.max(v.abs().max_element());
        let scale = corners(own).into_iter().chain(corners(other)).fold(0.0, largest);
        let alike = own.normal.dot(other.normal);
        if alike < 0.0 {
            return alike < -0.9999 && height <= SHEET * scale;
        }
        // A small triangle's normal is tilted by the rounding of its vertices, which counts at a distance.
        let [a, b, c] = corners(own);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let tilt = SHEET * scale * longest / area_vector_2(a, b, c).length();
        corners(other).iter().all(|&v| {
            let away = v - point;
            away.dot(own.normal).abs() <= PLANE * scale + tilt * away.length()
        })
    }

    /// The first surface beyond `point` on the triangle `own` that a ray through it meets; `normal` is the triangle's, on the
    /// side that the ray comes from. What lies in the same place is met at once: glass may stand against a wall.
    #[inline]
    pub fn beyond(&self, own: u32, normal: DVec3, point: DVec3, direction: DVec3) -> Option<SurfaceHit> {
        self.closest(self.lifted(point, normal), direction, own)
    }

    /// The patch of a hit; `None` on the absorbing back of a one-sided surface.
    #[inline]
    pub fn patch_of(&self, hit: &SurfaceHit) -> Option<PatchId> {
        self.patch_at(hit.triangle, hit.side, hit.u, hit.v)
    }

    /// True if the open segment between two points above surfaces is free. The points are lifted along the given
    /// unit normals by the distance that rounding asks for.
    pub fn visible(&self, a: DVec3, normal_a: DVec3, b: DVec3, normal_b: DVec3) -> bool {
        let (from, to) = (self.lifted(a, normal_a), self.lifted(b, normal_b));
        let d = to - from;
        let ray = Ray { t_max: 1.0, ..kernel_ray(from, d, NO_TRIANGLE) };
        if self.holes {
            self.kernel.closest_hit_where(&ray, |h| self.accept(h)).is_none()
        } else {
            !self.kernel.occluded(&ray)
        }
    }

    #[inline]
    pub(crate) fn closest(&self, origin: DVec3, direction: DVec3, skip: u32) -> Option<SurfaceHit> {
        let ray = kernel_ray(origin, direction, skip);
        let hit = if self.holes {
            self.kernel.closest_hit_where(&ray, |h| self.accept(h))
        } else {
            self.kernel.closest_hit(&ray)
        }?;
        Some(surface_hit(&hit))
    }

    fn accept(&self, hit: &Hit) -> bool {
        let material = self.triangles[hit.triangle as usize].material as usize;
        self.materials[material].opacity == Opacity::Opaque
            || self.is_present(hit.triangle, f64::from(hit.u), f64::from(hit.v))
    }

    /// A point moved off its surface by a few units in the last place of single precision, in which the kernel
    /// works: far below a millimetre indoors. What this does not keep apart, `is_in_plane` does.
    #[inline]
    pub(crate) fn lifted(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let scale = point.abs().max_element().max(1e-3 * self.radius());
        point + normal * (scale * LIFT)
    }
}

fn surface_hit(hit: &Hit) -> SurfaceHit {
    SurfaceHit {
        triangle: hit.triangle,
        side: if hit.front { Side::Front } else { Side::Back },
        u: f64::from(hit.u),
        v: f64::from(hit.v),
        t: f64::from(hit.t),
    }
}

fn kernel_ray(origin: DVec3, direction: DVec3, skip: u32) -> Ray {
    Ray { origin: origin.as_vec3().to_array(), direction: direction.as_vec3().to_array(), t_max: f32::INFINITY, skip }
}
