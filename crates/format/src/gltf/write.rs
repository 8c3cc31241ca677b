//! A scene as one binary glTF 2.0 file that other programs load as the same thing.
//!
//! Not here: reading (the sibling modules). The layout is fixed, so equal scenes give equal bytes: per mesh its
//! positions, normals, texture coordinates and indices, then the pictures as PNG.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DMat3};
use serde_json::{Map, Value, json};
use twinray_scene::{
    Camera, Environment, LightKind, LightProfile, Material, Mesh, NormalMap, Opacity, Projection, Rgb, Scene, Surface,
    Texel, TextureRef, TextureTransform, Transmission, Volume, Wrap,
};

use crate::ies::write_ies;
use crate::png::encode_rgba;

/// Writes `scene` as binary glTF 2.0 (`.glb`).
///
/// Emission above 1 uses `KHR_materials_emissive_strength`, pure Lambertian surfaces `KHR_materials_specular` with
/// factor 0, glass `KHR_materials_transmission` and, for bodies, `KHR_materials_volume`, lights `KHR_lights_punctual` and
/// `EXT_lights_ies`. Phong lobes, which glTF does
/// not have, become the metallic-roughness lobe of about the same width, α = √(2/(exponent + 2)); the material's
/// `extras` note the original values, which `read_scene` finds again, too. A uniform environment and the suggested number of patches go to `asset.extras.twinray`, where
/// `read_scene` finds them again. Meshes without triangles are left out.
///
/// # Panics
/// If the scene is not valid: an index in it points nowhere, or an image has not `4 × width × height` bytes.
pub fn write_glb(scene: &Scene) -> Vec<u8> {
    let mut writer = Writer::default();
    let mut numbers = vec![None; scene.meshes.len()];
    for (mesh, number) in scene.meshes.iter().zip(&mut numbers) {
        *number = writer.mesh(mesh);
    }
    let materials: Vec<Value> = scene.materials.iter().map(|m| writer.material(m)).collect();
    let images: Vec<Value> = scene
        .images
        .iter()
        .map(|image| {
            let png = encode_rgba(image.width, image.height, &image.rgba);
            let view = writer.view(&png, None);
            json!({ "name": image.name, "mimeType": "image/png", "bufferView": view })
        })
        .collect();

    let mut nodes = Vec::new();
    for instance in &scene.instances {
        let Some(mesh) = numbers[instance.mesh] else { continue };
        let mut node = json!({ "name": instance.name, "mesh": mesh });
        set_transform(&mut node, &instance.transform);
        nodes.push(node);
    }
    for (i, camera) in scene.cameras.iter().enumerate() {
        let mut node = json!({ "name": camera.name, "camera": i });
        let [right, up, forward] = camera.axes();
        let pose = DAffine3::from_mat3_translation(DMat3::from_cols(right, up, -forward), camera.eye);
        set_transform(&mut node, &pose);
        nodes.push(node);
    }

    let (lights, profiles) = writer.lights(scene, &mut nodes);

    let mut asset = json!({ "version": "2.0", "generator": concat!("twinray ", env!("CARGO_PKG_VERSION")) });
    if let Some(extras) = extras(scene) {
        asset["extras"] = extras;
    }
    let mut document =
        json!({ "asset": asset, "scene": 0, "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }] });
    if nodes.is_empty() {
        // Empty arrays are not allowed.
        document["scenes"] = json!([{}]);
    }
    for (key, list) in [("EXT_lights_ies", profiles), ("KHR_lights_punctual", lights)] {
        if !list.is_empty() {
            document["extensions"][key] = json!({ "lights": list });
            writer.extensions.insert(key);
        }
    }
    let cameras = scene.cameras.iter().map(camera).collect();
    let used: Vec<Value> = writer.extensions.iter().map(|name| json!(name)).collect();
    let arrays = [
        ("extensionsUsed", used),
        ("nodes", nodes),
        ("cameras", cameras),
        ("meshes", std::mem::take(&mut writer.meshes)),
        ("materials", materials),
        ("textures", std::mem::take(&mut writer.textures)),
        ("samplers", std::mem::take(&mut writer.samplers)),
        ("images", images),
        ("accessors", std::mem::take(&mut writer.accessors)),
        ("bufferViews", std::mem::take(&mut writer.views)),
    ];
    for (key, array) in arrays.into_iter().filter(|(_, array)| !array.is_empty()) {
        document[key] = Value::Array(array);
    }
    if !writer.binary.is_empty() {
        document["buffers"] = json!([{ "byteLength": writer.binary.len() }]);
    }
    container(document.to_string().into_bytes(), writer.binary)
}

/// The two chunks, padded to four bytes as the format wants: JSON with spaces, data with zeros.
pub(super) fn container(mut text: Vec<u8>, binary: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let binary_chunk = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let length = 12 + 8 + text.len() + binary_chunk;
    let word = |n: usize| u32::try_from(n).expect("a .glb file holds at most 4 GiB").to_le_bytes();
    let mut out = Vec::with_capacity(length);
    out.extend(b"glTF");
    out.extend(word(2));
    out.extend(word(length));
    out.extend(word(text.len()));
    out.extend(b"JSON");
    out.extend(text);
    if !binary.is_empty() {
        out.extend(word(binary.len()));
        out.extend(b"BIN\0");
        out.extend(binary);
    }
    out
}

/// The document's arrays as they grow.
#[derive(Default)]
struct Writer {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    /// Picture, tiling and filter of each texture.
    known: Vec<(usize, [Wrap; 2], bool)>,
    extensions: BTreeSet<&'static str>,
}

impl Writer {
    /// Appends `bytes`, aligned to four, and answers with the index of their view.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, kind: &str, component: u32, target: u32) -> usize {
        let view = self.view(bytes, Some(target));
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, values.len(), kind, 5126, 34962)
    }

    /// Index of the written mesh; `None` if it has no triangles, which glTF cannot say.
    fn mesh(&mut self, mesh: &Mesh) -> Option<usize> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let positions = self.floats(&mesh.positions, "VEC3");
        let bound = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
            let first = mesh.positions[0];
            mesh.positions.iter().fold(first, |m, p| std::array::from_fn(|c| pick(m[c], p[c])))
        };
        self.accessors[positions]["min"] = json!(bound(f32::min));
        self.accessors[positions]["max"] = json!(bound(f32::max));
        let mut attributes = json!({ "POSITION": positions });
        if let Some(normals) = &mesh.normals {
            attributes["NORMAL"] = json!(self.floats(normals, "VEC3"));
        }
        if let Some(tangents) = &mesh.tangents {
            attributes["TANGENT"] = json!(self.floats(tangents, "VEC4"));
        }
        for (key, texcoords) in [("TEXCOORD_0", &mesh.texcoords), ("TEXCOORD_1", &mesh.second_texcoords)] {
            if let Some(texcoords) = texcoords {
                attributes[key] = json!(self.floats(texcoords, "VEC2"));
            }
        }
        let bytes: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.accessor(&bytes, mesh.triangles.len() * 3, "SCALAR", 5125, 34963);
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": mesh.material });
        self.meshes.push(json!({ "name": mesh.name, "primitives": [primitive] }));
        Some(self.meshes.len() - 1)
    }

    fn material(&mut self, material: &Material) -> Value {
        let mut out = json!({ "name": material.name });
        let mut extensions = Map::new();
        self.surface(material, &mut out, &mut extensions);
        self.emission(material, &mut out, &mut extensions);
        if material.two_sided {
            out["doubleSided"] = json!(true);
        }
        match material.opacity {
            Opacity::Opaque => {}
            Opacity::Mask { cutoff } => {
                out["alphaMode"] = json!("MASK");
                out["alphaCutoff"] = json!(cutoff);
            }
            Opacity::Blend => out["alphaMode"] = json!("BLEND"),
        }
        if let Some(transmission) = &material.transmission {
            self.transmission(transmission, &mut extensions);
        }
        if let Some(NormalMap { texture, scale }) = &material.normal_map {
            out["normalTexture"] = self.texture(texture);
            if *scale != 1.0 {
                out["normalTexture"]["scale"] = json!(scale);
            }
        }
        const WRITTEN: [&str; 5] = [
            "KHR_materials_emissive_strength",
            "KHR_materials_ior",
            "KHR_materials_specular",
            "KHR_materials_transmission",
            "KHR_materials_volume",
        ];
        self.extensions.extend(WRITTEN.into_iter().filter(|name| extensions.contains_key(*name)));
        if !extensions.is_empty() {
            out["extensions"] = Value::Object(extensions);
        }
        out
    }

    /// Adds a node for each light without area; answers with the lists of lights and of profiles.
    fn lights(&mut self, scene: &Scene, nodes: &mut Vec<Value>) -> (Vec<Value>, Vec<Value>) {
        let (mut lights, mut profiles) = (Vec::new(), Vec::new());
        let mut known: Vec<&Arc<LightProfile>> = Vec::new();
        for light in &scene.lights {
            // Colours are limited to 1; what is brighter goes into the intensity.
            let strength = light.intensity.max_channel();
            let color = if strength > 0.0 { light.intensity / strength } else { Rgb::WHITE };
            let color = color.map(|c| c.clamp(0.0, 1.0)).to_array();
            let mut node = json!({ "name": light.name });
            set_transform(&mut node, &light.transform);
            if let Some(profile) = &light.profile {
                let index = known.iter().position(|p| Arc::ptr_eq(p, profile)).unwrap_or_else(|| {
                    let view = self.view(&write_ies(profile), None);
                    known.push(profile);
                    profiles.push(json!({
                        "name": profile.name, "mimeType": "application/x-ies-lm-63", "bufferView": view,
                    }));
                    known.len() - 1
                });
                node["extensions"]["EXT_lights_ies"] =
                    json!({ "light": index, "multiplier": strength, "color": color });
            } else {
                let mut out = json!({ "name": light.name, "color": color, "intensity": strength });
                out["type"] = match light.kind {
                    LightKind::Point => json!("point"),
                    LightKind::Directional => json!("directional"),
                    LightKind::Spot { inner, outer } => {
                        out["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
                        json!("spot")
                    }
                };
                node["extensions"]["KHR_lights_punctual"] = json!({ "light": lights.len() });
                lights.push(out);
            }
            nodes.push(node);
        }
        (lights, profiles)
    }

    fn surface(&mut self, material: &Material, out: &mut Value, extensions: &mut Map<String, Value>) {
        match &material.surface {
            Surface::Lambertian { reflectance } => {
                // Without a lobe, roughness is that of what passes, which a Lambertian surface does not blur.
                let roughness = if material.transmission.is_some() { 0.0 } else { 1.0 };
                out["pbrMetallicRoughness"] = self.pbr(reflectance, 0.0, roughness);
                extensions.insert("KHR_materials_specular".into(), json!({ "specularFactor": 0.0 }));
            }
            Surface::MetallicRoughness {
                base_color,
                metallic,
                roughness,
                metallic_roughness_texture,
                specular,
                specular_texture,
                specular_color,
                specular_color_texture,
                ior,
            } => {
                let mut pbr = self.pbr(base_color, *metallic, *roughness);
                if let Some(texture) = metallic_roughness_texture {
                    pbr["metallicRoughnessTexture"] = self.texture(texture);
                }
                out["pbrMetallicRoughness"] = pbr;
                let textures =
                    [("specularTexture", specular_texture), ("specularColorTexture", specular_color_texture)];
                if (*specular, *specular_color) != (1.0, Rgb::WHITE) || textures.iter().any(|t| t.1.is_some()) {
                    let color = specular_color.to_array();
                    let mut value = json!({ "specularFactor": specular, "specularColorFactor": color });
                    for (key, texture) in textures {
                        if let Some(texture) = texture {
                            value[key] = self.texture(texture);
                        }
                    }
                    extensions.insert("KHR_materials_specular".into(), value);
                }
                if *ior != 1.5 {
                    extensions.insert("KHR_materials_ior".into(), json!({ "ior": ior }));
                }
            }
            Surface::Phong { diffuse, specular, exponent } => {
                out["pbrMetallicRoughness"] = self.pbr(diffuse, 0.0, phong_roughness(*exponent));
                let color = (*specular / PHONG_F0).to_array();
                extensions.insert("KHR_materials_specular".into(), json!({ "specularColorFactor": color }));
                let original = json!({ "specular": specular.to_array(), "exponent": exponent });
                out["extras"] = json!({ "twinray_phong": original });
            }
        }
    }

    fn transmission(&mut self, transmission: &Transmission, extensions: &mut Map<String, Value>) {
        let mut value = json!({ "transmissionFactor": transmission.factor });
        if let Some(texture) = &transmission.texture {
            value["transmissionTexture"] = self.texture(texture);
        }
        extensions.insert("KHR_materials_transmission".into(), value);
        let Some(Volume { attenuation }) = transmission.volume else { return };
        // Any thickness above 0 says that there is an inside.
        let mut value = json!({ "thicknessFactor": 1.0 });
        let most = attenuation.max_channel();
        if most > 1e-100 {
            // At this distance no channel is below 1/e, where a logarithm would lose digits.
            value["attenuationDistance"] = json!(1.0 / most);
            value["attenuationColor"] = json!((attenuation / most).map(|c| (-c).exp()).to_array());
        }
        extensions.insert("KHR_materials_volume".into(), value);
    }

    fn pbr(&mut self, Texel { factor, alpha, texture }: &Texel, metallic: f64, roughness: f64) -> Value {
        let color = [factor.r, factor.g, factor.b, *alpha];
        let mut pbr = json!({ "baseColorFactor": color, "metallicFactor": metallic, "roughnessFactor": roughness });
        if let Some(texture) = texture {
            pbr["baseColorTexture"] = self.texture(texture);
        }
        pbr
    }

    /// Factors are limited to 1; what is brighter goes into the strength.
    fn emission(&mut self, material: &Material, out: &mut Value, extensions: &mut Map<String, Value>) {
        if material.emission.is_black() {
            return;
        }
        let strength = material.emission.max_channel().max(1.0);
        // Divided by itself the brightest channel is 1 exactly; rounding must not push another one above it.
        out["emissiveFactor"] = json!((material.emission / strength).map(|c| c.clamp(0.0, 1.0)).to_array());
        if strength > 1.0 {
            extensions.insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": strength }));
        }
        if let Some(texture) = &material.emission_texture {
            out["emissiveTexture"] = self.texture(texture);
        }
    }

    /// A slot's object.
    fn texture(&mut self, texture: &TextureRef) -> Value {
        let mut slot = json!({ "index": self.sampled(texture) });
        if texture.set != 0 {
            slot["texCoord"] = json!(texture.set);
        }
        let TextureTransform { offset, rotation, scale } = texture.transform;
        if texture.transform != TextureTransform::default() {
            let transform = json!({ "offset": offset, "rotation": rotation, "scale": scale });
            slot["extensions"] = json!({ "KHR_texture_transform": transform });
            self.extensions.insert("KHR_texture_transform");
        }
        slot
    }

    /// Index of the picture with its sampler, which slots may share.
    fn sampled(&mut self, texture: &TextureRef) -> usize {
        let key = (texture.image, texture.wrap, texture.nearest);
        if let Some(known) = self.known.iter().position(|k| *k == key) {
            return known;
        }
        let wrap = texture.wrap.map(|w| match w {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        });
        let filter = if texture.nearest { 9728 } else { 9729 };
        self.samplers.push(json!({ "wrapS": wrap[0], "wrapT": wrap[1], "magFilter": filter }));
        self.textures.push(json!({ "source": texture.image, "sampler": self.samplers.len() - 1 }));
        self.known.push(key);
        self.textures.len() - 1
    }
}

/// The perceptual roughness of about the width of a Phong lobe: α = √(2/(n + 2)), and α = roughness².
pub(super) fn phong_roughness(exponent: f64) -> f64 {
    (2.0 / (exponent + 2.0)).powf(0.25)
}

/// Reflectance of glTF's lobe at normal incidence, which its colour multiplies.
pub(super) const PHONG_F0: f64 = 0.04;

fn set_transform(node: &mut Value, transform: &DAffine3) {
    if transform.matrix3 != DMat3::IDENTITY {
        node["matrix"] = json!(glam::DMat4::from(*transform).to_cols_array());
    } else if transform.translation != glam::DVec3::ZERO {
        node["translation"] = json!(transform.translation.to_array());
    }
}

/// glTF knows neither panoramas nor fisheyes nor lenses: the first two become a wide view of what they look at.
fn camera(camera: &Camera) -> Value {
    const WIDE: f64 = std::f64::consts::FRAC_PI_2;
    // Clipping planes mean nothing to light; others want them.
    match camera.projection {
        Projection::Panorama | Projection::Fisheye { .. } => {
            json!({ "name": camera.name, "type": "perspective", "perspective": { "yfov": WIDE, "znear": 0.01 } })
        }
        Projection::Perspective { vertical_fov } => {
            let mut perspective = json!({ "yfov": vertical_fov, "znear": 0.01 });
            if let Some(aspect) = camera.aspect {
                perspective["aspectRatio"] = json!(aspect);
            }
            json!({ "name": camera.name, "type": "perspective", "perspective": perspective })
        }
        Projection::Orthographic { half_height } => {
            let xmag = half_height * camera.aspect.unwrap_or(1.0);
            let orthographic = json!({ "xmag": xmag, "ymag": half_height, "znear": 0.0, "zfar": 1e4 });
            json!({ "name": camera.name, "type": "orthographic", "orthographic": orthographic })
        }
    }
}

/// What glTF has no element for.
fn extras(scene: &Scene) -> Option<Value> {
    let mut extras = Map::new();
    if let Some(Environment::Uniform(radiance)) = &scene.environment {
        extras.insert("environment".into(), json!(radiance.to_array()));
    }
    if let Some(patches) = scene.suggested_patches {
        extras.insert("suggested_patches".into(), json!(patches));
    }
    (!extras.is_empty()).then(|| json!({ "twinray": extras }))
}
