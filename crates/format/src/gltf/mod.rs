//! glTF 2.0, binary and text: from a document to a scene, in the order a reader of the code expects.
//!
//! `container` opens the file, `json` finds its way in it, `node` walks the tree, `primitive` and `material`
//! and `light` read what stands there, `animation` how cameras move, `write` goes the other way, `lit` puts baked light into a document. Called by `read_scene`.

mod accessor;
mod animation;
mod container;
mod json;
mod light;
mod lit;
mod material;
mod node;
mod primitive;
mod slot;
mod write;

use std::collections::HashMap;
use std::sync::Arc;

use glam::DAffine3;
use twinray_scene::{Environment, Instance, Mesh, Rgb, Scene};

use self::container::Buffers;
use self::json::Element;
use self::light::Lights;
use self::material::{IGNORED, Materials};
use self::node::Placed;
use self::primitive::Primitives;
use crate::context::Context;
use crate::error::FormatError;
use crate::geometry::{Account, RICHEST_VERTEX, clean, mesh_bytes, no_triangles};
use crate::read::Origin;

pub use self::lit::{Lit, LitGlb, LitMaterial, LitPage, LitPicture, LitSurface, LitVertex, write_lit_glb};
pub use self::write::write_glb;

/// Extensions that are read, or whose absence from the result is named where it shows.
const UNDERSTOOD: [&str; 11] = [
    "EXT_lights_ies",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Memory of a mesh beside its arrays and its name.
const MESH_BYTES: u64 = 2 * size_of::<Mesh>() as u64;

/// Reads a `.glb` or `.gltf` file; says for each instance where it is in it.
pub(crate) fn read(context: &mut Context<'_>, bytes: &[u8]) -> Result<(Scene, Vec<Option<Origin>>), FormatError> {
    let (text, chunk) = container::split(context.file, bytes)?;
    let (document, tree_bytes) = json::parse(context, text)?;
    let root = Element::root(context.file, &document);
    if !root.is_object() {
        return Err(FormatError::invalid(context.file, "JSON", "no object", "a glTF 2.0 document"));
    }
    check_version(context, &root)?;
    check_extensions(context, &root)?;

    let placed = node::walk(context, &root)?;
    let buffers = Buffers::load(context, &root, chunk)?;
    let mut content = Content {
        primitives: Primitives::new(&root, &buffers),
        buffers: &buffers,
        materials: Materials::default(),
        meshes: HashMap::new(),
        lights: Lights::default(),
        account: Account::default(),
        camera_places: Vec::new(),
        primitives_of_meshes: Vec::new(),
        origins: Vec::new(),
        scene: Scene::default(),
    };
    for (i, place) in placed.iter().enumerate() {
        content.place(context, &root, place)?;
        let cameras = content.scene.cameras.len();
        content.camera_places.resize(cameras, i);
    }
    content.scene.animations = animation::read(context, &root, &buffers, &placed, &content.camera_places)?;
    warn_ignored(context, &placed);
    read_extras(context, &root, &mut content.scene);

    let Content { materials, mut scene, origins, .. } = content;
    let (list, pictures) = materials.finish(context);
    scene.materials = list;
    scene.images = pictures.into_images();
    context.budget.release(tree_bytes);
    if scene.instances.is_empty() {
        return Err(no_triangles(context, "scene"));
    }
    Ok((scene, origins))
}

/// The scene as it grows.
struct Content<'v, 'b> {
    primitives: Primitives<'v, 'b>,
    buffers: &'v Buffers<'b>,
    materials: Materials,
    /// Our meshes of each mesh of the file: one per primitive with triangles.
    meshes: HashMap<usize, Vec<usize>>,
    lights: Lights,
    account: Account,
    /// Of each of our meshes: the number of its primitive, and which elements of its accessors its vertices are.
    primitives_of_meshes: Vec<(usize, Arc<[u32]>)>,
    /// One for each instance.
    origins: Vec<Option<Origin>>,
    /// Where each camera of the scene is among the placed nodes.
    camera_places: Vec<usize>,
    scene: Scene,
}

impl Content<'_, '_> {
    /// Adds what `place` carries.
    fn place(&mut self, context: &mut Context<'_>, root: &Element<'_>, place: &Placed<'_>) -> Result<(), FormatError> {
        if let Some(camera) = node::camera(context, root, place) {
            self.scene.cameras.push(camera);
        }
        self.scene.lights.extend(self.lights.at(context, root, self.buffers, place)?);
        let Some((index, mesh)) = place.node.follow("mesh", root, "meshes")? else { return Ok(()) };
        if !self.meshes.contains_key(&index) {
            let meshes = self.read_mesh(context, root, index, &mesh)?;
            self.meshes.insert(index, meshes);
        }
        let limit = context.limits.max_coordinate;
        if !place.to_world.is_finite() || place.to_world.translation.abs().max_element() > limit {
            context.warn(&place.node.path, format!("ignored: it stands farther away than {limit:e}"));
            return Ok(());
        }
        let name = place.node.name_or(|| mesh.name_or(|| format!("node {}", place.index)));
        for mesh in self.meshes.get(&index).cloned().unwrap_or_default() {
            let Some((mesh, transform)) = self.flattened(context, mesh, place.to_world)? else { continue };
            context.charge(256 + name.len() as u64, &place.node.path)?;
            context.charge(256 + name.len() as u64, &place.node.path)?;
            self.account.add(context, &place.node.path, self.scene.meshes[mesh].triangles.len())?;
            let (primitive, vertices) = self.primitives_of_meshes[mesh].clone();
            self.origins.push(Some(Origin { node: place.index, mesh: index, primitive, vertices }));
            self.scene.instances.push(Instance { name: name.clone(), mesh, transform });
        }
        Ok(())
    }

    fn read_mesh(
        &mut self,
        context: &mut Context<'_>,
        root: &Element<'_>,
        index: usize,
        mesh: &Element<'_>,
    ) -> Result<Vec<usize>, FormatError> {
        let count = mesh.count("primitives");
        let base = mesh.name_or(|| format!("mesh {index}"));
        let mut meshes = Vec::new();
        for (i, primitive) in mesh.items("primitives")?.enumerate() {
            let name = if count > 1 { format!("{base}#{i}") } else { base.clone() };
            context.charge(MESH_BYTES + name.len() as u64, &primitive.path)?;
            let Some((read, vertices)) = self.primitives.read(context, root, &primitive, &name)? else { continue };
            // Beside the arrays of the mesh, which are at least three times as large.
            context.charge(vertices.len() as u64 * 4, &primitive.path)?;
            self.primitives_of_meshes.push((i, vertices.into()));
            let material = self.materials.of(context, root, self.buffers, &primitive)?;
            self.scene.meshes.push(Mesh { material, ..read });
            meshes.push(self.scene.meshes.len() - 1);
        }
        Ok(meshes)
    }

    /// The mesh to place and its transform. A transform that squashes space flat leaves triangles without area,
    /// which only a copy of the mesh can be cleaned of; `None` if nothing is left.
    fn flattened(
        &mut self,
        context: &mut Context<'_>,
        mesh: usize,
        to_world: DAffine3,
    ) -> Result<Option<(usize, DAffine3)>, FormatError> {
        let m = to_world.matrix3;
        let largest = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
        if m.determinant().abs() > 1e-15 * largest.powi(3) {
            return Ok(Some((mesh, to_world)));
        }
        let source = &self.scene.meshes[mesh];
        let bytes = mesh_bytes(source.positions.len(), source.triangles.len(), RICHEST_VERTEX);
        let mut flat = source.clone();
        context.charge(bytes, &format!("mesh \"{}\"", flat.name))?;
        (flat.normals, flat.tangents) = (None, None);
        for p in &mut flat.positions {
            *p = (m * glam::Vec3::from(*p).as_dvec3()).as_vec3().to_array();
        }
        let left = clean(context, &mut flat);
        if flat.triangles.is_empty() {
            return Ok(None);
        }
        let (primitive, vertices) = self.primitives_of_meshes[mesh].clone();
        let vertices = match left {
            Some(left) => vertices.iter().zip(left).filter(|(_, left)| *left).map(|(&v, _)| v).collect(),
            None => vertices,
        };
        self.scene.meshes.push(flat);
        self.primitives_of_meshes.push((primitive, vertices));
        Ok(Some((self.scene.meshes.len() - 1, DAffine3::from_translation(to_world.translation))))
    }
}

fn check_version(context: &Context<'_>, root: &Element<'_>) -> Result<(), FormatError> {
    let asset = root.require("asset", "an object with the glTF version")?;
    let version = asset.require("version", "\"2.0\"")?;
    let text = asset.text("version")?.unwrap_or_default();
    let minimum = asset.text("minVersion")?;
    match text.split('.').next().map(str::parse::<u32>) {
        // Minor versions only add; who cannot do without an addition says so in `minVersion`.
        Some(Ok(2)) if minimum.is_none_or(|m| m == "2.0") => Ok(()),
        Some(Ok(_)) => {
            let what = format!("glTF version {}", minimum.unwrap_or(text));
            Err(FormatError::unsupported(context.file, "asset.version", what, "Export the scene as glTF 2.0"))
        }
        _ => Err(version.invalid("\"2.0\"")),
    }
}

fn check_extensions(context: &mut Context<'_>, root: &Element<'_>) -> Result<(), FormatError> {
    let required = root.strings("extensionsRequired");
    let is_known = |name: &&&str| UNDERSTOOD.contains(*name) || IGNORED.contains(*name);
    if let Some(unknown) = required.iter().find(|name| !is_known(name)) {
        let hint = "Export without it; for compression (Draco, meshopt, Basis) switch the exporter's option off";
        let what = format!("the required extension {unknown}");
        return Err(FormatError::unsupported(context.file, "extensionsRequired", what, hint));
    }
    for unknown in root.strings("extensionsUsed").iter().filter(|name| !is_known(name)) {
        context.warn("extensionsUsed", format!("extension {unknown} is ignored"));
    }
    Ok(())
}

/// What `write_glb` leaves for us in `asset.extras.twinray`; from other programs it would be chance.
fn read_extras(context: &Context<'_>, root: &Element<'_>, scene: &mut Scene) {
    let extras = root.get("asset").and_then(|asset| asset.get("extras")?.get("twinray"));
    let Some(extras) = extras else { return };
    if let Ok(Some(radiance)) = extras.numbers::<3>("environment")
        && radiance.iter().all(|c| (0.0..=context.limits.max_radiance).contains(c))
    {
        scene.environment = Some(Environment::Uniform(Rgb::from_array(radiance)));
    }
    // A suggestion costs memory later: it has the limit of triangles.
    if let Ok(Some(patches)) = extras.integer("suggested_patches") {
        scene.suggested_patches = usize::try_from(patches).ok().filter(|_| patches <= context.limits.max_triangles);
    }
}

fn warn_ignored(context: &mut Context<'_>, placed: &[Placed<'_>]) {
    for place in placed {
        if place.node.get("skin").is_some() {
            context.warn(&place.node.path, "the skin is ignored: the mesh keeps the shape in which it was bound");
        }
    }
}
