//! Albedos without a closed form, tabulated once: over cosine and lobe width, read by bilinear interpolation.
//!
//! Tables are computed, not stored: deterministic quadrature, some tens of milliseconds at first use.

use std::sync::OnceLock;

use glam::DVec3;

use super::ggx;

const COSINES: usize = 48;
const WIDTHS: usize = 32;

/// A function of (cosine, width), both in [0, 1].
///
/// Nodes lie at squares: albedos turn steeply near grazing directions and for narrow lobes.
pub(super) struct Table {
    values: Vec<f64>,
}

impl Table {
    fn build(f: impl Fn(f64, f64) -> f64) -> Self {
        let values = nodes().map(|(cosine, width)| f(cosine, width)).collect();
        Self { values }
    }

    /// Two functions that are computed together.
    fn build_two(f: impl Fn(f64, f64) -> (f64, f64)) -> [Self; 2] {
        let (first, second) = nodes().map(|(cosine, width)| f(cosine, width)).unzip();
        [first, second].map(|values| Self { values })
    }

    /// Interpolated value.
    pub(super) fn at(&self, cosine: f64, width: f64) -> f64 {
        let place = |x: f64, n: usize| {
            let p = x.clamp(0.0, 1.0).sqrt() * (n - 1) as f64;
            let i = (p as usize).min(n - 2);
            (i, p - i as f64)
        };
        let ((c, fc), (w, fw)) = (place(cosine, COSINES), place(width, WIDTHS));
        let row = |w: usize| {
            let r = &self.values[w * COSINES + c..];
            r[0] + (r[1] - r[0]) * fc
        };
        let (a, b) = (row(w), row(w + 1));
        a + (b - a) * fw
    }
}

/// (cosine, width) of a table's entries, in order.
fn nodes() -> impl Iterator<Item = (f64, f64)> {
    let node = |i: usize, n: usize| (i as f64 / (n - 1) as f64).powi(2);
    (0..WIDTHS).flat_map(move |w| (0..COSINES).map(move |c| (node(c, COSINES).max(1e-4), node(w, WIDTHS))))
}

/// The GGX lobe's directional albedo for Schlick's Fresnel term: F0·scale + F90·bias ("split sum", Karis 2013),
/// and their cosine-weighted means.
pub(super) struct GgxTables {
    pub scale: Table,
    pub bias: Table,
    /// Functions of the width alone.
    pub mean_scale: Table,
    pub mean_bias: Table,
}

/// Points per axis of the quadrature behind one table entry.
const QUADRATURE: usize = 32;

fn unit_square() -> impl Iterator<Item = [f64; 2]> {
    let centre = |i: usize| (i as f64 + 0.5) / QUADRATURE as f64;
    (0..QUADRATURE * QUADRATURE).map(move |i| [centre(i / QUADRATURE), centre(i % QUADRATURE)])
}

pub(super) fn ggx() -> &'static GgxTables {
    static TABLES: OnceLock<GgxTables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let entry = |cosine: f64, alpha: f64| {
            let alpha = alpha.max(1e-3);
            let wi = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
            let (scale, bias) = unit_square()
                .map(|[s, v]| {
                    // The far tail of the distribution, a share of about α², is what is lost below the horizon. It
                    // lies at the end of the unit interval, so that is where the points crowd: u = 1 − (1 − s)³.
                    let (u, weight) = (1.0 - (1.0 - s).powi(3), 3.0 * (1.0 - s).powi(2));
                    let h = ggx::visible_normal(wi, alpha, [u, v]);
                    let wo = 2.0 * wi.dot(h) * h - wi;
                    if wo.z <= 0.0 {
                        return (0.0, 0.0);
                    }
                    let (lobe, fresnel) = (weight * ggx::masking_ratio(wi.z, wo.z, alpha), schlick(wi.dot(h)));
                    (lobe * (1.0 - fresnel), lobe * fresnel)
                })
                .fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
            let points = (QUADRATURE * QUADRATURE) as f64;
            (scale / points, bias / points)
        };
        let [scale, bias] = Table::build_two(entry);
        let mean = |table: &Table, a: f64| {
            let n = 64;
            (0..n).map(|i| table.at((1.0 - (i as f64 + 0.5) / n as f64).sqrt(), a)).sum::<f64>() / n as f64
        };
        let mean_scale = Table::build(|_, a| mean(&scale, a));
        let mean_bias = Table::build(|_, a| mean(&bias, a));
        GgxTables { scale, bias, mean_scale, mean_bias }
    })
}

/// The normalised Phong lobe's directional albedo over its reflectance, as a function of √(2/(n + 2)).
pub(super) fn phong() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| {
        Table::build(|cosine, width| {
            let width = width.max(1e-3);
            let exponent = 2.0 / (width * width) - 2.0;
            let mirror = DVec3::new(-(1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
            let frame = crate::geom::Frame::from_normal(mirror);
            let sum: f64 =
                unit_square().map(|u| frame.to_world(super::phong::around_axis(exponent, u)).z.max(0.0)).sum();
            sum / (QUADRATURE * QUADRATURE) as f64 * (exponent + 2.0) / (exponent + 1.0)
        })
    })
}

/// Schlick's (1 − cos)⁵.
pub(super) fn schlick(cosine: f64) -> f64 {
    let m = (1.0 - cosine).clamp(0.0, 1.0);
    (m * m) * (m * m) * m
}
