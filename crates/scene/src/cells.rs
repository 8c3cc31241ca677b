//! Cells of a triangle by index arithmetic: how one author's triangle becomes many patches of equal area.
//!
//! The ray kernel sees the triangle; the solver sees its cells; nothing is stored per cell here. Regular
//! triangles are cut into m² congruent triangles, slivers into columns × rows along their long side. All places
//! are barycentric weights (u, v) of vertices 1 and 2. Called by `patch`, by the solver (a random point of a
//! cell) and by the display (the cell of a hit).

use glam::DVec3;

use crate::sample::warp;

/// Slivers beyond this ratio of longest side to height are cut along their length.
const SLIVER: f64 = 3.5;

/// The most cells of one triangle: keeps every index within 32 bits.
const MAX_PER_SIDE: f64 = 30_000.0;

/// How a triangle is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cells {
    /// m² congruent triangles.
    Regular {
        /// Cuts per side.
        m: u32,
    },
    /// Columns of equal area across the longest side, each of `rows` cells of equal area.
    Strips {
        /// Columns along the longest side.
        columns: u32,
        /// Cells in a column.
        rows: u32,
        /// The longest side runs from vertex `first` to the next one.
        first: u8,
        /// Where the apex's foot divides the longest side, in [0, 1].
        foot: f64,
    },
}

impl Cells {
    /// A division of the triangle into cells of about `area` each (square metres; infinite gives one cell).
    pub fn of_area(vertices: [DVec3; 3], area: f64) -> Self {
        let side = |i: usize| vertices[(i + 1) % 3] - vertices[i];
        match Outline::of(vertices).cut(area) {
            Cut::Regular { m } => Self::Regular { m },
            Cut::Strips { columns, rows } => {
                let first = longest_side(vertices);
                let (base, length) = (side(first), side(first).length());
                let apex = vertices[(first + 2) % 3] - vertices[first];
                let foot = (apex.dot(base) / (length * length)).clamp(0.0, 1.0);
                Self::Strips { columns, rows, first: first as u8, foot }
            }
        }
    }

    /// Number of cells.
    pub fn count(&self) -> u32 {
        match *self {
            Self::Regular { m } => m * m,
            Self::Strips { columns, rows, .. } => columns * rows,
        }
    }

    /// The cell that holds the point (`u`, `v`); points slightly outside belong to the nearest cell.
    pub fn locate(&self, u: f64, v: f64) -> u32 {
        match *self {
            Self::Regular { m } => {
                let n = f64::from(m);
                let (x, y) = (u.max(0.0) * n, v.max(0.0) * n);
                let j = (y as u32).min(m - 1);
                let i = (x as u32).min(m - 1 - j);
                let upper = (x - f64::from(i)) + (y - f64::from(j)) > 1.0 && i + j + 1 < m;
                row_start(m, j) + 2 * i + u32::from(upper)
            }
            Self::Strips { columns, rows, first, foot } => {
                let weights = [1.0 - u - v, u, v];
                let (b, c) = (weights[(usize::from(first) + 1) % 3], weights[(usize::from(first) + 2) % 3]);
                let x = (b + c * foot).clamp(0.0, 1.0);
                let height = height_at(x, foot);
                let t = if height > 0.0 { c / height } else { 0.0 };
                let column = ((area_left_of(x, foot) * f64::from(columns)) as u32).min(columns - 1);
                let row = ((t.clamp(0.0, 1.0) * f64::from(rows)) as u32).min(rows - 1);
                column * rows + row
            }
        }
    }

    /// The point of `cell` at (`s`, `t`) in the unit square; uniform by area where (`s`, `t`) is uniform.
    pub fn point(&self, cell: u32, s: f64, t: f64) -> [f64; 2] {
        match *self {
            Self::Regular { m } => {
                let (i, j, upper) = self.lattice(m, cell);
                let [a, b] = warp::uniform_triangle([s, t]);
                let n = f64::from(m);
                if upper {
                    [(f64::from(i + 1) - a) / n, (f64::from(j + 1) - b) / n]
                } else {
                    [(f64::from(i) + a) / n, (f64::from(j) + b) / n]
                }
            }
            Self::Strips { columns, rows, first, foot } => {
                let (column, row) = (f64::from(cell / rows), f64::from(cell % rows));
                let x = position_of_area((column + s) / f64::from(columns), foot);
                place_in_strip(first, foot, x, (row + t) / f64::from(rows) * height_at(x, foot))
            }
        }
    }

    /// Number of [`Cells::grid`]'s points.
    pub fn grid_count(&self) -> u32 {
        match *self {
            Self::Regular { m } => (m + 1) * (m + 2) / 2,
            Self::Strips { columns, rows, .. } => (columns + 1) * (rows + 1),
        }
    }

    /// Points between which displays interpolate, as far apart as cells are large.
    ///
    /// Of regular triangles the corners of cells: (i/m, j/m), rows of j following each other with m + 1 − j points each. Of
    /// slivers (column, row) at column/columns of the longest side and row/rows of the height there, rows of a column
    /// following each other: even steps, unlike the cells' own columns, so that the place between them is found without a root.
    pub fn grid(&self) -> Vec<[f64; 2]> {
        let share = |k: u32, of: u32| f64::from(k) / f64::from(of);
        match *self {
            Self::Regular { m } => (0..=m).flat_map(|j| (0..=m - j).map(move |i| [share(i, m), share(j, m)])).collect(),
            Self::Strips { columns, rows, first, foot } => (0..=columns)
                .flat_map(|column| {
                    let x = share(column, columns);
                    (0..=rows).map(move |row| place_in_strip(first, foot, x, share(row, rows) * height_at(x, foot)))
                })
                .collect(),
        }
    }

    /// The corners of `cell`, three to six, running round as those of the triangle do.
    ///
    /// A cell under the apex of a sliver has a bend at the foot, and above the lowest row the bend makes it concave.
    /// Such a cell begins at the bend, so that triangles fanned from the first corner always cover the cell once.
    pub fn corners(&self, cell: u32) -> Vec<[f64; 2]> {
        match *self {
            Self::Regular { m } => {
                let (i, j, upper) = self.lattice(m, cell);
                let corners =
                    if upper { [[i + 1, j + 1], [i, j + 1], [i + 1, j]] } else { [[i, j], [i + 1, j], [i, j + 1]] };
                corners.map(|c| c.map(|k| f64::from(k) / f64::from(m))).to_vec()
            }
            Self::Strips { columns, rows, first, foot } => {
                let (column, row) = (cell / rows, cell % rows);
                let [left, right] =
                    [column, column + 1].map(|k| position_of_area(f64::from(k) / f64::from(columns), foot));
                let [low, high] = [row, row + 1].map(|k| f64::from(k) / f64::from(rows));
                let corner = |x: f64, share: f64| place_in_strip(first, foot, x, share * height_at(x, foot));
                let bend = (left < foot && foot < right).then_some(foot);
                // The triangle's own side is straight: no corner at the foot of the lowest row.
                let lower_bend = bend.filter(|_| row > 0);
                let lower = lower_bend.into_iter().chain([right]).map(|x| corner(x, low));
                // At the triangle's acute corners the upper side ends where the lower one does.
                let upper = [Some(right), bend, Some(left)].into_iter().flatten().filter(|&x| height_at(x, foot) > 0.0);
                lower.chain(upper.map(|x| corner(x, high))).chain([corner(left, low)]).collect()
            }
        }
    }

    /// The centre of `cell`.
    pub fn centre(&self, cell: u32) -> [f64; 2] {
        match *self {
            Self::Regular { m } => {
                let (i, j, upper) = self.lattice(m, cell);
                let offset = if upper { 2.0 / 3.0 } else { 1.0 / 3.0 };
                [(f64::from(i) + offset) / f64::from(m), (f64::from(j) + offset) / f64::from(m)]
            }
            Self::Strips { .. } => self.point(cell, 0.5, 0.5),
        }
    }

    /// Column, row and orientation of a regular cell.
    fn lattice(&self, m: u32, cell: u32) -> (u32, u32, bool) {
        // Row j starts at j (2m − j): solve the quadratic in floating point, then correct its rounding.
        let rest = f64::from(m) * f64::from(m) - f64::from(cell);
        let mut j = (f64::from(m) - rest.max(0.0).sqrt()).max(0.0) as u32;
        while j > 0 && row_start(m, j) > cell {
            j -= 1;
        }
        while j + 1 < m && row_start(m, j + 1) <= cell {
            j += 1;
        }
        let k = cell - row_start(m, j);
        (k / 2, j, k % 2 == 1)
    }
}

/// What of a triangle decides the number of its cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline {
    /// m².
    area: f64,
    /// Longest side, m.
    length: f64,
}

enum Cut {
    Regular { m: u32 },
    Strips { columns: u32, rows: u32 },
}

impl Outline {
    pub(crate) fn of(vertices: [DVec3; 3]) -> Self {
        let first = longest_side(vertices);
        Self {
            area: 0.5 * crate::geom::area_vector_2(vertices[0], vertices[1], vertices[2]).length(),
            length: (vertices[(first + 1) % 3] - vertices[first]).length(),
        }
    }

    pub(crate) fn area(&self) -> f64 {
        self.area
    }

    /// Number of cells of about `area` each.
    pub(crate) fn count(&self, area: f64) -> u32 {
        match self.cut(area) {
            Cut::Regular { m } => m * m,
            Cut::Strips { columns, rows } => columns * rows,
        }
    }

    fn cut(&self, area: f64) -> Cut {
        let wanted = (self.area / area).min(MAX_PER_SIDE * MAX_PER_SIDE);
        let height = 2.0 * self.area / self.length;
        if wanted > 1.5 && self.length > SLIVER * height {
            // Cells about as long as high: rows from the mean height, columns from what is left of the budget.
            let rows = (0.5 * height / area.sqrt()).round().clamp(1.0, MAX_PER_SIDE);
            let columns = (wanted / rows).round().clamp(1.0, MAX_PER_SIDE * MAX_PER_SIDE / rows);
            return Cut::Strips { columns: columns as u32, rows: rows as u32 };
        }
        Cut::Regular { m: wanted.sqrt().round().clamp(1.0, MAX_PER_SIDE) as u32 }
    }
}

/// Number of the vertex at which the longest side begins.
fn longest_side(vertices: [DVec3; 3]) -> usize {
    let length = |i: usize| (vertices[(i + 1) % 3] - vertices[i]).length();
    (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0)
}

/// Index of the first cell of row `j`: rows get shorter by two cells each.
fn row_start(m: u32, j: u32) -> u32 {
    j * (2 * m - j)
}

/// The place at `x` along the longest side and the share `c` of the apex's height above it.
fn place_in_strip(first: u8, foot: f64, x: f64, c: f64) -> [f64; 2] {
    let b = x - c * foot;
    let mut weights = [0.0; 3];
    weights[usize::from(first)] = 1.0 - b - c;
    weights[(usize::from(first) + 1) % 3] = b;
    weights[(usize::from(first) + 2) % 3] = c;
    [weights[1], weights[2]]
}

/// Height of the triangle at `x` along its base, as a share of the apex's height.
fn height_at(x: f64, foot: f64) -> f64 {
    // With the foot at 1 the far side is upright: the height is 1 up to there, not 0 at the end.
    if x < foot || foot == 1.0 { x / foot } else { (1.0 - x) / (1.0 - foot) }.clamp(0.0, 1.0)
}

/// Share of the area left of `x`.
fn area_left_of(x: f64, foot: f64) -> f64 {
    if x < foot { x * x / foot } else { 1.0 - (1.0 - x).powi(2) / (1.0 - foot).max(f64::MIN_POSITIVE) }
}

/// Inverse of [`area_left_of`].
fn position_of_area(area: f64, foot: f64) -> f64 {
    if area < foot { (area * foot).sqrt() } else { 1.0 - ((1.0 - area) * (1.0 - foot)).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Stream;
    use twinray_testkit::chi2;

    #[test]
    fn grids_have_as_many_points_as_they_say_within_their_triangle() {
        for cells in divisions() {
            let points = cells.grid();
            assert_eq!(points.len() as u32, cells.grid_count(), "{cells:?}");
            for [u, v] in &points {
                assert!(*u > -1e-9 && *v > -1e-9 && u + v < 1.0 + 1e-9, "{cells:?}: ({u}, {v})");
            }
            for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
                // The apex of a sliver is a point only where a column ends at its foot.
                let is_sliver = matches!(cells, Cells::Strips { .. });
                let there = points.iter().any(|p| (p[0] - corner[0]).abs() + (p[1] - corner[1]).abs() < 1e-9);
                assert!(is_sliver || there, "{cells:?} lacks {corner:?}");
            }
        }
    }

    fn divisions() -> Vec<Cells> {
        vec![
            Cells::Regular { m: 1 },
            Cells::Regular { m: 2 },
            Cells::Regular { m: 7 },
            Cells::Strips { columns: 9, rows: 2, first: 0, foot: 0.3 },
            Cells::Strips { columns: 5, rows: 1, first: 1, foot: 0.0 },
            Cells::Strips { columns: 6, rows: 3, first: 2, foot: 1.0 },
        ]
    }

    #[test]
    fn a_point_of_a_cell_is_located_in_that_cell() {
        let mut stream = Stream::new(1, 0, 0);
        for cells in divisions().into_iter().chain([Cells::Regular { m: 30_000 }]) {
            for k in 0..500u32 {
                let cell = (u64::from(k) * 7919 % u64::from(cells.count())) as u32;
                let [u, v] = cells.point(cell, 0.01 + 0.98 * stream.uniform(), 0.01 + 0.98 * stream.uniform());
                assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-12);
                assert_eq!(cells.locate(u, v), cell, "{cells:?}");
                let [u, v] = cells.centre(cell);
                assert_eq!(cells.locate(u, v), cell, "{cells:?}");
            }
        }
    }

    /// Uniform points of the triangle fall equally often into every cell, and points drawn cell by cell are
    /// uniform on the triangle: the two together say that cells have equal areas and `point` is uniform.
    #[test]
    fn cells_have_equal_areas() {
        let n = 100_000u64;
        for cells in divisions() {
            let mut stream = Stream::new(2, 0, 0);
            let count = cells.count();
            let mut hits = vec![0u64; count as usize];
            let mut back = vec![0u64; 64];
            let grid = Cells::Regular { m: 8 };
            for k in 0..n {
                let [u, v] = warp::uniform_triangle([stream.uniform(), stream.uniform()]);
                hits[cells.locate(u, v) as usize] += 1;
                let [u, v] = cells.point((k % u64::from(count)) as u32, stream.uniform(), stream.uniform());
                back[grid.locate(u, v) as usize] += 1;
            }
            if count > 1 {
                let p = chi2::test(&hits, &vec![n as f64 / f64::from(count); count as usize]).p_value;
                assert!(p > 1e-3, "{cells:?}: {p}");
            }
            let p = chi2::test(&back, &[n as f64 / 64.0; 64]).p_value;
            assert!(p > 1e-3, "{cells:?}: {p}");
        }
    }

    /// Twice the area of a polygon in the plane of (u, v); the whole triangle has 1.
    fn area_2(polygon: &[[f64; 2]]) -> f64 {
        let [a, rest @ ..] = polygon else { return 0.0 };
        rest.windows(2).map(|w| cross(*a, w[0], w[1])).sum()
    }

    fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Triangles fanned from the first corner are none of them turned over, and one of them holds each point of the
    /// cell: with the right area, the polygon is the cell.
    #[test]
    fn corners_are_those_of_the_cell() {
        let mut stream = Stream::new(3, 0, 0);
        let one_column = |rows| Cells::Strips { columns: 1, rows, first: 1, foot: 0.4 };
        for cells in divisions().into_iter().chain([1, 2, 3].map(one_column)) {
            for cell in 0..cells.count() {
                let polygon = cells.corners(cell);
                let area = area_2(&polygon);
                assert!((area * f64::from(cells.count()) - 1.0).abs() < 1e-12, "{cells:?}, {cell}: {area}");
                let fan: Vec<_> = polygon[1..].windows(2).map(|w| [polygon[0], w[0], w[1]]).collect();
                assert!(fan.iter().all(|[a, b, c]| cross(*a, *b, *c) > 1e-6), "{cells:?}, {cell}: {polygon:?}");
                let inside = |p: [f64; 2]| {
                    let in_triangle = |[a, b, c]: &[[f64; 2]; 3]| {
                        [(a, b), (b, c), (c, a)].iter().all(|(a, b)| cross(**a, **b, p) > -1e-12)
                    };
                    fan.iter().any(in_triangle)
                };
                for _ in 0..20 {
                    assert!(inside(cells.point(cell, stream.uniform(), stream.uniform())), "{cells:?}, {cell}");
                }
                assert!(inside(cells.centre(cell)), "{cells:?}, {cell}");
            }
        }
    }

    #[test]
    fn cells_under_the_apex_have_a_bend() {
        let cells = Cells::Strips { columns: 3, rows: 2, first: 0, foot: 0.5 };
        let corners = |cell| cells.corners(cell).len();
        // From left to right a tip, what is under the apex, another tip; the lower cell of each first.
        assert_eq!([0, 1, 2, 3, 4, 5].map(corners), [3, 3, 5, 6, 3, 3]);
        let bend = cells.corners(3)[0];
        assert!((bend[0] - 0.25).abs() < 1e-15 && (bend[1] - 0.5).abs() < 1e-15, "{bend:?}");
    }

    /// The upright side of a right-angled sliver: whatever rounding does to a point there, it has its row.
    #[test]
    fn points_of_an_upright_side_are_in_their_row() {
        for (foot, x) in [(0.0, 0.0), (1.0, 1.0)] {
            let cells = Cells::Strips { columns: 4, rows: 2, first: 0, foot };
            let [u, v] = place_in_strip(0, foot, x, 0.9);
            assert_eq!(cells.locate(u, v) % 2, 1, "foot {foot}");
        }
    }

    /// However small the cells that are asked for: no triangle gets more than indices can number.
    #[test]
    fn cells_of_no_size_are_as_many_as_can_be() {
        let sliver = [DVec3::ZERO, DVec3::new(1e6, 0.0, 0.0), DVec3::new(5e5, 1e5, 0.0)];
        let square = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for area in [1e-18, 1e-300, 0.0] {
            for vertices in [sliver, square] {
                assert_eq!(Cells::of_area(vertices, area).count(), 900_000_000, "{area}");
            }
        }
    }

    #[test]
    fn slivers_are_cut_along_their_length() {
        let sliver = [DVec3::ZERO, DVec3::new(10.0, 0.0, 0.0), DVec3::new(5.0, 0.1, 0.0)];
        let Cells::Strips { columns, rows, .. } = Cells::of_area(sliver, 0.01) else { panic!("a sliver") };
        assert_eq!((columns, rows), (50, 1));
        let square = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(Cells::of_area(square, 0.5 / 49.0), Cells::Regular { m: 7 });
        assert_eq!(Cells::of_area(square, f64::INFINITY).count(), 1);
    }
}
