//! Boxes that overlap a box, in two or three dimensions: a binary tree by medians.

/// Low and high corner.
pub type Bounds<const D: usize> = [[f64; D]; 2];

/// The box around points, larger by `margin` on all sides.
pub fn around<const D: usize>(points: &[[f64; D]], margin: f64) -> Bounds<D> {
    let mut bounds = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    for point in points {
        for k in 0..D {
            bounds[0][k] = bounds[0][k].min(point[k] - margin);
            bounds[1][k] = bounds[1][k].max(point[k] + margin);
        }
    }
    bounds
}

fn meet<const D: usize>(a: &Bounds<D>, b: &Bounds<D>) -> bool {
    (0..D).all(|k| a[0][k] <= b[1][k] && b[0][k] <= a[1][k])
}

/// Boxes in an order in which halves of every range are apart, with the box around each node.
pub struct BoxTree<const D: usize> {
    /// Numbers of the boxes, leaf by leaf.
    order: Vec<u32>,
    boxes: Vec<Bounds<D>>,
    /// A heap: children of `i` are `2i + 1` and `2i + 2`.
    nodes: Vec<Bounds<D>>,
}

const LEAF: usize = 8;

impl<const D: usize> BoxTree<D> {
    pub fn new(boxes: Vec<Bounds<D>>) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::new();
        build(&boxes, &mut order, 0, &mut nodes);
        Self { order, boxes, nodes }
    }

    /// Calls `each` with every box that meets `bounds`, until it answers false.
    pub fn meeting(&self, bounds: &Bounds<D>, mut each: impl FnMut(u32) -> bool) {
        let mut stack = vec![(0, 0, self.order.len())];
        while let Some((node, from, to)) = stack.pop() {
            if from == to || !meet(&self.nodes[node], bounds) {
                continue;
            }
            if to - from <= LEAF {
                let hits = self.order[from..to].iter().filter(|&&i| meet(&self.boxes[i as usize], bounds));
                for &i in hits {
                    if !each(i) {
                        return;
                    }
                }
                continue;
            }
            let middle = from + (to - from) / 2;
            stack.push((2 * node + 2, middle, to));
            stack.push((2 * node + 1, from, middle));
        }
    }
}

fn build<const D: usize>(boxes: &[Bounds<D>], order: &mut [u32], node: usize, nodes: &mut Vec<Bounds<D>>) {
    let mut all = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    for &i in order.iter() {
        for k in 0..D {
            all[0][k] = all[0][k].min(boxes[i as usize][0][k]);
            all[1][k] = all[1][k].max(boxes[i as usize][1][k]);
        }
    }
    if nodes.len() <= node {
        nodes.resize(node + 1, all);
    }
    nodes[node] = all;
    if order.len() <= LEAF {
        return;
    }
    let wide = |k: usize| all[1][k] - all[0][k];
    let axis = (0..D).max_by(|&a, &b| wide(a).total_cmp(&wide(b))).unwrap_or(0);
    let middle = order.len() / 2;
    let key = |i: u32| boxes[i as usize][0][axis] + boxes[i as usize][1][axis];
    order.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let (low, high) = order.split_at_mut(middle);
    build(boxes, low, 2 * node + 1, nodes);
    build(boxes, high, 2 * node + 2, nodes);
}
