//! `twinray merge`: solves of one scene added up, as if all of their rays had been shot by one.

use std::path::Path;

use anyhow::{anyhow, bail};
use serde_json::json;
use twinray::format::{self, Method, Provenance, SolutionFile};
use twinray::scene::sample::stream::mix;
use twinray::solve::{self, PatchLight, Record};

use crate::args::MergeArgs;
use crate::failure::Ending;
use crate::lights::LightSettings;
use crate::output::{Output, extension};
use crate::stored::{self, Stored};

/// Runs the command.
pub fn run(args: &MergeArgs) -> anyhow::Result<Ending> {
    if extension(&args.output) != "twin" {
        bail!("{}: expected a name that ends in .twin", args.output.display());
    }
    let stored: Vec<Stored> = args.files.iter().map(|name| Stored::open(name)).collect::<Result<_, _>>()?;
    let files = args.files.iter().zip(&stored).map(|(name, s)| Ok(Part { name, file: s.read_whole()? }));
    // In an order of their own: what is written does not depend on who is named first.
    let mut parts: Vec<Part> = files.collect::<anyhow::Result<_>>()?;
    parts.sort_by(|a, b| a.file.provenance.seeds.cmp(&b.file.provenance.seeds));
    check(&parts)?;
    let mut output = Output::open(&args.output)?;
    spare(args, &parts)?;
    let folder = args.output.parent().unwrap_or(Path::new(""));
    let merged = merge(&parts, folder)?;
    output.put(|out| format::write_solution(&merged, out))?;
    report(args, &parts, &merged);
    Ok(Ending::Done)
}

/// Refuses to replace what can be gone on with by what cannot.
fn spare(args: &MergeArgs, parts: &[Part]) -> anyhow::Result<()> {
    let name = args.output.display().to_string();
    let Some(there) = args.output.is_file().then(|| Stored::open(&name).ok()).flatten() else { return Ok(()) };
    let Ok(file) = there.read() else { return Ok(()) };
    if file.can_go_on() && file.provenance().fingerprint == parts[0].file.provenance.fingerprint {
        bail!(
            "{name}: holds a solve of this scene that can be gone on with, and a merge cannot: expected another name"
        );
    }
    Ok(())
}

/// One of the files.
struct Part<'a> {
    name: &'a str,
    file: SolutionFile<'a>,
}

/// Refuses what does not belong together.
fn check(parts: &[Part]) -> anyhow::Result<()> {
    let first = &parts[0];
    for part in parts {
        let (a, b) = (&first.file.provenance, &part.file.provenance);
        let pair = format!("{} and {}", first.name, part.name);
        if let Some(difference) = super::compare_solutions::what_differs(&first.file, &part.file) {
            bail!("{pair} are not of the same patches: {difference}. Solve both with the same scene, cut alike");
        }
        if a.method != b.method {
            bail!("{pair} were made in different ways, {} and {}; expected one", a.method.name(), b.method.name());
        }
        if let Some((key, x, y)) = different_setting(a, b) {
            bail!("{pair} were solved with different settings: {key} is \"{x}\" and \"{y}\"");
        }
        if let Some(Record::Sequential(_)) = part.file.record {
            bail!(
                "{}: is of the paper preset, whose average over iterations begins dark: many short ones together are no long one. Go on with one of them instead (`twinray solve FILE --rays N`)",
                part.name
            );
        }
    }
    for (k, part) in parts.iter().enumerate() {
        for other in &parts[..k] {
            let twice = part.file.provenance.seeds.iter().find(|s| other.file.provenance.seeds.contains(s));
            if twice.is_some() {
                let same = seed_and_part(&part.file.provenance);
                bail!(
                    "{} and {} have random numbers in common ({same}): their errors are the same, and together they know no more than the longer one. Solve with another --seed or --part",
                    other.name,
                    part.name
                );
            }
        }
    }
    Ok(())
}

fn seed_and_part(p: &Provenance) -> String {
    match (p.part, p.seeds.len()) {
        (Some([k, n]), _) => format!("seed {} part {k}/{n}", p.seed),
        (None, 1) => format!("seed {}", p.seed),
        (None, n) => format!("one of {n} that were added up before"),
    }
}

/// A setting that is not the same in both. How a reference was traced changes nothing but its error.
fn different_setting<'a>(a: &'a Provenance, b: &'a Provenance) -> Option<(&'a str, &'a str, &'a str)> {
    if a.method == Method::Reference {
        return None;
    }
    let of = |p: &'a Provenance, key: &str| p.settings.iter().find(|(k, _)| k == key).map_or("", |(_, v)| v.as_str());
    let keys = a.settings.iter().chain(&b.settings).map(|(key, _)| key.as_str());
    keys.map(|key| (key, of(a, key), of(b, key))).find(|(_, x, y)| x != y)
}

fn merge(parts: &[Part], folder: &Path) -> anyhow::Result<SolutionFile<'static>> {
    let first = &parts[0].file;
    let provenances = || parts.iter().map(|part| &part.file.provenance);
    let (light, record, error) = match first.record {
        Some(_) => {
            let records = parts.iter().filter_map(|part| match &part.file.record {
                Some(Record::Waves(waves)) => Some((identity(&part.file.provenance.seeds), waves)),
                _ => None,
            });
            let record = Record::Waves(solve::merge(&records.collect::<Vec<_>>()).map_err(|e| anyhow!("{e}"))?);
            let (light, error) = record.light(first.light.area.clone(), first.light.emits.clone());
            (light, Some(record), error)
        }
        None => {
            let light = PatchLight::mean(&parts.iter().map(|part| &part.file.light).collect::<Vec<_>>());
            let error = light.relative_error();
            (light, None, error)
        }
    };
    let mut seeds: Vec<u64> = provenances().flat_map(|p| p.seeds.iter().copied()).collect();
    seeds.sort_unstable();
    // Of several places of the scene the first in the alphabet: any would do, but always the same.
    let mut sources: Vec<_> = parts
        .iter()
        .map(|part| {
            let source = &part.file.provenance.source;
            let scene = stored::scene_of(part.name, source, None).unwrap_or_else(|_| source.file.clone());
            let place = |file: &str| stored::seen_from(&stored::beside(part.name, file), folder);
            let light = LightSettings::from_words(part.name, &source.light, place);
            // What this twinray does not know it hands on as it is.
            let light = light.map_or_else(|_| source.light.clone(), |light| light.words(str::to_owned));
            (stored::seen_from(&scene, folder), format::SceneSource { light, ..source.clone() })
        })
        .collect();
    sources.sort_by(|a, b| a.0.cmp(&b.0));
    let (file, source) = sources.swap_remove(0);
    let provenance = Provenance {
        source: format::SceneSource { file, ..source },
        rays: provenances().fold(0, |rays: u64, p| rays.saturating_add(p.rays)),
        seed: provenances().map(|p| p.seed).min().unwrap_or_default(),
        part: None,
        seeds,
        relative_error: error as f32,
        software: concat!("twinray ", env!("CARGO_PKG_VERSION")).to_owned(),
        ..first.provenance.clone()
    };
    Ok(SolutionFile { provenance, light, record })
}

/// One number for the solves of a file: its seed, or of several a mixture of theirs, which is nobody's seed.
fn identity(seeds: &[u64]) -> u64 {
    match seeds {
        [seed] => *seed,
        _ => seeds.iter().fold(0, |mixed, seed| mix(mixed ^ seed)),
    }
}

fn report(args: &MergeArgs, parts: &[Part], merged: &SolutionFile) {
    let p = &merged.provenance;
    let missing = missing_parts(parts);
    if !args.quiet {
        missing.iter().for_each(|m| crate::say!("note: {m}"));
        crate::say!(
            "{}: {} files, {} solves, {} rays, estimated error {:.2} %, fingerprint {:016x}",
            args.output.display(),
            parts.len(),
            p.seeds.len(),
            p.rays,
            100.0 * p.relative_error,
            p.fingerprint
        );
    }
    if args.json {
        let report = json!({
            "output": args.output.display().to_string(), "files": args.files, "solves": p.seeds.len(),
            "scene": p.scene, "fingerprint": format!("{:016x}", p.fingerprint), "patches": merged.light.len(),
            "rays": p.rays, "relative_error": Some(p.relative_error).filter(|e| e.is_finite()), "notes": missing,
        });
        println!("{report:#}");
    }
}

/// Where files are parts, which of their fellows are not there: no fault, but good to know.
fn missing_parts(parts: &[Part]) -> Vec<String> {
    let mut sets: Vec<(u64, u32, Vec<u32>)> = Vec::new();
    for p in parts.iter().map(|part| &part.file.provenance) {
        let Some([k, n]) = p.part else { continue };
        match sets.iter_mut().find(|(seed, of, _)| (*seed, *of) == (p.seed, n)) {
            Some((_, _, there)) => there.push(k),
            None => sets.push((p.seed, n, vec![k])),
        }
    }
    let missing = |(seed, n, there): &(u64, u32, Vec<u32>)| {
        let absent: Vec<String> = (1..=*n).filter(|k| !there.contains(k)).map(|k| k.to_string()).collect();
        let shown = absent.iter().take(10).cloned().collect::<Vec<_>>().join(", ");
        let more = if absent.len() > 10 { ", …" } else { "" };
        (!absent.is_empty()).then(|| {
            format!(
                "{} of {n} parts of seed {seed}, without {shown}{more}: the light is right, its error larger",
                there.len()
            )
        })
    };
    sets.iter().filter_map(missing).collect()
}
