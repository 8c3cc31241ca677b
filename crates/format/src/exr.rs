//! OpenEXR pictures: linear RGB, with the colour space and where they come from in the header.
//!
//! Not here: tone mapping (render), PNG (`png`).

use std::io::Cursor;

use exr::meta::attribute::Chromaticities;
use exr::meta::header::standard_names;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Text, Vec2, WritableImage,
};
use twinray_render::Aovs;

/// The bytes of an OpenEXR file with the 32-bit channels R, G and B, compressed without loss (ZIP).
///
/// `pixels` is `[height, width]` in linear Rec. 709, first row on top; the header says so in `chromaticities`.
/// `white_luminance` is the luminance of (1, 1, 1) in cd/m²: `Some(1.0)` where values are photometric, `None`
/// where they are radiance. `attributes` are pairs of name and text, such as `("software", "twinray 0.1.0")`;
/// `software`, `comments` and `owner` are the format's own, other names that mean something to it get a prefix.
/// Equal arguments give equal bytes.
///
/// # Panics
/// If `pixels` has not `width × height` elements, or width or height is 0.
pub fn write_exr(
    width: u32,
    height: u32,
    pixels: &[[f32; 3]],
    white_luminance: Option<f32>,
    attributes: &[(&str, &str)],
) -> Vec<u8> {
    write_exr_aovs(width, height, pixels, &Aovs::default(), white_luminance, attributes)
}

/// As [`write_exr`], with a layer of channels beside R, G and B for each output variable that is there: `albedo.R`, `.G`,
/// `.B`, `normal.X`, `.Y`, `.Z`, `depth.Z`, `direct.R`…, `indirect.R`…, `patch.id` (unsigned integers) and `error.Y`. All lie in
/// one part, which every reader knows, and are named as the "Technical Introduction to OpenEXR" names layers: Blender shows
/// them as passes, Nuke as layers.
///
/// # Panics
/// As [`write_exr`], and if a variable has not as many elements as `pixels`.
pub fn write_exr_aovs(
    width: u32,
    height: u32,
    pixels: &[[f32; 3]],
    aovs: &Aovs,
    white_luminance: Option<f32>,
    attributes: &[(&str, &str)],
) -> Vec<u8> {
    let expected = u64::from(width) * u64::from(height);
    assert_eq!(pixels.len() as u64, expected, "write_exr: {width}×{height} pixels were announced");
    assert!(expected > 0, "write_exr: a picture without pixels");
    write_layer(width, height, channels(pixels, aovs), white_luminance, attributes)
}

/// The same of channels of any names, each `[height, width]`.
pub(crate) fn write_channels(
    width: u32,
    height: u32,
    channels: Vec<(String, Vec<f32>)>,
    white_luminance: Option<f32>,
    attributes: &[(&str, &str)],
) -> Vec<u8> {
    let channel = |(name, values): (String, Vec<f32>)| AnyChannel::new(name.as_str(), FlatSamples::F32(values));
    write_layer(width, height, channels.into_iter().map(channel).collect(), white_luminance, attributes)
}

fn write_layer(
    width: u32,
    height: u32,
    channels: Vec<AnyChannel<FlatSamples>>,
    white_luminance: Option<f32>,
    attributes: &[(&str, &str)],
) -> Vec<u8> {
    let size = Vec2(width as usize, height as usize);
    let fits = |c: &AnyChannel<FlatSamples>| c.sample_data.len() == size.area();
    assert!(channels.iter().all(fits), "write_exr: an output variable has not {width}×{height} pixels");
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let mut layer = Layer::new(size, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);

    let mut header = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    // Rec. 709 primaries and D65 white, which a reader must assume anyway; written so that nobody has to.
    header.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    for (name, value) in attributes {
        match *name {
            "software" => layer.attributes.software_name = Some(latin1(value)),
            "comments" => layer.attributes.comments = Some(latin1(value)),
            "owner" => layer.attributes.owner = Some(latin1(value)),
            _ => {
                header.other.insert(attribute_name(name), AttributeValue::Text(latin1(value)));
            }
        }
    }
    layer.attributes.white_luminance = white_luminance;
    let image = Image { attributes: header, layer_data: layer };
    let mut out = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut out).expect("an EXR picture in memory");
    let mut out = out.into_inner();
    sort_header(&mut out);
    out
}

/// All channels, by their names.
fn channels(pixels: &[[f32; 3]], aovs: &Aovs) -> Vec<AnyChannel<FlatSamples>> {
    let float = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    let mut all = Vec::new();
    let mut triple = |names: [&str; 3], values: &[[f32; 3]]| {
        all.extend((0..3).map(|c| float(names[c], values.iter().map(|v| v[c]).collect())));
    };
    triple(["R", "G", "B"], pixels);
    let triples = [
        (["albedo.R", "albedo.G", "albedo.B"], &aovs.albedo),
        (["normal.X", "normal.Y", "normal.Z"], &aovs.normal),
        (["direct.R", "direct.G", "direct.B"], &aovs.direct),
        (["indirect.R", "indirect.G", "indirect.B"], &aovs.indirect),
    ];
    for (names, values) in triples {
        values.iter().for_each(|values| triple(names, values));
    }
    all.extend(aovs.depth.iter().map(|values| float("depth.Z", values.clone())));
    all.extend(aovs.error.iter().map(|values| float("error.Y", values.clone())));
    all.extend(aovs.patch.iter().map(|values| AnyChannel::new("patch.id", FlatSamples::U32(values.clone()))));
    all
}

/// `name` as an attribute name that no reader confuses with one of the format's own.
fn attribute_name(name: &str) -> Text {
    // Longer names need version 2 of the header with its long-name flag, which older readers refuse.
    const LONGEST: usize = 31;
    let taken = name.is_empty() || standard_names::ALL.contains(&name.as_bytes());
    let prefix = if taken { "twinray." } else { "" };
    let cut: String = format!("{prefix}{name}").chars().take(LONGEST).collect();
    latin1(&cut)
}

fn latin1(text: &str) -> Text {
    let kept: String = text.chars().map(|c| if u32::from(c) < 256 && c != '\0' { c } else { '?' }).collect();
    Text::new_or_panic(kept)
}

/// Puts the attributes of the header in order of their names. The encoder takes ours from a hash map, whose order
/// differs from run to run; the header's length, and with it every offset in the file, stays the same.
fn sort_header(file: &mut [u8]) {
    const MAGIC_AND_VERSION: usize = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut at = MAGIC_AND_VERSION;
    let text_end = |from: usize| from + file[from..].iter().position(|&b| b == 0).unwrap_or(0) + 1;
    while file[at] != 0 {
        let size_at = text_end(text_end(at));
        let size = file[size_at..size_at + 4].try_into().map_or(0, i32::from_le_bytes);
        let end = size_at + 4 + size as usize;
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    attributes.sort();
    file[MAGIC_AND_VERSION..at].copy_from_slice(&attributes.concat());
}
