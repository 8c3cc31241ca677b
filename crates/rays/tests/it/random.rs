//! SplitMix64 (Steele, Lea, Flood 2014): fixed seeds, no dependency.

pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0 … 1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform in the cube -1 … 1.
    pub fn point(&mut self) -> [f32; 3] {
        [0; 3].map(|_| 2.0 * self.unit() - 1.0)
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end as u64) as usize
    }

    /// A triangle of edges around `size`, in the cube -1 … 1.
    pub fn triangle(&mut self, size: f32) -> [[f32; 3]; 3] {
        let centre = self.point();
        [0; 3].map(|_| {
            let offset = self.point();
            [0, 1, 2].map(|k| centre[k] + size * offset[k])
        })
    }
}
