//! Baked light put into the document that it was baked for. Everything else of the document stays as it is: nodes,
//! names, animations, materials, extensions that nobody here knows.
//!
//! `former` takes out what an earlier bake left, `geometry` makes primitives with new texture coordinates, `materials` those that show the light, `tidy` puts all binary data into one
//! chunk and leaves out what nothing refers to any more, by the `references` that there are.

mod former;
mod geometry;
mod materials;
mod references;
mod tidy;

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use self::geometry::{Geometry, Wanted};
use self::materials::Materials;
use super::container::{self, Buffers};
use super::json::{self, Element, index, object};
use crate::context::Context;
use crate::error::FormatError;
use crate::limits::Limits;
use crate::read::{Origin, Resolver};
use crate::warning::Warning;

/// Baked light for a document.
#[derive(Clone, Debug, Default)]
pub struct Lit {
    /// What is drawn with it.
    pub surfaces: Vec<LitSurface>,
    /// What the materials of surfaces become.
    pub pages: Vec<LitPage>,
    /// Take point, spot and directional lights out: their light is baked.
    pub drop_lights: bool,
    /// Goes to `asset.extras.twinray_bake`.
    pub about: Value,
}

/// Triangles of one primitive of one node.
#[derive(Clone, Debug, Default)]
pub struct LitSurface {
    /// Instance of the scene that was read.
    pub instance: usize,
    /// Vertices.
    pub vertices: Vec<LitVertex>,
    /// Triangles as they are drawn.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Lit::pages`].
    pub page: Option<usize>,
    /// It is the back: normals are turned round.
    pub back: bool,
    /// Only one side is drawn: the other has triangles of its own.
    pub one_sided: bool,
}

/// A vertex of the scene's mesh with what the bake knows of it.
#[derive(Clone, Copy, Debug, Default)]
pub struct LitVertex {
    /// Vertex of the mesh.
    pub source: u32,
    /// `TEXCOORD_1`.
    pub texcoord: Option<[f32; 2]>,
    /// Irradiance, W·m⁻² (or lux): `_IRRADIANCE`, and in `COLOR_0` as a part of the largest of all, which is the extra
    /// `twinray_irradiance_scale` of every mesh.
    pub irradiance: Option<[f32; 3]>,
}

/// A picture within the file.
#[derive(Clone, Debug)]
pub struct LitPicture {
    /// Its name.
    pub name: String,
    /// The file's bytes.
    pub bytes: Vec<u8>,
    /// Such as `image/png`.
    pub mime: &'static str,
}

/// A page of an atlas as materials show it.
#[derive(Clone, Debug)]
pub struct LitPage {
    /// For messages and names.
    pub name: String,
    /// How.
    pub material: LitMaterial,
}

/// What a page makes of a material.
#[derive(Clone, Debug)]
pub enum LitMaterial {
    /// Adds a lightmap of irradiance: `TWINRAY_lightmap`, and `MOZ_lightmap` with a picture of 8 bits for those that know it.
    Lightmap {
        /// Irradiance over `scale`, W·m⁻² (or lux).
        hdr: LitPicture,
        /// What 1 is in `hdr`.
        scale: f32,
        /// Irradiance over `intensity`, sRGB-encoded.
        ldr: LitPicture,
        /// What is white in `ldr`.
        intensity: f32,
    },
    /// Says in the material's extras, `twinray_lightmap`, which file beside this one has its light.
    Beside(Value),
    /// Replaces it by colours as they look, without lights: `KHR_materials_unlit`.
    Unlit(LitPicture),
}

/// A document with baked light.
#[derive(Clone, Debug)]
pub struct LitGlb {
    /// The `.glb` file.
    pub bytes: Vec<u8>,
    /// What of the document could not be kept as it was.
    pub warnings: Vec<Warning>,
}

/// Writes a document with baked light as one `.glb` file. `name`, `source`, `resolver` and `limits` are those of
/// [`crate::read_scene`], which gave `origins`.
///
/// A primitive that has surfaces is replaced by them: attributes of any kind, morph targets among them, are copied vertex by
/// vertex; `TEXCOORD_1` becomes the lightmap's, and where the material uses the old one, that is kept under the next free number,
/// as is `COLOR_0` where vertices carry irradiance. Nodes that shared a mesh get meshes of their own. Materials and pictures that
/// nothing shows any more stay, but for those of an earlier bake; geometry goes. Equal arguments give equal bytes.
///
/// # Errors
/// As [`crate::read_scene`], and [`FormatError::Unsupported`] beyond the 4 GiB that such a file can hold. A surface whose
/// instance has no origin is left out.
///
/// # Panics
/// Never, whatever the bytes.
pub fn write_lit_glb(
    name: &str,
    source: &[u8],
    resolver: &mut Resolver<'_>,
    limits: &Limits,
    origins: &[Option<Origin>],
    lit: &Lit,
) -> Result<LitGlb, FormatError> {
    let mut fetch = |path: &str| resolver(path);
    let mut context = Context::new(name, limits, &mut fetch);
    context.check_size(source.len(), name)?;
    context.budget.add_input(source.len());
    let (text, chunk) = container::split(name, source)?;
    let (mut original, _) = json::parse(&mut context, text)?;
    former::forget(&mut original);
    let root = Element::root(name, &original);
    if !root.is_object() {
        return Err(FormatError::invalid(name, "JSON", "no object", "a glTF 2.0 document"));
    }
    let buffers = Buffers::load(&mut context, &root, chunk)?;

    let mut document = original.clone();
    let mut geometry = Geometry::new(&root, &buffers);
    let mut materials = Materials::new(&original, lit);
    let nodes = by_node(origins, lit);
    // One white for the whole file: viewers that know of no scale show meshes as bright as they are beside each other.
    let irradiance = lit.surfaces.iter().flat_map(|s| &s.vertices).filter_map(|v| v.irradiance);
    let scale = irradiance.map(|i| i.into_iter().fold(0.0, f32::max)).reduce(f32::max);
    let mut meshes = Meshes::new(&original, nodes.keys().copied());
    for (&node, primitives) in &nodes {
        let Some((_, first)) = primitives.values().flatten().next() else { continue };
        let Some(mesh) = root.item("meshes", first.mesh).filter(Element::is_object) else { continue };
        let Some(value) = document["nodes"].get_mut(node).and_then(Value::as_object_mut) else { continue };
        let made = lit_mesh(&mut context, &mesh, primitives, scale, &mut geometry, &mut materials)?;
        value.insert("mesh".into(), json!(meshes.put(first.mesh, made)));
    }
    if !meshes.list.is_empty() {
        document["meshes"] = Value::Array(meshes.list);
    }
    let extensions = materials.finish(&mut document, &mut geometry);
    if lit.drop_lights {
        drop_lights(&mut document);
    }
    if !lit.about.is_null() {
        note(&mut context, &mut document["asset"], "asset", "twinray_bake", lit.about.clone());
    }
    list_extensions(&mut document, &extensions);
    let bytes = tidy::finish(&mut context, &root, &buffers, document, geometry)?;
    Ok(LitGlb { bytes, warnings: context.warnings.finish(name) })
}

/// Surfaces of a node by the number of the primitive that they replace.
type Primitives<'a> = BTreeMap<usize, Vec<(&'a LitSurface, &'a Origin)>>;

fn by_node<'a>(origins: &'a [Option<Origin>], lit: &'a Lit) -> BTreeMap<usize, Primitives<'a>> {
    let mut nodes: BTreeMap<usize, Primitives<'a>> = BTreeMap::new();
    for surface in lit.surfaces.iter().filter(|s| !s.triangles.is_empty()) {
        if let Some(origin) = origins.get(surface.instance).and_then(Option::as_ref) {
            nodes.entry(origin.node).or_default().entry(origin.primitive).or_default().push((surface, origin));
        }
    }
    nodes
}

/// The mesh as one node shows it.
fn lit_mesh(
    context: &mut Context<'_>,
    mesh: &Element<'_>,
    primitives: &Primitives<'_>,
    scale: Option<f32>,
    geometry: &mut Geometry<'_, '_>,
    materials: &mut Materials<'_>,
) -> Result<Value, FormatError> {
    let surfaces = || primitives.values().flatten().map(|(surface, _)| *surface);
    let scale = scale.filter(|_| surfaces().any(|s| s.vertices.iter().any(|v| v.irradiance.is_some())));
    let mut list = Vec::new();
    for (k, primitive) in mesh.items("primitives")?.enumerate() {
        let Some(surfaces) = primitives.get(&k) else {
            list.push(primitive.value().clone());
            continue;
        };
        for (surface, origin) in surfaces {
            let used = materials.uses_second_set(primitive.value());
            let wanted = Wanted { surface, vertices: &origin.vertices, keeps_second_set: used, scale };
            let (mut made, second) = geometry.primitive(context, &primitive, &wanted)?;
            materials.assign(&mut made, surface, second);
            list.push(made);
        }
    }
    let mut out = mesh.value().clone();
    out["primitives"] = Value::Array(list);
    if let Some(scale) = scale {
        note(context, &mut out, &mesh.path, "twinray_irradiance_scale", json!(scale));
    }
    Ok(out)
}

/// Puts an extra beside those that are there.
fn note(context: &mut Context<'_>, owner: &mut Value, path: &str, key: &str, value: Value) {
    match object(owner, "extras") {
        Some(extras) => drop(extras.insert(key.to_owned(), value)),
        None => context.warn(format!("{path}.extras"), format!("no object: {key} has no place in it and is left out")),
    }
}

/// Meshes of the document: those of lit nodes take the place of the original where every node that shows it is lit.
struct Meshes {
    list: Vec<Value>,
    free: Vec<bool>,
}

impl Meshes {
    fn new(original: &Value, lit: impl Iterator<Item = usize>) -> Self {
        let list: Vec<Value> = original["meshes"].as_array().cloned().unwrap_or_default();
        let lit: BTreeSet<usize> = lit.collect();
        let mut free = vec![true; list.len()];
        for (k, node) in original["nodes"].as_array().into_iter().flatten().enumerate() {
            let shown = index(&node["mesh"]).filter(|_| !lit.contains(&k));
            if let Some(free) = shown.and_then(|mesh| free.get_mut(mesh)) {
                *free = false;
            }
        }
        Self { list, free }
    }

    fn put(&mut self, original: usize, mesh: Value) -> usize {
        if self.free.get_mut(original).is_some_and(std::mem::take) {
            self.list[original] = mesh;
            return original;
        }
        self.list.push(mesh);
        self.list.len() - 1
    }
}

/// Nodes keep their places; lights leave.
fn drop_lights(document: &mut Value) {
    const LIGHTS: [&str; 2] = ["KHR_lights_punctual", "EXT_lights_ies"];
    let remove = |owner: &mut Value| {
        let Some(extensions) = owner.get_mut("extensions").and_then(Value::as_object_mut) else { return };
        LIGHTS.iter().for_each(|l| drop(extensions.remove(*l)));
        if extensions.is_empty()
            && let Some(owner) = owner.as_object_mut()
        {
            owner.remove("extensions");
        }
    };
    document.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten().for_each(remove);
    remove(document);
    for key in ["extensionsUsed", "extensionsRequired"] {
        if let Some(list) = document.get_mut(key).and_then(Value::as_array_mut) {
            list.retain(|e| !LIGHTS.iter().any(|l| e == l));
        }
        if document.get(key).and_then(Value::as_array).is_some_and(Vec::is_empty)
            && let Some(document) = document.as_object_mut()
        {
            document.remove(key);
        }
    }
}

fn list_extensions(document: &mut Value, added: &BTreeSet<&'static str>) {
    if added.is_empty() {
        return;
    }
    let mut list = document["extensionsUsed"].as_array().cloned().unwrap_or_default();
    list.extend(added.iter().filter(|e| !list.iter().any(|l| l == *e)).map(|e| json!(e)).collect::<Vec<_>>());
    document["extensionsUsed"] = Value::Array(list);
}
