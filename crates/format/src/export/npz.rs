//! NPZ: one array a column, for `numpy.load`.
//!
//! A ZIP archive (`zip`) of `.npy` files, stored as `numpy.savez` does. Written by hand: the head of an array is a line
//! of text, for which `npyz` would bring a parser of Python literals along. Source: NumPy Enhancement Proposal 1,
//! version 1.0. Not here: what the columns mean (`export`).

use std::io::{self, BufWriter, Write};

use super::zip::Archive;
use super::{COLUMNS, CellTable, Column, Kind};

/// Writes `table` as NPZ: arrays `[patches]` or `[patches, 3]`, and `provenance`, texts `[pairs, 2]`.
///
/// Equal tables give equal bytes: entries carry no date and no trace of the platform.
///
/// # Errors
/// If `out` fails.
///
/// # Panics
/// If an array of the table has not one value for each patch.
pub fn write_npz(table: &CellTable, out: impl Write) -> io::Result<()> {
    table.check();
    let mut archive = Archive::new(out);
    for column in &COLUMNS {
        archive.add(&format!("{}.npy", column.name), |out| write_column(table, column, out))?;
    }
    archive.add("provenance.npy", |out| write_texts(&table.provenance, out))?;
    archive.finish()
}

fn write_column(table: &CellTable, column: &Column, out: &mut dyn Write) -> io::Result<()> {
    let descriptor = match column.kind {
        Kind::F64 => "<f8",
        Kind::F32 => "<f4",
        Kind::U32 => "<u4",
        Kind::Bool => "|b1",
    };
    let shape = match column.width() {
        1 => format!("({},)", table.len()),
        width => format!("({}, {width})", table.len()),
    };
    let mut out = BufWriter::with_capacity(1 << 16, out);
    out.write_all(&head(descriptor, &shape))?;
    let mut row = Vec::new();
    for patch in table.scene.patches() {
        row.clear();
        (column.encode)(table, patch, &mut row);
        out.write_all(&row)?;
    }
    out.flush()
}

/// The head of a `.npy` file: a Python literal, padded so that numbers begin at a multiple of 64.
fn head(descriptor: &str, shape: &str) -> Vec<u8> {
    const BEFORE_THE_TEXT: usize = 10;
    let mut text = format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (BEFORE_THE_TEXT + text.len() + 1).next_multiple_of(64) - BEFORE_THE_TEXT;
    text.extend(std::iter::repeat_n(' ', length - text.len() - 1));
    text.push('\n');
    [b"\x93NUMPY\x01\x00", &(length as u16).to_le_bytes()[..], text.as_bytes()].concat()
}

/// Texts of equal length in UTF-32, filled with zeros: the only texts that NumPy reads without unpickling.
fn write_texts(pairs: &[(String, String)], out: &mut dyn Write) -> io::Result<()> {
    let texts = || pairs.iter().flat_map(|(name, text)| [name, text]);
    let longest = texts().map(|t| t.chars().count()).max().unwrap_or(0).max(1);
    out.write_all(&head(&format!("<U{longest}"), &format!("({}, 2)", pairs.len())))?;
    for text in texts() {
        let codes = text.chars().map(u32::from).chain(std::iter::repeat(0)).take(longest);
        out.write_all(&codes.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())?;
    }
    Ok(())
}
