//! Tests of the tree and the walk against brute force with the same triangle test.
//!
//! Whatever the tree, the padding and the lanes do, the outcome must be that of [`meet`] asked
//! about every triangle: to the bit, in every instruction set. What [`meet`] itself promises is
//! tested from outside, in `tests/it`.

mod limits;
mod shapes;

use crate::Bvh;
use crate::lanes::{Lanes, Portable};
use crate::node::{Label, Leaf};
use crate::ray::{Hit, PreparedRay, Ray};
use crate::triangle::{can_be_hit, canonical, meet};
#[cfg(target_arch = "x86_64")]
use crate::wide::Avx2;

type Triangle = [[f32; 3]; 3];

/// `full`, or `under_miri`, whose interpreter takes a thousand times as long: it looks for other faults.
const fn count(full: usize, under_miri: usize) -> usize {
    if cfg!(miri) { under_miri } else { full }
}

/// Leaves of one triangle each, of all that can be hit.
fn single_leaves(triangles: &[Triangle]) -> Vec<Leaf> {
    let hittable = triangles.iter().enumerate().filter(|(_, t)| can_be_hit(t));
    let single = hittable.map(|(id, triangle)| {
        let mut leaf = Leaf::empty();
        let (vertices, order) = canonical(triangle);
        leaf.set(0, &vertices, Label::new(id as u32, order));
        leaf
    });
    single.collect()
}

fn brute_force(leaves: &[Leaf], ray: &PreparedRay) -> Option<Hit> {
    let others = leaves.iter().filter(|leaf| leaf.labels[0].id() != ray.skip);
    let hits = others.filter_map(|leaf| meet(leaf, 0, ray, ray.t_max));
    hits.reduce(|best, hit| if hit.beats(&best) { hit } else { best })
}

/// Asserts that all rays get the same answer from the tree, in every instruction set there is, and
/// from brute force; returns how many hit.
fn check(triangles: &[Triangle], rays: impl IntoIterator<Item = Ray>) -> usize {
    let (bvh, leaves) = (Bvh::build(triangles), single_leaves(triangles));
    assert_eq!(bvh.left_out() + leaves.len(), triangles.len());
    let mut hits = 0;
    for ray in rays {
        let prepared = bvh.prepare(&ray);
        let expected = prepared.as_ref().and_then(|prepared| brute_force(&leaves, prepared));
        // The public calls take the widest instruction set there is, the others are named.
        assert_eq!(bvh.closest_hit(&ray), expected, "{ray:?}");
        assert_eq!(bvh.occluded(&ray), expected.is_some(), "{ray:?}");
        if let Some(prepared) = &prepared {
            check_in::<Portable>(&bvh, prepared, expected);
            #[cfg(target_arch = "x86_64")]
            if Avx2::detected() {
                check_in::<Avx2>(&bvh, prepared, expected);
            }
        }
        hits += usize::from(expected.is_some());
    }
    hits
}

fn check_in<L: Lanes>(bvh: &Bvh, ray: &PreparedRay, expected: Option<Hit>) {
    assert_eq!(bvh.closest::<L>(ray, |_| true), expected, "{}, {ray:?}", std::any::type_name::<L>());
    assert_eq!(bvh.any::<L>(ray), expected.is_some(), "{}, {ray:?}", std::any::type_name::<L>());
}

struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in -1 … 1.
    fn signed(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> [f32; 3] {
        [0; 3].map(|_| self.signed())
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.bits() % from.len() as u64) as usize]
    }
}

/// Triangles of edge lengths around `size` in the unit cube.
fn soup(count: usize, size: f32, random: &mut Random) -> Vec<Triangle> {
    let triangle = |_| {
        let centre = random.point();
        [0; 3].map(|_| {
            let offset = random.point();
            [0, 1, 2].map(|k| centre[k] + size * offset[k])
        })
    };
    (0..count).map(triangle).collect()
}
