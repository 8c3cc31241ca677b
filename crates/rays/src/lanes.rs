//! The two tests on eight lanes that make up nearly all of the work of a ray: boxes of a node,
//! triangles of a leaf.
//!
//! [`Lanes`] is what the walk needs; [`Portable`] is its plain form, used where there is no faster
//! one and as the oracle of the others. Implementations must agree to the bit: same operations,
//! same order, nothing fused.

use crate::node::{LANES, Leaf, Node};
use crate::ray::PreparedRay;

/// Eight-lane tests in one instruction set.
pub(crate) trait Lanes {
    /// Which children of `node` the ray may meet at `0 <= t <= t_cull`, one bit a lane, and the
    /// distances at which it enters them (meaningless where the bit is 0). Conservative.
    fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]);

    /// Which triangles of `leaf` the line of the ray may meet, one bit a lane: all that
    /// [`crate::triangle::meet`] accepts and few others.
    fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32;
}

/// Plain loops over arrays; the compiler makes what vectors it can of them.
pub(crate) struct Portable;

impl Lanes for Portable {
    #[inline(always)]
    fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]) {
        let (mut near, mut far) = ([0.0; LANES], [t_cull; LANES]);
        for axis in 0..3 {
            let (enter, leave) =
                (&node.planes[ray.near_plane[axis] as usize], &node.planes[ray.far_plane[axis] as usize]);
            for lane in 0..LANES {
                let t_enter = (enter[lane] - ray.near_origin[axis]) * ray.near_reciprocal[axis];
                let t_leave = (leave[lane] - ray.far_origin[axis]) * ray.far_reciprocal[axis];
                // 0·inf, a parallel ray in the plane, is NaN, and must not narrow the interval:
                // hence these comparisons, this way round.
                near[lane] = if t_enter > near[lane] { t_enter } else { near[lane] };
                far[lane] = if t_leave < far[lane] { t_leave } else { far[lane] };
            }
        }
        let mut mask = 0;
        for lane in 0..LANES {
            mask |= u32::from(near[lane] <= far[lane]) << lane;
        }
        (mask, near)
    }

    #[inline(always)]
    fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32 {
        let [x, y, z] = ray.axes.map(|axis| axis as usize);
        let mut mask = 0;
        for lane in 0..LANES {
            let sheared = |vertex: usize| {
                let vertex = &leaf.vertices[vertex];
                let to_z = vertex[z][lane] - ray.origin[z];
                let to_x = (vertex[x][lane] - ray.origin[x]) - ray.shear[0] * to_z;
                let to_y = (vertex[y][lane] - ray.origin[y]) - ray.shear[1] * to_z;
                [to_x, to_y]
            };
            let (a, b, c) = (sheared(0), sheared(1), sheared(2));
            // The rounded edge functions have the right sign or are zero, because rounding is
            // monotonic: so zeros pass, and `meet` decides.
            let u = c[0] * b[1] - c[1] * b[0];
            let v = a[0] * c[1] - a[1] * c[0];
            let w = b[0] * a[1] - b[1] * a[0];
            let (min, max) = (|a, b| if a < b { a } else { b }, |a, b| if a > b { a } else { b });
            let (least, most) = (min(min(u, v), w), max(max(u, v), w));
            mask |= u32::from((0.0 <= least) | (most <= 0.0)) << lane;
        }
        mask
    }
}
