//! Rays and hits, and what is computed once per ray before the walk.
//!
//! [`Ray`] and [`Hit`] are the public values; [`PreparedRay`] holds the shear of the watertight
//! triangle test and the padded slabs of the box test. The padding is derived here, and nowhere
//! else; `lanes`, `wide` and `triangle` only use it.

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
    pub axes: [Axis; 3],
    /// `direction[x] / direction[z]` and `direction[y] / direction[z]`, magnitudes at most 1.
    pub shear: [f32; 2],
    /// `direction[z]`.
    pub direction_z: f32,
    /// Per axis, index of the plane where the ray enters and leaves a box, see
    /// [`crate::node::Node::planes`].
    pub near_plane: [Plane; 3],
    pub far_plane: [Plane; 3],
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
    /// 6·U·(X + Z); taken are 8, because X, Z and their sum are rounded too, and 2·U of the origin,
    /// because it is moved by a sum that rounds by half as much. With it the walk never culls a hit
    /// that the triangle test would accept: results equal brute force to the bit. (After Woop,
    /// Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013, section 4.)
    #[inline(always)]
    pub fn new(ray: &Ray, bounds: &[[f32; 3]; 2]) -> Option<PreparedRay> {
        let magnitude = ray.direction.map(f32::abs);
        let larger = |i: usize, j: usize| if magnitude[i] > magnitude[j] { i } else { j };
        let axes = CYCLES[larger(larger(0, 1), 2)];
        let [x, y, z] = axes.map(|axis| axis as usize);
        // Every comparison is written so that NaN fails it. All are made: to choose between them
        // would cost more.
        let in_range = |values: [f32; 3], most: f32| {
            (values[0].abs() <= most) & (values[1].abs() <= most) & (values[2].abs() <= most)
        };
        let direction_ok = in_range(magnitude, *DIRECTION_RANGE.end()) & (magnitude[z] >= *DIRECTION_RANGE.start());
        if !(direction_ok & in_range(ray.origin, MAX_COORDINATE) & (ray.t_max > 0.0)) {
            return None;
        }

        let larger = |a: f32, b: f32| if a > b { a } else { b };
        let extent: [f32; 3] = std::array::from_fn(|axis| {
            larger((ray.origin[axis] - bounds[0][axis]).abs(), (ray.origin[axis] - bounds[1][axis]).abs())
        });
        // The last term is for numbers so small that the products underflow.
        let padding: [f32; 3] = std::array::from_fn(|axis| {
            8.0 * U * (extent[axis] + extent[z]) + 2.0 * U * ray.origin[axis].abs() + f32::MIN_POSITIVE
        });
        let backward = ray.direction.map(|d| d < 0.0);
        let along: [f32; 3] = std::array::from_fn(|axis| if backward[axis] { -padding[axis] } else { padding[axis] });
        // Of a parallel ray either plane may be the near one; both signs of zero must agree with
        // the choice made here.
        let reciprocal = ray.direction.map(|d| if d == 0.0 { f32::INFINITY } else { 1.0 / d });
        Some(PreparedRay {
            origin: ray.origin,
            axes,
            shear: [ray.direction[x] / ray.direction[z], ray.direction[y] / ray.direction[z]],
            direction_z: ray.direction[z],
            near_plane: std::array::from_fn(|axis| if backward[axis] { HIGH[axis] } else { LOW[axis] }),
            far_plane: std::array::from_fn(|axis| if backward[axis] { LOW[axis] } else { HIGH[axis] }),
            near_origin: std::array::from_fn(|axis| ray.origin[axis] + along[axis]),
            far_origin: std::array::from_fn(|axis| ray.origin[axis] - along[axis]),
            near_reciprocal: reciprocal,
            far_reciprocal: reciprocal.map(|r| r * FAR_SLACK),
            t_max: ray.t_max,
            skip: ray.skip,
        })
    }
}

/// An index of three, which the compiler knows to be below three.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(usize)]
pub(crate) enum Axis {
    X = 0,
    Y = 1,
    Z = 2,
}

/// The axes in cyclic order, by the last of them.
const CYCLES: [[Axis; 3]; 3] = [[Axis::Y, Axis::Z, Axis::X], [Axis::Z, Axis::X, Axis::Y], [Axis::X, Axis::Y, Axis::Z]];

/// An index of [`crate::node::Node::planes`], likewise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(usize)]
pub(crate) enum Plane {
    LowX = 0,
    LowY = 1,
    LowZ = 2,
    HighX = 3,
    HighY = 4,
    HighZ = 5,
}

const LOW: [Plane; 3] = [Plane::LowX, Plane::LowY, Plane::LowZ];
const HIGH: [Plane; 3] = [Plane::HighX, Plane::HighY, Plane::HighZ];
