//! The eight-lane tests in AVX2, operation for operation the portable ones of `lanes`.
//!
//! The engine's only intrinsics. `bvh` takes this path where the processor has it.

use std::arch::x86_64::*;

use crate::lanes::Lanes;
use crate::node::{LANES, Leaf, Node};
use crate::ray::PreparedRay;

/// Eight lanes in one AVX register. Whoever names this type must run on a processor with AVX2.
pub(crate) struct Avx2;

impl Lanes for Avx2 {
    #[inline(always)]
    fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]) {
        // SAFETY: AVX2 is present by the condition on `Avx2`.
        #[allow(unsafe_code)]
        unsafe {
            boxes(node, ray, t_cull)
        }
    }

    #[inline(always)]
    fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32 {
        // SAFETY: AVX2 is present by the condition on `Avx2`.
        #[allow(unsafe_code)]
        unsafe {
            triangles(leaf, ray)
        }
    }
}

#[inline]
#[target_feature(enable = "avx2")]
fn boxes(node: &Node, ray: &PreparedRay, t_cull: f32) -> (u32, [f32; LANES]) {
    let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(t_cull));
    for axis in 0..3 {
        let from_near = _mm256_sub_ps(load(&node.planes[ray.near_plane[axis]]), _mm256_set1_ps(ray.near_origin[axis]));
        let from_far = _mm256_sub_ps(load(&node.planes[ray.far_plane[axis]]), _mm256_set1_ps(ray.far_origin[axis]));
        let t_enter = _mm256_mul_ps(from_near, _mm256_set1_ps(ray.near_reciprocal[axis]));
        let t_leave = _mm256_mul_ps(from_far, _mm256_set1_ps(ray.far_reciprocal[axis]));
        // Of a NaN and a number these return the second operand.
        near = _mm256_max_ps(t_enter, near);
        far = _mm256_min_ps(t_leave, far);
    }
    let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far));
    (mask as u32, store(near))
}

#[inline]
#[target_feature(enable = "avx2")]
fn triangles(leaf: &Leaf, ray: &PreparedRay) -> u32 {
    let [x, y, z] = ray.axes;
    let origin = ray.axes.map(|axis| _mm256_set1_ps(ray.origin[axis]));
    let shear = ray.shear.map(|s| _mm256_set1_ps(s));
    let sheared = |vertex: &[[f32; LANES]; 3]| {
        let to_z = _mm256_sub_ps(load(&vertex[z]), origin[2]);
        let to_x = _mm256_sub_ps(_mm256_sub_ps(load(&vertex[x]), origin[0]), _mm256_mul_ps(shear[0], to_z));
        let to_y = _mm256_sub_ps(_mm256_sub_ps(load(&vertex[y]), origin[1]), _mm256_mul_ps(shear[1], to_z));
        [to_x, to_y]
    };
    let [a, b, c] = &leaf.vertices;
    let (a, b, c) = (sheared(a), sheared(b), sheared(c));

    let edge = |p: [__m256; 2], q: [__m256; 2]| _mm256_sub_ps(_mm256_mul_ps(p[0], q[1]), _mm256_mul_ps(p[1], q[0]));
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let zero = _mm256_setzero_ps();
    let not_negative = |e| _mm256_cmp_ps::<_CMP_GE_OQ>(e, zero);
    let not_positive = |e| _mm256_cmp_ps::<_CMP_LE_OQ>(e, zero);
    let left = _mm256_and_ps(_mm256_and_ps(not_negative(u), not_negative(v)), not_negative(w));
    let right = _mm256_and_ps(_mm256_and_ps(not_positive(u), not_positive(v)), not_positive(w));
    _mm256_movemask_ps(_mm256_or_ps(left, right)) as u32
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
