//! The glTF document that gets the light: the scene's own file, or one made of a scene of another kind.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, anyhow};
use twinray::format::{self, Lit, LitGlb, Origin};
use twinray::scene::Scene;

use crate::args::ReadArgs;
use crate::files::{self, Folder};
use crate::input::{self, Loaded};

/// A document and where the scene's instances are in it.
pub struct Document {
    name: String,
    bytes: Vec<u8>,
    pub origins: Vec<Option<Origin>>,
    is_own: bool,
}

impl Document {
    /// That of a scene which was kept when it was loaded.
    pub fn of(loaded: &Loaded, scene: &Scene, args: &ReadArgs) -> anyhow::Result<Self> {
        let name = loaded.scene_file();
        let path = Path::new(name);
        let limits = input::limits(args);
        if path.exists() {
            let bytes = files::read(path, limits.max_file_bytes).with_context(|| format!("{name}: cannot be read"))?;
            let folder = Folder::of(path, args.allow_outside, limits.max_file_bytes);
            let mut resolver = |reference: &str| folder.read(reference);
            let reading = format::read_scene(name, &bytes, &mut resolver, &limits).map_err(|e| anyhow!("{e}"))?;
            if reading.origins.iter().any(Option::is_some) {
                return Ok(Self { name: name.into(), bytes, origins: reading.origins, is_own: true });
            }
        }
        let cameras = loaded.scene_cameras().to_vec();
        let scene = Scene { cameras, ..scene.clone() };
        Ok(Self { name: "scene.glb".into(), bytes: format::write_glb(&scene), origins: origins(&scene), is_own: false })
    }

    /// The document with light in it.
    pub fn lit(&self, lit: &Lit, args: &ReadArgs) -> anyhow::Result<LitGlb> {
        let limits = input::limits(args);
        let folder = Folder::of(Path::new(&self.name), args.allow_outside, limits.max_file_bytes);
        let mut resolver = |reference: &str| match self.is_own {
            true => folder.read(reference),
            false => Err(std::io::ErrorKind::NotFound.into()),
        };
        format::write_lit_glb(&self.name, &self.bytes, &mut resolver, &limits, &self.origins, lit)
            .map_err(|e| anyhow!("{e}"))
    }
}

/// True of a file that a bake has written without the lights that it baked.
pub fn has_lost_lights(path: &Path, most: u64) -> bool {
    let Ok(bytes) = files::read(path, most) else { return false };
    let json = match bytes.first_chunk::<20>() {
        Some(head) if head.starts_with(b"glTF") => {
            let length = u32::from_le_bytes([head[12], head[13], head[14], head[15]]) as usize;
            bytes.get(20..).and_then(|rest| rest.get(..length))
        }
        _ => Some(bytes.as_slice()),
    };
    let value = json.and_then(|json| serde_json::from_slice::<serde_json::Value>(json).ok());
    value.is_some_and(|v| {
        let baked = &v["asset"]["extras"]["twinray_bake"]["lights"]["punctual"];
        baked.as_array().is_some_and(|lights| !lights.is_empty()) && v["extensions"]["KHR_lights_punctual"].is_null()
    })
}

/// Where `write_glb` puts instances: a node each, and a mesh of one primitive for each mesh that has triangles.
fn origins(scene: &Scene) -> Vec<Option<Origin>> {
    let mut meshes = 0;
    let numbers: Vec<Option<usize>> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let number = (!mesh.triangles.is_empty()).then_some(meshes);
            meshes += usize::from(number.is_some());
            number
        })
        .collect();
    let mut nodes = 0;
    scene
        .instances
        .iter()
        .map(|instance| {
            let mesh = numbers[instance.mesh]?;
            let vertices: Arc<[u32]> = (0..scene.meshes[instance.mesh].positions.len() as u32).collect();
            nodes += 1;
            Some(Origin { node: nodes - 1, mesh, primitive: 0, vertices })
        })
        .collect()
}
