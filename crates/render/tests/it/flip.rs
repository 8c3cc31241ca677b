//! ꟻLIP against the authors' tool, flip-evaluator 1.7 (default settings, 67.02 pixels per degree).
//!
//! The pictures are made of whole numbers, so that any program can make the same ones. The tool works in f32; ours
//! agrees to 6e-6 in the mean and 2e-5 in single pixels; steep powers near 0 enlarge rounding.

use twinray_render::Image;
use twinray_render::compare::{FlipMap, flip};
use twinray_scene::texture::srgb_to_linear;

const WIDTH: i32 = 96;
const HEIGHT: i32 = 64;

/// Name, mean, largest value, values at (x, y) = (7, 5), (60, 30), (95, 63).
type Expected = (&'static str, f64, f32, [f32; 3]);

const LDR: [Expected; 5] = [
    ("noise", 0.071318, 0.38835, [0.00000, 0.10769, 0.21906]),
    ("shift", 0.278279, 0.96853, [0.14570, 0.14271, 0.13462]),
    ("dim", 0.332679, 0.53612, [0.22882, 0.27091, 0.26240]),
    ("grey", 0.567774, 0.97767, [0.32538, 0.38245, 0.38227]),
    ("opposite", 0.934044, 0.99115, [0.96801, 0.85286, 0.75166]),
];

/// At ten exposures from −10.6416 to −.8275 stops, all of one reference.
const HDR: [Expected; 5] = [
    ("noise", 0.102648, 0.65832, [0.00000, 0.15532, 0.20334]),
    ("shift", 0.299709, 0.96935, [0.20632, 0.16243, 0.12893]),
    ("dim", 0.285632, 0.35803, [0.30323, 0.28734, 0.18604]),
    ("grey", 0.641154, 0.97917, [0.58525, 0.49460, 0.42204]),
    ("opposite", 0.948046, 0.99180, [0.96644, 0.90223, 0.78006]),
];

/// Codes 0 to 255 of the reference (`None`) and of pictures that differ from it in one way.
fn code(difference: Option<&str>, x: i32, y: i32, c: i32) -> i32 {
    let base = |x: i32, c: i32| (3 * x + 5 * y + 40 * c) % 256;
    match difference {
        Some("noise") if x >= WIDTH / 2 => {
            (base(x, c) + (x * 7919 + y * 104_729 + c * 1_299_709) % 61 - 30).clamp(0, 255)
        }
        Some("shift") => base(x + 2, c),
        Some("dim") => base(x, c) * 9 / 10,
        Some("grey") => base(x, 1),
        Some("opposite") => 255 - base(x, c),
        _ => base(x, c),
    }
}

fn image(value: impl Fn(i32, i32, i32) -> f32) -> Image {
    let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    let pixels = pixels.map(|(x, y)| [0, 1, 2].map(|c| value(x, y, c))).collect();
    Image { width: WIDTH as u32, height: HEIGHT as u32, pixels }
}

/// What a screen makes of the codes.
fn display(difference: Option<&str>) -> Image {
    image(|x, y, c| srgb_to_linear(f64::from(code(difference, x, y, c)) / 255.0) as f32)
}

/// Squares of the codes, with bright sparks.
fn radiance(difference: Option<&str>) -> Image {
    image(|x, y, c| {
        let v = (1 + code(difference, x, y, c)) as f32;
        v * v / 4096.0 * if x * y % 97 == 5 { 256.0 } else { 1.0 }
    })
}

#[track_caller]
fn check(map: &FlipMap, (name, mean, max, pixels): Expected) {
    let at = |x: usize, y: usize| map.values[y * WIDTH as usize + x];
    let found = [at(7, 5), at(60, 30), at(95, 63)];
    println!(
        "{name}: mean {:.6} ({mean}), largest {:.5} ({max}), pixels {found:.5?} {pixels:?}",
        map.mean(),
        map.max()
    );
    assert!((map.mean() - mean).abs() < 2e-5, "{name}");
    assert!((map.max() - max).abs() < 1e-4, "{name}");
    assert!((0..3).all(|k| (found[k] - pixels[k]).abs() < 1e-3), "{name}");
}

#[test]
fn pictures_for_a_screen_agree_with_the_authors_tool() {
    for expected in LDR {
        check(&flip::ldr(&display(Some(expected.0)), &display(None)), expected);
    }
}

#[test]
fn pictures_of_radiance_agree_with_the_authors_tool() {
    for expected in HDR {
        check(&flip::hdr(&radiance(Some(expected.0)), &radiance(None)), expected);
    }
}

#[test]
fn equal_pictures_do_not_differ() {
    let black = image(|_, _, _| 0.0);
    for same in [display(None), radiance(None), black] {
        for map in [flip::ldr(&same, &same), flip::hdr(&same, &same)] {
            assert!(map.values.iter().all(|v| *v == 0.0));
        }
    }
}

#[test]
fn magma_runs_from_black_to_pale_yellow() {
    let map = FlipMap { width: 3, height: 1, values: vec![0.0, 0.5, 1.0] };
    let colors = map.magma();
    // The ends and the middle of matplotlib's map: #000004, #b73779, #fcfdbf.
    assert_eq!(colors[..3], [0, 0, 4]);
    assert_eq!(colors[6..], [252, 253, 191]);
    assert!(colors[3].abs_diff(0xb7) < 4 && colors[4].abs_diff(0x37) < 4 && colors[5].abs_diff(0x79) < 4);
}
