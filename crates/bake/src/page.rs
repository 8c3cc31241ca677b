//! One page of an atlas: irradiance per texel, and how much of each texel is surface.

use twinray_scene::Rgb;

/// A page of a lightmap; the first row is that of the smallest v.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Irradiance `[height, width]`, W·m⁻² (or lux), linear BT.709.
    pub irradiance: Vec<[f32; 3]>,
    /// Share of each texel that is surface whose light is known, `[height, width]`; 0 in the gaps between charts.
    pub coverage: Vec<f32>,
}

impl Page {
    /// A black page.
    pub fn new([width, height]: [u32; 2]) -> Self {
        let count = width as usize * height as usize;
        Self { width, height, irradiance: vec![[0.0; 3]; count], coverage: vec![0.0; count] }
    }

    /// What a graphics processor reads at (`u`, `v`) in [0, 1]²: bilinear, clamped at the page's edges.
    pub fn sample(&self, u: f64, v: f64) -> Rgb {
        let mut sum = Rgb::BLACK;
        for (texel, weight) in self.footprint(u, v) {
            sum += Rgb::from_f32(self.irradiance[texel]) * weight;
        }
        sum
    }

    /// The four texels that a bilinear filter reads at (`u`, `v`), and their weights.
    pub fn footprint(&self, u: f64, v: f64) -> [(usize, f64); 4] {
        let (x, y) = (u * f64::from(self.width) - 0.5, v * f64::from(self.height) - 0.5);
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (x - i, y - j);
        let at = |di: f64, dj: f64| {
            let column = (i + di).clamp(0.0, f64::from(self.width - 1)) as usize;
            let row = (j + dj).clamp(0.0, f64::from(self.height - 1)) as usize;
            row * self.width as usize + column
        };
        [
            (at(0.0, 0.0), (1.0 - s) * (1.0 - t)),
            (at(1.0, 0.0), s * (1.0 - t)),
            (at(0.0, 1.0), (1.0 - s) * t),
            (at(1.0, 1.0), s * t),
        ]
    }
}
