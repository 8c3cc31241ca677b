//! Wavefront OBJ with MTL: from text to a scene.
//!
//! `parse` and `mtl` read the text, `polygon` and `mesh` make triangles, `material` makes surfaces, `write` goes
//! the other way. Called by `read_scene`. OBJ has no cameras, no units and no sides; see `material` for the latter.

mod material;
mod mesh;
mod mtl;
mod parse;
mod polygon;
mod write;

use std::borrow::Cow;
use std::collections::HashSet;

use glam::DAffine3;
use twinray_scene::{Instance, Mesh, Scene};

use self::material::Materials;
use self::mesh::Builder;
use self::polygon::Triangulator;
use crate::context::Context;
use crate::error::FormatError;
use crate::geometry::no_triangles;
use crate::limits::as_name;

pub use self::write::{ObjFiles, write_obj};

/// Reads an `.obj` file.
pub(crate) fn read(context: &mut Context<'_>, bytes: &[u8]) -> Result<Scene, FormatError> {
    let mut document = parse::parse(context, bytes)?;
    // Taken out, so that the faces of each group can go once it is a mesh.
    let groups = std::mem::take(&mut document.groups);
    let mut materials = Materials::new(read_libraries(context, &document.libraries)?);
    let centre = mesh::centre(&document, context.limits.max_coordinate);
    let mut builder = Builder {
        document: &document,
        centre,
        triangulator: Triangulator::default(),
        flipped: 0,
        dangling: 0,
        triangles: 0,
    };
    let mut scene = Scene::default();
    for group in groups {
        let material = group.material.clone();
        let Some(mesh) = builder.build(context, group)? else { continue };
        let material = materials.of(context, material.as_deref());
        let instance = Instance {
            name: mesh.name.clone(),
            mesh: scene.meshes.len(),
            transform: DAffine3::from_translation(centre),
        };
        scene.meshes.push(Mesh { material, ..mesh });
        scene.instances.push(instance);
    }
    let mut report = |count: usize, message: &str| {
        if count > 0 {
            context.sum_up("faces", format!("{message}: {count}"));
        }
    };
    report(builder.flipped, "triangles turned round so that their front is where their normals point");
    report(builder.dangling, "references to texture coordinates or normals that do not exist");
    report(builder.triangulator.fanned, "concave polygons with too many corners, split as if they were convex");
    let (list, pictures) = materials.finish(context);
    scene.materials = list;
    scene.images = pictures.into_images();
    if scene.instances.is_empty() {
        return Err(no_triangles(context, "faces"));
    }
    Ok(scene)
}

/// Materials of all libraries that can be had; what cannot is a warning.
fn read_libraries(context: &mut Context<'_>, libraries: &[(String, usize)]) -> Result<Vec<mtl::Entry>, FormatError> {
    let mut entries = Vec::new();
    let mut seen = HashSet::new();
    for (names, line) in libraries {
        for name in library_names(names) {
            // A file that names hundreds of libraries is not a scene.
            if seen.len() >= 256 || !seen.insert(name.clone()) {
                continue;
            }
            match context.fetch(&format!("line {line}: mtllib"), &name) {
                Ok(bytes) => entries.extend(mtl::parse(context, &name, &bytes)?),
                Err(error) => {
                    let message = format!("{}; its materials become grey", error.without_place());
                    context.warn(format!("line {line}: mtllib"), message);
                }
            }
        }
    }
    Ok(entries)
}

/// The files of one `mtllib` line: several names between spaces, or one name with spaces in it. Backslashes keep
/// spaces together, as `tinyobjloader` has it.
fn library_names(names: &str) -> Vec<String> {
    const SPACE: &str = "\u{1}";
    if names.to_ascii_lowercase().matches(".mtl").count() <= 1 {
        return vec![names.replace("\\ ", " ")];
    }
    names.replace("\\ ", SPACE).split_ascii_whitespace().map(|name| name.replace(SPACE, " ")).collect()
}

/// A line of text that says something.
struct Line<'t> {
    number: usize,
    keyword: &'t str,
    /// What follows the keyword, trimmed.
    rest: &'t str,
}

/// The text of an OBJ or MTL file. Foreign encodings keep their ASCII part, which holds all numbers; a backslash at
/// the end of a line, which continues it, becomes a form feed, so that lines can still be counted.
fn text<'b>(file: &str, bytes: &'b [u8], what: &str) -> Result<Cow<'b, str>, FormatError> {
    let unreadable = |detail: &str| FormatError::unreadable(file, format!("{what} in UTF-8 or ASCII"), detail);
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(unreadable("the text is UTF-16"));
    }
    if bytes.iter().take(4096).any(|&b| b == 0) {
        return Err(unreadable("the bytes are not text"));
    }
    let mut bytes = Cow::Borrowed(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    // Old Macs end lines with a carriage return alone; that of Windows is trimmed with the line.
    if bytes.contains(&b'\r') && !bytes.contains(&b'\n') {
        bytes.to_mut().iter_mut().filter(|b| **b == b'\r').for_each(|b| *b = b'\n');
    }
    // Before foreign bytes become three each: there is one copy of that at most.
    Ok(match join_lines(bytes) {
        Cow::Borrowed(bytes) => String::from_utf8_lossy(bytes),
        Cow::Owned(bytes) => Cow::Owned(match String::from_utf8_lossy(&bytes) {
            Cow::Owned(text) => text,
            Cow::Borrowed(_) => String::from_utf8(bytes).unwrap_or_default(),
        }),
    })
}

/// Puts a space and a form feed where a backslash ends a line.
fn join_lines(bytes: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    let end = |at: usize| match &bytes[at..] {
        [b'\\', b'\n', ..] => 2,
        [b'\\', b'\r', b'\n', ..] => 3,
        _ => 0,
    };
    if (0..bytes.len()).all(|at| end(at) == 0) {
        return bytes;
    }
    let (mut joined, mut at) = (Vec::with_capacity(bytes.len()), 0);
    while at < bytes.len() {
        match end(at) {
            0 => {
                joined.push(bytes[at]);
                at += 1;
            }
            length => {
                joined.extend(b" \x0c");
                at += length;
            }
        }
    }
    joined.into()
}

/// Memory of a text that could not stay where it was.
#[allow(clippy::ptr_arg, reason = "whether it is owned is the question")]
fn copied_bytes(text: &Cow<'_, str>) -> u64 {
    if let Cow::Owned(text) = text { text.capacity() as u64 } else { 0 }
}

/// The lines of `text` that say something: no comments, no empty ones.
fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut next = 1;
    text.split('\n').filter_map(move |line| {
        let number = next;
        next += 1 + line.bytes().filter(|&b| b == b'\x0c').count();
        let line = line.trim();
        let (keyword, rest) = line.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((line, ""));
        (!keyword.is_empty() && !keyword.starts_with('#')).then(|| Line { number, keyword, rest: rest.trim() })
    })
}

impl Line<'_> {
    /// The first `N` words as numbers; "nan" and "inf" are numbers here, and the vertices with them damaged.
    fn numbers<const N: usize>(&self, file: &str) -> Result<[f64; N], FormatError> {
        let mut words = self.rest.split_ascii_whitespace();
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let parsed = words.next().and_then(|word| word.parse().ok());
            *number = parsed.ok_or_else(|| {
                let found = format!("{:?}", self.rest.chars().take(60).collect::<String>());
                self.invalid(file, found, &format!("{N} numbers after {}", self.keyword))
            })?;
        }
        Ok(numbers)
    }

    /// What follows the keyword as a name.
    fn name(&self) -> &str {
        as_name(self.rest)
    }

    fn invalid(&self, file: &str, found: String, expected: &str) -> FormatError {
        FormatError::invalid(file, &format!("line {}", self.number), found, expected)
    }
}
