//! What a solution file holds, in words: `info FILE.twin`.

use serde_json::{Map, Value, json};
use twinray::format::{Provenance, SolutionFile};
use twinray::scene::Rgb;
use twinray::solve::PatchLight;

use crate::failure::Ending;
use crate::input;

/// Says what the file holds.
pub fn describe(name: &str, as_json: bool) -> anyhow::Result<Ending> {
    let SolutionFile { provenance: p, light } = input::read_solution(name)?;
    let sums = Sums::of(&light);
    if as_json {
        println!("{:#}", report(name, &p, &light, &sums));
        return Ok(Ending::Done);
    }
    println!("scene      {}", p.scene);
    println!("method     {} ({})", p.method.name(), p.software);
    println!("rays       {}, seed {}", p.rays, p.seed);
    let settings: Vec<String> = p.settings.iter().map(|(name, value)| format!("{name} {value}")).collect();
    println!("settings   {}", settings.join(", "));
    println!("patches    {} ({} emitting), area {:.4} m²", light.len(), sums.emitting, sums.area);
    println!("error      {}", error_text(p.relative_error));
    println!("error bars {:.2} % of the patches have one", 100.0 * sums.known as f64 / light.len().max(1) as f64);
    let power = sums.power;
    println!("arriving   {:.6} {:.6} {:.6} W (R G B), Σ A E", power.r, power.g, power.b);
    println!("fingerprint {:016x}", p.fingerprint);
    Ok(Ending::Done)
}

fn report(name: &str, p: &Provenance, light: &PatchLight, sums: &Sums) -> Value {
    let settings: Map<String, Value> = p.settings.iter().map(|(k, v)| (k.clone(), Value::from(v.as_str()))).collect();
    json!({
        "file": name, "scene": p.scene, "method": p.method.name(), "software": p.software,
        "fingerprint": format!("{:016x}", p.fingerprint),
        "rays": p.rays, "seed": p.seed, "settings": settings,
        "patches": light.len(), "emitting_patches": sums.emitting, "patches_with_error": sums.known,
        "area": sums.area, "arriving_power_rgb": sums.power.to_array(),
        "relative_error": Some(p.relative_error).filter(|e| e.is_finite()),
    })
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
        let powers = light.area.iter().zip(&light.irradiance).map(|(a, e)| Rgb::from_f32(*e) * f64::from(*a));
        Self {
            area: light.area.iter().map(|a| f64::from(*a)).sum(),
            power: powers.sum(),
            emitting: light.emits.iter().filter(|e| **e).count(),
            known: light.standard_error.iter().filter(|e| e.is_finite()).count(),
        }
    }
}
