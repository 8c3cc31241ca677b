//! Small files built by hand, and what the tests ask of a scene.

use std::io;

use serde_json::{Value, json};
use twinray_format::{FormatError, Limits, Reading, read_scene};
use twinray_scene::{Scene, Surface, Texel};

/// A glTF document under construction: one scene, one node, one mesh, no primitives yet.
pub struct Doc {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl Doc {
    pub fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
            "nodes": [{ "name": "node", "mesh": 0 }], "meshes": [{ "name": "mesh", "primitives": [] }],
            "accessors": [], "bufferViews": [], "buffers": [{ "byteLength": 0 }],
        });
        Self { json, binary: Vec::new() }
    }

    /// A unit square in the plane z = 0 that faces +Z, of two triangles and material 0.
    pub fn square() -> Self {
        let mut doc = Self::new();
        let positions = doc.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        let texcoords = doc.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        let indices = doc.indices(&[0, 1, 2, 0, 2, 3]);
        doc.primitive(json!({
            "attributes": { "POSITION": positions, "TEXCOORD_0": texcoords }, "indices": indices, "material": 0,
        }));
        doc.json["materials"] =
            json!([{ "name": "paint", "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1.0] } }]);
        doc
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, kind: &str, component: u32) -> usize {
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() }));
        let view = views.len() - 1;
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        accessors.len() - 1
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, values.len(), ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1], 5126)
    }

    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, values.len(), "SCALAR", 5123)
    }

    pub fn bytes(&mut self, values: &[u8], kind: &str, components: usize, component: u32) -> usize {
        self.accessor(values, values.len() / components, kind, component)
    }

    pub fn primitive(&mut self, primitive: Value) {
        self.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }

    /// Embeds a picture as image and texture 0.
    pub fn texture(&mut self, png: &[u8]) {
        let at = self.binary.len();
        self.binary.extend(png);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = json!(self.binary.len());
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": at, "byteLength": png.len() }));
        let view = views.len() - 1;
        self.json["images"] = json!([{ "name": "picture", "mimeType": "image/png", "bufferView": view }]);
        self.json["textures"] = json!([{ "source": 0 }]);
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(self.json.to_string().as_bytes(), &self.binary)
    }

    pub fn read(&self) -> Result<Reading, FormatError> {
        read("test.glb", &self.glb())
    }

    pub fn scene(&self) -> Scene {
        self.read().unwrap().scene
    }

    /// The message of the error that reading gives.
    pub fn error(&self) -> String {
        self.read().expect_err("the file should be refused").to_string()
    }
}

/// The container of a binary glTF file.
pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    let word = |n: usize| (n as u32).to_le_bytes();
    out.extend(word(2));
    out.extend(word(28 + json.len() + binary.len()));
    out.extend(word(json.len()));
    out.extend(b"JSON");
    out.extend(json);
    out.extend(word(binary.len()));
    out.extend(b"BIN\0");
    out.extend(binary);
    out
}

/// Reads a file that refers to no other.
pub fn read(name: &str, bytes: &[u8]) -> Result<Reading, FormatError> {
    read_with(name, bytes, &[])
}

/// Reads a file beside which lie `files`.
pub fn read_with(name: &str, bytes: &[u8], files: &[(&str, &[u8])]) -> Result<Reading, FormatError> {
    let mut resolver = |path: &str| {
        let file = files.iter().find(|(name, _)| *name == path);
        file.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
    };
    read_scene(name, bytes, &mut resolver, &Limits::default())
}

/// All warnings, one a line.
pub fn warnings(reading: &Reading) -> String {
    reading.warnings.iter().map(|w| format!("{w}\n")).collect()
}

/// Asserts that some warning contains all of `parts`.
#[track_caller]
pub fn assert_warns(reading: &Reading, parts: &[&str]) {
    let found = reading.warnings.iter().any(|w| parts.iter().all(|p| w.to_string().contains(p)));
    assert!(found, "no warning with {parts:?} in:\n{}", warnings(reading));
}

/// Asserts that `message` contains all of `parts`.
#[track_caller]
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

/// Corners of all placed triangles in world space, front side counter-clockwise.
pub fn world_triangles(scene: &Scene) -> Vec<[glam::DVec3; 3]> {
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let mirrored = instance.transform.matrix3.determinant() < 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| {
                let p = glam::Vec3::from(mesh.positions[i as usize]).as_dvec3();
                instance.transform.transform_point3(p)
            });
            triangles.push(if mirrored { [a, c, b] } else { [a, b, c] });
        }
    }
    triangles
}

/// Twice the area vector of a triangle: its direction is the front side.
pub fn normal([a, b, c]: [glam::DVec3; 3]) -> glam::DVec3 {
    (b - a).cross(c - a)
}

/// The base colour or diffuse reflectance of a material.
pub fn colour(surface: &Surface) -> &Texel {
    match surface {
        Surface::Lambertian { reflectance } => reflectance,
        Surface::MetallicRoughness { base_color, .. } => base_color,
        Surface::Phong { diffuse, .. } => diffuse,
    }
}

/// A PNG file of one row.
pub fn png(rgb: &[[u8; 3]]) -> Vec<u8> {
    twinray_format::write_png(rgb.len() as u32, 1, rgb.as_flattened(), &[])
}
