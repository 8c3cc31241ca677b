//! Denoising of pictures with Intel's Open Image Denoise, where the command was built for it and the library is there.
//!
//! Never on by default: what it takes for noise may be a thing, and no error bar knows. The library is found at run time, so
//! that nothing has to be installed to build; all of its foreign code is called in this file. Versions 1 and 2 differ in one
//! name, as far as it matters here (their header: `OpenImageDenoise/oidn.h`).

#[cfg(not(feature = "oidn"))]
pub use absent::Denoiser;
#[cfg(feature = "oidn")]
pub use present::Denoiser;

/// Where the library comes from.
const WHERE: &str = "https://www.openimagedenoise.org has the library";

#[cfg(not(feature = "oidn"))]
mod absent {
    use anyhow::bail;
    use twinray::render::{Aovs, Picture};

    /// Nothing: the command was built without.
    #[derive(Debug)]
    pub enum Denoiser {}

    impl Denoiser {
        /// # Errors
        /// Always, with what to do.
        pub fn open() -> anyhow::Result<Self> {
            bail!(
                "--denoise: this twinray was built without it. Build with `cargo install --path crates/cli --features oidn`; {}",
                super::WHERE
            )
        }

        /// Never called.
        pub fn denoise(&self, _: &mut Picture, _: &Aovs) -> anyhow::Result<()> {
            match *self {}
        }
    }
}

#[cfg(feature = "oidn")]
#[allow(unsafe_code)]
mod present {
    use std::ffi::{CStr, c_char, c_int, c_void};
    use std::ptr::null;

    use anyhow::{anyhow, bail};
    use libloading::Library;
    use twinray::render::{Aovs, Picture};

    /// Names of the library, of which the loader finds one.
    #[cfg(target_os = "linux")]
    const NAMES: [&str; 2] = ["libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1"];
    #[cfg(target_os = "macos")]
    const NAMES: [&str; 2] = ["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.1.dylib"];
    #[cfg(not(any(target_os = "linux", target_os = "macos")))]
    const NAMES: [&str; 1] = ["OpenImageDenoise.dll"];

    // Constants of the header.
    const DEVICE_CPU: c_int = 1;
    const FORMAT_FLOAT3: c_int = 3;

    type Handle = *mut c_void;
    type SetImage = unsafe extern "C" fn(Handle, *const c_char, Handle, c_int, usize, usize, usize, usize, usize);

    /// The library.
    #[derive(Debug)]
    pub struct Denoiser {
        /// Never unloaded: its threads outlive its last call, and version 1 ends the process if its code goes away under them.
        library: &'static Library,
    }

    impl Denoiser {
        /// Finds the library.
        ///
        /// # Errors
        /// If it is not there, with where to get it.
        pub fn open() -> anyhow::Result<Self> {
            // SAFETY: loading runs the library's initialisers; it is the one that the user has installed under this name.
            let found = NAMES.iter().find_map(|name| unsafe { Library::new(name) }.ok());
            let library = found.ok_or_else(|| {
                anyhow!(
                    "--denoise: the loader finds no {}: {}; on Linux LD_LIBRARY_PATH may say where it lies",
                    NAMES[0],
                    super::WHERE
                )
            })?;
            Ok(Self { library: Box::leak(Box::new(library)) })
        }

        /// Denoises linear radiance in place; `aovs` must have albedo and normal.
        ///
        /// # Errors
        /// What the library says.
        pub fn denoise(&self, picture: &mut Picture, aovs: &Aovs) -> anyhow::Result<()> {
            let (Some(albedo), Some(normal)) = (&aovs.albedo, &aovs.normal) else {
                bail!("--denoise: the picture has no albedo and normal");
            };
            let (width, height) = (picture.image.width as usize, picture.image.height as usize);
            let count = width * height;
            let color = picture.image.pixels.clone();
            assert!([color.len(), albedo.len(), normal.len()] == [count; 3], "layers have the size of their picture");
            // SAFETY: the signatures are those of the header, in both versions. Handles are used until they are released
            // below. Images are `[height, width, 3]` floats without gaps, as was just asserted, outlive the filter, and none
            // overlaps the output, which alone is written.
            unsafe {
                let new_device: unsafe extern "C" fn(c_int) -> Handle = self.function(b"oidnNewDevice")?;
                let commit_device: unsafe extern "C" fn(Handle) = self.function(b"oidnCommitDevice")?;
                let release_device: unsafe extern "C" fn(Handle) = self.function(b"oidnReleaseDevice")?;
                let error: unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int =
                    self.function(b"oidnGetDeviceError")?;
                let new_filter: unsafe extern "C" fn(Handle, *const c_char) -> Handle =
                    self.function(b"oidnNewFilter")?;
                let set_image: SetImage = self.function(b"oidnSetSharedFilterImage")?;
                let set_bool: unsafe extern "C" fn(Handle, *const c_char, bool) =
                    self.function(b"oidnSetFilterBool").or_else(|_| self.function(b"oidnSetFilter1b"))?;
                let commit_filter: unsafe extern "C" fn(Handle) = self.function(b"oidnCommitFilter")?;
                let execute: unsafe extern "C" fn(Handle) = self.function(b"oidnExecuteFilter")?;
                let release_filter: unsafe extern "C" fn(Handle) = self.function(b"oidnReleaseFilter")?;

                let device = new_device(DEVICE_CPU);
                if device.is_null() {
                    bail!("--denoise: Open Image Denoise does not work on this processor");
                }
                commit_device(device);
                let filter = new_filter(device, c"RT".as_ptr());
                if !filter.is_null() {
                    let set = |name: &CStr, image: Handle| {
                        set_image(filter, name.as_ptr(), image, FORMAT_FLOAT3, width, height, 0, 0, 0);
                    };
                    set(c"color", color.as_ptr() as Handle);
                    set(c"albedo", albedo.as_ptr() as Handle);
                    set(c"normal", normal.as_ptr() as Handle);
                    set(c"output", picture.image.pixels.as_mut_ptr() as Handle);
                    set_bool(filter, c"hdr".as_ptr(), true);
                    commit_filter(filter);
                    execute(filter);
                    release_filter(filter);
                }
                let mut message = null();
                let code = error(device, &raw mut message);
                let text = match message.is_null() {
                    true => String::new(),
                    false => CStr::from_ptr(message).to_string_lossy().into_owned(),
                };
                release_device(device);
                if code != 0 || filter.is_null() {
                    bail!("--denoise: Open Image Denoise says \"{text}\" (error {code})");
                }
            }
            Ok(())
        }

        /// A function of the library.
        ///
        /// # Safety
        /// `F` must be its signature.
        unsafe fn function<F: Copy>(&self, name: &[u8]) -> anyhow::Result<F> {
            // SAFETY: as the caller promises.
            let symbol = unsafe { self.library.get::<F>(name) };
            let missing = |e| anyhow!("--denoise: this Open Image Denoise is of another kind: {e}");
            symbol.map(|f| *f).map_err(missing)
        }
    }
}
