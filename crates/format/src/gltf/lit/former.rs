//! What an earlier bake left in a document: it goes before the document is baked again, or every bake would add its pictures to
//! those of all before.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Map, Value};

use super::super::json::index;
use super::materials::walk_materials;
use super::references::has_others;

const LIGHTMAPS: [&str; 2] = ["MOZ_lightmap", "TWINRAY_lightmap"];

/// Takes light that an earlier bake put there out of `document`: lightmaps and light at vertices. Materials that are the same
/// without it become one; materials, textures and pictures at the ends of their lists that nothing refers to any more leave.
/// Coordinates stay, and with them the places of charts.
pub(super) fn forget(document: &mut Value) {
    if document["asset"]["extras"]["twinray_bake"].is_null() {
        return;
    }
    for material in list(document, "materials") {
        LIGHTMAPS.iter().for_each(|l| remove(material, "extensions", l));
        remove(material, "extras", "twinray_lightmap");
    }
    if let Some(used) = document.get_mut("extensionsUsed").and_then(Value::as_array_mut) {
        used.retain(|e| !LIGHTMAPS.iter().any(|l| e == l));
    }
    for mesh in list(document, "meshes") {
        remove(mesh, "extras", "twinray_irradiance_scale");
        for primitive in list(mesh, "primitives") {
            primitive.get_mut("attributes").and_then(Value::as_object_mut).map(without_light);
        }
    }
    unite_materials(document);
    // Extensions that nobody here knows may refer to anything.
    if has_others(document) {
        return;
    }
    let textures = numbers(document, &["textures", "images"], "index");
    shorten(document, "textures", &textures);
    let mut images = numbers(document, &["textures", "images"], "image");
    images.extend(numbers(&document["textures"], &[], "source"));
    shorten(document, "images", &images);
}

fn list<'a>(owner: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
    owner.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
}

/// Removes `owner[group][key]`, and a group that is empty then.
fn remove(owner: &mut Value, group: &str, key: &str) {
    let Some(members) = owner.get_mut(group).and_then(Value::as_object_mut) else { return };
    if members.remove(key).is_some()
        && members.is_empty()
        && let Some(owner) = owner.as_object_mut()
    {
        owner.remove(group);
    }
}

/// The light's colours were put before the author's.
fn without_light(attributes: &mut Map<String, Value>) {
    if attributes.remove("_IRRADIANCE").is_none() {
        return;
    }
    attributes.remove("COLOR_0");
    for k in 1.. {
        let Some(colours) = attributes.remove(&format!("COLOR_{k}")) else { break };
        attributes.insert(format!("COLOR_{}", k - 1), colours);
    }
}

fn unite_materials(document: &mut Value) {
    let mut known = BTreeMap::new();
    let first: Vec<usize> = (document["materials"].as_array().into_iter().flatten().enumerate())
        .map(|(k, material)| *known.entry(material.to_string()).or_insert(k))
        .collect();
    let mut used = BTreeSet::new();
    for mesh in list(document, "meshes") {
        for primitive in list(mesh, "primitives") {
            walk_materials(primitive, &mut |material| {
                let Some(number) = material.as_ref().and_then(index) else { return };
                let number = first.get(number).copied().unwrap_or(number);
                used.insert(number);
                *material = Some(number.into());
            });
        }
    }
    shorten(document, "materials", &used);
}

/// Leaves out what follows the last of a list that is used.
fn shorten(document: &mut Value, key: &str, used: &BTreeSet<usize>) {
    let Some(members) = document.as_object_mut() else { return };
    let Some(items) = members.get_mut(key).and_then(Value::as_array_mut) else { return };
    items.truncate(used.last().map_or(0, |last| last + 1));
    if items.is_empty() {
        members.remove(key);
    }
}

/// All numbers that stand anywhere under `key`, but for some parts of the document.
fn numbers(value: &Value, without: &[&str], key: &str) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    match value {
        Value::Object(members) => {
            for (name, member) in members.iter().filter(|(name, _)| !without.contains(&name.as_str())) {
                if name == key {
                    found.extend(index(member));
                }
                found.extend(numbers(member, &[], key));
            }
        }
        Value::Array(items) => items.iter().for_each(|item| found.extend(numbers(item, &[], key))),
        _ => {}
    }
    found
}
