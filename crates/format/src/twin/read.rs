//! Bytes to solutions: nothing is believed before it is checked.
//!
//! Memory is at most what the file itself holds in full: no count can ask for more than its bytes. Arrays that lie as
//! memory wants them, as in a mapped file, are not copied.

use std::borrow::Cow;

use bytemuck::Pod;
use twinray_solve::record::{RUN_WORDS, RunRecord, SequentialRecord, TALLY_WORDS, WavesRecord};
use twinray_solve::{PatchLight, Record, RecordError, Tally};

use super::header::Header;
use super::sections::{Kind, Sections};
use super::{AREA, EMITS, HEADER, Method, Provenance, STANDARD_ERROR, SolutionFile};
use crate::error::FormatError;
use crate::limits::Limits;

/// A solution file whose header was read. What else is in it is read, and found whole, when it is asked for.
#[derive(Clone, Debug)]
pub struct StoredSolution<'a> {
    file: &'a str,
    sections: Sections<'a>,
    provenance: Provenance,
    patches: usize,
    glossy: usize,
    can_go_on: bool,
}

/// Reads the whole of a `.twin` file and checks every bit. `name` is for messages.
///
/// # Errors
/// Those of [`StoredSolution`].
pub fn read_solution<'a>(name: &'a str, bytes: &'a [u8], limits: &Limits) -> Result<SolutionFile<'a>, FormatError> {
    let stored = StoredSolution::open(name, bytes, limits)?;
    stored.verify()?;
    let (light, record) = (stored.light()?, stored.record()?);
    Ok(SolutionFile { provenance: stored.provenance, light, record })
}

impl<'a> StoredSolution<'a> {
    /// Reads the header of a `.twin` file. `name` is for messages.
    ///
    /// # Errors
    /// `Unreadable` if it is no such file, is cut off or has a changed bit where it was looked at; `Unsupported` for another
    /// version or an unknown method; `Invalid` if a value makes no sense; `OverLimit` if it is too large.
    pub fn open(name: &'a str, bytes: &'a [u8], limits: &Limits) -> Result<Self, FormatError> {
        let sections = Sections::open(name, bytes, limits)?;
        let header = Header::parse(name, sections.bytes(HEADER)?)?;
        let count = |key: &str| {
            // More patches than bytes there cannot be.
            header.count(key).map(|n| usize::try_from(n).unwrap_or(usize::MAX).min(bytes.len()))
        };
        let (patches, glossy) = (count("patches")?, count("glossy_patches")?);
        let (can_go_on, provenance) = (header.flag("can_go_on")?, header.provenance()?);
        Ok(Self { file: name, sections, provenance, patches, glossy, can_go_on })
    }

    /// Where the light comes from.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.patches
    }

    /// Number of glossy patches.
    pub fn glossy_patches(&self) -> usize {
        self.glossy
    }

    /// True if a solver can go on from it.
    pub fn can_go_on(&self) -> bool {
        self.can_go_on
    }

    /// Checks every bit of the file.
    ///
    /// # Errors
    /// Names the first section that was changed.
    pub fn verify(&self) -> Result<(), FormatError> {
        self.sections.verify()
    }

    /// Irradiance with error bars.
    ///
    /// # Errors
    /// `Invalid` if a value makes no sense (an area that is negative or not finite, an irradiance that is not finite, a standard
    /// error that is negative or not a number).
    pub fn light(&self) -> Result<PatchLight, FormatError> {
        let area =
            self.checked(AREA, Kind::F64, |a: &f64| a.is_finite() && *a >= 0.0, "a finite area of at least 0")?;
        let emits = self.checked(EMITS, Kind::Bytes, |e: &u8| *e <= 1, "0 or 1")?;
        let (area, emits) = (area.into_owned(), emits.iter().map(|&e| e == 1).collect());
        let bar = |s: &f32| *s >= 0.0;
        let standard_error = self.checked(STANDARD_ERROR, Kind::F32, bar, "a number of at least 0, or infinity")?;
        let standard_error = standard_error.into_owned();
        if let Some(record) = self.record()? {
            let (light, _) = record.light(area, emits);
            if let Some(patch) = light.irradiance.iter().position(|c| !c.iter().all(|x| x.is_finite())) {
                let (found, place) = (format!("{:?}", light.irradiance[patch]), format!("patch {patch}"));
                return Err(FormatError::invalid(self.file, &place, found, "an irradiance of three finite numbers"));
            }
            return Ok(PatchLight { standard_error, ..light });
        }
        let finite = |c: &[f32; 3]| c.iter().all(|x| x.is_finite());
        let irradiance = self.checked("irradiance", Kind::F32, finite, "three finite numbers")?.into_owned();
        let hits = self.sections.rows("hits", Kind::U32, self.patches)?.into_owned();
        Ok(PatchLight { area, emits, irradiance, standard_error, hits })
    }

    /// What it takes to go on or to take pictures; `None` of a reference.
    ///
    /// # Errors
    /// `Invalid` if a value is none that a solve gives.
    pub fn record(&self) -> Result<Option<Record<'a>>, FormatError> {
        if self.provenance.method == Method::Reference {
            return Ok(None);
        }
        let record = match self.sections.has("tree") {
            true => Record::Sequential(self.sequential()?),
            false => Record::Waves(self.waves()?),
        };
        record.check().map_err(|error| {
            let (array, found, expected) = match error {
                RecordError::Value { array, index, expected } => {
                    let row = index.map_or(String::new(), |k| format!(", row {k}"));
                    (format!("{array}\"{row}"), "a value that no solve gives".to_owned(), expected.to_owned())
                }
                RecordError::Length { array, found, expected } => {
                    (format!("{array}\""), format!("{found} rows"), format!("{expected} rows"))
                }
                other => ("header\"".to_owned(), other.to_string(), "a solve".to_owned()),
            };
            FormatError::invalid(self.file, &format!("section \"{array}"), found, expected)
        })?;
        Ok(Some(record))
    }

    fn waves(&self) -> Result<WavesRecord<'a>, FormatError> {
        let (patches, glossy) = (self.patches, self.glossy);
        let totals = self.sections.rows::<u64>("totals", Kind::U64, 2 + TALLY_WORDS)?;
        let runs = match self.can_go_on {
            true => {
                Some([self.run(["run-0", "radiance-0"], None)?, self.run(["run-1", "radiance-1"], Some("sample-1"))?])
            }
            false => None,
        };
        Ok(WavesRecord {
            rays: self.provenance.rays,
            weight: f64::from_bits(totals[0]),
            unit: f64::from_bits(totals[1]),
            tally: tally(&totals[2..]),
            deposits: self.sections.rows("deposits", Kind::F64, patches)?,
            squares: self.sections.rows("squares", Kind::F32, patches)?,
            difference: self.sections.rows("difference", Kind::F32, patches)?,
            hits: self.sections.rows("hits", Kind::U32, patches)?,
            glossy: self.sections.rows("glossy", Kind::U32, glossy)?,
            reflected: self.sections.rows("reflected", Kind::F32, glossy)?,
            representatives: self.sections.rows("sample-0", Kind::Bytes, glossy)?,
            runs,
        })
    }

    fn run(&self, [words, radiance]: [&str; 2], sample: Option<&str>) -> Result<RunRecord<'a>, FormatError> {
        let words = self.sections.rows::<u64>(words, Kind::U64, RUN_WORDS)?;
        Ok(RunRecord {
            words: std::array::from_fn(|k| words[k]),
            radiance: self.sections.rows(radiance, Kind::F32, self.patches)?,
            representatives: match sample {
                Some(name) => self.sections.rows(name, Kind::Bytes, self.glossy)?,
                None => Cow::Borrowed(&[]),
            },
        })
    }

    fn sequential(&self) -> Result<SequentialRecord<'a>, FormatError> {
        let (patches, glossy) = (self.patches, self.glossy);
        let totals = self.sections.rows::<u64>("totals", Kind::U64, 1 + TALLY_WORDS)?;
        let nodes = patches.checked_next_power_of_two().and_then(|n| n.checked_mul(2)).unwrap_or(usize::MAX);
        Ok(SequentialRecord {
            rays: self.provenance.rays,
            updates: totals[0],
            tally: tally(&totals[1..]),
            irradiance: self.sections.rows("irradiance", Kind::F64, patches)?,
            squares: self.sections.rows("squares", Kind::F64, patches)?,
            hits: self.sections.rows("hits", Kind::U32, patches)?,
            tree: self.sections.rows("tree", Kind::F64, nodes)?,
            glossy: self.sections.rows("glossy", Kind::U32, glossy)?,
            memory: self.sections.rows("memory", Kind::F64, glossy)?,
        })
    }

    /// A section of one row a patch, each checked.
    fn checked<T: Pod + std::fmt::Debug>(
        &self,
        section: &str,
        kind: Kind,
        is_good: impl Fn(&T) -> bool,
        expected: &str,
    ) -> Result<Cow<'a, [T]>, FormatError> {
        let rows = self.sections.rows(section, kind, self.patches)?;
        if let Some(patch) = rows.iter().position(|row| !is_good(row)) {
            let place = format!("section \"{section}\", patch {patch}");
            return Err(FormatError::invalid(self.file, &place, format!("{:?}", rows[patch]), expected));
        }
        Ok(rows)
    }
}

fn tally(words: &[u64]) -> Tally {
    Tally::from_words(std::array::from_fn(|k| words[k]))
}
