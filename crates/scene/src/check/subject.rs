//! The scene under examination, and which triangle of it is which.

use glam::DVec3;

use super::finding::Element;
use crate::authored::{Mesh, Scene};
use crate::patch::{PatchScene, Side, TriangleSource, sources, vec};

/// A scene, its patches, and where their triangles come from.
pub struct Subject<'a> {
    pub scene: &'a Scene,
    pub patches: &'a PatchScene,
    /// Per placed triangle.
    pub sources: Vec<TriangleSource>,
    /// Per mesh: its placed triangles, in order.
    of_mesh: Vec<Vec<u32>>,
}

impl<'a> Subject<'a> {
    pub fn new(scene: &'a Scene, patches: &'a PatchScene) -> Self {
        let sources = sources(scene);
        let mut of_mesh = vec![Vec::new(); scene.meshes.len()];
        for (triangle, source) in (0..).zip(&sources) {
            of_mesh[scene.instances[source.instance as usize].mesh].push(triangle);
        }
        Self { scene, patches, sources, of_mesh }
    }

    /// All placed triangles.
    pub fn triangles(&self) -> std::ops::Range<u32> {
        0..self.sources.len() as u32
    }

    pub fn instance_of(&self, triangle: u32) -> usize {
        self.sources[triangle as usize].instance as usize
    }

    /// Meshes that are placed.
    pub fn meshes(&self) -> impl Iterator<Item = (usize, &'a Mesh)> {
        self.scene.meshes.iter().enumerate().filter(|(i, _)| !self.of_mesh[*i].is_empty())
    }

    /// Placed triangles of a mesh.
    pub fn placed(&self, mesh: usize) -> &[u32] {
        &self.of_mesh[mesh]
    }

    /// Placed triangles of those of a mesh that are chosen.
    pub fn placed_where(&self, mesh: usize, chosen: impl Fn(usize) -> bool) -> Vec<u32> {
        let number = |t: u32| self.sources[t as usize].triangle as usize;
        self.of_mesh[mesh].iter().copied().filter(|&t| chosen(number(t))).collect()
    }

    pub fn area(&self, triangles: &[u32]) -> f64 {
        triangles.iter().map(|&t| self.patches.triangle_area(t)).sum()
    }

    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.patches.corners(triangle)
    }

    pub fn is_one_sided(&self, triangle: u32) -> bool {
        !self.patches.has_side(triangle, Side::Back)
    }

    /// Whether both sides of a mesh meet light, wherever it is placed.
    pub fn is_two_sided(&self, mesh: usize) -> bool {
        self.of_mesh[mesh].first().is_some_and(|&t| !self.is_one_sided(t))
    }

    pub fn mesh_element(&self, mesh: usize) -> Element {
        Element::Mesh(mesh, self.scene.meshes[mesh].name.clone())
    }

    pub fn instance_element(&self, instance: usize) -> Element {
        Element::Instance(instance, self.scene.instances[instance].name.clone())
    }

    /// Length of the diagonal of the box around all of it, metres.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.patches.bounding_box();
        (high - low).length()
    }
}

/// Corners of a triangle in its mesh's own coordinates.
pub fn mesh_corners(mesh: &Mesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|k| vec(mesh.positions[k as usize]))
}

/// Chosen triangles of a list of flags.
pub fn count(flags: &[bool]) -> usize {
    flags.iter().filter(|f| **f).count()
}
