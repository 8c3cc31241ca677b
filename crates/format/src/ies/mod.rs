//! Photometric files of luminaires, IESNA LM-63 of 1986 to 2019: text to intensities and back.
//!
//! Type C photometry is read, with all of its symmetries, which are unfolded to the whole sphere; types A and B are
//! refused. Not here: what the light does (scene). `numbers` finds the numbers and their lines.

mod numbers;

use std::fmt::Write as _;

use twinray_scene::LightProfile;

use crate::error::FormatError;
use crate::limits::{Limits, as_name};
use numbers::Numbers;

/// Reads an IES file. `name` is for messages, and the profile's name.
///
/// Candela values are multiplied by the file's factors: multiplier, ballast factor and, before 2002, the
/// ballast-lamp photometric factor. A `TILT=INCLUDE` table is passed over: it tells of other positions of the lamp.
///
/// # Errors
/// `Invalid` with the line, and what was expected there; `Unsupported` for photometry of types A and B and for tilt in another
/// file; `OverLimit` beyond `max_file_bytes`.
///
/// # Panics
/// Never, whatever the bytes.
pub fn read_ies(name: &str, bytes: &[u8], limits: &Limits) -> Result<LightProfile, FormatError> {
    if bytes.len() as u64 > limits.max_file_bytes {
        return Err(FormatError::OverLimit {
            file: name.to_owned(),
            element: "file".to_owned(),
            limit: "max_file_bytes",
            needed: format!("{} bytes", bytes.len()),
            allowed: limits.max_file_bytes,
        });
    }
    // Names of manufacturers come in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let (first, tilt, mut numbers) = head(name, &text)?;
    match tilt {
        "NONE" => {}
        "INCLUDE" => pass_tilt(&mut numbers)?,
        other => {
            let hint = "Put its table into the file (TILT=INCLUDE), or write TILT=NONE for an upright luminaire";
            return Err(FormatError::unsupported(
                name,
                "TILT",
                format!("tilt in the file \"{}\"", as_name(other)),
                hint,
            ));
        }
    }
    let header = Header::read(&mut numbers, name, first)?;
    let vertical = numbers.list(header.vertical, "vertical angles")?;
    ascending(&numbers, &vertical, "vertical angles that ascend within 0 to 180 degrees", 180.0)?;
    let horizontal = numbers.list(header.horizontal, "horizontal angles")?;
    ascending(&numbers, &horizontal, "horizontal angles that ascend within 0 to 360 degrees", 360.0)?;
    let (horizontal, order) = unfold(&numbers, &horizontal)?;
    let mut planes = Vec::new();
    for k in 0..header.horizontal {
        let what = format!("candela values of plane {} of {}", k + 1, header.horizontal);
        let mut plane = numbers.list(header.vertical, &what)?;
        for value in &mut plane {
            // Measured noise around nothing may be negative by a hair.
            if *value < 0.0 && *value > -1e-3 {
                *value = 0.0;
            }
            *value *= header.factor;
            if !(0.0..=limits.max_radiance).contains(value) {
                let expected = format!("an intensity of 0 to {:e} (Limits::max_radiance)", limits.max_radiance);
                return Err(numbers.invalid(format!("{value} cd"), expected));
            }
        }
        planes.push(plane);
    }
    let candela = order.iter().flat_map(|&k| planes[k].iter().map(|&c| c as f32)).collect();
    Ok(LightProfile { name: as_name(name).to_owned(), vertical: to_f32(&vertical), horizontal, candela })
}

/// A profile as an IES file of 2002, absolute photometry; [`read_ies`] gives the same one back.
pub(crate) fn write_ies(profile: &LightProfile) -> Vec<u8> {
    let list = |values: &[f32]| {
        let mut text = String::new();
        // Lines may have 132 characters.
        for line in values.chunks(10) {
            let words: Vec<String> = line.iter().map(f32::to_string).collect();
            let _ = writeln!(text, "{}", words.join(" "));
        }
        text
    };
    let (vertical, horizontal) = (&profile.vertical, &profile.horizontal);
    let mut text = "IESNA:LM-63-2002\nTILT=NONE\n".to_owned();
    let _ = writeln!(text, "1 -1 1 {} {} 1 2 0 0 0\n1 1 0", vertical.len(), horizontal.len());
    text += &list(vertical);
    text += &list(horizontal);
    for plane in profile.candela.chunks(vertical.len().max(1)) {
        text += &list(plane);
    }
    text.into_bytes()
}

/// The first line, what tilt is said to be, and the numbers after that.
fn head<'a>(name: &'a str, text: &'a str) -> Result<(&'a str, &'a str, Numbers<'a>), FormatError> {
    let mut rest = text;
    let mut line = 0;
    let first = text.lines().next().unwrap_or_default().trim();
    while !rest.is_empty() {
        line += 1;
        let (this, after) = rest.split_once('\n').unwrap_or((rest, ""));
        if let Some(tilt) = this.trim().strip_prefix("TILT=") {
            return Ok((first, tilt.trim(), Numbers::new(name, after, line)));
        }
        rest = after;
    }
    let detail = format!("has no line that begins with TILT= among its {line} lines");
    Err(FormatError::unreadable(name, "an IES file (LM-63)", detail))
}

/// Passes over the table of a lamp's output at other angles.
fn pass_tilt(numbers: &mut Numbers) -> Result<(), FormatError> {
    numbers.next("the lamp's position in the luminaire, 1 to 3")?;
    let count = numbers.count("the number of tilt angles", 10_000)?;
    numbers.list(count, "tilt angles")?;
    numbers.list(count, "tilt factors").map(|_| ())
}

struct Header {
    vertical: usize,
    horizontal: usize,
    factor: f64,
}

impl Header {
    fn read(numbers: &mut Numbers, name: &str, first: &str) -> Result<Self, FormatError> {
        numbers.next("the number of lamps")?;
        numbers.next("lumens per lamp")?;
        let multiplier = numbers.positive("the multiplier of candela values")?;
        let vertical = numbers.count("the number of vertical angles", numbers.most())?;
        let horizontal = numbers.count("the number of horizontal angles", numbers.most())?;
        match numbers.next("the photometric type, 1 to 3")? {
            1.0 => {}
            found @ (2.0 | 3.0) => {
                let what = format!("photometry of type {}", if found == 2.0 { "B" } else { "A" });
                let hint = "Ask the manufacturer for a file of type C, or convert it with a photometric tool";
                return Err(FormatError::unsupported(name, &numbers.place(), what, hint));
            }
            found => return Err(numbers.invalid(found.to_string(), "a photometric type of 1 (C), 2 (B) or 3 (A)")),
        }
        for what in ["the type of units, 1 or 2", "the width", "the length", "the height"] {
            numbers.next(what)?;
        }
        let ballast = numbers.positive("the ballast factor")?;
        let lamp = numbers.next("the ballast-lamp factor")?;
        numbers.next("the watts")?;
        // From 2002 on the place is reserved, whatever stands there.
        let reserved = ["2002", "2019"].iter().any(|year| first.contains(year));
        let lamp = if reserved || lamp <= 0.0 { 1.0 } else { lamp };
        Ok(Self { vertical, horizontal, factor: multiplier * ballast * lamp })
    }
}

fn ascending(numbers: &Numbers, angles: &[f64], expected: &str, most: f64) -> Result<(), FormatError> {
    let stored = to_f32(angles);
    if let Some(k) = angles.iter().position(|a| !(0.0..=most).contains(a)) {
        return Err(numbers.invalid(format!("angle {} = {}", k + 1, angles[k]), expected));
    }
    match stored.windows(2).position(|pair| pair[0] >= pair[1]) {
        Some(k) => Err(numbers.invalid(format!("{} followed by {}", angles[k], angles[k + 1]), expected)),
        None => Ok(()),
    }
}

/// Horizontal angles of the whole circle, and the plane of the file that each repeats.
fn unfold(numbers: &Numbers, angles: &[f64]) -> Result<(Vec<f32>, Vec<usize>), FormatError> {
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    let mut all: Vec<(f64, usize)> = angles.iter().copied().zip(0..).collect();
    let mirror = |about: f64, all: &mut Vec<(f64, usize)>| {
        let mirrored: Vec<(f64, usize)> = all.iter().map(|&(c, k)| ((2.0 * about - c).rem_euclid(360.0), k)).collect();
        all.extend(mirrored);
    };
    match (first, last) {
        _ if angles.len() == 1 => return Ok((vec![0.0], vec![0])),
        (0.0, 90.0) => {
            mirror(90.0, &mut all);
            mirror(180.0, &mut all);
        }
        (0.0, 180.0) => mirror(180.0, &mut all),
        (90.0, 270.0) => mirror(90.0, &mut all),
        // Some leave out the last plane, which is the first.
        (0.0, last) if last > 180.0 => {}
        _ => {
            let expected = "horizontal angles from 0 to 0, 90, 180 or 360, or from 90 to 270 degrees";
            return Err(numbers.invalid(format!("{first} to {last} degrees"), expected));
        }
    }
    all.iter_mut().filter(|(c, _)| *c == 360.0).for_each(|(c, _)| *c = 0.0);
    // Where planes meet themselves in the mirror, the file's own comes first.
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-4);
    let closing = if last == 360.0 { angles.len() - 1 } else { all[0].1 };
    all.push((360.0, closing));
    Ok(all.into_iter().map(|(c, k)| (c as f32, k)).unzip())
}

fn to_f32(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&v| v as f32).collect()
}
