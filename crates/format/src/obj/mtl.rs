//! The text of an MTL file: material names and the values that have a meaning for light.
//!
//! Not here: what surfaces they become (`material`). Nothing in an MTL file ends the reading: a line that cannot
//! be read is a warning, and the value keeps its default.

use twinray_scene::Rgb;

use super::Line;
use crate::context::Context;
use crate::error::FormatError;

/// A material as written; `None` where the file says nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) ambient: Option<Rgb>,
    pub(super) diffuse: Option<Rgb>,
    pub(super) specular: Option<Rgb>,
    pub(super) emission: Option<Rgb>,
    pub(super) exponent: Option<f64>,
    pub(super) opacity: Option<f64>,
    pub(super) illumination: Option<f64>,
    /// Index of refraction, Ni.
    pub(super) ior: Option<f64>,
    /// Colour of what passes, Tf.
    pub(super) filter: Option<Rgb>,
    pub(super) diffuse_map: Option<Map>,
    pub(super) emission_map: Option<Map>,
    pub(super) opacity_map: Option<Map>,
    pub(super) normal_map: Option<Map>,
    /// The file of a height map.
    pub(super) bump_map: Option<String>,
}

/// A texture with those of its options that matter.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) file: String,
    pub(super) clamp: bool,
    /// Added to the coordinates, and before that multiplied with them: options -o and -s.
    pub(super) offset: [f64; 2],
    pub(super) scale: [f64; 2],
    /// Option -bm: how strong bumps are.
    pub(super) strength: f64,
}

/// Reads the MTL file `file`.
pub(super) fn parse(context: &mut Context<'_>, file: &str, bytes: &[u8]) -> Result<Vec<Entry>, FormatError> {
    let mut entries: Vec<Entry> = Vec::new();
    let text = super::text(file, bytes, "an MTL file")?;
    let copied = super::copied_bytes(&text);
    context.charge(copied, "text")?;
    for line in super::lines(&text) {
        if line.keyword.eq_ignore_ascii_case("newmtl") {
            context.charge(size_of::<Entry>() as u64 * 2 + line.rest.len() as u64, "materials")?;
            entries.push(Entry { name: line.name().to_owned(), ..Entry::default() });
            continue;
        }
        // Values before the first name belong to nothing.
        let Some(entry) = entries.last_mut() else { continue };
        if let Err(message) = set(context, file, entry, &line) {
            context.warnings.push(file, format!("line {}", line.number), format!("{message}: ignored"));
        }
    }
    drop(text);
    context.budget.release(copied);
    Ok(entries)
}

fn set(context: &mut Context<'_>, file: &str, entry: &mut Entry, line: &Line<'_>) -> Result<(), String> {
    let number = || line.numbers::<1>(file).map(|[v]| Some(v)).map_err(|e| e.without_place());
    let map = |context: &mut Context<'_>| parse_map(context, file, line).map(Some);
    match line.keyword.to_ascii_lowercase().as_str() {
        "ka" => entry.ambient = colour(line)?,
        "kd" => entry.diffuse = colour(line)?,
        "ks" => entry.specular = colour(line)?,
        "ke" => entry.emission = colour(line)?,
        "ns" => entry.exponent = number()?,
        "illum" => entry.illumination = number()?,
        "ni" => entry.ior = number()?,
        "tf" => entry.filter = colour(line)?,
        // `d` wins over `Tr`, its complement: files that give both often have the latter wrong.
        "d" => entry.opacity = line.numbers::<1>(file).map(|[v]| Some(v)).or_else(|_| halo(line))?,
        "tr" if entry.opacity.is_none() => entry.opacity = number()?.map(|v| 1.0 - v),
        "map_kd" => entry.diffuse_map = map(context)?,
        "map_ke" => entry.emission_map = map(context)?,
        "map_d" => entry.opacity_map = map(context)?,
        "norm" | "map_kn" => entry.normal_map = map(context)?,
        "bump" | "map_bump" => entry.bump_map = map(context)?.map(|m| m.file),
        _ => {}
    }
    Ok(())
}

/// `d -halo 0.5`: an opacity that depends on the angle; its constant is taken.
fn halo(line: &Line<'_>) -> Result<Option<f64>, String> {
    let value = line.rest.strip_prefix("-halo").and_then(|v| v.trim().parse::<f64>().ok());
    value.map(Some).ok_or_else(|| "found no number".to_owned())
}

/// One number for grey or three for RGB; other spaces are not known.
fn colour(line: &Line<'_>) -> Result<Option<Rgb>, String> {
    let words: Vec<&str> = line.rest.split_ascii_whitespace().take_while(|w| !w.starts_with('#')).collect();
    let numbers: Option<Vec<f64>> = words.iter().map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[grey]) => Ok(Some(Rgb::grey(grey))),
        Some(&[r, g, b, ..]) => Ok(Some(Rgb::new(r, g, b))),
        _ => Err(format!("found {:?}, expected three numbers", line.rest.chars().take(40).collect::<String>())),
    }
}

/// `map_Kd -clamp on -o 0 0 0 wood floor.png`: options first, then a name that may contain spaces.
fn parse_map(context: &mut Context<'_>, file: &str, line: &Line<'_>) -> Result<Map, String> {
    let mut map = Map { file: String::new(), clamp: false, offset: [0.0; 2], scale: [1.0; 2], strength: 1.0 };
    let mut rest = line.rest;
    while let Some(options) = rest.strip_prefix('-') {
        let (option, others) = first_word(options);
        rest = others;
        let mut word = || {
            let (word, others) = first_word(rest);
            rest = others;
            word
        };
        match option {
            "clamp" => map.clamp = word() == "on",
            "bm" => map.strength = word().parse().ok().filter(|v: &f64| v.is_finite()).unwrap_or(1.0),
            "blendu" | "blendv" | "cc" | "imfchan" | "type" | "texres" | "boost" | "colorspace" => {
                word();
            }
            "mm" => {
                word();
                word();
            }
            "o" | "s" | "t" => {
                let values;
                (values, rest) = up_to_three_numbers(rest);
                // What is left out keeps its default.
                let set = |target: &mut [f64; 2]| target.iter_mut().zip(&values).for_each(|(t, v)| *t = *v);
                match option {
                    "o" => set(&mut map.offset),
                    "s" => set(&mut map.scale),
                    _ => {
                        let place = format!("line {}", line.number);
                        context.warnings.push(file, place, format!("option -t of {} is ignored", line.keyword));
                    }
                }
            }
            other => return Err(format!("unknown option -{}", other.chars().take(20).collect::<String>())),
        }
    }
    if rest.is_empty() {
        return Err("found no file name".to_owned());
    }
    Ok(Map { file: rest.to_owned(), ..map })
}

/// The numbers at the start of `text`, at most three, and what follows them.
fn up_to_three_numbers(mut text: &str) -> (Vec<f64>, &str) {
    let mut numbers = Vec::new();
    while numbers.len() < 3 {
        let (word, others) = first_word(text);
        let Some(number) = word.parse().ok().filter(|v: &f64| v.is_finite()) else { break };
        numbers.push(number);
        text = others;
    }
    (numbers, text)
}

/// The text before the first white space and that after it; the former is empty if `text` begins with some.
fn first_word(text: &str) -> (&str, &str) {
    text.split_once(char::is_whitespace).map_or((text, ""), |(word, rest)| (word, rest.trim_start()))
}
