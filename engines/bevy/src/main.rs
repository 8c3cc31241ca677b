//! Shows what `twinray bake --for bevy` wrote, in a window or as a picture in a file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use bevy::app::{PluginGroupBuilder, ScheduleRunnerPlugin};
use bevy::camera::primitives::Aabb;
use bevy::camera::{Exposure, Hdr, RenderTarget};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::window::ExitCondition;
use bevy::world_serialization::WorldInstanceReady;
use twinray_bevy::{EV100_OF_ONE, TwinrayLightmaps};

const USAGE: &str =
    "usage: twinray-bevy LIT.glb [--shot FILE.exr|FILE.png [--size WIDTHxHEIGHT]] [--ev100 EV] [--bicubic]

LIT.glb is what `twinray bake SCENE --for bevy -o LIT.glb` wrote; its lightmaps lie beside it.
--shot takes one picture without a window: radiance in nit as .exr, or .png (sRGB, without a tone curve).
--ev100 is the exposure [default: with --shot the one under which pixels are nit, else by the lightmaps].";
/// Frames between everything being loaded and the picture.
const SETTLING: u32 = 8;

#[derive(Resource, Clone, Debug)]
struct Options {
    document: PathBuf,
    shot: Option<PathBuf>,
    size: UVec2,
    ev100: Option<f32>,
    bicubic: bool,
}

impl Options {
    fn parse(mut args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options =
            Self { document: PathBuf::new(), shot: None, size: UVec2::new(640, 480), ev100: None, bicubic: false };
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} wants a value"));
            match arg.as_str() {
                "--shot" => options.shot = Some(value()?.into()),
                "--size" => {
                    let text = value()?;
                    let size =
                        text.split_once('x').and_then(|(w, h)| Some(UVec2::new(w.parse().ok()?, h.parse().ok()?)));
                    options.size = size
                        .filter(|s| s.min_element() > 0 && s.max_element() <= 8192)
                        .ok_or_else(|| format!("--size {text}: expected such as 640x480"))?;
                }
                "--ev100" => {
                    let text = value()?;
                    let ev: Option<f32> = text.parse().ok().filter(|ev: &f32| ev.is_finite());
                    options.ev100 = Some(ev.ok_or_else(|| format!("--ev100 {text}: expected a number"))?);
                }
                "--bicubic" => options.bicubic = true,
                _ if arg.starts_with('-') => return Err(format!("{arg}: unknown")),
                _ if options.document == Path::new("") => options.document = arg.into(),
                _ => return Err(format!("{arg}: one file is shown")),
            }
        }
        if options.document == Path::new("") {
            return Err("which file?".into());
        }
        if let Some(shot) = &options.shot
            && !["exr", "png"].iter().any(|e| shot.extension().is_some_and(|x| x == *e))
        {
            return Err(format!("{}: expected a name that ends in .exr or .png", shot.display()));
        }
        options.document =
            options.document.canonicalize().map_err(|e| format!("{}: {e}", options.document.display()))?;
        Ok(options)
    }
}

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(fault) => {
            eprintln!("twinray-bevy: {fault}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    if cfg!(not(feature = "window")) && options.shot.is_none() {
        eprintln!(
            "twinray-bevy: was built without windows: ask for a picture by --shot, or build with --features window"
        );
        return ExitCode::from(2);
    }
    let mut app = App::new();
    app.add_plugins((plugins(&options), TwinrayLightmaps { bicubic: options.bicubic, ..default() }))
        .insert_resource(ClearColor(Color::BLACK))
        .add_systems(Startup, load)
        .add_observer(set_up);
    if options.shot.is_some() {
        app.add_plugins(ScheduleRunnerPlugin::run_loop(Duration::from_millis(5))).add_systems(Update, (fail, shoot));
    } else {
        app.add_systems(Update, (fail, meter));
        #[cfg(feature = "window")]
        app.add_plugins(bevy::camera_controller::free_camera::FreeCameraPlugin).add_systems(Update, expose);
    }
    match app.insert_resource(options).run() {
        AppExit::Success => ExitCode::SUCCESS,
        AppExit::Error(code) => ExitCode::from(code.get()),
    }
}

fn plugins(options: &Options) -> PluginGroupBuilder {
    let folder = options.document.parent().unwrap_or(Path::new("/")).to_string_lossy().into_owned();
    let group = DefaultPlugins.set(AssetPlugin { file_path: folder, ..default() });
    if options.shot.is_none() {
        let window = Window { title: "twinray in Bevy".into(), ..default() };
        return group.set(WindowPlugin { primary_window: Some(window), ..default() });
    }
    let group = group
        .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
        // No frame is drawn before its shaders are there.
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() });
    #[cfg(feature = "window")]
    let group = group.disable::<bevy::winit::WinitPlugin>();
    group
}

/// The root of the scene that is shown.
#[derive(Component)]
struct Shown;

/// What the picture is taken from.
#[derive(Resource)]
struct Film(Handle<Image>);

/// The camera that looks.
#[derive(Component)]
struct Eye;

fn load(mut commands: Commands, server: Res<AssetServer>, options: Res<Options>, mut images: ResMut<Assets<Image>>) {
    let name = options.document.file_name().map(PathBuf::from).unwrap_or_default();
    let path = bevy::asset::AssetPath::from_path_buf(name).with_label(GltfAssetLabel::Scene(0).to_string());
    commands.spawn((WorldAssetRoot(server.load(path)), Shown));
    if let Some(shot) = &options.shot {
        let is_exr = shot.extension().is_some_and(|e| e == "exr");
        let format = if is_exr { TextureFormat::Rgba32Float } else { TextureFormat::Rgba8UnormSrgb };
        let mut film = Image::new_target_texture(options.size.x, options.size.y, format, None);
        film.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        commands.insert_resource(Film(images.add(film)));
    }
}

/// A camera where the first of the file is, or, where there is none, one that sees all of it.
fn set_up(
    ready: On<WorldInstanceReady>,
    options: Res<Options>,
    film: Option<Res<Film>>,
    children: Query<&Children>,
    mut cameras: Query<(Entity, &mut Camera, &Projection)>,
    boxes: Query<(Entity, &Aabb)>,
    transforms: TransformHelper,
    mut commands: Commands,
) {
    let mut found = None;
    for entity in children.iter_descendants(ready.entity) {
        let Ok((entity, mut camera, projection)) = cameras.get_mut(entity) else { continue };
        if std::mem::take(&mut camera.is_active)
            && let Ok(place) = transforms.compute_global_transform(entity)
        {
            found = Some((place.compute_transform(), projection.clone()));
        }
    }
    let (place, projection) = found.unwrap_or_else(|| {
        let mut corners = Vec::new();
        for (entity, aabb) in &boxes {
            let Ok(place) = transforms.compute_global_transform(entity) else { continue };
            corners.extend((0..8).map(|k| {
                let sign = Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) * 2.0 - 1.0;
                place.transform_point(Vec3::from(aabb.center) + sign * Vec3::from(aabb.half_extents))
            }));
        }
        let all = Aabb::enclosing(&corners).unwrap_or(Aabb::from_min_max(Vec3::NEG_ONE, Vec3::ONE));
        let (centre, radius) = (Vec3::from(all.center), Vec3::from(all.half_extents).length());
        let eye = centre + Vec3::new(0.5, 0.4, 1.0).normalize() * 2.6 * radius;
        (Transform::from_translation(eye).looking_at(centre, Vec3::Y), Projection::default())
    });
    let mut eye = commands.spawn((
        Eye,
        Camera3d::default(),
        Hdr,
        projection,
        place,
        Exposure { ev100: options.ev100.unwrap_or(EV100_OF_ONE) },
    ));
    match film {
        // Numbers as they are.
        Some(film) => {
            eye.insert((RenderTarget::Image(film.0.clone().into()), Tonemapping::None, DebandDither::Disabled))
        }
        // Those that need no table in a texture.
        None => eye.insert(Tonemapping::AcesFitted),
    };
    #[cfg(feature = "window")]
    if options.shot.is_none() {
        eye.insert(bevy::camera_controller::free_camera::FreeCamera::default());
    }
}

/// Takes the picture when all is there.
fn shoot(
    mut commands: Commands,
    mut frames: Local<u32>,
    server: Res<AssetServer>,
    options: Res<Options>,
    film: Res<Film>,
    root: Single<&WorldAssetRoot, With<Shown>>,
    eyes: Query<&Eye>,
    lightmaps: Query<&Lightmap>,
) {
    let is_there = !eyes.is_empty()
        && server.is_loaded_with_dependencies(root.0.id())
        && lightmaps.iter().all(|l| server.is_loaded(l.image.id()));
    *frames += u32::from(is_there);
    if *frames == SETTLING
        && let Some(shot) = &options.shot
    {
        info!("{} meshes have lightmaps", lightmaps.iter().count());
        commands.spawn(Screenshot::image(film.0.clone())).observe(save_to_disk(shot.clone())).observe(
            |_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
                exit.write(AppExit::Success);
            },
        );
    }
}

/// Ends it where a file is missing or bad; Bevy has said which.
fn fail(
    server: Res<AssetServer>,
    root: Single<&WorldAssetRoot, With<Shown>>,
    lightmaps: Query<&Lightmap>,
    mut exit: MessageWriter<AppExit>,
) {
    let has_failed = server.recursive_dependency_load_state(root.0.id()).is_failed()
        || lightmaps.iter().any(|l| server.load_state(l.image.id()).is_failed());
    if has_failed {
        exit.write(AppExit::error());
    }
}

/// Exposes the window by the light in the lightmaps, once: grey in their mean light becomes grey on the screen.
fn meter(
    mut is_done: Local<bool>,
    options: Res<Options>,
    images: Res<Assets<Image>>,
    lightmaps: Query<&Lightmap>,
    mut eye: Single<&mut Exposure, With<Eye>>,
) {
    if *is_done || options.ev100.is_some() {
        return;
    }
    let mut pages: Vec<_> = lightmaps.iter().map(|l| l.image.id()).collect();
    pages.sort_unstable();
    pages.dedup();
    let Some(pages) = pages.into_iter().map(|page| images.get(page)?.data.as_deref()).collect::<Option<Vec<_>>>()
    else {
        return;
    };
    if let Some(light) = mean_light(&pages) {
        eye.ev100 = EV100_OF_ONE + light.log2();
        info!("lit by {light:.3} nit × π in the mean: --ev100 {:.1}", eye.ev100);
        *is_done = true;
    }
}

/// Mean green of the texels of RGB9E5 pages that have light.
fn mean_light(pages: &[&[u8]]) -> Option<f32> {
    let (mut sum, mut count) = (0.0_f64, 0_u64);
    for texel in pages.iter().flat_map(|page| page.as_chunks::<4>().0) {
        let bits = u32::from_le_bytes(*texel);
        let green = f64::from(bits >> 9 & 0x1ff) * (f64::from(bits >> 27) - 24.0).exp2();
        (sum, count) = (sum + green, count + u64::from(green > 0.0));
    }
    (count > 0).then(|| (sum / count as f64) as f32)
}

/// Brighter and darker by keys.
#[cfg(feature = "window")]
fn expose(keys: Res<ButtonInput<KeyCode>>, mut eye: Single<&mut Exposure, With<Eye>>) {
    let stops = [(KeyCode::Period, 0.5), (KeyCode::Comma, -0.5)];
    for (_, step) in stops.into_iter().filter(|(key, _)| keys.just_pressed(*key)) {
        eye.ev100 -= step;
        info!("--ev100 {:.1}", eye.ev100);
    }
}
