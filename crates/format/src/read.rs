//! The one entrance for scenes: tells the formats apart and hands the bytes to their reader.
//!
//! Not here: anything a format says. Called by: the command, the viewer, tests.

use std::io;
use std::sync::Arc;

use twinray_scene::Scene;

use crate::context::Context;
use crate::error::FormatError;
use crate::limits::Limits;
use crate::warning::Warning;

/// Fetches a referenced file: gets a relative path with `/` between its parts, never one that leaves the
/// scene's folder, and answers with the file's bytes.
pub type Resolver<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// A scene and what had to be changed or ignored to get it.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The scene.
    pub scene: Scene,
    /// For each of its instances where it is in the glTF document: what [`crate::write_lit_glb`] needs. `None` where there is
    /// nothing as it was read.
    pub origins: Vec<Option<Origin>>,
    /// What was changed, ignored or guessed, in order of appearance.
    pub warnings: Vec<Warning>,
}

/// Where an instance comes from in a glTF document.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// Index of the node.
    pub node: usize,
    /// Index of its mesh.
    pub mesh: usize,
    /// Index of the primitive in the mesh.
    pub primitive: usize,
    /// For each vertex of our mesh, the element of the primitive's accessors that it was.
    pub vertices: Arc<[u32]>,
}

/// Reads a scene from the bytes of a `.glb`, `.gltf` or `.obj` file.
///
/// `name` is the file's name: its extension chooses the format (binary glTF is known by its first bytes), its
/// stem names the scene, and messages start with it. `resolver` fetches files that the scene refers to.
///
/// Of glTF 2.0 are read: triangles, strips and fans, node transforms, perspective and orthographic cameras,
/// metallic-roughness materials with their textures and `KHR_materials_emissive_strength`, `_ior`, `_specular`
/// and `_transmission`, `KHR_mesh_quantization`, `EXT_texture_webp`. Of OBJ with MTL: polygons, normals, texture
/// coordinates, Kd, Ks, Ns, Ke, d, Tr, map_Kd, map_Ke. What else a file contains is named in a warning.
///
/// Light leaves an emitter on its front side only, also where the material is two-sided. The front is the side
/// from which the corners run counter-clockwise, in OBJ files that have normals the side of these.
///
/// # Errors
/// [`FormatError::Unreadable`] if the bytes are damaged, [`FormatError::Unsupported`] if they need something this
/// version does not have or contain no triangle, [`FormatError::Reference`] if a buffer file is not to be had,
/// [`FormatError::Invalid`] if an element breaks the rules of the format, [`FormatError::OverLimit`] beyond
/// `limits`. Missing or broken textures and materials are warnings.
///
/// # Panics
/// Never, whatever the bytes.
pub fn read_scene(
    name: &str,
    bytes: &[u8],
    resolver: &mut Resolver<'_>,
    limits: &Limits,
) -> Result<Reading, FormatError> {
    let mut fetch = |path: &str| resolver(path);
    let mut context = Context::new(name, limits, &mut fetch);
    context.check_size(bytes.len(), name)?;
    context.budget.add_input(bytes.len());
    context.charge(0, "file")?;
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let (stem, extension) = base.rsplit_once('.').unwrap_or((base, ""));
    let obj = |scene: Scene| {
        let origins = vec![None; scene.instances.len()];
        (scene, origins)
    };
    let (mut scene, origins) = match extension.to_ascii_lowercase().as_str() {
        _ if bytes.starts_with(b"glTF") => crate::gltf::read(&mut context, bytes)?,
        "gltf" | "glb" => crate::gltf::read(&mut context, bytes)?,
        "obj" => obj(crate::obj::read(&mut context, bytes)?),
        _ if bytes.trim_ascii_start().starts_with(b"{") => crate::gltf::read(&mut context, bytes)?,
        other => {
            let what = if other.is_empty() { "a file without an extension".into() } else { format!("format .{other}") };
            let hint = "Scenes are read from .glb, .gltf and .obj; convert the file to glTF 2.0";
            return Err(FormatError::unsupported(name, "file", what, hint));
        }
    };
    scene.name = stem.to_owned();
    Ok(Reading { scene, origins, warnings: context.warnings.finish(name) })
}
