//! The JSON part of a glTF file: values that know where they stand.
//!
//! Lives here: a view of one JSON value with its path, so that every message names the element. Not here: what
//! the elements mean. The `gltf` crate is not used: it cuts indices to 32 bits, refuses integers written as 1.0
//! (which glTF allows), names no element when a type is wrong, refuses a file for faults in parts that light does
//! not need, and unpacks `{}` to many hundred bytes.

use serde_json::{Map, Value};

use crate::context::Context;
use crate::error::FormatError;
use crate::limits::as_name;

/// Parses `text` after asking for the memory that its tree will take.
pub(super) fn parse(context: &mut Context<'_>, text: &[u8]) -> Result<(Value, u64), FormatError> {
    // A UTF-8 byte order mark is forbidden by glTF and written by some text editors.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let bytes = tree_bytes(text);
    context.charge(bytes, "JSON")?;
    let value = serde_json::from_slice(text)
        .map_err(|error| FormatError::unreadable(context.file, "JSON text of glTF 2.0", error.to_string()))?;
    Ok((value, bytes))
}

/// Memory of the parsed tree, from counts of its punctuation: an object has a tree node of 640 bytes, each key a
/// string and its share of further nodes, each value 32 bytes in a vector that may be half full.
fn tree_bytes(text: &[u8]) -> u64 {
    let (mut bytes, mut in_string, mut escaped) = (text.len() as u64, false, false);
    for &b in text {
        if in_string {
            in_string = escaped || b != b'"';
            escaped = !escaped && b == b'\\';
            continue;
        }
        bytes += match b {
            b'{' => 640,
            b':' => 100,
            b'[' => 64,
            b',' => 32,
            _ => 0,
        };
        in_string = b == b'"';
    }
    bytes
}

/// One value of the document and the way to it.
#[derive(Clone)]
pub(super) struct Element<'a> {
    file: &'a str,
    /// For messages, such as `meshes[3] "sofa".primitives[0].indices`.
    pub(super) path: String,
    value: &'a Value,
}

impl<'a> Element<'a> {
    /// The whole document.
    pub(super) fn root(file: &'a str, value: &'a Value) -> Self {
        Self { file, path: String::new(), value }
    }

    /// Name of the file.
    pub(super) fn file(&self) -> &'a str {
        self.file
    }

    /// The value itself.
    pub(super) fn value(&self) -> &'a Value {
        self.value
    }

    /// The member `key`, if there is one. `null` counts as absent: some exporters write it.
    pub(super) fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key).filter(|v| !v.is_null())?;
        let dot = if self.path.is_empty() { "" } else { "." };
        Some(Self { file: self.file, path: format!("{}{dot}{key}", self.path), value })
    }

    /// The member `key`.
    pub(super) fn require(&self, key: &str, expected: &str) -> Result<Self, FormatError> {
        self.get(key).ok_or_else(|| {
            let element = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
            FormatError::invalid(self.file, &element, "nothing", expected)
        })
    }

    /// The extension `name` of this element.
    pub(super) fn extension(&self, name: &str) -> Option<Self> {
        self.get("extensions")?.get(name)
    }

    /// Number of items of the array `key`; 0 if it is absent.
    pub(super) fn count(&self, key: &str) -> usize {
        self.value.get(key).and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// Item `index` of the array `key`, its name in the path.
    pub(super) fn item(&self, key: &str, index: usize) -> Option<Self> {
        let value = self.value.get(key)?.as_array()?.get(index)?;
        let dot = if self.path.is_empty() { "" } else { "." };
        let name = match value.get("name").and_then(Value::as_str) {
            Some(name) if self.path.is_empty() => format!(" {:?}", name.chars().take(60).collect::<String>()),
            _ => String::new(),
        };
        Some(Self { file: self.file, path: format!("{}{dot}{key}[{index}]{name}", self.path), value })
    }

    /// All items of the array `key`; none if it is absent.
    pub(super) fn items(&self, key: &str) -> Result<impl Iterator<Item = Self>, FormatError> {
        if let Some(member) = self.get(key)
            && !member.value.is_array()
        {
            return Err(member.invalid("an array"));
        }
        let this = self.clone();
        let key = key.to_owned();
        Ok((0..self.count(&key)).filter_map(move |i| this.item(&key, i)))
    }

    /// Keys of this object.
    pub(super) fn keys(&self) -> impl Iterator<Item = &'a str> {
        self.value.as_object().into_iter().flatten().map(|(key, _)| key.as_str())
    }

    /// The non-negative integer `key`, if present.
    pub(super) fn integer(&self, key: &str) -> Result<Option<u64>, FormatError> {
        self.get(key).map(|member| member.as_integer()).transpose()
    }

    /// This value as a non-negative integer; 1.0 is one too.
    pub(super) fn as_integer(&self) -> Result<u64, FormatError> {
        integer(self.value).ok_or_else(|| self.invalid("a non-negative integer"))
    }

    /// The index `key` into the root's array `array`, and that item.
    pub(super) fn follow(&self, key: &str, root: &Self, array: &str) -> Result<Option<(usize, Self)>, FormatError> {
        self.get(key).map(|member| member.as_link(root, array)).transpose()
    }

    /// This value as an index into the root's array `array`, and that item.
    pub(super) fn as_link(&self, root: &Self, array: &str) -> Result<(usize, Self), FormatError> {
        let index = self.as_integer()?;
        let target = usize::try_from(index).ok().and_then(|i| Some((i, root.item(array, i)?)));
        target.ok_or_else(|| {
            let count = root.count(array);
            self.invalid(&format!("an index below {count}, the number of {array}"))
        })
    }

    /// The number `key`, if present.
    pub(super) fn number(&self, key: &str) -> Result<Option<f64>, FormatError> {
        let Some(member) = self.get(key) else { return Ok(None) };
        member.value.as_f64().filter(|v| v.is_finite()).map(Some).ok_or_else(|| member.invalid("a number"))
    }

    /// The array of `N` numbers `key`, if present.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, FormatError> {
        let Some(member) = self.get(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = member.value.as_array().and_then(|a| a.iter().map(Value::as_f64).collect());
        let array = numbers.and_then(|n| <[f64; N]>::try_from(n).ok()).filter(|n| n.iter().all(|v| v.is_finite()));
        array.map(Some).ok_or_else(|| member.invalid(&format!("an array of {N} numbers")))
    }

    /// The string `key`, if present.
    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>, FormatError> {
        let Some(member) = self.get(key) else { return Ok(None) };
        member.value.as_str().map(Some).ok_or_else(|| member.invalid("a string"))
    }

    /// The truth value `key`; false if absent or of another type.
    pub(super) fn flag(&self, key: &str) -> bool {
        self.value.get(key).and_then(Value::as_bool).unwrap_or(false)
    }

    /// The strings of the array `key`; what is not a string is passed over.
    pub(super) fn strings(&self, key: &str) -> Vec<&'a str> {
        self.value.get(key).and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect()
    }

    /// Its name, or `fallback`.
    pub(super) fn name_or(&self, fallback: impl FnOnce() -> String) -> String {
        let name = self.value.get("name").and_then(Value::as_str).filter(|n| !n.is_empty());
        name.map_or_else(fallback, |name| as_name(name).to_owned())
    }

    /// True if this value is a JSON object.
    pub(super) fn is_object(&self) -> bool {
        self.value.is_object()
    }

    /// The fault of this element being something else than `expected`.
    pub(super) fn invalid(&self, expected: &str) -> FormatError {
        let found = match self.value {
            Value::Array(items) => format!("an array of {}", items.len()),
            Value::Object(_) => "an object".to_owned(),
            Value::String(text) => format!("{:?}", text.chars().take(60).collect::<String>()),
            scalar => scalar.to_string(),
        };
        FormatError::invalid(self.file, &self.path, found, expected)
    }

    /// The fault of this element, in words.
    pub(super) fn fault(&self, found: impl Into<String>, expected: impl Into<String>) -> FormatError {
        FormatError::invalid(self.file, &self.path, found, expected)
    }
}

/// A value as a non-negative integer; 1.0 is one too.
pub(super) fn integer(value: &Value) -> Option<u64> {
    // Doubles are exact up to 2⁵³, far beyond any count in a file.
    let from_float = |v: f64| (v.fract() == 0.0 && (0.0..9.0e15).contains(&v)).then_some(v as u64);
    value.as_u64().or_else(|| value.as_f64().and_then(from_float))
}

/// A value as an index.
pub(super) fn index(value: &Value) -> Option<usize> {
    integer(value).and_then(|i| usize::try_from(i).ok())
}

/// The object `key` of `owner`, made if there is none. `None` if something else stands there.
pub(super) fn object<'v>(owner: &'v mut Value, key: &str) -> Option<&'v mut Map<String, Value>> {
    let member = owner.as_object_mut()?.entry(key).or_insert(Value::Null);
    if member.is_null() {
        *member = Value::Object(Map::new());
    }
    member.as_object_mut()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn punctuation_inside_strings_costs_nothing() {
        assert_eq!(tree_bytes(br#"["{\"{", "x"]"#), 13 + 64 + 32);
    }

    #[test]
    fn values_are_found_with_their_path() {
        let value = serde_json::json!({"meshes": [{"name": "m", "primitives": [{"indices": 1.0, "mode": -1}]}]});
        let root = Element::root("f.gltf", &value);
        let primitive = root.item("meshes", 0).unwrap().item("primitives", 0).unwrap();
        assert_eq!(primitive.integer("indices").unwrap(), Some(1));
        let message = primitive.integer("mode").unwrap_err().to_string();
        assert!(message.contains(r#"f.gltf: meshes[0] "m".primitives[0].mode: found -1"#), "{message}");
    }
}
