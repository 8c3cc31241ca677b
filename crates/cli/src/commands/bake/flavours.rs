//! Pages as engines want them: what is in the file, what lies beside it, and in which numbers.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use serde_json::json;
use twinray::bake::{Colours, Lightmap, Page};
use twinray::format::{self, Ktx2Format, Ktx2Packing, LitMaterial, LitPage, LitPicture};
use twinray::render::ToneCurve;
use twinray::scene::Rgb;

use crate::args::EngineArg;

/// Share of the texels that the picture of 8 bits may show too dark.
const CLIPPED: f64 = 1e-3;
/// Just below what RGB9E5 and half floats can say.
const LARGEST: f32 = 65_000.0;
const SOFTWARE: [(&str, &str); 1] = [("Software", concat!("twinray ", env!("CARGO_PKG_VERSION")))];

/// Kinds of files beside the document.
const KTX2: &str = "ktx2";
const EXR: &str = "exr";

/// Pages for the document, and files beside it.
pub struct Dressed {
    pub pages: Vec<LitPage>,
    pub files: Vec<(PathBuf, Vec<u8>)>,
}

/// Lightmaps of irradiance for an engine; `output` is the document's place.
pub fn lightmaps(map: &Lightmap, engine: EngineArg, output: &Path) -> Dressed {
    let mut dressed = Dressed { pages: Vec::new(), files: Vec::new() };
    for (k, page) in map.pages.iter().enumerate() {
        let name = format!("lightmap {k}");
        let (scaled, extension, quantity) = match engine {
            EngineArg::Three | EngineArg::Unlit => {
                let material = in_the_file(page, &name);
                dressed.pages.push(LitPage { name, material });
                continue;
            }
            EngineArg::Bevy => (1.0 / PI, KTX2, "irradiance/π"),
            EngineArg::Godot => (1.0, EXR, "irradiance"),
        };
        let pixels: Vec<[f32; 3]> = page.irradiance.iter().map(|p| p.map(|c| (f64::from(c) * scaled) as f32)).collect();
        let bytes = match engine {
            EngineArg::Bevy => {
                format::write_ktx2(page.width, page.height, &pixels, Ktx2Format::Rgb9e5, Ktx2Packing::Zstandard)
            }
            _ => format::write_exr(page.width, page.height, &pixels, Some(1.0), &[("software", SOFTWARE[0].1)]),
        };
        let place = beside(output, k, extension);
        let uri = place.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let about = json!({ "uri": uri, "page": k, "texCoord": 1, "quantity": quantity });
        dressed.files.push((place, bytes));
        dressed.pages.push(LitPage { name, material: LitMaterial::Beside(about) });
    }
    dressed
}

/// The first page that will lie beside the document.
pub fn first_beside(engine: EngineArg, output: &Path) -> Option<PathBuf> {
    match engine {
        EngineArg::Three | EngineArg::Unlit => None,
        EngineArg::Bevy => Some(beside(output, 0, KTX2)),
        EngineArg::Godot => Some(beside(output, 0, EXR)),
    }
}

/// The place of a page beside the document.
fn beside(output: &Path, page: usize, kind: &str) -> PathBuf {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    output.with_file_name(format!("{stem}-{page}.{kind}"))
}

/// Says which files beside the document have names of pages, and are none of those that were written.
pub fn left_over(output: &Path, files: &[(PathBuf, Vec<u8>)]) -> Option<String> {
    let stem = format!("{}-", output.file_stem()?.to_string_lossy());
    let is_page = |name: &str| {
        let (number, kind) = name.strip_prefix(&stem)?.split_once('.')?;
        let number: usize = number.parse().ok()?;
        [KTX2, EXR].contains(&kind).then_some((number, name.to_owned()))
    };
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let names = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut found: Vec<_> = names.filter_map(|name| is_page(&name)).collect();
    found.retain(|(_, name)| {
        files.iter().all(|(path, _)| path.file_name().is_none_or(|n| n.to_string_lossy() != *name))
    });
    found.sort();
    match found.as_slice() {
        [] => None,
        [(_, one)] => Some(format!("{one}: is no page of this bake, though it has the name of one")),
        [(_, first), .., (_, last)] => Some(format!(
            "{first} to {last} ({}): are no pages of this bake, though they have names of some",
            found.len()
        )),
    }
}

fn in_the_file(page: &Page, name: &str) -> LitMaterial {
    // A sunny day has more lux than shared exponents can say.
    let largest = page.irradiance.iter().flatten().copied().fold(0.0, f32::max);
    let scale = if largest > LARGEST { (largest / LARGEST).log2().ceil().exp2() } else { 1.0 };
    let scaled: Vec<[f32; 3]> = page.irradiance.iter().map(|p| p.map(|c| c / scale)).collect();
    // Browsers unpack zlib themselves.
    let hdr = format::write_ktx2(page.width, page.height, &scaled, Ktx2Format::Rgb9e5, Ktx2Packing::Zlib);
    let mut brightest: Vec<f32> =
        page.irradiance.iter().map(|p| p.iter().copied().fold(0.0, f32::max)).filter(|b| *b > 0.0).collect();
    brightest.sort_by(f32::total_cmp);
    let place = ((1.0 - CLIPPED) * brightest.len() as f64) as usize;
    let intensity = brightest.get(place.min(brightest.len().saturating_sub(1))).copied().unwrap_or(1.0);
    let rgb: Vec<u8> = page.irradiance.iter().flatten().map(|&c| encoded(f64::from(c / intensity))).collect();
    let ldr = format::write_png(page.width, page.height, &rgb, &SOFTWARE);
    LitMaterial::Lightmap {
        hdr: LitPicture { name: format!("{name} (irradiance)"), bytes: hdr, mime: "image/ktx2" },
        scale,
        ldr: LitPicture { name: name.to_owned(), bytes: ldr, mime: "image/png" },
        intensity,
    }
}

/// Colours for viewers without light, multiplied by `exposure`.
pub fn unlit(colours: &[Colours], exposure: f64) -> Vec<LitPage> {
    let page = |(k, colours): (usize, &Colours)| {
        let Page { width, height, irradiance: radiance, .. } = &colours.radiance;
        let rgba: Vec<u8> = radiance
            .iter()
            .zip(&colours.presence)
            .flat_map(|(p, alpha)| {
                let [r, g, b] = ToneCurve::AgX.shown(Rgb::from_f32(*p) * exposure).to_array();
                [r, g, b, f64::from(*alpha)].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
            })
            .collect();
        let name = format!("light {k}");
        let bytes = format::write_png_rgba(*width, *height, &rgba, &SOFTWARE);
        LitPage { name: name.clone(), material: LitMaterial::Unlit(LitPicture { name, bytes, mime: "image/png" }) }
    };
    colours.iter().enumerate().map(page).collect()
}

/// Linear light as a byte of sRGB (IEC 61966-2-1).
fn encoded(c: f64) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let e = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (e * 255.0).round() as u8
}
