//! What can be said on the command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use twinray::scene::check::Kind;

use crate::display::DisplayArgs;
use crate::light_args::LightArgs;

/// The light of a whole scene, by bi-directional rays.
#[derive(Debug, Parser)]
#[command(name = "twinray", version, about, arg_required_else_help = true)]
#[command(after_help = "SCENE is a .glb, .gltf or .obj file, or a built-in scene: \
    furnace, plates, cube, cornell, cornell-closed, doorway, hall, hall-diffuse, \
    uneven, uneven-glowing.\n\
    A .twin file, the light of a scene as `solve` keeps it, stands for its scene.\n\
    Exit codes: 0 done, 1 the limit of compare exceeded or something found by check, 2 bad input, 130 (Ctrl-C), 143 (SIGTERM) or 129 (a closed terminal) interrupted with \
    the result kept.")]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Verbs, in the order light is computed.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solve a scene and take a picture of it, or take one of a .twin file's light
    Render(Box<RenderArgs>),
    /// Solve a scene and keep the light of its patches in a .twin file, or go on with one
    Solve(SolutionArgs),
    /// Add up solves of one scene that were made with different seeds or as parts
    Merge(MergeArgs),
    /// Trace the irradiance of every patch by paths, slowly and without bias, to compare solutions with
    Reference(ReferenceArgs),
    /// Say what is in a scene (triangles, patches, power, closedness, memory, warnings), or in a .twin file
    Info(InfoArgs),
    /// Find what ruins a bake before it is paid for: units, flipped normals, leaks, unwrapping, and more
    #[command(
        mut_arg("scene", |a| a.help("A .glb, .gltf or .obj file, or the name of a built-in scene")),
        mut_arg("scene_file", |a| a.hide(true))
    )]
    Check(Box<CheckArgs>),
    /// Write the light of every patch as a table or a mesh for other programs, or a walk-through as one HTML file
    Export(ExportArgs),
    /// Bake the light of a scene into it: glTF with lightmaps, light at vertices, or probes for what moves
    Bake(Box<BakeArgs>),
    /// Walk through a scene in a browser while it is solved, or through the light of a .twin file
    View(Box<ViewerArgs>),
    /// Say how far a picture or a solution is from a reference
    Compare(CompareArgs),
    /// Write a built-in scene (or convert a file) to glTF or OBJ, so that other programs can load it
    Scene(SceneArgs),
}

/// What a scene may ask for.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct ReadArgs {
    /// Memory to do with, such as 800M or 8G: what needs more is refused before it starts
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub max_memory: Option<u64>,
    /// Read textures and buffers that lie outside the scene's folder too
    #[arg(long)]
    pub allow_outside: bool,
}

/// How a scene is loaded and cut.
#[derive(Clone, Debug, clap::Args)]
pub struct LoadArgs {
    /// A .glb, .gltf or .obj file, the name of a built-in scene, or a .twin file
    #[arg(value_name = "SCENE")]
    pub scene: String,
    /// Where the scene of a .twin file is now [default: where it was, as seen from the file]
    #[arg(long, value_name = "FILE")]
    pub scene_file: Option<String>,
    /// Number of patches to aim at, distributed by area [default: 100000, or what a built-in scene suggests]
    #[arg(long, value_name = "N", value_parser = count, conflicts_with = "patch_size")]
    pub patches: Option<u64>,
    /// Side of a patch in metres; inf: one patch per triangle
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    pub patch_size: Option<f64>,
    /// Treat every surface as two-sided
    #[arg(long)]
    pub two_sided: bool,
    /// Unit of the file's lengths [default: m]
    #[arg(long, value_enum)]
    pub unit: Option<Unit>,
    /// Light beside its own.
    #[command(flatten)]
    pub light: LightArgs,
    /// What it may ask for.
    #[command(flatten)]
    pub read: ReadArgs,
    /// Threads [default: all]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Units of length.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum Unit {
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    #[default]
    M,
}

impl RenderArgs {
    /// How light reaches the picture.
    pub fn method(&self) -> MethodArg {
        let of_patches = self.solve.preset == Some(Preset::Paper) || self.flat || self.lobes.is_some();
        self.path.method.unwrap_or(if of_patches { MethodArg::Patches } else { MethodArg::Gather })
    }
}

impl Unit {
    /// Metres per unit.
    pub fn metres(self) -> f64 {
        match self {
            Unit::Mm => 1e-3,
            Unit::Cm => 1e-2,
            Unit::M => 1.0,
        }
    }
}

/// A camera of the command line.
#[derive(Debug, Default, clap::Args)]
pub struct ViewArgs {
    /// Camera of the scene, by name or index [default: 0]
    #[arg(long, value_name = "NAME|INDEX")]
    pub camera: Option<String>,
    /// Place of the camera, in the scene's unit
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub eye: Option<[f64; 3]>,
    /// Point the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub target: Option<[f64; 3]>,
    /// Upwards
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    pub up: Option<[f64; 3]>,
    /// Vertical field of view, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub fov: Option<f64>,
}

/// Settings of the solver.
#[derive(Debug, Default, clap::Args)]
pub struct SolveArgs {
    /// Rays to shoot, such as 5000000, 5e6 or 5M [default: 400 per patch]
    #[arg(long, value_name = "N", value_parser = count, conflicts_with_all = ["time", "error"])]
    pub rays: Option<u64>,
    /// Seconds to shoot for
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true, conflicts_with = "error")]
    pub time: Option<f64>,
    /// Shoot until the estimated error is below this, such as 2%: relative RMS of patch irradiance, weighted by area
    #[arg(long, value_name = "PERCENT", value_parser = share, allow_hyphen_values = true)]
    pub error: Option<f64>,
    /// Seed of every random number [default: 1]
    #[arg(long)]
    pub seed: Option<u64>,
    /// default: ours; paper: Kelemen et al. 2003, one ray per iteration, corrected as docs/paper.md says [default: default]
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Which of a ray's two transfers count, and how [default: balance]
    #[arg(long, value_enum)]
    pub estimator: Option<EstimatorArg>,
    /// What glossy patches remember of the direction of light [default: both]
    #[arg(long, value_enum)]
    pub representation: Option<RepresentationArg>,
    /// Rays per iteration of the paper preset [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=LARGEST_BATCH))]
    pub batch: Option<u64>,
}

/// A batch is shot before anybody looks at signals, and its deposits are kept meanwhile: 2 GB of them.
pub const LARGEST_BATCH: u64 = 1 << 24;

/// Presets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Ours.
    #[default]
    Default,
    /// The paper's.
    Paper,
}

/// Estimators.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EstimatorArg {
    /// From the shooter to the hit only.
    Forward,
    /// From the hit to the shooter only.
    Backward,
    /// Both with half the weight.
    Equal,
    /// Both by the balance heuristic.
    #[default]
    Balance,
}

/// Representations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum RepresentationArg {
    /// Direction-independent main part.
    Main,
    /// One accepted sample.
    Sample,
    /// Main part and one accepted sample of the difference BRDF.
    #[default]
    Both,
    /// Main part and the last sample, always accepted.
    Last,
}

/// `twinray render`.
#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Camera.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Method.
    #[command(flatten)]
    pub path: PathArgs,
    /// Solver.
    #[command(flatten)]
    pub solve: SolveArgs,
    /// Frames along a path.
    #[command(flatten)]
    pub motion: MotionArgs,
    /// Picture to write: .png, or .exr for linear radiance [default: SCENE.png in this folder]; with --path a picture for each
    /// frame, such as frames/%04d.png [default: SCENE-%04d.png], or a film, .mp4, .webm or .webp, where ffmpeg is installed
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Size of the picture in pixels [default: 512 high, as wide as the camera asks]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Show the raw patches instead of smooth light
    #[arg(long)]
    pub flat: bool,
    /// With --method patches, reflections in glossy surfaces: traced per pixel, or as patches remember them [default: traced]
    #[arg(long, value_enum)]
    pub lobes: Option<LobesArg>,
    /// Film, lens and screen.
    #[command(flatten)]
    pub display: DisplayArgs,
}

/// A camera that moves.
#[derive(Debug, clap::Args)]
pub struct MotionArgs {
    /// Frames along a path, all of the same solution: a file of keys (docs/pictures.md tells its form), or an animation of a
    /// camera in a glTF file, the first that moves the camera or the one of that name
    #[arg(long, value_name = "KEYS.json|animation[:NAME]", conflicts_with_all = ["eye", "target", "time"])]
    pub path: Option<String>,
    /// Frames per second of the path [default: what the keys say, else 24]
    #[arg(long, value_name = "N", value_parser = fps, requires = "path", allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Only the frames from A on and before B, counted from 0: a part, or to go on after an interruption; either may be left out
    #[arg(long, value_name = "A..B", value_parser = frames, requires = "path", allow_hyphen_values = true)]
    pub frames: Option<FrameRange>,
}

/// Frames from the first on and before the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange(pub usize, pub Option<usize>);

/// How a picture is made.
#[derive(Debug, clap::Args)]
pub struct PathArgs {
    /// How light reaches the picture [default: gather; patches with --preset paper, --flat or --lobes]
    #[arg(long, value_enum)]
    pub method: Option<MethodArg>,
    /// Camera rays per pixel, the mean where noise decides [default: 64, or until --time or --error; with --method patches 16]
    #[arg(long, visible_alias = "spp", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub samples: Option<u32>,
}

/// Methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Solve, then trace the last bounce for every pixel: sharp shadows and textures.
    Gather,
    /// Solve, then look at the patches: the paper's own picture.
    Patches,
    /// Trace whole paths for every pixel, slowly and without bias, for comparison.
    Path,
}

/// `twinray solve`.
#[derive(Debug, clap::Args)]
pub struct SolutionArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Solver.
    #[command(flatten)]
    pub solve: SolveArgs,
    /// Solution to write: .twin [default: SCENE.twin in this folder; of a .twin file, the file itself]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How often to write what there is, such as 60s, 10m, 2h or never: what a crash can cost
    #[arg(long, value_name = "INTERVAL", default_value = "60s", value_parser = interval)]
    pub checkpoint: Interval,
    /// Begin anew where the file to write holds the light of this scene already
    #[arg(long)]
    pub overwrite: bool,
    /// Solve one of N parts, with random numbers and a share of the rays of its own, for `merge` to add up
    #[arg(long, value_name = "K/N", value_parser = part)]
    pub part: Option<[u32; 2]>,
}

/// `twinray merge`.
#[derive(Debug, clap::Args)]
pub struct MergeArgs {
    /// Solutions to add up: .twin files of one scene, solved with the same settings
    #[arg(value_name = "FILE", required = true, num_args = 1..)]
    pub files: Vec<String>,
    /// Solution to write: .twin
    #[arg(long, short, value_name = "FILE", required = true)]
    pub output: PathBuf,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Seconds between two checkpoints; `None` for never.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval(pub Option<f64>);

/// Reflections.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LobesArg {
    /// One ray per camera ray.
    Traced,
    /// From the patches alone.
    Patches,
}

/// `twinray reference`.
#[derive(Debug, clap::Args)]
pub struct ReferenceArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Solution file to write: .twin [default: SCENE-reference.twin in this folder]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Paths that start on each patch [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    pub paths: Option<u32>,
    /// Seconds to trace for
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true, conflicts_with = "paths")]
    pub time: Option<f64>,
    /// Relative RMS error of the patches' irradiance to trace for, such as 2% or 0.02
    #[arg(long, value_name = "E", value_parser = share, allow_negative_numbers = true, conflicts_with_all = ["paths", "time"])]
    pub error: Option<f64>,
    /// Seed of every random number
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

/// `twinray info`.
#[derive(Debug, clap::Args)]
pub struct InfoArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
}

/// `twinray check`.
#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Camera.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Picture to write: .png, the scene in grey, what was found in colours
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// What the picture shows [default: all findings]
    #[arg(long, value_enum, requires = "picture")]
    pub show: Option<ShowArg>,
    /// Size of the picture in pixels [default: 512 high, as wide as the camera asks]
    #[arg(long, value_name = "WxH", value_parser = size, requires = "picture")]
    pub size: Option<(u32, u32)>,
    /// Texels for a metre that a lightmap is to have: says how many that makes, and which meshes have too few
    #[arg(long, value_name = "N", value_parser = above_zero, allow_negative_numbers = true)]
    pub density: Option<f64>,
    /// Side of a lightmap, texels
    #[arg(long, value_name = "N", default_value = "1024", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub texture_size: u32,
    /// Kinds that do not count, such as uv2-padding,bright-albedo
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = kind)]
    pub allow: Vec<Kind>,
}

/// What a picture of findings shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShowArg {
    /// Flipped normals.
    Flipped,
    /// Overlaps on the lightmap and in space.
    Overlap,
    /// Texels for a metre, in false colours, and the texels as a chequered pattern.
    Density,
    /// Bright albedo.
    Albedo,
    /// Leaks and open shells.
    Leak,
}

/// `twinray export`.
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    /// The solution, a .twin file, and its scene.
    #[command(flatten)]
    pub load: LoadArgs,
    /// File to write: .npz (NumPy), .csv, .ply (mesh), .vtu (ParaView), or .html (a walk-through in one file)
    #[arg(long, short, value_name = "FILE", required = true)]
    pub output: PathBuf,
    /// Of .html: the longer side of textures, pixels, at most
    #[arg(long, value_name = "PIXELS", default_value = "1024", value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub texture_size: u32,
    /// Of .html: what irradiance is called
    #[arg(long, value_name = "UNIT", value_enum, default_value = "lx")]
    pub unit_name: UnitName,
}

/// What the scene's numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UnitName {
    /// Radiance is in nit, irradiance in lux.
    Lx,
    /// Radiance is in W·sr⁻¹·m⁻², irradiance in W·m⁻².
    Watt,
}

impl UnitName {
    /// The unit of irradiance as it is written.
    pub fn as_str(self) -> &'static str {
        match self {
            UnitName::Lx => "lx",
            UnitName::Watt => "W/m²",
        }
    }
}

/// `twinray bake`.
#[derive(Debug, clap::Args)]
pub struct BakeArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Solver.
    #[command(flatten)]
    pub solve: SolveArgs,
    /// File to write: .glb [default: SCENE-lit.glb in this folder]; lightmaps that lie beside it take its name. With --to
    /// probes .json, .exr, or .ktx2 as Bevy reads it [default: SCENE-probes.json, or what --for reads]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// What carries the light [default: lightmap]
    #[arg(long, value_enum)]
    pub to: Option<CarrierArg>,
    /// Who is to load it [default: three]
    #[arg(long = "for", value_name = "ENGINE", value_enum)]
    pub engine: Option<EngineArg>,
    /// Texels for a metre, on as many pages as it takes [default: as many as one page holds]
    #[arg(long, value_name = "TEXELS_PER_METRE", value_parser = above_zero, allow_negative_numbers = true)]
    pub density: Option<f64>,
    /// Side of a page, texels, at most [default: 1024, or 2048 with --density]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(64..=8192), allow_negative_numbers = true)]
    pub page_size: Option<u32>,
    /// Texels around each chart that belong to no other: 2 for bilinear filters, more for mip maps [default: 2]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..=16), allow_negative_numbers = true)]
    pub padding: Option<u32>,
    /// How each texel's light is found [default: smooth]
    #[arg(long, value_enum)]
    pub quality: Option<QualityArg>,
    /// Of --quality high: rays that each texel gathers with [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536), allow_negative_numbers = true)]
    pub texel_rays: Option<u32>,
    /// Of --to probes: how far they are apart, at most [default: a metre, less in small scenes]
    #[arg(long, value_name = "METRES", value_parser = above_zero, allow_negative_numbers = true)]
    pub spacing: Option<f64>,
    /// Of --to probes: rays of each [default: 512]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536), allow_negative_numbers = true)]
    pub probe_rays: Option<u32>,
    /// Lay out new texture coordinates even where the scene's second set is sound
    #[arg(long)]
    pub unwrap: bool,
    /// Leave jumps where charts of a smooth surface meet
    #[arg(long)]
    pub no_stitch: bool,
    /// Keep the lights that were baked in; without, point, spot and directional lights are taken out of the file
    #[arg(long)]
    pub keep_lights: bool,
    /// Of --for unlit: stops by which pictures are brighter [default: by the light that there is]
    #[arg(long, value_name = "EV", value_parser = stops, allow_negative_numbers = true)]
    pub exposure: Option<f64>,
}

/// What carries baked light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CarrierArg {
    /// Textures of irradiance.
    #[default]
    Lightmap,
    /// Values at vertices.
    Vertex,
    /// A grid of irradiance for all directions, for what moves.
    Probes,
}

/// Who loads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EngineArg {
    /// three.js with the loader plugin of docs/bake.md: irradiance, within the file.
    #[default]
    Three,
    /// Bevy: irradiance / π in KTX2 files beside the .glb.
    Bevy,
    /// Godot and other engines: irradiance in EXR files beside the .glb.
    Godot,
    /// Any viewer of glTF: colours as they look, without lights.
    Unlit,
}

/// How the light of a texel is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum QualityArg {
    /// Means of the cells that it covers, as they are.
    Cells,
    /// Smooth between cells of a surface that see each other.
    #[default]
    Smooth,
    /// Gathered anew at each texel: sharp shadows, and slower.
    High,
}

fn stops(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number, such as -2".to_owned())?;
    if value.abs() <= 64.0 { Ok(value) } else { Err("expected -64 to 64 stops".into()) }
}

fn above_zero(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number, such as 20".to_owned())?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("expected a positive number".into()) }
}

/// `twinray view`.
#[derive(Debug, clap::Args)]
pub struct ViewerArgs {
    /// Scene and patches.
    #[command(flatten)]
    pub load: LoadArgs,
    /// Solver.
    #[command(flatten)]
    pub solve: SolveArgs,
    /// Port of 127.0.0.1 to serve on [default: a free one]
    #[arg(long, value_name = "PORT")]
    pub port: Option<u16>,
    /// Open the page in the browser of this desktop
    #[arg(long)]
    pub open: bool,
    /// What the address begins with, so that a page finds its server again when that is restarted: 16 letters and digits or more
    /// [default: random]
    #[arg(long, value_name = "TOKEN")]
    pub token: Option<String>,
    /// Keep the light in this .twin file when the solve ends, by itself or by Ctrl-C
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// The longer side of textures, pixels, at most
    #[arg(long, value_name = "PIXELS", default_value = "2048", value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub texture_size: u32,
    /// What irradiance is called
    #[arg(long, value_name = "UNIT", value_enum, default_value = "lx")]
    pub unit_name: UnitName,
}

/// `twinray compare`.
#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// What to judge: a .png or .exr picture, or a .twin solution
    #[arg(value_name = "A")]
    pub test: String,
    /// The reference, of the same kind
    #[arg(value_name = "B")]
    pub reference: String,
    /// Exit with 1 if the difference is larger, such as 2% or 0.02: the metric of pictures (for psnr the least, in dB),
    /// the relative RMS of solutions
    #[arg(long, value_name = "LIMIT", value_parser = max_error, allow_negative_numbers = true)]
    pub max_error: Option<MaxError>,
    /// What --max-error is about [default: flip]
    #[arg(long, value_enum)]
    pub metric: Option<MetricArg>,
    /// Picture of the visible differences to write: FLIP from black (none) to pale yellow
    #[arg(long, value_name = "FILE.png")]
    pub diff: Option<PathBuf>,
    /// Threads [default: all]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say nothing but errors: the exit code is the answer
    #[arg(long, short)]
    pub quiet: bool,
    /// Print one JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Measures of pictures.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MetricArg {
    /// Root of the mean squared difference in linear light.
    Rmse,
    /// Mean squared difference in linear light relative to the reference.
    Relmse,
    /// Peak signal-to-noise ratio of PNGs, dB.
    Psnr,
    /// Mean of FLIP: what somebody sees who alternates between the two.
    Flip,
}

/// A limit, and how it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxError {
    /// The number; 0.02 for 2%.
    pub value: f64,
    /// True if it was written in percent.
    pub percent: bool,
}

impl MaxError {
    /// As it was written.
    pub fn text(self) -> String {
        if self.percent { format!("{}%", (1e14 * self.value).round() / 1e12) } else { self.value.to_string() }
    }
}

/// `twinray scene`.
#[derive(Debug, clap::Args)]
pub struct SceneArgs {
    /// A built-in scene, or a file to convert; without it the built-in scenes are listed
    pub scene: Option<String>,
    /// What it may ask for.
    #[command(flatten)]
    pub read: ReadArgs,
    /// File to write: .glb or .obj (with its .mtl and textures beside it)
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

/// A count that may be written as 5e6, 5M or 200k.
fn count(text: &str) -> Result<u64, String> {
    let (digits, factor) = match text.char_indices().last() {
        Some((i, 'k' | 'K')) => (&text[..i], 1e3),
        Some((i, 'M')) => (&text[..i], 1e6),
        Some((i, 'G')) => (&text[..i], 1e9),
        _ => (text, 1.0),
    };
    let value: f64 = digits.replace('_', "").parse().map_err(|_| "expected a count such as 5000000, 5e6 or 5M")?;
    let value = value * factor;
    if (1.0..=1e15).contains(&value) { Ok(value.round() as u64) } else { Err("expected 1 to 1e15".into()) }
}

/// A time such as 60s, 10m, 2h or 90; or never.
fn interval(text: &str) -> Result<Interval, String> {
    if text == "never" {
        return Ok(Interval(None));
    }
    let (digits, unit) = match text.char_indices().last() {
        Some((i, 's')) => (&text[..i], 1.0),
        Some((i, 'm')) => (&text[..i], 60.0),
        Some((i, 'h')) => (&text[..i], 3600.0),
        _ => (text, 1.0),
    };
    let seconds = digits.trim().parse().ok().map(|x: f64| x * unit).filter(|x| *x > 0.0 && x.is_finite());
    let seconds = seconds.ok_or("expected a time such as 60s, 10m or 2h, or never")?;
    Ok(Interval(Some(seconds)))
}

/// Which of how many parts, such as 3/16.
fn part(text: &str) -> Result<[u32; 2], String> {
    let numbers = text.split_once('/').and_then(|(k, n)| Some([k.trim().parse().ok()?, n.trim().parse().ok()?]));
    let good = numbers.filter(|[k, n]: &[u32; 2]| (1..=*n).contains(k));
    good.ok_or_else(|| "expected which of how many, such as 3/16, counted from 1".into())
}

/// A number of bytes that may be written as 8G, 8GB, 8GiB, 800M or 1.5e9.
fn bytes(text: &str) -> Result<u64, String> {
    let expected = "expected a size such as 800M, 8G or 8GiB";
    let unit_at = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e').unwrap_or(text.len());
    let (digits, unit) = text.split_at(unit_at);
    let (unit, base) = match unit.strip_suffix("iB") {
        Some(unit) => (unit, 1024f64),
        None => (unit.strip_suffix('B').unwrap_or(unit), 1000.0),
    };
    let power = match unit {
        "" if base == 1000.0 => 0,
        "k" | "K" => 1,
        "M" => 2,
        "G" => 3,
        "T" => 4,
        _ => return Err(expected.into()),
    };
    let value = digits.trim().parse::<f64>().map_err(|_| expected)? * base.powi(power);
    if (1.0..=1e18).contains(&value) { Ok(value as u64) } else { Err(expected.into()) }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|s: &f64| *s > 0.0 && s.is_finite());
    seconds.ok_or_else(|| "expected a positive number of seconds".into())
}

/// A share between 0 and 1 that may be written as 2% or 0.02.
fn share(text: &str) -> Result<f64, String> {
    let (digits, unit) = text.strip_suffix('%').map_or((text, 1.0), |digits| (digits, 0.01));
    let share = digits.trim().parse().ok().map(|x: f64| x * unit).filter(|x| *x > 0.0 && *x < 1.0);
    share.ok_or_else(|| "expected a share such as 2% or 0.02, more than 0 and less than 100%".into())
}

/// A limit that may be written as 2% or 0.02; it may be larger than 1, and 0 asks for equality.
fn max_error(text: &str) -> Result<MaxError, String> {
    let (digits, percent) = text.strip_suffix('%').map_or((text, false), |digits| (digits, true));
    let value = digits.trim().parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
    let value = value.ok_or("expected a limit such as 2% or 0.02, at least 0")?;
    Ok(MaxError { value: if percent { value / 100.0 } else { value }, percent })
}

/// A kind of finding.
fn kind(text: &str) -> Result<Kind, String> {
    let known = || Kind::ALL.map(Kind::id).join(", ");
    Kind::ALL.into_iter().find(|k| k.id() == text.trim()).ok_or_else(|| format!("expected of {}", known()))
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    let expected = "expected three numbers such as 1.5,0,-2";
    let numbers: Vec<f64> =
        text.split(',').map(|t| t.trim().parse()).collect::<Result<_, _>>().map_err(|_| expected)?;
    let triple: [f64; 3] = numbers.try_into().map_err(|_| expected)?;
    if triple.iter().all(|x| x.is_finite()) { Ok(triple) } else { Err(expected.into()) }
}

/// A frame rate that may be written as 30000/1001.
fn fps(text: &str) -> Result<f64, String> {
    let (over, under) = text.split_once('/').unwrap_or((text, "1"));
    let rate = over.trim().parse::<f64>().ok().zip(under.trim().parse::<f64>().ok()).map(|(a, b)| a / b);
    let rate = rate.filter(|r| (1e-3..=1000.0).contains(r));
    rate.ok_or_else(|| "expected frames per second such as 24 or 30000/1001, from 0.001 to 1000".into())
}

fn frames(text: &str) -> Result<FrameRange, String> {
    let expected = "expected A..B with A less than B, such as 0..48, 24.. or ..48";
    let (from, to) = text.split_once("..").ok_or(expected)?;
    let number = |text: &str| text.trim().parse::<usize>().map_err(|_| expected);
    let from = if from.trim().is_empty() { 0 } else { number(from)? };
    let to = if to.trim().is_empty() { None } else { Some(number(to)?) };
    if to.is_some_and(|to| to <= from) { Err(expected.into()) } else { Ok(FrameRange(from, to)) }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let expected = "expected WIDTHxHEIGHT in pixels, such as 800x600, each 1 to 16384";
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or(expected)?;
    let side = |s: &str| s.trim().parse().ok().filter(|n| (1..=16384).contains(n)).ok_or(expected);
    Ok((side(w)?, side(h)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn counts_and_sizes() {
        assert_eq!(count("5e6"), Ok(5_000_000));
        assert_eq!(count("5M"), Ok(5_000_000));
        assert_eq!(count("78_443"), Ok(78_443));
        assert!(count("-3").is_err() && count("nan").is_err() && count("").is_err());
        assert_eq!(size("800x600"), Ok((800, 600)));
        assert!(size("0x600").is_err() && size("800").is_err());
        assert_eq!(triple("1,-2.5, 3"), Ok([1.0, -2.5, 3.0]));
        assert!((share("2%").unwrap() - share("0.02").unwrap()).abs() < 1e-15);
        assert!(["0", "-1%", "100%", "2", "nan", ""].iter().all(|text| share(text).is_err()));
        assert_eq!(max_error("2%"), Ok(MaxError { value: 0.02, percent: true }));
        assert_eq!(max_error("2%").map(MaxError::text), Ok("2%".into()));
        assert_eq!(max_error("40"), Ok(MaxError { value: 40.0, percent: false }));
        assert!(["-1", "nan", "inf", "%", "2 %%"].iter().all(|text| max_error(text).is_err()));
        assert_eq!(interval("2h"), Ok(Interval(Some(7200.0))));
        assert_eq!(interval("0.5"), Ok(Interval(Some(0.5))));
        assert_eq!(interval("never"), Ok(Interval(None)));
        assert!(["0s", "-1", "s", "soon", ""].iter().all(|text| interval(text).is_err()));
        assert_eq!(part("3/16"), Ok([3, 16]));
        assert!(["0/4", "5/4", "4", "a/b", "-1/2"].iter().all(|text| part(text).is_err()));
        assert!(triple("1,2").is_err() && triple("1,2,nan").is_err());
        assert_eq!(fps("24"), Ok(24.0));
        assert!((fps("30000/1001").unwrap() - 29.97).abs() < 1e-3);
        assert!(["0", "-1", "nan", "1/0", "", "a/2"].iter().all(|text| fps(text).is_err()));
        assert_eq!(frames("3..8"), Ok(FrameRange(3, Some(8))));
        assert_eq!((frames("3.."), frames("..8")), (Ok(FrameRange(3, None)), Ok(FrameRange(0, Some(8)))));
        assert!(["3", "8..3", "3..3", "-1..3", "a..b", "1...3"].iter().all(|text| frames(text).is_err()));
    }
}
