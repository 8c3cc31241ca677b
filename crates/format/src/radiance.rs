//! Pictures of all directions: Radiance `.hdr` and OpenEXR, as maps of radiance.
//!
//! Lives here: what both have in common, and Radiance's format (G. Ward, "Real pixels", Graphics Gems II, 1991), in all
//! orientations, plain or in either run-length coding. EXR is read by `picture`.

use twinray_scene::RadianceMap;

use crate::error::FormatError;
use crate::limits::{Limits, as_name};
use crate::picture::{read_exr, within, within_texels};
use crate::warning::{Warning, Warnings};

/// Reads an equirectangular map; the first bytes tell the format. `name` is for messages, and the map's name. Values are linear
/// and taken for Rec. 709; negative ones become 0, and what is above `max_radiance` that, with a warning.
///
/// # Errors
/// `Unreadable` if the bytes are neither, or damaged; `Unsupported` for EXR compressions that cannot be read (DWAA, DWAB); `Invalid`
/// if a pixel is not finite; `OverLimit` beyond `max_file_bytes` or `max_image_texels`.
///
/// # Panics
/// Never, whatever the bytes.
pub fn read_radiance_map(
    name: &str,
    bytes: &[u8],
    limits: &Limits,
) -> Result<(RadianceMap, Vec<Warning>), FormatError> {
    within(name, "max_file_bytes", bytes.len() as u64, limits.max_file_bytes, "bytes")?;
    let (width, height, mut pixels) = if bytes.starts_with(b"#?") {
        read_hdr(name, bytes, limits)?
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        let image = read_exr(name, bytes, limits)?.image;
        (image.width, image.height, image.pixels)
    } else {
        let expected = "a Radiance (.hdr) or OpenEXR (.exr) picture";
        return Err(FormatError::unreadable(name, expected, "is of neither kind"));
    };
    let mut warnings = Warnings::default();
    let most = limits.max_radiance as f32;
    let (mut negative, mut bright) = (0u64, 0u64);
    for value in pixels.as_flattened_mut() {
        negative += u64::from(*value < 0.0);
        bright += u64::from(*value > most);
        *value = value.clamp(0.0, most);
    }
    if negative > 0 {
        warnings.push(name, "the map", format!("{negative} negative values are taken as 0"));
    }
    if bright > 0 {
        warnings.push(name, "the map", format!("{bright} values are brought down to {most:e} (Limits::max_radiance)"));
    }
    if width != 2 * height {
        let message = format!("has {width}×{height} pixels: maps of all directions are twice as wide as high");
        warnings.push(name, "the map", message);
    }
    Ok((RadianceMap { name: as_name(name).to_owned(), width, height, pixels }, warnings.finish(name)))
}

/// Width, height and pixels, first row on top.
type Pixels = (u32, u32, Vec<[f32; 3]>);

fn read_hdr(name: &str, bytes: &[u8], limits: &Limits) -> Result<Pixels, FormatError> {
    let unreadable = |detail: String| FormatError::unreadable(name, "a Radiance picture (.hdr)", detail);
    let mut rest = bytes;
    let line = |rest: &mut &[u8]| -> Result<String, FormatError> {
        let end = rest.iter().take(4096).position(|&b| b == b'\n');
        let end = end.ok_or_else(|| unreadable("its header has no end".into()))?;
        let text = String::from_utf8_lossy(&rest[..end]).trim().to_owned();
        *rest = &rest[end + 1..];
        Ok(text)
    };
    let mut header = Header { exposure: 1.0, colour: [1.0; 3], xyz: false };
    loop {
        let text = line(&mut rest)?;
        if text.is_empty() {
            break;
        }
        header.entry(&text).map_err(&unreadable)?;
    }
    let size = line(&mut rest)?;
    let axes = Axes::parse(&size).ok_or_else(|| {
        let size: String = size.chars().take(60).collect();
        unreadable(format!("its size is {size:?} instead of such as \"-Y 512 +X 1024\""))
    })?;
    let (width, height) = axes.size();
    within_texels(name, u64::from(width), u64::from(height), limits)?;
    if width == 0 || height == 0 {
        return Err(unreadable("has no pixels".into()));
    }
    let mut pixels = vec![[0.0f32; 3]; width as usize * height as usize];
    let mut scanline = vec![[0u8; 4]; axes.length as usize];
    for row in 0..axes.lines {
        read_line(&mut rest, &mut scanline)
            .ok_or_else(|| unreadable(format!("is cut off or damaged in line {row}")))?;
        for (k, rgbe) in (0..).zip(&scanline) {
            pixels[axes.index(row, k)] = header.colour_of(*rgbe);
        }
    }
    if let Some(k) = pixels.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        let place = format!("pixel ({}, {})", k % width as usize, k / width as usize);
        return Err(FormatError::invalid(name, &place, format!("{:?}", pixels[k]), "finite numbers"));
    }
    Ok((width, height, pixels))
}

/// What the header says of values.
struct Header {
    /// Product of all: values were multiplied by it.
    exposure: f64,
    colour: [f64; 3],
    /// CIE XYZ instead of RGB.
    xyz: bool,
}

impl Header {
    fn entry(&mut self, text: &str) -> Result<(), String> {
        let Some((key, value)) = text.split_once('=') else { return Ok(()) };
        let numbers = || value.split_whitespace().map(str::parse::<f64>).collect::<Result<Vec<_>, _>>().ok();
        let positive = |x: &f64| *x > 0.0 && x.is_finite();
        match key.trim() {
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => self.xyz = false,
                "32-bit_rle_xyze" => self.xyz = true,
                other => {
                    return Err(format!("has the unknown format {:?}", other.chars().take(40).collect::<String>()));
                }
            },
            "EXPOSURE" => match numbers().as_deref() {
                Some([x]) if positive(x) => self.exposure *= x,
                _ => return Err("has an EXPOSURE that is no positive number".into()),
            },
            "COLORCORR" => match numbers().as_deref() {
                Some(c @ [_, _, _]) if c.iter().all(positive) => {
                    self.colour.iter_mut().zip(c).for_each(|(all, c)| *all *= c);
                }
                _ => return Err("has a COLORCORR that is not three positive numbers".into()),
            },
            _ => {}
        }
        Ok(())
    }

    fn colour_of(&self, [r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
        if exponent == 0 {
            return [0.0; 3];
        }
        // Mantissas were cut off: the middle of what they stand for, as Radiance itself has it.
        let scale = libm::scalbn(1.0, i32::from(exponent) - 136) / self.exposure;
        let [x, y, z] = [r, g, b].map(|m| (f64::from(m) + 0.5) * scale);
        let value = match self.xyz {
            true => [
                3.240_6 * x - 1.537_2 * y - 0.498_6 * z,
                -0.968_9 * x + 1.875_8 * y + 0.041_5 * z,
                0.055_7 * x - 0.204 * y + 1.057 * z,
            ],
            false => [x, y, z],
        };
        std::array::from_fn(|c| (value[c] / self.colour[c]) as f32)
    }
}

/// How scanlines lie in the picture.
struct Axes {
    /// Number of scanlines, and pixels in each.
    lines: u32,
    length: u32,
    /// True if scanlines are rows.
    rows: bool,
    /// Whether lines and pixels come backwards: from below, from the right.
    backwards: [bool; 2],
}

impl Axes {
    fn parse(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let [first, lines, second, length] = words[..] else { return None };
        let rows = match (&first.get(1..)?, &second.get(1..)?) {
            (&"Y", &"X") => true,
            (&"X", &"Y") => false,
            _ => return None,
        };
        // Y grows upwards, so that −Y is from above; X to the right.
        let backwards = |axis: &str| match axis {
            "-Y" | "+X" => Some(false),
            "+Y" | "-X" => Some(true),
            _ => None,
        };
        let number = |word: &str| word.parse().ok().filter(|n| *n <= 1 << 30);
        let backwards = [backwards(first)?, backwards(second)?];
        Some(Self { lines: number(lines)?, length: number(length)?, rows, backwards })
    }

    fn size(&self) -> (u32, u32) {
        if self.rows { (self.length, self.lines) } else { (self.lines, self.length) }
    }

    /// Index of pixel `k` of scanline `line`.
    fn index(&self, line: u32, k: u32) -> usize {
        let turned = |at: u32, of: u32, backwards: bool| if backwards { of - 1 - at } else { at };
        let (line, k) = (turned(line, self.lines, self.backwards[0]), turned(k, self.length, self.backwards[1]));
        let (x, y) = if self.rows { (k, line) } else { (line, k) };
        y as usize * self.size().0 as usize + x as usize
    }
}

/// One scanline; `None` if the bytes end too soon or mean nothing.
fn read_line(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let length = line.len();
    if let [2, 2, high, low, ..] = **rest
        && (8..0x8000).contains(&length)
        && usize::from(high) << 8 | usize::from(low) == length
    {
        *rest = &rest[4..];
        for channel in 0..4 {
            let mut at = 0;
            while at < length {
                let (&count, after) = rest.split_first()?;
                // Above 128 a run of one value, otherwise so many values.
                let run = count > 128;
                let count = usize::from(if run { count - 128 } else { count });
                let (values, after) = after.split_at_checked(if run { 1 } else { count })?;
                *rest = after;
                if count == 0 {
                    return None;
                }
                for k in 0..count {
                    line.get_mut(at + k)?[channel] = values[if run { 0 } else { k }];
                }
                at += count;
            }
        }
        return Some(());
    }
    // Plain pixels, and of old files runs of the last one: 1, 1, 1 and their number, more digits following each other.
    let (mut at, mut shift) = (0, 0);
    while at < length {
        let (pixel, after) = rest.split_first_chunk::<4>()?;
        *rest = after;
        match *pixel {
            [1, 1, 1, count] => {
                let count = usize::from(count).checked_shl(shift)?;
                let last = *line.get(at.checked_sub(1)?)?;
                line.get_mut(at..at.checked_add(count)?)?.fill(last);
                at += count;
                shift += 8;
                if shift > 24 {
                    return None;
                }
            }
            pixel => {
                line[at] = pixel;
                at += 1;
                shift = 0;
            }
        }
    }
    Some(())
}
