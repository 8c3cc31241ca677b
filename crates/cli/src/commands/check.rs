//! `twinray check`: what ruins a bake, found before it is paid for.

use std::collections::BTreeMap;

use anyhow::bail;
use serde_json::json;
use twinray::scene::check::{CheckOptions, Finding, Kind, Severity, check};

use crate::args::CheckArgs;
use crate::commands::{self, check_picture};
use crate::failure::Ending;
use crate::input;
use crate::output::{Output, extension};

/// Elements of one kind that are listed for a reader; all are in the JSON report.
const LISTED: usize = 10;

/// Runs the command.
pub fn run(args: &CheckArgs) -> anyhow::Result<Ending> {
    if let Some(path) = args.picture.as_ref().filter(|p| extension(p) != "png") {
        bail!("{}: expected a name that ends in .png", path.display());
    }
    commands::set_threads(args.load.threads);
    let authored = input::load_authored(&args.load, &args.view)?;
    let output = args.picture.as_deref().map(Output::open).transpose()?;
    let options = CheckOptions { texture_size: args.texture_size, density: args.density };
    let mut findings = check(&authored.scene, &authored.patches, &authored.cameras, &options);
    findings.retain(|f| !args.allow.contains(&f.kind));
    let legend = match output {
        Some(output) => check_picture::draw(args, &authored, &findings, output)?,
        None => Vec::new(),
    };
    if args.load.json {
        let report = json!({
            "scene": authored.scene.name,
            "findings": findings.iter().map(finding_json).collect::<Vec<_>>(),
            "errors": of(&findings, Severity::Error), "warnings": of(&findings, Severity::Warning),
            "notes": of(&findings, Severity::Note),
            "allowed": args.allow.iter().map(|k| k.id()).collect::<Vec<_>>(),
            "reading": authored.warnings,
            "legend": legend.iter().map(|(what, colour)| json!({ "what": what, "colour": colour })).collect::<Vec<_>>(),
        });
        println!("{report:#}");
    } else if !args.load.quiet {
        commands::print_warnings(&authored.warnings, false);
        print!("{}", crate::plain(&report(&authored.scene.name, &findings)));
        legend.iter().for_each(|(what, colour)| println!("{colour:>16}  {what}"));
    }
    let is_bad = findings.iter().any(|f| f.severity != Severity::Note);
    Ok(if is_bad { Ending::Exceeded } else { Ending::Done })
}

fn of(findings: &[Finding], severity: Severity) -> usize {
    findings.iter().filter(|f| f.severity == severity).count()
}

fn finding_json(f: &Finding) -> serde_json::Value {
    json!({
        "kind": f.kind.id(), "severity": f.severity.id(), "element": f.element.to_string(),
        "count": f.count, "area": f.area, "worst": { "value": f.worst.value, "unit": f.worst.unit },
        "message": f.message, "advice": f.kind.advice(),
    })
}

/// For a reader: kinds by their worst finding, each with what to do and its elements.
fn report(scene: &str, findings: &[Finding]) -> String {
    let mut kinds: BTreeMap<(Severity, Kind), Vec<&Finding>> = BTreeMap::new();
    for f in findings {
        let worst = findings.iter().filter(|g| g.kind == f.kind).map(|g| g.severity).min().unwrap_or(f.severity);
        kinds.entry((worst, f.kind)).or_default().push(f);
    }
    let mut text = String::new();
    for ((severity, kind), of_kind) in &kinds {
        text += &format!("{} {}: {}\n", severity.id(), kind.id(), kind.advice());
        for f in of_kind.iter().take(LISTED) {
            text += &format!("    {}: {}\n", f.element, f.message);
        }
        if of_kind.len() > LISTED {
            text += &format!("    and {} more\n", of_kind.len() - LISTED);
        }
    }
    let [errors, warnings, notes] = [Severity::Error, Severity::Warning, Severity::Note].map(|s| of(findings, s));
    text + &format!("{scene}: {errors} errors, {warnings} warnings, {notes} notes\n")
}
