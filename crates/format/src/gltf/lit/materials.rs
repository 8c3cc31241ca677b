//! Materials that show baked light: a copy for each page that a material's surfaces lie on.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value, json};

use super::geometry::Geometry;
use super::{Lit, LitMaterial, LitPicture, LitSurface};

/// What tells copies of materials apart: original, page, one-sided, number of the old second set of texture coordinates.
type Key = (Option<usize>, Option<usize>, bool, Option<u64>);

/// Copies of the document's materials as they are asked for.
pub(super) struct Materials<'a> {
    original: &'a Value,
    lit: &'a Lit,
    known: BTreeMap<Key, usize>,
    added: Vec<Key>,
}

impl<'a> Materials<'a> {
    pub fn new(original: &'a Value, lit: &'a Lit) -> Self {
        Self { original, lit, known: BTreeMap::new(), added: Vec::new() }
    }

    fn material(&self, index: Option<usize>) -> Value {
        let materials = &self.original["materials"];
        index.and_then(|i| materials.get(i)).cloned().unwrap_or_else(|| json!({}))
    }

    /// True if textures of a material lie on the second set of coordinates.
    pub fn uses_second_set(&self, material: Option<usize>) -> bool {
        let mut found = false;
        walk_sets(&mut self.material(material), &mut |set| found |= set.as_u64() == Some(1));
        found
    }

    /// The material of a surface, whose old second set of coordinates is now number `moved_to`.
    pub fn of(&mut self, original: Option<usize>, surface: &LitSurface, moved_to: u64) -> Option<usize> {
        let moves = self.uses_second_set(original) && surface.vertices.iter().all(|v| v.texcoord.is_some());
        let one_sided = surface.one_sided && self.material(original)["doubleSided"] == json!(true);
        let key = (original, surface.page, one_sided, moves.then_some(moved_to));
        if key == (original, None, false, None) {
            return original;
        }
        let first = self.original["materials"].as_array().map_or(0, Vec::len);
        let index = *self.known.entry(key).or_insert_with(|| {
            self.added.push(key);
            first + self.added.len() - 1
        });
        Some(index)
    }

    /// Adds the copies and their pictures to the document.
    pub fn finish(
        self,
        document: &mut Value,
        geometry: &mut Geometry<'_, '_>,
        extensions: &mut BTreeSet<&'static str>,
    ) {
        let mut pictures = Pictures { document, geometry };
        let pages: Vec<Shown> = self.lit.pages.iter().map(|page| Shown::new(&page.material, &mut pictures)).collect();
        let mut copies = Vec::new();
        for &(original, page, one_sided, moved) in &self.added {
            let mut material = self.material(original);
            if let Some(number) = moved {
                walk_sets(&mut material, &mut |set| {
                    if set.as_u64() == Some(1) {
                        *set = json!(number);
                    }
                });
            }
            if one_sided {
                material["doubleSided"] = json!(false);
            }
            if let Some(page) = page.and_then(|p| pages.get(p)) {
                page.put(&mut material, extensions);
            }
            copies.push(material);
        }
        if !copies.is_empty() {
            let mut list = document["materials"].as_array().cloned().unwrap_or_default();
            list.extend(copies);
            document["materials"] = Value::Array(list);
        }
    }
}

/// The document's pictures as they grow.
struct Pictures<'d, 'g, 'v, 'b> {
    document: &'d mut Value,
    geometry: &'g mut Geometry<'v, 'b>,
}

impl Pictures<'_, '_, '_, '_> {
    fn push(&mut self, key: &str, value: Value) -> usize {
        if !self.document[key].is_array() {
            self.document[key] = json!([]);
        }
        let Some(list) = self.document[key].as_array_mut() else { return 0 };
        list.push(value);
        list.len() - 1
    }

    fn image(&mut self, picture: &LitPicture) -> usize {
        let view = self.geometry.view(json!({}), picture.bytes.clone());
        self.push("images", json!({ "name": picture.name, "mimeType": picture.mime, "bufferView": view }))
    }

    /// A texture of a picture, bilinear, without mip maps, which would mix charts.
    fn texture(&mut self, picture: &LitPicture) -> usize {
        let source = self.image(picture);
        let sampler = json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 });
        let known = self.document["samplers"].as_array().and_then(|s| s.iter().position(|s| *s == sampler));
        let sampler = known.unwrap_or_else(|| self.push("samplers", sampler));
        self.push("textures", json!({ "name": picture.name, "sampler": sampler, "source": source }))
    }
}

/// A page whose pictures are in the document.
enum Shown {
    Lightmap { image: usize, scale: f32, texture: usize, intensity: f32 },
    Beside(Value),
    Unlit { texture: usize },
}

impl Shown {
    fn new(material: &LitMaterial, pictures: &mut Pictures<'_, '_, '_, '_>) -> Self {
        match material {
            LitMaterial::Lightmap { hdr, scale, ldr, intensity } => Self::Lightmap {
                image: pictures.image(hdr),
                scale: *scale,
                texture: pictures.texture(ldr),
                intensity: *intensity,
            },
            LitMaterial::Beside(value) => Self::Beside(value.clone()),
            LitMaterial::Unlit(picture) => Self::Unlit { texture: pictures.texture(picture) },
        }
    }

    fn put(&self, material: &mut Value, extensions: &mut BTreeSet<&'static str>) {
        match self {
            Self::Lightmap { image, scale, texture, intensity } => {
                material["extensions"]["MOZ_lightmap"] =
                    json!({ "index": texture, "texCoord": 1, "intensity": intensity });
                material["extensions"]["TWINRAY_lightmap"] =
                    json!({ "image": image, "texCoord": 1, "quantity": "irradiance", "scale": scale });
                extensions.extend(["MOZ_lightmap", "TWINRAY_lightmap"]);
            }
            Self::Beside(value) => material["extras"]["twinray_lightmap"] = value.clone(),
            Self::Unlit { texture } => {
                let mut unlit = Map::new();
                for key in ["name", "extras", "alphaMode", "alphaCutoff", "doubleSided"] {
                    if let Some(value) = material.get(key) {
                        unlit.insert(key.to_owned(), value.clone());
                    }
                }
                // What shines through by chance has its share in the picture's alpha.
                *material = Value::Object(unlit);
                material["pbrMetallicRoughness"] = json!({
                    "baseColorTexture": { "index": texture, "texCoord": 1 },
                    "metallicFactor": 0.0, "roughnessFactor": 1.0,
                });
                material["extensions"] = json!({ "KHR_materials_unlit": {} });
                extensions.insert("KHR_materials_unlit");
            }
        }
    }
}

/// Calls `each` with the set of coordinates of every texture of a material.
fn walk_sets(value: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    match value {
        Value::Object(members) => {
            if members.contains_key("index") {
                // KHR_texture_transform has the last word where it is there.
                if let Some(set) = members.get_mut("texCoord") {
                    each(set);
                }
                let transform = members.get_mut("extensions").and_then(|e| e.get_mut("KHR_texture_transform"));
                if let Some(set) = transform.and_then(|t| t.get_mut("texCoord")) {
                    each(set);
                }
                return;
            }
            members.values_mut().for_each(|v| walk_sets(v, each));
        }
        Value::Array(items) => items.iter_mut().for_each(|v| walk_sets(v, each)),
        _ => {}
    }
}
