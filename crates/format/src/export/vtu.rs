//! VTU: cells as an unstructured grid with all columns as cell data, for ParaView and its kin.
//!
//! Written by hand: XML that announces arrays, and the arrays in base64 behind it ("appended", VTK's own default), which
//! is well-formed and exact. `vtkio` would want the whole grid in memory and brings twenty crates along; it reads back in
//! the tests. Source: VTK's documentation, "XML file formats". Not here: what the columns mean (`export`).

use std::io::{self, BufWriter, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use twinray_scene::PatchId;

use super::{COLUMNS, CellTable, Column, Kind};

/// Writes `table` as a VTK unstructured grid (`.vtu`).
///
/// Every cell has corners of its own. Equal tables give equal bytes.
///
/// # Errors
/// If `out` fails.
///
/// # Panics
/// If an array of the table has not one value for each patch.
pub fn write_vtu(table: &CellTable, out: impl Write) -> io::Result<()> {
    table.check();
    let points = table.corner_count();
    let mut out = BufWriter::with_capacity(1 << 16, out);
    out.write_all(head(table, points).as_bytes())?;
    for column in &COLUMNS {
        write_array(&mut out, column_bytes(table, column), table, column.encode)?;
    }
    write_array(&mut out, points as u64 * 24, table, |table, patch, row| {
        row.extend(table.corners(patch).flat_map(|c| c.to_array()).flat_map(f64::to_le_bytes));
    })?;
    let mut first = 0u64;
    write_array(&mut out, points as u64 * 8, table, |table, patch, row| {
        let end = first + table.corners(patch).len() as u64;
        row.extend((first..end).flat_map(u64::to_le_bytes));
        first = end;
    })?;
    let mut end = 0u64;
    write_array(&mut out, table.len() as u64 * 8, table, |table, patch, row| {
        end += table.corners(patch).len() as u64;
        row.extend(end.to_le_bytes());
    })?;
    write_array(&mut out, table.len() as u64, table, |table, patch, row| {
        row.push(cell_type(table.corners(patch).len()));
    })?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    out.flush()
}

/// VTK's number of a shape: programs treat triangles and quadrilaterals better than polygons of three and four. Of four
/// corners a quadrilateral must be convex, as ours are: only a cell under an apex is concave, and it has more.
fn cell_type(corners: usize) -> u8 {
    match corners {
        3 => 5,
        4 => 9,
        _ => 7,
    }
}

/// The XML before the arrays.
fn head(table: &CellTable, points: usize) -> String {
    let cells = table.len();
    let mut head = "<?xml version=\"1.0\"?>\n".to_owned();
    for (name, text) in &table.provenance {
        head += &format!("<!-- {}: {} -->\n", plain(name), plain(text));
    }
    head += "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
    head += &format!("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n");
    let mut offset = 0;
    let mut announce = |name: &str, kind: &str, components: usize, bytes: u64| {
        let line = format!(
            "<DataArray Name=\"{name}\" type=\"{kind}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>\n"
        );
        offset += base64_length(8 + bytes);
        line
    };
    head += "<CellData>\n";
    for column in &COLUMNS {
        let kind = match column.kind {
            Kind::F64 => "Float64",
            Kind::F32 => "Float32",
            Kind::U32 => "UInt32",
            Kind::Bool => "UInt8",
        };
        head += &announce(column.name, kind, column.width(), column_bytes(table, column));
    }
    head += "</CellData>\n<Points>\n";
    head += &announce("Points", "Float64", 3, points as u64 * 24);
    head += "</Points>\n<Cells>\n";
    head += &announce("connectivity", "Int64", 1, points as u64 * 8);
    head += &announce("offsets", "Int64", 1, cells as u64 * 8);
    head += &announce("types", "UInt8", 1, cells as u64);
    head + "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"base64\">\n_"
}

fn column_bytes(table: &CellTable, column: &Column) -> u64 {
    table.len() as u64 * (column.width() * column.kind.bytes()) as u64
}

/// Characters that `bytes` bytes become, padding included.
fn base64_length(bytes: u64) -> u64 {
    4 * bytes.div_ceil(3)
}

/// An array: the number of its bytes, then what `encode` appends for each cell.
fn write_array(
    out: &mut impl Write,
    bytes: u64,
    table: &CellTable,
    mut encode: impl FnMut(&CellTable, PatchId, &mut Vec<u8>),
) -> io::Result<()> {
    let mut out = EncoderWriter::new(out, &STANDARD);
    out.write_all(&bytes.to_le_bytes())?;
    let mut row = Vec::new();
    for patch in table.scene.patches() {
        row.clear();
        encode(table, patch, &mut row);
        out.write_all(&row)?;
    }
    out.finish()?;
    Ok(())
}

/// Text for a comment, which must not hold two hyphens in a row, and of which every reader takes ASCII.
fn plain(text: &str) -> String {
    let text: String = text.chars().map(|c| if c == ' ' || c.is_ascii_graphic() { c } else { '?' }).collect();
    text.replace("--", "-\u{20}-")
}
