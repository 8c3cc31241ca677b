//! Results as files: `benches/results/PART.json`, written by one run and read by any later one.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::origin::Origin;

/// A part's result and where it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of the part.
    pub part: String,
    /// Commit and machine.
    pub origin: Origin,
    /// Time that the measurement took.
    pub seconds: f64,
    /// Whatever the part measured.
    pub result: Value,
}

impl Record {
    /// As JSON.
    pub fn text(&self) -> String {
        let value = json!({
            "part": self.part,
            "commit": self.origin.commit,
            "processor": self.origin.processor,
            "cores": self.origin.cores,
            "seconds": self.seconds,
            "result": self.result,
        });
        format!("{value:#}\n")
    }

    /// What [`Record::text`] wrote.
    pub fn parse(text: &str) -> Result<Self, String> {
        let value: Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let top = Reader::new(&value);
        Ok(Self {
            part: top.get("part")?.text()?.to_owned(),
            origin: Origin {
                commit: top.get("commit")?.text()?.to_owned(),
                processor: top.get("processor")?.text()?.to_owned(),
                cores: top.get("cores")?.number()? as usize,
            },
            seconds: top.get("seconds")?.number()?,
            result: top.get("result")?.value.clone(),
        })
    }

    /// Writes the file of this part.
    pub fn write(&self, root: &Path) -> Result<(), String> {
        let path = path(root, &self.part);
        path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|e| format!("{}: {e}", path.display()))?;
        std::fs::write(&path, self.text()).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// The stored result of a part; `None` if there is none.
    pub fn read(root: &Path, part: &str) -> Result<Option<Self>, String> {
        let path = path(root, part);
        if !path.exists() {
            return Ok(None);
        }
        let named = |e: String| format!("{}: {e}", path.display());
        let text = std::fs::read_to_string(&path).map_err(|e| named(e.to_string()))?;
        Self::parse(&text).map(Some).map_err(named)
    }
}

fn path(root: &Path, part: &str) -> PathBuf {
    root.join("benches/results").join(part).with_extension("json")
}

/// A JSON value that names itself when it is not what was expected.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    value: &'a Value,
    place: String,
}

impl<'a> Reader<'a> {
    /// The whole document.
    pub fn new(value: &'a Value) -> Self {
        Self { value, place: String::new() }
    }

    /// A member of an object.
    pub fn get(&self, key: &str) -> Result<Self, String> {
        let place = format!("{}/{key}", self.place);
        match self.value.get(key) {
            Some(value) => Ok(Self { value, place }),
            None => Err(format!("{place} is missing: measure this part anew")),
        }
    }

    /// All members of an object.
    pub fn members(&self) -> Result<Vec<(String, Self)>, String> {
        let members = self.value.as_object().ok_or_else(|| self.is_not("an object"))?;
        let reader =
            |(key, value): (&String, &'a Value)| (key.clone(), Self { value, place: format!("{}/{key}", self.place) });
        Ok(members.iter().map(reader).collect())
    }

    /// The elements of an array.
    pub fn items(&self) -> Result<Vec<Self>, String> {
        let items = self.value.as_array().ok_or_else(|| self.is_not("an array"))?;
        let reader = |(k, value)| Self { value, place: format!("{}/{k}", self.place) };
        Ok(items.iter().enumerate().map(reader).collect())
    }

    /// A number.
    pub fn number(&self) -> Result<f64, String> {
        self.value.as_f64().ok_or_else(|| self.is_not("a number"))
    }

    /// A string.
    pub fn text(&self) -> Result<&'a str, String> {
        self.value.as_str().ok_or_else(|| self.is_not("a string"))
    }

    fn is_not(&self, expected: &str) -> String {
        format!("{} is not {expected}: measure this part anew", self.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let origin = Origin { commit: "abc".into(), processor: "Some \"9\"".into(), cores: 2 };
        let result = json!({"rates": [0.1, 1e300, 3], "scene": "hall"});
        let record = Record { part: "kernel".into(), origin, seconds: 1.0 / 3.0, result };
        assert_eq!(Record::parse(&record.text()), Ok(record));
    }

    #[test]
    fn faults_name_their_place() {
        let value = json!({"a": [{"b": "x"}]});
        let item = &Reader::new(&value).get("a").unwrap().items().unwrap()[0];
        assert!(item.get("b").unwrap().number().unwrap_err().starts_with("/a/0/b is not a number"));
        assert!(item.get("c").unwrap_err().starts_with("/a/0/c is missing"));
        assert!(Record::parse("{}").unwrap_err().starts_with("/part is missing"));
    }
}
