//! The eight-lane tests in vector registers, operation for operation the portable ones of `lanes`.
//!
//! The engine's only intrinsics: written once, in a macro, and compiled for each instruction set
//! with all that the walk inlines. `bvh` takes the widest that the processor has.

use std::arch::x86_64::*;

use crate::bvh::Bvh;
use crate::lanes::Lanes;
use crate::node::{LANES, Leaf, Node};
use crate::ray::{Hit, PreparedRay, Ray};

/// Defines `$name`, eight lanes in one register with `$features` switched on; `$at_most` compares
/// two registers and returns one bit a lane.
macro_rules! eight_lanes {
    ($(#[$about:meta])* $name:ident, $features:literal, [$($feature:tt)*], $at_most:ident) => {
        $(#[$about])*
        /// Whoever names this type must run on a processor where it is [`Self::detected`].
        pub(crate) struct $name;

        impl $name {
            pub fn detected() -> bool {
                true $(&& is_x86_feature_detected!($feature))*
            }

            #[target_feature(enable = $features)]
            pub fn closest(bvh: &Bvh, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
                bvh.closest::<$name>(&bvh.prepare(ray)?, accept)
            }

            #[target_feature(enable = $features)]
            pub fn any(bvh: &Bvh, ray: &Ray) -> bool {
                bvh.prepare(ray).is_some_and(|ray| bvh.any::<$name>(&ray))
            }
        }

        impl Lanes for $name {
            #[inline(always)]
            fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]) {
                #[inline]
                #[target_feature(enable = $features)]
                fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]) {
                    let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(t_cull));
                    for axis in 0..3 {
                        let [enter, leave] = [ray.near_plane, ray.far_plane].map(|p| load(&node.planes[p[axis] as usize]));
                        let from_near = _mm256_sub_ps(enter, _mm256_set1_ps(ray.near_origin[axis]));
                        let from_far = _mm256_sub_ps(leave, _mm256_set1_ps(ray.far_origin[axis]));
                        let t_enter = _mm256_mul_ps(from_near, _mm256_set1_ps(ray.near_reciprocal[axis]));
                        let t_leave = _mm256_mul_ps(from_far, _mm256_set1_ps(ray.far_reciprocal[axis]));
                        // Of a NaN and a number these return the second operand.
                        near = _mm256_max_ps(t_enter, near);
                        far = _mm256_min_ps(t_leave, far);
                    }
                    ($at_most(near, far), store(near))
                }
                // SAFETY: the features are present by the condition on the type.
                #[allow(unsafe_code)]
                unsafe {
                    boxes(node, ray, t_cull)
                }
            }

            #[inline(always)]
            fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32 {
                #[inline]
                #[target_feature(enable = $features)]
                fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32 {
                    let [x, y, z] = ray.axes;
                    let origin = ray.axes.map(|axis| _mm256_set1_ps(ray.origin[axis as usize]));
                    let shear = ray.shear.map(|s| _mm256_set1_ps(s));
                    let sheared = |vertex: &[[f32; LANES]; 3]| {
                        let [x, y, z] = [x, y, z].map(|axis| load(&vertex[axis as usize]));
                        let to_z = _mm256_sub_ps(z, origin[2]);
                        let to_x = _mm256_sub_ps(_mm256_sub_ps(x, origin[0]), _mm256_mul_ps(shear[0], to_z));
                        let to_y = _mm256_sub_ps(_mm256_sub_ps(y, origin[1]), _mm256_mul_ps(shear[1], to_z));
                        [to_x, to_y]
                    };
                    let [a, b, c] = &leaf.vertices;
                    let (a, b, c) = (sheared(a), sheared(b), sheared(c));

                    let edge = |p: [__m256; 2], q: [__m256; 2]| {
                        _mm256_sub_ps(_mm256_mul_ps(p[0], q[1]), _mm256_mul_ps(p[1], q[0]))
                    };
                    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
                    let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
                    let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
                    let zero = _mm256_setzero_ps();
                    $at_most(zero, least) | $at_most(most, zero)
                }
                // SAFETY: the features are present by the condition on the type.
                #[allow(unsafe_code)]
                unsafe {
                    triangles(leaf, ray)
                }
            }
        }
    };
}

eight_lanes! {
    /// AVX2, as processors have it since 2013 (Intel) and 2015 (AMD), with what came along.
    Avx2, "avx2,bmi1,bmi2,lzcnt,popcnt", ["avx2" "bmi1" "bmi2" "lzcnt" "popcnt"], at_most_avx2
}

eight_lanes! {
    /// AVX-512 on registers of eight lanes, for its comparisons into masks and its broadcasts from
    /// memory.
    Avx512, "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512dq,avx512bw",
    ["avx2" "bmi1" "bmi2" "lzcnt" "popcnt" "avx512f" "avx512vl" "avx512dq" "avx512bw"], at_most_avx512
}

#[inline]
#[target_feature(enable = "avx2")]
fn at_most_avx2(a: __m256, b: __m256) -> u32 {
    _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32
}

#[inline]
#[target_feature(enable = "avx512f,avx512vl")]
fn at_most_avx512(a: __m256, b: __m256) -> u32 {
    u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b))
}

#[inline]
#[target_feature(enable = "avx2")]
fn load(lanes: &[f32; LANES]) -> __m256 {
    // SAFETY: the reference covers the 32 bytes that are read; unaligned loads ask no more.
    #[allow(unsafe_code)]
    unsafe {
        _mm256_loadu_ps(lanes.as_ptr())
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn store(lanes: __m256) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    // SAFETY: `out` has the 32 bytes that are written; unaligned stores ask no more.
    #[allow(unsafe_code)]
    unsafe {
        _mm256_storeu_ps(out.as_mut_ptr(), lanes);
    }
    out
}
