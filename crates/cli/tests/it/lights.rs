//! Light from the command line and from files: lamps without area, profiles, maps, skies, units; solutions remember it.

use serde_json::{Value, json};

use crate::support::{FLOOR, Place, warnings};

/// A floor of 4 m² and these lights at nodes 1 m above it.
fn lit(lights: Value) -> String {
    let positions: Vec<u8> = [[-1f32, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]]
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let indices: Vec<u8> = [0u16, 1, 2, 0, 2, 3].iter().flat_map(|x| x.to_le_bytes()).collect();
    let bytes: Vec<String> = [positions, indices].concat().iter().map(|b| format!("%{b:02x}")).collect();
    let count = lights.as_array().unwrap().len();
    let mut nodes = vec![json!({ "mesh": 0 })];
    nodes.extend((0..count).map(|k| {
        json!({ "translation": [0, 1, 0], "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()],
            "extensions": { "KHR_lights_punctual": { "light": k } } })
    }));
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": (0..=count).collect::<Vec<_>>() }],
        "nodes": nodes, "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": lights } },
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "emissiveFactor": [0, 0, 0], "pbrMetallicRoughness": { "metallicFactor": 0 } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, -1], "max": [1, 0, 1] },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 12 }],
        "buffers": [{ "byteLength": 60, "uri": format!("data:application/octet-stream,{}", bytes.concat()) }],
    })
    .to_string()
}

/// A downlight of π · 100 lm: 100 cd · cos γ.
fn ies() -> String {
    let angles: Vec<f64> = (0..=18).map(|k| 5.0 * f64::from(k)).collect();
    let words = |list: Vec<f64>| list.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let candela = angles.iter().map(|a| 100.0 * a.to_radians().cos().max(0.0)).collect();
    format!("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 19 1 1 2 0 0 0\n1 1 10\n{}\n0\n{}\n", words(angles), words(candela))
}

/// A map of 8 × 4 pixels, all alike.
fn map(mantissa: u8) -> Vec<u8> {
    let pixels = [mantissa, mantissa, mantissa, 129].repeat(32);
    [&b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"[..], &pixels].concat()
}

fn number(report: &Value, path: &str) -> f64 {
    report.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {report}"))
}

#[test]
fn point_lights_light_and_no_sky_is_added() {
    let place = Place::new();
    place.write("a.gltf", lit(json!([{ "name": "bulb", "type": "point", "intensity": 100 }])));
    let report = place.done(&["info", "a.gltf", "--json"]).json();
    assert_eq!((&report["lights"], &report["environment"]), (&json!(1), &json!(false)));
    let flux = 4.0 * std::f64::consts::PI * 100.0;
    assert!((number(&report, "/power/emitted") / flux - 1.0).abs() < 1e-9);
    assert!((number(&report, "/lights_power_rgb/0") / flux - 1.0).abs() < 1e-9);
    // Half goes upwards, and more passes the floor.
    assert!(number(&report, "/power/escaped") > 0.5 * flux);
    let warned = warnings(&report);
    assert!(!warned.iter().any(|w| w.contains("no light")), "{warned:?}");
    // A picture, by every method.
    place.render(&["a.gltf", "--eye", "0,2,3", "--target", "0,0,0"]);
    let view = ["--eye", "0,2,3", "--target", "0,0,0", "--size", "64x48"];
    place.done(&[&["render", "a.gltf", "--method", "path", "--samples", "4", "-o", "path.png"], &view[..]].concat());
    let refused = place.run(&["render", "a.gltf", "--preset", "paper"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("default preset"), "{}", refused.stderr);
}

#[test]
fn profiles_replace_the_intensity_of_named_lights() {
    let place = Place::new();
    let lights = json!([{ "name": "bulb", "type": "point", "color": [1, 0.5, 0.5] }, { "name": "sun", "type": "directional", "intensity": 0 }]);
    place.write("a.gltf", lit(lights));
    place.write("down.ies", ies());
    let report = place.done(&["info", "a.gltf", "--ies", "bulb=down.ies", "--json"]).json();
    let power = ["/lights_power_rgb/0", "/lights_power_rgb/1", "/lights_power_rgb/2"].map(|p| number(&report, p));
    let luminance = 0.2126 * power[0] + 0.7152 * power[1] + 0.0722 * power[2];
    // The chords of five degrees leave 0.1 %.
    assert!((luminance / (100.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{luminance}");
    assert!((power[1] / power[0] - 0.5).abs() < 1e-12, "{power:?}");
    for (option, words) in [
        ("lamp=down.ies", ["no such light", "\"bulb\", \"sun\""]),
        ("sun=down.ies", ["directional", "point or spot"]),
        ("bulb=none.ies", ["none.ies", "cannot be read"]),
        ("bulb=a.gltf", ["a.gltf", "TILT="]),
    ] {
        let run = place.run(&["info", "a.gltf", "--ies", option]);
        assert_eq!(run.code, Some(2), "{option}");
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{option}: {}", run.stderr);
    }
}

#[test]
fn skies_give_the_illuminance_they_should() {
    let place = Place::new();
    place.write("floor.obj", FLOOR);
    let info = |options: &[&str]| place.done(&[&["info", "floor.obj", "--json"], options].concat()).json();
    // Open ground: 4 m² under 10 000 lx, under what the user says, under a clear sky without and with a sun of 30°. The lower side
    // sees the ground far away, which sends a fifth of that back.
    for (options, lux) in [
        (&["--sky", "overcast"][..], 10_000.0),
        (&["--sky", "uniform", "--sky-lux", "123"], 123.0),
        (&["--sky", "clear", "--sun", "30,100", "--no-sun"], 800.0 + 15_500.0 * 0.5f64.sqrt()),
        (&["--sky", "clear", "--sun", "30,100"], 800.0 + 15_500.0 * 0.5f64.sqrt() + 0.5 * 127_500.0 * (-0.42f64).exp()),
    ] {
        let found = number(&info(options), "/power/sky") / (4.0 * 1.2);
        // 200 000 rays, of which a fifth meets the floor: 1 %.
        assert!((found / lux - 1.0).abs() < 0.02, "{options:?}: {found} lx, expected {lux}");
    }
    let preetham =
        number(&info(&["--when", "2026-06-21T12:00+02:00", "--where", "52.5,13.4"]), "/power/sky") / (4.0 * 1.2);
    assert!((60_000.0..120_000.0).contains(&preetham), "{preetham}");
    for (options, words) in [
        (&["--sun", "-1,0"][..], "below the horizon"),
        (&["--sky", "preetham"], "where is the sun"),
        (&["--sun", "10"], "elevation and azimuth"),
        (&["--when", "2026-06-21T12:00Z"], "--where"),
        (&["--env", "a.hdr", "--sky", "clear"], "cannot be used with"),
        (&["--env", "nowhere.hdr"], "nowhere.hdr: cannot be read"),
        (&["--env", "floor.obj"], "Radiance (.hdr) or OpenEXR"),
    ] {
        let run = place.run(&[&["info", "floor.obj"], options].concat());
        assert!(run.code == Some(2) && run.stderr.contains(words), "{options:?}: {}", run.stderr);
    }
}

#[test]
fn solutions_remember_what_lit_them() {
    let place = Place::new();
    std::fs::create_dir(place.path("out")).unwrap();
    place.write("floor.obj", FLOOR);
    place.write("sky.hdr", map(127));
    let lit = ["--env", "sky.hdr", "--env-rotation", "30", "--env-strength", "2"];
    let solve =
        [&["solve", "floor.obj", "-o", "out/a.twin", "--patches", "500", "--rays", "100000"], &lit[..]].concat();
    place.done(&solve);
    let report = place.done(&["info", "out/a.twin", "--json"]).json();
    assert_eq!(
        report["source"]["light"],
        json!([["env", "../sky.hdr"], ["env-rotation", "30"], ["env-strength", "2"]])
    );
    // π · 2 · 127.5/128 lx on both sides of 4 m².
    let expected = 8.0 * std::f64::consts::PI * 2.0 * 127.5 / 128.0;
    assert!((number(&report, "/arriving_power_rgb/0") / expected - 1.0).abs() < 0.02, "{report}");
    let view = ["--eye", "0,2,3", "--target", "0,0,0", "--size", "64x48"];
    let render = |options: &[&str]| place.run(&[&["render", "out/a.twin", "-o", "a.png"], &view[..], options].concat());
    assert_eq!(render(&[]).code, Some(0), "{}", render(&[]).stderr);
    // It may be repeated, and may be elsewhere now; what differs is named.
    std::fs::copy(place.path("sky.hdr"), place.path("other.hdr")).unwrap();
    assert_eq!(render(&lit).code, Some(0));
    assert_eq!(render(&["--env", "other.hdr", "--env-rotation", "30", "--env-strength", "2"]).code, Some(0));
    for options in [&["--env", "sky.hdr"][..], &["--sky", "overcast"]] {
        let run = render(options);
        assert!(
            run.code == Some(2) && run.stderr.contains("was solved with another --"),
            "{options:?}: {}",
            run.stderr
        );
    }
    // Going on keeps it, and merging hands it on.
    place.done(&["solve", "out/a.twin", "--rays", "150000"]);
    place.done(
        &[&["solve", "floor.obj", "-o", "b.twin", "--patches", "500", "--rays", "100000", "--seed", "2"], &lit[..]]
            .concat(),
    );
    place.done(&["merge", "out/a.twin", "b.twin", "-o", "merged.twin"]);
    let merged = place.done(&["info", "merged.twin", "--json"]).json();
    assert_eq!(merged["source"]["light"][0], json!(["env", "sky.hdr"]));
    // Another map is another scene.
    place.write("sky.hdr", map(100));
    let run = render(&[]);
    assert!(run.code == Some(2) && run.stderr.contains("files that lit it"), "{}", run.stderr);
    std::fs::remove_file(place.path("sky.hdr")).unwrap();
    assert!(render(&[]).stderr.contains("sky.hdr: cannot be read"));
}

#[test]
fn units_are_brought_together_and_doubtful_ones_are_named() {
    let place = Place::new();
    let watts = 683.0;
    place.write("a.gltf", lit(json!([{ "name": "bulb", "type": "point", "intensity": watts }])));
    let shining = lit(json!([{ "name": "bulb", "type": "point", "intensity": watts }]))
        .replace("\"emissiveFactor\":[0,0,0]", "\"emissiveFactor\":[1,1,1]");
    place.write("b.gltf", shining);
    place.write(
        "c.gltf",
        lit(json!([{ "type": "point", "intensity": 100 }, { "type": "directional", "intensity": 3 }])),
    );
    let info = |file: &str, units: &str| place.done(&["info", file, "--units", units, "--json"]).json();
    for (units, factor) in [("auto", 1.0), ("si", 1.0), ("blender-683", 1.0 / 683.0), ("blender-177", 1.0 / 177.83)] {
        let power = number(&info("a.gltf", units), "/lights_power_rgb/1");
        assert!((power / (4.0 * std::f64::consts::PI * watts * factor) - 1.0).abs() < 1e-9, "{units}: {power}");
    }
    assert!((number(&info("a.gltf", "unitless"), "/lights_power_rgb/1") / watts - 1.0).abs() < 1e-9);
    let doubts = |file: &str, units: &str| {
        let report = info(file, units);
        warnings(&report).iter().any(|w| w.contains("--units"))
    };
    assert!(!doubts("a.gltf", "auto") && doubts("b.gltf", "auto") && doubts("c.gltf", "auto"));
    assert!(!doubts("b.gltf", "si") && !doubts("b.gltf", "blender-683") && !doubts("c.gltf", "si"));
}
