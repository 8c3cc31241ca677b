//! As much of JSON as `cargo metadata` writes: this crate borrows nothing.

/// A JSON value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// null, true, false and numbers, as written.
    Word(String),
    /// A string.
    Text(String),
    /// An array.
    List(Vec<Value>),
    /// An object, in order.
    Map(Vec<(String, Value)>),
}

impl Value {
    /// Member of an object.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let Value::Map(members) = self else { return None };
        members.iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }

    /// Elements of the array `key` of an object; none if there is no such array.
    pub fn list(&self, key: &str) -> &[Value] {
        if let Some(Value::List(values)) = self.get(key) { values } else { &[] }
    }

    /// The string `key` of an object; empty if it is not one.
    pub fn text(&self, key: &str) -> &str {
        if let Some(Value::Text(text)) = self.get(key) { text } else { "" }
    }
}

/// Reads one value; `None` if `text` is not JSON.
pub fn parse(text: &str) -> Option<Value> {
    let mut rest = text.trim_start();
    let value = value(&mut rest)?;
    rest.is_empty().then_some(value)
}

/// Takes a value and the white space after it.
fn value(rest: &mut &str) -> Option<Value> {
    let parsed = match rest.chars().next()? {
        '"' => Value::Text(string(rest)?),
        '[' => {
            let mut items = Vec::new();
            sequence(rest, '[', ']', |rest| {
                items.push(value(rest)?);
                Some(())
            })?;
            Value::List(items)
        }
        '{' => {
            let mut members = Vec::new();
            sequence(rest, '{', '}', |rest| {
                let key = string(rest)?;
                *rest = rest.trim_start();
                skip(rest, ':')?;
                members.push((key, value(rest)?));
                Some(())
            })?;
            Value::Map(members)
        }
        _ => {
            let end = rest.find([',', ']', '}', ' ', '\n', '\r', '\t']).unwrap_or(rest.len());
            let (word, after) = rest.split_at(end);
            *rest = after;
            Value::Word(word.to_owned())
        }
    };
    *rest = rest.trim_start();
    Some(parsed)
}

fn sequence(rest: &mut &str, open: char, close: char, mut element: impl FnMut(&mut &str) -> Option<()>) -> Option<()> {
    skip(rest, open)?;
    if skip(rest, close).is_some() {
        return Some(());
    }
    loop {
        element(rest)?;
        if skip(rest, close).is_some() {
            return Some(());
        }
        skip(rest, ',')?;
    }
}

/// Takes one character and the white space after it.
fn skip(rest: &mut &str, c: char) -> Option<()> {
    *rest = rest.strip_prefix(c)?.trim_start();
    Some(())
}

fn string(rest: &mut &str) -> Option<String> {
    let mut chars = rest.strip_prefix('"')?.char_indices();
    let mut out = String::new();
    loop {
        let (at, c) = chars.next()?;
        match c {
            '"' => {
                *rest = &rest[at + 2..];
                return Some(out);
            }
            '\\' => match chars.next()?.1 {
                'n' => out.push('\n'),
                't' => out.push('\t'),
                'r' => out.push('\r'),
                'u' => {
                    let code: String = chars.by_ref().take(4).map(|(_, c)| c).collect();
                    // Surrogate pairs do not occur in names.
                    out.push(u32::from_str_radix(&code, 16).ok().and_then(char::from_u32).unwrap_or('?'));
                }
                other => out.push(other),
            },
            c => out.push(c),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_every_kind_are_read() {
        let text = r#" {"a": [1, "x\"\u00e4", null, []], "b": {} , "c" : "ö"} "#;
        let value = parse(text).unwrap();
        assert_eq!(value.list("a")[1], Value::Text("x\"ä".into()));
        assert_eq!(value.list("a")[3], Value::List(Vec::new()));
        assert_eq!(value.text("c"), "ö");
        assert_eq!(parse("{\"a\": }{"), None);
    }
}
