//! Primitives anew: attributes of any kind copied vertex by vertex, and the light's own.

use serde_json::{Map, Value, json};

use super::super::accessor::{Accessor, Component, Expected, element_bytes};
use super::super::container::Buffers;
use super::super::json::Element;
use super::references::fresh;
use super::{LitSurface, LitVertex};
use crate::context::Context;
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
}

/// What is to become of a primitive.
pub(super) struct Wanted<'a> {
    pub surface: &'a LitSurface,
    /// Elements of the accessors that the vertices of the surface's mesh were.
    pub vertices: &'a [u32],
    /// Its materials use the second set of texture coordinates.
    pub keeps_second_set: bool,
    /// Irradiance that is 1 in `COLOR_0`.
    pub scale: Option<f32>,
}

impl<'v, 'b> Geometry<'v, 'b> {
    pub fn new(root: &'v Element<'v>, buffers: &'v Buffers<'b>) -> Self {
        Self { root, buffers, accessors: Vec::new(), views: Vec::new() }
    }

    /// A view of bytes of a picture and the like.
    pub fn view(&mut self, value: Value, bytes: Vec<u8>) -> Value {
        self.views.push((value, bytes));
        fresh(self.views.len() - 1)
    }

    /// `primitive` as a surface has it, and the number of the set of texture coordinates that was the second.
    pub fn primitive(
        &mut self,
        context: &mut Context<'_>,
        primitive: &Element<'_>,
        wanted: &Wanted<'_>,
    ) -> Result<(Value, u64), FormatError> {
        let Wanted { surface, vertices, .. } = wanted;
        let element_of = |v: &LitVertex| vertices.get(v.source as usize).copied().unwrap_or(0);
        let sources: Vec<u32> = surface.vertices.iter().map(element_of).collect();
        let old = primitive.require("attributes", "an object of accessors")?;
        let turn = |key: &str| if surface.back { Turn::of(key) } else { Turn::None };
        let mut attributes = self.copies(context, &old, &sources, turn)?;
        // Numbers of sets follow each other (glTF §3.7.2.1), so that the next one is free.
        let next = |attributes: &Map<String, Value>, set: &str| -> u64 {
            (1..).find(|k| !attributes.contains_key(&format!("{set}_{k}"))).unwrap_or(1)
        };
        let mut second = 1;
        if let Some(texcoords) = all(surface, |v| v.texcoord) {
            let replaced = attributes.remove("TEXCOORD_1").filter(|_| wanted.keeps_second_set);
            let ours = self.floats(&texcoords, "VEC2");
            // No second set without a first.
            attributes.entry("TEXCOORD_0").or_insert_with(|| ours.clone());
            attributes.insert("TEXCOORD_1".into(), ours);
            if let Some(replaced) = replaced {
                second = next(&attributes, "TEXCOORD");
                attributes.insert(format!("TEXCOORD_{second}"), replaced);
            }
        }
        if let (Some(irradiance), Some(scale)) = (all(surface, |v| v.irradiance), wanted.scale) {
            attributes.insert("_IRRADIANCE".into(), self.floats(&irradiance, "VEC3"));
            let colours = self.colours(&irradiance, scale);
            if let Some(replaced) = attributes.insert("COLOR_0".into(), colours) {
                let number = next(&attributes, "COLOR");
                let message =
                    format!("gives its place to irradiance; the old colours are COLOR_{number}, which viewers ignore");
                context.warn(format!("{}.COLOR_0", old.path), message);
                attributes.insert(format!("COLOR_{number}"), replaced);
            }
        }
        let mut targets = Vec::new();
        for target in (0..primitive.count("targets")).filter_map(|k| primitive.item("targets", k)) {
            // Displacements of normals turn round with them; those of tangents have no handedness.
            let turn = |key: &str| if surface.back && key == "NORMAL" { Turn::Negated } else { Turn::None };
            targets.push(Value::Object(self.copies(context, &target, &sources, turn)?));
        }

        let mut out = primitive.value().clone();
        out["attributes"] = Value::Object(attributes);
        out["indices"] = self.indices(&surface.triangles, surface.vertices.len());
        if !targets.is_empty() {
            out["targets"] = Value::Array(targets);
        }
        if let Some(out) = out.as_object_mut() {
            out.remove("mode");
            // The packed form is that of the old geometry.
            remove_extension(out, "KHR_draco_mesh_compression");
        }
        Ok((out, second))
    }

    /// The accessors of `owner`, element by element in the order of `sources`. What cannot be read is left out, as it was when
    /// the scene was read; there is nothing without positions.
    fn copies(
        &mut self,
        context: &mut Context<'_>,
        owner: &Element<'_>,
        sources: &[u32],
        turn: impl Fn(&str) -> Turn,
    ) -> Result<Map<String, Value>, FormatError> {
        let mut out = Map::new();
        for key in owner.keys() {
            match self.copy(owner, key, sources, turn(key)) {
                Ok(copied) => out.extend(copied.map(|c| (key.to_owned(), c))),
                Err(error) if key == "POSITION" => return Err(error),
                Err(error) => {
                    context.warn(format!("{}.{key}", owner.path), format!("{}: left out", error.without_place()))
                }
            }
        }
        Ok(out)
    }

    /// Irradiance as colours of sixteen bits; `scale` is white.
    fn colours(&mut self, irradiance: &[[f32; 3]], scale: f32) -> Value {
        let unit = |c: f32| (f64::from(c) / f64::from(scale.max(f32::MIN_POSITIVE))).clamp(0.0, 1.0);
        let texels = irradiance.iter().flat_map(|&[r, g, b]| [unit(r), unit(g), unit(b), 1.0]);
        let bytes = texels.flat_map(|c| ((c * 65535.0).round() as u16).to_le_bytes()).collect();
        let view = self.view(json!({ "target": 34962 }), bytes);
        let count = irradiance.len();
        self.accessor(json!({
            "bufferView": view, "componentType": 5123, "normalized": true, "count": count, "type": "VEC4",
        }))
    }

    /// Elements of the accessor `key`.
    fn copy(
        &mut self,
        owner: &Element<'_>,
        key: &str,
        sources: &[u32],
        turn: Turn,
    ) -> Result<Option<Value>, FormatError> {
        let Some((_, element)) = owner.follow(key, self.root, "accessors")? else { return Ok(None) };
        let kind = element.text("type")?.unwrap_or_default();
        let accessor = Accessor::load(self.root, self.buffers, &element, &Expected { kind, components: &ALL })?;
        if let Some(beyond) = sources.iter().find(|&&s| s as usize >= accessor.count) {
            return Err(element.fault(format!("{} elements", accessor.count), format!("one number {beyond}")));
        }
        let code = element.integer("componentType")?.unwrap_or_default();
        let component = Component::from_code(code).unwrap_or(Component::F32);
        let (width, size) = (component.bytes(), element_bytes(component, kind));
        // Attributes start at multiples of four bytes (glTF §3.6.2.4).
        let stride = size.next_multiple_of(4);
        let mut bytes = Vec::with_capacity(stride * sources.len());
        for &source in sources {
            let start = bytes.len();
            bytes.extend(accessor.element(source as usize).iter().take(size));
            bytes.resize(start + stride, 0);
            let element = &mut bytes[start..start + size];
            match turn {
                Turn::None => {}
                Turn::Negated => element.chunks_mut(width).for_each(|c| negate(c, component)),
                Turn::Handedness => element.chunks_mut(width).skip(3).for_each(|c| negate(c, component)),
            }
        }
        let bounds = (key == "POSITION").then(|| bounds(&bytes, stride, component));
        let mut view = json!({ "target": 34962 });
        // What the last column of a matrix is filled up with is not everybody's part of it.
        if stride != size || kind.starts_with("MAT") {
            view["byteStride"] = json!(stride);
        }
        let view = self.view(view, bytes);
        let mut out = json!({ "bufferView": view, "componentType": code, "count": sources.len(), "type": kind });
        if element.flag("normalized") {
            out["normalized"] = json!(true);
        }
        if let Some([min, max]) = bounds {
            (out["min"], out["max"]) = (min, max);
        }
        Ok(Some(self.accessor(out)))
    }

    /// Adds an accessor.
    fn accessor(&mut self, value: Value) -> Value {
        self.accessors.push(value);
        fresh(self.accessors.len() - 1)
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> Value {
        let bytes = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(json!({ "target": 34962 }), bytes);
        let count = values.len();
        self.accessor(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }))
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
        self.accessor(json!({ "bufferView": view, "componentType": code, "count": count, "type": "SCALAR" }))
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

/// The smallest and the largest of each of three components as they are stored: bounds of accessors are not normalized
/// (glTF §3.6.2.5).
fn bounds(bytes: &[u8], stride: usize, component: Component) -> [Value; 2] {
    let value = |element: &[u8], c: usize| element.get(c * component.bytes()..).map_or(0.0, |b| component.read(b));
    let bound = |pick: fn(f64, f64) -> f64| -> Vec<Value> {
        let over = |c: usize| bytes.chunks(stride.max(1)).map(|e| value(e, c)).reduce(pick).unwrap_or(0.0);
        let number = |v: f64| if component == Component::F32 { json!(v) } else { json!(v as i64) };
        (0..3).map(|c| number(over(c))).collect()
    };
    [bound(f64::min), bound(f64::max)].map(Value::Array)
}

/// Takes an extension out of an object, and what held it where nothing is left.
fn remove_extension(owner: &mut Map<String, Value>, name: &str) {
    let Some(extensions) = owner.get_mut("extensions").and_then(Value::as_object_mut) else { return };
    extensions.remove(name);
    if extensions.is_empty() {
        owner.remove("extensions");
    }
}

/// A value of every vertex, if all have it.
fn all<T>(surface: &LitSurface, value: impl Fn(&LitVertex) -> Option<T>) -> Option<Vec<T>> {
    surface.vertices.iter().map(value).collect()
}
