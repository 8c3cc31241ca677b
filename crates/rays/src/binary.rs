//! The binary tree: ranges of triangles, parted by the binned surface-area heuristic until they fit
//! into leaves.
//!
//! How binary nodes become wide ones is in `collapse`, how these lie in memory in `build`.

use crate::bounds::Bounds;
use crate::collapse::Areas;
use crate::node::LANES;
use crate::traverse::MAX_DEPTH;

/// Bins per axis: against 32, as in the prototype, rays are 4 % faster in a large scene and the tree
/// is 2 % smaller, for a quarter more time to build; 16 make both worse, 256 do not help.
const BINS: usize = 64;

/// Ranges above this many triangles are built in parallel; below, tasks cost more than they save.
const PARALLEL: usize = 4096;

/// A triangle on its way into the tree.
#[derive(Clone, Copy)]
pub(crate) struct Item {
    bounds: Bounds,
    pub id: u32,
}

impl Item {
    pub fn new(id: u32, triangle: &[[f32; 3]; 3]) -> Item {
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

/// A node of the binary tree, or a leaf of it.
pub(crate) struct Binary<'a> {
    pub bounds: Bounds,
    /// What the part from here on costs, see there.
    pub areas: Areas,
    pub below: Below<'a>,
}

pub(crate) enum Below<'a> {
    Leaf(&'a [Item]),
    Parts(Box<[Binary<'a>; 2]>),
}

impl<'a> Binary<'a> {
    /// The tree over `items`, at `depth` (the root's is 1), large parts in parallel.
    pub fn over(items: &'a mut [Item], depth: usize) -> Binary<'a> {
        let bounds = bounds_of(items);
        if items.len() <= LANES {
            return Binary { bounds, areas: Areas::of_leaf(), below: Below::Leaf(items) };
        }
        // Halving reaches leaves in this many levels more. Where only that keeps the stack of the
        // walk in bounds, halve: a path has no more wide nodes than binary ones.
        let levels = items.len().div_ceil(LANES).next_power_of_two().ilog2() as usize;
        let parted = if depth + levels >= MAX_DEPTH { None } else { partition(items) };
        let middle = parted.unwrap_or_else(|| partition_halves(items));

        let in_parallel = items.len() > PARALLEL;
        let (left, right) = items.split_at_mut(middle);
        let (left, right) = if in_parallel {
            rayon::join(|| Binary::over(left, depth + 1), || Binary::over(right, depth + 1))
        } else {
            (Binary::over(left, depth + 1), Binary::over(right, depth + 1))
        };
        let areas = Areas::of_parts(bounds.half_area(), &left.areas, &right.areas);
        Binary { bounds, areas, below: Below::Parts(Box::new([left, right])) }
    }

    /// The triangles of a leaf; `None` of an inner node.
    pub fn items(&self) -> Option<&'a [Item]> {
        match &self.below {
            Below::Leaf(items) => Some(items),
            Below::Parts(_) => None,
        }
    }
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
