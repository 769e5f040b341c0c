//! The promise is kept in every hard case of the sample.

use super::{HardCase, run_all};

/// Fails with a list of the rows for which this does not hold.
fn all(rows: &[HardCase], holds: fn(&HardCase) -> bool) {
    let failed: Vec<_> = rows.iter().filter(|r| !holds(r)).map(|r| format!("{r:?}")).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

fn kept(case: u8) -> Vec<HardCase> {
    let rows = run_all(&[case], false).unwrap();
    assert!(!rows.is_empty());
    all(&rows, |r| r.kept);
    rows
}

/// Subsets of muscles converge without inversion. Up to 10 N the barrier never acts, so the answers are those of the law; they are also on
/// the branch from rest.
fn subsets_converge(case: u8) -> Vec<HardCase> {
    let rows = kept(case);
    all(&rows, |r| r.converged && r.min_area_ratio.is_some_and(|a| a > 0.0));
    let is_ordinary = |r: &&HardCase| r.variant.ends_with(" 1 N") || r.variant.ends_with(" 10 N");
    let ordinary: Vec<_> = rows.iter().filter(is_ordinary).collect();
    assert_eq!(2 * ordinary.len(), rows.len());
    assert!(ordinary.iter().all(|r| r.guarded == 0 && r.is_on_branch()), "{ordinary:?}");
    rows
}

#[test]
fn case_1_explicit_steps_of_the_printed_table_are_refused_with_the_limit_named_and_implicit_ones_run() {
    let rows = kept(1);
    let refused: Vec<_> = rows.iter().filter(|r| r.status == "refused").collect();
    assert!(!refused.is_empty() && refused.iter().all(|r| r.note.contains("stability limit")), "{refused:?}");
    let printed = rows.iter().filter(|r| r.variant.contains("2.2e-4 (printed), kappa_s 1.46e3 (printed)"));
    assert_eq!(printed.filter(|r| r.status == "refused").count(), 1);
    assert!(rows.iter().filter(|r| r.solver == "tr-bdf2").all(|r| r.converged));
}

#[test]
fn case_8_steps_up_to_100_s_a_sudden_load_and_many_explicit_steps_leave_no_inverted_or_drifting_body() {
    let rows = kept(8);
    all(&rows, |r| r.converged);
    // For a body out of equilibrium a trapezoidal stage of 100 s would overshoot, so this step alone uses backward Euler.
    let damped: Vec<_> = rows.iter().filter(|r| r.note.contains("by backward Euler")).collect();
    let names: Vec<_> = damped.iter().map(|r| (r.solver, r.variant.as_str())).collect();
    assert_eq!(names, [("tr-bdf2", "20 steps of 1e2 s")]);
    assert!(damped[0].note.contains(", 2 steps by backward Euler"), "{damped:?}");
}

#[test]
fn case_2_subsets_of_muscles_up_to_1000_newtons_converge_to_stable_equilibria_without_inversion() {
    subsets_converge(2);
}

#[test]
fn case_11_subsets_of_muscles_of_a_continuum_up_to_1000_newtons_converge_without_inversion() {
    let rows = subsets_converge(11);
    assert!(rows.iter().filter(|r| r.variant.ends_with(" 1000 N")).all(|r| r.guarded > 0));
}

#[test]
fn case_3_nearly_incompressible_uneven_and_area_less_tissue_converges() {
    let rows = kept(3);
    let refused = rows.iter().filter(|r| r.status == "refused").map(|r| r.variant.as_str());
    assert_eq!(refused.collect::<Vec<_>>(), ["nu = 0", "nu = 0.5"]);
    let converged = |start: &str| rows.iter().filter(|r| r.variant.starts_with(start)).all(|r| r.converged);
    assert!(converged("nu = 0.26") && converged("nu = 0.4") && converged("every second"), "{rows:?}");
    assert!(converged("kappa_s x 1"), "{rows:?}");
    // Without an area term nothing prevents inverted cells; the status says so.
    let without: Vec<_> =
        rows.iter().filter(|r| r.status == "inverted").map(|r| r.variant.as_str()).collect();
    assert_eq!(without, ["nu = 0.25", "kappa_s x 0e0"]);
    // The continuum is stable where the area term of springs is not.
    let continuum: Vec<_> = rows.iter().filter(|r| r.variant.ends_with(", continuum")).collect();
    assert!(continuum.len() == 6 && continuum.iter().all(|r| r.converged), "{continuum:?}");
    let springs = rows.iter().find(|r| r.variant == "nu = 0").unwrap();
    assert!(springs.note.contains("or take a continuum"), "{}", springs.note);
}

#[test]
fn cases_4_6_and_10_keep_the_promise() {
    kept(6);
    [4, 10].map(kept).iter().for_each(|rows| all(rows, |r| r.converged));
}

#[test]
fn case_5_broken_meshes_are_refused_with_what_is_wrong_and_slivers_are_solved() {
    let rows = kept(5);
    let hint = rows.iter().find(|r| r.variant.starts_with("millimetres")).unwrap();
    assert!(hint.note.contains("divide them by 1000"), "{}", hint.note);
    // In triangles a millionth as high as wide, rounding causes forces as large as the load, so the residual has no meaning.
    let flat = rows.iter().find(|r| r.variant == "slivers: height x 1e-6").unwrap();
    assert!(!flat.converged && flat.note.contains("rounding alone makes"), "{flat:?}");
    let boneless = rows.iter().find(|r| r.variant == "no bone").unwrap();
    assert!(boneless.note.contains("is joined to no bone"), "{}", boneless.note);
}

#[test]
fn case_7_searches_that_begin_badly_end_in_a_status() {
    let rows = kept(7);
    // A search in which some solves fail still finds the answer among the others.
    let partly: Vec<_> = rows.iter().filter(|r| r.variant.starts_with("failures in the middle")).collect();
    assert_eq!(partly.len(), 2);
    assert!(
        partly.iter().all(|r| r.converged && r.note.contains("candidates had no equilibrium")),
        "{partly:?}"
    );
    let nothing = rows.iter().find(|r| r.variant.starts_with("every direct solve fails")).unwrap();
    // The simplex has no equilibrium to start from, but small load steps from rest lead to some, from which it finds the answer of the
    // other searches.
    assert!(nothing.note.starts_with("GGa 10.50, SGm 8.01, HGa 3.06 N"), "{nothing:?}");
    assert_eq!(nothing.status, "converged");
}

#[test]
fn case_9_buckling_and_snap_through_are_found_at_their_exact_critical_loads() {
    let rows = kept(9);
    assert!(rows.iter().any(|r| r.note.contains("bifurcation")));
    assert!(rows.iter().any(|r| r.note.contains("limit_point")));
}
