//! Films of frames, by ffmpeg where it is installed: found at run time, as a program of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, anyhow, bail};

use crate::output::{BesideFolder, Output, extension};

/// A kind of film.
struct Kind {
    extension: &'static str,
    /// Encoders that can make it, the best first, with what each is told.
    encoders: &'static [(&'static str, &'static [&'static str])],
    /// Whether colours are stored as luma and chroma of half the resolution.
    is_subsampled: bool,
}

/// Qualities that look like the frames at a tenth of their size.
const KINDS: [Kind; 3] = [
    Kind {
        extension: "mp4",
        encoders: &[
            ("libx264", &["-crf", "16", "-preset", "slow", "-movflags", "+faststart"]),
            ("libopenh264", &["-b:v", "20M", "-movflags", "+faststart"]),
            ("mpeg4", &["-q:v", "2", "-movflags", "+faststart"]),
        ],
        is_subsampled: true,
    },
    Kind {
        extension: "webm",
        encoders: &[
            ("libvpx-vp9", &["-crf", "24", "-b:v", "0", "-row-mt", "1"]),
            ("libvpx", &["-crf", "8", "-b:v", "20M"]),
        ],
        is_subsampled: true,
    },
    Kind {
        extension: "webp",
        encoders: &[
            ("libwebp_anim", &["-quality", "90", "-loop", "0"]),
            ("libwebp", &["-quality", "90", "-loop", "0"]),
        ],
        is_subsampled: false,
    },
];

/// True if a name is that of a film.
pub fn is_film(path: &Path) -> bool {
    KINDS.iter().any(|kind| kind.extension == extension(path))
}

/// A film to be made, its frames in a folder beside it.
pub struct Video {
    output: Output,
    folder: BesideFolder,
    kind: &'static Kind,
    encoder: usize,
}

impl Video {
    /// Looks for ffmpeg and opens the place, before anything is paid for.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let kind = KINDS.iter().find(|kind| kind.extension == extension(path)).context("expected a film")?;
        let instead = "or write the frames alone, such as with -o %04d.png";
        let known = Command::new("ffmpeg").args(["-hide_banner", "-encoders"]).stdin(Stdio::null()).output();
        let known = known.map_err(|error| {
            anyhow!(
                "{}: films are made by ffmpeg, which cannot be run ({error}): install it (https://ffmpeg.org) so that it is on the PATH, {instead}",
                path.display()
            )
        })?;
        let known = String::from_utf8_lossy(&known.stdout);
        let has = |name: &str| known.split_whitespace().any(|word| word == name);
        let encoder = kind.encoders.iter().position(|(name, _)| has(name)).ok_or_else(|| {
            let names: Vec<_> = kind.encoders.iter().map(|(name, _)| *name).collect();
            anyhow!("{}: this ffmpeg has none of {}: install one that has, {instead}", path.display(), names.join(", "))
        })?;
        let output = Output::open(path)?;
        let folder = BesideFolder::of(&output)?;
        Ok(Self { output, folder, kind, encoder })
    }

    /// Where a frame of the film belongs.
    pub fn frame(&self, number: usize) -> PathBuf {
        self.folder.path().join(format!("{number:08}.png"))
    }

    /// Makes the film of the frames from `first` on, and puts it in its place.
    pub fn finish(mut self, first: usize, fps: f64) -> anyhow::Result<()> {
        let made = self.encode(first, fps).and_then(|bytes| self.output.put(|out| out.write_all(&bytes)));
        if made.is_err() {
            // They may have taken hours, and ffmpeg can be tried again by hand.
            self.folder.keep();
        }
        made.with_context(|| format!("{}: the frames are kept in {}", self.output.name(), self.folder.path().display()))
    }

    fn encode(&self, first: usize, fps: f64) -> anyhow::Result<Vec<u8>> {
        let folder = self.folder.path();
        let film = format!("film.{}", self.kind.extension);
        let (encoder, settings) = self.kind.encoders[self.encoder];
        let mut command = Command::new("ffmpeg");
        command.current_dir(folder).args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-framerate", &fps.to_string(), "-start_number", &first.to_string(), "-i", "%08d.png"]);
        if self.kind.is_subsampled {
            // Sides have to be even: an odd one loses a row of pixels. Players take what says nothing for Rec. 709.
            let filter = "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p";
            command.args(["-vf", filter, "-colorspace", "bt709", "-color_primaries", "bt709"]);
            command.args(["-color_trc", "iec61966-2-1", "-color_range", "tv"]);
        }
        command.args(["-c:v", encoder]).args(settings).arg(&film);
        // Out of reach of a Ctrl-C that is meant for us: what there is will be a film.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let ran = command.stdin(Stdio::null()).output().context("ffmpeg cannot be run")?;
        if !ran.status.success() {
            let said = String::from_utf8_lossy(&ran.stderr);
            let last: Vec<&str> = said.lines().rev().take(3).collect();
            bail!("ffmpeg failed ({}): {}", ran.status, last.into_iter().rev().collect::<Vec<_>>().join("; "));
        }
        std::fs::read(folder.join(film)).context("the film cannot be read")
    }
}
