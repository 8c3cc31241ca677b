//! Embree, where it is installed: found at run time, so that nothing has to be there to build.
//!
//! Versions 3 and 4 differ in the arguments of the intersection call alone, as far as it matters here (their headers:
//! `embree3/rtcore_ray.h`, `embree4/rtcore_scene.h`). All of the foreign code is called in this file.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};

use libloading::Library;
use twinray_rays::Ray;

use crate::rays::Triangle;

/// Environment variable that names the library.
const VARIABLE: &str = "TWINRAY_EMBREE";
/// Where the loader finds it otherwise.
const NAMES: [&str; 2] = ["libembree4.so.4", "libembree3.so.3"];

// Constants of Embree's headers.
const INVALID: c_uint = c_uint::MAX;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const BUFFER_INDEX: c_int = 0;
const BUFFER_VERTEX: c_int = 1;
const GEOMETRY_TRIANGLE: c_int = 0;
const FLAG_ROBUST: c_int = 4;
const QUALITY_MEDIUM: c_int = 1;
const QUALITY_HIGH: c_int = 2;
/// The property of a version's major part; minor and patch follow.
const PROPERTY_VERSION_MAJOR: c_int = 1;

type Handle = *mut c_void;
type Intersect3 = unsafe extern "C" fn(Handle, *mut Context3, *mut RayHit);
type Intersect4 = unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void);

/// `RTCRayHit` of both versions: the members that later versions add lie behind the others, in `rest`.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: c_uint,
    geometry: c_uint,
    rest: [c_uint; 5],
}

/// `RTCIntersectContext` of version 3, with room to spare.
#[repr(C)]
struct Context3 {
    flags: c_int,
    filter: *const c_void,
    instances: [c_uint; 4],
}

/// How a tree is built and walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Manner {
    /// `RTC_SCENE_FLAG_ROBUST`: no gaps between triangles.
    pub robust: bool,
    /// `RTC_BUILD_QUALITY_HIGH`: spatial splits.
    pub high_quality: bool,
}

/// Every manner, with its name.
pub const MANNERS: [(&str, Manner); 4] = [
    ("robust", Manner { robust: true, high_quality: false }),
    ("robust, high quality", Manner { robust: true, high_quality: true }),
    ("fast", Manner { robust: false, high_quality: false }),
    ("fast, high quality", Manner { robust: false, high_quality: true }),
];

/// The loaded library and its device.
pub struct Embree {
    /// Never closed: its threads outlive every device.
    library: &'static Library,
    device: Handle,
    version: [usize; 3],
}

impl Embree {
    /// Loads the library.
    ///
    /// # Errors
    /// In words, if there is none.
    pub fn open() -> Result<Self, String> {
        let named = std::env::var(VARIABLE).ok();
        let names = named.as_deref().map_or(NAMES.to_vec(), |name| vec![name]);
        // SAFETY: Embree's initialisers have no conditions on the program that loads it; what `VARIABLE` names is the
        // user's choice.
        let library = names.iter().find_map(|name| unsafe { Library::new(name) }.ok());
        let library = library.ok_or_else(|| {
            format!("no Embree found ({}); install libembree or name the library in {VARIABLE}", names.join(", "))
        })?;
        let library = Box::leak(Box::new(library));
        let mut this = Self { library, device: std::ptr::null_mut(), version: [0; 3] };
        // SAFETY: the types are those of the headers; a null configuration is the default one.
        unsafe {
            let new: unsafe extern "C" fn(*const c_char) -> Handle = this.function("rtcNewDevice")?;
            this.device = new(std::ptr::null());
        }
        if this.device.is_null() {
            return Err("Embree refuses to run here".to_owned());
        }
        // SAFETY: as above, and the device is alive.
        unsafe {
            let get: unsafe extern "C" fn(Handle, c_int) -> isize = this.function("rtcGetDeviceProperty")?;
            this.version = [0, 1, 2].map(|k| get(this.device, PROPERTY_VERSION_MAJOR + k) as usize);
        }
        match this.version[0] {
            3 | 4 => Ok(this),
            other => Err(format!("Embree {other} is not known here; expected 3 or 4")),
        }
    }

    /// Like "4.4.0".
    pub fn version(&self) -> String {
        self.version.map(|v| v.to_string()).join(".")
    }

    /// A tree over triangles.
    ///
    /// # Errors
    /// In words, if Embree reports one.
    pub fn scene(&self, triangles: &[Triangle], manner: Manner) -> Result<Scene<'_>, String> {
        let flags = if manner.robust { FLAG_ROBUST } else { 0 };
        let quality = if manner.high_quality { QUALITY_HIGH } else { QUALITY_MEDIUM };
        let corners = 3 * triangles.len();
        // SAFETY: the types are those of the headers, handles are used while they live, and buffers have the sizes that
        // are asked for: three floats a corner, and three numbers of corners a triangle.
        unsafe {
            let on_device: unsafe extern "C" fn(Handle) -> Handle = self.function("rtcNewScene")?;
            let handle = on_device(self.device);
            let intersect = match self.version[0] {
                3 => Intersect::Three(self.function("rtcIntersect1")?),
                _ => Intersect::Four(self.function("rtcIntersect1")?),
            };
            let scene = Scene { embree: self, handle, intersect };
            let with_number: unsafe extern "C" fn(Handle, c_int) = self.function("rtcSetSceneFlags")?;
            with_number(scene.handle, flags);
            let with_number: unsafe extern "C" fn(Handle, c_int) = self.function("rtcSetSceneBuildQuality")?;
            with_number(scene.handle, quality);

            let of_type: unsafe extern "C" fn(Handle, c_int) -> Handle = self.function("rtcNewGeometry")?;
            let geometry = of_type(self.device, GEOMETRY_TRIANGLE);
            type NewBuffer = unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void;
            let buffer: NewBuffer = self.function("rtcSetNewGeometryBuffer")?;
            let vertices = buffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, 12, corners).cast::<[f32; 3]>();
            let indices = buffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, 12, triangles.len()).cast::<c_uint>();
            if vertices.is_null() || indices.is_null() {
                return Err("Embree gives no memory".to_owned());
            }
            for (k, corner) in triangles.iter().flatten().enumerate() {
                vertices.add(k).write(*corner);
                indices.add(k).write(k as c_uint);
            }
            let on_handle: unsafe extern "C" fn(Handle) = self.function("rtcCommitGeometry")?;
            on_handle(geometry);
            let attach: unsafe extern "C" fn(Handle, Handle) -> c_uint = self.function("rtcAttachGeometry")?;
            attach(scene.handle, geometry);
            let on_handle: unsafe extern "C" fn(Handle) = self.function("rtcReleaseGeometry")?;
            on_handle(geometry);
            let on_handle: unsafe extern "C" fn(Handle) = self.function("rtcCommitScene")?;
            on_handle(scene.handle);
            let error: unsafe extern "C" fn(Handle) -> c_int = self.function("rtcGetDeviceError")?;
            match error(self.device) {
                0 => Ok(scene),
                code => Err(format!("Embree reports error {code}")),
            }
        }
    }

    /// A function of the library.
    ///
    /// # Safety
    /// `T` must be the function's type in the headers.
    unsafe fn function<T: Copy>(&self, name: &str) -> Result<T, String> {
        // SAFETY: by the condition above.
        let symbol = unsafe { self.library.get::<T>(name.as_bytes()) };
        symbol.map(|s| *s).map_err(|e| format!("Embree has no {name}: {e}"))
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: scenes borrow this value, so the device is used no more; its type is that of the header.
        unsafe {
            if let Ok(release) = self.function::<unsafe extern "C" fn(Handle)>("rtcReleaseDevice") {
                release(self.device);
            }
        }
    }
}

#[derive(Clone, Copy)]
enum Intersect {
    Three(Intersect3),
    Four(Intersect4),
}

/// A tree over triangles.
pub struct Scene<'a> {
    embree: &'a Embree,
    handle: Handle,
    intersect: Intersect,
}

// SAFETY: Embree documents that any number of threads may ask a committed scene at once; nothing else is done with it.
unsafe impl Sync for Scene<'_> {}

impl Scene<'_> {
    /// Triangle and distance of the nearest hit. `Ray::skip` is not known to Embree without a callback, which would slow
    /// it down: rays start above their triangle and so do not meet it again but by rounding.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<(u32, f32)> {
        let mut query = RayHit {
            origin: ray.origin,
            t_near: 0.0,
            direction: ray.direction,
            time: 0.0,
            t_far: ray.t_max,
            mask: c_uint::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            primitive: INVALID,
            geometry: INVALID,
            rest: [INVALID; 5],
        };
        // SAFETY: the scene is committed; ray and context are those of the version's headers (null arguments are the
        // defaults), aligned and alive during the call.
        unsafe {
            match self.intersect {
                Intersect::Three(intersect) => {
                    let mut context = Context3 { flags: 0, filter: std::ptr::null(), instances: [INVALID; 4] };
                    intersect(self.handle, &mut context, &mut query);
                }
                Intersect::Four(intersect) => intersect(self.handle, &mut query, std::ptr::null_mut()),
            }
        }
        (query.geometry != INVALID).then_some((query.primitive, query.t_far))
    }
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: the handle is used no more; the function's type is that of the header.
        unsafe {
            if let Ok(release) = self.embree.function::<unsafe extern "C" fn(Handle)>("rtcReleaseScene") {
                release(self.handle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_two_triangles() {
        let Ok(embree) = Embree::open() else {
            eprintln!("skipped: no Embree here");
            return;
        };
        let triangle = |z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        for (name, manner) in MANNERS {
            let scene = embree.scene(&[triangle(0.0), triangle(1.0)], manner).unwrap();
            let (triangle, t) = scene.closest(&Ray::new([0.25, 0.25, 3.0], [0.0, 0.0, -1.0])).unwrap();
            assert!(triangle == 1 && (t - 2.0).abs() < 1e-5, "{name}: {triangle} at {t}");
            assert_eq!(scene.closest(&Ray::new([2.0, 2.0, 3.0], [0.0, 0.0, -1.0])), None, "{name}");
        }
    }
}
