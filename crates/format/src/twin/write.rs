//! Solutions to bytes: the same solution gives the same bytes.

use std::io::{self, Write};

use twinray_solve::Record;
use twinray_solve::record::{RunRecord, SequentialRecord, WavesRecord};

use super::sections::{self, Kind, Section};
use super::{AREA, EMITS, HEADER, STANDARD_ERROR, SolutionFile, header};

/// Writes a `.twin` file. Equal solutions give equal bytes. What is borrowed is not copied.
///
/// # Errors
/// Of `out`.
///
/// # Panics
/// If the arrays of the light differ in length.
pub fn write_solution(solution: &SolutionFile, out: &mut dyn Write) -> io::Result<()> {
    let light = &solution.light;
    let patches = light.len();
    let lengths = [light.emits.len(), light.irradiance.len(), light.standard_error.len(), light.hits.len()];
    assert!(lengths.iter().all(|&n| n == patches), "write_solution: arrays of {lengths:?} for {patches} patches");
    let emits = light.emits.iter().map(|&e| u8::from(e)).collect::<Vec<_>>();
    let mut all = vec![
        Section::raw(HEADER, 1, header::write(solution).into()),
        Section::rows(AREA, Kind::F64, &light.area),
        Section::raw(EMITS, 1, emits.into()),
        Section::rows(STANDARD_ERROR, Kind::F32, &light.standard_error),
    ];
    match &solution.record {
        None => {
            all.push(Section::rows("irradiance", Kind::F32, &light.irradiance));
            all.push(Section::rows("hits", Kind::U32, &light.hits));
        }
        Some(Record::Waves(record)) => waves(record, &mut all),
        Some(Record::Sequential(record)) => sequential(record, &mut all),
    }
    sections::write(&all, out)
}

fn waves<'a>(record: &'a WavesRecord, all: &mut Vec<Section<'a>>) {
    let totals = [&[record.weight.to_bits(), record.unit.to_bits()][..], &record.tally.to_words()].concat();
    all.extend([
        Section::owned("totals", Kind::U64, totals),
        Section::rows("deposits", Kind::F64, &record.deposits),
        Section::rows("squares", Kind::F32, &record.squares),
        Section::rows("difference", Kind::F32, &record.difference),
        Section::rows("hits", Kind::U32, &record.hits),
        Section::rows("glossy", Kind::U32, &record.glossy),
        Section::rows("reflected", Kind::F32, &record.reflected),
        Section::rows("sample-0", Kind::Bytes, &record.representatives),
    ]);
    let Some([first, second]) = &record.runs else { return };
    let run = |names: [&'static str; 2], run: &'a RunRecord| {
        [Section::rows(names[0], Kind::U64, &run.words), Section::rows(names[1], Kind::F32, &run.radiance)]
    };
    all.extend(run(["run-0", "radiance-0"], first));
    all.extend(run(["run-1", "radiance-1"], second));
    all.push(Section::rows("sample-1", Kind::Bytes, &second.representatives));
}

fn sequential<'a>(record: &'a SequentialRecord, all: &mut Vec<Section<'a>>) {
    let totals = [&[record.updates][..], &record.tally.to_words()].concat();
    all.extend([
        Section::owned("totals", Kind::U64, totals),
        Section::rows("irradiance", Kind::F64, &record.irradiance),
        Section::rows("squares", Kind::F64, &record.squares),
        Section::rows("hits", Kind::U32, &record.hits),
        Section::rows("tree", Kind::F64, &record.tree),
        Section::rows("glossy", Kind::U32, &record.glossy),
        Section::rows("memory", Kind::F64, &record.memory),
    ]);
}
