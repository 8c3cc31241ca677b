//! Colour as the solver sees it: three linear Rec. 709 channels in double precision.
//!
//! Lives here: the type, its arithmetic, and the one luminance of the project. Not here: display
//! transforms (render) and file encodings (format). Everyone calls it. Paper: §2 (luminance 𝓛).

use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Neg, Sub};

/// A linear RGB quantity (Rec. 709 primaries, D65 white): radiance, irradiance, power or albedo.
///
/// Doubles, because sums over millions of rays are built from it; big arrays store `[f32; 3]`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb {
    /// Red channel.
    pub r: f64,
    /// Green channel.
    pub g: f64,
    /// Blue channel.
    pub b: f64,
}

impl Rgb {
    /// No light.
    pub const BLACK: Rgb = Rgb::grey(0.0);
    /// One in every channel.
    pub const WHITE: Rgb = Rgb::grey(1.0);

    /// A colour from its channels.
    #[inline]
    pub const fn new(r: f64, g: f64, b: f64) -> Self {
        Self { r, g, b }
    }

    /// The same value in every channel.
    #[inline]
    pub const fn grey(v: f64) -> Self {
        Self { r: v, g: v, b: v }
    }

    /// Rec. 709 luminance 0.2126 R + 0.7152 G + 0.0722 B, the scalar 𝓛 of the paper (§2).
    #[inline]
    pub fn luminance(self) -> f64 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// Largest channel.
    #[inline]
    pub fn max_channel(self) -> f64 {
        self.r.max(self.g).max(self.b)
    }

    /// Smallest channel.
    #[inline]
    pub fn min_channel(self) -> f64 {
        self.r.min(self.g).min(self.b)
    }

    /// `f` applied to each channel.
    #[inline]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// True if every channel is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }

    /// True if no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// Linear interpolation from `self` (`t` = 0) to `other` (`t` = 1).
    #[inline]
    pub fn lerp(self, other: Self, t: f64) -> Self {
        self * (1.0 - t) + other * t
    }

    /// Single-precision channels, for storage.
    #[inline]
    pub fn to_f32(self) -> [f32; 3] {
        [self.r as f32, self.g as f32, self.b as f32]
    }

    /// From stored single-precision channels.
    #[inline]
    pub fn from_f32(c: [f32; 3]) -> Self {
        Self::new(f64::from(c[0]), f64::from(c[1]), f64::from(c[2]))
    }

    /// Double-precision channels.
    #[inline]
    pub fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }

    /// From double-precision channels.
    #[inline]
    pub fn from_array(c: [f64; 3]) -> Self {
        Self::new(c[0], c[1], c[2])
    }
}

impl Index<usize> for Rgb {
    type Output = f64;
    #[inline]
    fn index(&self, channel: usize) -> &f64 {
        match channel {
            0 => &self.r,
            1 => &self.g,
            _ => &self.b,
        }
    }
}

macro_rules! channelwise {
    ($($op:ident $method:ident $symbol:tt),*) => {$(
        impl $op for Rgb {
            type Output = Rgb;
            #[inline]
            fn $method(self, o: Rgb) -> Rgb {
                Rgb::new(self.r $symbol o.r, self.g $symbol o.g, self.b $symbol o.b)
            }
        }
    )*};
}
channelwise!(Add add +, Sub sub -, Mul mul *);

impl Mul<f64> for Rgb {
    type Output = Rgb;
    #[inline]
    fn mul(self, s: f64) -> Rgb {
        self.map(|c| c * s)
    }
}

impl Mul<Rgb> for f64 {
    type Output = Rgb;
    #[inline]
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl Div<f64> for Rgb {
    type Output = Rgb;
    #[inline]
    fn div(self, s: f64) -> Rgb {
        self.map(|c| c / s)
    }
}

impl Neg for Rgb {
    type Output = Rgb;
    #[inline]
    fn neg(self) -> Rgb {
        self.map(|c| -c)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl MulAssign<f64> for Rgb {
    #[inline]
    fn mul_assign(&mut self, s: f64) {
        *self = *self * s;
    }
}

impl std::iter::Sum for Rgb {
    fn sum<I: Iterator<Item = Rgb>>(iter: I) -> Rgb {
        iter.fold(Rgb::BLACK, |a, b| a + b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_has_luminance_one() {
        assert!((Rgb::WHITE.luminance() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn arithmetic_is_channelwise() {
        let a = Rgb::new(1.0, 2.0, 3.0);
        let b = Rgb::new(4.0, 5.0, 6.0);
        assert_eq!(a * b + a - b, Rgb::new(1.0, 7.0, 15.0));
        assert_eq!((a / 2.0).to_array(), [0.5, 1.0, 1.5]);
        assert_eq!(a[2], 3.0);
    }
}
