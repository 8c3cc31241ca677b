//! Frames of a path: which there are, and where the camera is in each.
//!
//! Lives here: keys of a file or an animation of the scene, and what options make of them. Not here: how keys are written
//! (`keyframes`), how a camera moves between them (the library), the pictures (`commands::frames`).

use anyhow::{Context, anyhow, bail};
use glam::DVec3;
use twinray::scene::{Camera, CameraAnimation, CameraKey, CameraPath, Projection};

use crate::args::{RenderArgs, ViewArgs};
use crate::display;
use crate::input::{self, Loaded};
use crate::keyframes::{Key, Keyframes};

/// Frames per second where nobody says: that of the cinema.
const DEFAULT_FPS: f64 = 24.0;
/// More frames than anybody waits for: a time in other units than seconds, most likely.
const MOST_FRAMES: f64 = 1e6;
/// Frames that a path may be too short for its last one: times of glTF are of single precision.
const TOLERANCE: f64 = 0.01;

/// What `--path` asks for.
#[derive(Debug)]
pub enum Source {
    /// A file of keys.
    Keys(Keyframes),
    /// An animation of the scene, of this name or any.
    Animation(Option<String>),
}

impl Source {
    /// Reads the file of keys, if it is one.
    pub fn new(path: &str) -> anyhow::Result<Self> {
        Ok(match path.strip_prefix("animation") {
            Some("") => Self::Animation(None),
            Some(name) if name.starts_with(':') => Self::Animation(Some(name[1..].to_owned())),
            _ => Self::Keys(Keyframes::read(path)?),
        })
    }

    /// The options that would show the first frame: a scene that lacks a camera or light is completed for it.
    pub fn first_view(&self, view: &ViewArgs) -> ViewArgs {
        match self {
            Self::Keys(keys) => view_of(&keys.keys[0], view),
            Self::Animation(_) => ViewArgs { camera: view.camera.clone(), ..ViewArgs::default() },
        }
    }
}

/// The options that would show a key.
fn view_of(key: &Key, view: &ViewArgs) -> ViewArgs {
    ViewArgs {
        camera: key.camera.clone().or_else(|| view.camera.clone()),
        eye: key.eye,
        target: key.target,
        up: key.up.or(view.up),
        fov: key.fov.or(view.fov),
    }
}

/// The frames.
#[derive(Debug)]
pub struct Motion {
    way: Way,
    start: f64,
    /// Frames per second.
    pub fps: f64,
    /// How many there are.
    pub count: usize,
}

#[derive(Debug)]
enum Way {
    Keys(CameraPath),
    Animation(CameraAnimation, Camera),
}

impl Motion {
    /// The frames of a path in a scene.
    ///
    /// # Errors
    /// If the scene lacks what the path names, or keys cannot be what they say.
    pub fn new(args: &RenderArgs, loaded: &Loaded, source: &Source) -> anyhow::Result<Self> {
        let (way, [start, end], fps) = match source {
            Source::Keys(keys) => {
                let path = path(args, loaded, keys)?;
                let ends = [path.keys()[0].time, path.keys()[path.keys().len() - 1].time];
                (Way::Keys(path), ends, keys.fps)
            }
            Source::Animation(name) => {
                let animation = animation(args, loaded, name.as_deref())?;
                let mut camera = loaded.scene_cameras()[animation.camera].clone();
                if let Some(fov) = args.view.fov {
                    camera.projection = Projection::Perspective { vertical_fov: fov.to_radians() };
                }
                (Way::Animation(animation.clone(), camera), animation.span(), None)
            }
        };
        let fps = args.motion.fps.or(fps).unwrap_or(DEFAULT_FPS);
        let last = ((end - start) * fps + TOLERANCE).floor();
        if last >= MOST_FRAMES {
            bail!(
                "--path: {} seconds at {fps} frames per second are {} frames; expected a million at most: are times seconds?",
                end - start,
                last + 1.0
            );
        }
        Ok(Self { way, start, fps, count: last as usize + 1 })
    }

    /// The camera of a frame, with the projection and the lens that the options ask for.
    pub fn camera(&self, args: &RenderArgs, loaded: &Loaded, frame: usize) -> anyhow::Result<Camera> {
        let time = self.start + frame as f64 / self.fps;
        let (camera, focus) = match &self.way {
            Way::Keys(path) => {
                let at = path.at(time);
                (at.camera, at.focus)
            }
            Way::Animation(animation, camera) => (animation.at(camera, time), None),
        };
        display::camera(args, loaded, &camera, focus)
    }
}

/// The way through the keys of a file.
fn path(args: &RenderArgs, loaded: &Loaded, keyframes: &Keyframes) -> anyhow::Result<CameraPath> {
    let unit = loaded.metres_per_unit();
    let mut keys: Vec<CameraKey> = Vec::new();
    for (i, key) in keyframes.keys.iter().enumerate() {
        let at = format!("{}: keys[{i}]", keyframes.file);
        let camera = camera(args, loaded, key).with_context(|| at.clone())?;
        let (forward, up) = (camera.forward.normalize_or_zero(), camera.up.normalize_or_zero());
        if forward.cross(up).length() < 1e-6 {
            bail!("{at}: looks along its \"up\", {:?}; expected another \"up\"", camera.up.to_array());
        }
        let target = key.target.map(|target| DVec3::from_array(target) * unit);
        let focus = match (args.display.dof, key.focus) {
            (None, Some(_)) => bail!("{at}.focus: is for a lens, and there is none; expected --dof with an aperture"),
            (None, None) => None,
            (Some(dof), focus) => {
                let focus = focus.or(dof.distance()).map(|distance| distance * unit);
                let focus = focus.or(target.map(|target| (target - camera.eye).length()));
                Some(
                    focus.ok_or_else(|| {
                        anyhow!("{at}: \"focus\" is missing; expected it, or a \"target\" that is sharp")
                    })?,
                )
            }
        };
        if let Some(before) = keys.last() {
            let opposite = |a: DVec3, b: DVec3| a.normalize_or_zero().dot(b.normalize_or_zero()) < -0.9999;
            if std::mem::discriminant(&before.camera.projection) != std::mem::discriminant(&camera.projection) {
                bail!(
                    "{at}: has another kind of projection than the key before it; expected one kind, such as with \"fov\" in each"
                );
            }
            if opposite(before.camera.up, camera.up) {
                bail!(
                    "{at}.up: is opposite to that of the key before it; expected a key in between that says which way to turn"
                );
            }
            if target.is_none() && opposite(before.camera.forward, camera.forward) {
                bail!(
                    "{at}: looks opposite to the key before it; expected a key in between that says which way to turn"
                );
            }
        }
        keys.push(CameraKey { time: key.time, camera, target, focus });
    }
    Ok(CameraPath::new(keys, keyframes.linear))
}

/// The camera of a key, as options would give it.
fn camera(args: &RenderArgs, loaded: &Loaded, key: &Key) -> anyhow::Result<Camera> {
    let view = view_of(key, &args.view);
    match input::override_camera(loaded.scene_cameras(), &view, loaded.metres_per_unit())? {
        Some(camera) => Ok(camera),
        None => input::pick_camera(loaded.scene_cameras(), view.camera.as_deref()).cloned(),
    }
}

/// The animation of that name, or the first, that moves the camera, if one is wished for.
fn animation<'a>(args: &RenderArgs, loaded: &'a Loaded, name: Option<&str>) -> anyhow::Result<&'a CameraAnimation> {
    if args.view.up.is_some() && !args.display.panorama {
        bail!("--up: the animation says where up is; leave it out");
    }
    if args.display.dof.is_some_and(|dof| dof.distance().is_none()) {
        bail!("--dof: with an animation, expected a distance, such as f/2.8,3.5: what is in the middle would jump");
    }
    if let Some(fov) = args.view.fov.filter(|fov| !(*fov > 0.0 && *fov < 180.0)) {
        bail!("--fov {fov}: expected more than 0 and less than 180 degrees");
    }
    let cameras = loaded.scene_cameras();
    let wish = args.view.camera.as_deref();
    let camera = wish.map(|wish| input::pick_camera(cameras, Some(wish))).transpose()?;
    let fits = |a: &&CameraAnimation| {
        name.is_none_or(|name| a.name == name) && camera.is_none_or(|c| std::ptr::eq(c, &cameras[a.camera]))
    };
    loaded.animations.iter().find(fits).ok_or_else(|| {
        let of = |a: &CameraAnimation| format!("\"{}\" of the camera \"{}\"", a.name, cameras[a.camera].name);
        let all: Vec<_> = loaded.animations.iter().take(20).map(of).collect();
        let asked = name.map_or_else(|| "animation".to_owned(), |name| format!("animation:{name}"));
        let by = wish.map_or_else(String::new, |wish| format!(" of the camera {wish}"));
        let there = if all.is_empty() {
            "no animation in the scene moves a camera; expected a glTF file in which one does, or a file of keys"
                .to_owned()
        } else {
            format!("the scene has {}", all.join(", "))
        };
        anyhow!("--path {asked}: no such animation{by}; {there}")
    })
}
