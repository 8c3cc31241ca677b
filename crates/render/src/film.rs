//! The film: which of its pixels are wanted, and the camera rays of each.
//!
//! A crop is a window of pixels of the whole film. Every number of a pixel depends on its place on the whole film and on
//! nothing else, so that a cropped picture is that part of the whole one, to the bit. Not here: what rays meet.

use glam::DVec3;
use twinray_scene::Camera;
use twinray_scene::sample::Stream;

/// A window of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column of the whole film.
    pub x: u32,
    /// First row of the whole film.
    pub y: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Crop {
    /// Whether it holds a pixel, and none beyond a film of so many columns and rows.
    pub fn lies_within(&self, width: u32, height: u32) -> bool {
        let inside =
            |first: u32, count: u32, all: u32| count > 0 && first.checked_add(count).is_some_and(|end| end <= all);
        inside(self.x, self.width, width) && inside(self.y, self.height, height)
    }
}

/// A film of so many pixels, and the window of it that is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Film {
    width: u32,
    height: u32,
    /// The pixels that are wanted.
    pub window: Crop,
}

impl Film {
    /// The whole film without a crop.
    ///
    /// # Panics
    /// If the crop is empty or leaves the film: who asks for pictures checks that with [`Crop::lies_within`].
    pub fn new(width: u32, height: u32, crop: Option<Crop>) -> Self {
        let window = crop.unwrap_or(Crop { x: 0, y: 0, width, height });
        assert!(
            crop.is_none() || window.lies_within(width, height),
            "{window:?} is not within {width}×{height} pixels"
        );
        Self { width, height, window }
    }

    /// Pixels of the window.
    pub fn len(&self) -> usize {
        self.window.width as usize * self.window.height as usize
    }

    /// Column and row on the whole film of a pixel of the window, counted along its rows.
    pub fn place(&self, index: usize) -> [u32; 2] {
        let columns = self.window.width as usize;
        [self.window.x + (index % columns) as u32, self.window.y + (index / columns) as u32]
    }

    /// Number of the pixel in a column and row of the whole film, counted along the rows of the whole film.
    pub fn number(&self, [x, y]: [u32; 2]) -> u64 {
        u64::from(y) * u64::from(self.width) + u64::from(x)
    }

    /// World-space origin and direction of the ray through a pixel of the whole film; see [`Camera::ray`]. `offset` is the
    /// place within and around the pixel, whose upper left corner is (0, 0).
    pub fn ray(&self, camera: &Camera, [x, y]: [u32; 2], offset: [f64; 2], lens: [f64; 2]) -> Option<(DVec3, DVec3)> {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let (px, py) = (f64::from(x) + offset[0], f64::from(y) + offset[1]);
        camera.ray(px / width, py / height, width / height, lens)
    }

    /// Sample `k` of a pixel of the whole film: even over the pixel, spread by a tent of one pixel's radius, and even over
    /// the lens. The same for everyone who asks.
    pub fn sample(&self, camera: &Camera, at: [u32; 2], k: u32) -> Option<(DVec3, DVec3)> {
        let pixel = self.number(at);
        // Additive recurrences, shifted at random per pixel, are even for any number of samples: R2 over the pixel, whose
        // steps are powers of the root of x³ = x + 1, and two powers of the root of x⁵ = x + 1, which are independent
        // of these, over the lens.
        let place = |step: f64, shift: f64| (f64::from(k) * step + shift).fract();
        let mut jitter = Stream::new(0, 0xF11A, pixel);
        let u = [place(0.754_877_666_246_692_7, jitter.uniform()), place(0.569_840_290_998_053_3, jitter.uniform())];
        let lens = match camera.lens {
            None => [0.0; 2],
            Some(_) => {
                let mut jitter = Stream::new(0, 0x1E45, pixel);
                [place(0.856_674_883_854_502_9, jitter.uniform()), place(0.538_597_257_223_610_1, jitter.uniform())]
            }
        };
        self.ray(camera, at, u.map(tent), lens)
    }
}

/// Place across a pixel, whose middle is 0.5, from a number in [0, 1): spread by a tent of one pixel's radius.
pub(crate) fn tent(u: f64) -> f64 {
    0.5 + if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}
