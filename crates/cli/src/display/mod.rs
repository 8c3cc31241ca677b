//! How a picture looks: options for the film, the lens and the screen, and what they become.
//!
//! Not here: whence the camera looks (`input`), how the light is computed (`commands`).

mod parse;

use anyhow::{anyhow, bail};
use clap::ValueEnum;
use twinray::render::{AovOptions, Aovs, Crop, Exposure, Picture, ToneCurve, WhiteBalance, aovs};
use twinray::scene::{Camera, Lens, Projection};

use crate::args::{MethodArg, RenderArgs};
use crate::commands::render::default_size;
use crate::denoise::Denoiser;
use crate::input::Loaded;
use parse::{crop, dof, exposure, fisheye, white_balance};

/// Options of film, lens and screen.
#[derive(Debug, clap::Args)]
pub struct DisplayArgs {
    /// Only this part of the picture: its first column and row, counted from 0 at the upper left, and its size
    #[arg(long, value_name = "X,Y,WxH", value_parser = crop)]
    pub crop: Option<Crop>,
    /// All around: longitude by latitude, 360° by 180°, upright; twice as wide as high by default
    #[arg(long, conflicts_with_all = ["fisheye", "fov", "dof"])]
    pub panorama: bool,
    /// A circle of so many degrees in all, up to 360, angles in proportion (equidistant); square by default
    #[arg(long, value_name = "DEGREES", value_parser = fisheye, allow_negative_numbers = true, conflicts_with_all = ["fov", "dof"])]
    pub fisheye: Option<f64>,
    /// Depth of field: the f-number of a full-frame camera, or the radius of the aperture; and the distance that is sharp,
    /// both in the scene's unit [default distance: what is in the middle of the picture]
    #[arg(long, value_name = "f/N|RADIUS[,DISTANCE]", value_parser = dof)]
    pub dof: Option<Dof>,
    /// Exposure of PNGs: auto; stops (EV) on radiance; or as a camera of so much ISO, seconds and f-number, such as
    /// camera:100,1/60,f/4, which takes radiance for nit
    #[arg(long, value_name = "auto|EV|camera:ISO,S,f/N", default_value = "auto", allow_hyphen_values = true, value_parser = exposure)]
    pub exposure: Exposure,
    /// What is white in PNGs: none, the white of screens; the light of a colour temperature in kelvin (lamps: 2700, daylight:
    /// 5500 to 6500); auto, the mean colour of what lamps light
    #[arg(long, value_name = "none|auto|K", default_value = "none", allow_hyphen_values = true, value_parser = white_balance)]
    pub white_balance: WhiteBalance,
    /// Tone curve of PNGs
    #[arg(long, value_enum, default_value = "agx")]
    pub tone: ToneArg,
    /// Layers of an .exr beside the picture, such as albedo,normal
    #[arg(long, value_enum, value_name = "LAYERS", value_delimiter = ',')]
    pub aov: Vec<AovArg>,
    /// Remove noise with Open Image Denoise (https://www.openimagedenoise.org), which takes it for noise whatever it is;
    /// needs a twinray built with `--features oidn`, and the library
    #[arg(long)]
    pub denoise: bool,
}

/// An aperture and what it is focussed on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dof {
    aperture: Aperture,
    /// In the scene's unit; `None` for what is in the middle.
    distance: Option<f64>,
}

impl Dof {
    /// What is sharp, in the scene's unit, if it says that.
    pub fn distance(self) -> Option<f64> {
        self.distance
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Aperture {
    FNumber(f64),
    /// In the scene's unit.
    Radius(f64),
}

/// Tone curves.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ToneArg {
    /// AgX-like: bright colours fade to white.
    Agx,
    /// ACES-like: more contrast and colour.
    Aces,
    /// Reinhard's, by luminance: soft.
    Reinhard,
    /// Clip at 1.
    None,
}

/// Layers of EXR files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AovArg {
    /// All that the method knows.
    All,
    /// Share of light that is reflected towards the camera.
    Albedo,
    /// Normals in world space.
    Normal,
    /// Metres from the camera.
    Depth,
    /// Light straight from emitters, at most once reflected.
    Direct,
    /// All other light.
    Indirect,
    /// Numbers of patches.
    Patch,
    /// Standard errors.
    Error,
}

/// A film: columns, rows, and the part of it that is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Film {
    /// Pixels in a row of the whole film.
    pub width: u32,
    /// Rows of the whole film.
    pub height: u32,
    /// The part that is wanted.
    pub crop: Option<Crop>,
}

impl Film {
    /// Columns and rows that are wanted.
    pub fn size(&self) -> (u32, u32) {
        self.crop.map_or((self.width, self.height), |c| (c.width, c.height))
    }
}

impl DisplayArgs {
    /// Tone curve.
    pub fn curve(&self) -> ToneCurve {
        match self.tone {
            ToneArg::Agx => ToneCurve::AgX,
            ToneArg::Aces => ToneCurve::Aces,
            ToneArg::Reinhard => ToneCurve::Reinhard,
            ToneArg::None => ToneCurve::None,
        }
    }

    /// Luminance of (1, 1, 1) for EXR files, cd/m²: 1 where the user says that radiance is nit, otherwise unknown.
    pub fn white_luminance(&self) -> Option<f32> {
        matches!(self.exposure, Exposure::Camera(_)).then_some(1.0)
    }

    /// Refuses layers that the file cannot hold or the method does not know.
    pub fn check(&self, method: MethodArg, extension: &str) -> anyhow::Result<()> {
        if !self.aov.is_empty() && extension != "exr" {
            bail!("--aov: layers need a file that holds them; expected -o with a name that ends in .exr");
        }
        let known = known(method);
        if let Some(unknown) = self.aov.iter().find(|a| !known.contains(a) && **a != AovArg::All) {
            bail!("--aov {}: --method {} does not know it; expected of {}", word(unknown), word(&method), words(known));
        }
        Ok(())
    }

    /// Size of the pictures that are wanted where no camera has to say; for the estimate.
    pub fn expected_size(&self, size: Option<(u32, u32)>) -> Option<(u32, u32)> {
        let wide = self.panorama.then_some((2 * DEFAULT_HEIGHT, DEFAULT_HEIGHT));
        let round = self.fisheye.map(|_| (DEFAULT_HEIGHT, DEFAULT_HEIGHT));
        self.crop.map(|c| (c.width, c.height)).or(size).or(wide).or(round)
    }

    /// Whether a layer is wanted.
    pub fn wants(&self, layer: AovArg) -> bool {
        self.aov.contains(&layer) || self.aov.contains(&AovArg::All)
    }
}

/// Height of a picture where the user does not say.
pub const DEFAULT_HEIGHT: u32 = 512;

/// Layers that a method can fill.
fn known(method: MethodArg) -> &'static [AovArg] {
    match method {
        MethodArg::Gather => &[
            AovArg::Albedo,
            AovArg::Normal,
            AovArg::Depth,
            AovArg::Direct,
            AovArg::Indirect,
            AovArg::Patch,
            AovArg::Error,
        ],
        MethodArg::Patches => &[AovArg::Albedo, AovArg::Normal, AovArg::Depth, AovArg::Patch],
        MethodArg::Path => &[AovArg::Albedo, AovArg::Normal, AovArg::Depth, AovArg::Patch, AovArg::Error],
    }
}

fn word(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned())
}

fn words(values: &[impl ValueEnum]) -> String {
    values.iter().map(word).collect::<Vec<_>>().join(", ")
}

/// The scene's camera with the projection and the lens that the options ask for. `focus`, metres, is what is sharp
/// whatever the options say.
///
/// # Errors
/// If a lens is asked of a parallel projection, or to focus on nothing.
pub fn camera(args: &RenderArgs, loaded: &Loaded, camera: &Camera, focus: Option<f64>) -> anyhow::Result<Camera> {
    let display = &args.display;
    if display.panorama {
        let up = args.view.up.map_or(glam::DVec3::Y, glam::DVec3::from_array);
        let level = camera.levelled(up);
        return Ok(Camera { projection: Projection::Panorama, aspect: Some(2.0), ..level });
    }
    if let Some(degrees) = display.fisheye {
        let projection = Projection::Fisheye { angle: degrees.to_radians() };
        return Ok(Camera { projection, aspect: Some(1.0), ..camera.clone() });
    }
    let Some(dof) = display.dof else { return Ok(camera.clone()) };
    let Projection::Perspective { vertical_fov } = camera.projection else {
        bail!("--dof: camera \"{}\" is a parallel projection, which has no lens; --fov gives it one", camera.name);
    };
    let unit = loaded.metres_per_unit();
    let focus = focus.or(dof.distance.map(|d| d * unit)).or_else(|| distance_in_the_middle(loaded, camera));
    let focus = focus.ok_or_else(|| {
        anyhow!("--dof: there is nothing in the middle of the picture to focus on; give a distance, such as f/2.8,3.5")
    })?;
    let lens = match dof.aperture {
        Aperture::FNumber(n) => Lens::full_frame(vertical_fov, n, focus),
        Aperture::Radius(radius) => Lens { radius: radius * unit, focus },
    };
    Ok(Camera { lens: Some(lens), ..camera.clone() })
}

/// Depth of what a camera sees in the middle of its picture, metres.
fn distance_in_the_middle(loaded: &Loaded, camera: &Camera) -> Option<f64> {
    // One of many pixels: a ray within a hundredth of the film around its middle.
    let (side, crop) = (201, Some(Crop { x: 100, y: 100, width: 1, height: 1 }));
    let seen = aovs(&loaded.patches, camera, &AovOptions { width: side, height: side, crop, samples: 1 });
    let depth = *seen.depth?.first()?;
    (depth != Aovs::NO_DEPTH && depth > 0.0).then_some(f64::from(depth))
}

/// Size of the film, and the part of it that is wanted.
///
/// # Errors
/// If the crop leaves the film.
pub fn film(args: &RenderArgs, camera: &Camera) -> anyhow::Result<Film> {
    let (width, height) = args.size.unwrap_or_else(|| default_size(camera));
    let crop = args.display.crop;
    if let Some(Crop { x, y, width: w, height: h }) = crop.filter(|c| !c.lies_within(width, height)) {
        bail!(
            "--crop {x},{y},{w}x{h}: is not within the picture, which has {width}x{height} pixels; --size changes that"
        );
    }
    Ok(Film { width, height, crop })
}

/// What removes noise, if that is wanted; it is looked for before anything is paid for.
pub fn denoiser(args: &RenderArgs) -> anyhow::Result<Option<Denoiser>> {
    args.display.denoise.then(Denoiser::open).transpose()
}

/// Removes noise, if that is wanted.
///
/// # Errors
/// What the library says.
pub fn denoise(
    denoiser: Option<&Denoiser>,
    picture: &mut Picture,
    loaded: &Loaded,
    camera: &Camera,
    film: &Film,
    samples: u32,
) -> anyhow::Result<()> {
    let Some(denoiser) = denoiser else { return Ok(()) };
    let Film { width, height, crop } = *film;
    denoiser.denoise(picture, &aovs(&loaded.patches, camera, &AovOptions { width, height, crop, samples }))
}

/// The layers that are wanted and that the scene alone decides.
pub fn layers(args: &RenderArgs, loaded: &Loaded, camera: &Camera, film: &Film, samples: u32) -> Aovs {
    let wants = |layer| args.display.wants(layer);
    if ![AovArg::Albedo, AovArg::Normal, AovArg::Depth, AovArg::Patch].into_iter().any(wants) {
        return Aovs::default();
    }
    let Film { width, height, crop } = *film;
    let seen = aovs(&loaded.patches, camera, &AovOptions { width, height, crop, samples });
    Aovs {
        albedo: seen.albedo.filter(|_| wants(AovArg::Albedo)),
        normal: seen.normal.filter(|_| wants(AovArg::Normal)),
        depth: seen.depth.filter(|_| wants(AovArg::Depth)),
        patch: seen.patch.filter(|_| wants(AovArg::Patch)),
        ..Aovs::default()
    }
}
