//! Construction of the tree: a binary tree by the surface-area heuristic (`binary`), collapsed to
//! eight-wide nodes (`collapse`) and laid out here.
//!
//! Every decision depends on its own range of triangles only, so the tree does not depend on the
//! number of threads. `bvh` calls [`build`]; nothing here is used by rays.

use rayon::prelude::*;

use crate::binary::{Binary, Item};
use crate::node::{Child, LANES, Label, Leaf, Node};
use crate::triangle::{can_be_hit, canonical};

/// What [`build`] makes.
pub(crate) struct Tree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    pub bounds: Option<[[f32; 3]; 2]>,
    pub left_out: usize,
}

/// The tree over those `triangles` that can be hit.
pub(crate) fn build(triangles: &[[[f32; 3]; 3]]) -> Tree {
    let mut items: Vec<Item> = triangles
        .par_iter()
        .enumerate()
        .filter(|(_, t)| can_be_hit(t))
        .map(|(id, t)| Item::new(id as u32, t))
        .collect();
    let left_out = triangles.len() - items.len();
    if items.is_empty() {
        return Tree { nodes: Vec::new(), leaves: Vec::new(), bounds: None, left_out };
    }
    let root = Binary::over(&mut items, 1);
    let bounds = root.bounds;
    let (mut nodes, mut leaves) = (Vec::new(), Vec::with_capacity(triangles.len() / 5));
    lay_out_node(&root, triangles, &mut nodes, &mut leaves);
    nodes.shrink_to_fit();
    leaves.shrink_to_fit();
    Tree { nodes, leaves, bounds: Some([bounds.low, bounds.high]), left_out }
}

/// Memory that [`build`] needs beside the tree and the triangles, in bytes: a list of boxes, and a binary tree whose
/// leaves hold six triangles on average, each of its inner nodes an allocation of its own.
pub(crate) fn scratch_bytes(triangles: usize) -> usize {
    const TRIANGLES_OF_A_LEAF: usize = 6;
    const ALLOCATION: usize = 16;
    triangles * size_of::<Item>() + triangles / TRIANGLES_OF_A_LEAF * (2 * size_of::<Binary>() + ALLOCATION)
}

/// Appends the wide node that `binary` becomes, parents before children, and returns where it went.
fn lay_out_node(binary: &Binary, triangles: &[[[f32; 3]; 3]], nodes: &mut Vec<Node>, leaves: &mut Vec<Leaf>) -> Child {
    let mut children = Vec::with_capacity(LANES);
    binary.open(&mut children);
    // Small boxes in the low lanes, which the walk takes first, were measured to be a little faster
    // than the order of space.
    children.sort_by(|a, b| a.bounds.half_area().total_cmp(&b.bounds.half_area()));
    let place = nodes.len();
    nodes.push(Node::empty());
    for (lane, part) in children.iter().enumerate() {
        let child = match part.items() {
            Some(items) => lay_out_leaf(items, triangles, leaves),
            None => lay_out_node(part, triangles, nodes, leaves),
        };
        let node = &mut nodes[place];
        for axis in 0..3 {
            node.planes[axis][lane] = part.bounds.low[axis];
            node.planes[axis + 3][lane] = part.bounds.high[axis];
        }
        node.children[lane] = child;
    }
    Child::node(place)
}

fn lay_out_leaf(items: &[Item], triangles: &[[[f32; 3]; 3]], leaves: &mut Vec<Leaf>) -> Child {
    let mut leaf = Leaf::empty();
    for (lane, item) in items.iter().enumerate() {
        let (vertices, order) = canonical(&triangles[item.id as usize]);
        leaf.set(lane, &vertices, Label::new(item.id, order));
    }
    leaves.push(leaf);
    Child::leaf(leaves.len() - 1)
}
