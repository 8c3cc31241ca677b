//! Two solutions of one scene: how far apart, how much of it their error bars explain, where it is worst.

use anyhow::bail;
use serde_json::{Value, json};
use twinray::format::SolutionFile;
use twinray::render::compare::{self, LightDifference, PatchDifference};

use crate::args::CompareArgs;
use crate::commands::compare::verdict;
use crate::failure::Ending;
use crate::stored::Stored;

/// Compares `args.test` with `args.reference`.
pub fn run(args: &CompareArgs) -> anyhow::Result<Ending> {
    if args.metric.is_some() {
        bail!("--metric is for pictures; solutions are compared by the relative RMS of irradiance: leave it out");
    }
    if args.diff.is_some() {
        bail!("--diff is for pictures; expected two PNG or EXR pictures, or no --diff");
    }
    let stored = [Stored::open(&args.test)?, Stored::open(&args.reference)?];
    let (test, reference) = (stored[0].read_whole()?, stored[1].read_whole()?);
    if let Some(difference) = what_differs(&test, &reference) {
        bail!(
            "{} and {} are not of the same patches: {difference}. Solve both with the same scene, --patches (or --patch-size), --unit and --two-sided",
            args.test,
            args.reference
        );
    }
    let (a, b) = (&test.provenance, &reference.provenance);
    if a.seeds.iter().any(|seed| b.seeds.contains(seed)) && a.method == b.method && !args.quiet {
        crate::say!(
            "warning: both have the seed {}: their errors are not independent, and z-scores say little",
            a.seed
        );
    }
    let difference = compare::solutions(&test.light, &reference.light);
    if args.json {
        println!("{:#}", report(args, &test, &reference, &difference));
    } else if !args.quiet {
        print(args, &reference, &difference);
    }
    let limit = args.max_error.map_or(f64::NAN, |limit| limit.value);
    let rms = difference.relative_rms;
    Ok(verdict(args, "the relative RMS difference", rms, rms <= limit))
}

/// Why the patches of two solutions are not the same ones; `None` if they are.
pub(super) fn what_differs(a: &SolutionFile, b: &SolutionFile) -> Option<String> {
    let (p, q) = (&a.provenance, &b.provenance);
    if p.fingerprint == q.fingerprint && a.light.len() == b.light.len() {
        return None;
    }
    Some(if p.scene != q.scene {
        format!("the scenes are \"{}\" and \"{}\"", p.scene, q.scene)
    } else if a.light.len() != b.light.len() {
        format!("there are {} and {} patches", a.light.len(), b.light.len())
    } else if a.light.area != b.light.area {
        "they have other areas, so the geometry has changed".to_owned()
    } else if a.light.emits != b.light.emits {
        "other patches emit".to_owned()
    } else {
        format!(
            "areas and emitters agree, but the fingerprints {:016x} and {:016x} do not: colours, lights or places have changed",
            p.fingerprint, q.fingerprint
        )
    })
}

fn print(args: &CompareArgs, reference: &SolutionFile, d: &LightDifference) {
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    println!(
        "{} against {}: {}, {} patches compared, {} that emit left out",
        args.test, args.reference, reference.provenance.scene, d.compared, d.emitting
    );
    println!("difference {} relative RMS, √(ΣA ΔE²/ΣA E_B²) of luminance", percent(d.relative_rms));
    println!("bias       {:+.3} % of the arriving light", 100.0 * d.bias);
    let Some(z) = &d.z else {
        println!("error bars none: no patch has a finite standard error in both files");
        return print_worst("largest differences", &d.worst_by_difference);
    };
    println!(
        "error bars predict {} for the {} of {} patches that have them{}",
        percent(d.expected_rms),
        percent(d.relative_rms_with_error),
        z.count,
        if d.without_error > 0 { format!("; {} have none", d.without_error) } else { String::new() }
    );
    println!(
        "z-scores   mean |z| {:.3} (normal: 0.798), mean {:+.3}; {:.1} % within 1 (68.3), {:.1} % within 2 (95.4)",
        z.mean_abs,
        z.mean,
        100.0 * z.within_1,
        100.0 * z.within_2
    );
    let counts: Vec<String> = z.histogram.iter().map(u64::to_string).collect();
    println!("           below -4 | steps of 0.5 | above 4: {}", counts.join(" "));
    print_worst("largest |z|", &d.worst_by_z);
    print_worst("largest differences", &d.worst_by_difference);
}

fn print_worst(title: &str, worst: &[PatchDifference]) {
    if worst.is_empty() {
        return;
    }
    println!("{title}, by patch:");
    for w in worst {
        let z = if w.z.is_nan() { "no error bar".to_owned() } else { format!("z {:+.2}", w.z) };
        println!("  {:>8}  {:.6} against {:.6}, {z}", w.patch, w.irradiance[0], w.irradiance[1]);
    }
}

fn report(args: &CompareArgs, test: &SolutionFile, reference: &SolutionFile, d: &LightDifference) -> Value {
    let worst = |list: &[PatchDifference]| -> Value {
        let patch = |w: &PatchDifference| json!({ "patch": w.patch, "test": w.irradiance[0], "reference": w.irradiance[1], "z": w.z });
        list.iter().map(patch).collect()
    };
    let made = |file: &SolutionFile| {
        let p = &file.provenance;
        json!({ "method": p.method.name(), "rays": p.rays, "seed": p.seed, "software": p.software })
    };
    let z = d.z.as_ref().map(|z| {
        json!({ "count": z.count, "mean": z.mean, "mean_abs": z.mean_abs, "within_1": z.within_1,
            "within_2": z.within_2, "histogram": z.histogram })
    });
    json!({
        "kind": "solutions", "test": args.test, "reference": args.reference,
        "scene": reference.provenance.scene, "fingerprint": format!("{:016x}", reference.provenance.fingerprint),
        "test_made_by": made(test), "reference_made_by": made(reference),
        "patches": { "compared": d.compared, "emitting": d.emitting, "without_error": d.without_error },
        "relative_rms": d.relative_rms, "bias": d.bias,
        "relative_rms_with_error": d.relative_rms_with_error, "expected_rms": d.expected_rms,
        "explained": d.explained(),
        "z": z,
        "worst_by_z": worst(&d.worst_by_z), "worst_by_difference": worst(&d.worst_by_difference),
        "equal": d.relative_rms == 0.0,
    })
}
