//! Groups of polygons to meshes: triangulated, oriented by the author's normals, near the origin.
//!
//! OBJ coordinates are decimal text, often far from the origin (maps, survey data), where f32 resolves only
//! millimetres or worse. They are read as f64, and meshes are stored relative to one centre of the whole file,
//! not one per object: neighbours that share a vertex must round it alike, or light leaks between them.

use std::collections::HashMap;

use glam::DVec3;
use twinray_scene::Mesh;

use super::parse::{Document, Group, NONE};
use super::polygon::Triangulator;
use crate::context::Context;
use crate::error::FormatError;
use crate::geometry::{check_triangles, clean, mesh_bytes, vertex_bytes};

/// The point that mesh coordinates are relative to: the origin, unless the file lies so far away that f32 would
/// lose more than a bit to the distance.
pub(super) fn centre(document: &Document, max_coordinate: f64) -> DVec3 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in document.positions.iter().map(|p| DVec3::from(*p)) {
        if p.is_finite() && p.abs().max_element() <= max_coordinate {
            (low, high) = (low.min(p), high.max(p));
        }
    }
    if low.x > high.x {
        return DVec3::ZERO;
    }
    let (middle, half) = ((low + high) * 0.5, (high - low).max_element() * 0.5);
    // Whole numbers, so that subtracting them costs no digit.
    if middle.abs().max_element() > 2.0 * half { middle.round() } else { DVec3::ZERO }
}

/// Makes meshes of groups.
pub(super) struct Builder<'d> {
    pub(super) document: &'d Document,
    pub(super) centre: DVec3,
    pub(super) triangulator: Triangulator,
    pub(super) flipped: usize,
    /// Texture coordinates or normals that faces name and the file does not have.
    pub(super) dangling: usize,
    pub(super) triangles: u64,
}

impl Builder<'_> {
    /// The mesh of `group`, without its material; `None` if it has no triangles.
    pub(super) fn build(&mut self, context: &mut Context<'_>, group: Group) -> Result<Option<Mesh>, FormatError> {
        let element = format!("object \"{}\"", group.name);
        let triangles = group.corners.len() - 2 * group.sizes.len();
        self.triangles += triangles as u64;
        check_triangles(context, &element, self.triangles)?;
        context.charge(mesh_bytes(0, triangles, 0), &element)?;

        let mut mesh = Mesh { name: group.name.clone(), ..Mesh::default() };
        let mut vertices = Vertices::default();
        let has = |kind: usize| group.corners.iter().filter(|c| c[kind] != NONE).count();
        let (textured, smooth) = (has(1) > 0, has(2) == group.corners.len());
        mesh.triangles.reserve_exact(triangles);
        let mut rest = group.corners.as_slice();
        let mut points = Vec::new();
        for &size in &group.sizes {
            let (corners, others) = rest.split_at(size as usize);
            rest = others;
            vertices.pay(context, corners.len(), &element)?;
            let working = self.triangulator.bytes(corners.len());
            context.charge(working, &element)?;
            points.clear();
            points.extend(corners.iter().map(|c| self.point(c[0])));
            let (document, triangles) = (self.document, &mut mesh.triangles);
            let mut flipped = 0;
            let (points, vertices) = (&points, &mut vertices);
            self.triangulator.split(points, |t| {
                let [a, b, c] = t.map(|i| points[i]);
                let normal = (b - a).cross(c - a);
                let mut triangle = t.map(|i| vertices.number(corners[i]));
                // Author's normals decide where the front is: exporters that mirror forget the winding.
                let wish: DVec3 = t.iter().filter_map(|&i| author_normal(document, corners[i][2])).sum();
                if wish.dot(normal) < 0.0 {
                    triangle.swap(1, 2);
                    flipped += 1;
                }
                triangles.push(triangle);
            });
            self.flipped += flipped;
            context.budget.release(working);
        }
        context.budget.release(vertices.paid * VERTEX_BYTES + group.bytes());
        drop(group);
        let corners = std::mem::take(&mut vertices.corners);
        drop(vertices);
        context.charge(mesh_bytes(corners.len(), 0, vertex_bytes(smooth, false, usize::from(textured))), &element)?;
        mesh.positions = corners.iter().map(|c| self.point(c[0]).as_vec3().to_array()).collect();
        if textured {
            mesh.texcoords = Some(corners.iter().map(|c| self.texcoord(c[1])).collect());
        }
        if smooth {
            let normal = |c: &[u32; 3]| self.document.normals.get(c[2] as usize).copied();
            mesh.normals = corners.iter().map(normal).collect();
            self.dangling += usize::from(mesh.normals.is_none());
        }
        drop(corners);
        // Cleaning sorts keys of 16 bytes.
        context.charge(triangles as u64 * 16, &element)?;
        clean(context, &mut mesh);
        context.budget.release(triangles as u64 * 16);
        Ok(Some(mesh).filter(|m| !m.triangles.is_empty()))
    }

    fn point(&self, index: u32) -> DVec3 {
        let position = self.document.positions.get(index as usize);
        position.map_or(DVec3::NAN, |p| DVec3::from(*p) - self.centre)
    }

    fn texcoord(&mut self, index: u32) -> [f32; 2] {
        match self.document.texcoords.get(index as usize) {
            Some(texcoord) => *texcoord,
            None => {
                self.dangling += usize::from(index != NONE);
                [0.0; 2]
            }
        }
    }
}

fn author_normal(document: &Document, index: u32) -> Option<DVec3> {
    let normal = document.normals.get(index as usize)?;
    Some(DVec3::from(normal.map(f64::from))).filter(|n| n.is_finite())
}

/// Corners with equal indices become one vertex.
#[derive(Default)]
struct Vertices {
    corners: Vec<[u32; 3]>,
    numbers: HashMap<[u32; 3], u32>,
    /// Vertices whose memory was asked for.
    paid: u64,
}

/// Memory of one vertex while corners are welded: the corner, and its place in a hash table half full.
const VERTEX_BYTES: u64 = 44;

impl Vertices {
    /// Asks for the memory of `more` vertices.
    fn pay(&mut self, context: &mut Context<'_>, more: usize, element: &str) -> Result<(), FormatError> {
        // In steps: asking costs more than welding.
        const STEP: u64 = 4096;
        let needed = (self.corners.len() + more) as u64;
        if needed > self.paid {
            let step = (needed - self.paid).next_multiple_of(STEP);
            context.charge(step * VERTEX_BYTES, element)?;
            self.paid += step;
        }
        Ok(())
    }

    fn number(&mut self, corner: [u32; 3]) -> u32 {
        let next = self.corners.len() as u32;
        let number = *self.numbers.entry(corner).or_insert(next);
        if number == next {
            self.corners.push(corner);
        }
        number
    }
}
