//! Materials that show baked light: a copy for each page that a material's surfaces lie on.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value, json};

use super::super::json::{index, object};
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
        let found = index.and_then(|i| materials.get(i)).filter(|m| m.is_object());
        found.cloned().unwrap_or_else(|| json!({}))
    }

    /// True if textures of a primitive's materials lie on the second set of coordinates.
    pub fn uses_second_set(&self, primitive: &Value) -> bool {
        let mut primitive = primitive.clone();
        let mut found = false;
        walk_materials(&mut primitive, &mut |material| {
            found |= self.is_on_second_set(material.as_ref().and_then(index))
        });
        found
    }

    fn is_on_second_set(&self, material: Option<usize>) -> bool {
        let mut found = false;
        walk_sets(&mut self.material(material), &mut |set| found |= index(set) == Some(1));
        found
    }

    /// Gives a primitive that stands for `surface` its materials, those of its variants too. The old second set of
    /// coordinates now has the number `second`.
    pub fn assign(&mut self, primitive: &mut Value, surface: &LitSurface, second: u64) {
        walk_materials(primitive, &mut |material| {
            let original = material.as_ref().and_then(index);
            if let Some(copy) = self.of(original, surface, second) {
                *material = Some(json!(copy));
            }
        });
    }

    /// The copy of a material that a surface needs; `None` if it needs none.
    fn of(&mut self, original: Option<usize>, surface: &LitSurface, second: u64) -> Option<usize> {
        let moved = (second > 1 && self.is_on_second_set(original)).then_some(second);
        let one_sided = surface.one_sided && self.material(original)["doubleSided"] == json!(true);
        let page = surface.page.filter(|&p| p < self.lit.pages.len());
        let key = (original, page, one_sided, moved);
        if key == (original, None, false, None) {
            return None;
        }
        let first = self.original["materials"].as_array().map_or(0, Vec::len);
        let added = &mut self.added;
        Some(*self.known.entry(key).or_insert_with(|| {
            added.push(key);
            first + added.len() - 1
        }))
    }

    /// Adds the copies and their pictures to the document; answers with the extensions that they use.
    pub fn finish(self, document: &mut Value, geometry: &mut Geometry<'_, '_>) -> BTreeSet<&'static str> {
        let mut extensions = BTreeSet::new();
        let mut pictures = Pictures { document, geometry };
        let pages: Vec<Shown> = self.lit.pages.iter().map(|page| Shown::new(&page.material, &mut pictures)).collect();
        let mut copies = Vec::new();
        for &(original, page, one_sided, moved) in &self.added {
            let mut material = self.material(original);
            if let Some(number) = moved {
                walk_sets(&mut material, &mut |set| {
                    if index(set) == Some(1) {
                        *set = json!(number);
                    }
                });
            }
            if one_sided {
                material["doubleSided"] = json!(false);
            }
            if let Some(page) = page.and_then(|p| pages.get(p)) {
                page.put(&mut material, &mut extensions);
            }
            copies.push(material);
        }
        if !copies.is_empty() {
            let mut list = document["materials"].as_array().cloned().unwrap_or_default();
            list.extend(copies);
            document["materials"] = Value::Array(list);
        }
        extensions
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
                let moz = json!({ "index": texture, "texCoord": 1, "intensity": intensity });
                let ours = json!({ "image": image, "texCoord": 1, "quantity": "irradiance", "scale": scale });
                put(material, "extensions", "MOZ_lightmap", moz);
                put(material, "extensions", "TWINRAY_lightmap", ours);
                extensions.extend(["MOZ_lightmap", "TWINRAY_lightmap"]);
            }
            Self::Beside(value) => put(material, "extras", "twinray_lightmap", value.clone()),
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

/// Sets `owner[group][key]`. What is there instead of a group is kept within it.
fn put(owner: &mut Value, group: &str, key: &str, value: Value) {
    if let Some(other) = owner.get_mut(group).filter(|g| !g.is_object() && !g.is_null()) {
        *other = json!({ "value": other });
    }
    if let Some(group) = object(owner, group) {
        group.insert(key.to_owned(), value);
    }
}

/// Calls `each` with the number of a primitive's material, then with those of its variants (`KHR_materials_variants`).
pub(super) fn walk_materials(primitive: &mut Value, each: &mut dyn FnMut(&mut Option<Value>)) {
    fn visit(owner: &mut Value, each: &mut dyn FnMut(&mut Option<Value>)) {
        let Some(owner) = owner.as_object_mut() else { return };
        let mut material = owner.remove("material");
        each(&mut material);
        owner.extend(material.map(|m| ("material".to_owned(), m)));
    }
    visit(primitive, each);
    let mappings = primitive.pointer_mut("/extensions/KHR_materials_variants/mappings").and_then(Value::as_array_mut);
    mappings.into_iter().flatten().for_each(|m| visit(m, each));
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
