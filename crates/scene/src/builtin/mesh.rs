//! A small mesh builder for the built-in scenes: materials, polygons, turned shapes; one mesh per material.
//!
//! Positions are rounded to a micrometre, so that a plane computed in two ways is one plane and neighbours meet
//! without a gap. Not here: axis-parallel architecture (`blocks`). Called by every file of `builtin`.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::authored::{Instance, Material, Mesh, Scene, Surface, Texel};
use crate::camera::Camera;
use crate::rgb::Rgb;

/// Steps per metre of the coordinate lattice.
const LATTICE: f64 = 1e6;

/// Profile joints of a turned shape that bend less than this cosine tells are shaded smoothly.
const SMOOTH_COSINE: f64 = 0.7;

/// `v` on the coordinate lattice.
pub(super) fn to_lattice(v: f64) -> i64 {
    (v * LATTICE).round() as i64
}

/// The coordinate of lattice step `k`, metres.
pub(super) fn from_lattice(k: i64) -> f64 {
    k as f64 / LATTICE
}

/// Collects geometry and materials into a `Scene`.
pub(super) struct Builder {
    scene: Scene,
    /// Mesh and known vertices of the flat-shaded faces of each material.
    flat: Vec<(Mesh, HashMap<[i64; 3], u32>)>,
    /// Meshes with vertex normals.
    smooth: Vec<Mesh>,
}

impl Builder {
    pub(super) fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.to_owned(), ..Scene::default() }, flat: Vec::new(), smooth: Vec::new() }
    }

    /// Adds a material and returns its index.
    pub(super) fn material(&mut self, material: Material) -> usize {
        let index = self.scene.materials.len();
        let mesh = Mesh { name: material.name.clone(), material: index, ..Mesh::default() };
        self.flat.push((mesh, HashMap::new()));
        self.scene.materials.push(material);
        index
    }

    /// Adds a one-sided Lambertian material.
    pub(super) fn matte(&mut self, name: &str, reflectance: Rgb) -> usize {
        self.lamp(name, reflectance, Rgb::BLACK)
    }

    /// Adds a one-sided Lambertian material that emits `radiance`.
    pub(super) fn lamp(&mut self, name: &str, reflectance: Rgb, radiance: Rgb) -> usize {
        self.material(Material {
            name: name.to_owned(),
            surface: Surface::Lambertian { reflectance: Texel::constant(reflectance) },
            emission: radiance,
            ..Material::default()
        })
    }

    /// Adds a convex polygon, counter-clockwise seen from the front.
    pub(super) fn polygon(&mut self, material: usize, corners: &[[f64; 3]]) {
        let (mesh, known) = &mut self.flat[material];
        let ids: Vec<u32> = corners
            .iter()
            .map(|corner| {
                let key = corner.map(to_lattice);
                *known.entry(key).or_insert_with(|| {
                    mesh.positions.push(key.map(|k| from_lattice(k) as f32));
                    mesh.positions.len() as u32 - 1
                })
            })
            .collect();
        mesh.triangles.extend((2..ids.len()).map(|i| [ids[0], ids[i - 1], ids[i]]));
    }

    /// Adds the side of a solid turned about the vertical axis through (`x`, `z`), with `sides` flat faces.
    ///
    /// `profile` lists (radius, height) from the bottom upwards; a radius of 0 closes the solid in a pole.
    /// Corners lie where `turned_corner` says.
    pub(super) fn turned(&mut self, material: usize, x: f64, z: f64, sides: usize, profile: &[[f64; 2]]) {
        // A segment's normal in the (radius, height) plane; joints that bend little share their mean.
        let segment_normals: Vec<[f64; 2]> = profile
            .windows(2)
            .map(|w| {
                let (dr, dy) = (w[1][0] - w[0][0], w[1][1] - w[0][1]);
                let length = dr.hypot(dy);
                [dy / length, -dr / length]
            })
            .collect();
        let normal_at = |segment: usize, joint: usize| {
            let own = segment_normals[segment];
            let other = if joint > segment { segment + 1 } else { segment.wrapping_sub(1) };
            match segment_normals.get(other) {
                Some(n) if n[0] * own[0] + n[1] * own[1] > SMOOTH_COSINE => [n[0] + own[0], n[1] + own[1]],
                _ => own,
            }
        };

        let mut mesh = Mesh {
            name: self.scene.materials[material].name.clone(),
            normals: Some(Vec::new()),
            material,
            ..Mesh::default()
        };
        for segment in 0..profile.len() - 1 {
            let first = mesh.positions.len() as u32;
            for joint in [segment, segment + 1] {
                let [radius, y] = profile[joint];
                let [nr, ny] = normal_at(segment, joint);
                for i in 0..sides {
                    let (cos, sin) = direction(i, sides);
                    let [px, pz] = turned_corner(x, z, radius, i, sides);
                    mesh.positions.push([px, y, pz].map(|v| from_lattice(to_lattice(v)) as f32));
                    let normal = DVec3::new(nr * cos, ny, nr * sin).normalize();
                    mesh.normals.get_or_insert_default().push(normal.as_vec3().to_array());
                }
            }
            let n = sides as u32;
            for i in 0..n {
                let next = (i + 1) % n;
                let (a, b) = (first + i, first + next);
                let (c, d) = (first + n + next, first + n + i);
                if profile[segment][0] > 0.0 {
                    mesh.triangles.push([a, c, b]);
                }
                if profile[segment + 1][0] > 0.0 {
                    mesh.triangles.push([a, d, c]);
                }
            }
        }
        self.smooth.push(mesh);
    }

    /// Adds a horizontal square of half width `half` with a hole for a turned solid of `radius`, facing upwards
    /// or downwards. `sides` is a multiple of 4.
    pub(super) fn collar(
        &mut self,
        material: usize,
        centre: [f64; 3],
        half: f64,
        radius: f64,
        sides: usize,
        upwards: bool,
    ) {
        let [x, y, z] = centre;
        let quarter = sides / 4;
        let hole = |i: usize| {
            let [px, pz] = turned_corner(x, z, radius, i % sides, sides);
            [px, y, pz]
        };
        let corner = |k: usize| {
            let (sx, sz) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][k % 4];
            [x + sx * half, y, z + sz * half]
        };
        // Each side of the square: its first corner sees half of the hole's edges, its second one the others.
        let mut add = |[a, b, c]: [[f64; 3]; 3]| {
            self.polygon(material, &if upwards { [a, c, b] } else { [a, b, c] });
        };
        for k in 0..4 {
            let (first, middle, last) = (k * quarter, k * quarter + quarter / 2, (k + 1) * quarter);
            (first..middle).for_each(|i| add([corner(k), hole(i + 1), hole(i)]));
            add([corner(k), corner(k + 1), hole(middle)]);
            (middle..last).for_each(|i| add([corner(k + 1), hole(i + 1), hole(i)]));
        }
    }

    /// The scene: every mesh that has a triangle, placed where it was drawn.
    pub(super) fn finish(self, cameras: Vec<Camera>) -> Scene {
        let Self { mut scene, flat, smooth } = self;
        scene.meshes = flat.into_iter().map(|(mesh, _)| mesh).chain(smooth).collect();
        scene.meshes.retain(|mesh| !mesh.triangles.is_empty());
        scene.instances = scene
            .meshes
            .iter()
            .enumerate()
            .map(|(i, mesh)| Instance { name: mesh.name.clone(), mesh: i, transform: DAffine3::IDENTITY })
            .collect();
        scene.cameras = cameras;
        scene
    }
}

/// Corner `i` of a turned solid of `sides` sides and `radius` about (`x`, `z`); corner 0 points to (+x, +z).
pub(super) fn turned_corner(x: f64, z: f64, radius: f64, i: usize, sides: usize) -> [f64; 2] {
    let (cos, sin) = direction(i, sides);
    [x + radius * cos, z + radius * sin]
}

fn direction(i: usize, sides: usize) -> (f64, f64) {
    let angle = std::f64::consts::TAU * (i as f64 / sides as f64 + 0.125);
    (libm::cos(angle), libm::sin(angle))
}
