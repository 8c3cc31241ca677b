//! Checks of the workspace that need no compiler: the dependency table, what libraries may touch, the documents.
//!
//! Each is a function that answers with the first faults in words, called by `cargo xtask deps` and by a test.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::json::{self, Value};

/// Which of our crates a crate may use. `testkit` may be a dev-dependency of all of them.
const TABLE: &[(&str, &[&str])] = &[
    ("twinray-rays", &[]),
    ("twinray-scene", &["twinray-rays"]),
    ("twinray-solve", &["twinray-scene"]),
    ("twinray-render", &["twinray-scene", "twinray-solve"]),
    ("twinray-bake", &["twinray-scene", "twinray-solve", "twinray-render"]),
    ("twinray-format", &["twinray-scene", "twinray-solve", "twinray-render"]),
    (
        "twinray",
        &["twinray-rays", "twinray-scene", "twinray-solve", "twinray-render", "twinray-bake", "twinray-format"],
    ),
    ("twinray-view", &["twinray"]),
    ("twinray-cli", &["twinray", "twinray-view"]),
    ("twinray-validate", &["twinray"]),
    ("twinray-bench", &["twinray", "twinray-rays", "twinray-validate"]),
    ("twinray-testkit", &[]),
    ("xtask", &[]),
];

/// Crates that compute: they see no file, clock, terminal or environment.
const LIBRARIES: [&str; 6] = ["rays", "scene", "solve", "render", "bake", "format"];

/// What the libraries must not name outside their tests.
const OUTSIDE: [&str; 11] = [
    "std::fs",
    "std::env",
    "std::net",
    "std::process",
    "std::time",
    "Instant::now",
    "SystemTime",
    "println!",
    "eprint",
    "static mut",
    "thread_local!",
];

/// The documents whose links and names are checked.
const DOCUMENTS: [&str; 10] = [
    "README.md",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "docs/paper.md",
    "docs/formats.md",
    "docs/validation.md",
    "docs/performance.md",
    "docs/scale.md",
    "docs/bake.md",
    "docs/check.md",
];

/// The root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map_or_else(|| PathBuf::from("."), Path::to_owned)
}

/// Files below `folder` with the given extension, sorted.
pub fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, String> {
    let (mut folders, mut found) = (vec![folder.to_owned()], Vec::new());
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for path in entries.flatten().map(|e| e.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// The edges between our crates are those of the table.
pub fn dependencies_follow_the_table() -> Result<(), String> {
    let mut faults = Vec::new();
    for package in packages()? {
        let name = package.text("name");
        let Some((_, allowed)) = TABLE.iter().find(|(n, _)| *n == name) else {
            faults.push(format!("{name} is not in the table of xtask/src/structure.rs"));
            continue;
        };
        for dependency in package.list("dependencies") {
            let other = dependency.text("name");
            let ours = TABLE.iter().any(|(n, _)| *n == other);
            let testkit = other == "twinray-testkit" && dependency.text("kind") == "dev";
            if ours && !testkit && !allowed.contains(&other) {
                faults.push(format!("{name} must not depend on {other}"));
            }
        }
    }
    report(faults)
}

/// Every crate of other people is named in the architecture's list, which gives the reason.
pub fn borrowed_crates_have_their_reasons() -> Result<(), String> {
    let text = read(&root().join("ARCHITECTURE.md"))?;
    let mut faults = Vec::new();
    for package in packages()? {
        for dependency in package.list("dependencies") {
            let (name, other) = (package.text("name"), dependency.text("name"));
            if !TABLE.iter().any(|(n, _)| *n == other) && !text.contains(&format!("| `{other}` |")) {
                faults.push(format!("{name} borrows {other}; ARCHITECTURE.md does not say why"));
            }
            // Stored formats are promises, and `format` alone makes them.
            if other.starts_with("serde") && ["rays", "scene", "solve", "render"].iter().any(|l| name.ends_with(l)) {
                faults.push(format!("{name} must not know {other}"));
            }
        }
    }
    report(faults)
}

/// The libraries name no file, clock, terminal, environment or global variable outside their tests.
pub fn libraries_touch_nothing_outside() -> Result<(), String> {
    let mut faults = Vec::new();
    for library in LIBRARIES {
        for path in files(&root().join("crates").join(library).join("src"), "rs")? {
            let is_test =
                path.components().any(|c| ["tests.rs", "tests", "oracle"].iter().any(|t| c.as_os_str() == *t));
            if is_test {
                continue;
            }
            let text = read(&path)?;
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            for (number, line) in (1..).zip(code.lines()) {
                let line = line.split("//").next().unwrap_or_default();
                faults.extend(OUTSIDE.iter().filter(|word| line.contains(*word)).map(|word| {
                    let place = path.strip_prefix(root()).unwrap_or(&path).display();
                    format!("{place}:{number}: a library must not use {word}")
                }));
            }
        }
    }
    report(faults)
}

/// Relative links of the documents lead to files.
pub fn links_lead_somewhere() -> Result<(), String> {
    let mut faults = Vec::new();
    for document in DOCUMENTS {
        let path = root().join(document);
        let text = read(&path)?;
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            let outside = link.contains("://") || link.starts_with("mailto:");
            if !outside && !file.is_empty() && !path.parent().is_some_and(|folder| folder.join(file).exists()) {
                faults.push(format!("{document} links to {link}, which is not there"));
            }
        }
    }
    report(faults)
}

/// Names like `module::item` in the documents are those of something in the sources.
pub fn names_in_documents_exist() -> Result<(), String> {
    let mut sources = String::new();
    for folder in ["crates", "xtask"] {
        for path in files(&root().join(folder), "rs")? {
            sources.push_str(&read(&path)?);
            // A file is a module too.
            sources.push_str(&format!("\nmod {};\n", path.file_stem().unwrap_or_default().to_string_lossy()));
        }
    }
    let mut faults = Vec::new();
    for document in DOCUMENTS {
        for name in names(&read(&root().join(document))?) {
            let last = name.rsplit("::").next().unwrap_or_default();
            if !is_defined(&sources, last) {
                faults.push(format!("{document} names `{name}`; nothing is called {last}"));
            }
        }
    }
    report(faults)
}

/// The README's example is the one that is compiled and run: the doctest of the front door.
pub fn the_example_is_the_doctest() -> Result<(), String> {
    let readme = read(&root().join("README.md"))?;
    let pages = read(&root().join("crates/twinray/src/lib.rs"))?;
    let example = readme.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap_or_default();
    let shown: Vec<&str> = example.lines().collect();
    let run = pages.lines().map(|l| l.strip_prefix("//! ").unwrap_or(l.trim_start_matches("//!")));
    let run: Vec<&str> = run.skip_while(|l| *l != "```").skip(1).take(shown.len()).collect();
    let first = shown.iter().zip(&run).find(|(a, b)| a != b);
    match first {
        Some((a, b)) => Err(format!("README.md shows \"{a}\" where crates/twinray/src/lib.rs runs \"{b}\"")),
        None if shown.is_empty() || shown.len() != run.len() => Err("README.md shows no example".to_owned()),
        None => Ok(()),
    }
}

/// Words between single backticks that are paths of Rust.
fn names(text: &str) -> Vec<&str> {
    let quoted = text.lines().filter(|l| !l.starts_with("```")).flat_map(|l| l.split('`').skip(1).step_by(2));
    let is_path = |n: &&str| n.contains("::") && n.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == ':');
    quoted.filter(is_path).collect()
}

fn is_defined(sources: &str, name: &str) -> bool {
    let keywords = ["fn", "mod", "struct", "enum", "const", "type", "trait", "static"];
    keywords.iter().any(|keyword| {
        let definition = format!("{keyword} {name}");
        sources.match_indices(&definition).any(|(at, _)| {
            let next = sources[at + definition.len()..].chars().next();
            next.is_none_or(|c| !(c.is_ascii_alphanumeric() || c == '_'))
        })
    }) || sources.lines().any(|line| {
        // A variant or a field.
        let line = line.trim().trim_start_matches("pub ").trim_start_matches("pub(crate) ");
        line.strip_prefix(name).is_some_and(|rest| rest.starts_with([',', '(', ':']) || rest.starts_with(" {"))
    })
}

/// Packages of the workspace, as cargo sees them.
fn packages() -> Result<Vec<Value>, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--no-deps", "--format-version", "1"])
        .current_dir(root())
        .output()
        .map_err(|e| format!("cargo metadata could not be started: {e}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let document = json::parse(&text).ok_or("cargo metadata did not write JSON")?;
    Ok(document.list("packages").to_vec())
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn report(faults: Vec<String>) -> Result<(), String> {
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n  ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(outcome: Result<(), String>) {
        outcome.unwrap_or_else(|faults| panic!("\n  {faults}"));
    }

    #[test]
    fn edges_between_crates_are_those_of_the_table() {
        check(dependencies_follow_the_table());
        // The check sees something: the workspace has all crates of the table.
        assert_eq!(packages().unwrap().len(), TABLE.len());
    }

    #[test]
    fn every_borrowed_crate_has_its_reason() {
        check(borrowed_crates_have_their_reasons());
    }

    #[test]
    fn libraries_name_no_file_clock_or_terminal() {
        check(libraries_touch_nothing_outside());
    }

    #[test]
    fn links_of_the_documents_lead_to_files() {
        check(links_lead_somewhere());
    }

    #[test]
    fn the_readme_shows_the_doctest() {
        check(the_example_is_the_doctest());
    }

    #[test]
    fn names_in_the_documents_are_in_the_sources() {
        check(names_in_documents_exist());
        assert_eq!(names("a `b::c` and `d`, `e::F::g` `x :: y`"), ["b::c", "e::F::g"]);
        assert!(is_defined("pub fn abc(", "abc") && !is_defined("pub fn abcd(", "abc"));
    }
}
