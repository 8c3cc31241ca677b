//! What rays leave, on its way to the patches: lists that are sorted by buckets of neighbouring patches as they are
//! written, so that each bucket is summed by one thread, in cache, in an order that no thread changes.

use twinray_scene::{PatchId, Rgb};

/// A deposit on a patch.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct Deposit {
    /// Its patch, and in the top bit whether it only tells what part of another deposit is direct light.
    patch: u32,
    /// W (or lumen).
    power: [f32; 3],
}

/// Marks the part of a deposit on the same patch that comes straight from emission.
const DIRECT: u32 = 1 << 31;

impl Deposit {
    #[inline]
    pub(crate) fn new(patch: PatchId, power: Rgb, direct_part: bool) -> Self {
        Self { patch: patch.0 | if direct_part { DIRECT } else { 0 }, power: power.to_f32() }
    }

    #[inline]
    pub(crate) fn patch(&self) -> PatchId {
        PatchId(self.patch & !DIRECT)
    }

    #[inline]
    pub(crate) fn power(&self) -> Rgb {
        Rgb::from_f32(self.power)
    }

    #[inline]
    pub(crate) fn is_direct_part(&self) -> bool {
        self.patch & DIRECT != 0
    }

    #[inline]
    pub(crate) fn is_nothing(&self) -> bool {
        self.power == [0.0; 3]
    }

    /// Its bits, as a source of numbers that no order of rays changes.
    #[inline]
    pub(crate) fn bits(&self) -> [u64; 2] {
        let [r, g, b] = self.power.map(|c| u64::from(c.to_bits()));
        [r << 32 | g, b << 32 | u64::from(self.patch)]
    }
}

/// How patches are divided into buckets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Buckets {
    /// log₂ of a bucket's patches.
    shift: u32,
    count: usize,
}

impl Buckets {
    /// About as many patches a bucket as the sums of which fit into a core's cache; at most 512 buckets, or the lists
    /// of one task would be too short.
    pub(crate) fn of(patches: usize) -> Self {
        let mut shift = 11;
        while patches >> shift > 512 {
            shift += 1;
        }
        Self { shift, count: patches.div_ceil(1 << shift) }
    }

    #[inline]
    pub(crate) fn of_patch(&self, patch: PatchId) -> usize {
        patch.index() >> self.shift
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Patches of every bucket but perhaps the last.
    pub(crate) fn size(&self) -> usize {
        1 << self.shift
    }
}

/// The deposits of one task, bucket by bucket.
#[derive(Debug, Default)]
pub(crate) struct Deposits {
    list: Vec<Deposit>,
    /// Directions that the deposits came from, packed; only in scenes with glossy patches.
    from: Vec<u32>,
    /// Where buckets end; while the list is written, where their next deposits go.
    ends: Vec<u32>,
}

impl Deposits {
    /// Makes room: `targets` calls with the patches of all deposits to come, as often as they come.
    pub(crate) fn prepare(
        &mut self,
        buckets: Buckets,
        directions: bool,
        targets: impl FnOnce(&mut dyn FnMut(PatchId)),
    ) {
        self.ends.clear();
        self.ends.resize(buckets.count(), 0);
        let ends = &mut self.ends;
        targets(&mut |p| ends[buckets.of_patch(p)] += 1);
        let mut total = 0;
        for end in &mut self.ends {
            let count = *end;
            *end = total;
            total += count;
        }
        self.list.resize(total as usize, Deposit::default());
        if directions {
            self.from.resize(total as usize, 0);
        }
    }

    /// Writes a deposit that was announced, with the packed direction that it came from.
    #[inline]
    pub(crate) fn push(&mut self, buckets: Buckets, deposit: Deposit, from: Option<u32>) {
        let end = &mut self.ends[buckets.of_patch(deposit.patch())];
        self.list[*end as usize] = deposit;
        if let Some(from) = from {
            self.from[*end as usize] = from;
        }
        *end += 1;
    }

    /// A bucket's deposits, with the directions that they came from if there are any.
    #[inline]
    pub(crate) fn bucket(&self, bucket: usize) -> (&[Deposit], &[u32]) {
        let start = if bucket == 0 { 0 } else { self.ends[bucket - 1] as usize };
        let range = start..self.ends[bucket] as usize;
        (&self.list[range.clone()], if self.from.is_empty() { &[] } else { &self.from[range] })
    }
}
