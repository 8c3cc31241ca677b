//! The text of an OBJ file: positions, attributes, and faces grouped by object and material.
//!
//! Not here: MTL files (`mtl`), triangles (`mesh`). The `tobj` crate is not used: it panics on `Kd 1` and on large
//! relative indices, names no line in its errors, and fans concave polygons.

use std::collections::HashMap;

use super::Line;
use crate::context::Context;
use crate::error::FormatError;

/// Stands for an index that a corner does not have.
pub(super) const NONE: u32 = u32::MAX;

/// Everything an OBJ file says that light can use.
#[derive(Default)]
pub(super) struct Document {
    pub(super) positions: Vec<[f64; 3]>,
    /// First row on top, as in `Mesh`.
    pub(super) texcoords: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) groups: Vec<Group>,
    /// `mtllib` files with their line.
    pub(super) libraries: Vec<(String, usize)>,
}

/// Polygons of one object and one material.
pub(super) struct Group {
    pub(super) name: String,
    /// Name of the material, if one was in use.
    pub(super) material: Option<String>,
    /// Position, texture coordinate and normal of each corner, from 0; `NONE` where absent.
    pub(super) corners: Vec<[u32; 3]>,
    /// Number of corners of each polygon.
    pub(super) sizes: Vec<u32>,
}

/// Memory of one corner and of one polygon in a `Group`, its arrays three quarters full.
const CORNER_BYTES: u64 = 16;
const POLYGON_BYTES: u64 = 6;

impl Group {
    /// Memory of the faces, as charged while reading.
    pub(super) fn bytes(&self) -> u64 {
        self.corners.len() as u64 * CORNER_BYTES + self.sizes.len() as u64 * POLYGON_BYTES
    }
}

/// What the lines so far have set.
#[derive(Default)]
struct State {
    document: Document,
    object: String,
    group: String,
    material: Option<String>,
    by_name: HashMap<(String, Option<String>), usize>,
    /// Index in `document.groups` of the current object and material, once it has a face.
    current: Option<usize>,
    /// Largest position a face has named before it was there, and the face's line.
    ahead: Option<(u32, usize)>,
    small_faces: usize,
    colours: bool,
}

/// Reads the text of an OBJ file.
pub(super) fn parse(context: &mut Context<'_>, bytes: &[u8]) -> Result<Document, FormatError> {
    let mut state = State::default();
    let text = super::text(context.file, bytes, "an OBJ file")?;
    let copied = super::copied_bytes(&text);
    context.charge(copied, "text")?;
    state.reserve(context, &text)?;
    for line in super::lines(&text) {
        state.line(context, &line)?;
    }
    drop(text);
    context.budget.release(copied);
    let State { document, ahead, small_faces, colours, .. } = state;
    if let Some((index, line)) = ahead.filter(|(index, _)| *index as usize >= document.positions.len()) {
        let expected = format!("a number from 1 to {}, the count of vertices", document.positions.len());
        return Err(FormatError::invalid(
            context.file,
            &format!("line {line}"),
            format!("vertex {}", index + 1),
            expected,
        ));
    }
    if small_faces > 0 {
        context.sum_up("faces", format!("those with fewer than three corners are ignored: {small_faces}"));
    }
    if colours {
        context.sum_up("vertices", "vertex colours are ignored");
    }
    Ok(document)
}

impl State {
    /// Counts vertices first: growing the arrays step by step would take twice their memory.
    fn reserve(&mut self, context: &mut Context<'_>, text: &str) -> Result<(), FormatError> {
        let (mut positions, mut texcoords, mut normals) = (0, 0, 0);
        for line in super::lines(text) {
            match line.keyword {
                "v" => positions += 1,
                "vt" => texcoords += 1,
                "vn" => normals += 1,
                _ => {}
            }
        }
        context.charge(positions * 24, "vertices")?;
        context.charge(texcoords * 8, "texture coordinates")?;
        context.charge(normals * 12, "normals")?;
        self.document.positions.reserve_exact(positions as usize);
        self.document.texcoords.reserve_exact(texcoords as usize);
        self.document.normals.reserve_exact(normals as usize);
        Ok(())
    }

    fn line(&mut self, context: &mut Context<'_>, line: &Line<'_>) -> Result<(), FormatError> {
        match line.keyword {
            "v" => {
                let position = line.numbers(context.file)?;
                self.colours |= line.rest.split_ascii_whitespace().take_while(|w| !w.starts_with('#')).count() >= 6;
                self.document.positions.push(position);
            }
            "vt" => {
                // One number is allowed: a texture of one dimension.
                let words = line.rest.split_ascii_whitespace().count();
                let [u, v] =
                    if words == 1 { [line.numbers::<1>(context.file)?[0], 0.0] } else { line.numbers(context.file)? };
                // OBJ counts v from the bottom, our pictures from the top.
                self.document.texcoords.push([u as f32, (1.0 - v) as f32]);
            }
            "vn" => {
                self.document.normals.push(line.numbers(context.file)?.map(|c: f64| c as f32));
            }
            "f" | "fo" => self.face(context, line)?,
            "o" => {
                self.object = line.name().to_owned();
                self.current = None;
            }
            "g" => {
                self.group = line.name().to_owned();
                self.current = None;
            }
            "usemtl" => {
                self.material = Some(line.name().to_owned()).filter(|m| !m.is_empty());
                self.current = None;
            }
            "mtllib" => {
                context.charge(64 + line.rest.len() as u64, "mtllib")?;
                self.document.libraries.push((line.rest.to_owned(), line.number));
            }
            // Smoothing, display and free-form data say nothing about triangles.
            "s" | "vp" | "lod" | "usemap" | "maplib" | "bevel" | "c_interp" | "d_interp" | "shadow_obj"
            | "trace_obj" => {}
            "l" | "p" => context.warn("points and lines", "they have no area: ignored"),
            other => {
                let other: String = other.chars().take(40).collect();
                context.warn(format!("line {}", line.number), format!("unknown keyword {other:?} is ignored"));
            }
        }
        Ok(())
    }

    fn face(&mut self, context: &mut Context<'_>, line: &Line<'_>) -> Result<(), FormatError> {
        let group = match self.current {
            Some(group) => group,
            None => self.open_group(context)?,
        };
        let counts = [self.document.positions.len(), self.document.texcoords.len(), self.document.normals.len()];
        let corners = &mut self.document.groups[group].corners;
        let start = corners.len();
        for word in line.rest.split_ascii_whitespace() {
            if word.starts_with('#') {
                break;
            }
            let corner = parse_corner(word, counts).ok_or_else(|| {
                let word: String = word.chars().take(40).collect();
                line.invalid(
                    context.file,
                    format!("corner {word:?}"),
                    "v, v/vt, v//vn or v/vt/vn with numbers that exist",
                )
            })?;
            if corner[0] as usize >= counts[0] && self.ahead.is_none_or(|(index, _)| corner[0] > index) {
                self.ahead = Some((corner[0], line.number));
            }
            context.charge(CORNER_BYTES, "faces")?;
            corners.push(corner);
        }
        let count = corners.len() - start;
        if count < 3 {
            corners.truncate(start);
            self.small_faces += 1;
            return Ok(());
        }
        self.document.groups[group].sizes.push(count as u32);
        context.charge(POLYGON_BYTES, "faces")
    }

    /// The group of the current names, made when the first face needs it.
    fn open_group(&mut self, context: &mut Context<'_>) -> Result<usize, FormatError> {
        let name = if self.object.is_empty() { &self.group } else { &self.object };
        let key = (name.clone(), self.material.clone());
        let groups = &mut self.document.groups;
        let index = match self.by_name.get(&key) {
            Some(&index) => index,
            None => {
                let names = key.0.len() + key.1.as_ref().map_or(0, String::len);
                context.charge(1024 + 4 * names as u64, "groups")?;
                let name = if key.0.is_empty() { "object".to_owned() } else { key.0.clone() };
                groups.push(Group { name, material: key.1.clone(), corners: Vec::new(), sizes: Vec::new() });
                self.by_name.insert(key, groups.len() - 1);
                groups.len() - 1
            }
        };
        self.current = Some(index);
        Ok(index)
    }
}

/// Indices of a corner from 0; `None` if it is not one. Positions may lie ahead; texture coordinates and normals
/// that do not exist become `NONE` when they are used.
fn parse_corner(word: &str, counts: [usize; 3]) -> Option<[u32; 3]> {
    let mut corner = [NONE; 3];
    for (i, part) in word.split('/').enumerate() {
        let slot = corner.get_mut(i)?;
        if part.is_empty() {
            continue;
        }
        let number: i64 = part.parse().ok()?;
        let index = match number {
            1.. => number - 1,
            0 => return None,
            // Relative: −1 is the last one so far.
            _ => number.checked_add(counts[i] as i64).filter(|n| *n >= 0)?,
        };
        *slot = u32::try_from(index).ok().filter(|n| *n != NONE)?;
    }
    (corner[0] != NONE).then_some(corner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_come_in_four_forms() {
        let cases = [
            ("1", Some([0, NONE, NONE])),
            ("1/2", Some([0, 1, NONE])),
            ("1//3", Some([0, NONE, 2])),
            ("1/2/3", Some([0, 1, 2])),
            ("-1/-1/-1", Some([4, 4, 4])),
            ("0", None),
            ("-6", None),
            ("1/2/3/4", None),
            ("/1/1", None),
            ("x", None),
            ("99999999999999999999", None),
            ("-9223372036854775808", None),
            ("4294967296", None),
        ];
        for (word, corner) in cases {
            assert_eq!(parse_corner(word, [5; 3]), corner, "{word}");
        }
    }
}
