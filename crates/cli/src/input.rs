//! From a name on the command line to what the file holds, and to patches: reading, units, cameras, completion, cutting, warnings.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use twinray::format::{self, Limits, PictureFile, SceneSource};
use twinray::scene::complete::{Addition, choose_camera, complete};
use twinray::scene::{Camera, CameraAnimation, PatchBudget, PatchOptions, PatchScene, Projection, Scene, builtin};

use crate::args::{LoadArgs, ReadArgs, ViewArgs};
use crate::estimate::{self, Expected, Work};
use crate::files::{self, Folder};
use crate::lights::LightSettings;
use crate::stored::{self, Stored};

/// Patches where neither the user nor the scene says how many.
const DEFAULT_PATCHES: usize = 100_000;

/// Name of the camera that options describe.
const COMMAND_LINE: &str = "command line";

/// A scene ready to be solved.
#[derive(Debug)]
pub struct Loaded {
    /// Its name.
    pub name: String,
    /// Its patches.
    pub patches: PatchScene,
    /// Cameras of the file; before them, the one that was chosen.
    pub cameras: Vec<Camera>,
    /// Whether the first of them is what options describe.
    is_chosen: bool,
    /// What the file lacked.
    pub additions: Vec<Addition>,
    /// How cameras of the file move.
    pub animations: Vec<CameraAnimation>,
    /// What was ignored or added, one line each.
    pub warnings: Vec<String>,
    /// What was expected before the start.
    pub expected: Expected,
    /// The solution file that stands for the scene, if it is one.
    pub stored: Option<Stored>,
    /// The scene itself, its cameras and their movements taken out, where the work asks for it.
    pub scene: Option<Scene>,
    /// Where the scene is, as seen from the working folder, and how it was cut.
    source: SceneSource,
    /// How it was lit beside what its file says.
    light: LightSettings,
}

impl Loaded {
    /// Cameras of the file alone.
    pub fn scene_cameras(&self) -> &[Camera] {
        let others = usize::from(self.is_chosen) + usize::from(self.additions.contains(&Addition::Camera));
        &self.cameras[others..]
    }

    /// The camera that options describe, if they do; otherwise the file's of that name or index, or its first.
    pub fn camera(&self, wish: Option<&str>) -> anyhow::Result<&Camera> {
        pick_camera(&self.cameras, wish.filter(|_| !self.is_chosen))
    }

    /// The scene's unit of length.
    pub fn metres_per_unit(&self) -> f64 {
        self.source.metres_per_unit
    }

    /// The scene's file, or the name of a built-in one.
    pub fn scene_file(&self) -> &str {
        &self.source.file
    }

    /// Where the scene is, as seen from a folder, and how it was cut.
    pub fn source_seen_from(&self, folder: &Path) -> SceneSource {
        let place = |file: &str| stored::seen_from(file, folder);
        SceneSource { file: place(&self.source.file), light: self.light.words(place), ..self.source.clone() }
    }
}

/// Reads a scene from a file, or builds the built-in one; warnings go to the second part.
pub fn read(name: &str, args: &ReadArgs) -> anyhow::Result<(Scene, Vec<String>)> {
    let path = Path::new(name);
    if let Some(scene) = builtin::by_name(name) {
        return Ok((scene, Vec::new()));
    }
    if !path.exists() {
        let names: Vec<_> = builtin::NAMES.iter().map(|(n, _)| *n).collect();
        bail!("{name}: no such file, and no built-in scene of that name; built-in are {}", names.join(", "));
    }
    let limits = limits(args);
    let bytes = files::read(path, limits.max_file_bytes).with_context(|| format!("{name}: cannot be read"))?;
    let folder = Folder::of(path, args.allow_outside, limits.max_file_bytes);
    let mut resolver = |reference: &str| folder.read(reference);
    let reading = format::read_scene(name, &bytes, &mut resolver, &limits).map_err(|e| anyhow!("{e}"))?;
    drop(bytes);
    let faults = reading.scene.validate();
    if let Some(fault) = faults.first() {
        bail!("{name}: {fault} ({} faults in all)", faults.len());
    }
    Ok((reading.scene, reading.warnings.iter().map(ToString::to_string).collect()))
}

/// What files may ask for.
pub fn limits(args: &ReadArgs) -> Limits {
    let limits = Limits { allow_outside: args.allow_outside, ..Limits::default() };
    args.max_memory.map_or(limits.clone(), |bytes| limits.within(bytes))
}

/// Reads a scene, or that of a solution file.
pub fn read_any(name: &str, args: &ReadArgs) -> anyhow::Result<(Scene, Vec<String>)> {
    if !stored::is_solution(name) {
        return read(name, args);
    }
    let file = Stored::open(name)?;
    let scene = stored::scene_of(name, &file.read()?.provenance().source, None)?;
    read(&scene, args)
}

/// Reads a picture.
pub fn read_picture(name: &str) -> anyhow::Result<PictureFile> {
    let bytes = std::fs::read(name).with_context(|| format!("{name}: cannot be read"))?;
    format::read_picture(name, &bytes, &Limits::default()).map_err(|e| anyhow!("{e}"))
}

/// Loads a scene for `work`, completed with a camera and light where it lacks them; says what is to be expected.
pub fn load(args: &LoadArgs, view: Option<&ViewArgs>, work: &Work) -> anyhow::Result<Loaded> {
    if stored::is_solution(&args.scene) {
        return load_stored(args, view, work);
    }
    if args.scene_file.is_some() {
        bail!("--scene-file says where the scene of a .twin file is, and {} is none: leave it out", args.scene);
    }
    let source = SceneSource {
        file: args.scene.clone(),
        metres_per_unit: args.unit.unwrap_or_default().metres(),
        patches: args.patches,
        patch_size: args.patch_size,
        two_sided: args.two_sided,
        light: Vec::new(),
    };
    cut(args, source, LightSettings::new(&args.light)?, view, None, work)
}

/// The scene of a solution file, cut as it was for it.
fn load_stored(args: &LoadArgs, view: Option<&ViewArgs>, work: &Work) -> anyhow::Result<Loaded> {
    let name = args.scene.as_str();
    let stored = Stored::open(name)?;
    let (mut source, fingerprint, scene, patches) = {
        let file = stored.read()?;
        let p = file.provenance();
        (p.source.clone(), p.fingerprint, p.scene.clone(), file.patches())
    };
    let differs = [
        ("--patches", args.patches.is_some_and(|n| Some(n) != source.patches)),
        ("--patch-size", args.patch_size.is_some_and(|size| Some(size) != source.patch_size)),
        ("--unit", args.unit.is_some_and(|unit| unit.metres() != source.metres_per_unit)),
        ("--two-sided", args.two_sided && !source.two_sided),
    ];
    if let Some((option, _)) = differs.iter().find(|(_, differs)| *differs) {
        bail!("{name}: was solved with another {option}: leave it out, or solve the scene anew");
    }
    let stored_light = LightSettings::from_words(name, &source.light, |file| stored::beside(name, file))?;
    let light = stored_light
        .repeated(&LightSettings::new(&args.light)?)
        .map_err(|option| anyhow!("{name}: was solved with another {option}: leave it out, or solve the scene anew"))?;
    source.file = stored::scene_of(name, &source, args.scene_file.as_deref())?;
    let file = source.file.clone();
    let lit = if source.light.is_empty() { "" } else { ", the files that lit it among it" };
    let loaded = cut(args, source, light, view, Some(patches), work)?;
    let found = loaded.patches.fingerprint();
    if found != fingerprint {
        bail!(
            "{name}: is the light of another scene: of \"{scene}\" with the fingerprint {fingerprint:016x}, and {file} has {found:016x}. It may have changed since{lit}; --scene-file FILE says where the right one is"
        );
    }
    Ok(Loaded { stored: Some(stored), ..loaded })
}

/// A scene as its author and the options of light made it, cut, with nothing added: what a check looks at.
#[derive(Debug)]
pub struct Authored {
    /// The scene.
    pub scene: Scene,
    /// Its patches.
    pub patches: PatchScene,
    /// Cameras of the file; before them, the one that options describe; one that was chosen where there is none.
    pub cameras: Vec<Camera>,
    /// The camera to look through.
    pub view: Camera,
    /// What was ignored or changed in reading.
    pub warnings: Vec<String>,
}

/// Loads a scene to be checked: without the camera and the lamps that other commands add where there are none.
pub fn load_authored(args: &LoadArgs, view: &ViewArgs) -> anyhow::Result<Authored> {
    let name = args.scene.as_str();
    if stored::is_solution(name) {
        bail!("{name}: is the light of a scene; expected the scene itself, a .glb, .gltf or .obj file");
    }
    let metres = args.unit.unwrap_or_default().metres();
    let (mut scene, mut warnings) = read(name, &args.read)?;
    scale(&mut scene, metres);
    let lit = LightSettings::new(&args.light)?.apply(&mut scene, &limits(&args.read))?;
    warnings.extend(lit.into_iter().map(|w| format!("{name}: {w}")));
    let wanted = override_camera(&scene.cameras, view, metres)?;
    let options = PatchOptions { budget: budget(args.patches, args.patch_size, &scene), two_sided: args.two_sided };
    let work = Work { is_silent: true, ..Work::default() };
    let expected = estimate::expect(args, &scene, options, &work)?;
    warnings.extend(estimate::announce(args, &expected, &work));
    let patches = PatchScene::new(&scene, options).map_err(|e| anyhow!("{name}: {e}"))?;
    let mut cameras = scene.cameras.clone();
    if cameras.is_empty() && wanted.is_none() {
        cameras.push(choose_camera(&patches));
    }
    let view = match &wanted {
        Some(camera) => camera.clone(),
        None => pick_camera(&cameras, view.camera.as_deref())?.clone(),
    };
    cameras.splice(0..0, wanted);
    Ok(Authored { scene, patches, cameras, view, warnings })
}

/// How finely to cut: as options say, or as the scene suggests.
fn budget(patches: Option<u64>, patch_size: Option<f64>, scene: &Scene) -> PatchBudget {
    match (patches, patch_size) {
        (Some(n), _) => PatchBudget::Count(n as usize),
        (None, Some(size)) => PatchBudget::Size(size),
        (None, None) => PatchBudget::Count(scene.suggested_patches.unwrap_or(DEFAULT_PATCHES)),
    }
}

/// Reads a scene, completes it and cuts it. A wanted camera may be lit by a lamp of its own, where there is no light, unless
/// the patches are `known`: then there are about so many.
fn cut(
    args: &LoadArgs,
    source: SceneSource,
    light: LightSettings,
    view: Option<&ViewArgs>,
    known: Option<usize>,
    work: &Work,
) -> anyhow::Result<Loaded> {
    let (mut scene, mut warnings) = read(&source.file, &args.read)?;
    scale(&mut scene, source.metres_per_unit);
    let lit = light.apply(&mut scene, &limits(&args.read))?;
    warnings.extend(lit.into_iter().map(|w| format!("{}: {w}", source.file)));
    let wanted = view.map(|v| override_camera(&scene.cameras, v, source.metres_per_unit)).transpose()?.flatten();
    let name = source.file.as_str();
    let budget = budget(source.patches, source.patch_size, &scene);
    let options = PatchOptions { budget, two_sided: source.two_sided };
    let expected = estimate::expect(args, &scene, options, work)?;
    // Whatever a file says of how its scene was cut, it must not cost more than the file itself did. Completing adds few.
    if let Some(known) = known.filter(|known| expected.cut.patches / 2 > known + 1000) {
        bail!(
            "{}: has {known} patches, and its scene is cut into {}: one of them has changed",
            args.scene,
            expected.cut.patches
        );
    }
    warnings.extend(estimate::announce(args, &expected, work));
    let lamp_at = wanted.as_ref().filter(|_| known.is_none());
    let additions = complete(&mut scene, lamp_at, source.two_sided).map_err(|e| anyhow!("{name}: {e}"))?;
    // Whoever wants the scene itself wants no picture.
    let told = additions.iter().filter(|&&a| a != Addition::Camera || !work.keeps_scene);
    warnings.extend(told.map(|addition| format!("{name}: {addition}")));
    let patches = PatchScene::new(&scene, options).map_err(|e| anyhow!("{name}: {e}"))?;
    if patches.degenerate_triangles() > 0 {
        let count = patches.degenerate_triangles();
        warnings
            .push(format!("{name}: {count} triangles left out, as they have no area or no finite place in the scene"));
    }
    let mut cameras = std::mem::take(&mut scene.cameras);
    let is_chosen = wanted.is_some();
    cameras.splice(0..0, wanted);
    let animations = std::mem::take(&mut scene.animations);
    Ok(Loaded {
        name: scene.name.clone(),
        patches,
        cameras,
        is_chosen,
        additions,
        animations,
        warnings,
        expected,
        stored: None,
        scene: work.keeps_scene.then_some(scene),
        source,
        light,
    })
}

/// Lengths of the file to metres.
fn scale(scene: &mut Scene, metres: f64) {
    if metres == 1.0 {
        return;
    }
    for instance in &mut scene.instances {
        instance.transform.matrix3 *= metres;
        instance.transform.translation *= metres;
    }
    // What a coefficient is per metre follows the metre.
    let volumes = scene.materials.iter_mut().filter_map(|m| m.transmission.as_mut()?.volume.as_mut());
    volumes.for_each(|v| v.attenuation = v.attenuation / metres);
    for light in &mut scene.lights {
        light.transform.translation *= metres;
    }
    scene.animations.iter_mut().for_each(|animation| animation.scale_lengths(metres));
    for camera in &mut scene.cameras {
        camera.eye *= metres;
        if let Projection::Orthographic { half_height } = &mut camera.projection {
            *half_height *= metres;
        }
    }
}

/// The camera that `--eye` and its kin describe, starting from the scene's own; `None` without any of them.
pub fn override_camera(cameras: &[Camera], view: &ViewArgs, metres: f64) -> anyhow::Result<Option<Camera>> {
    if view.eye.is_none() && view.target.is_none() && view.up.is_none() && view.fov.is_none() {
        return Ok(None);
    }
    let base = match (cameras.is_empty(), view.eye.is_some() && view.target.is_some()) {
        (false, _) => pick_camera(cameras, view.camera.as_deref())?.clone(),
        (true, true) => Camera::look_at(COMMAND_LINE, Vector::ZERO, Vector::ZERO, Vector::Y, 50.0),
        (true, false) => bail!("the scene has no camera to change; give both --eye and --target"),
    };
    let mut camera = Camera { name: COMMAND_LINE.into(), ..base };
    let target = view.target.map(|t| vector(t) * metres);
    if let Some(eye) = view.eye {
        camera.eye = vector(eye) * metres;
    }
    if let Some(target) = target {
        camera.forward = target - camera.eye;
        if camera.forward.length() == 0.0 {
            bail!("--eye and --target are the same point; expected two different ones");
        }
    }
    if let Some(up) = view.up {
        camera.up = vector(up);
    }
    if let Some(fov) = view.fov {
        if !(fov > 0.0 && fov < 180.0) {
            bail!("--fov {fov}: expected more than 0 and less than 180 degrees");
        }
        camera.projection = Projection::Perspective { vertical_fov: fov.to_radians() };
    }
    Ok(Some(camera))
}

type Vector = glam::DVec3;

fn vector(v: [f64; 3]) -> Vector {
    Vector::from_array(v)
}

/// The camera of that name or index; the first without a wish.
pub fn pick_camera<'a>(cameras: &'a [Camera], wish: Option<&str>) -> anyhow::Result<&'a Camera> {
    let Some(wish) = wish else { return cameras.first().ok_or_else(|| anyhow!("the scene has no camera")) };
    let by_name = cameras.iter().find(|c| c.name == wish);
    let by_index = || wish.parse::<usize>().ok().and_then(|i| cameras.get(i));
    by_name.or_else(by_index).ok_or_else(|| {
        let names: Vec<_> = cameras.iter().enumerate().map(|(i, c)| format!("{i} \"{}\"", c.name)).collect();
        anyhow!("--camera {wish}: no such camera; the scene has {}", names.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use twinray::scene::{Material, Rgb, Scene, Transmission, Volume};

    /// What halves light within a millimetre of the file's unit does so within a millimetre of the world.
    #[test]
    fn attenuation_follows_the_unit() {
        let volume = Some(Volume { attenuation: Rgb::new(0.5, 1.0, 0.0) });
        let transmission = Some(Transmission { factor: 1.0, texture: None, volume });
        let mut scene = Scene { materials: vec![Material { transmission, ..Material::default() }], ..Scene::default() };
        super::scale(&mut scene, 0.001);
        let attenuation = scene.materials[0].transmission.as_ref().unwrap().volume.unwrap().attenuation;
        assert_eq!(attenuation, Rgb::new(500.0, 1000.0, 0.0));
    }
}
