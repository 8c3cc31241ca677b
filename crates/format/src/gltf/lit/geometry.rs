//! Primitives anew: attributes of any kind copied vertex by vertex, and the light's own.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::super::accessor::{Accessor, Component, Expected};
use super::super::container::Buffers;
use super::super::json::Element;
use super::{LitSurface, LitVertex};
use crate::error::FormatError;

const ALL: [Component; 6] =
    [Component::I8, Component::U8, Component::I16, Component::U16, Component::U32, Component::F32];

/// What is new in the document's binary data.
pub(super) struct Geometry<'v, 'b> {
    root: &'v Element<'v>,
    buffers: &'v Buffers<'b>,
    /// Accessors to be added, whose `bufferView` counts the new views.
    pub accessors: Vec<Value>,
    /// Views to be added, without buffer and offset, and their bytes.
    pub views: Vec<(Value, Vec<u8>)>,
    /// Irradiance that is 1 in `COLOR_0` of the mesh at hand.
    scale: Option<f32>,
}

/// A new primitive.
pub(super) struct Made {
    pub value: Value,
    /// The number of the set of texture coordinates that was the second.
    pub moved_to: u64,
}

/// Marks indices of new things until `tidy` knows their numbers.
pub(super) fn fresh(index: usize) -> Value {
    json!({ "twinray_new": index })
}

/// The index behind such a mark.
pub(super) fn is_fresh(value: &Value) -> Option<usize> {
    value.get("twinray_new")?.as_u64().map(|i| i as usize)
}

impl<'v, 'b> Geometry<'v, 'b> {
    pub fn new(root: &'v Element<'v>, buffers: &'v Buffers<'b>) -> Self {
        Self { root, buffers, accessors: Vec::new(), views: Vec::new(), scale: None }
    }

    /// The scale of the colours of primitives since the last call.
    pub fn take_scale(&mut self) -> Option<f32> {
        self.scale.take()
    }

    /// A view of bytes of a picture and the like.
    pub fn view(&mut self, value: Value, bytes: Vec<u8>) -> Value {
        self.views.push((value, bytes));
        fresh(self.views.len() - 1)
    }

    /// `primitive` as `surface` has it, whose mesh has these `vertices` of the accessors. The second set of texture
    /// coordinates stays under another number if `keep_second`.
    pub fn primitive(
        &mut self,
        primitive: &Value,
        element: &Element<'_>,
        surface: &LitSurface,
        vertices: &[u32],
        keep_second: bool,
    ) -> Result<Made, FormatError> {
        let mut out = primitive.clone();
        let sources: Vec<u32> =
            surface.vertices.iter().map(|v| vertices.get(v.source as usize).copied().unwrap_or(0)).collect();
        let old = element.require("attributes", "an object of accessors")?;
        let mut attributes = Map::new();
        let has = |key: &str| primitive["attributes"].get(key).is_some();
        let next = (2..).find(|k| !has(&format!("TEXCOORD_{k}"))).unwrap_or(2);
        let texcoords = all(surface, |v| v.texcoord);
        let irradiance = all(surface, |v| v.irradiance);
        for key in old.keys() {
            let name = match key {
                "TEXCOORD_1" if texcoords.is_some() && keep_second => format!("TEXCOORD_{next}"),
                "TEXCOORD_1" if texcoords.is_some() => continue,
                "COLOR_0" if irradiance.is_some() => continue,
                _ => key.to_owned(),
            };
            let turn = if surface.back { Turn::of(key) } else { Turn::None };
            attributes.insert(name, self.copy(&old, key, &sources, turn)?);
        }
        if let Some(texcoords) = &texcoords {
            attributes.insert("TEXCOORD_1".into(), self.floats(texcoords, "VEC2"));
        }
        if let Some(irradiance) = &irradiance {
            attributes.insert("_IRRADIANCE".into(), self.floats(irradiance, "VEC3"));
            let scale = irradiance.iter().flatten().copied().fold(self.scale.unwrap_or(0.0), f32::max);
            self.scale = Some(scale);
            // All primitives of a mesh share their scale, which `colours` puts in once it is known.
            attributes.insert("COLOR_0".into(), json!({ "twinray_colour": irradiance }));
        }
        out["attributes"] = Value::Object(attributes);
        if let Some(targets) = primitive["targets"].as_array() {
            let mut list = Vec::new();
            for k in 0..targets.len() {
                let Some(target) = element.item("targets", k) else { continue };
                let mut copied = Map::new();
                for key in target.keys() {
                    // Displacements of normals turn round with them.
                    let turn = if surface.back && key == "NORMAL" { Turn::Negated } else { Turn::None };
                    copied.insert(key.to_owned(), self.copy(&target, key, &sources, turn)?);
                }
                list.push(Value::Object(copied));
            }
            out["targets"] = Value::Array(list);
        }
        out["indices"] = self.indices(&surface.triangles, surface.vertices.len());
        if let Some(out) = out.as_object_mut() {
            out.remove("mode");
        }
        Ok(Made { value: out, moved_to: next })
    }

    /// Colours of all primitives of a mesh by one scale, which is told.
    pub fn colours(&mut self, primitives: &mut [Value], scale: f32) {
        for primitive in primitives {
            let Some(colour) = primitive["attributes"].get_mut("COLOR_0") else { continue };
            let Some(list) = colour.get("twinray_colour").and_then(Value::as_array) else { continue };
            let unit =
                |v: &Value| (v.as_f64().unwrap_or(0.0) / f64::from(scale.max(f32::MIN_POSITIVE))).clamp(0.0, 1.0);
            let bytes: Vec<u8> = list
                .iter()
                .flat_map(|c| [unit(&c[0]), unit(&c[1]), unit(&c[2]), 1.0])
                .flat_map(|c| ((c * 65535.0).round() as u16).to_le_bytes())
                .collect();
            let count = list.len();
            let view = self.view(json!({ "target": 34962 }), bytes);
            self.accessors.push(
                json!({ "bufferView": view, "componentType": 5123, "normalized": true, "count": count, "type": "VEC4" }),
            );
            *colour = fresh(self.accessors.len() - 1);
        }
    }

    /// Elements of the accessor `key`, in the order of `sources`.
    fn copy(&mut self, owner: &Element<'_>, key: &str, sources: &[u32], turn: Turn) -> Result<Value, FormatError> {
        let Some((_, element)) = owner.follow(key, self.root, "accessors")? else { return Ok(Value::Null) };
        let kind = element.text("type")?.unwrap_or_default();
        let accessor = Accessor::load(self.root, self.buffers, &element, &Expected { kind, components: &ALL })?;
        let code = element.integer("componentType")?.unwrap_or_default();
        let component = Component::from_code(code).unwrap_or(Component::F32);
        let components = super::super::accessor::components_of(kind);
        let (width, size) = (component.bytes(), component.bytes() * components);
        // Attributes start at multiples of four bytes (glTF §3.6.2.4).
        let stride = size.next_multiple_of(4);
        let mut bytes = Vec::with_capacity(stride * sources.len());
        for &source in sources {
            let from = if (source as usize) < accessor.count { accessor.element(source as usize) } else { &[] };
            let start = bytes.len();
            bytes.extend(from.iter().take(size));
            bytes.resize(start + stride, 0);
            let element = &mut bytes[start..start + size];
            match turn {
                Turn::None => {}
                Turn::Negated => element.chunks_mut(width).for_each(|c| negate(c, component)),
                Turn::Handedness => element.chunks_mut(width).skip(3).for_each(|c| negate(c, component)),
            }
        }
        let mut view = json!({ "target": 34962 });
        if stride != size {
            view["byteStride"] = json!(stride);
        }
        let view = self.view(view, bytes);
        let mut out = json!({ "bufferView": view, "componentType": code, "count": sources.len(), "type": kind });
        if element.flag("normalized") {
            out["normalized"] = json!(true);
        }
        if key == "POSITION" {
            let places: Vec<[f32; 3]> = sources.iter().map(|&s| raw(accessor.element(s as usize), component)).collect();
            let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..3).map(|c| places.iter().map(|p| p[c]).reduce(pick).unwrap_or(0.0)).collect()
            };
            out["min"] = json!(bound(f32::min));
            out["max"] = json!(bound(f32::max));
        }
        self.accessors.push(out);
        Ok(fresh(self.accessors.len() - 1))
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> Value {
        let bytes = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(json!({ "target": 34962 }), bytes);
        let count = values.len();
        self.accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }));
        fresh(self.accessors.len() - 1)
    }

    fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> Value {
        // The largest number of a type means "restart".
        let small = vertices < 65_535;
        let (code, bytes) = if small {
            (5123, triangles.iter().flatten().flat_map(|&i| (i as u16).to_le_bytes()).collect())
        } else {
            (5125, triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect())
        };
        let view = self.view(json!({ "target": 34963 }), bytes);
        let count = 3 * triangles.len();
        self.accessors.push(json!({ "bufferView": view, "componentType": code, "count": count, "type": "SCALAR" }));
        fresh(self.accessors.len() - 1)
    }
}

/// What becomes of an attribute on the back of a surface.
#[derive(Clone, Copy)]
enum Turn {
    None,
    Negated,
    /// The sign of the bitangent: it is normal × tangent × sign, and stays where the normal turns.
    Handedness,
}

impl Turn {
    fn of(key: &str) -> Self {
        match key {
            "NORMAL" => Self::Negated,
            "TANGENT" => Self::Handedness,
            _ => Self::None,
        }
    }
}

fn negate(bytes: &mut [u8], component: Component) {
    match (component, bytes) {
        (Component::F32, [.., sign]) => *sign ^= 0x80,
        (Component::I8, [byte]) => *byte = (*byte as i8).saturating_neg() as u8,
        (Component::I16, bytes @ [_, _]) => {
            let value = i16::from_le_bytes([bytes[0], bytes[1]]).saturating_neg();
            bytes.copy_from_slice(&value.to_le_bytes());
        }
        // What has no sign is no direction.
        _ => {}
    }
}

/// Three components as they are stored: bounds of accessors are not normalized (glTF §3.6.2.5).
fn raw(bytes: &[u8], component: Component) -> [f32; 3] {
    std::array::from_fn(|c| {
        let at = bytes.get(c * component.bytes()..);
        at.filter(|b| b.len() >= component.bytes()).map_or(0.0, |b| component.read(b) as f32)
    })
}

/// A value of every vertex, if all have it.
fn all<T>(surface: &LitSurface, value: impl Fn(&LitVertex) -> Option<T>) -> Option<Vec<T>> {
    surface.vertices.iter().map(value).collect()
}

/// Accessors that primitives, skins, animations and instancing refer to: how often each.
pub(super) fn references(document: &Value) -> BTreeMap<usize, usize> {
    let mut count = BTreeMap::new();
    walk_references(&mut document.clone(), &mut |value| {
        if let Some(index) = value.as_u64() {
            *count.entry(index as usize).or_default() += 1;
        }
    });
    count
}

/// Calls `each` with every place that refers to an accessor.
pub(super) fn walk_references(document: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    fn list<'a>(value: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
        value.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
    }
    fn members<'a>(value: Option<&'a mut Value>) -> impl Iterator<Item = &'a mut Value> {
        value.and_then(Value::as_object_mut).into_iter().flat_map(|o| o.values_mut())
    }
    for mesh in list(document, "meshes") {
        for primitive in list(mesh, "primitives") {
            members(primitive.get_mut("attributes")).for_each(&mut *each);
            primitive.get_mut("indices").into_iter().for_each(&mut *each);
            list(primitive, "targets").for_each(|t| members(Some(t)).for_each(&mut *each));
        }
    }
    for skin in list(document, "skins") {
        skin.get_mut("inverseBindMatrices").into_iter().for_each(&mut *each);
    }
    for animation in list(document, "animations") {
        for sampler in list(animation, "samplers") {
            sampler.get_mut("input").into_iter().for_each(&mut *each);
            sampler.get_mut("output").into_iter().for_each(&mut *each);
        }
    }
    for node in list(document, "nodes") {
        let instancing = node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes");
        members(instancing).for_each(&mut *each);
    }
}
