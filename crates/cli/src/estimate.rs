//! What a command will need, before it starts: patches, memory, rays, the size of the file. `--max-memory` refuses here.
//!
//! What is resident already, the scene among it, is asked of the system where it tells; what is to come is computed by
//! the libraries. How much memory there is: `memory`.

use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use twinray::scene::{Estimate, PatchOptions, Scene};
use twinray::solve::{Demand, Params, solving_bytes};

use crate::args::LoadArgs;
use crate::commands::render::default_size;
use crate::memory;

/// Bytes of a solution file for each patch, for each glossy one beside that, and for each patch of a reference.
const FILE_BYTES_PER_PATCH: usize = 73;
const FILE_BYTES_PER_GLOSSY_PATCH: usize = 48;
const REFERENCE_BYTES_PER_PATCH: usize = 29;
/// Bytes that writing a solution takes for each patch beside the solver and beyond what a snapshot takes, which is made
/// after it: what has another form in the file, error bars and the light.
const WRITING_BYTES_PER_PATCH: usize = 46;
/// Bytes that a patch tracer keeps for each patch, and then the light that it gives.
const TRACER_BYTES_PER_PATCH: usize = 40 + 25;
/// Bytes that looking at a solution takes for each patch, the solution included, and for each that is seen.
const LOOK_BYTES_PER_PATCH: usize = 318;
const LOOK_BYTES_PER_SEEN_PATCH: usize = 150;
/// Bytes of a pixel while its picture is made and encoded, and of one that paths are traced for.
const PICTURE_BYTES_PER_PIXEL: usize = 60;
const PATH_BYTES_PER_PIXEL: usize = 240;
/// The same where neighbours share rays: sums, what they give each other, what was learnt of lamps and directions
/// (320 with few lamps, 390 under a sky).
const GATHER_BYTES_PER_PIXEL: usize = 360;
/// The same for its layers: sums, what they become, and that as channels.
const LAYER_BYTES_PER_PIXEL: usize = 200;
/// What a thread keeps at hand: its stack as far as it is used, tasks of rays, the allocator's share.
const THREAD_BYTES: usize = 1 << 20;
/// The program and what is not worth an estimate of its own.
const PROGRAM_BYTES: usize = 6_000_000;

/// What a command does with a scene once it is cut.
#[derive(Clone, Debug, Default)]
pub struct Work {
    /// A solve: its settings, the rays to shoot per patch or in all if that ends it.
    pub solve: Option<(Params, Rays)>,
    /// A trace of paths from every patch, so many of each if that ends it.
    pub trace: Option<Option<u64>>,
    /// A picture.
    pub picture: Option<PictureWork>,
    /// Whether a solution file is written.
    pub writes_solution: bool,
    /// Whether the scene is needed beside its patches.
    pub keeps_scene: bool,
    /// Whether another process speaks for this one, or the command itself says what there is.
    pub is_silent: bool,
}

/// A picture to be made.
#[derive(Clone, Copy, Debug)]
pub struct PictureWork {
    /// Width and height; `None` as the camera asks.
    pub size: Option<(u32, u32)>,
    /// Rays of a pixel.
    pub samples: u32,
    /// Whether its pixels are traced, without a solve.
    pub is_traced: bool,
    /// Whether its last bounce is traced, for which no observer is needed.
    pub is_gathered: bool,
    /// Whether it has layers beside radiance.
    pub has_layers: bool,
}

/// Rays of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rays {
    /// Something else ends it.
    Unknown,
    /// In all.
    Total(u64),
    /// For each patch.
    PerPatch(u64),
}

/// What is to be expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// What cutting the scene gives.
    pub cut: Estimate,
    /// Most resident memory, bytes.
    pub memory: u64,
    /// Rays or paths, if their number is the goal.
    pub rays: Option<u64>,
    /// Size of the solution file, bytes.
    pub file: Option<u64>,
}

impl Expected {
    /// One line.
    pub fn line(&self, name: &str) -> String {
        let mut line = format!("{name}: expecting {} patches, {} of memory", self.cut.patches, size(self.memory));
        if let Some(rays) = self.rays {
            let millions = rays as f64 * 1e-6;
            line += &if rays < 1_000_000 { format!(", {rays} rays") } else { format!(", {millions:.1} M rays") };
        }
        if let Some(bytes) = self.file {
            line += &format!(", a file of {}", size(bytes));
        }
        line
    }

    /// For reports.
    pub fn json(&self) -> Value {
        json!({ "patches": self.cut.patches, "memory": self.memory, "rays": self.rays, "file": self.file })
    }
}

/// Bytes of a solution file.
fn solution_file_bytes(cut: &Estimate, is_reference: bool) -> u64 {
    let bytes = match is_reference {
        true => REFERENCE_BYTES_PER_PATCH * cut.patches,
        false => FILE_BYTES_PER_PATCH * cut.patches + FILE_BYTES_PER_GLOSSY_PATCH * cut.glossy_patches,
    };
    bytes as u64 + 2000
}

/// What `work` on `scene` will take.
///
/// # Errors
/// If the scene cannot be cut so, or needs more than `--max-memory` allows.
pub fn expect(args: &LoadArgs, scene: &Scene, options: PatchOptions, work: &Work) -> anyhow::Result<Expected> {
    let name = args.scene.as_str();
    let cut = twinray::scene::estimate(scene, options).map_err(|e| anyhow!("{name}: {e}"))?;
    let now = memory::of_process().unwrap_or([PROGRAM_BYTES as u64 + scene.bytes() as u64; 2]);
    let shape =
        |size: Option<(u32, u32)>| size.unwrap_or_else(|| scene.cameras.first().map_or((683, 512), default_size));
    let pixels = work.picture.map_or((0, 0), |p| shape(p.size));
    let pixels = pixels.0 as usize * pixels.1 as usize;
    let expected = with(&cut, now, work, pixels);
    match args.read.max_memory {
        Some(allowed) if expected.memory > allowed => bail!("{name}: {}", refusal(&expected, now, allowed)),
        _ => Ok(expected),
    }
}

/// Says what is to be expected; a warning if that is more than there is.
pub fn announce(args: &LoadArgs, expected: &Expected, work: &Work) -> Option<String> {
    if !args.quiet && !work.is_silent {
        crate::say!("{}", expected.line(&args.scene));
    }
    // Who allows some memory knows better how much there is.
    let shortage = shortage(expected).filter(|_| args.read.max_memory.is_none())?;
    Some(format!("{}: {shortage}", args.scene))
}

/// A warning if the system has less memory than is to be expected.
fn shortage(expected: &Expected) -> Option<String> {
    let [now, _] = memory::of_process()?;
    let available = memory::available()?;
    let more = expected.memory.saturating_sub(now);
    (more > available).then(|| {
        format!(
            "about {} of memory are needed and {} are available: it may be slow or end early; ask for fewer --patches",
            size(more),
            size(available)
        )
    })
}

/// The estimate for a scene of which `cut` is known, by a process that has taken `now` and at most so far.
fn with(cut: &Estimate, [now, most_so_far]: [u64; 2], work: &Work, pixels: usize) -> Expected {
    let patches = cut.patches;
    let (mut after, mut rays) = (0, None);
    if let Some((params, goal)) = &work.solve {
        rays = match *goal {
            Rays::Unknown => None,
            Rays::Total(n) => Some(n),
            Rays::PerPatch(n) => Some(n.saturating_mul(patches as u64)),
        };
        let (glossy, observed) = (cut.glossy_patches, work.picture.is_some_and(|p| !p.is_gathered));
        let demand = Demand { patches, glossy, observed, reflectance: cut.reflectance, rays };
        after =
            solving_bytes(params, &demand) + if work.writes_solution { WRITING_BYTES_PER_PATCH * patches } else { 0 };
    }
    if let Some(paths) = work.trace {
        rays = paths.map(|n| n.saturating_mul(patches as u64));
        after = TRACER_BYTES_PER_PATCH * patches;
    }
    let file = work.writes_solution.then(|| solution_file_bytes(cut, work.trace.is_some()));
    if let Some(picture) = work.picture {
        // What is not seen has neighbours that are.
        let seen = patches.min(pixels.saturating_mul(picture.samples as usize) * 3 / 4);
        let look = LOOK_BYTES_PER_PATCH * patches + LOOK_BYTES_PER_SEEN_PATCH * seen;
        after = match picture.is_traced {
            true => PATH_BYTES_PER_PIXEL * pixels,
            false if picture.is_gathered => after.max(look + GATHER_BYTES_PER_PIXEL * pixels),
            false => after.max(look + PICTURE_BYTES_PER_PIXEL * pixels),
        };
        after += if picture.has_layers { LAYER_BYTES_PER_PIXEL * pixels } else { 0 };
    }
    let more = cut.peak_bytes.max(cut.bytes + after) + THREAD_BYTES * rayon::current_num_threads();
    Expected { cut: *cut, memory: most_so_far.max(now + more as u64), rays, file }
}

/// Why there is too little, and what to do.
fn refusal(expected: &Expected, [now, _]: [u64; 2], allowed: u64) -> String {
    let patches = expected.cut.patches as u64;
    let needed = format!(
        "needs about {} of memory for {} triangles and {patches} patches, and --max-memory allows {}",
        size(expected.memory),
        expected.cut.triangles,
        size(allowed)
    );
    // What is there already stays; the rest is about in proportion.
    let share = allowed.saturating_sub(now) as f64 / expected.memory.saturating_sub(now).max(1) as f64;
    let fewer = (0.9 * share * patches as f64) as u64;
    if fewer > expected.cut.triangles as u64 {
        format!("{needed}: ask for fewer, such as --patches {fewer}, or allow more")
    } else {
        format!("{needed}: a triangle is a patch at least, so simplify the scene or allow more")
    }
}

/// A size in words.
pub fn size(bytes: u64) -> String {
    let bytes = bytes as f64;
    match bytes {
        b if b < 1e6 => format!("{:.0} kB", (1e-3 * b).ceil()),
        b if b < 1e9 => format!("{:.1} MB", 1e-6 * b),
        b => format!("{:.2} GB", 1e-9 * b),
    }
}
