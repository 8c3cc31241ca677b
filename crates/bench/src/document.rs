//! The document: sections from stored results, and every target with what was measured of it.

use std::fmt::Write;
use std::path::Path;

use twinray_validate::report::Figure;

use crate::parts::Part;
use crate::results::Record;

/// A part in words.
#[derive(Clone, Debug)]
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// What was measured and how, with tables.
    pub text: String,
    /// Plots, after the text.
    pub figures: Vec<Figure>,
    /// What was to be reached.
    pub targets: Vec<Target>,
}

/// Something to be reached, and what was.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    what: String,
    bound: String,
    measured: String,
    reached: bool,
}

impl Target {
    /// A value that should not be below a bound; both are shown by `show`.
    pub fn at_least(what: String, bound: f64, measured: f64, show: fn(f64) -> String) -> Self {
        Self { what, bound: format!("≥ {}", show(bound)), measured: show(measured), reached: measured >= bound }
    }

    /// A value that should not be above a bound.
    pub fn at_most(what: String, bound: f64, measured: f64, show: fn(f64) -> String) -> Self {
        Self { what, bound: format!("≤ {}", show(bound)), measured: show(measured), reached: measured <= bound }
    }

    /// A value that should be below a bound.
    pub fn below(what: String, bound: f64, measured: f64, show: fn(f64) -> String) -> Self {
        Self { what, bound: format!("< {}", show(bound)), measured: show(measured), reached: measured < bound }
    }

    /// The same with something said before the measured value, like "≈".
    pub fn noted(self, note: &str) -> Self {
        Self { measured: format!("{note}{}", self.measured), ..self }
    }
}

/// Writes `docs/performance.md` and its plots from the results below `root`.
pub fn write(root: &Path, parts: &[Part]) -> Result<(), String> {
    let (mut sections, mut missing) = (Vec::new(), Vec::new());
    for part in parts {
        match Record::read(root, part.name)? {
            Some(record) => {
                let section = (part.describe)(&record.result);
                sections.push((section.map_err(|e| format!("benches/results/{}.json: {e}", part.name))?, record));
            }
            None => missing.push((part.name, part.what)),
        }
    }
    let docs = root.join("docs");
    let folder = docs.join("performance");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for figure in sections.iter().flat_map(|(section, _)| &section.figures) {
        let path = folder.join(figure.name).with_extension("svg");
        std::fs::write(&path, &figure.svg).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    let path = docs.join("performance.md");
    std::fs::write(&path, text(&sections, &missing)).map_err(|e| format!("{}: {e}", path.display()))
}

/// The document of these sections; `missing` are parts without a result.
fn text(sections: &[(Section, Record)], missing: &[(&str, &str)]) -> String {
    let targets: Vec<&Target> = sections.iter().flat_map(|(section, _)| &section.targets).collect();
    let reached = targets.iter().filter(|t| t.reached).count();
    let mut out = format!(
        "# Performance\n\n\
         How fast twinray is, measured against itself, against another ray kernel and against the aims of this project. This file is \
         written by `cargo xtask bench`, which takes some ten minutes of an otherwise idle machine; do not edit it. `cargo xtask bench \
         PART` measures one part anew, `cargo xtask bench document` only writes this file, from the results in `benches/results`.\n\n\
         Figures of different machines say little about each other, ratios a little more. So most aims are ratios, and whatever is \
         compared took turns in one run, in which a machine that slows down for a while slows all. *M* stands for millions.\n\n\
         ## Aims\n\n{reached} of {} are reached.\n\n",
        targets.len()
    );
    let row = |t: &&Target| {
        vec![t.what.clone(), t.bound.clone(), t.measured.clone(), if t.reached { "yes" } else { "**no**" }.to_owned()]
    };
    out += &table(&["aim", "target", "measured", "reached"], &targets.iter().map(row).collect::<Vec<_>>());
    out.push('\n');
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|(name, what)| format!("`{name}` ({what})")).collect();
        let _ = write!(out, "\nNot measured yet: {}.\n", names.join(", "));
    }
    out += "\n## What was measured where\n\n";
    let rows: Vec<Vec<String>> = sections
        .iter()
        .map(|(section, record)| {
            let origin = &record.origin;
            vec![
                section.title.to_owned(),
                format!("`cargo xtask bench {}`", record.part),
                origin.commit.clone(),
                format!("{}, {} cores", origin.processor, origin.cores),
                seconds(record.seconds),
            ]
        })
        .collect();
    out += &table(&["section", "command", "commit", "processor", "took"], &rows);
    out.push('\n');
    for (section, _) in sections {
        let _ = write!(out, "\n## {}\n\n{}\n", section.title, section.text);
        for figure in &section.figures {
            let _ = write!(out, "\n![{0}](performance/{0}.svg)\n\n{1}\n", figure.name, figure.caption);
        }
    }
    out
}

/// A table of Markdown.
pub fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let mut lines = vec![format!("| {} |", head.join(" | ")), format!("|{}", "---|".repeat(head.len()))];
    lines.extend(rows.iter().map(|cells| format!("| {} |", cells.join(" | "))));
    lines.join("\n")
}

/// A count or a rate in millions, three digits.
pub fn millions(x: f64) -> String {
    digits(1e-6 * x)
}

/// A ratio.
pub fn times(x: f64) -> String {
    format!("{x:.2}×")
}

/// A share, percent.
pub fn share(x: f64) -> String {
    format!("{:.0} %", 100.0 * x)
}

/// An error, percent.
pub fn percent(x: f64) -> String {
    format!("{} %", digits(100.0 * x))
}

/// A time.
pub fn seconds(x: f64) -> String {
    format!("{} s", digits(x))
}

/// Three significant digits; whole numbers above a thousand.
pub fn digits(x: f64) -> String {
    // Of the rounded value: 0.9999 is 1.00.
    let scientific = format!("{x:.2e}");
    let magnitude: f64 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0.0);
    if !(-4.0..=6.0).contains(&magnitude) {
        return format!("{x:.1e}");
    }
    format!("{x:.*}", (2.0 - magnitude).max(0.0) as usize)
}

/// Whole decades around positive values, for an axis.
pub fn decades(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values.filter(|v| *v > 0.0).fold((f64::MAX, 0.0), |(l, h), v| (f64::min(l, v), f64::max(h, v)));
    if high == 0.0 {
        return [1.0, 10.0];
    }
    let (first, last) = (libm::log10(low * 1.001).floor(), libm::log10(high * 0.999).ceil());
    [first, last.max(first + 1.0)].map(|e| libm::pow(10.0, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::origin::Origin;

    #[test]
    fn numbers_have_three_digits() {
        let shown = [0.0, 0.012345, 1.2345, 0.99999, 12345.6, 5.5e16].map(digits);
        assert_eq!(shown, ["0.00", "0.0123", "1.23", "1.00", "12346", "5.5e16"]);
        assert_eq!((millions(2.5e6), percent(0.0512), times(1.004)), ("2.50".into(), "5.12 %".into(), "1.00×".into()));
        assert_eq!(decades([7e3, 1.1e7].into_iter()), [1e3, 1e8]);
        assert_eq!(decades([1e3, 1e7].into_iter()), [1e3, 1e7]);
    }

    #[test]
    fn a_missed_target_and_a_missing_part_are_seen() {
        let targets = vec![
            Target::at_least("speed".into(), 2.0, 1.0, times),
            Target::below("time".into(), 4.0, 3.5, seconds),
            Target::at_most("cost".into(), 2.0, 2.0, times).noted("≈ "),
        ];
        let figures = vec![Figure { name: "plot", caption: "Under it.".into(), svg: String::new() }];
        let section = Section { title: "Speed", text: "Words.".into(), figures, targets };
        let origin = Origin { commit: "abc".into(), processor: "Some 9".into(), cores: 2 };
        let record = Record { part: "kernel".into(), origin, seconds: 3.0, result: serde_json::Value::Null };
        let text = text(&[(section, record)], &[("threads", "one and two")]);
        for line in [
            "2 of 3 are reached.",
            "| speed | ≥ 2.00× | 1.00× | **no** |",
            "| time | < 4.00 s | 3.50 s | yes |",
            "| cost | ≤ 2.00× | ≈ 2.00× | yes |",
            "Not measured yet: `threads` (one and two).",
            "| Speed | `cargo xtask bench kernel` | abc | Some 9, 2 cores | 3.00 s |",
            "## Speed\n\nWords.\n\n![plot](performance/plot.svg)\n\nUnder it.",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }
}
