//! Writes `docs/validation.md` and its plots; ends with 1 if a comparison fails.
//!
//! With the name of a part (`analytic`, `cie`, ...) only that part is computed, and written to standard output.

use std::path::Path;
use std::process::ExitCode;

use twinray_validate::case::{Case, Effort};
use twinray_validate::report::{self, Section};
use twinray_validate::{PARTS, Part, commit};

fn main() -> ExitCode {
    let wish = std::env::args().nth(1);
    let parts: Vec<&Part> = PARTS.iter().filter(|(name, _)| wish.as_deref().is_none_or(|w| w == *name)).collect();
    if parts.is_empty() {
        eprintln!("usage: twinray-validate [PART]; parts: {}", PARTS.map(|(name, _)| name).join(", "));
        return ExitCode::from(2);
    }
    let mut sections = Vec::new();
    let mut failed = false;
    for (name, part) in parts {
        eprintln!("validate: {name}");
        let section = part(Effort::DOCUMENT);
        let faults: Vec<String> = section.cases.iter().flat_map(Case::faults).collect();
        faults.iter().for_each(|fault| eprintln!("validate: FAIL {fault}"));
        failed |= !faults.is_empty();
        sections.push(section);
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    match wish {
        Some(_) => sections.iter().for_each(|section| println!("{}", report::part(section))),
        None => {
            if let Err(error) = write(&root.join("docs"), &sections, &commit::hash(&root)) {
                eprintln!("validate: docs: {error}");
                return ExitCode::from(2);
            }
        }
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn write(docs: &Path, sections: &[Section], commit: &str) -> std::io::Result<()> {
    let folder = docs.join("validation");
    std::fs::create_dir_all(&folder)?;
    for figure in sections.iter().flat_map(|s| &s.figures) {
        std::fs::write(folder.join(figure.name).with_extension("svg"), &figure.svg)?;
    }
    std::fs::write(docs.join("validation.md"), report::document(sections, commit))
}
