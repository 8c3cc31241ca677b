//! Primitives to meshes: corners in order, vertices that are used, attributes that can be read.
//!
//! Not here: accessors (`accessor`), the cleaning that both formats share (`geometry`), placing (`node`).

use twinray_scene::Mesh;

use super::accessor::{Accessor, Component, Expected};
use super::container::Buffers;
use super::json::Element;
use crate::context::Context;
use crate::error::FormatError;
use crate::geometry::{check_triangles, clean, mesh_bytes, vertex_bytes};

/// Reads primitives one after the other; keeps what they share.
pub(super) struct Primitives<'v, 'b> {
    buffers: &'v Buffers<'b>,
    /// New number of each vertex of the current accessor, `UNUSED` outside of it: resetting only what was
    /// touched keeps a thousand primitives over one accessor linear.
    renumbered: Vec<u32>,
    quantized: bool,
}

const UNUSED: u32 = u32::MAX;

impl<'v, 'b> Primitives<'v, 'b> {
    pub(super) fn new(root: &Element<'_>, buffers: &'v Buffers<'b>) -> Self {
        let quantized = root.strings("extensionsUsed").contains(&"KHR_mesh_quantization");
        Self { buffers, renumbered: Vec::new(), quantized }
    }

    /// The mesh of `primitive`, without its material, and which element of the accessors each vertex was; `None` if it has no
    /// triangles.
    pub(super) fn read(
        &mut self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        primitive: &Element<'_>,
        name: &str,
    ) -> Result<Option<(Mesh, Vec<u32>)>, FormatError> {
        let mode = primitive.integer("mode")?.unwrap_or(4);
        match mode {
            4..=6 => {}
            0..=3 => {
                context.warn(&primitive.path, "points and lines have no area: ignored");
                return Ok(None);
            }
            _ => return Err(primitive.fault(format!("mode {mode}"), "a mode from 0 to 6")),
        }
        let attributes = primitive.require("attributes", "an object of accessors")?;
        if !attributes.is_object() {
            return Err(attributes.invalid("an object of accessors"));
        }
        if attributes.get("POSITION").is_none() {
            context.warn(&primitive.path, "no POSITION: ignored");
            return Ok(None);
        }
        let positions = self.attribute(root, &attributes, "POSITION", "VEC3")?;
        let Some(positions) = positions else { return Ok(None) };
        let indices = match primitive.follow("indices", root, "accessors")? {
            Some((_, element)) => {
                let components = &[Component::U8, Component::U16, Component::U32];
                Some(Accessor::load(root, self.buffers, &element, &Expected { kind: "SCALAR", components })?)
            }
            None => None,
        };
        self.warn_ignored(context, primitive, &attributes);

        let corners = indices.as_ref().map_or(positions.count, |i| i.count);
        let triangles = triangle_count(mode, corners);
        if mode == 4 && corners % 3 != 0 || mode > 4 && corners < 3 {
            context.warn(&primitive.path, format!("{corners} corners: those left over make no triangle"));
        }
        check_triangles(context, &primitive.path, triangles as u64)?;
        // The cleaning sorts keys of 16 bytes per triangle; given back below.
        context.charge(triangles as u64 * 16, &primitive.path)?;
        self.grow(context, &positions)?;
        context.charge(mesh_bytes(0, triangles, 0), &primitive.path)?;

        let normals = self.optional(context, root, &attributes, "NORMAL", "VEC3", positions.count);
        let tangents = self.optional(context, root, &attributes, "TANGENT", "VEC4", positions.count);
        let [texcoords, second] = ["TEXCOORD_0", "TEXCOORD_1"]
            .map(|key| self.optional(context, root, &attributes, key, "VEC2", positions.count));

        // Corners to triangles, vertices in the order of their first use.
        let corner = |i: usize| -> Result<u32, FormatError> {
            let Some(indices) = &indices else { return Ok(i as u32) };
            let index = indices.index(i);
            if index as usize >= positions.count {
                let element = format!("{}.indices = {}", primitive.path, indices.path);
                let found = format!("index {index} at place {i}");
                let expected = format!("an index below {}, the count of {}", positions.count, positions.path);
                return Err(FormatError::invalid(context.file, &element, found, expected));
            }
            Ok(index)
        };
        let mut used: Vec<u32> = Vec::new();
        let mut mesh = Mesh { name: name.to_owned(), ..Mesh::default() };
        mesh.triangles.reserve_exact(triangles);
        let mut fault = None;
        for t in 0..triangles {
            let places = corners_of(mode, t);
            let mut triangle = [0; 3];
            for (slot, place) in triangle.iter_mut().zip(places) {
                match corner(place) {
                    Ok(index) => *slot = self.renumber(index, &mut used),
                    Err(error) => fault = Some(error),
                }
            }
            if fault.is_some() {
                break;
            }
            mesh.triangles.push(triangle);
        }
        used.iter().for_each(|&i| self.renumbered[i as usize] = UNUSED);
        if let Some(fault) = fault {
            return Err(fault);
        }

        let sets = usize::from(texcoords.is_some()) + usize::from(second.is_some());
        let bytes = mesh_bytes(used.len(), 0, vertex_bytes(normals.is_some(), tangents.is_some(), sets));
        context.charge(bytes, &primitive.path)?;
        mesh.positions = used.iter().map(|&i| positions.floats(i as usize)).collect();
        mesh.normals = normals.map(|n| used.iter().map(|&i| n.floats(i as usize)).collect());
        mesh.tangents = tangents.map(|t| used.iter().map(|&i| t.floats(i as usize)).collect());
        mesh.texcoords = texcoords.map(|t| used.iter().map(|&i| t.floats(i as usize)).collect());
        mesh.second_texcoords = second.map(|t| used.iter().map(|&i| t.floats(i as usize)).collect());
        if let Some(left) = clean(context, &mut mesh) {
            let mut left = left.iter();
            used.retain(|_| left.next().copied().unwrap_or(false));
        }
        context.budget.release(triangles as u64 * 16);
        Ok(Some((mesh, used)).filter(|(m, _)| !m.triangles.is_empty()))
    }

    fn renumber(&mut self, index: u32, used: &mut Vec<u32>) -> u32 {
        let slot = &mut self.renumbered[index as usize];
        if *slot == UNUSED {
            *slot = used.len() as u32;
            used.push(index);
        }
        *slot
    }

    /// Makes `renumbered` long enough.
    fn grow(&mut self, context: &mut Context<'_>, positions: &Accessor<'_>) -> Result<(), FormatError> {
        let more = positions.count.saturating_sub(self.renumbered.len());
        // Asked for before it is allocated: an accessor without data may claim any count.
        context.charge(more as u64 * 4, &positions.path)?;
        self.renumbered.resize(self.renumbered.len() + more, UNUSED);
        Ok(())
    }

    fn attribute(
        &self,
        root: &Element<'_>,
        attributes: &Element<'_>,
        key: &str,
        kind: &str,
    ) -> Result<Option<Accessor<'v>>, FormatError> {
        let Some((_, element)) = attributes.follow(key, root, "accessors")? else { return Ok(None) };
        let all = [Component::F32, Component::I8, Component::U8, Component::I16, Component::U16];
        let components: &[Component] = match (key, self.quantized) {
            (_, true) => &all,
            ("TEXCOORD_0" | "TEXCOORD_1", _) => &[Component::F32, Component::U8, Component::U16],
            _ => &[Component::F32],
        };
        Accessor::load(root, self.buffers, &element, &Expected { kind, components }).map(Some)
    }

    /// An attribute that the mesh can do without: faults are warnings.
    fn optional(
        &self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        attributes: &Element<'_>,
        key: &str,
        kind: &str,
        count: usize,
    ) -> Option<Accessor<'v>> {
        match self.attribute(root, attributes, key, kind) {
            Ok(Some(accessor)) if accessor.count != count => {
                let message = format!("has {} elements for {count} positions: ignored", accessor.count);
                context.warn(format!("{}.{key}", attributes.path), message);
                None
            }
            Ok(accessor) => accessor,
            Err(error) => {
                context.warn(format!("{}.{key}", attributes.path), format!("{}: ignored", error.without_place()));
                None
            }
        }
    }

    fn warn_ignored(&self, context: &mut Context<'_>, primitive: &Element<'_>, attributes: &Element<'_>) {
        if primitive.count("targets") > 0 {
            context.warn(&primitive.path, "morph targets are ignored: the base shape is used");
        }
        if attributes.keys().any(|k| k.starts_with("COLOR_")) {
            context.warn(&primitive.path, "vertex colours are ignored");
        }
    }
}

fn triangle_count(mode: u64, corners: usize) -> usize {
    if mode == 4 { corners / 3 } else { corners.saturating_sub(2) }
}

/// Places of the corners of triangle `t` (glTF §3.7.2.1).
fn corners_of(mode: u64, t: usize) -> [usize; 3] {
    match mode {
        4 => [3 * t, 3 * t + 1, 3 * t + 2],
        // Every second triangle of a strip would otherwise face the other way.
        5 => [t, t + 1 + t % 2, t + 2 - t % 2],
        _ => [t + 1, t + 2, 0],
    }
}
