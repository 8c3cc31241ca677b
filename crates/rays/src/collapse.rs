//! Which binary nodes become wide ones: the choice of least expected work, by dynamic programming.
//!
//! A ray meets a box with a probability in proportion to its area, and leaves are the same whatever
//! is chosen, so least is the sum of the areas of all wide nodes. Source: Ylitie, Karras, Laine,
//! "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017, section 3.1.

use crate::binary::{Below, Binary};
use crate::node::LANES;

/// Entry `[n - 1]` is the least sum of areas of wide nodes over all ways to hand a subtree to a
/// wide node as at most `n` children of it.
pub(crate) struct Areas([f64; LANES]);

impl Areas {
    pub fn of_leaf() -> Areas {
        Areas([0.0; LANES])
    }

    /// Of a node of the half area `own` from those of its parts.
    pub fn of_parts(own: f64, left: &Areas, right: &Areas) -> Areas {
        let whole = own + share(left, right, LANES).0;
        // One child is the node itself; of more, each part has one at least.
        Areas(std::array::from_fn(|i| if i == 0 { whole } else { share(left, right, i + 1).0.min(whole) }))
    }
}

/// The least sum of areas with `count` children for both parts together, and how many of these the
/// left part gets.
fn share(left: &Areas, right: &Areas, count: usize) -> (f64, usize) {
    let sum = |for_left: usize| (left.0[for_left - 1] + right.0[count - for_left - 1], for_left);
    (2..count).map(sum).fold(sum(1), |best, other| if other.0 < best.0 { other } else { best })
}

impl<'a> Binary<'a> {
    /// Appends the children of the wide node that this node becomes; a leaf is its own only child.
    pub fn open<'b>(&'b self, children: &mut Vec<&'b Binary<'a>>) {
        self.split(LANES, children);
    }

    /// Appends what stands for this node's parts as at most `count` children.
    fn split<'b>(&'b self, count: usize, children: &mut Vec<&'b Binary<'a>>) {
        let Below::Parts(parts) = &self.below else {
            children.push(self);
            return;
        };
        let [left, right] = &**parts;
        let (_, for_left) = share(&left.areas, &right.areas, count);
        for (part, count) in [(left, for_left), (right, count - for_left)] {
            // One child: the part itself. It also is where it costs no more than its parts do.
            if part.areas.0[count - 1] < part.areas.0[0] {
                part.split(count, children);
            } else {
                children.push(part);
            }
        }
    }
}
