//! The walk: nodes in order of distance, leaves sifted by lanes, candidates decided by `triangle`.
//!
//! Written once over [`Lanes`] and compiled per instruction set; `bvh` chooses. Nothing here knows
//! how boxes and triangles are tested.

use std::mem::MaybeUninit;

use crate::lanes::Lanes;
use crate::node::{Child, LANES, Leaf, Node};
use crate::ray::{FAR_SLACK, Hit, PreparedRay};
use crate::triangle::meet;

/// Most levels of inner nodes; `build` keeps to it.
pub(crate) const MAX_DEPTH: usize = 40;

/// A node leaves at most all children but one waiting while the walk goes down through that one.
const STACK: usize = MAX_DEPTH * (LANES - 1) + 1;

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
    let mut stack = [const { MaybeUninit::<Waiting>::uninit() }; STACK];
    stack[0] = MaybeUninit::new(Waiting::new(0.0, Child::node(0)));
    let mut height = 1;
    while height > 0 {
        height -= 1;
        // SAFETY: entries below `height` have been written: it starts at 1 with entry 0 written and
        // grows only after writing.
        #[allow(unsafe_code)]
        let top = unsafe { stack[height].assume_init() };
        if top.t() > limit * FAR_SLACK {
            continue;
        }
        let child = top.child();
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
            continue;
        }

        // Insertion sort onto the stack, farthest lowest: two or three children are met on average.
        let node = &nodes[child.index()];
        let (mask, near) = L::boxes(node, ray, limit * FAR_SLACK);
        let base = height;
        for lane in bits(mask) {
            let entry = Waiting::new(near[lane], node.children[lane]);
            let mut place = height;
            while place > base {
                // SAFETY: `base <= place - 1 < height`, and entries below `height` have been
                // written.
                #[allow(unsafe_code)]
                let below = unsafe { stack[place - 1].assume_init() };
                if below.0 >= entry.0 {
                    break;
                }
                stack[place] = MaybeUninit::new(below);
                place -= 1;
            }
            stack[place] = MaybeUninit::new(entry);
            height += 1;
        }
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
        let lane = mask.trailing_zeros() as usize & (LANES - 1);
        mask &= mask - 1;
        Some(lane)
    })
}
