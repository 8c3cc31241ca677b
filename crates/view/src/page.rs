//! The files of `web/` as a page: from a server, or all in one.
//!
//! Its modules import each other by names that an import map leads to files, or, where there is only one file, to the
//! modules themselves as data. So nothing has to be bundled, and the page is the same in both.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Map, Value, json};

macro_rules! modules {
    ($($name:literal)*) => { &[$(($name, include_str!(concat!("../web/", $name)))),*] };
}

/// Names and texts of the modules.
#[rustfmt::skip]
pub const MODULES: &[(&str, &str)] = modules! {
    "actions.js"
    "announce.js"
    "camera.js"
    "colours.js"
    "controls.js"
    "legend.js"
    "live.js"
    "lookup.js"
    "main.js"
    "options.js"
    "painter.js"
    "panel.js"
    "progress.js"
    "projection.js"
    "readings.js"
    "renderer.js"
    "resources.js"
    "screenshot.js"
    "see-through.js"
    "settings.js"
    "shaders.js"
    "sheet.js"
    "shortcuts.js"
    "solve.js"
    "ticker.js"
    "url.js"
    "vec.js"
    "walk.js"
};

/// The style sheet.
pub const STYLE: &str = include_str!("../web/style.css");

const SKELETON: &str = include_str!("../web/index.html");

/// The page that a server gives, whose modules are beside it; inline scripts carry `nonce`.
pub fn served(name: &str, nonce: &str) -> String {
    let imports = imports(|name, _| format!("./{name}"));
    let map = format!("<script type=\"importmap\">{imports}</script>");
    let page = assembled(name, &map, "<link rel=\"stylesheet\" href=\"style.css\">", "");
    page.replace("<script", &format!("<script nonce=\"{nonce}\""))
}

/// The page in one file, with a scene and its light as containers, that reads from a disk and asks nobody for anything.
pub fn alone(name: &str, scene: &[u8], light: &[u8]) -> String {
    let imports = imports(|_, text| format!("data:text/javascript;base64,{}", STANDARD.encode(text)));
    let map = format!("<script type=\"importmap\">{imports}</script>");
    let policy = "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; \
        img-src data: blob:; connect-src 'none'; form-action 'none'; base-uri 'none'";
    let style = format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n<style>\n{STYLE}</style>");
    let data = [("walk-scene", scene), ("walk-light", light)].map(|(id, bytes)| {
        let packed = STANDARD.encode(compressed(bytes));
        format!("<script type=\"application/octet-stream;base64\" id=\"{id}\">{packed}</script>")
    });
    assembled(name, &map, &style, &data.join("\n"))
}

fn assembled(name: &str, map: &str, style: &str, data: &str) -> String {
    let name = name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    SKELETON
        .replacen("<title>twinray</title>", &format!("<title>{name} – twinray</title>"), 1)
        .replacen("<!-- style -->", style, 1)
        .replacen("<!-- importmap -->", map, 1)
        .replacen("<!-- walk -->", data, 1)
}

fn imports(of: impl Fn(&str, &str) -> String) -> Value {
    let entries = MODULES.iter().map(|(name, text)| (format!("twinray/{name}"), Value::String(of(name, text))));
    json!({ "imports": entries.collect::<Map<String, Value>>() })
}

/// In gzip, which browsers unpack themselves.
fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // A vector takes whatever is written.
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_modules_of_the_folder_are_served() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("web");
        let mut there: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .filter(|name| name.ends_with(".js"))
            .collect();
        there.sort();
        let listed: Vec<&str> = MODULES.iter().map(|(name, _)| *name).collect();
        assert_eq!(there, listed);
    }

    #[test]
    fn every_import_is_a_module() {
        for (name, text) in MODULES {
            for import in text.lines().filter(|l| l.contains("from \"")).filter(|l| !l.trim_start().starts_with('/')) {
                let wanted = import.split("from \"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
                let file = wanted.strip_prefix("twinray/").unwrap_or_else(|| panic!("{name}: {wanted}"));
                assert!(MODULES.iter().any(|(n, _)| *n == file), "{name} imports {wanted}");
            }
        }
    }

    #[test]
    fn a_page_alone_asks_nobody_for_anything() {
        let page = alone("A <scene>", b"scene", b"light");
        assert!(page.contains("<title>A &lt;scene> – twinray</title>"));
        assert!(!page.contains("<!-- "), "all places are filled");
        for outside in ["src=\"http", "href=\"http", "url(http", "import(\"http", "href=\"style.css", "\"./main.js"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }
}
