//! The walk: nodes in order of distance, leaves sifted by lanes, candidates decided by `triangle`.
//!
//! Written once over [`Lanes`] and compiled per instruction set; `bvh` chooses. Nothing here knows
//! how boxes and triangles are tested.

use std::mem::MaybeUninit;

use crate::lanes::Lanes;
use crate::node::{Child, LANES, Leaf, Node};
use crate::ray::{FAR_SLACK, Hit, PreparedRay};
use crate::triangle::meet;

/// Most levels of inner nodes; `binary` keeps to it. The stack stays within a page of memory.
pub(crate) const MAX_DEPTH: usize = 64;

/// The hit that beats all others among those that `accept` takes.
#[inline(always)]
pub(crate) fn closest<L: Lanes>(
    nodes: &[Node],
    leaves: &[Leaf],
    ray: &PreparedRay,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    walk::<L>(nodes, leaves, ray, |hit| {
        if best.is_none_or(|best| hit.beats(&best)) && accept(&hit) {
            best = Some(hit);
        }
        best.map_or(ray.t_max, |best| best.t)
    });
    best
}

/// Whether there is any hit.
#[inline(always)]
pub(crate) fn any<L: Lanes>(nodes: &[Node], leaves: &[Leaf], ray: &PreparedRay) -> bool {
    let mut found = false;
    walk::<L>(nodes, leaves, ray, |_| {
        found = true;
        STOP
    });
    found
}

/// A limit before which nothing lies.
const STOP: f32 = -1.0;

/// Calls `visit` with hits at `t` up to the limit, which is `t_max` first and then what the last
/// `visit` returned. Near boxes come first, and boxes that begin exactly at the limit are still
/// opened, because ties are decided by `visit`.
#[inline(always)]
fn walk<L: Lanes>(nodes: &[Node], leaves: &[Leaf], ray: &PreparedRay, mut visit: impl FnMut(Hit) -> f32) {
    let mut limit = ray.t_max;
    let mut stack = Stack::new();
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            let leaf = &leaves[child.index()];
            for lane in bits(L::triangles(leaf, ray)) {
                if leaf.labels[lane].id() == ray.skip {
                    continue;
                }
                if let Some(hit) = meet(leaf, lane, ray, limit) {
                    limit = visit(hit);
                }
            }
        } else {
            let node = &nodes[child.index()];
            let (mask, near) = L::boxes(node, ray, limit * FAR_SLACK);
            let entry = |lane: usize| Waiting::new(near[lane], node.children[lane]);
            // One child is met most often, then two: neither goes through a loop, and the walk goes
            // on with a child that never was on the stack.
            if mask != 0 {
                let (lane, mask) = first(mask);
                if mask == 0 {
                    child = node.children[lane];
                    continue;
                }
                let one = entry(lane);
                let (lane, mut mask) = first(mask);
                let other = entry(lane);
                let (nearer, farther) = if one.0 < other.0 { (one, other) } else { (other, one) };
                let base = stack.height;
                stack.push(farther);
                if mask == 0 {
                    child = nearer.child();
                    continue;
                }
                stack.push(nearer);
                while mask != 0 {
                    let lane;
                    (lane, mask) = first(mask);
                    stack.insert(base, entry(lane));
                }
            }
        }
        child = loop {
            let Some(top) = stack.pop() else { return };
            if top.t() <= limit * FAR_SLACK {
                break top.child();
            }
        };
    }
}

/// Children that wait, the next one last.
struct Stack {
    /// Those below `height` have been written. A node leaves at most all children but one waiting
    /// while the walk goes down through that one.
    entries: [MaybeUninit<Waiting>; MAX_DEPTH * (LANES - 1) + 1],
    height: usize,
}

impl Stack {
    #[inline(always)]
    fn new() -> Stack {
        Stack { entries: [const { MaybeUninit::uninit() }; _], height: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: Waiting) {
        self.entries[self.height] = MaybeUninit::new(entry);
        self.height += 1;
    }

    /// One step of an insertion sort of the entries from `base` on, farthest lowest.
    #[inline(always)]
    fn insert(&mut self, base: usize, entry: Waiting) {
        let mut place = self.height;
        while place > base {
            // SAFETY: `base <= place - 1 < height`, and entries below `height` have been written.
            #[allow(unsafe_code)]
            let below = unsafe { self.entries[place - 1].assume_init() };
            if below.0 >= entry.0 {
                break;
            }
            self.entries[place] = MaybeUninit::new(below);
            place -= 1;
        }
        self.entries[place] = MaybeUninit::new(entry);
        self.height += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Waiting> {
        self.height = self.height.checked_sub(1)?;
        // SAFETY: entries below what `height` was have been written.
        #[allow(unsafe_code)]
        Some(unsafe { self.entries[self.height].assume_init() })
    }
}

/// A child to visit: the distance at which the ray enters it above, its place below. Distances are
/// not negative, so that the order of the words is the order of the distances.
#[derive(Clone, Copy)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(t: f32, child: Child) -> Waiting {
        Waiting(u64::from(t.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn t(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// Places of the ones in `mask`, lowest first.
#[inline(always)]
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        if mask == 0 {
            return None;
        }
        let lane;
        (lane, mask) = first(mask);
        Some(lane)
    })
}

/// Place of the lowest one in `mask`, and the rest of it.
#[inline(always)]
fn first(mask: u32) -> (usize, u32) {
    (mask.trailing_zeros() as usize & (LANES - 1), mask & (mask - 1))
}
