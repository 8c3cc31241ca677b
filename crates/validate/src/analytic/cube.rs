//! The unit cube whose floor emits: the continuous solution by a radiosity system with exact form factors.

use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
use twinray::solve::Params;

use crate::case::{Case, Effort, Row};
use crate::factors::{parallel_rectangles, perpendicular_rectangles};
use crate::rig::{REPLICAS, replicas};

/// Mean irradiance of the floor, the ceiling and the walls.
pub fn cube(effort: Effort) -> Case {
    let mut rows = Vec::new();
    for albedo in [0.5, 0.8] {
        let rho = f64::from(albedo as f32);
        let (exact, fine) = continuous(rho);
        let options = PatchOptions { budget: PatchBudget::Count(6 * 2 * 400), two_sided: false };
        let scene = PatchScene::new(&builtin::cube(albedo), options).expect("a built-in scene");
        let runs = replicas(&scene, &Params::default_preset(700), effort.rays(1 << 20), REPLICAS, |solution| {
            let mut sums = [(0.0, 0.0); 3];
            for p in scene.patches() {
                let y = scene.normal(p).y;
                let face = if y > 0.5 {
                    0
                } else if y < -0.5 {
                    1
                } else {
                    2
                };
                sums[face].0 += scene.area(p) * solution.irradiance(p).luminance();
                sums[face].1 += scene.area(p);
            }
            sums.map(|(power, area)| power / area)
        });
        for (face, name) in ["floor", "ceiling", "walls"].into_iter().enumerate() {
            let replicas: Vec<f64> = runs.iter().map(|r| r[face]).collect();
            // The solver has two constant triangles where `fine` has one square: its error is at most that one's.
            let model = (fine[face] - exact[face]).abs();
            rows.push(Row::statistical(
                format!("ρ = {albedo}: {name}"),
                exact[face],
                &replicas,
                model,
                effort.resolution(4e-3),
            ));
        }
    }
    Case {
        title: "Unit cube",
        story: "Built-in scene `cube`: the floor emits radiosity 1, every face reflects ρ. Expected is the continuous solution: \
                radiosity systems of 5², 10² and 20² squares a face with exact form factors, extrapolated at the order that the three \
                show (1.7 on the floor: light is not smooth at the edges). The solver's 800 triangles a face may differ from it by as \
                much as 20² squares do, 0.1 % on the floor. 2²⁰ rays, default preset."
            .to_owned(),
        quantity: "irradiance, W·m⁻²",
        rows,
    }
}

/// Means of the continuous solution, and those of 20² squares a face: Aitken's extrapolation of three halvings.
fn continuous(rho: f64) -> ([f64; 3], [f64; 3]) {
    let [coarse, middle, fine] = [5, 10, 20].map(|n| radiosity(rho, n));
    let limit = |face: usize| {
        let (first, second) = (middle[face] - coarse[face], fine[face] - middle[face]);
        fine[face] + second * second / (first - second)
    };
    ([0, 1, 2].map(limit), fine)
}

/// Mean irradiances of floor, ceiling and walls in the unit cube with n × n constant squares a face.
pub(super) fn radiosity(rho: f64, n: usize) -> [f64; 3] {
    let cell = |i: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
    // Factors depend on index differences only; tabulated once.
    let parallel: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| parallel_rectangles(cell(0), cell(0), cell(i), cell(j), 1.0)).collect())
        .collect();
    let corner: Vec<Vec<Vec<f64>>> = (0..n)
        .map(|i| {
            (0..n)
                .map(|k| (0..n).map(|j| perpendicular_rectangles(cell(i), cell(0), cell(k), cell(j))).collect())
                .collect()
        })
        .collect();
    // Face 2a + s lies in the plane where axis a is s; a square has indices along the two other axes, in order.
    let squares: Vec<[usize; 3]> = (0..6).flat_map(|f| (0..n * n).map(move |k| [f, k % n, k / n])).collect();
    let place = |[face, a, b]: [usize; 3], axis: usize| {
        let first_other = if face / 2 == 0 { 1 } else { 0 };
        if axis == first_other { a } else { b }
    };
    let factor = |s: [usize; 3], t: [usize; 3]| {
        let (axis, other) = (s[0] / 2, t[0] / 2);
        if s[0] == t[0] {
            return 0.0;
        }
        if axis == other {
            return parallel[s[1].abs_diff(t[1])][s[2].abs_diff(t[2])];
        }
        let along = 3 - axis - other;
        let distance = |index: usize, face: usize| if face.is_multiple_of(2) { index } else { n - 1 - index };
        let (i, k) = (distance(place(s, other), t[0]), distance(place(t, axis), s[0]));
        corner[i][k][place(s, along).abs_diff(place(t, along))]
    };
    let matrix: Vec<Vec<f64>> = squares.iter().map(|&s| squares.iter().map(|&t| factor(s, t)).collect()).collect();
    // Axis 1 is up: face 2 is the floor, face 3 the ceiling.
    let emitted = |s: [usize; 3]| if s[0] == 2 { 1.0 } else { 0.0 };
    let mut irradiance = vec![0.0; squares.len()];
    // Each sweep leaves ρ of the error: 120 sweeps at 0.8 leave 2e-12.
    for _ in 0..120 {
        let b: Vec<f64> = squares.iter().zip(&irradiance).map(|(&s, e)| emitted(s) + rho * e).collect();
        irradiance = matrix.iter().map(|row| row.iter().zip(&b).map(|(f, b)| f * b).sum()).collect();
    }
    let mean = |faces: &[usize]| {
        let chosen: Vec<f64> =
            squares.iter().zip(&irradiance).filter(|(s, _)| faces.contains(&s[0])).map(|(_, e)| *e).collect();
        chosen.iter().sum::<f64>() / chosen.len() as f64
    };
    [mean(&[2]), mean(&[3]), mean(&[0, 1, 4, 5])]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means of a Galerkin solution of up to 15² squares a face by other code, extrapolated as if its order were two,
    /// which with the order 1.73 that the floor shows leaves 4e-5 there, and
    /// 1.3e-4 at ρ = 0.8, where reflections add up.
    #[test]
    fn the_radiosity_system_agrees_with_the_table() {
        for (rho, floor, ceiling, wall) in [(0.5, 1.10433, 0.17122, 0.18111), (0.8, 1.58740, 0.66099, 0.68790)] {
            let (exact, fine) = continuous(rho);
            let [f, c, w] = exact.map(|e| rho * e);
            for (own, table) in [(1.0 + f, floor), (c, ceiling), (w, wall)] {
                assert!(
                    (own - table).abs() < if rho < 0.6 { 6e-5 } else { 1.6e-4 },
                    "ρ = {rho}: {own} against {table}"
                );
            }
            // Whatever the extrapolation does, energy is kept.
            assert!((1.0 + f + c + 4.0 * w - 1.0 / (1.0 - rho)).abs() < 3e-5);
            // The six radiosities add up to 1/(1−ρ) for any number of squares.
            let [f, c, w] = fine.map(|e| rho * e);
            assert!((1.0 + f + c + 4.0 * w - 1.0 / (1.0 - rho)).abs() < 1e-9);
        }
    }
}
