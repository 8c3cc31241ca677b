//! The picture of `twinray check`: the scene in grey, what was found in colours.

use twinray::format;
use twinray::render;
use twinray::scene::SurfaceHit;
use twinray::scene::check::{Finding, Kind, texels_per_metre};
use twinray::scene::{TriangleSource, sources};

use crate::args::{CheckArgs, ShowArg};
use crate::commands::render::default_size;
use crate::input::Authored;
use crate::output::Output;

/// Colours of kinds in order of their appearance, by name, for a screen: told apart by most colour-blind people (Okabe and Ito).
const COLOURS: [(&str, [f64; 3]); 7] = [
    ("vermilion", [0.84, 0.37, 0.0]),
    ("sky blue", [0.34, 0.71, 0.91]),
    ("yellow", [0.94, 0.89, 0.26]),
    ("bluish green", [0.0, 0.62, 0.45]),
    ("reddish purple", [0.8, 0.47, 0.65]),
    ("orange", [0.9, 0.62, 0.0]),
    ("blue", [0.0, 0.45, 0.7]),
];

/// How far the false colours reach to both sides of what half of the surface has.
const REACH: f64 = 8.0;
/// Texels along one field of the chequered pattern.
const FIELD: f64 = 8.0;

/// Draws and writes it; answers what each colour means.
pub fn draw(
    args: &CheckArgs,
    authored: &Authored,
    findings: &[Finding],
    output: Output,
) -> anyhow::Result<Vec<(String, String)>> {
    let (width, height) = args.size.unwrap_or_else(|| default_size(&authored.view));
    let size = [width, height];
    let patches = &authored.patches;
    let (bytes, legend) = if args.show == Some(ShowArg::Density) {
        let middle = middle_density(authored, args.texture_size);
        let colour = density(authored, args.texture_size, middle);
        (render::marked(patches, &authored.view, size, colour), density_legend(middle))
    } else {
        let mut shown: Vec<Kind> =
            findings.iter().filter(|f| !f.triangles.is_empty() && shows(args.show, f.kind)).map(|f| f.kind).collect();
        shown.sort();
        shown.dedup();
        // The first kind wins where a triangle has several.
        let mut of_triangle: Vec<Option<u8>> = vec![None; patches.triangle_count()];
        for (index, kind) in shown.iter().enumerate().rev() {
            for f in findings.iter().filter(|f| f.kind == *kind) {
                f.triangles.iter().for_each(|&t| of_triangle[t as usize] = Some(index as u8));
            }
        }
        let named = |index: u8| COLOURS[usize::from(index) % COLOURS.len()];
        let colour = |hit: &SurfaceHit| of_triangle[hit.triangle as usize].map(|index| named(index).1);
        let legend =
            (0u8..).zip(&shown).map(|(index, kind)| (kind.id().to_owned(), named(index).0.to_owned())).collect();
        (render::marked(patches, &authored.view, size, colour), legend)
    };
    let software = concat!("twinray ", env!("CARGO_PKG_VERSION"));
    let words: Vec<String> =
        legend.iter().map(|(what, colour): &(String, String)| format!("{colour}: {what}")).collect();
    let comment = format!("scene {}, {}", authored.scene.name, words.join(", "));
    output.write(&format::write_png(width, height, &bytes, &[("Software", software), ("Comment", &comment)]))?;
    Ok(legend)
}

/// Whether a kind is in the picture that was asked for.
fn shows(show: Option<ShowArg>, kind: Kind) -> bool {
    match show {
        None => true,
        Some(ShowArg::Flipped) => kind == Kind::FlippedNormals,
        Some(ShowArg::Overlap) => matches!(kind, Kind::Uv2Overlap | Kind::CoplanarDuplicates),
        Some(ShowArg::Albedo) => kind == Kind::BrightAlbedo,
        Some(ShowArg::Leak) => matches!(kind, Kind::Leak | Kind::OpenShell),
        Some(ShowArg::Density) => kind == Kind::TexelDensity,
    }
}

/// The colour of a place by its texels for a metre; grey without second texture coordinates.
fn density(authored: &Authored, texture_size: u32, middle: f64) -> impl Fn(&SurfaceHit) -> Option<[f64; 3]> + Sync {
    let (scene, patches, sources) = (&authored.scene, &authored.patches, sources(&authored.scene));
    move |hit| {
        let source = sources[hit.triangle as usize];
        let mesh = &scene.meshes[scene.instances[source.instance as usize].mesh];
        let triangle = source.triangle as usize;
        let density = texels_per_metre(mesh, triangle, patches.triangle_area(hit.triangle), texture_size)?;
        let level = (0.5 + 0.5 * (density / middle).ln() / REACH.ln()).clamp(0.0, 1.0);
        // The hit's weights are of the corners as they are placed: under a mirror the last two are exchanged.
        let order = if source.mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let uvs = mesh.second_texcoords.as_ref()?;
        let [a, b, c] = order.map(|k| uvs[mesh.triangles[triangle][k] as usize].map(f64::from));
        let texel = |k: usize| (a[k] + hit.u * (b[k] - a[k]) + hit.v * (c[k] - a[k])) * f64::from(texture_size);
        let is_dark = (texel(0) / FIELD).floor() + (texel(1) / FIELD).floor();
        let shade = if is_dark.rem_euclid(2.0) == 0.0 { 1.0 } else { 0.7 };
        Some(ramp(level).map(|c| c * shade))
    }
}

/// Blue for few, green, and red for many.
fn ramp(level: f64) -> [f64; 3] {
    let near = |at: f64| (1.0 - 2.0 * (level - at).abs()).clamp(0.0, 1.0);
    [near(1.0), near(0.5), near(0.0)]
}

fn density_legend(middle: f64) -> Vec<(String, String)> {
    let of =
        |density: f64, more: &str, colour: &str| (format!("{density:.1}{more} texels for a metre"), colour.to_owned());
    vec![
        of(middle / REACH, " or fewer", "blue"),
        of(middle, "", "green"),
        of(middle * REACH, " or more", "red"),
        ("no second texture coordinates".to_owned(), "grey".to_owned()),
    ]
}

/// Texels for a metre that half of the surface has less than; 1 where nothing has any.
fn middle_density(authored: &Authored, texture_size: u32) -> f64 {
    let (scene, patches) = (&authored.scene, &authored.patches);
    let of = |(t, source): (u32, &TriangleSource)| {
        let mesh = &scene.meshes[scene.instances[source.instance as usize].mesh];
        let area = patches.triangle_area(t);
        let density = texels_per_metre(mesh, source.triangle as usize, area, texture_size)?;
        (density > 0.0).then_some((density, area))
    };
    let sources = sources(scene);
    let mut densities: Vec<(f64, f64)> = (0..).zip(&sources).filter_map(of).collect();
    densities.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * densities.iter().map(|d| d.1).sum::<f64>();
    let mut sum = 0.0;
    let middle = densities.iter().find(|d| {
        sum += d.1;
        sum >= half
    });
    middle.map_or(1.0, |d| d.0)
}
