//! Construction of the tree: binned surface-area heuristic, straight into eight-wide nodes.
//!
//! A node begins as one range of triangles and splits its largest range until it has eight; each
//! range then becomes a leaf (up to eight triangles) or a node in turn, ranges in parallel. Every
//! decision depends on its own range only, so the tree does not depend on the number of threads.
//! `bvh` calls [`build`]; nothing here is used by rays.

use rayon::prelude::*;

use crate::bounds::Bounds;
use crate::node::{Child, LANES, Label, Leaf, Node};
use crate::traverse::MAX_DEPTH;
use crate::triangle::{can_be_hit, canonical};

/// Bins per axis, after the prototype; from 16 to 64 speed and memory change by less than the noise
/// of the measurement (`examples/throughput.rs`), at 8 the tree is 4 % larger.
const BINS: usize = 32;

/// Ranges above this many triangles are built in parallel; below, tasks cost more than they save.
const PARALLEL: usize = 4096;

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
    let bounds = bounds_of(&items);
    let root = branch(&mut items, 1);
    let (mut nodes, mut leaves) = (Vec::new(), Vec::with_capacity(triangles.len() / 5));
    lay_out(&root, triangles, &mut nodes, &mut leaves);
    nodes.shrink_to_fit();
    leaves.shrink_to_fit();
    Tree { nodes, leaves, bounds: Some([bounds.low, bounds.high]), left_out }
}

/// A triangle on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    id: u32,
}

impl Item {
    fn new(id: u32, triangle: &[[f32; 3]; 3]) -> Item {
        let bounds = triangle.iter().fold(Bounds::EMPTY, |b, v| b.union(&Bounds { low: *v, high: *v }));
        Item { bounds, id }
    }

    /// Twice the centre of its box: saves a multiplication, and only the order matters.
    #[inline(always)]
    fn centre(&self, axis: usize) -> f32 {
        self.bounds.low[axis] + self.bounds.high[axis]
    }
}

fn bounds_of(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |bounds, item| bounds.union(&item.bounds))
}

/// A node or leaf before it has a place in the arrays.
enum Subtree {
    Leaf(Vec<u32>),
    Branch(Vec<(Bounds, Subtree)>),
}

/// The inner node over `items`, at `depth` (the root's is 1).
fn branch(items: &mut [Item], depth: usize) -> Subtree {
    // Halving reaches leaves in this many levels more. Where only that keeps the stack of the walk
    // in bounds, halve.
    let levels = items.len().div_ceil(LANES).next_power_of_two().ilog2() as usize;
    let halve = depth + levels >= MAX_DEPTH;

    let count = items.len();
    let mut ranges = vec![(bounds_of(items), items)];
    while ranges.len() < LANES {
        let largest = (0..ranges.len()).filter(|&i| ranges[i].1.len() > LANES).max_by(|&i, &j| {
            // The first of equals, so that the outcome is plain to reason about.
            ranges[i].0.half_area().total_cmp(&ranges[j].0.half_area()).then(j.cmp(&i))
        });
        let Some(largest) = largest else { break };
        let (_, items) = ranges.swap_remove(largest);
        let middle = if halve { None } else { partition(items) };
        let middle = middle.unwrap_or_else(|| partition_halves(items));
        let (left, right) = items.split_at_mut(middle);
        ranges.push((bounds_of(left), left));
        ranges.push((bounds_of(right), right));
    }

    let subtree = |(bounds, items): (Bounds, &mut [Item])| {
        let below = if items.len() <= LANES {
            Subtree::Leaf(items.iter().map(|i| i.id).collect())
        } else {
            branch(items, depth + 1)
        };
        (bounds, below)
    };
    Subtree::Branch(if count > PARALLEL {
        ranges.into_par_iter().map(subtree).collect()
    } else {
        ranges.into_iter().map(subtree).collect()
    })
}

/// Parts `items` where the surface-area heuristic is least over all bins of all axes; returns the
/// size of the first part, or `None` if all centres coincide.
fn partition(items: &mut [Item]) -> Option<usize> {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for item in items.iter() {
        for axis in 0..3 {
            low[axis] = low[axis].min(item.centre(axis));
            high[axis] = high[axis].max(item.centre(axis));
        }
    }
    let scale: [f32; 3] = std::array::from_fn(|axis| BINS as f32 / (high[axis] - low[axis]));
    // The cast saturates and takes NaN (no extent) to 0, so any input lands in a bin.
    let bin = |item: &Item, axis: usize| (((item.centre(axis) - low[axis]) * scale[axis]) as usize).min(BINS - 1);

    let mut bins = [[(Bounds::EMPTY, 0u32); BINS]; 3];
    for item in items.iter() {
        for (axis, bins) in bins.iter_mut().enumerate() {
            let (bounds, count) = &mut bins[bin(item, axis)];
            *bounds = bounds.union(&item.bounds);
            *count += 1;
        }
    }

    let mut best: Option<(f64, usize, usize)> = None;
    for (axis, bins) in bins.iter().enumerate().filter(|&(axis, _)| high[axis] > low[axis]) {
        // Costs of everything from a bin on, then of everything before it.
        let mut right = [0.0; BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0);
        for at in (1..BINS).rev() {
            (bounds, count) = (bounds.union(&bins[at].0), count + bins[at].1);
            right[at] = if count == 0 { f64::INFINITY } else { cost(&bounds, count) };
        }
        (bounds, count) = (Bounds::EMPTY, 0);
        for at in 1..BINS {
            (bounds, count) = (bounds.union(&bins[at - 1].0), count + bins[at - 1].1);
            let total = cost(&bounds, count) + right[at];
            if count > 0 && total.is_finite() && best.is_none_or(|(least, ..)| total < least) {
                best = Some((total, axis, at));
            }
        }
    }

    let (_, axis, at) = best?;
    let (mut left, mut right) = (0, items.len());
    while left < right {
        if bin(&items[left], axis) < at {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    Some(left)
}

/// Expected work below a box: its area times the leaves it needs. Whole leaves, because one of two
/// triangles costs what one of eight does; this also fills them, which keeps the tree small.
#[inline(always)]
fn cost(bounds: &Bounds, count: u32) -> f64 {
    bounds.half_area() * f64::from(count.div_ceil(LANES as u32))
}

/// Parts `items` in the middle of their order along the longest axis, coincident ones by id;
/// returns the size of the first half.
fn partition_halves(items: &mut [Item]) -> usize {
    let bounds = bounds_of(items);
    let extent = |axis: &usize| bounds.high[*axis] - bounds.low[*axis];
    let axis = (0..3).max_by(|i, j| extent(i).total_cmp(&extent(j))).unwrap_or(0);
    // A multiple of eight on the left wastes no lane there.
    let middle = (items.len() / 2).next_multiple_of(LANES).min(items.len() - 1);
    items.select_nth_unstable_by(middle, |a, b| a.centre(axis).total_cmp(&b.centre(axis)).then(a.id.cmp(&b.id)));
    middle
}

/// Appends `subtree` to the arrays, parents before children, and returns where it went.
fn lay_out(subtree: &Subtree, triangles: &[[[f32; 3]; 3]], nodes: &mut Vec<Node>, leaves: &mut Vec<Leaf>) -> Child {
    match subtree {
        Subtree::Leaf(ids) => {
            let mut leaf = Leaf::empty();
            for (lane, &id) in ids.iter().enumerate() {
                let (vertices, order) = canonical(&triangles[id as usize]);
                leaf.set(lane, &vertices, Label::new(id, order));
            }
            leaves.push(leaf);
            Child::leaf(leaves.len() - 1)
        }
        Subtree::Branch(children) => {
            let place = nodes.len();
            nodes.push(Node::empty());
            for (lane, (bounds, below)) in children.iter().enumerate() {
                let child = lay_out(below, triangles, nodes, leaves);
                let node = &mut nodes[place];
                for axis in 0..3 {
                    node.planes[axis][lane] = bounds.low[axis];
                    node.planes[axis + 3][lane] = bounds.high[axis];
                }
                node.children[lane] = child;
            }
            Child::node(place)
        }
    }
}
