//! Directions by a table over the sphere: piecewise constant, sampled by inverting sums, with exactly the density that is
//! sampled.
//!
//! Rows are equal steps of the angle from a pole, columns equal steps around it; a place on the sphere is the cosine of
//! the one and the other in turns. Which axis the pole is decides the caller: environments and light profiles differ.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

/// Cells of one parallel task, about.
const TASK: usize = 1 << 14;

/// A density over directions.
#[derive(Clone, Debug)]
pub struct SphereTable {
    columns: usize,
    /// `[rows + 1]`: cosines of the angles between rows, from 1 to −1.
    edges: Vec<f64>,
    /// `[rows + 1]`: sums of the rows' probabilities, from 0 to 1.
    marginal: Vec<f64>,
    /// `[rows][columns]`: sums of the cells' probabilities within their row, the last of which is 1.
    conditional: Vec<f64>,
    integral: f64,
}

impl SphereTable {
    /// A table whose density in each cell is proportional to `weight(row, column)`, which is not negative. `None` if all
    /// weights are zero.
    pub fn new(rows: usize, columns: usize, weight: impl Fn(usize, usize) -> f64 + Sync) -> Option<Self> {
        let edges: Vec<f64> = (0..=rows).map(|row| edge(row, rows)).collect();
        let mut conditional = vec![0.0; rows * columns];
        let fill = |(row, sums): (usize, &mut [f64])| {
            let mut sum = 0.0;
            for (column, entry) in sums.iter_mut().enumerate() {
                sum += weight(row, column);
                *entry = sum;
            }
            if sum > 0.0 {
                sums.iter_mut().for_each(|entry| *entry /= sum);
            }
            sum
        };
        let tasks = conditional.par_chunks_mut(columns).enumerate().with_min_len(TASK.div_ceil(columns));
        let sums: Vec<f64> = tasks.map(fill).collect();
        let mut marginal = vec![0.0; rows + 1];
        for (row, sum) in sums.iter().enumerate() {
            marginal[row + 1] = marginal[row] + sum * cell(&edges, row, columns);
        }
        let integral = marginal[rows];
        if !(integral > 0.0 && integral.is_finite()) {
            return None;
        }
        marginal.iter_mut().for_each(|entry| *entry /= integral);
        Some(Self { columns, edges, marginal, conditional, integral })
    }

    /// ∫ weight dω.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Cosine of the angle from the pole, and turns around it in [0, 1), from uniform numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f64; 2]) -> [f64; 2] {
        // The first entry above u ends a part that has a width.
        let row = (self.marginal.partition_point(|&sum| sum <= u[0]).max(1) - 1).min(self.marginal.len() - 2);
        let within = (u[0] - self.marginal[row]) / (self.marginal[row + 1] - self.marginal[row]);
        let sums = &self.conditional[row * self.columns..][..self.columns];
        let column = sums.partition_point(|&sum| sum <= u[1]).min(self.columns - 1);
        let before = if column == 0 { 0.0 } else { sums[column - 1] };
        let across = (u[1] - before) / (sums[column] - before);
        // Even by solid angle: within a row the cosine is uniform.
        let cosine = self.edges[row] + inside(within) * (self.edges[row + 1] - self.edges[row]);
        [cosine, (column as f64 + inside(across)) / self.columns as f64]
    }

    /// Density of [`SphereTable::sample`] per solid angle.
    #[inline]
    pub fn pdf(&self, [cosine, turn]: [f64; 2]) -> f64 {
        let rows = self.edges.len() - 1;
        let row = row_of(cosine, rows, |row| self.edges[row]);
        let column = ((turn * self.columns as f64) as usize).min(self.columns - 1);
        let sums = &self.conditional[row * self.columns..][..self.columns];
        let before = if column == 0 { 0.0 } else { sums[column - 1] };
        let probability = (self.marginal[row + 1] - self.marginal[row]) * (sums[column] - before);
        probability / cell(&self.edges, row, self.columns)
    }
}

/// A place within a cell, so far from its border that no rounding leads across, where the density may be zero.
#[inline]
fn inside(place: f64) -> f64 {
    place.clamp(1e-9, 1.0 - 1e-9)
}

/// Cosine at the beginning of a row.
fn edge(row: usize, rows: usize) -> f64 {
    match row {
        0 => 1.0,
        _ if row == rows => -1.0,
        // The equator exactly, where skies meet the ground.
        _ if 2 * row == rows => 0.0,
        _ => libm::cos(PI * row as f64 / rows as f64),
    }
}

/// The row of a cosine: rounding of the arc cosine must not put a sample into a neighbour's row.
#[inline]
fn row_of(cosine: f64, rows: usize, edge: impl Fn(usize) -> f64) -> usize {
    let angle = libm::acos(cosine.clamp(-1.0, 1.0));
    let row = ((angle / PI * rows as f64) as usize).min(rows - 1);
    if cosine > edge(row) && row > 0 {
        row - 1
    } else if cosine < edge(row + 1) && row + 1 < rows {
        row + 1
    } else {
        row
    }
}

/// Solid angle of a cell.
#[inline]
fn cell(edges: &[f64], row: usize, columns: usize) -> f64 {
    (edges[row] - edges[row + 1]) * TAU / columns as f64
}

/// Solid angle of a cell in row `row` of `rows` × `columns` cells, sr.
pub fn cell_solid_angle(row: usize, rows: usize, columns: usize) -> f64 {
    (edge(row, rows) - edge(row + 1, rows)) * TAU / columns as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Stream;
    use twinray_testkit::chi2;

    /// Uneven weights, empty rows and empty cells among them: counts of cells against weight × solid angle.
    #[test]
    fn samples_follow_the_weights() {
        let weight = |row: usize, column: usize| match (row, column) {
            (3, _) | (_, 7) => 0.0,
            (8, 11) => 500.0,
            _ => ((row * 31 + column * 17) % 13) as f64,
        };
        let table = SphereTable::new(20, 20, weight).unwrap();
        let mut stream = Stream::new(21, 0, 0);
        let mut counts = vec![0u64; 400];
        const N: u32 = 400_000;
        for _ in 0..N {
            let [cosine, turn] = table.sample([stream.uniform(), stream.uniform()]);
            let row = (cosine.acos() / PI * 20.0) as usize;
            counts[20 * row + (turn * 20.0) as usize] += 1;
        }
        let share = |k: usize| weight(k / 20, k % 20) * cell_solid_angle(k / 20, 20, 20) / table.integral();
        let expected: Vec<f64> = (0..400).map(|k| share(k) * f64::from(N)).collect();
        let outcome = chi2::test(&counts, &expected);
        assert!(outcome.p_value > 0.01, "{outcome:?}");
    }

    #[test]
    fn the_density_is_the_weight_over_its_integral() {
        let weight = |row: usize, column: usize| (1 + row * column) as f64;
        let table = SphereTable::new(16, 8, weight).unwrap();
        let sum: f64 = (0..128).map(|k| weight(k / 8, k % 8) * cell_solid_angle(k / 8, 16, 8)).sum();
        assert!((table.integral() / sum - 1.0).abs() < 1e-12);
        for (row, column) in [(0, 0), (7, 3), (15, 7)] {
            let middle = libm::cos(PI * (row as f64 + 0.5) / 16.0);
            let pdf = table.pdf([middle, (column as f64 + 0.5) / 8.0]);
            assert!((pdf * sum / weight(row, column) - 1.0).abs() < 1e-12);
        }
        assert!(SphereTable::new(4, 4, |_, _| 0.0).is_none());
    }

    /// Every sample lies where its density is positive, at the ends of the unit square too.
    #[test]
    fn samples_are_never_where_the_density_is_zero() {
        let table = SphereTable::new(9, 5, |row, column| f64::from(u8::from(row == 4 && column % 2 == 1))).unwrap();
        let last = 1.0 - f64::EPSILON / 2.0;
        for u in [[0.0, 0.0], [last, last], [0.5, 0.5], [0.0, last], [last, 0.0], [0.3, 0.499_999]] {
            let place = table.sample(u);
            assert!(table.pdf(place) > 0.0, "{u:?} gives {place:?}");
        }
    }
}
