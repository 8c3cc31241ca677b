//! Keys of a camera's path, as a JSON file writes them down.
//!
//! Lives here: what the file says, and every fault of it with its place. Not here: what becomes of it (`motion`).

use std::path::Path;

use anyhow::{Context, bail};
use serde_json::Value;

use crate::files;

/// A file of keys.
#[derive(Debug)]
pub struct Keyframes {
    /// Its name.
    pub file: String,
    /// Frames per second.
    pub fps: Option<f64>,
    /// Straight from key to key.
    pub linear: bool,
    /// The keys; their times increase.
    pub keys: Vec<Key>,
}

/// One key; lengths in the scene's unit.
#[derive(Debug, Default, PartialEq)]
pub struct Key {
    /// Seconds.
    pub time: f64,
    /// A camera of the scene to start from.
    pub camera: Option<String>,
    /// Place.
    pub eye: Option<[f64; 3]>,
    /// What is looked at.
    pub target: Option<[f64; 3]>,
    /// Upwards.
    pub up: Option<[f64; 3]>,
    /// Vertical field of view, degrees.
    pub fov: Option<f64>,
    /// Distance that is sharp.
    pub focus: Option<f64>,
}

/// Bytes that a file of keys may have: some hundred thousand keys.
const MOST_BYTES: u64 = 64 << 20;

const FILE_FIELDS: [&str; 3] = ["fps", "linear", "keys"];
const KEY_FIELDS: [&str; 7] = ["time", "camera", "eye", "target", "up", "fov", "focus"];

impl Keyframes {
    /// Reads a file.
    pub fn read(name: &str) -> anyhow::Result<Self> {
        let path = Path::new(name);
        if !path.exists() {
            bail!("--path {name}: no such file; expected a file of keys, \"animation\" or \"animation:NAME\"");
        }
        let bytes = files::read(path, MOST_BYTES).with_context(|| format!("{name}: cannot be read"))?;
        Self::parse(name, &bytes)
    }

    fn parse(name: &str, bytes: &[u8]) -> anyhow::Result<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let document: Value =
            serde_json::from_slice(bytes).with_context(|| format!("{name}: expected JSON with the keys of a path"))?;
        let file = Field { at: name.to_owned(), value: &document };
        file.knows(&FILE_FIELDS)?;
        let fps = file.get("fps").map(|f| f.number_within(1e-3, 1000.0, "frames per second")).transpose()?;
        let linear = match file.get("linear") {
            None => false,
            Some(field) => match field.value.as_bool() {
                Some(linear) => linear,
                None => return Err(field.fault("true or false")),
            },
        };
        let Some(list) = file.get("keys") else { bail!("{name}: \"keys\" is missing; expected a list of keys") };
        let keys = list.value.as_array().filter(|keys| !keys.is_empty());
        let keys = keys.ok_or_else(|| list.fault("a list of one key at least"))?;
        let keys: Vec<Key> = keys
            .iter()
            .enumerate()
            .map(|(i, value)| key(&Field { at: format!("{name}: keys[{i}]"), value }))
            .collect::<anyhow::Result<_>>()?;
        for (i, pair) in keys.windows(2).enumerate() {
            if pair[1].time <= pair[0].time {
                bail!(
                    "{name}: keys[{}].time: found {}, expected more than {}, the time of the key before it",
                    i + 1,
                    pair[1].time,
                    pair[0].time
                );
            }
        }
        Ok(Self { file: name.to_owned(), fps, linear, keys })
    }
}

fn key(field: &Field<'_>) -> anyhow::Result<Key> {
    field.knows(&KEY_FIELDS)?;
    let at = &field.at;
    let Some(time) = field.get("time") else { bail!("{at}: \"time\" is missing; expected seconds") };
    let time = time.number_within(-1e9, 1e9, "seconds")?;
    let triple = |name: &str| field.get(name).map(|f| f.triple()).transpose();
    let camera = match field.get("camera") {
        None => None,
        // An index is a number to whoever writes JSON.
        Some(f) => match (f.value.as_str(), f.value.as_u64()) {
            (Some(name), _) => Some(name.to_owned()),
            (None, Some(index)) => Some(index.to_string()),
            (None, None) => return Err(f.fault("the name or index of a camera of the scene")),
        },
    };
    let (eye, target, up) = (triple("eye")?, triple("target")?, triple("up")?);
    let missing = [("eye", eye), ("target", target)].into_iter().find(|(_, v)| v.is_none());
    if let (Some((missing, _)), None) = (missing, &camera) {
        bail!("{at}: \"{missing}\" is missing; expected it, or a \"camera\" of the scene to start from");
    }
    if eye.is_some() && eye == target {
        bail!("{at}: \"eye\" and \"target\" are the same point; expected two different ones");
    }
    if up == Some([0.0; 3]) {
        bail!("{at}.up: found [0, 0, 0], expected a direction");
    }
    let positive = |name: &str, most: f64, what: &str| {
        field.get(name).map(|f| f.number_within(f64::MIN_POSITIVE, most, what)).transpose()
    };
    let fov = positive("fov", 179.999, "degrees, more than 0 and less than 180")?;
    let focus = positive("focus", 1e12, "a distance of more than 0")?;
    Ok(Key { time, camera, eye, target, up, fov, focus })
}

/// A value, and where it is.
struct Field<'a> {
    at: String,
    value: &'a Value,
}

impl<'a> Field<'a> {
    fn get(&self, name: &str) -> Option<Field<'a>> {
        let separator = if self.at.ends_with(']') { "." } else { ": " };
        self.value.get(name).map(|value| Field { at: format!("{}{separator}{name}", self.at), value })
    }

    /// Refuses what is no object, and fields that nobody reads: they are misspelt.
    fn knows(&self, known: &[&str]) -> anyhow::Result<()> {
        let Some(fields) = self.value.as_object() else { return Err(self.fault("an object")) };
        match fields.keys().find(|name| !known.contains(&name.as_str())) {
            Some(unknown) => bail!("{}: \"{unknown}\" is not known; expected of {}", self.at, known.join(", ")),
            None => Ok(()),
        }
    }

    fn fault(&self, expected: &str) -> anyhow::Error {
        let found: String = self.value.to_string().chars().take(60).collect();
        anyhow::anyhow!("{}: found {found}, expected {expected}", self.at)
    }

    fn number_within(&self, least: f64, most: f64, what: &str) -> anyhow::Result<f64> {
        self.value.as_f64().filter(|x| (least..=most).contains(x)).ok_or_else(|| self.fault(what))
    }

    fn triple(&self) -> anyhow::Result<[f64; 3]> {
        let numbers: Option<Vec<f64>> = self.value.as_array().and_then(|a| a.iter().map(Value::as_f64).collect());
        let triple = numbers.and_then(|n| <[f64; 3]>::try_from(n).ok()).filter(|t| t.iter().all(|x| x.abs() <= 1e12));
        triple.ok_or_else(|| self.fault("three numbers such as [1.5, 0, -2]"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> anyhow::Result<Keyframes> {
        Keyframes::parse("walk.json", text.as_bytes())
    }

    #[test]
    fn what_is_written_is_read() {
        let file = r#"{ "fps": 30, "linear": true, "keys": [
            { "time": 0, "eye": [0, 1, 2], "target": [0, 1.5, 0], "up": [0, 0, 1], "fov": 40, "focus": 2 },
            { "time": 1.5, "camera": "gallery" }, { "time": 2, "camera": 1, "eye": [1, 2, 3] } ] }"#;
        let path = parse(file).unwrap();
        assert_eq!((path.fps, path.linear, path.keys.len()), (Some(30.0), true, 3));
        let (eye, target) = (Some([0.0, 1.0, 2.0]), Some([0.0, 1.5, 0.0]));
        let up = Some([0.0, 0.0, 1.0]);
        assert_eq!(path.keys[0], Key { time: 0.0, camera: None, eye, target, up, fov: Some(40.0), focus: Some(2.0) });
        assert_eq!(path.keys[1], Key { time: 1.5, camera: Some("gallery".into()), ..Key::default() });
        assert_eq!(path.keys[2].camera.as_deref(), Some("1"));
    }

    #[test]
    fn every_fault_says_where_it_is() {
        let key = |fields: &str| {
            format!(r#"{{ "keys": [{{ "time": 0, "eye": [0,0,0], "target": [1,0,0] }}, {{{fields}}}] }}"#)
        };
        let cases = [
            ("{".to_owned(), "expected JSON"),
            ("[]".into(), "walk.json: found [], expected an object"),
            ("{}".into(), "walk.json: \"keys\" is missing"),
            (r#"{"keys": []}"#.into(), "walk.json: keys: found [], expected a list of one key at least"),
            (r#"{"keyz": []}"#.into(), "walk.json: \"keyz\" is not known; expected of fps, linear, keys"),
            (r#"{"fps": 0, "keys": []}"#.into(), "walk.json: fps: found 0, expected frames per second"),
            (r#"{"linear": 1, "keys": []}"#.into(), "walk.json: linear: found 1, expected true or false"),
            (key(""), "walk.json: keys[1]: \"time\" is missing"),
            (key(r#""time": "1""#), "walk.json: keys[1].time: found \"1\", expected seconds"),
            (key(r#""time": 1"#), "walk.json: keys[1]: \"eye\" is missing"),
            (key(r#""time": 1, "eye": [0, 0, 0]"#), "walk.json: keys[1]: \"target\" is missing"),
            (key(r#""time": 1, "eye": [0, 0]"#), "walk.json: keys[1].eye: found [0,0], expected three numbers"),
            (key(r#""time": 1, "eye": [0, 0, null]"#), "walk.json: keys[1].eye: found [0,0,null]"),
            (
                key(r#""time": 1, "eye": [1,1,1], "target": [1,1,1]"#),
                "walk.json: keys[1]: \"eye\" and \"target\" are the same point",
            ),
            (key(r#""time": 1, "camera": "a", "up": [0,0,0]"#), "walk.json: keys[1].up: found [0, 0, 0]"),
            (key(r#""time": 1, "camera": "a", "fov": 180"#), "walk.json: keys[1].fov: found 180, expected degrees"),
            (key(r#""time": 1, "camera": "a", "focus": 0"#), "walk.json: keys[1].focus: found 0, expected a distance"),
            (key(r#""time": 1, "camera": []"#), "walk.json: keys[1].camera: found [], expected the name or index"),
            (
                key(r#""time": 1, "camera": "a", "roll": 3"#),
                "walk.json: keys[1]: \"roll\" is not known; expected of time, camera, eye",
            ),
            (
                key(r#""time": 0, "camera": "a""#),
                "walk.json: keys[1].time: found 0, expected more than 0, the time of the key before",
            ),
        ];
        for (text, says) in cases {
            let message = format!("{:#}", parse(&text).expect_err(&text));
            assert!(message.starts_with("walk.json") && message.contains(says), "{text}: {message}, expected {says}");
        }
    }
}
