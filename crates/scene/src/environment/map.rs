//! A picture of all directions: bilinear radiance, and directions by the light of its pixels.
//!
//! Every pixel is chosen by the mean of its bilinear radiance, so that there is light nowhere without a density.

use std::f64::consts::PI;

use glam::DVec3;

use super::{direction_of, place_of};
use crate::authored::{EnvironmentMap, RadianceMap};
use crate::rgb::Rgb;
use crate::sample::table::{SphereTable, cell_solid_angle};

/// Weights of a pixel's neighbours in its mean, along one side: the integral of a tent of one pixel's radius.
const MEAN: [f64; 3] = [0.125, 0.75, 0.125];
/// Within a pixel, bilinear radiance is at most so many times its mean: a quarter of one bright neighbour in a corner, of
/// which the mean knows a sixty-fourth.
const OVER_MEAN: f64 = 16.0;

#[derive(Clone, Debug)]
pub(super) struct MapLight {
    map: EnvironmentMap,
    /// Sine and cosine of the turn.
    turn: [f64; 2],
    /// `None` if all of it is black.
    table: Option<SphereTable>,
    integral: Rgb,
}

impl MapLight {
    pub(super) fn new(map: &EnvironmentMap) -> Self {
        let image = &map.image;
        let (rows, columns) = (image.height as usize, image.width as usize);
        let table = SphereTable::new(rows, columns, |row, column| mean(image, row, column).luminance());
        let row = |row| (0..columns).map(|column| mean(image, row, column)).sum::<Rgb>();
        let integral: Rgb = (0..rows).map(|r| row(r) * cell_solid_angle(r, rows, columns)).sum();
        let (sin, cos) = libm::sincos(map.rotation);
        Self { map: map.clone(), turn: [sin, cos], table, integral: integral * map.strength }
    }

    #[inline]
    pub(super) fn radiance(&self, towards: DVec3) -> Rgb {
        let image = &self.map.image;
        let [cosine, turn] = place_of(self.to_map(towards));
        let (x, y) = (turn * f64::from(image.width) - 0.5, libm::acos(cosine) / PI * f64::from(image.height) - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (dx, dy) = (x - left, y - top);
        let pixel = |i: i64, j: i64| pixel(image, left as i64 + i, top as i64 + j);
        let row = |j| pixel(0, j) * (1.0 - dx) + pixel(1, j) * dx;
        (row(0) * (1.0 - dy) + row(1) * dy) * self.map.strength
    }

    /// ∫ L dω.
    pub(super) fn integral(&self) -> Rgb {
        self.integral
    }

    /// Bound of 𝓛(radiance)/pdf.
    pub(super) fn largest_estimate(&self) -> f64 {
        OVER_MEAN * self.integral.luminance()
    }

    #[inline]
    pub(super) fn pdf(&self, towards: DVec3) -> f64 {
        match &self.table {
            Some(table) => table.pdf(place_of(self.to_map(towards))),
            None => 1.0 / (4.0 * PI),
        }
    }

    #[inline]
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let d = match &self.table {
            Some(table) => direction_of(table.sample(u)),
            None => return crate::sample::warp::uniform_sphere(u),
        };
        let [sin, cos] = self.turn;
        DVec3::new(cos * d.x + sin * d.z, d.y, cos * d.z - sin * d.x)
    }

    /// A direction of the world as the picture has it.
    #[inline]
    fn to_map(&self, d: DVec3) -> DVec3 {
        let [sin, cos] = self.turn;
        DVec3::new(cos * d.x - sin * d.z, d.y, cos * d.z + sin * d.x)
    }
}

/// Mean of the bilinear radiance over a pixel.
fn mean(image: &RadianceMap, row: usize, column: usize) -> Rgb {
    let mut sum = Rgb::BLACK;
    for (j, down) in MEAN.iter().enumerate() {
        for (i, across) in MEAN.iter().enumerate() {
            sum += pixel(image, (column + i) as i64 - 1, (row + j) as i64 - 1) * (down * across);
        }
    }
    sum
}

/// A pixel: columns go round, beyond the poles their own row is met.
#[inline]
fn pixel(image: &RadianceMap, column: i64, row: i64) -> Rgb {
    let column = column.rem_euclid(i64::from(image.width)) as usize;
    let row = row.clamp(0, i64::from(image.height) - 1) as usize;
    Rgb::from_f32(image.pixels[row * image.width as usize + column])
}
