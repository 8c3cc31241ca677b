//! `twinray export`: the light of every patch as a table or a mesh for other programs.

use std::io::{self, Write};
use std::path::Path;

use anyhow::{anyhow, bail};
use serde_json::json;
use twinray::format::{self, CellTable, Provenance, StoredSolution};

use crate::args::{ExportArgs, SolveArgs};
use crate::commands::{self, view};
use crate::estimate::Work;
use crate::failure::Ending;
use crate::input::{self, Loaded};
use crate::output::{Output, extension};
use crate::settings::Settings;
use crate::stored;

/// Runs the command.
pub fn run(args: &ExportArgs) -> anyhow::Result<Ending> {
    let name = &args.load.scene;
    let is_page = extension(&args.output) == "html";
    let write = if is_page { None } else { Some(writer(&args.output)?) };
    if !stored::is_solution(name) {
        bail!("{name}: is no solution; expected a .twin file: `twinray solve {name}` writes one");
    }
    commands::set_threads(args.load.threads);
    let loaded = input::load(&args.load, None, &Work::default())?;
    let mut output = Output::open(&args.output)?;
    commands::print_warnings(&loaded.warnings, args.load.quiet);
    let Some(stored) = &loaded.stored else { unreachable!("a solution was loaded") };
    let file = stored.read()?;
    match write {
        Some(write) => {
            let table = table(name, &loaded, &file)?;
            output.put(|out| write(&table, out))?;
        }
        None => {
            let page = view::export(args, &loaded)?;
            output.put(|out| out.write_all(&page))?;
        }
    }
    report(args, &loaded, file.provenance());
    Ok(Ending::Done)
}

type Writer = fn(&CellTable, &mut dyn Write) -> io::Result<()>;

/// The format that a name asks for.
fn writer(path: &Path) -> anyhow::Result<Writer> {
    Ok(match extension(path).as_str() {
        "npz" => |table, out| format::write_npz(table, out),
        "csv" => |table, out| format::write_csv(table, out),
        "ply" => |table, out| format::write_ply(table, out),
        "vtu" => |table, out| format::write_vtu(table, out),
        _ => bail!("{}: expected a name that ends in .npz, .csv, .ply, .vtu or .html", path.display()),
    })
}

/// The table of a solution; of a reference, which knows the light of its patches and no reflections, that of the light.
fn table<'a>(name: &str, loaded: &'a Loaded, file: &StoredSolution) -> anyhow::Result<CellTable<'a>> {
    let provenance = file.provenance();
    let Some(record) = file.record().map_err(|e| anyhow!("{e}"))? else {
        let light = file.light().map_err(|e| anyhow!("{e}"))?;
        return Ok(CellTable::of_light(&loaded.patches, light, provenance));
    };
    let settings = Settings::stored(name, provenance, &SolveArgs::default())?;
    let solution = record.solution(&loaded.patches, &settings.params()).map_err(|e| anyhow!("{name}: {e}"))?;
    Ok(CellTable::new(&loaded.patches, &solution, provenance))
}

fn report(args: &ExportArgs, loaded: &Loaded, p: &Provenance) {
    let (output, patches) = (args.output.display().to_string(), loaded.patches.len());
    if !args.load.quiet {
        crate::say!(
            "{output}: {patches} patches of {}, {} rays, estimated error {:.2} %, fingerprint {:016x}",
            p.scene,
            p.rays,
            100.0 * p.relative_error,
            p.fingerprint
        );
    }
    if args.load.json {
        let report = json!({
            "output": output, "scene": p.scene, "fingerprint": format!("{:016x}", p.fingerprint), "patches": patches,
            "rays": p.rays, "relative_error": Some(p.relative_error).filter(|e| e.is_finite()),
            "warnings": loaded.warnings,
        });
        println!("{report:#}");
    }
}
