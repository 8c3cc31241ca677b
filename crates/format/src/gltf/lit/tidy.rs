//! All binary data of a document in one chunk: what is referred to, in the old order, then what is new.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::super::container::Buffers;
use super::super::json::Element;
use super::super::write::container;
use super::geometry::{Geometry, is_fresh, references, walk_references};
use crate::context::Context;
use crate::error::FormatError;
use crate::reference::{data_uri, percent_decode};

/// Puts the document and its data into one `.glb` file.
pub(super) fn finish(
    context: &mut Context<'_>,
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    mut document: Value,
    mut geometry: Geometry<'_, '_>,
) -> Result<Vec<u8>, FormatError> {
    colours(&mut document, &mut geometry);
    embed_pictures(context, root, &mut document, &mut geometry)?;
    accessors(&mut document, &mut geometry);
    let binary = views(root, buffers, &mut document, geometry)?;
    document["buffers"] = json!([{ "byteLength": binary.len() }]);
    if binary.is_empty()
        && let Some(document) = document.as_object_mut()
    {
        document.remove("buffers");
    }
    Ok(container(document.to_string().into_bytes(), binary))
}

/// Colours at vertices by the scale of their mesh.
fn colours(document: &mut Value, geometry: &mut Geometry<'_, '_>) {
    for mesh in document.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten() {
        let Some(scale) = mesh["extras"]["twinray_irradiance_scale"].as_f64() else { continue };
        if let Some(primitives) = mesh["primitives"].as_array_mut() {
            geometry.colours(primitives, scale as f32);
        }
    }
}

/// Pictures in files of their own become views.
fn embed_pictures(
    context: &mut Context<'_>,
    root: &Element<'_>,
    document: &mut Value,
    geometry: &mut Geometry<'_, '_>,
) -> Result<(), FormatError> {
    for (k, image) in root.items("images")?.enumerate() {
        let Some(uri) = image.text("uri")? else { continue };
        let bytes = match data_uri(uri) {
            Some(Ok(bytes)) => bytes,
            Some(Err(detail)) => return Err(image.fault(detail, "base64 data")),
            // A picture that is not there was a warning when the scene was read; the reference stays.
            None => match context.fetch(&image.path, &percent_decode(uri)) {
                Ok(bytes) => bytes.to_vec(),
                Err(_) => continue,
            },
        };
        let mime = match bytes.get(..12) {
            Some([0x89, b'P', b'N', b'G', ..]) => "image/png",
            Some([0xFF, 0xD8, ..]) => "image/jpeg",
            Some([b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P']) => "image/webp",
            Some([0xAB, b'K', b'T', b'X', ..]) => "image/ktx2",
            _ => continue,
        };
        let view = geometry.view(json!({}), bytes);
        let Some(out) = document["images"].get_mut(k).and_then(Value::as_object_mut) else { continue };
        out.remove("uri");
        out.insert("mimeType".into(), json!(mime));
        out.insert("bufferView".into(), view);
    }
    Ok(())
}

/// New accessors take the places of those that nothing refers to any more. What is left over keeps its number, since
/// extensions may refer to others, and loses its data.
fn accessors(document: &mut Value, geometry: &mut Geometry<'_, '_>) {
    let used = references(document);
    let mut list = document["accessors"].as_array().cloned().unwrap_or_default();
    let mut free: Vec<usize> = (0..list.len()).filter(|k| !used.contains_key(k)).rev().collect();
    let mut number = Vec::new();
    for accessor in geometry.accessors.drain(..) {
        match free.pop() {
            Some(k) => {
                list[k] = accessor;
                number.push(k);
            }
            None => {
                list.push(accessor);
                number.push(list.len() - 1);
            }
        }
    }
    while free.first().is_some_and(|&k| k + 1 == list.len()) {
        free.remove(0);
        list.pop();
    }
    for k in free {
        if let Some(accessor) = list[k].as_object_mut() {
            ["bufferView", "byteOffset", "sparse"].iter().for_each(|key| drop(accessor.remove(*key)));
        }
    }
    walk_references(document, &mut |value| {
        if let Some(index) = is_fresh(value) {
            *value = json!(number[index]);
        }
    });
    document["accessors"] = Value::Array(list);
    if document["accessors"].as_array().is_some_and(Vec::is_empty)
        && let Some(document) = document.as_object_mut()
    {
        document.remove("accessors");
    }
}

/// Views that are referred to, old ones first, and their bytes.
fn views(
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    document: &mut Value,
    geometry: Geometry<'_, '_>,
) -> Result<Vec<u8>, FormatError> {
    let mut used = BTreeSet::new();
    walk_views(document, &mut |value| {
        if let Some(index) = value.as_u64() {
            used.insert(index as usize);
        }
    });
    let (mut binary, mut list, mut number) = (Vec::new(), Vec::new(), BTreeMap::new());
    let mut add = |mut view: Value, bytes: &[u8]| {
        // Eight bytes suit every kind of component.
        binary.resize(binary.len().next_multiple_of(8), 0);
        view["buffer"] = json!(0);
        view["byteOffset"] = json!(binary.len());
        view["byteLength"] = json!(bytes.len());
        binary.extend(bytes);
        list.push(view);
        list.len() - 1
    };
    for &k in &used {
        let owner = json!({ "bufferView": k });
        let found = buffers.view(root, &Element::root(root.file(), &owner))?;
        let (Some(found), Some(view)) = (found, document["bufferViews"].get(k)) else { continue };
        let mut view = view.clone();
        // Bytes that were packed by an extension of the view stand here as its fallback has them.
        if let Some(view) = view.as_object_mut() {
            view.remove("extensions");
        }
        number.insert(k, add(view, found.bytes));
    }
    let first = number.len();
    for (view, bytes) in geometry.views {
        add(view, &bytes);
    }
    walk_views(document, &mut |value| {
        let place = match is_fresh(value) {
            Some(index) => Some(first + index),
            None => value.as_u64().and_then(|k| number.get(&(k as usize)).copied()),
        };
        if let Some(place) = place {
            *value = json!(place);
        }
    });
    document["bufferViews"] = Value::Array(list);
    if document["bufferViews"].as_array().is_some_and(Vec::is_empty)
        && let Some(document) = document.as_object_mut()
    {
        document.remove("bufferViews");
    }
    Ok(binary)
}

/// Calls `each` with every place that refers to a view, whatever it belongs to.
fn walk_views(value: &mut Value, each: &mut dyn FnMut(&mut Value)) {
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
