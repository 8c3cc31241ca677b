//! PLY: cells as polygons with all columns on the faces, for mesh viewers and for programs that read meshes.
//!
//! Written by hand: a text that announces bytes. `ply-rs-bw` asks for every number by its name through a trait of
//! thirty methods, which is longer than this file; it reads back in the tests. Source: Greg Turk, "The PLY polygon
//! file format", 1994. Not here: colours (`colour`), what the columns mean (`export`).

use std::io::{self, BufWriter, Write};

use super::{COLUMNS, CellTable, Kind, colour};

/// Writes `table` as binary little-endian PLY.
///
/// Every cell is a face with corners of its own, so that the colours of vertices do not run into each other. Equal
/// tables give equal bytes.
///
/// # Errors
/// `InvalidInput` if there are more corners than the format's 31 bits can number; otherwise if `out` fails.
///
/// # Panics
/// If an array of the table has not one value for each patch.
pub fn write_ply(table: &CellTable, out: impl Write) -> io::Result<()> {
    table.check();
    let vertices = table.corner_count();
    if i32::try_from(vertices).is_err() {
        let message = format!("{vertices} corners are more than PLY can number (2147483647): write .vtu instead");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let mut out = BufWriter::with_capacity(1 << 16, out);
    out.write_all(head(table, vertices).as_bytes())?;

    let scale = colour::scale(table);
    for patch in table.scene.patches() {
        let colour = colour::of(table, patch, scale);
        for corner in table.corners(patch) {
            for x in corner.to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
            out.write_all(&colour)?;
        }
    }
    let (mut first, mut face) = (0i32, Vec::new());
    for patch in table.scene.patches() {
        let count = table.corners(patch).len();
        let end = first + count as i32;
        face.clear();
        face.push(count as u8);
        face.extend((first..end).flat_map(i32::to_le_bytes));
        face.extend(colour::of(table, patch, scale));
        COLUMNS.iter().for_each(|column| (column.encode)(table, patch, &mut face));
        out.write_all(&face)?;
        first = end;
    }
    out.flush()
}

/// The text before the bytes.
fn head(table: &CellTable, vertices: usize) -> String {
    const COLOUR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let mut head = "ply\nformat binary_little_endian 1.0\n".to_owned();
    for (name, text) in &table.provenance {
        head += &format!("comment {} {}\n", plain(name), plain(text));
    }
    head += &format!("element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n{COLOUR}");
    head += &format!("element face {}\nproperty list uchar int vertex_indices\n{COLOUR}", table.len());
    for column in &COLUMNS {
        let kind = match column.kind {
            Kind::F64 => "double",
            Kind::F32 => "float",
            Kind::U32 => "uint",
            Kind::Bool => "uchar",
        };
        column.names().iter().for_each(|name| head += &format!("property {kind} {name}\n"));
    }
    head + "end_header\n"
}

/// One line of ASCII: readers refuse other comments.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect()
}
