//! Cases 5.11, 5.13 and 5.14: a black room behind a facade with an opening, outside it ground, a canopy or a wall.
//!
//! The sky is uniform all around; below the horizon the ground hides it, and what lies beyond the ground's border counts as
//! sky, in the scene and in the expectation alike. The facade is long and high, so that outside one sees nothing of the room but it.
//! Outer surfaces reflect once at most: the facade's outer side is black, and of ground and mask only one reflects.

use std::f64::consts::PI;

use glam::DVec3;

use crate::case::{Case, Effort, Row};
use crate::factors::{point_to_polygon, through};
use crate::rig::{Rectangle, Rig, sensor_params, unreflected_share};

/// Luminance of the sky, cd/m².
const SKY: f64 = 1000.0;
/// Sensors stand so far before floor and walls.
const GAP: f64 = 0.01;
/// How far the ground reaches, m.
const FAR: f64 = 20.0;

/// The wall at x = 0 with the opening, seen from within. It is higher than anything that stands opposite, or one
/// would look over it at the room's roof, which the expectation does not know.
fn facade() -> Rectangle {
    Rectangle::new([0.0, -GAP, 2.0 - FAR], [0.0, 6.0 + GAP, 0.0], [0.0, 0.0, 2.0 * FAR])
}

fn opening() -> Rectangle {
    Rectangle::new([0.0, 1.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0])
}

/// The ground in strips that get finer towards the facade, where its light changes.
fn ground() -> Vec<Rectangle> {
    let edges = [0.0, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, FAR];
    let strip = |w: &[f64]| {
        let whole = Rectangle::new([-w[1], 0.0, 2.0 - FAR], [0.0, 0.0, 2.0 * FAR], [w[1] - w[0], 0.0, 0.0]);
        whole.cut([10, 1])
    };
    edges.windows(2).flat_map(strip).collect()
}

fn tiles() -> [(&'static str, Rectangle); 4] {
    [
        ("floor, 1 m from the facade", Rectangle::new([0.75, 0.0, 1.75], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0])),
        ("floor, 3 m", Rectangle::new([2.75, 0.0, 1.75], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0])),
        ("rear wall, 1.5 m high", Rectangle::new([4.0, 1.25, 1.75], [0.0, 0.0, 0.5], [0.0, 0.5, 0.0])),
        ("ceiling, 1 m from the facade", Rectangle::new([0.75, 3.0, 1.75], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5])),
    ]
}

/// What stands outside: cells with a reflectance and their illuminance, and what hides the sky.
struct Outside {
    ground_reflectance: f64,
    mask: Option<Rectangle>,
    mask_reflectance: f64,
}

impl Outside {
    /// Reflecting cells with their illuminance in units of πL: the sky less what stands before it.
    fn lit_cells(&self, finer: usize) -> Vec<(Vec<DVec3>, f64)> {
        let sight = |hides: &[Rectangle], cell: &Rectangle| {
            let polygons: Vec<Vec<DVec3>> = hides.iter().map(Rectangle::polygon).collect();
            cell.mean(4, |p, n| 1.0 - polygons.iter().map(|h| point_to_polygon(p, n, h)).sum::<f64>())
        };
        let cells = |r: &Rectangle, cuts: [usize; 2], hides: &[Rectangle]| -> Vec<(Vec<DVec3>, f64)> {
            r.cut(cuts).iter().map(|c| (c.polygon(), sight(hides, c))).collect()
        };
        if self.ground_reflectance > 0.0 {
            return ground().iter().flat_map(|g| cells(g, [finer, finer], &[facade()])).collect();
        }
        match &self.mask {
            // It looks at the facade over black ground, of which it sees what is on its own side.
            Some(mask) if self.mask_reflectance > 0.0 => {
                cells(mask, [10 * finer, 5 * finer], &[above_ground(), whole_ground()])
            }
            _ => Vec::new(),
        }
    }

    /// Illuminance at a point in the room: πL (F of the opening less what hides the sky) + ρ Σ E F.
    fn illuminance(&self, p: DVec3, n: DVec3, lit: &[(Vec<DVec3>, f64)]) -> [f64; 2] {
        let window = opening().polygon();
        let seen = |polygon: &[DVec3]| through(p, polygon, &window);
        let factor = |polygon: &[DVec3]| point_to_polygon(p, n, polygon);
        let behind_ground = seen(&whole_ground().polygon());
        let mut hidden = factor(&behind_ground);
        if let Some(mask) = &self.mask {
            // Together they hide the sum less what both hide.
            hidden += factor(&seen(&mask.polygon())) - factor(&through(p, &behind_ground, &mask.polygon()));
        }
        let reflectance = self.ground_reflectance.max(self.mask_reflectance);
        let reflected: f64 = lit.iter().map(|(cell, e)| e * factor(&seen(cell))).sum();
        [PI * SKY * (factor(&window) - hidden), PI * SKY * reflectance * reflected]
    }

    fn rows(&self, effort: Effort, seed: u64) -> Vec<Row> {
        let mut rig = Rig::default();
        let (walls, outside) = (rig.group(), rig.group());
        let black = rig.material(0.0, 0.0);
        let earth = rig.material(self.ground_reflectance, 0.0);
        room(&mut rig, walls, black);
        ground().iter().for_each(|cell| rig.rectangle(outside, earth, cell, [1, 1]));
        if let Some(mask) = &self.mask {
            let material = rig.material(self.mask_reflectance, 0.0);
            rig.rectangle(outside, material, mask, [10, 5]);
        }
        rig.sky(SKY);
        let groups = tiles().map(|(_, tile)| {
            let group = rig.group();
            rig.rectangle(group, black, &tile, [16, 16]);
            group
        });
        let rays = effort.rays(1 << 21);
        let measured = rig.measure(&sensor_params(seed), rays);
        let (as_cut, smooth) = (self.lit_cells(1), self.lit_cells(2));
        let row = |((name, tile), group): ((&'static str, Rectangle), _)| {
            let mean = |lit: &[_], part: usize| tile.mean(8, |p, n| self.illuminance(p, n, lit)[part]);
            let (sky, reflected) = (mean(&smooth, 0), mean(&smooth, 1));
            if sky + reflected < 1e-6 {
                // No sky is left to be seen: no ray may bring light.
                let brightest = measured[group].iter().copied().fold(0.0, f64::max);
                return Row::at_most(format!("{name}, nothing, at most"), 1e-6, brightest);
            }
            let cells = (mean(&as_cut, 1) - reflected).abs();
            let model = 1.5 * cells + unreflected_share(rig.len(), rays) * reflected;
            Row::statistical(name, sky + reflected, &measured[group], model, effort.resolution(4e-2))
        };
        tiles().into_iter().zip(groups).map(row).collect()
    }
}

/// The facade as the mask sees it.
fn above_ground() -> Rectangle {
    let whole = facade();
    Rectangle { corner: whole.corner + DVec3::Y * GAP, u: whole.u - DVec3::Y * GAP, ..whole }
}

/// All the ground, as what hides the sky below the horizon.
fn whole_ground() -> Rectangle {
    Rectangle::new([-FAR, 0.0, 2.0 - FAR], [0.0, 0.0, 2.0 * FAR], [FAR, 0.0, 0.0])
}

/// The room of 4 × 4 × 3 m behind the facade.
fn room(rig: &mut Rig, group: crate::rig::Group, black: usize) {
    let (w, h, d) = (4.0 + 2.0 * GAP, 3.0 + 2.0 * GAP, 4.0 + GAP);
    let faces = [
        Rectangle::new([0.0, -GAP, -GAP], [0.0, 0.0, w], [d, 0.0, 0.0]),
        Rectangle::new([0.0, 3.0 + GAP, -GAP], [d, 0.0, 0.0], [0.0, 0.0, w]),
        Rectangle::new([d, -GAP, -GAP], [0.0, 0.0, w], [0.0, h, 0.0]),
        Rectangle::new([0.0, -GAP, -GAP], [d, 0.0, 0.0], [0.0, h, 0.0]),
        Rectangle::new([0.0, -GAP, 4.0 + GAP], [0.0, h, 0.0], [d, 0.0, 0.0]),
    ];
    faces.iter().for_each(|face| rig.rectangle(group, black, face, [1, 1]));
    let (wall, hole) = (facade(), opening());
    let share = |low: f64, high: f64, start: f64, length: f64| [(low - start) / length, (high - start) / length];
    let s = share(hole.corner.y, hole.corner.y + hole.u.y, wall.corner.y, wall.u.y);
    let t = share(hole.corner.z, hole.corner.z + hole.v.z, wall.corner.z, wall.v.z);
    wall.around(s, t).0.iter().for_each(|part| rig.rectangle(group, black, part, [1, 1]));
}

const QUANTITY: &str = "illuminance, lx";

/// Case 5.11.
pub fn ground_case(effort: Effort) -> Case {
    let outside = Outside { ground_reflectance: 0.3, mask: None, mask_reflectance: 0.0 };
    Case {
        title: "Case 5.11, sky and external reflected component through a facade opening",
        story: "A black room of 4 × 4 × 3 m with an unglazed opening of 2 × 1 m, its sill at 1 m, in a facade 40 m long and 6 m high; \
                before it 20 m of ground of reflectance 0.3 (260 patches), a uniform sky of 1000 cd/m² all around. Black tiles of \
                0.5 × 0.5 m. Expected: πL times the factor of the opening less the ground seen through it, plus ρ Σ E F over the \
                ground, whose illuminance is πL less what the facade hides. Allowed beside noise: what cells of a quarter of the size \
                change, and the first wave. 2²¹ rays, sensor settings."
            .to_owned(),
        quantity: QUANTITY,
        rows: outside.rows(effort, 1500),
    }
}

/// Case 5.13.
pub fn horizontal_mask(effort: Effort) -> Case {
    let canopy = Rectangle::new([-1.5, 2.1, -8.0], [1.5, 0.0, 0.0], [0.0, 0.0, 20.0]);
    let outside = Outside { ground_reflectance: 0.0, mask: Some(canopy), mask_reflectance: 0.0 };
    Case {
        title: "Case 5.13, with a continuous external horizontal mask",
        story: "As 5.11 with black ground and a black canopy, 1.5 m deep and 20 m long, 0.1 m above the opening. Expected: the sky \
                that ground and canopy leave of the opening, by clipped contour integrals."
            .to_owned(),
        quantity: QUANTITY,
        rows: outside.rows(effort, 1600),
    }
}

/// Case 5.14.
pub fn vertical_mask(effort: Effort) -> Case {
    let wall = Rectangle::new([-6.0, 0.0, -8.0], [0.0, 0.0, 20.0], [0.0, 5.0, 0.0]);
    // Its front looks at the facade.
    let outside = Outside { ground_reflectance: 0.0, mask: Some(wall.flipped()), mask_reflectance: 0.4 };
    Case {
        title: "Case 5.14, with a continuous external vertical mask",
        story: "As 5.11 with black ground and a wall of reflectance 0.4 (100 patches), 5 m high and 20 m long, opposite at 6 m. \
                Expected: the sky that ground and wall leave of the opening, plus ρ Σ E F over the wall, whose illuminance is πL less \
                what ground and facade hide."
            .to_owned(),
        quantity: QUANTITY,
        rows: outside.rows(effort, 1700),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shadow borders are kinks, at which Gauss points converge slowly: what the rows use is good to 0.05 %.
    #[test]
    fn sensors_have_enough_points() {
        let wall = Rectangle::new([-6.0, 0.0, -8.0], [0.0, 0.0, 20.0], [0.0, 5.0, 0.0]);
        let outside = Outside { ground_reflectance: 0.0, mask: Some(wall.flipped()), mask_reflectance: 0.4 };
        let lit = outside.lit_cells(2);
        for (name, tile) in tiles() {
            let mean = |n: usize, part: usize| tile.mean(n, |p, normal| outside.illuminance(p, normal, &lit)[part]);
            for part in 0..2 {
                let (used, many) = (mean(8, part), mean(24, part));
                assert!((used - many).abs() < 5e-4 * many + 1e-9, "{name}: {used} against {many}");
            }
        }
    }
}
