//! The document's comparisons with fewer rays: what `docs/validation.md` claims, the tests ask.
//!
//! Sixteen times fewer rays, four times coarser resolutions, fewer albedos; the rule is the document's. With some 120 rows and a
//! false-alarm rate of 1e-5 a row, a right program fails by chance once in 800 choices of seeds; seeds are fixed.

use twinray_validate::case::{Case, Effort};
use twinray_validate::{analytic, cie, convergence};

fn check(cases: &[Case]) {
    let faults: Vec<String> = cases.iter().flat_map(Case::faults).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // The check sees something.
    assert!(cases.iter().all(|c| !c.rows.is_empty()));
}

#[test]
fn closed_forms_hold() {
    check(&analytic::cases(Effort::TEST));
}

#[test]
fn families_of_cie_171_hold() {
    check(&cie::cases(Effort::TEST));
}

#[test]
fn the_average_loses_what_theory_says() {
    check(&[convergence::loss(Effort::TEST).0]);
}
