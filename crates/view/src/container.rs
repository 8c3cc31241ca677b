//! One file of a JSON header and arrays: what the page reads without parsing numbers.
//!
//! `twinwalk`, the header's length in bytes as u32, four zero bytes, the header (UTF-8, padded with spaces to a multiple
//! of 8), then the arrays, each at a multiple of 8 bytes. The header's `arrays` names them: `{"type": "f32", "offset":
//! bytes after the header, "length": numbers}`. Everything is little-endian, as browsers' machines are.

use serde_json::{Map, Value, json};

const MAGIC: &[u8; 8] = b"twinwalk";
const ALIGN: usize = 8;

/// A container in the making.
#[derive(Debug, Default)]
pub struct Container {
    arrays: Map<String, Value>,
    bytes: Vec<u8>,
}

impl Container {
    /// Adds numbers under a name.
    pub fn add<T: Number>(&mut self, name: &str, numbers: impl IntoIterator<Item = T>) {
        let offset = self.bytes.len();
        let mut length = 0;
        for number in numbers {
            number.put(&mut self.bytes);
            length += 1;
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(ALIGN), 0);
        self.arrays.insert(name.to_owned(), json!({ "type": T::NAME, "offset": offset, "length": length }));
    }

    /// The bytes, with a header of whatever else is to be said: an object.
    pub fn finish(self, mut header: Value) -> Vec<u8> {
        header["arrays"] = Value::Object(self.arrays);
        let mut text = header.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(ALIGN), b' ');
        let mut bytes = Vec::with_capacity(2 * ALIGN + text.len() + self.bytes.len());
        bytes.extend(MAGIC);
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(text);
        bytes.extend(self.bytes);
        bytes
    }
}

/// Numbers of typed arrays.
pub trait Number {
    /// Its name in the header.
    const NAME: &'static str;
    /// Appends it.
    fn put(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($type:ty),*) => { $(
        impl Number for $type {
            const NAME: &'static str = stringify!($type);
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    )* };
}
number!(u8, i8, i16, u16, u32, f32);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_lie_where_the_header_says() {
        let mut container = Container::default();
        container.add("a", [1_u8, 2, 3]);
        container.add("b", [1.5_f32, -2.0]);
        let bytes = container.finish(json!({ "name": "Zürich" }));
        assert_eq!(&bytes[..8], MAGIC);
        let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
        let header: Value = serde_json::from_slice(&bytes[16..16 + length]).unwrap();
        assert_eq!(header["name"], "Zürich");
        assert_eq!(header["arrays"]["a"], json!({ "type": "u8", "offset": 0, "length": 3 }));
        let b = &header["arrays"]["b"];
        assert_eq!((b["type"].as_str(), b["length"].as_u64()), (Some("f32"), Some(2)));
        let at = 16 + length + b["offset"].as_u64().unwrap() as usize;
        assert_eq!(at % ALIGN, 0);
        assert_eq!(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()), 1.5);
        assert_eq!(bytes.len() % ALIGN, 0);
    }
}
