//! The outer layer of glTF: the chunks of a `.glb` file, the buffers and the views into them.
//!
//! Not here: what the bytes mean (`accessor`). Every offset from the file is added with overflow in mind.

use std::cell::RefCell;
use std::collections::HashSet;
use std::rc::Rc;

use super::json::Element;
use crate::context::Context;
use crate::error::FormatError;
use crate::reference::{data_uri, percent_decode};

/// The JSON and the binary chunk of a file; plain `.gltf` text has no binary chunk.
pub(super) fn split<'b>(file: &str, bytes: &'b [u8]) -> Result<(&'b [u8], Option<&'b [u8]>), FormatError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    let unreadable = |detail: String| FormatError::unreadable(file, "a binary glTF 2.0 file (.glb)", detail);
    let word = |at: usize| -> Result<u32, FormatError> {
        let four = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        four.ok_or_else(|| unreadable(format!("the file ends inside the field at byte {at}")))
    };
    match word(4)? {
        2 => {}
        version => {
            let hint = "Export the scene as glTF 2.0";
            return Err(FormatError::unsupported(file, "header", format!("binary glTF version {version}"), hint));
        }
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        return Err(unreadable(format!("the file has {} of the {length} bytes its header announces", bytes.len())));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    // Bytes beyond the announced length, and chunks of other types, are to be ignored.
    while at + 8 <= length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let Some(data) = bytes[..length].get(at + 8..(at + 8).saturating_add(size)) else {
            return Err(unreadable(format!("the chunk at byte {at} announces {size} bytes, beyond the end")));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(data),
            b"BIN\0" if binary.is_none() => binary = Some(data),
            _ => {}
        }
        at += 8 + size;
    }
    let json = json.ok_or_else(|| unreadable("there is no JSON chunk".to_owned()))?;
    Ok((json, binary))
}

/// Bytes of the buffers, by index.
pub(super) struct Buffers<'b> {
    buffers: Vec<Bytes<'b>>,
    /// Paths of the sparse accessors found to be in order: many primitives may share one.
    pub(super) checked: RefCell<HashSet<String>>,
}

enum Bytes<'b> {
    Chunk(&'b [u8]),
    Own(Vec<u8>),
    Shared(Rc<[u8]>),
}

/// A part of a buffer.
pub(super) struct View<'v> {
    /// Its bytes.
    pub(super) bytes: &'v [u8],
    /// Distance from element to element, if the file gives one.
    pub(super) stride: Option<usize>,
}

impl<'b> Buffers<'b> {
    /// Fetches every buffer of the document. `chunk` is the binary chunk, which the first buffer may stand for.
    pub(super) fn load(
        context: &mut Context<'_>,
        root: &Element<'_>,
        chunk: Option<&'b [u8]>,
    ) -> Result<Self, FormatError> {
        let mut buffers = Vec::new();
        for (i, buffer) in root.items("buffers")?.enumerate() {
            let length = buffer.require("byteLength", "the length of the buffer in bytes")?.as_integer()?;
            let bytes = match (buffer.text("uri")?, chunk) {
                (Some(uri), _) => from_uri(context, &buffer, uri)?,
                (None, Some(chunk)) if i == 0 => Bytes::Chunk(chunk),
                // A placeholder for extensions. Whoever looks into it finds it too short.
                (None, _) => Bytes::Chunk(&[]),
            };
            let (found, placeholder) = (bytes.as_slice().len(), matches!(bytes, Bytes::Chunk(&[])));
            if (found as u64) < length && !placeholder {
                let expected = format!("at least the {length} bytes of its byteLength");
                return Err(buffer.fault(format!("{found} bytes of data"), expected));
            }
            buffers.push(bytes);
        }
        Ok(Self { buffers, checked: RefCell::default() })
    }

    /// The buffer view that the member `bufferView` of `owner` names, if it names one.
    pub(super) fn view(&self, root: &Element<'_>, owner: &Element<'_>) -> Result<Option<View<'_>>, FormatError> {
        let Some((_, view)) = owner.follow("bufferView", root, "bufferViews")? else { return Ok(None) };
        let link = view.require("buffer", "the index of a buffer")?;
        let (index, _) = link.as_link(root, "buffers")?;
        let buffer = self.buffers.get(index).map_or(&[][..], Bytes::as_slice);
        if buffer.is_empty() {
            let hint = "Export the scene as .glb, or with its .bin file";
            return Err(FormatError::unsupported(
                root.file(),
                &view.path,
                format!("buffers[{index}] without data"),
                hint,
            ));
        }
        let offset = view.integer("byteOffset")?.unwrap_or(0);
        let length = view.require("byteLength", "the length of the view in bytes")?.as_integer()?;
        let bytes = slice(buffer, offset, length).ok_or_else(|| {
            let found = format!("bytes {offset} to {}", u128::from(offset) + u128::from(length));
            view.fault(found, format!("a part of the {} bytes of buffers[{index}]", buffer.len()))
        })?;
        let stride = view.integer("byteStride")?.map(|s| usize::try_from(s).unwrap_or(usize::MAX));
        Ok(Some(View { bytes, stride }))
    }
}

impl Bytes<'_> {
    fn as_slice(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Own(bytes) => bytes,
            Self::Shared(bytes) => bytes,
        }
    }
}

/// `length` bytes of `bytes` from `offset`, if they are there.
pub(super) fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = offset.checked_add(length)?;
    bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
}

fn from_uri<'b>(context: &mut Context<'_>, buffer: &Element<'_>, uri: &str) -> Result<Bytes<'b>, FormatError> {
    match data_uri(uri) {
        Some(Ok(bytes)) => {
            context.charge(bytes.len() as u64, &buffer.path)?;
            Ok(Bytes::Own(bytes))
        }
        Some(Err(detail)) => Err(buffer.fault(detail, "base64 data")),
        None => context.fetch(&buffer.path, &percent_decode(uri)).map(Bytes::Shared),
    }
}
