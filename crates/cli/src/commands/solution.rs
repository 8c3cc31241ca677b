//! What a solution file holds, in words: `info FILE.twin`.

use serde_json::{Map, Value, json};
use twinray::format::{Provenance, SolutionFile};
use twinray::scene::Rgb;
use twinray::solve::PatchLight;

use crate::failure::Ending;
use crate::stored::Stored;

/// Says what the file holds.
pub fn describe(name: &str, as_json: bool) -> anyhow::Result<Ending> {
    let stored = Stored::open(name)?;
    let SolutionFile { provenance: p, light, record } = stored.read_whole()?;
    let can_go_on = record.as_ref().is_some_and(|r| r.can_go_on());
    let sums = Sums::of(&light);
    if as_json {
        println!("{:#}", report(name, &p, &light, &sums, can_go_on));
        return Ok(Ending::Done);
    }
    println!("scene      {}", line(&p.scene));
    println!("method     {} ({})", p.method.name(), line(&p.software));
    println!("from       {}", line(&source_text(&p)));
    println!("rays       {}, {}", p.rays, seeds_text(&p));
    let settings: Vec<String> = p.settings.iter().map(|(name, value)| format!("{name} {value}")).collect();
    println!("settings   {}", line(&settings.join(", ")));
    println!("patches    {} ({} emitting), area {:.4} m²", light.len(), sums.emitting, sums.area);
    println!("error      {}", error_text(p.relative_error));
    println!("error bars {:.2} % of the patches have one", 100.0 * sums.known as f64 / light.len().max(1) as f64);
    let power = sums.power;
    println!("arriving   {:.6} {:.6} {:.6} W (R G B), Σ A E", power.r, power.g, power.b);
    println!("goes on    {}", if can_go_on { "yes: `twinray solve` makes it better" } else { "no" });
    println!("fingerprint {:016x}", p.fingerprint);
    Ok(Ending::Done)
}

fn report(name: &str, p: &Provenance, light: &PatchLight, sums: &Sums, can_go_on: bool) -> Value {
    let settings: Map<String, Value> = p.settings.iter().map(|(k, v)| (k.clone(), Value::from(v.as_str()))).collect();
    json!({
        "file": name, "scene": p.scene, "method": p.method.name(), "software": p.software,
        "fingerprint": format!("{:016x}", p.fingerprint),
        "rays": p.rays, "seed": p.seed, "part": p.part, "seeds": p.seeds, "settings": settings,
        "source": {
            "file": p.source.file, "metres_per_unit": p.source.metres_per_unit, "patches": p.source.patches,
            "patch_size": p.source.patch_size.filter(|s| s.is_finite()), "two_sided": p.source.two_sided,
            "light": p.source.light,
        },
        "can_go_on": can_go_on,
        "patches": light.len(), "emitting_patches": sums.emitting, "patches_with_error": sums.known,
        "area": sums.area, "arriving_power_rgb": sums.power.to_array(),
        "relative_error": Some(p.relative_error).filter(|e| e.is_finite()),
    })
}

/// What a file says, in one line.
fn line(text: &str) -> String {
    crate::plain(text).replace('\n', "\\n")
}

/// Where the scene was, and how it was cut.
fn source_text(p: &Provenance) -> String {
    let s = &p.source;
    let cut = match (s.patches, s.patch_size) {
        (Some(n), _) => format!("--patches {n}"),
        (None, Some(size)) => format!("--patch-size {size}"),
        (None, None) => "cut as it suggests".to_owned(),
    };
    let unit = if s.metres_per_unit == 1.0 { String::new() } else { format!(", {} m a unit", s.metres_per_unit) };
    let light: String = s.light.iter().map(|(name, value)| format!(", --{name} {value}")).collect();
    format!("{}, {cut}{unit}{}{light}", s.file, if s.two_sided { ", --two-sided" } else { "" })
}

fn seeds_text(p: &Provenance) -> String {
    match (p.part, p.seeds.len()) {
        (Some([k, n]), _) => format!("seed {} part {k}/{n}", p.seed),
        (None, 1) => format!("seed {}", p.seed),
        (None, n) => format!("{n} solves added up"),
    }
}

fn error_text(error: f32) -> String {
    if error.is_finite() { format!("{:.2} % (relative RMS, estimated)", 100.0 * error) } else { "unknown".to_owned() }
}

struct Sums {
    area: f64,
    power: Rgb,
    emitting: usize,
    known: usize,
}

impl Sums {
    fn of(light: &PatchLight) -> Self {
        let powers = light.area.iter().zip(&light.irradiance).map(|(a, e)| Rgb::from_f32(*e) * *a);
        Self {
            area: light.area.iter().sum(),
            power: powers.sum(),
            emitting: light.emits.iter().filter(|e| **e).count(),
            known: light.standard_error.iter().filter(|e| e.is_finite()).count(),
        }
    }
}
