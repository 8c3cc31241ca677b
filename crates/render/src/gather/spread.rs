//! Light that few rays bring, as of a caustic or a bright spot far away: what is too much for the pixel of a ray is given to
//! all around, in proportion to what is expected of them. No light is lost; it is only less sharp than the rest, and the
//! less so the more rays brought it: each pixel gives to the smallest neighbourhood that has enough of such rays.

use twinray_scene::Rgb;

use crate::sums::PixelSums;

/// Pixels from one centre of a neighbourhood to the next, from the smallest to the largest; each pixel's light goes to the
/// nearest four centres.
const STEPS: [usize; 4] = [2, 4, 8, 16];
/// Rays of equal light that are enough: as evenly as this, (Σ light)²/Σ light².
const ENOUGH: f64 = 16.0;
/// Of its luminance, what each channel of an expectation counts at least: a ray may bring what was not expected.
const FAINT: f64 = 1e-3;

/// What each pixel of rows of `width` gets: mean direct and indirect radiance.
pub(super) fn spread(pixels: &[PixelSums], width: usize) -> Vec<[Rgb; 2]> {
    let mut shares = vec![[Rgb::BLACK; 2]; pixels.len()];
    let has_enough = |[sum, squares]: [f64; 2]| sum * sum >= ENOUGH * squares;
    // Pixels that have not yet given what they have.
    let mut open: Vec<usize> = Vec::new();
    for (index, pixel) in pixels.iter().enumerate() {
        let moments = pixel.excess_moments();
        if moments[1] == 0.0 {
            continue;
        }
        if has_enough(moments) { shares[index] = pixel.excess() } else { open.push(index) }
    }
    for step in STEPS {
        if open.is_empty() {
            break;
        }
        let grid = Grid { width, step, columns: width.div_ceil(step) + 1 };
        let centres = grid.columns * ((pixels.len() / width.max(1)).div_ceil(step) + 1);
        let mut moments = vec![[0.0; 2]; centres];
        let mut expected = vec![Rgb::BLACK; centres];
        for (index, pixel) in pixels.iter().enumerate() {
            let [sum, squares] = pixel.excess_moments();
            for (centre, weight) in grid.around(index) {
                moments[centre][0] += sum * weight;
                moments[centre][1] += squares * weight;
                expected[centre] += due(pixel) * weight;
            }
        }
        let is_last = step == STEPS[STEPS.len() - 1];
        let gives = |&index: &usize| {
            is_last || grid.around(index).all(|(centre, weight)| weight == 0.0 || has_enough(moments[centre]))
        };
        let (giving, others): (Vec<usize>, Vec<usize>) = open.into_iter().partition(gives);
        open = others;
        let mut given = vec![[Rgb::BLACK; 2]; centres];
        for index in giving {
            let excess = pixels[index].excess();
            for (centre, weight) in grid.around(index) {
                (0..2).for_each(|k| given[centre][k] += excess[k] * weight);
            }
        }
        let over = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
        for (given, expected) in given.iter_mut().zip(&expected) {
            *given = given.map(|g| Rgb::new(over(g.r, expected.r), over(g.g, expected.g), over(g.b, expected.b)));
        }
        for (index, (share, pixel)) in shares.iter_mut().zip(pixels).enumerate() {
            for (centre, weight) in grid.around(index) {
                (0..2).for_each(|k| share[k] += due(pixel) * given[centre][k] * weight);
            }
        }
    }
    shares
}

/// What a pixel's share is in proportion to.
fn due(pixel: &PixelSums) -> Rgb {
    let expected = pixel.expected();
    expected + Rgb::grey(FAINT * expected.luminance())
}

/// Centres of neighbourhoods over rows of pixels.
struct Grid {
    width: usize,
    step: usize,
    columns: usize,
}

impl Grid {
    /// The four centres around a pixel, with weights that add up to 1.
    fn around(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let Grid { width, step, columns } = *self;
        let [x, y] = [index % width, index / width].map(|c| (c / step, (c % step) as f64 / step as f64));
        (0..4).map(move |k| {
            let (right, below) = (k % 2, k / 2);
            let weight = |(_, part): (usize, f64), far: usize| if far == 1 { part } else { 1.0 - part };
            ((y.0 + below) * columns + x.0 + right, weight(x, right) * weight(y, below))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sums::Seen;

    /// Whatever the expectations, what is given is what was too much, channel by channel.
    #[test]
    fn no_light_is_lost() {
        let (width, height) = (53, 37);
        let pixels: Vec<PixelSums> = (0..width * height)
            .map(|i| {
                let mut sums = PixelSums::default();
                let expected = Rgb::new((i % 7) as f64, (i % 5) as f64, 0.0);
                let excess =
                    if i % 97 == 3 { [Rgb::new(1.0, 2.0, 3.0), Rgb::grey((i % 11) as f64)] } else { [Rgb::BLACK; 2] };
                let excess_squares = (excess[0] + excess[1]).luminance().powi(2);
                sums.add(&Seen { rays: 1, expected, excess, excess_squares, ..Seen::default() });
                sums
            })
            .collect();
        let shares = spread(&pixels, width);
        for k in 0..2 {
            let before = pixels.iter().fold(Rgb::BLACK, |sum, p| sum + p.excess()[k]);
            let after = shares.iter().fold(Rgb::BLACK, |sum, s| sum + s[k]);
            assert!(
                (after - before).map(f64::abs).max_channel() < 1e-9 * before.max_channel(),
                "{after:?} of {before:?}"
            );
        }
    }

    /// What many rays brought to one pixel stays where it is, and what one ray brought does not.
    #[test]
    fn many_rays_are_sharper_than_one() {
        let width = 65;
        let spot = |rays: u32| {
            let mut pixels = vec![PixelSums::default(); width * width];
            for (i, pixel) in pixels.iter_mut().enumerate() {
                let is_spot = i == width * width / 2;
                let excess = if is_spot { [Rgb::BLACK, Rgb::grey(f64::from(rays))] } else { [Rgb::BLACK; 2] };
                let excess_squares = if is_spot { f64::from(rays) } else { 0.0 };
                pixel.add(&Seen { rays: 100, expected: Rgb::WHITE, excess, excess_squares, ..Seen::default() });
            }
            let shares = spread(&pixels, width);
            shares[width * width / 2][1].r / (f64::from(rays) / 100.0)
        };
        assert_eq!(spot(16), 1.0);
        assert!(spot(15) < 0.5);
        assert!(spot(1) < 0.01);
    }
}
