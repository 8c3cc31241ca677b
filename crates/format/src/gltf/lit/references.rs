//! Where a document refers to accessors and to views, and marks for those that have no number yet.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::super::json::index;

/// Marks indices of new things until `tidy` knows their numbers.
pub(super) fn fresh(index: usize) -> Value {
    json!({ "twinray_new": index })
}

/// The index behind such a mark.
pub(super) fn is_fresh(value: &Value) -> Option<usize> {
    index(value.get("twinray_new")?)
}

/// Numbers of the accessors that primitives, skins, animations and instancing refer to.
pub(super) fn accessors_of(document: &mut Value) -> BTreeSet<usize> {
    let mut used = BTreeSet::new();
    walk_accessors(document, &mut |value| used.extend(index(value)));
    used
}

/// Calls `each` with every place that refers to an accessor.
pub(super) fn walk_accessors(document: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    fn list<'a>(value: &'a mut Value, key: &str) -> impl Iterator<Item = &'a mut Value> {
        value.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten()
    }
    fn members(value: Option<&mut Value>) -> impl Iterator<Item = &mut Value> {
        value.and_then(Value::as_object_mut).into_iter().flat_map(|o| o.values_mut())
    }
    for mesh in list(document, "meshes") {
        for primitive in list(mesh, "primitives") {
            members(primitive.get_mut("attributes")).for_each(&mut *each);
            primitive.get_mut("indices").into_iter().for_each(&mut *each);
            list(primitive, "targets").for_each(|t| members(Some(t)).for_each(&mut *each));
        }
    }
    for skin in list(document, "skins") {
        skin.get_mut("inverseBindMatrices").into_iter().for_each(&mut *each);
    }
    for animation in list(document, "animations") {
        for sampler in list(animation, "samplers") {
            sampler.get_mut("input").into_iter().for_each(&mut *each);
            sampler.get_mut("output").into_iter().for_each(&mut *each);
        }
    }
    for node in list(document, "nodes") {
        let instancing = node.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes");
        members(instancing).for_each(&mut *each);
    }
}

/// Calls `each` with every place that refers to a view, whatever it belongs to.
pub(super) fn walk_views(value: &mut Value, each: &mut dyn FnMut(&mut Value)) {
    match value {
        Value::Object(members) => {
            for (key, member) in members.iter_mut() {
                if key == "bufferView" {
                    each(member);
                } else if key != "extras" {
                    walk_views(member, each);
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|v| walk_views(v, each)),
        _ => {}
    }
}

/// True if the document uses an extension that may refer to accessors and views in ways of its own.
pub(super) fn has_others(document: &Value) -> bool {
    const KNOWN: [&str; 8] = [
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "KHR_animation_pointer",
        "KHR_draco_mesh_compression",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_node_visibility",
        "MOZ_lightmap",
    ];
    // What materials, textures, lights and metadata say is theirs: numbers, textures, or a `bufferView`.
    const HARMLESS: [&str; 5] = ["_materials_", "_texture_", "_lights_", "_xmp", "TWINRAY_"];
    let names = document["extensionsUsed"].as_array().into_iter().flatten().filter_map(Value::as_str);
    names.into_iter().any(|name| !KNOWN.contains(&name) && !HARMLESS.iter().any(|part| name.contains(part)))
}
