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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::binary::Item;

    type Open = for<'b, 'a> fn(&'b Binary<'a>) -> Vec<&'b Binary<'a>>;

    /// The work of the wide tree under `binary` whose nodes have the children that `open` gives.
    fn work(binary: &Binary, open: Open) -> f64 {
        if binary.items().is_some() {
            return 0.0;
        }
        binary.bounds.half_area() + open(binary).into_iter().map(|child| work(child, open)).sum::<f64>()
    }

    fn least<'b, 'a>(binary: &'b Binary<'a>) -> Vec<&'b Binary<'a>> {
        let mut children = Vec::new();
        binary.open(&mut children);
        assert!((2..=LANES).contains(&children.len()));
        children
    }

    /// Splits the largest child until there are eight: what is usual.
    fn greedy<'b, 'a>(binary: &'b Binary<'a>) -> Vec<&'b Binary<'a>> {
        let mut children = vec![binary];
        while children.len() < LANES {
            let area = |i: &usize| children[*i].bounds.half_area();
            let inner = (0..children.len()).filter(|&i| children[i].items().is_none());
            let Some(largest) = inner.max_by(|i, j| area(i).total_cmp(&area(j))) else { break };
            let Below::Parts(parts) = &children.swap_remove(largest).below else { unreachable!() };
            children.extend(parts.iter());
        }
        children
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes hours there, and has no unsafe code to look at")]
    fn the_choice_costs_what_was_promised_and_less_than_a_greedy_one() {
        // A lattice of small triangles that is dense in one corner.
        let mut items: Vec<Item> = (0..3000u32)
            .map(|id| {
                let corner = [id % 10, id / 10 % 15, id / 150].map(|i| (i * i) as f32 / 100.0);
                Item::new(id, &[corner, corner.map(|c| c + 0.02), [corner[0], corner[1] + 0.03, corner[2]]])
            })
            .collect();
        let root = Binary::over(&mut items, 1);
        let (promised, chosen, usual) = (root.areas.0[0], work(&root, least), work(&root, greedy));
        assert!((chosen / promised - 1.0).abs() < 1e-12, "{chosen} {promised}");
        assert!(chosen < 0.98 * usual, "{chosen} {usual}");
    }
}
