//! PNG and EXR files read back by other people's decoders.

use std::io::Cursor;

use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, Vec2, read};
use twinray_format::{Limits, read_picture, write_exr, write_exr_aovs, write_png};
use twinray_render::Aovs;

#[test]
fn png_keeps_pixels_text_and_colour_space() {
    let rgb: Vec<u8> = (0..3 * 5 * 4).map(|i| (i * 4) as u8).collect();
    let text = [("Software", "twinray 0.1"), ("Comment", "seed 1, π")];
    let bytes = write_png(5, 4, &rgb, &text);
    assert_eq!(bytes, write_png(5, 4, &rgb, &text), "equal arguments, equal bytes");

    let decoded = image::load_from_memory(&bytes).unwrap();
    assert_eq!((decoded.width(), decoded.height(), decoded.color()), (5, 4, image::ColorType::Rgb8));
    assert_eq!(decoded.into_rgb8().into_raw(), rgb);

    let reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
    assert!(reader.info().srgb.is_some());
    let chunks: Vec<_> =
        reader.info().uncompressed_latin1_text.iter().map(|t| (t.keyword.as_str(), t.text.as_str())).collect();
    assert_eq!(chunks, [("Software", "twinray 0.1"), ("Comment", "seed 1, ?")]);
}

#[test]
#[should_panic(expected = "need 60 bytes")]
fn png_refuses_a_wrong_size() {
    write_png(5, 4, &[0; 59], &[]);
}

#[test]
fn exr_keeps_values_and_says_what_they_mean() {
    let pixels: Vec<[f32; 3]> = (0..37 * 21).map(|i| [i as f32 * 0.37, 1e-6 * i as f32, -(i as f32)]).collect();
    let attributes =
        [("software", "twinray 0.1"), ("comments", "seed 1"), ("channels", "mine"), ("view", "v"), ("rays", "9")];
    let bytes = write_exr(37, 21, &pixels, Some(1.0), &attributes);
    for _ in 0..4 {
        assert_eq!(bytes, write_exr(37, 21, &pixels, Some(1.0), &attributes), "equal arguments, equal bytes");
    }
    assert!(bytes.len() < pixels.len() * 12, "it is compressed");

    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: Vec2<usize>, _| (size, vec![[0.0f32; 3]; size.area()]),
            |(size, out), at, (r, g, b): (f32, f32, f32)| out[at.1 * size.0 + at.0] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .unwrap();
    assert_eq!(image.layer_data.channel_data.pixels, (Vec2(37, 21), pixels.clone()));
    let white = image.attributes.chromaticities.unwrap().white;
    assert_eq!((white.0, white.1), (0.3127, 0.3290));
    assert_eq!(image.layer_data.attributes.white_luminance, Some(1.0));
    let text = |name: &str| {
        let all = image.attributes.other.iter().chain(&image.layer_data.attributes.other);
        let found = all.filter(|(key, _)| **key == *name).map(|(_, value)| value.clone()).next();
        found.map(|value| matches!(value, AttributeValue::Text(text) if !text.as_slice().is_empty()))
    };
    let own = &image.layer_data.attributes;
    let words = [&own.software_name, &own.comments].map(|t| t.as_ref().map(ToString::to_string));
    assert_eq!(words, [Some("twinray 0.1".into()), Some("seed 1".into())]);
    assert_eq!(text("twinray.channels"), Some(true));
    assert_eq!(text("rays"), Some(true));

    let radiance = write_exr(37, 21, &pixels, None, &[]);
    assert!(!contains(&radiance, b"whiteLuminance") && contains(&bytes, b"whiteLuminance"));
    assert!(contains(&radiance, b"chromaticities"));
}

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|w| w == word)
}

/// All output variables lie beside R, G and B under their usual names, and whoever knows none of them reads the picture.
#[test]
fn output_variables_come_back() {
    let (width, height) = (7, 5);
    let count = width as usize * height as usize;
    let floats = |first: f32| (0..count).map(|i| first + i as f32).collect::<Vec<_>>();
    let triples =
        |first: f32| (0..count).map(|i| [first + i as f32, first - i as f32, first * 0.5]).collect::<Vec<_>>();
    let ids: Vec<u32> = (0..count as u32).map(|i| if i == 3 { Aovs::NO_PATCH } else { i + (1 << 30) + 1 }).collect();
    let aovs = Aovs {
        albedo: Some(triples(0.1)),
        normal: Some(triples(0.2)),
        depth: Some(floats(2.0)),
        direct: Some(triples(0.3)),
        indirect: Some(triples(0.4)),
        patch: Some(ids.clone()),
        error: Some(floats(3.0)),
    };
    let pixels = triples(0.9);
    let bytes = write_exr_aovs(width, height, &pixels, &aovs, None, &[("rays", "9")]);
    assert_eq!(bytes, write_exr_aovs(width, height, &pixels, &aovs, None, &[("rays", "9")]), "equal arguments");
    assert_eq!(read_picture("a.exr", &bytes, &Limits::default()).unwrap().image.pixels, pixels);

    let file = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let channels = file.from_buffered(Cursor::new(&bytes)).unwrap().layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
    let expected = "B G R albedo.B albedo.G albedo.R depth.Z direct.B direct.G direct.R error.Y indirect.B indirect.G \
        indirect.R normal.X normal.Y normal.Z patch.id";
    assert_eq!(names.join(" "), expected);
    let values = |name: &str| channels.iter().find(|c| c.name == *name).unwrap().sample_data.clone();
    let third = |t: &Option<Vec<[f32; 3]>>| FlatSamples::F32(t.as_ref().unwrap().iter().map(|v| v[2]).collect());
    for (name, expected) in [
        ("albedo.B", third(&aovs.albedo)),
        ("normal.Z", third(&aovs.normal)),
        ("direct.B", third(&aovs.direct)),
        ("indirect.B", third(&aovs.indirect)),
        ("depth.Z", FlatSamples::F32(floats(2.0))),
        ("error.Y", FlatSamples::F32(floats(3.0))),
        ("patch.id", FlatSamples::U32(ids)),
    ] {
        assert_eq!(values(name), expected, "{name}");
    }
}

#[test]
#[should_panic(expected = "an output variable has not 2×1 pixels")]
fn output_variables_of_another_size_are_refused() {
    write_exr_aovs(2, 1, &[[0.0; 3]; 2], &Aovs { depth: Some(vec![0.0]), ..Aovs::default() }, None, &[]);
}
