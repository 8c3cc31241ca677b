//! CSV: one line a cell, for spreadsheets and data frames.
//!
//! Plain RFC 4180 with one header line. There is no room for provenance: a comment would be taken for the header by most
//! programs. Not here: what the columns mean (`export`).

use std::io::{self, Write};

use super::{COLUMNS, CellTable};

/// Writes `table` as CSV: a line of names, then a line for each cell, beginning with its index.
///
/// Numbers are the shortest decimals that read back to the same bits; infinite ones are `inf`. Equal tables give
/// equal bytes.
///
/// # Errors
/// If `out` fails.
///
/// # Panics
/// If an array of the table has not one value for each patch.
pub fn write_csv(table: &CellTable, out: impl Write) -> io::Result<()> {
    table.check();
    let mut lines = csv::Writer::from_writer(out);
    let names = COLUMNS.iter().flat_map(super::Column::names);
    lines.write_record(std::iter::once("cell".to_owned()).chain(names))?;
    let light = &table.light;
    for (k, patch) in table.scene.patches().enumerate() {
        // In the order of `COLUMNS`; arrays become a field for each number.
        lines.serialize((
            patch.0,
            table.centre(patch),
            table.normal(patch),
            table.scene.area(patch),
            u8::from(light.emits[k]),
            light.irradiance[k],
            table.radiosity[k],
            light.standard_error[k],
            light.hits[k],
        ))?;
    }
    lines.flush()
}
