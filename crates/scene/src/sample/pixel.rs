//! Even numbers for the samples of one pixel: any number of pairs a sample, each pair its own sequence over the samples.
//!
//! Every pair is a two-dimensional Sobol sequence, Owen-scrambled and in an order of its own (Burley, "Practical
//! hash-based Owen scrambling", JCGT 9(4), 2020): even over the first 2ᵏ samples, whatever k, and independent of the
//! other pairs and of other pixels.

use super::sobol::owen_scramble;
use super::stream::mix;

/// The numbers of one sample of a pixel, drawn pair after pair.
#[derive(Clone, Debug)]
pub struct PixelSample {
    key: u64,
    index: u32,
    pair: u64,
}

impl PixelSample {
    /// Sample `index` of `pixel` under `seed`.
    pub fn new(seed: u64, pixel: u64, index: u32) -> Self {
        Self { key: mix(seed ^ mix(pixel.wrapping_add(0x517C_C1B7_2722_0A95))), index, pair: 0 }
    }

    /// The next pair, each number uniform in [0, 1).
    #[inline]
    pub fn pair(&mut self) -> [f64; 2] {
        self.pair += 1;
        let key = mix(self.key.wrapping_add(self.pair.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        let other = mix(key);
        let index = owen_scramble(self.index.reverse_bits(), key as u32);
        let unit =
            |digits: u32, scramble: u32| f64::from(owen_scramble(digits, scramble)) * (1.0 / (1u64 << 32) as f64);
        [unit(index, (key >> 32) as u32), unit(pascal(index), other as u32)]
    }

    /// The next number alone.
    #[inline]
    pub fn single(&mut self) -> f64 {
        self.pair()[0]
    }

    /// Draws on from the given pair, so that what follows does not depend on how many were drawn before.
    #[inline]
    pub fn jump(&mut self, pair: u64) {
        self.pair = pair;
    }
}

/// Point `index` of the sequence `key`, each coordinate in [0, 1): of 2ᵏ points from a multiple of 2ᵏ on, one lies in
/// every elementary interval of area 2⁻ᵏ. The order is that of the index, for those who deal the points out themselves.
#[inline]
pub fn net_point(key: u64, index: u32) -> [f64; 2] {
    let key = mix(key);
    let unit =
        |digits: u32, scramble: u64| f64::from(owen_scramble(digits, scramble as u32)) * (1.0 / (1u64 << 32) as f64);
    [unit(index, key), unit(pascal(index), key >> 32)]
}

/// The digits of the second Sobol dimension, first one lowest: Pascal's triangle modulo 2 times those of the index.
#[inline]
fn pascal(mut x: u32) -> u32 {
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0F0F_0F0F;
    x ^= (x >> 8) & 0x00FF_00FF;
    x ^= (x >> 16) & 0x0000_FFFF;
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the first 2ᵏ samples, one lies in every elementary interval of area 2⁻ᵏ, of whatever shape.
    #[test]
    fn every_elementary_interval_holds_one_point() {
        for (pixel, pair) in [(0, 1), (17, 2), (4_000_000, 5)] {
            for k in 0..9u32 {
                let points: Vec<[f64; 2]> = (0..1u32 << k)
                    .map(|i| {
                        let mut sample = PixelSample::new(3, pixel, i);
                        sample.jump(pair);
                        sample.pair()
                    })
                    .collect();
                for columns in 0..=k {
                    let mut seen = vec![0; 1 << k];
                    for [x, y] in &points {
                        let (nx, ny) = (1u64 << columns, 1u64 << (k - columns));
                        seen[((x * nx as f64) as u64 * ny + (y * ny as f64) as u64) as usize] += 1;
                    }
                    assert!(seen.iter().all(|n| *n == 1), "2^{k} points, 2^{columns} columns");
                }
            }
        }
    }

    /// Pairs are uncorrelated with each other and from pixel to pixel; |z| < 4 has a false-alarm rate of 6e-5.
    #[test]
    fn pairs_and_pixels_are_uncorrelated() {
        let of = |pixel, pair| {
            let mut sample = PixelSample::new(1, pixel, 5);
            sample.jump(pair);
            sample.single() - 0.5
        };
        let n = 100_000;
        let z = |f: &dyn Fn(u64) -> f64| (0..n).map(f).sum::<f64>() * 12.0 / (n as f64).sqrt();
        assert!(z(&|i| of(i, 0) * of(i, 1)).abs() < 4.0);
        assert!(z(&|i| of(i, 0) * of(i + 1, 0)).abs() < 4.0);
    }
}
