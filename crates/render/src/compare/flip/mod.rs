//! ꟻLIP: where, and how strongly, somebody who alternates between two pictures sees them differ.
//!
//! LDR-ꟻLIP after Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "ꟻLIP: A Difference Evaluator
//! for Alternating Images" (HPG 2020), below LDR; HDR-ꟻLIP after Andersson, Nilsson, Shirley and Akenine-Möller,
//! "Visualizing Errors in Rendered High Dynamic Range Images" (Eurographics 2021, short papers), below HDR. `color` is
//! the colour spaces, `filter` the kernels, `exposure` what HDR adds. Checked against the authors' tool in
//! `tests/it/flip.rs`.

mod color;
mod exposure;
mod filter;

use rayon::prelude::*;

use crate::image::Image;
use color::{Opponent, hunt_lab, hyab, linear_from_opponent, opponent};
use filter::{Features, Planes, Spatial};

/// Pixels per degree of visual angle: 0.7 m before a screen of 3840 pixels on 0.7 m (LDR, §6).
pub const PIXELS_PER_DEGREE: f64 = 0.7 * 3840.0 / 0.7 * std::f64::consts::PI / 180.0;

/// Visible differences of two pictures, in [0, 1]: 0 where nobody sees any.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `[height, width]`, first row on top.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// Mean over all pixels.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|v| f64::from(*v)).sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Largest value.
    pub fn max(&self) -> f32 {
        self.values.iter().copied().fold(0.0, f32::max)
    }

    /// sRGB bytes `[height, width, 3]` in the colours that ꟻLIP is shown in: black 0, purple, orange, pale yellow 1.
    pub fn magma(&self) -> Vec<u8> {
        let color = |v: &f32| colorous::MAGMA.eval_continuous(f64::from(v.clamp(0.0, 1.0))).as_array();
        self.values.iter().flat_map(color).collect()
    }
}

/// ꟻLIP of two pictures as a screen shows them: linear display values, of which [0, 1] counts.
///
/// # Panics
/// If they differ in size.
pub fn ldr(test: &Image, reference: &Image) -> FlipMap {
    let size = common_size(test, reference);
    let stage = Stage::new(size);
    let clamped = |image: &Image| Planes::map(&image.pixels, |c| opponent(c.map(|v| f64::from(v).clamp(0.0, 1.0))));
    let values = stage.differences(&clamped(test), &clamped(reference));
    FlipMap { width: size.0 as u32, height: size.1 as u32, values }
}

/// ꟻLIP of two pictures of radiance: the largest difference of each pixel over all sensible exposures of the
/// reference, tone-mapped.
///
/// # Panics
/// If they differ in size.
pub fn hdr(test: &Image, reference: &Image) -> FlipMap {
    let size = common_size(test, reference);
    let stage = Stage::new(size);
    let mut values = vec![0.0f32; test.pixels.len()];
    for stops in exposure::exposures(&reference.pixels) {
        let exposed = |image: &Image| {
            let scale = libm::exp2(stops);
            Planes::map(&image.pixels, |c| opponent(c.map(|v| exposure::tone(scale * f64::from(v)))))
        };
        let differences = stage.differences(&exposed(test), &exposed(reference));
        values.iter_mut().zip(differences).for_each(|(most, d)| *most = most.max(d));
    }
    FlipMap { width: size.0 as u32, height: size.1 as u32, values }
}

fn common_size(test: &Image, reference: &Image) -> (usize, usize) {
    assert_eq!((test.width, test.height), (reference.width, reference.height), "pictures of different size");
    (test.width as usize, test.height as usize)
}

/// Everything that does not depend on the pictures.
struct Stage {
    size: (usize, usize),
    spatial: Spatial,
    features: Features,
    largest_color_difference: f64,
}

/// Exponents and knees of LDR, §4.1.3 and §4.2.
const COLOR_EXPONENT: f64 = 0.7;
const KNEE: f64 = 0.4;
const KNEE_VALUE: f64 = 0.95;
const FEATURE_EXPONENT: f64 = 0.5;

impl Stage {
    fn new(size: (usize, usize)) -> Self {
        // The largest difference of the colour space lies between the blue and the green of the screen (LDR, §4.1.3).
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(hunt_lab);
        Self {
            size,
            spatial: Spatial::new(PIXELS_PER_DEGREE),
            features: Features::new(PIXELS_PER_DEGREE),
            largest_color_difference: libm::pow(hyab(green, blue), COLOR_EXPONENT),
        }
    }

    /// ꟻLIP per pixel of two pictures in the opponent space. LDR, §4.
    fn differences(&self, test: &Planes, reference: &Planes) -> Vec<f32> {
        let seen = |picture: &Planes| {
            let filtered = self.spatial.apply(picture, self.size);
            // What the eye's filter leaves may lie outside what a screen can show.
            filtered.map_each(|c: Opponent| hunt_lab(linear_from_opponent(c).map(|v| v.clamp(0.0, 1.0))))
        };
        let colors = [seen(test), seen(reference)];
        let features = [test, reference].map(|picture| self.features.apply(&picture.0[0], self.size));
        let value = |i: usize| {
            let color = self.color_difference(hyab(colors[0].at(i), colors[1].at(i)));
            let [a, b] = [0, 1].map(|k| features[k][i]);
            let strongest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            let feature = libm::pow(f64::from(strongest) / std::f64::consts::SQRT_2, FEATURE_EXPONENT);
            libm::pow(color, 1.0 - feature) as f32
        };
        (0..self.size.0 * self.size.1).into_par_iter().map(value).collect()
    }

    /// A distance in colour space to [0, 1]: small differences take most of the range. LDR, §4.1.3.
    fn color_difference(&self, distance: f64) -> f64 {
        let (compressed, most) = (libm::pow(distance, COLOR_EXPONENT), self.largest_color_difference);
        if compressed < KNEE * most {
            compressed * KNEE_VALUE / (KNEE * most)
        } else {
            KNEE_VALUE + (compressed - KNEE * most) / (most - KNEE * most) * (1.0 - KNEE_VALUE)
        }
    }
}
