//! Bytes to solutions: nothing is believed before it is checked.
//!
//! Memory is what the arrays need, which the file itself holds in full: no count can ask for more than its bytes.

use serde_json::Value;
use twinray_solve::PatchLight;

use super::sections::Sections;
use super::{AREA, EMITS, HEADER, HITS, IRRADIANCE, Method, Provenance, STANDARD_ERROR, SolutionFile};
use crate::error::FormatError;
use crate::limits::{Budget, Limits};

/// JSON of a few bytes unpacks to many: a header that is longer than this is none of ours.
const LONGEST_HEADER: usize = 1 << 20;

/// Reads a `.twin` file. `name` is for messages.
///
/// # Errors
/// `Unreadable` if it is no such file, is cut off or has a changed bit; `Unsupported` for another version or an
/// unknown method; `Invalid` if a value makes no sense (an area that is negative or not finite, an irradiance that
/// is not finite, a standard error that is negative or not a number); `OverLimit` if it is too large.
pub fn read_solution(name: &str, bytes: &[u8], limits: &Limits) -> Result<SolutionFile, FormatError> {
    let sections = Sections::unpack(name, bytes, limits)?;
    let mut budget = Budget::new(limits);
    budget.add_input(bytes.len());
    // The arrays take at most as much memory as the file.
    budget.charge(bytes.len() as u64, name, "the arrays")?;
    let header = Header::parse(name, sections.get(HEADER)?)?;
    let provenance = header.provenance()?;
    let arrays = Arrays { file: name, sections: &sections, patches: header.count("patches")? };
    let light = PatchLight {
        area: arrays.values(AREA, float, |a| a.is_finite() && *a >= 0.0, "a finite area of at least 0")?,
        emits: arrays.values(EMITS, |b| b[0], |e| *e <= 1, "0 or 1")?.into_iter().map(|e| e == 1).collect(),
        irradiance: arrays.values(
            IRRADIANCE,
            |b| [float(&b[..4]), float(&b[4..8]), float(&b[8..])],
            |c| c.iter().all(|x| x.is_finite()),
            "three finite numbers",
        )?,
        standard_error: arrays.values(STANDARD_ERROR, float, |s| *s >= 0.0, "a number of at least 0, or infinity")?,
        hits: arrays.values(HITS, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]), |_| true, "")?,
    };
    Ok(SolutionFile { provenance, light })
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// The sections that hold one value a patch.
struct Arrays<'a> {
    file: &'a str,
    sections: &'a Sections<'a>,
    patches: u64,
}

impl Arrays<'_> {
    /// All values of a section, each checked.
    fn values<T: std::fmt::Debug>(
        &self,
        (section, size): (&str, usize),
        decode: impl Fn(&[u8]) -> T,
        is_good: impl Fn(&T) -> bool,
        expected: &str,
    ) -> Result<Vec<T>, FormatError> {
        let bytes = self.sections.get(section)?;
        if self.patches.checked_mul(size as u64) != Some(bytes.len() as u64) {
            return Err(FormatError::unreadable(
                self.file,
                format!("{size} for each of {} patches", self.patches),
                format!("section \"{section}\" has {} bytes", bytes.len()),
            ));
        }
        let mut values = Vec::with_capacity(bytes.len() / size);
        for (patch, chunk) in bytes.chunks_exact(size).enumerate() {
            let value = decode(chunk);
            if !is_good(&value) {
                let place = format!("section \"{section}\", patch {patch}");
                return Err(FormatError::invalid(self.file, &place, format!("{value:?}"), expected));
            }
            values.push(value);
        }
        Ok(values)
    }
}

/// The JSON object that says where a solution comes from.
struct Header<'a> {
    file: &'a str,
    json: Value,
}

impl<'a> Header<'a> {
    fn parse(file: &'a str, bytes: &[u8]) -> Result<Self, FormatError> {
        let unreadable = |detail: String| FormatError::unreadable(file, "a JSON object", format!("header: {detail}"));
        if bytes.len() > LONGEST_HEADER {
            return Err(unreadable(format!("{} bytes are more than {LONGEST_HEADER}", bytes.len())));
        }
        let json: Value = serde_json::from_slice(bytes).map_err(|e| unreadable(e.to_string()))?;
        if json.is_object() { Ok(Self { file, json }) } else { Err(unreadable("is something else".to_owned())) }
    }

    fn provenance(&self) -> Result<Provenance, FormatError> {
        let method = match self.text("method")? {
            "solve" => Method::Solve,
            "reference" => Method::Reference,
            other => {
                let what = format!("the method \"{}\"", shortened(other));
                let hint = "This twinray knows \"solve\" and \"reference\": use the twinray that wrote the file";
                return Err(FormatError::unsupported(self.file, "header.method", what, hint));
            }
        };
        Ok(Provenance {
            software: self.text("software")?.to_owned(),
            method,
            scene: self.text("scene")?.to_owned(),
            fingerprint: self.fingerprint()?,
            rays: self.count("rays")?,
            seed: self.count("seed")?,
            settings: self.settings()?,
            relative_error: self.relative_error()?,
        })
    }

    fn invalid(&self, key: &str, expected: &str) -> FormatError {
        let found = self.json.get(key).map_or_else(|| "nothing".to_owned(), |v| shortened(&v.to_string()));
        FormatError::invalid(self.file, &format!("header.{key}"), found, expected)
    }

    fn text(&self, key: &str) -> Result<&str, FormatError> {
        self.json.get(key).and_then(Value::as_str).ok_or_else(|| self.invalid(key, "a text"))
    }

    fn count(&self, key: &str) -> Result<u64, FormatError> {
        self.json.get(key).and_then(Value::as_u64).ok_or_else(|| self.invalid(key, "a whole number of at least 0"))
    }

    fn fingerprint(&self) -> Result<u64, FormatError> {
        let text = self.text("fingerprint")?;
        // `from_str_radix` would take a sign as well.
        let digits = text.len() == 16 && text.bytes().all(|b| b.is_ascii_hexdigit());
        let value = digits.then(|| u64::from_str_radix(text, 16).ok()).flatten();
        value.ok_or_else(|| self.invalid("fingerprint", "16 hexadecimal digits"))
    }

    fn settings(&self) -> Result<Vec<(String, String)>, FormatError> {
        let pair = |value: &Value| match value.as_array()?.as_slice() {
            [Value::String(name), Value::String(text)] => Some((name.clone(), text.clone())),
            _ => None,
        };
        let pairs = self.json.get("settings").and_then(Value::as_array).map(|list| list.iter().map(pair).collect());
        pairs.flatten().ok_or_else(|| self.invalid("settings", "a list of pairs of texts"))
    }

    fn relative_error(&self) -> Result<f32, FormatError> {
        let value = match self.json.get("relative_error") {
            Some(Value::Null) => Some(f32::INFINITY),
            Some(Value::Number(n)) => n.as_f64().map(|x| x as f32).filter(|x| *x >= 0.0 && x.is_finite()),
            _ => None,
        };
        value.ok_or_else(|| self.invalid("relative_error", "a number of at least 0, or null"))
    }
}

/// What a stranger wrote, short enough for a message.
fn shortened(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { format!("{short}…") } else { short }
}
