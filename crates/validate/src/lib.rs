//! What `docs/validation.md` says, computed: twinray against closed forms, theory and an independent path tracer.
//!
//! A *case* is a function that builds a scene, solves it and gives rows of expected and measured values. The cases are
//! tests as well, with fewer rays, so nothing in the document is unguarded. Files are written by `main` alone, and the only
//! process is the one that asks for the `commit`.

pub mod analytic;
pub mod case;
pub mod cie;
pub mod commit;
pub mod convergence;
pub mod factors;
pub mod plot;
pub mod quadrature;
pub mod reference;
pub mod report;
pub mod rig;
pub mod shapes;
pub mod variance;

use case::Effort;
use report::Section;

/// A part of the document: its name on the terminal, and what computes it.
pub type Part = (&'static str, fn(Effort) -> Section);

/// The document's parts, in order.
pub const PARTS: [Part; 5] = [
    ("analytic", analytic),
    ("cie", cie),
    ("convergence", convergence::section),
    ("variance", variance::section),
    ("reference", reference::section),
];

fn analytic(effort: Effort) -> Section {
    Section {
        title: "Closed forms and conservation",
        text:
            "Scenes whose light is known. Albedos are rounded to single precision in the solver and in the expectation."
                .into(),
        cases: analytic::cases(effort),
        figures: Vec::new(),
    }
}

fn cie(effort: Effort) -> Section {
    let missing: Vec<String> = cie::NOT_YET.iter().map(|(case, why)| format!("- {case}: {why}.")).collect();
    Section {
        title: "Analytic families of CIE 171:2006",
        text: format!(
            "Validated against the analytic families of CIE 171:2006, *Test Cases to Assess the Accuracy of Lighting Computer \
             Programs*. Each case below is of the named family: its kind of scene with dimensions and sensors of our own, and an \
             expectation derived in the code and held against independent quadrature. The tables of the report are not reproduced, \
             and nothing here is a certificate.\n\nNot covered yet:\n\n{}",
            missing.join("\n")
        ),
        cases: cie::cases(effort),
        figures: Vec::new(),
    }
}
