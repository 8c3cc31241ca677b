//! Bodies of triangles for the rigs: spheres from the icosahedron, truncated spheres, regular polygons.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Positions and triangles.
#[derive(Clone, Debug)]
pub struct Body {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Body {
    /// The same with all fronts on the other side.
    pub fn flipped(mut self) -> Self {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: &[u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }

    /// Mean of a triangle's corners.
    pub fn centre(&self, triangle: &[u32; 3]) -> DVec3 {
        self.corners(triangle).iter().sum::<DVec3>() / 3.0
    }
}

/// A sphere about the origin, fronts outside: an icosahedron whose faces are cut in four `level` times.
pub fn icosphere(radius: f64, level: u32) -> Body {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        positions.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Faces are the triples of neighbours, whose distance is 2.
    let near = |a: usize, b: usize| (positions[a].distance(positions[b]) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outwards =
                        (positions[b] - positions[a]).cross(positions[c] - positions[a]).dot(positions[a]) > 0.0;
                    triangles.push(if outwards { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    let mut body = Body { positions, triangles };
    for _ in 0..level {
        let mut middles = HashMap::new();
        let Body { mut positions, triangles } = body;
        let mut cut = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let sum = positions[i as usize].normalize() + positions[j as usize].normalize();
                    positions.push(sum);
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            cut.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        body = Body { positions, triangles: cut };
    }
    body.positions.iter_mut().for_each(|p| *p = p.normalize() * radius);
    body
}

/// The sphere of `radius` on the side of negative x whose rim is the circle of radius `opening` in the plane x = 0,
/// fronts inside: `rings` × `sectors` quads, triangles at the pole.
pub fn truncated_sphere(radius: f64, opening: f64, rings: usize, sectors: usize) -> Body {
    let rim = PI - libm::asin(opening / radius);
    let centre = -(radius * radius - opening * opening).sqrt();
    let mut positions = vec![DVec3::new(centre - radius, 0.0, 0.0)];
    for ring in 1..=rings {
        let angle = rim * ring as f64 / rings as f64;
        // The rim is put where the other sphere has it, to the bit.
        let (x, r) = match ring == rings {
            true => (0.0, opening),
            false => (centre - radius * libm::cos(angle), radius * libm::sin(angle)),
        };
        positions.extend((0..sectors).map(|k| {
            let turn = TAU * k as f64 / sectors as f64;
            DVec3::new(x, r * libm::cos(turn), r * libm::sin(turn))
        }));
    }
    let at = |ring: usize, k: usize| (1 + (ring - 1) * sectors + k % sectors) as u32;
    let mut triangles = Vec::new();
    for k in 0..sectors {
        triangles.push([0, at(1, k), at(1, k + 1)]);
        for ring in 1..rings {
            let (a, b, c, d) = (at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k));
            triangles.extend([[a, d, c], [a, c, b]]);
        }
    }
    Body { positions, triangles }
}

/// A disc at height y about the y axis as a regular polygon of the same area, front upwards.
pub fn disc(radius: f64, y: f64, sides: usize) -> Body {
    let n = sides as f64;
    // n/2 R² sin(2π/n) = π r².
    let rim = radius * (PI / (0.5 * n * libm::sin(TAU / n))).sqrt();
    let corner = |k: usize| {
        let turn = TAU * k as f64 / n;
        DVec3::new(rim * libm::sin(turn), y, rim * libm::cos(turn))
    };
    let positions = std::iter::once(DVec3::new(0.0, y, 0.0)).chain((0..sides).map(corner)).collect();
    let triangles = (0..sides as u32).map(|k| [0, 1 + k, 1 + (k + 1) % sides as u32]).collect();
    Body { positions, triangles }
}

/// Solid angle of a triangle from the origin (van Oosterom and Strackee 1983).
pub fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la;
    2.0 * libm::atan2(a.dot(b.cross(c)).abs(), below)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(body: &Body) -> f64 {
        body.triangles.iter().map(|t| body.corners(t)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn bodies_have_their_sizes_and_look_the_right_way() {
        let sphere = icosphere(2.0, 3);
        assert_eq!(sphere.triangles.len(), 1280);
        assert!((volume(&sphere) / (4.0 / 3.0 * PI * 8.0) - 1.0).abs() < 0.02);
        let whole: f64 = sphere.triangles.iter().map(|t| solid_angle(sphere.corners(t))).sum();
        assert!((whole - 4.0 * PI).abs() < 1e-9);
        // Fronts inside: the cone from the origin to each triangle counts negative; the lid at x = 0 counts nothing.
        let room = truncated_sphere(1.0, 0.5, 20, 40);
        let height = 1.0 - 0.75f64.sqrt();
        let cap = PI * height * height * (1.0 - height / 3.0);
        assert!((volume(&room) / -(4.0 / 3.0 * PI - cap) - 1.0).abs() < 0.02);
        let lid = disc(1.0, 3.0, 64);
        assert!((volume(&lid) - PI).abs() < 1e-9, "a cone of height 3 has volume π r²");
    }
}
