//! The header of a solution file: JSON that says where the light comes from.

use serde_json::{Value, json};

use super::{Method, Provenance, SceneSource, SolutionFile};
use crate::error::FormatError;

/// JSON of a few bytes unpacks to many: a header that is longer than this is none of ours.
const LONGEST_HEADER: usize = 1 << 20;

/// The header's bytes.
pub(super) fn write(solution: &SolutionFile) -> Vec<u8> {
    let p = &solution.provenance;
    // The shortest decimal of an f32 is exact in both directions, and short to read; JSON has no infinity.
    let error: Option<f64> = p.relative_error.is_finite().then(|| p.relative_error.to_string().parse().ok()).flatten();
    let settings: Vec<_> = p.settings.iter().map(|(name, value)| [name, value]).collect();
    let light: Vec<_> = p.source.light.iter().map(|(name, value)| [name, value]).collect();
    let size = p.source.patch_size.map(|s| if s.is_finite() { json!(s) } else { json!("inf") });
    let record = solution.record.as_ref();
    let header = json!({
        "software": p.software,
        "method": p.method.name(),
        "scene": p.scene,
        "source": {
            "file": p.source.file, "metres_per_unit": p.source.metres_per_unit, "patches": p.source.patches,
            "patch_size": size, "two_sided": p.source.two_sided, "light": light,
        },
        // A number of 64 bits does not survive every JSON reader.
        "fingerprint": format!("{:016x}", p.fingerprint),
        "units": "m, W (lm where radiance is in nit); irradiance W/m2 (lx)",
        "patches": solution.light.len(),
        "glossy_patches": record.map_or(0, |r| r.glossy()),
        "rays": p.rays,
        "seed": p.seed,
        "part": p.part,
        "seeds": p.seeds,
        "can_go_on": record.is_some_and(|r| r.can_go_on()),
        "settings": settings,
        "relative_error": error,
    });
    format!("{header:#}\n").into_bytes()
}

/// The JSON object that says where a solution comes from.
pub(super) struct Header<'a> {
    file: &'a str,
    json: Value,
}

impl<'a> Header<'a> {
    pub(super) fn parse(file: &'a str, bytes: &[u8]) -> Result<Self, FormatError> {
        let unreadable = |detail: String| FormatError::unreadable(file, "a JSON object", format!("header: {detail}"));
        if bytes.len() > LONGEST_HEADER {
            return Err(unreadable(format!("{} bytes are more than {LONGEST_HEADER}", bytes.len())));
        }
        let json: Value = serde_json::from_slice(bytes).map_err(|e| unreadable(e.to_string()))?;
        if json.is_object() { Ok(Self { file, json }) } else { Err(unreadable("is something else".to_owned())) }
    }

    pub(super) fn provenance(&self) -> Result<Provenance, FormatError> {
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
            source: self.source()?,
            fingerprint: self.fingerprint()?,
            rays: self.count("rays")?,
            seed: self.count("seed")?,
            part: self.part()?,
            seeds: self.seeds()?,
            settings: self.settings()?,
            relative_error: self.relative_error()?,
        })
    }

    /// A whole number of at least 0.
    pub(super) fn count(&self, key: &str) -> Result<u64, FormatError> {
        self.json.get(key).and_then(Value::as_u64).ok_or_else(|| self.invalid(key, "a whole number of at least 0"))
    }

    /// Yes or no.
    pub(super) fn flag(&self, key: &str) -> Result<bool, FormatError> {
        self.json.get(key).and_then(Value::as_bool).ok_or_else(|| self.invalid(key, "true or false"))
    }

    fn invalid(&self, key: &str, expected: &str) -> FormatError {
        let found = self.json.get(key).map_or_else(|| "nothing".to_owned(), |v| shortened(&v.to_string()));
        FormatError::invalid(self.file, &format!("header.{key}"), found, expected)
    }

    fn text(&self, key: &str) -> Result<&str, FormatError> {
        self.json.get(key).and_then(Value::as_str).ok_or_else(|| self.invalid(key, "a text"))
    }

    fn source(&self) -> Result<SceneSource, FormatError> {
        let source = || {
            let object = self.json.get("source")?.as_object()?;
            let positive = |v: &Value| v.as_f64().filter(|x| *x > 0.0 && x.is_finite());
            let optional = |key: &str| object.get(key).filter(|v| !v.is_null());
            Some(SceneSource {
                file: object.get("file")?.as_str()?.to_owned(),
                metres_per_unit: positive(object.get("metres_per_unit")?)?,
                patches: match optional("patches") {
                    Some(n) => Some(n.as_u64().filter(|n| *n > 0)?),
                    None => None,
                },
                patch_size: match optional("patch_size") {
                    Some(Value::String(text)) if text == "inf" => Some(f64::INFINITY),
                    Some(size) => Some(positive(size)?),
                    None => None,
                },
                two_sided: object.get("two_sided")?.as_bool()?,
                light: pairs(object.get("light")?)?,
            })
        };
        source().ok_or_else(|| self.invalid("source", "where the scene is and how it was cut"))
    }

    fn fingerprint(&self) -> Result<u64, FormatError> {
        let text = self.text("fingerprint")?;
        // `from_str_radix` would take a sign as well.
        let digits = text.len() == 16 && text.bytes().all(|b| b.is_ascii_hexdigit());
        let value = digits.then(|| u64::from_str_radix(text, 16).ok()).flatten();
        value.ok_or_else(|| self.invalid("fingerprint", "16 hexadecimal digits"))
    }

    fn part(&self) -> Result<Option<[u32; 2]>, FormatError> {
        let number = |v: &Value| v.as_u64().and_then(|n| u32::try_from(n).ok());
        match self.json.get("part").unwrap_or(&Value::Null) {
            Value::Null => return Ok(None),
            Value::Array(list) => match list[..] {
                [ref k, ref n] => number(k).zip(number(n)).filter(|(k, n)| (1..=*n).contains(k)),
                _ => None,
            },
            _ => None,
        }
        .map(|(k, n)| Some([k, n]))
        .ok_or_else(|| self.invalid("part", "null, or which of how many"))
    }

    fn seeds(&self) -> Result<Vec<u64>, FormatError> {
        let list = self.json.get("seeds").and_then(Value::as_array);
        let seeds = list.and_then(|list| list.iter().map(Value::as_u64).collect::<Option<Vec<u64>>>());
        let seeds = seeds.filter(|seeds| !seeds.is_empty() && seeds.is_sorted_by(|a, b| a < b));
        seeds.ok_or_else(|| self.invalid("seeds", "ascending whole numbers"))
    }

    fn settings(&self) -> Result<Vec<(String, String)>, FormatError> {
        let pairs = self.json.get("settings").and_then(pairs);
        pairs.ok_or_else(|| self.invalid("settings", "a list of pairs of texts"))
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

/// A list of pairs of texts.
fn pairs(value: &Value) -> Option<Vec<(String, String)>> {
    let pair = |value: &Value| match value.as_array()?.as_slice() {
        [Value::String(name), Value::String(text)] => Some((name.clone(), text.clone())),
        _ => None,
    };
    value.as_array()?.iter().map(pair).collect()
}

/// What a stranger wrote, short enough for a message.
fn shortened(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { format!("{short}…") } else { short }
}
