//! Sums of what camera rays saw, pixel by pixel, and what is made of them: a picture, its errors, its exposure.
//!
//! Samples enter in batches. Those of a batch may be even among each other, batches are independent, so that their
//! scatter tells the error of the mean.

use twinray_scene::Rgb;

use crate::image::Image;
use crate::picture::Picture;

/// Pixels along a side of the tiles whose logarithms count for automatic exposure: small against what a picture
/// shows, large against its noise.
const TILE: usize = 4;

/// What some camera rays saw; sums over them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    pub rays: u32,
    pub radiance: Rgb,
    /// The part of it that comes straight from emitters and sky, and the rays that met some.
    pub lights: Rgb,
    pub covered: u32,
    /// The part that surfaces reflect of light straight from emitters and sky.
    pub direct: Rgb,
    /// What was too much for one pixel, of direct and of indirect light: it is for all around, and no part of the sums above.
    pub excess: [Rgb; 2],
    /// Σ of the squares of its luminance, ray by ray.
    pub excess_squares: f64,
    /// What was expected of gather rays.
    pub expected: Rgb,
    /// Rays that met surfaces without emission, and the luminance of these.
    pub unlit: u32,
    pub unlit_luminance: f64,
    pub empty: u32,
    pub invalid: u32,
}

/// Sums of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelSums {
    seen: Seen,
    batches: u32,
    /// Σ of batches' mean luminance, and of its square.
    sum: f64,
    squares: f64,
}

impl PixelSums {
    /// Adds a batch; all batches of a pixel are of one size.
    pub fn add(&mut self, batch: &Seen) {
        let s = &mut self.seen;
        s.rays += batch.rays;
        s.radiance += batch.radiance;
        s.lights += batch.lights;
        s.covered += batch.covered;
        s.direct += batch.direct;
        (0..2).for_each(|k| s.excess[k] += batch.excess[k]);
        s.excess_squares += batch.excess_squares;
        s.expected += batch.expected;
        s.unlit += batch.unlit;
        s.unlit_luminance += batch.unlit_luminance;
        s.empty += batch.empty;
        s.invalid += batch.invalid;
        let mean = batch.radiance.luminance() / f64::from(batch.rays.max(1));
        self.batches += 1;
        self.sum += mean;
        self.squares += mean * mean;
    }

    /// Camera rays so far.
    pub fn rays(&self) -> u32 {
        self.seen.rays
    }

    /// Mean radiance.
    pub fn radiance(&self) -> Rgb {
        self.seen.radiance / f64::from(self.seen.rays.max(1))
    }

    /// Mean of the part that is reflected light straight from emitters and sky.
    pub fn direct(&self) -> Rgb {
        self.seen.direct / f64::from(self.seen.rays.max(1))
    }

    /// Mean of the part that is emitted where it is seen.
    pub fn lights(&self) -> Rgb {
        self.seen.lights / f64::from(self.seen.rays.max(1))
    }

    /// Mean of what was too much for this pixel and is for all around: of direct and of indirect light.
    pub fn excess(&self) -> [Rgb; 2] {
        self.seen.excess.map(|light| light / f64::from(self.seen.rays.max(1)))
    }

    /// Sum and sum of squares of the luminance of what was too much, ray by ray.
    pub fn excess_moments(&self) -> [f64; 2] {
        [(self.seen.excess[0] + self.seen.excess[1]).luminance(), self.seen.excess_squares]
    }

    /// Mean of what was expected of gather rays.
    pub fn expected(&self) -> Rgb {
        self.seen.expected / f64::from(self.seen.rays.max(1))
    }

    /// The pixel with its share of what was too much for others: mean direct and indirect light.
    pub fn with(mut self, [direct, indirect]: [Rgb; 2]) -> Self {
        let rays = f64::from(self.seen.rays);
        self.seen.direct += direct * rays;
        self.seen.radiance += (direct + indirect) * rays;
        self.seen.unlit_luminance += (direct + indirect).luminance() * f64::from(self.seen.unlit);
        self
    }

    /// True if no ray met a light.
    pub fn is_plain(&self) -> bool {
        self.seen.covered == 0
    }

    /// Camera rays that were dropped.
    pub fn invalid(&self) -> u32 {
        self.seen.invalid
    }

    /// Variance of a single batch's mean luminance, estimated; infinite before the second batch.
    pub fn variance_of_batch(&self) -> f64 {
        if self.batches < 2 {
            return f64::INFINITY;
        }
        let n = f64::from(self.batches);
        // Rounding may leave less than nothing where all batches are equal.
        (self.squares - self.sum * self.sum / n).max(0.0) / (n - 1.0)
    }

    /// Variance of the mean luminance: the square of its standard error; infinite before the second batch.
    pub fn variance(&self) -> f64 {
        self.variance_of_batch() / f64::from(self.batches.max(1))
    }
}

/// Relative RMS error of the pixels' luminance, √(Σ variance / Σ 𝓛²), over pixels that no light covers; over all
/// pixels if there are no others. Infinite before the second batch; 0 in the dark.
pub(crate) fn relative_error(pixels: &[PixelSums]) -> f64 {
    let over = |which: &dyn Fn(&PixelSums) -> bool| {
        pixels.iter().filter(|p| which(p)).fold((0.0, 0.0), |(variance, square), p| {
            (variance + p.variance(), square + p.radiance().luminance().powi(2))
        })
    };
    let plain = over(&PixelSums::is_plain);
    let (variance, square) = if plain.1 > 0.0 { plain } else { over(&|_| true) };
    match (variance.is_finite(), square > 0.0) {
        (false, _) => f64::INFINITY,
        (true, true) => (variance / square).sqrt(),
        (true, false) => 0.0,
    }
}

/// The picture of a film `width` pixels wide.
pub(crate) fn picture(pixels: impl ExactSizeIterator<Item = PixelSums> + Clone, width: u32) -> Picture {
    let height = pixels.len() as u32 / width.max(1);
    let empty: f64 = pixels.clone().map(|p| f64::from(p.seen.empty) / f64::from(p.rays().max(1))).sum();
    let lights = |p: PixelSums| (p.lights().to_f32(), (f64::from(p.seen.covered) / f64::from(p.rays().max(1))) as f32);
    Picture {
        image: Image { width, height, pixels: pixels.clone().map(|p| p.radiance().to_f32()).collect() },
        lights: pixels.clone().map(lights).collect(),
        log2_luminance: log2_luminance(pixels.clone(), width as usize),
        empty: empty / pixels.len().max(1) as f64,
    }
}

/// Mean of log₂ luminance for automatic exposure, where camera rays met surfaces without emission. The logarithm is
/// that of tiles: of single paths, or of pixels of a few, it would be darker by all of their noise.
fn log2_luminance(pixels: impl ExactSizeIterator<Item = PixelSums>, width: usize) -> Option<f64> {
    let columns = width.div_ceil(TILE);
    let mut tiles = vec![(0.0, 0.0); columns * (pixels.len() / width.max(1)).div_ceil(TILE)];
    for (index, p) in pixels.enumerate() {
        // Pixels count alike, however many rays they have.
        let rays = f64::from(p.rays().max(1));
        let tile = &mut tiles[index / width / TILE * columns + index % width / TILE];
        tile.0 += f64::from(p.seen.unlit) / rays;
        tile.1 += p.seen.unlit_luminance / rays;
    }
    let lit = tiles.iter().filter(|(_, luminance)| *luminance > 0.0);
    let (share, sum) = lit.fold((0.0, 0.0), |(share, sum), (n, l)| (share + n, sum + n * libm::log2(l / n)));
    (share > 0.0).then(|| sum / share)
}
