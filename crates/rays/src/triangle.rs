//! The exact ray–triangle test, one triangle at a time, and the order in which a leaf stores
//! vertices.
//!
//! The eight-lane tests of `lanes` and `wide` only sift: what they let through is decided here, in
//! `f64`. Source: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013,
//! with the double-precision path for every candidate instead of for zero edge functions only.
//! Candidates are few (about two per ray), so this is free, and `t` stays on the triangle however
//! thin it is.

use crate::node::Leaf;
use crate::ray::{Hit, MAX_COORDINATE, PreparedRay};

/// Orders of stored vertices: entry `[o][i]` is the author's index of stored vertex `i`. The first
/// three are rotations (even), the last three change the winding.
pub(crate) const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// First odd entry of [`ORDERS`].
const FIRST_ODD: usize = 3;

/// Whether rays can hit the triangle at all: all coordinates within ±[`MAX_COORDINATE`] (not NaN),
/// and an area above zero.
pub(crate) fn can_be_hit(triangle: &[[f32; 3]; 3]) -> bool {
    if !triangle.iter().flatten().all(|c| c.abs() <= MAX_COORDINATE) {
        return false;
    }
    let [a, b, c] = triangle.map(|v| v.map(f64::from));
    let (e, f) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    e[1] * f[2] != e[2] * f[1] || e[2] * f[0] != e[0] * f[2] || e[0] * f[1] != e[1] * f[0]
}

/// The triangle with its vertices in lexicographic order, and the index of that order in
/// [`ORDERS`].
///
/// Coincident triangles are thereby stored alike, whatever their author's order, so a ray meets
/// them at the same `t` to the bit and the tie rule decides. Negative zeros become positive ones,
/// because the two compare equal.
pub(crate) fn canonical(triangle: &[[f32; 3]; 3]) -> ([[f32; 3]; 3], usize) {
    let vertices = triangle.map(|v| v.map(|c| c + 0.0));
    let sorted =
        |order: &[usize; 3]| vertices[order[0]] <= vertices[order[1]] && vertices[order[1]] <= vertices[order[2]];
    let order = ORDERS.iter().position(sorted).expect("finite vertices have an order");
    (ORDERS[order].map(|i| vertices[i]), order)
}

/// Where `ray` meets the triangle in `lane` of `leaf`, if it does so at `0 < t <= t_limit`.
#[inline(always)]
pub(crate) fn meet(leaf: &Leaf, lane: usize, ray: &PreparedRay, t_limit: f32) -> Option<Hit> {
    // The sheared frame: the ray becomes the z axis. Rounded to f32 exactly as in the lanes, so
    // that triangles that share a vertex see it at the same place; everything after this is a
    // question about those rounded vertices and is answered without error in sign.
    let [x, y, z] = ray.axes.map(|axis| axis as usize);
    let sheared = leaf.vertices.each_ref().map(|vertex| {
        let to_z = vertex[z][lane] - ray.origin[z];
        let to_x = (vertex[x][lane] - ray.origin[x]) - ray.shear[0] * to_z;
        let to_y = (vertex[y][lane] - ray.origin[y]) - ray.shear[1] * to_z;
        [to_x, to_y, to_z].map(f64::from)
    });
    let [a, b, c] = &sheared;

    // Edge functions: products of two f32 are exact in f64, so only the difference rounds, and
    // rounding keeps its sign. Zero counts as inside for both neighbours of an edge.
    let weights = [c[0] * b[1] - c[1] * b[0], a[0] * c[1] - a[1] * c[0], b[0] * a[1] - b[1] * a[0]];
    let (negative, positive) = (weights.iter().any(|w| *w < 0.0), weights.iter().any(|w| *w > 0.0));
    if negative == positive {
        return None; // outside, or seen edge-on
    }

    let determinant = weights[0] + weights[1] + weights[2];
    let along_z = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
    let t = (along_z / (determinant * f64::from(ray.direction_z))) as f32;
    if !(t > 0.0 && t <= t_limit) {
        return None;
    }

    // Back to the author's order. The determinant is positive if the stored order is
    // counter-clockwise as seen by a ray that runs towards positive z.
    let label = leaf.labels[lane];
    let mut author = [0.0; 3];
    for (weight, &vertex) in weights.iter().zip(&ORDERS[label.order()]) {
        author[vertex] = *weight;
    }
    Some(Hit {
        t,
        triangle: label.id(),
        u: (author[1] / determinant) as f32,
        v: (author[2] / determinant) as f32,
        front: (determinant > 0.0) ^ (ray.direction_z < 0.0) ^ (label.order() >= FIRST_ODD),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_order_is_stored_alike() {
        // Shared coordinates and zeros of both signs decide late or not at all.
        let triangle = [[0.0, 1.0, -0.0], [-0.0, 1.0, 2.0], [0.0, -3.0, 5.0]];
        let stored = [[0.0, -3.0, 5.0], [0.0, 1.0, 0.0], [0.0, 1.0, 2.0]];
        for order in ORDERS {
            let author = order.map(|i| triangle[i]);
            let (vertices, at) = canonical(&author);
            let bits = |v: [[f32; 3]; 3]| v.map(|v| v.map(f32::to_bits));
            assert_eq!(bits(vertices), bits(stored), "{order:?}");
            assert_eq!(ORDERS[at].map(|i| author[i]), stored, "{order:?}");
        }
    }
}
