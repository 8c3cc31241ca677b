//! Directions from which light comes to a place of the film, learnt from its gather rays.
//!
//! Windows, sunlit sills, doors ajar and bright spots in mirrors are small seen from most of a room, and rays of a BRDF
//! find them by luck alone. A guide is a density over directions, piecewise constant on a grid, in proportion to the root
//! of the mean square of what rays into each cell brought to the eye: so a ray into any cell brings about the same
//! (after Vorba et al., "On-line learning of parametric mixture models for light transport simulation", SIGGRAPH 2014,
//! and Rath et al., "Variance-aware path guiding", SIGGRAPH 2020). Half of the gather rays follow it, half the BRDF; the
//! density of a ray is that of both together.
//!
//! The sphere is unfolded as an octahedron: no trigonometry, and density per solid angle from that on the square by |x| +
//! |y| + |z| cubed.

use glam::DVec3;
use twinray_scene::Rgb;
use twinray_scene::brdf::Towards;

/// Cells along a side of the unfolded sphere.
const GRID: usize = 16;
/// Cells of a guide.
pub(super) const CELLS: usize = GRID * GRID;
/// Probability with which a guide is followed where there is one.
const SHARE: f64 = 0.5;
/// Of the mean, what each cell gets as well.
const LEAST: f64 = 0.01;

/// A density over directions.
#[derive(Clone, Debug)]
pub(super) struct Guide {
    /// Per row, sums of probabilities up to its end.
    rows: [f64; GRID],
    /// Per row, sums of its cells' probabilities within it.
    columns: Box<[f64; CELLS]>,
    /// Per cell, density on the unit square.
    density: Box<[f64; CELLS]>,
}

/// A BRDF as the eye sees it, and perhaps a guide: how gather rays are aimed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim<'g> {
    pub brdf: Towards,
    pub guide: Option<&'g Guide>,
}

impl Aim<'_> {
    /// A direction for a point of the unit square.
    pub fn sample(&self, [u, v]: [f64; 2]) -> Option<DVec3> {
        match self.guide {
            Some(guide) if u < self.share() => Some(guide.sample([u / self.share(), v])),
            Some(_) => self.brdf.sample([(u - self.share()) / (1.0 - self.share()), v]),
            None => self.brdf.sample([u, v]),
        }
    }

    /// Probability with which the guide is followed, if there is one: lobes know better.
    fn share(&self) -> f64 {
        SHARE * (1.0 - self.brdf.lobe_share())
    }

    /// Density of [`Aim::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let brdf = self.brdf.pdf(direction);
        self.guide.map_or(brdf, |guide| self.share() * guide.pdf(direction) + (1.0 - self.share()) * brdf)
    }

    /// The BRDF's value.
    #[inline]
    pub fn eval(&self, direction: DVec3) -> Rgb {
        self.brdf.eval(direction)
    }
}

impl Guide {
    /// A guide in proportion to weights that are not negative; `None` if all are zero.
    pub fn new(weights: &[f64]) -> Option<Self> {
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let least = LEAST * total / CELLS as f64;
        let total = total + LEAST * total;
        let probability = |cell: usize| (weights[cell] + least) / total;
        let (mut rows, mut columns, mut density) = ([0.0; GRID], Box::new([0.0; CELLS]), Box::new([0.0; CELLS]));
        let mut before = 0.0;
        for row in 0..GRID {
            let mut within = 0.0;
            for cell in row * GRID..(row + 1) * GRID {
                within += probability(cell);
                columns[cell] = within;
                density[cell] = probability(cell) * CELLS as f64;
            }
            columns[row * GRID..(row + 1) * GRID].iter_mut().for_each(|sum| *sum /= within);
            before += within;
            rows[row] = before;
        }
        rows.iter_mut().for_each(|sum| *sum /= before);
        Some(Self { rows, columns, density })
    }

    /// A guide for the integrals of f² over the cells, where f is what rays bring: a cell of solid angle Ω gets rays in
    /// proportion to √(Ω ∫f² dω), which has the least variance among densities that are even within cells.
    pub fn learnt(squares: &[f64]) -> Option<Self> {
        let weight = |(cell, square): (usize, &f64)| {
            let centre = [cell % GRID, cell / GRID].map(|c| (c as f64 + 0.5) / GRID as f64);
            (square / square_per_solid_angle(unfold_back(centre))).sqrt()
        };
        Self::new(&squares.iter().enumerate().map(weight).collect::<Vec<f64>>())
    }

    fn sample(&self, [u, v]: [f64; 2]) -> DVec3 {
        let (row, y) = invert(&self.rows, u);
        let (column, x) = invert(&self.columns[row * GRID..(row + 1) * GRID], v);
        unfold_back([(column as f64 + x) / GRID as f64, (row as f64 + y) / GRID as f64])
    }

    #[inline]
    fn pdf(&self, direction: DVec3) -> f64 {
        self.density[cell_of(direction)] * square_per_solid_angle(direction)
    }
}

/// The cell of a direction.
#[inline]
pub(super) fn cell_of(direction: DVec3) -> usize {
    let [x, y] = unfold(direction).map(|c| ((c * GRID as f64) as usize).min(GRID - 1));
    y * GRID + x
}

/// The interval of running sums that holds `u`, and where in it.
fn invert(sums: &[f64], u: f64) -> (usize, f64) {
    let k = sums.partition_point(|&sum| sum <= u).min(sums.len() - 1);
    let before = if k == 0 { 0.0 } else { sums[k - 1] };
    // A hair within, or rounding would lead into a neighbour, where the density is another.
    (k, ((u - before) / (sums[k] - before)).clamp(1e-9, 1.0 - 1e-9))
}

/// The place of a unit vector on the unit square.
#[inline]
fn unfold(d: DVec3) -> [f64; 2] {
    let sum = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, z) = (d.x / sum, d.z / sum);
    let [x, z] = if d.y >= 0.0 { [x, z] } else { [(1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z)] };
    [0.5 * (x + 1.0), 0.5 * (z + 1.0)]
}

/// The unit vector of a place on the unit square.
fn unfold_back(square: [f64; 2]) -> DVec3 {
    let [x, z] = square.map(|c| 2.0 * c - 1.0);
    let y = 1.0 - x.abs() - z.abs();
    let [x, z] = if y >= 0.0 { [x, z] } else { [(1.0 - z.abs()).copysign(x), (1.0 - x.abs()).copysign(z)] };
    DVec3::new(x, y, z).normalize()
}

/// Area of the unit square per solid angle: a face of the octahedron is √3 times as large as its shadow on the square of
/// side 2, seen from its centre at an angle with cosine (|x|+|y|+|z|)/√3 from a distance of 1/(|x|+|y|+|z|).
#[inline]
fn square_per_solid_angle(d: DVec3) -> f64 {
    let sum = d.x.abs() + d.y.abs() + d.z.abs();
    0.25 / (sum * sum * sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use twinray_scene::brdf::Brdf;
    use twinray_scene::sample::Stream;
    use twinray_testkit::chi2;

    /// Directions against the density, of a guide alone and of one beside a BRDF; 2 tests, false-alarm rate 1 % each.
    #[test]
    fn samples_follow_their_density() {
        let weights: Vec<f64> = (0..CELLS).map(|c| if c % 3 == 0 { 0.0 } else { ((c * 37) % 101) as f64 }).collect();
        let guide = Guide::new(&weights).unwrap();
        let brdf = Brdf::Lambertian { reflectance: Rgb::grey(0.5) }.towards(DVec3::new(0.6, 0.0, 0.8), DVec3::Z);
        let aim = Aim { brdf, guide: Some(&guide) };
        let mut random = Stream::new(5, 0, 0);
        let mut pair = || [random.uniform(), random.uniform()];
        let alone: Vec<_> = (0..400_000).map(|_| Some(guide.sample(pair()).to_array())).collect();
        let both: Vec<_> = (0..400_000).map(|_| aim.sample(pair()).map(|d| d.to_array())).collect();
        let p = chi2::sphere(alone.into_iter(), |d| guide.pdf(DVec3::from_array(d)), 10, 20).p_value;
        assert!(p > 0.01, "guide: p = {p}");
        let p = chi2::sphere(both.into_iter(), |d| aim.pdf(DVec3::from_array(d)), 10, 20).p_value;
        assert!(p > 0.01, "both: p = {p}");
    }

    #[test]
    fn unfolding_is_undone() {
        for k in 0..1000 {
            let square = [(f64::from(k) * 0.618_034).fract(), (f64::from(k) * 0.754_878).fract()];
            let again = unfold(unfold_back(square));
            assert!((0..2).all(|c| (again[c] - square[c]).abs() < 1e-12), "{square:?} {again:?}");
        }
    }

    #[test]
    fn nothing_learnt_is_no_guide() {
        assert!(Guide::learnt(&[0.0; CELLS]).is_none());
    }
}
