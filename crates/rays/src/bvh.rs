//! [`Bvh`], the crate's front: the tree with the instruction set chosen for it.
//!
//! Construction is in `build`, the walk in `traverse`; here the public calls are checked, prepared
//! and sent to the widest code this processor runs.

use crate::build;
use crate::lanes::{Lanes, Portable};
use crate::node::{Label, Leaf, Node};
use crate::ray::{Hit, PreparedRay, Ray};
use crate::traverse;
#[cfg(target_arch = "x86_64")]
use crate::wide::{Avx2, Avx512};

/// Bytes of a tree for each of its triangles, see [`Bvh`].
const EXPECTED_PER_TRIANGLE: usize = 57;

/// Triangles, ready to be met by rays: a tree of bounding boxes with eight children a node and up
/// to eight triangles a leaf.
///
/// Immutable; any number of threads may ask at once. It keeps its own copy of the triangles; all in
/// all it takes 50 to 57 bytes a triangle.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    bounds: Option<[[f32; 3]; 2]>,
    triangle_count: usize,
    left_out: usize,
    instructions: Instructions,
}

impl Bvh {
    /// Builds the tree over `triangles`, given as `[triangle][vertex][axis]`, in O(n log n), in
    /// parallel on the current rayon pool.
    ///
    /// A triangle's id is its index in the slice. Triangles that have a coordinate that is not
    /// finite or above 1e18 in magnitude, or no area, are never hit and only counted
    /// ([`Bvh::left_out`]). The same triangles give the same tree on any number of threads.
    ///
    /// # Panics
    /// If there are more than 2²⁹ triangles.
    pub fn build(triangles: &[[[f32; 3]; 3]]) -> Bvh {
        assert!(triangles.len() <= Label::MAX_TRIANGLES, "more than 2^29 triangles");
        let tree = build::build(triangles);
        Bvh {
            nodes: tree.nodes,
            leaves: tree.leaves,
            bounds: tree.bounds,
            triangle_count: triangles.len(),
            left_out: tree.left_out,
            instructions: Instructions::widest(),
        }
    }

    /// The nearest hit of `ray`; of hits at equal distance the front-facing one, then the one with
    /// the lower triangle id.
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit_where(ray, |_| true)
    }

    /// The nearest of those hits of `ray` that `accept` takes, ties as in [`Bvh::closest_hit`].
    ///
    /// `accept` is asked, in no particular order, about any hit that would win so far; it should
    /// depend on the hit alone.
    pub fn closest_hit_where(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        match self.instructions {
            // SAFETY: `Instructions::widest` has detected them.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            Instructions::Avx512 => unsafe { Avx512::closest(self, ray, accept) },
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            Instructions::Avx2 => unsafe { Avx2::closest(self, ray, accept) },
            Instructions::Portable => self.closest::<Portable>(&self.prepare(ray)?, accept),
        }
    }

    /// Whether `ray` hits anything, which is found sooner than what it hits first.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match self.instructions {
            // SAFETY: `Instructions::widest` has detected them.
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            Instructions::Avx512 => unsafe { Avx512::any(self, ray) },
            #[cfg(target_arch = "x86_64")]
            #[allow(unsafe_code)]
            Instructions::Avx2 => unsafe { Avx2::any(self, ray) },
            Instructions::Portable => self.prepare(ray).is_some_and(|ray| self.any::<Portable>(&ray)),
        }
    }

    /// Memory of the tree in bytes, the triangles in it included.
    pub fn bytes(&self) -> usize {
        size_of::<Bvh>() + self.nodes.capacity() * size_of::<Node>() + self.leaves.capacity() * size_of::<Leaf>()
    }

    /// About how much memory a tree over so many triangles takes, in bytes: of the tree, and at the most while it is
    /// built, the tree included. The triangles that are handed in are not counted.
    ///
    /// Both are a little more than what scenes take. Only triangles that no plane parts, such as many of one and the same
    /// place, need more than twice as much.
    pub fn expected_bytes(triangles: usize) -> [usize; 2] {
        let tree = size_of::<Bvh>() + size_of::<Node>() + size_of::<Leaf>() + EXPECTED_PER_TRIANGLE * triangles;
        [tree, tree + build::scratch_bytes(triangles)]
    }

    /// Lowest and highest corner of the box around all triangles that can be hit; `None` if there
    /// are none.
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        self.bounds
    }

    /// How many triangles it was built from, those left out included: ids of hits are below this.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// How many of the triangles can never be hit, because they are not finite or have no area.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    #[inline(always)]
    pub(crate) fn prepare(&self, ray: &Ray) -> Option<PreparedRay> {
        PreparedRay::new(ray, self.bounds.as_ref()?)
    }

    #[inline(always)]
    pub(crate) fn closest<L: Lanes>(&self, ray: &PreparedRay, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        traverse::closest::<L>(&self.nodes, &self.leaves, ray, accept)
    }

    #[inline(always)]
    pub(crate) fn any<L: Lanes>(&self, ray: &PreparedRay) -> bool {
        traverse::any::<L>(&self.nodes, &self.leaves, ray)
    }
}

/// Which code the rays of a tree run through.
#[derive(Clone, Copy, Debug)]
enum Instructions {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Instructions {
    /// The widest that this processor has. All give the same hits.
    fn widest() -> Instructions {
        #[cfg(target_arch = "x86_64")]
        if Avx512::detected() {
            return Instructions::Avx512;
        } else if Avx2::detected() {
            return Instructions::Avx2;
        }
        Instructions::Portable
    }
}
