//! Scenes and solutions for the tests.

use glam::{DAffine3, DVec3};
use twinray_scene::{Instance, Material, Mesh, PatchBudget, PatchOptions, PatchScene, Rgb, Scene, Surface, Texel};
use twinray_solve::{Params, Solution, Solver};

/// A scene of plain boxes.
pub struct Boxes(pub Scene);

impl Boxes {
    pub fn new() -> Self {
        Self(Scene { name: "boxes".into(), ..Scene::default() })
    }

    pub fn material(&mut self, reflectance: f64, emission: f64) -> usize {
        self.0.materials.push(Material {
            surface: Surface::Lambertian { reflectance: Texel::constant(Rgb::grey(reflectance)) },
            emission: Rgb::grey(emission),
            ..Material::default()
        });
        self.0.materials.len() - 1
    }

    /// A box between two corners; `inwards` turns its faces round.
    pub fn add(&mut self, low: [f32; 3], high: [f32; 3], material: usize, inwards: bool) {
        let mut mesh = Mesh { name: "box".into(), material, ..Mesh::default() };
        let mut normals = Vec::new();
        for axis in 0..3 {
            for end in 0..2 {
                let first = mesh.positions.len() as u32;
                let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                for [s, t] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                    let mut p = [0.0; 3];
                    p[axis] = [low, high][end][axis];
                    p[b] = [low, high][s][b];
                    p[c] = [low, high][t][c];
                    mesh.positions.push(p);
                    let mut n = [0.0; 3];
                    n[axis] = if (end == 1) == inwards { -1.0 } else { 1.0 };
                    normals.push(n);
                }
                let quads = [[first, first + 1, first + 2], [first, first + 2, first + 3]];
                mesh.triangles.extend(quads.map(|[a, b, c]| if (end == 1) == inwards { [a, c, b] } else { [a, b, c] }));
            }
        }
        mesh.normals = Some(normals);
        self.0.meshes.push(mesh);
        self.place(self.0.meshes.len() - 1, DAffine3::IDENTITY);
    }

    pub fn place(&mut self, mesh: usize, transform: DAffine3) {
        let name = format!("box {}", self.0.instances.len());
        self.0.instances.push(Instance { name, mesh, transform });
    }
}

pub fn cut(scene: &Scene, size: f64) -> PatchScene {
    let options = PatchOptions { budget: PatchBudget::Size(size), ..PatchOptions::default() };
    PatchScene::new(scene, options).expect("a scene with surfaces")
}

pub fn solve(patches: &PatchScene, rays: u64) -> Solution {
    let mut solver = Solver::new(patches, Params::default_preset(1), None).expect("light");
    solver.run(rays);
    solver.solution()
}

pub fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}
