//! Rays and hits, and what is computed once per ray before the walk.
//!
//! [`Ray`] and [`Hit`] are the public values; [`PreparedRay`] holds the shear of the watertight
//! triangle test and the padded slabs of the box test. The padding is derived here, and nowhere
//! else; `lanes`, `avx2` and `triangle` only use it.

/// The value of [`Ray::skip`] that skips nothing.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Half a unit in the last place, relative: the rounding error of one operation.
const U: f32 = f32::EPSILON / 2.0;

/// Largest magnitude of a coordinate. Beyond it products of three lengths could overflow, so such
/// triangles are left out and such rays hit nothing.
pub(crate) const MAX_COORDINATE: f32 = 1e18;

/// Range of a direction's largest component, chosen so that neither it nor its reciprocal times a
/// length leaves the range of `f32`.
const DIRECTION_RANGE: std::ops::RangeInclusive<f32> = 1e-18..=1e18;

/// Factor on far distances of the slab test: `(plane - origin) * reciprocal` carries three
/// roundings on the near and on the far side, so 1 + 2·gamma(3) = 1 + 6·U suffices (Ize, "Robust
/// BVH Ray Traversal", JCGT 2013); two more for the roundings of this product.
pub(crate) const FAR_SLACK: f32 = 1.0 + 8.0 * U;

/// A ray, or a segment of one: the points `origin + t * direction` with `0 < t <= t_max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in the frame and unit of the triangles. Magnitudes beyond 1e18 hit
    /// nothing.
    pub origin: [f32; 3],
    /// Where it goes; need not be unit length. A ray hits nothing if a component is NaN or
    /// infinite, or if the largest one has a magnitude outside 1e-18 … 1e18 (zero among them).
    pub direction: [f32; 3],
    /// End of the ray in units of `direction`; hits at exactly `t_max` count. May be infinite; NaN
    /// hits nothing.
    pub t_max: f32,
    /// The triangle the ray starts on, which it ignores; [`NO_TRIANGLE`] (`u32::MAX`) for none.
    pub skip: u32,
}

impl Ray {
    /// The unbounded ray that ignores no triangle.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray { origin, direction, t_max: f32::INFINITY, skip: NO_TRIANGLE }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction, `0 < t <= t_max`.
    pub t: f32,
    /// Index of the triangle in the slice the [`Bvh`](crate::Bvh) was built from.
    pub triangle: u32,
    /// Barycentric weight of the triangle's vertex 1, in the author's order, in 0 … 1.
    pub u: f32,
    /// Barycentric weight of the triangle's vertex 2, in the author's order; vertex 0 has the
    /// weight `1 - u - v`.
    pub v: f32,
    /// Whether the ray meets the side from which the vertices are counter-clockwise.
    pub front: bool,
}

impl Hit {
    /// Whether this hit wins over `other`: nearer, or as near and front-facing, or as near and of
    /// the lower id.
    #[inline(always)]
    pub(crate) fn beats(&self, other: &Hit) -> bool {
        if self.t != other.t {
            return self.t < other.t;
        }
        (!self.front, self.triangle) < (!other.front, other.triangle)
    }
}

/// Everything the tests need to know of a ray.
#[derive(Clone, Debug)]
pub(crate) struct PreparedRay {
    pub origin: [f32; 3],
    /// The axes x, y, z of the sheared frame: z is the one along which the direction is largest, x
    /// and y follow cyclically.
    pub axes: [usize; 3],
    /// `direction[x] / direction[z]` and `direction[y] / direction[z]`, magnitudes at most 1.
    pub shear: [f32; 2],
    /// `direction[z]`.
    pub direction_z: f32,
    /// Per axis, index of the plane where the ray enters and leaves a box, see
    /// [`crate::node::Node::planes`].
    pub near_plane: [usize; 3],
    pub far_plane: [usize; 3],
    /// Per axis, the origin moved against and along the direction, so that boxes look larger by the
    /// padding.
    pub near_origin: [f32; 3],
    pub far_origin: [f32; 3],
    /// Per axis, `1 / direction` (infinite for 0), the far one times [`FAR_SLACK`].
    pub near_reciprocal: [f32; 3],
    pub far_reciprocal: [f32; 3],
    pub t_max: f32,
    pub skip: u32,
}

impl PreparedRay {
    /// Constants of `ray` for a tree whose boxes all lie in `bounds`; `None` if the ray cannot hit
    /// anything.
    ///
    /// The padding: a hit at `t` is found by `triangle` on vertices whose sheared coordinates carry
    /// rounding errors. Let X and Z be the largest distances from the origin to the bounds along an
    /// axis and along z, and U the unit roundoff. The coordinate x of a sheared vertex is then
    /// wrong by at most 2·U·X + 4·U·Z, and `t` (computed in `f64` from the rounded z) moves the
    /// point by 2·U·Z more. So all that the triangle test can accept lies in the box widened by
    /// 6·U·(X + Z); taken are 8, because X, Z and the sum below are rounded too. With it the walk
    /// never culls a hit that the triangle test would accept: results equal brute force to the bit.
    /// (After Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013, section 4.)
    #[inline(always)]
    pub fn new(ray: &Ray, bounds: &[[f32; 3]; 2]) -> Option<PreparedRay> {
        let magnitude = ray.direction.map(f32::abs);
        let z = if magnitude[0] > magnitude[1] {
            if magnitude[0] > magnitude[2] { 0 } else { 2 }
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        // Every comparison is written so that NaN fails it.
        let direction_ok =
            magnitude.iter().all(|&m| m <= *DIRECTION_RANGE.end()) && magnitude[z] >= *DIRECTION_RANGE.start();
        let origin_ok = ray.origin.iter().all(|o| o.abs() <= MAX_COORDINATE);
        let t_max_ok = ray.t_max > 0.0;
        if !(direction_ok && origin_ok && t_max_ok) {
            return None;
        }

        let axes = [NEXT[z], NEXT[NEXT[z]], z];
        let extent = |axis: usize| {
            let (below, above) =
                ((ray.origin[axis] - bounds[0][axis]).abs(), (ray.origin[axis] - bounds[1][axis]).abs());
            if below > above { below } else { above }
        };
        let mut prepared = PreparedRay {
            origin: ray.origin,
            axes,
            shear: [ray.direction[axes[0]] / ray.direction[z], ray.direction[axes[1]] / ray.direction[z]],
            direction_z: ray.direction[z],
            near_plane: [0; 3],
            far_plane: [0; 3],
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            near_reciprocal: [0.0; 3],
            far_reciprocal: [0.0; 3],
            t_max: ray.t_max,
            skip: ray.skip,
        };
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            let padding = 8.0 * U * (extent(axis) + extent(z));
            // Far from zero the padding is lost in the rounding of the sum; the step to the next
            // float is then at least as large.
            let (below, above) = ((origin - padding).next_down(), (origin + padding).next_up());
            // Of a parallel ray either plane may be the near one; both signs of zero must agree
            // with the choice made here.
            let reciprocal = if direction == 0.0 { f32::INFINITY } else { 1.0 / direction };
            if direction < 0.0 {
                (prepared.near_plane[axis], prepared.far_plane[axis]) = (axis + 3, axis);
                (prepared.near_origin[axis], prepared.far_origin[axis]) = (below, above);
            } else {
                (prepared.near_plane[axis], prepared.far_plane[axis]) = (axis, axis + 3);
                (prepared.near_origin[axis], prepared.far_origin[axis]) = (above, below);
            }
            prepared.near_reciprocal[axis] = reciprocal;
            prepared.far_reciprocal[axis] = reciprocal * FAR_SLACK;
        }
        Some(prepared)
    }
}

/// The axis after each, cyclically.
const NEXT: [usize; 3] = [1, 2, 0];
