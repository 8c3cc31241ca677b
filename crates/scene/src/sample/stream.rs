//! Counter-based random streams: the stream of (seed, purpose, index) is a pure function of the three.
//!
//! Two rounds of the SplitMix64 finaliser (Steele, Lea, Flood, "Fast splittable pseudorandom number
//! generators", OOPSLA 2014) turn the key into a start; successive numbers walk its Weyl sequence.

const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The SplitMix64 finaliser: a bijection of 64 bits in which every input bit changes half of the output bits.
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A stream of independent uniform numbers.
#[derive(Clone, Debug)]
pub struct Stream(u64);

impl Stream {
    /// The stream number `index` for one `purpose` under one `seed`.
    #[inline]
    pub fn new(seed: u64, purpose: u64, index: u64) -> Self {
        let key = mix(seed.wrapping_add(mix(purpose.wrapping_add(GOLDEN))));
        Self(mix(key ^ mix(index.wrapping_mul(GOLDEN).wrapping_add(key))))
    }

    /// The next 64 random bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// The next number, uniform in [0, 1), 53 bits.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        to_unit(self.bits())
    }
}

/// The upper 53 bits as a number in [0, 1).
#[inline]
pub fn to_unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_testkit::chi2;

    #[test]
    fn uniform_within_and_across_streams() {
        let mut within = vec![0u64; 64];
        let mut across = vec![0u64; 64];
        let mut stream = Stream::new(1, 2, 3);
        for i in 0..200_000 {
            within[(stream.uniform() * 64.0) as usize] += 1;
            across[(Stream::new(7, 0, i).uniform() * 64.0) as usize] += 1;
        }
        let expected = vec![200_000.0 / 64.0; 64];
        assert!(chi2::test(&within, &expected).p_value > 1e-3);
        assert!(chi2::test(&across, &expected).p_value > 1e-3);
    }

    #[test]
    fn neighbouring_seeds_purposes_and_indices_are_uncorrelated() {
        let correlation = |f: &dyn Fn(u64) -> (f64, f64)| {
            let n = 100_000;
            (0..n).map(f).map(|(a, b)| (a - 0.5) * (b - 0.5) * 12.0).sum::<f64>() / (n as f64).sqrt()
        };
        let one = |s, p, i| Stream::new(s, p, i).uniform();
        // Each is a standard normal: |z| < 4 has a false-alarm rate of 6e-5.
        assert!(correlation(&|i| (one(1, 0, i), one(2, 0, i))).abs() < 4.0);
        assert!(correlation(&|i| (one(1, 0, i), one(1, 1, i))).abs() < 4.0);
        assert!(correlation(&|i| (one(1, 0, i), one(1, 0, i + 1))).abs() < 4.0);
    }
}
