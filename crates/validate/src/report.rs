//! The document: sections of cases and figures as Markdown. Text only; `main` writes the files.

use std::fmt::Write;

use crate::case::{Case, FALSE_ALARM, Row};
use crate::rig::REPLICAS;

/// A part of the document.
#[derive(Clone, Debug)]
pub struct Section {
    /// Heading.
    pub title: &'static str,
    /// What holds for all of it.
    pub text: String,
    /// Tables.
    pub cases: Vec<Case>,
    /// Plots, after the tables.
    pub figures: Vec<Figure>,
}

/// A plot and the file it goes to.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the file without its extension.
    pub name: &'static str,
    /// Text under it.
    pub caption: String,
    /// The picture.
    pub svg: String,
}

/// The whole document. `commit` says what it was made from.
pub fn document(sections: &[Section], commit: &str) -> String {
    let rows = || sections.iter().flat_map(|s| &s.cases).flat_map(|c| &c.rows);
    let (total, failed) = (rows().count(), rows().filter(|r| !r.passes()).count());
    let mut out = format!(
        "# Validation\n\n\
         What twinray computes against what is known. This file is written by `cargo xtask validate`; do not edit it.\n\n\
         - Commit: {commit}\n\
         - Verdict: {} of {total} comparisons pass{}\n\n\
         ## How to read the tables\n\n\
         - **Expected** is computed from closed forms, conservation laws or an independent method, never from the solver.\n\
         - **Measured** is the mean of {REPLICAS} independent solves (seeds follow on a fixed first one) unless the case says otherwise, \
           **error** the standard error of that mean from their scatter, in percent of the expected value.\n\
         - A row **passes** if |measured − expected| is within **allowed** = t · error + model. t is the quantile of Student's \
           distribution that a right program exceeds with probability {FALSE_ALARM:e} ({:.2} for {REPLICAS} solves); model is what the solved \
           scene is known beforehand to differ by from the ideal one (facets, patches), as the case states.\n\
         - So that noise cannot hide a fault, **allowed** itself must not exceed the row's **resolution**; a row that resolves \
           too little fails.\n\
         - *Default preset* is what the command does when nothing is said (`Params::default_preset`). *Sensor settings* are the \
           same with a gather share of 0.9, an environment share of 0.05 and no warm start: most rays start at the sensors instead of \
           at the lamp, and the same estimators combine them.\n\
         - **A known deviation** is allowed for: means of closed rooms of albedo ρ may be low by 0.004 %/(1−ρ) with the default preset. \
           All rays are one low-discrepancy sequence, and the state that later rays start from follows the earlier ones, so the two are not \
           independent. What is seen is half of that: 0.004 % at ρ = 0.5, 0.012 % at 0.8. It is not there without a gather share, nor when \
           every wave is scrambled anew, but that makes the RMS error of a patch 15 to 25 % larger, which is far more.\n\
         - Everything but the commit line is the same at every run: seeds are fixed and threads change no bit.\n",
        total - failed,
        if failed == 0 { String::new() } else { format!("; **{failed} FAIL**") },
        crate::quadrature::student_quantile(FALSE_ALARM, REPLICAS as f64 - 1.0),
    );
    sections.iter().for_each(|section| out += &part(section));
    out + PICTURES
}

/// What is compared by eye.
const PICTURES: &str = "
## Pictures beside another renderer's

Three real interiors come with pictures by Tungsten, a path tracer. They stand beside ours in [gallery.md](gallery.md), judged by eye, with \
what differs: the wood of the modern hall is brighter and redder here; in Veach's room behind the door teapots and checkerboard are \
missing from the file; the grey and white room has a little grain here. The files' materials are approximations of the originals, and how \
much of a difference is theirs has not been measured. How far pictures are from those of our own path tracer, which takes the very same \
materials, is: [performance.md](performance.md#pictures).
";

/// One section.
pub fn part(section: &Section) -> String {
    let mut out = format!("\n## {}\n\n{}\n", section.title, section.text);
    section.cases.iter().for_each(|case| table(&mut out, case));
    for figure in &section.figures {
        let _ = write!(out, "\n![{}](validation/{}.svg)\n\n{}\n", figure.name, figure.name, figure.caption);
    }
    out
}

fn table(out: &mut String, case: &Case) {
    let _ = write!(out, "\n### {}\n\n{}\n\n", case.title, case.story);
    let _ = writeln!(
        out,
        "| {} | expected | measured | deviation % | error % | allowed % | resolution % | |\n|---|---|---|---|---|---|---|---|",
        case.quantity
    );
    for row in &case.rows {
        let _ = writeln!(out, "{}", line(row));
    }
}

fn line(row: &Row) -> String {
    let verdict = if row.passes() { "pass" } else { "**FAIL**" };
    let relative = |x: f64| percent(x / row.expected.abs());
    if row.at_most {
        return format!("| {} | ≤ {} | {} | | | | | {verdict} |", row.name, number(row.expected), number(row.measured));
    }
    let resolution = if row.resolution.is_finite() { percent(row.resolution) } else { String::new() };
    let error = if row.error > 0.0 { relative(row.error) } else { String::new() };
    let deviation = row.measured - row.expected;
    format!(
        "| {} | {} | {} | {}{} | {error} | {} | {resolution} | {verdict} |",
        row.name,
        number(row.expected),
        number(row.measured),
        if deviation > 0.0 { "+" } else { "" },
        relative(deviation),
        relative(row.allowed),
    )
}

/// Percent with two significant digits.
fn percent(share: f64) -> String {
    let x = 100.0 * share;
    if x.abs() < 5e-6 {
        return "0".to_owned();
    }
    let magnitude = libm::log10(x.abs()).floor() as i32;
    format!("{x:.*}", (1 - magnitude).clamp(0, 6) as usize)
}

/// Six significant digits.
pub fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = libm::log10(x.abs()).floor() as i32;
    if !(-4..7).contains(&magnitude) {
        return format!("{x:.2e}");
    }
    format!("{x:.*}", (5 - magnitude).max(0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        assert_eq!(
            [0.19982489, 1234.5678, 0.0, 1.0e-9, 12345678.0].map(number),
            ["0.199825", "1234.57", "0", "1.00e-9", "1.23e7"]
        );
    }

    #[test]
    fn a_failing_row_is_seen() {
        let rows = vec![Row::fixed("wrong", 1.0, 2.0, 0.1), Row::fixed("right", 1.0, 1.05, 0.1)];
        let case = Case { title: "T", story: "S".into(), quantity: "Q", rows };
        let section = Section { title: "S", text: String::new(), cases: vec![case], figures: Vec::new() };
        let text = document(&[section], "none");
        assert!(text.contains("1 of 2 comparisons pass; **1 FAIL**"));
        assert!(text.contains("| wrong | 1.00000 | 2.00000 | +100 |") && text.matches("**FAIL**").count() == 1);
    }
}
