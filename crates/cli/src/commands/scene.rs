//! `twinray scene`: built-in scenes as files, and files as other files.

use std::path::Path;

use anyhow::bail;
use twinray::format;
use twinray::scene::builtin;

use crate::args::SceneArgs;
use crate::failure::Ending;
use crate::input;
use crate::output::{Output, extension};

/// Runs the command.
pub fn run(args: &SceneArgs) -> anyhow::Result<Ending> {
    let Some(name) = &args.scene else {
        for (name, description) in builtin::NAMES {
            println!("{name:15} {description}");
        }
        return Ok(Ending::Done);
    };
    let Some(path) = &args.output else { bail!("where to? expected -o FILE.glb or -o FILE.obj") };
    let (mut scene, warnings) = input::read_any(name, &args.read)?;
    warnings.iter().for_each(|w| crate::say!("warning: {w}"));
    match extension(path).as_str() {
        "glb" => Output::open(path)?.write(&format::write_glb(&scene))?,
        "obj" => {
            // The object file names its materials by the file's stem.
            scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            let files = format::write_obj(&scene);
            let folder = path.parent().unwrap_or(Path::new(""));
            let side_files = files.textures.iter().map(|(name, bytes)| (name, bytes));
            for (name, bytes) in side_files.chain([(&files.mtl_name, &files.mtl)]) {
                Output::open(&folder.join(name))?.write(bytes)?;
            }
            Output::open(path)?.write(&files.obj)?;
        }
        _ => bail!("{}: expected a name that ends in .glb or .obj", path.display()),
    }
    Ok(Ending::Done)
}
