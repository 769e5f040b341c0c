//! The cases of `tongue-fit stability`, in the sample that takes seconds: in each the promise is kept.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot begin has failed")]

use tongue_fit::stability::{Extent, Row, run};

/// Runs a case and names every row in which the promise was broken.
fn kept(case: u8) -> Vec<Row> {
    let rows = run(case, Extent::Sample).unwrap();
    assert!(!rows.is_empty());
    let broken: Vec<_> = rows.iter().filter(|r| !r.kept).map(|r| format!("{r:?}")).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    rows
}

fn all_converge(rows: &[Row]) {
    let failed: Vec<_> = rows.iter().filter(|r| !r.converged).map(|r| format!("{r:?}")).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn case_1_explicit_steps_of_the_printed_table_are_refused_with_the_limit_named_and_implicit_ones_run() {
    let rows = kept(1);
    let refused: Vec<_> = rows.iter().filter(|r| r.status == "refused").collect();
    assert!(!refused.is_empty() && refused.iter().all(|r| r.note.contains("stability limit")), "{refused:?}");
    let printed = |r: &&Row| r.variant.contains("2.2e-4 (printed), kappa_s 1.46e3 (printed)");
    assert_eq!(rows.iter().filter(printed).filter(|r| r.status == "refused").count(), 3);
    assert!(rows.iter().filter(|r| ["backward-euler", "tr-bdf2"].contains(&r.solver)).all(|r| r.converged));
}

#[test]
fn case_8_steps_up_to_100_s_a_sudden_load_and_many_explicit_steps_leave_no_inverted_or_drifting_body() {
    let rows = kept(8);
    // A trapezoidal stage of 100 s throws a body that starts out of balance; it says so instead of running.
    let too_long = |r: &&Row| r.solver == "tr-bdf2" && r.variant == "20 steps of 1e2 s";
    let others: Vec<Row> = rows.iter().filter(|r| !too_long(r)).cloned().collect();
    assert_eq!(others.len() + 1, rows.len());
    all_converge(&others);
}

#[test]
fn case_2_subsets_of_muscles_up_to_1000_newtons_converge_to_stable_equilibria_without_inversion() {
    let rows = kept(2);
    all_converge(&rows);
    assert!(rows.iter().all(|r| r.min_area_ratio.is_some_and(|a| a > 0.0)));
    // Up to 10 N the barrier is never touched: there the answers are those of the published law.
    let ordinary = |r: &&Row| r.variant.ends_with(" 1 N") || r.variant.ends_with(" 10 N");
    assert!(rows.iter().filter(ordinary).all(|r| r.guarded == 0));
}

#[test]
fn case_3_nearly_incompressible_uneven_and_area_less_tissue_converges() {
    let rows = kept(3);
    let refused = rows.iter().filter(|r| r.status == "refused").map(|r| r.variant.as_str());
    assert_eq!(refused.collect::<Vec<_>>(), ["nu = 0", "nu = 0.5"]);
    let converged = |start: &str| rows.iter().filter(|r| r.variant.starts_with(start)).all(|r| r.converged);
    assert!(converged("nu = 0.26") && converged("nu = 0.4") && converged("every second"), "{rows:?}");
}

#[test]
fn case_4_folding_chains_end_in_a_stable_or_neutral_equilibrium_either_way_of_modelling() {
    all_converge(&kept(4));
}

#[test]
fn case_5_broken_meshes_are_refused_with_what_is_wrong_and_slivers_are_solved() {
    let rows = kept(5);
    let hint = rows.iter().find(|r| r.variant.starts_with("millimetres")).unwrap();
    assert!(hint.note.contains("divide them by 1000"), "{}", hint.note);
    let boneless = rows.iter().find(|r| r.variant == "no bone").unwrap();
    assert!(boneless.note.contains("hangs on no bone"), "{}", boneless.note);
}

#[test]
fn case_6_targets_that_cannot_be_met_are_not_called_met() {
    kept(6);
}

#[test]
fn case_7_searches_that_begin_badly_end_in_a_status() {
    kept(7);
}

#[test]
fn case_9_buckling_and_snap_through_are_found_at_their_exact_critical_loads() {
    let rows = kept(9);
    assert!(rows.iter().any(|r| r.note.contains("bifurcation")));
    assert!(rows.iter().any(|r| r.note.contains("limit_point")));
}

#[test]
fn case_10_threads_numbering_and_position_do_not_change_the_answer() {
    all_converge(&kept(10));
}
