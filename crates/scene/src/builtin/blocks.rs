//! Axis-parallel architecture from painted boxes: rock in the beginning, then air and solids, later over earlier.
//!
//! The border between solid and air becomes rectangles, merged where neighbours share plane and material. So a
//! closed room is closed by construction, every front faces the air, and nothing lies under anything else.

use super::mesh::{Builder, from_lattice, to_lattice};

/// A face that `Blocks` leaves out, because the scene draws it by hand.
pub(super) const OPEN: usize = usize::MAX;

/// A face that no one painted; meeting one is a bug of the scene.
const ROCK: usize = usize::MAX - 1;

/// Materials of a solid's faces towards −x, +x, −y, +y, −z, +z.
#[derive(Clone, Copy)]
pub(super) struct Skin([usize; 6]);

impl From<usize> for Skin {
    fn from(material: usize) -> Self {
        Self([material; 6])
    }
}

impl Skin {
    /// The same, the face towards +x of `material`.
    pub(super) fn right(mut self, material: usize) -> Self {
        self.0[1] = material;
        self
    }

    /// The same, the upper face of `material`.
    pub(super) fn top(mut self, material: usize) -> Self {
        self.0[3] = material;
        self
    }

    /// The same, the lower face of `material`.
    pub(super) fn bottom(mut self, material: usize) -> Self {
        self.0[2] = material;
        self
    }
}

/// Boxes in painting order.
#[derive(Default)]
pub(super) struct Blocks {
    /// Bounds in lattice steps per axis, and what fills them; `None` is air.
    boxes: Vec<([[i64; 2]; 3], Option<Skin>)>,
}

impl Blocks {
    /// Fills a box with air.
    pub(super) fn air(&mut self, x: [f64; 2], y: [f64; 2], z: [f64; 2]) {
        self.paint(x, y, z, None);
    }

    /// Fills a box with a solid.
    pub(super) fn solid(&mut self, x: [f64; 2], y: [f64; 2], z: [f64; 2], skin: impl Into<Skin>) {
        self.paint(x, y, z, Some(skin.into()));
    }

    fn paint(&mut self, x: [f64; 2], y: [f64; 2], z: [f64; 2], fill: Option<Skin>) {
        let bounds = [x, y, z].map(|range| range.map(to_lattice));
        assert!(bounds.iter().all(|[lo, hi]| lo < hi), "empty box: {x:?} {y:?} {z:?}");
        self.boxes.push((bounds, fill));
    }

    /// Adds all borders between solid and air to `builder`.
    pub(super) fn emit(&self, builder: &mut Builder) {
        let planes: [Vec<i64>; 3] = std::array::from_fn(|axis| {
            let mut planes: Vec<i64> = self.boxes.iter().flat_map(|(bounds, _)| bounds[axis]).collect();
            planes.sort_unstable();
            planes.dedup();
            planes
        });
        let cells = self.cells(&planes);
        for axis in 0..3 {
            for plane in 0..planes[axis].len() {
                let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
                let border = cells.border(axis, plane, &planes);
                for rectangle in merge(border, planes[u].len() - 1, planes[v].len() - 1) {
                    let Face { outwards, material } = rectangle.face;
                    assert!(material != ROCK, "air meets rock at {axis} {}", planes[axis][plane]);
                    if material != OPEN {
                        let corner = |i: usize, j: usize| {
                            let mut p = [0.0; 3];
                            p[axis] = from_lattice(planes[axis][plane]);
                            p[u] = from_lattice(planes[u][rectangle.u[i]]);
                            p[v] = from_lattice(planes[v][rectangle.v[j]]);
                            p
                        };
                        let mut corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        if !outwards {
                            corners.reverse();
                        }
                        builder.polygon(material, &corners);
                    }
                }
            }
        }
    }

    fn cells(&self, planes: &[Vec<i64>; 3]) -> Cells {
        let size = [0, 1, 2].map(|axis| planes[axis].len() - 1);
        let mut cells = Cells { size, fill: vec![Some(Skin::from(ROCK)); size.iter().product()] };
        for (bounds, fill) in &self.boxes {
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let [lo, hi] = bounds[axis].map(|b| planes[axis].partition_point(|&plane| plane < b));
                lo..hi
            });
            for k in z {
                for j in y.clone() {
                    let row = cells.index([0, j, k]);
                    cells.fill[row + x.start..row + x.end].fill(*fill);
                }
            }
        }
        cells
    }
}

/// What fills each cell between neighbouring planes.
struct Cells {
    size: [usize; 3],
    fill: Vec<Option<Skin>>,
}

/// One side of a border: the material, and whether its front looks along the positive axis.
#[derive(Clone, Copy, PartialEq)]
struct Face {
    outwards: bool,
    material: usize,
}

impl Cells {
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Faces on a plane, `[v][u]` with `u` the axis after `axis` and `v` the one before.
    fn border(&self, axis: usize, plane: usize, planes: &[Vec<i64>; 3]) -> Vec<Option<Face>> {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut faces = Vec::with_capacity(self.size[u] * self.size[v]);
        for j in 0..self.size[v] {
            for i in 0..self.size[u] {
                let fill_at = |layer: Option<usize>| {
                    let Some(layer) = layer.filter(|&layer| layer + 1 < planes[axis].len()) else {
                        return Some(Skin::from(ROCK));
                    };
                    let mut cell = [0; 3];
                    (cell[axis], cell[u], cell[v]) = (layer, i, j);
                    self.fill[self.index(cell)]
                };
                faces.push(match (fill_at(plane.checked_sub(1)), fill_at(Some(plane))) {
                    (Some(skin), None) => Some(Face { outwards: true, material: skin.0[2 * axis + 1] }),
                    (None, Some(skin)) => Some(Face { outwards: false, material: skin.0[2 * axis] }),
                    _ => None,
                });
            }
        }
        faces
    }
}

/// A merged rectangle of faces: plane indices along both axes.
struct Rectangle {
    u: [usize; 2],
    v: [usize; 2],
    face: Face,
}

/// Covers the faces with rectangles, greedily, growing along `u` first or along `v` first, whichever needs fewer.
fn merge(faces: Vec<Option<Face>>, width: usize, height: usize) -> Vec<Rectangle> {
    let along_u = grow(faces.clone(), width, height);
    let transposed = (0..width * height).map(|i| faces[(i % height) * width + i / height]).collect();
    let along_v = grow(transposed, height, width);
    if along_v.len() < along_u.len() {
        along_v.into_iter().map(|r| Rectangle { u: r.v, v: r.u, face: r.face }).collect()
    } else {
        along_u
    }
}

fn grow(mut faces: Vec<Option<Face>>, width: usize, height: usize) -> Vec<Rectangle> {
    let mut rectangles = Vec::new();
    for j in 0..height {
        for i in 0..width {
            let Some(face) = faces[j * width + i] else { continue };
            let same = |&f: &Option<Face>| f == Some(face);
            let columns = faces[j * width + i..(j + 1) * width].iter().take_while(|f| same(f)).count();
            let rows = (j..height).take_while(|k| faces[k * width + i..][..columns].iter().all(same)).count();
            for k in j..j + rows {
                faces[k * width + i..][..columns].fill(None);
            }
            rectangles.push(Rectangle { u: [i, i + columns], v: [j, j + rows], face });
        }
    }
    rectangles
}
