//! The paper's binary tree (§2.2): leaves and nodes hold (emitted power, reflected power × n), so that the
//! division by the iteration number n happens on the fly and an iteration touches O(log K) nodes.
//!
//! Sums are doubles; each update adds to a path, so rounding drifts as about √updates · 1e-16. `rebuild` sums
//! the leaves anew; the solver calls it every million updates.

/// Powers of all patches, selectable in proportion to emission + reflection/n.
#[derive(Clone, Debug)]
pub struct PowerTree {
    /// Heap order: node 1 is the root, the children of i are 2i and 2i + 1, leaf k is `leaves + k`.
    nodes: Vec<[f64; 2]>,
    leaves: usize,
    patches: usize,
}

impl PowerTree {
    /// A tree over patches of the given emitted powers (luminance, W) that reflect nothing yet. O(K).
    pub fn new(emitted: impl ExactSizeIterator<Item = f64>) -> Self {
        let patches = emitted.len();
        let leaves = patches.next_power_of_two().max(1);
        let mut nodes = vec![[0.0; 2]; 2 * leaves];
        for (leaf, e) in nodes[leaves..].iter_mut().zip(emitted) {
            leaf[0] = e;
        }
        let mut tree = Self { nodes, leaves, patches };
        tree.rebuild();
        tree
    }

    /// Sums every node from its children. O(K).
    pub fn rebuild(&mut self) {
        for i in (1..self.leaves).rev() {
            let ([e0, r0], [e1, r1]) = (self.nodes[2 * i], self.nodes[2 * i + 1]);
            self.nodes[i] = [e0 + e1, r0 + r1];
        }
    }

    /// Reflected power × n of every node, in heap order: with the emitted powers, all that there is.
    pub(crate) fn reflected(&self) -> impl Iterator<Item = f64> {
        self.nodes.iter().map(|node| node[1])
    }

    /// Takes what [`PowerTree::reflected`] gave of a tree of as many patches. Leaves alone would not do: sums along the
    /// paths have roundings of their own, and the next choice depends on them.
    pub(crate) fn set_reflected(&mut self, reflected: &[f64]) {
        self.nodes.iter_mut().zip(reflected).for_each(|(node, &r)| node[1] = r);
    }

    /// Adds to the reflected power × n of a patch, up to the root. O(log K).
    pub fn add_reflected(&mut self, patch: usize, increment: f64) {
        let mut i = self.leaves + patch;
        while i > 0 {
            self.nodes[i][1] += increment;
            i /= 2;
        }
    }

    /// Power of a patch after `n` iterations, W; at n = 0 the emission alone.
    #[inline]
    pub fn power(&self, patch: usize, n: u64) -> f64 {
        self.value(self.leaves + patch, inverse(n))
    }

    /// Power of all patches after `n` iterations, W.
    #[inline]
    pub fn total(&self, n: u64) -> f64 {
        self.value(1, inverse(n))
    }

    #[inline]
    fn value(&self, node: usize, inverse_n: f64) -> f64 {
        let [e, r] = self.nodes[node];
        e + r * inverse_n
    }

    /// The patch at `u` in [0, 1) of the running sum of powers. O(log K).
    #[inline]
    pub fn select(&self, u: f64, n: u64) -> usize {
        let inverse_n = inverse(n);
        let mut rest = u * self.value(1, inverse_n);
        let mut i = 1;
        while i < self.leaves {
            i *= 2;
            let left = self.value(i, inverse_n);
            // A subtree without power is never entered, whatever rounding left in `rest`.
            if rest >= left && self.value(i + 1, inverse_n) > 0.0 {
                rest -= left;
                i += 1;
            }
        }
        (i - self.leaves).min(self.patches - 1)
    }
}

/// 1/n, or 0 before the first iteration, when nothing has been reflected.
#[inline]
fn inverse(n: u64) -> f64 {
    if n == 0 { 0.0 } else { 1.0 / n as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::sample::Stream;
    use twinray_testkit::chi2;

    #[test]
    fn sums_and_frequencies_after_a_million_updates() {
        let k = 777;
        let mut tree = PowerTree::new((0..k).map(|i| if i % 7 == 0 { f64::from(i as u32) } else { 0.0 }));
        let mut reflected = vec![0.0; k];
        let mut stream = Stream::new(1, 0, 0);
        let n = 1_000_000;
        for _ in 0..n {
            let (patch, x) = ((stream.uniform() * k as f64) as usize, stream.uniform());
            // Patches above 700 are never updated: some stay without power and must not be chosen.
            if patch < 700 {
                tree.add_reflected(patch, x);
                reflected[patch] += x;
            }
        }
        let power = |i: usize| tree.power(i, n);
        for (i, r) in reflected.iter().enumerate() {
            let e = if i % 7 == 0 { i as f64 } else { 0.0 };
            assert!((power(i) - e - r / n as f64).abs() <= 1e-12 * power(i).max(1.0));
        }
        let sum: f64 = (0..k).map(power).sum();
        assert!((tree.total(n) / sum - 1.0).abs() < 1e-9);

        let draws = 1_000_000u64;
        let mut count = vec![0u64; k];
        (0..draws).for_each(|_| count[tree.select(stream.uniform(), n)] += 1);
        let expected: Vec<f64> = (0..k).map(|i| power(i) / sum * draws as f64).collect();
        let outcome = chi2::test(&count, &expected);
        assert!(outcome.p_value > 0.01, "{outcome:?}");
        assert!((0..k).all(|i| power(i) > 0.0 || count[i] == 0));
    }

    #[test]
    fn the_ends_of_the_unit_interval_choose_patches_with_power() {
        let tree = PowerTree::new([0.0, 1.0, 0.0, 2.0, 0.0].into_iter());
        assert_eq!(tree.select(0.0, 0), 1);
        assert_eq!(tree.select(1.0 - f64::EPSILON / 2.0, 0), 3);
        assert_eq!(PowerTree::new([3.0].into_iter()).select(0.5, 0), 0);
    }
}
