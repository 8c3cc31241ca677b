//! All binary data of a document in one chunk: what is referred to, in the old order, then what is new.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use super::super::container::Buffers;
use super::super::json::{Element, index};
use super::super::write::container;
use super::geometry::Geometry;
use super::references::{accessors_of, has_others, is_fresh, walk_accessors, walk_views};
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
    embed_pictures(context, root, &mut document, &mut geometry);
    // Extensions that nobody here knows may refer to anything: then all that was there stays, under its number.
    let keeps_all = has_others(root.value());
    accessors(&mut document, std::mem::take(&mut geometry.accessors), keeps_all);
    let binary = views(root, buffers, &mut document, geometry, keeps_all)?;
    let buffer = (!binary.is_empty()).then(|| json!({ "byteLength": binary.len() }));
    set(&mut document, "buffers", buffer.into_iter().collect());
    let text = document.to_string().into_bytes();
    // Both chunks, their headers, and what fills them up.
    if (text.len() as u64).saturating_add(binary.len() as u64) > u64::from(u32::MAX) - 64 {
        let hint = "Bake less of the scene into one file";
        return Err(FormatError::unsupported(context.file, "file", "a .glb file beyond 4 GiB", hint));
    }
    Ok(container(text, binary))
}

/// An array of the document; glTF has none that are empty.
fn set(document: &mut Value, key: &str, list: Vec<Value>) {
    let Some(document) = document.as_object_mut() else { return };
    match list.is_empty() {
        true => drop(document.remove(key)),
        false => drop(document.insert(key.to_owned(), Value::Array(list))),
    }
}

/// Pictures in files of their own become views; those that are not to be had keep their references.
fn embed_pictures(
    context: &mut Context<'_>,
    root: &Element<'_>,
    document: &mut Value,
    geometry: &mut Geometry<'_, '_>,
) {
    for (k, out) in document.get_mut("images").and_then(Value::as_array_mut).into_iter().flatten().enumerate() {
        let (Some(image), Some(out)) = (root.item("images", k), out.as_object_mut()) else { continue };
        let Some(uri) = out.get("uri").and_then(Value::as_str).map(str::to_owned) else { continue };
        match picture(context, &image, &uri) {
            Ok((bytes, mime, name)) => {
                out.remove("uri");
                if let Some(name) = name {
                    out.entry("name").or_insert_with(|| json!(name));
                }
                out.insert("mimeType".into(), json!(mime));
                out.insert("bufferView".into(), geometry.view(json!({}), bytes));
            }
            Err(reason) => context.warn(&image.path, format!("{reason}: the reference stays")),
        }
    }
}

/// The bytes of a picture, what they are, and the name of their file.
fn picture(
    context: &mut Context<'_>,
    image: &Element<'_>,
    uri: &str,
) -> Result<(Vec<u8>, &'static str, Option<String>), String> {
    let (bytes, name) = match data_uri(uri) {
        Some(embedded) => (embedded?, None),
        None => {
            let name = percent_decode(uri);
            (context.fetch(&image.path, &name).map_err(|error| error.without_place())?.to_vec(), Some(name))
        }
    };
    let mime = match bytes.get(..12) {
        Some([0x89, b'P', b'N', b'G', ..]) => "image/png",
        Some([0xFF, 0xD8, ..]) => "image/jpeg",
        Some([b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P']) => "image/webp",
        Some([0xAB, b'K', b'T', b'X', ..]) => "image/ktx2",
        _ => return Err("no PNG, JPEG, WebP or KTX2 picture".to_owned()),
    };
    Ok((bytes, mime, name))
}

/// Old accessors that are referred to, or all, then new ones.
fn accessors(document: &mut Value, new: Vec<Value>, keeps_all: bool) {
    let old = document["accessors"].as_array().cloned().unwrap_or_default();
    let used = accessors_of(document);
    let (mut list, mut number) = (Vec::new(), BTreeMap::new());
    for (k, accessor) in old.into_iter().enumerate().filter(|(k, _)| keeps_all || used.contains(k)) {
        number.insert(k, list.len());
        list.push(accessor);
    }
    let first = list.len();
    list.extend(new);
    walk_accessors(document, &mut |value| renumber(value, first, &number));
    set(document, "accessors", list);
}

/// Views that are referred to, or all, old ones first, and their bytes.
fn views(
    root: &Element<'_>,
    buffers: &Buffers<'_>,
    document: &mut Value,
    geometry: Geometry<'_, '_>,
    keeps_all: bool,
) -> Result<Vec<u8>, FormatError> {
    let mut used = BTreeSet::new();
    walk_views(document, &mut |value| used.extend(index(value)));
    if keeps_all {
        used.extend(0..root.count("bufferViews"));
    }
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
        let (Some(found), Some(view)) = (found, root.item("bufferViews", k)) else { continue };
        let mut view = view.value().clone();
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
    walk_views(document, &mut |value| renumber(value, first, &number));
    set(document, "bufferViews", list);
    // Chunks end at multiples of four bytes.
    binary.resize(binary.len().next_multiple_of(4), 0);
    Ok(binary)
}

/// The new number of something new, which follow those of `first` old ones, or of something old.
fn renumber(value: &mut Value, first: usize, number: &BTreeMap<usize, usize>) {
    let new = is_fresh(value).map(|k| first + k);
    if let Some(place) = new.or_else(|| number.get(&index(value)?).copied()) {
        *value = json!(place);
    }
}
