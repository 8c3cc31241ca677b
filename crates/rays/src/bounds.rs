//! Axis-aligned boxes, as far as the build needs them. Rays test boxes by lanes, in `lanes`.

/// A box; inverted and infinite while empty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    /// The smallest box around both.
    #[inline(always)]
    pub fn union(&self, other: &Bounds) -> Bounds {
        Bounds {
            low: std::array::from_fn(|i| if other.low[i] < self.low[i] { other.low[i] } else { self.low[i] }),
            high: std::array::from_fn(|i| if other.high[i] > self.high[i] { other.high[i] } else { self.high[i] }),
        }
    }

    /// Half the surface; 0 if empty. In `f64`, where the square of the largest extent does not
    /// overflow.
    #[inline(always)]
    pub fn half_area(&self) -> f64 {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|i| f64::from(self.high[i]) - f64::from(self.low[i]));
        if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
    }
}
