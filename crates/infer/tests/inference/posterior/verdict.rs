//! The words of a verdict.

use tongue_infer::posterior::{Certainty, MuscleVerdict, Verdict, VerdictFrom};

fn verdict(muscle: &str, p_rises: f64, mostly_prior: bool) -> MuscleVerdict {
    let (muscle, certainty) = (muscle.to_owned(), Certainty::of(p_rises));
    MuscleVerdict { muscle, p_rises, certainty, tension_n_per_m: [14.2, 68.9], mostly_prior }
}

#[test]
fn three_sentences_name_every_muscle_once_and_say_how_sure_it_is() {
    let from = VerdictFrom::Draws;
    let muscles = vec![
        verdict("GGa", 0.9, false),
        verdict("GGm", 0.3, true),
        verdict("SGm", 0.99, true),
        verdict("HGa", 1.0, true),
        verdict("HGp", 0.11, true),
        verdict("SGa", 0.01, true),
    ];
    let [harder, open, how_hard] = Verdict { from, hyoid_mm: None, muscles }.sentences("ɯ");
    assert_eq!(
        harder,
        "Harder than in /ɯ/, surely: SGm, HGa; probably: GGa. Not harder, surely: SGa; probably: HGp."
    );
    assert_eq!(open, "Not known: GGm.");
    assert_eq!(
        how_hard,
        "How hard: GGa 14 to 69 N/m; SGm 14 to 69, HGa 14 to 69 N/m (more from prior than data)."
    );
    let nobody = Verdict { from, hyoid_mm: None, muscles: vec![verdict("GGa", 0.5, true)] }.sentences("e");
    assert_eq!(nobody[0], "No muscle is known to pull harder than in /e/.");
    assert_eq!(nobody[2], "No muscle is known to pull harder, so no tension is listed.");
}

#[test]
fn words_change_at_the_probabilities_that_are_documented() {
    let words = [0.95, 0.949, 0.8, 0.79, 0.21, 0.2, 0.051, 0.05].map(|p| Certainty::of(p).text());
    assert_eq!(
        words.join("; "),
        "surely harder; probably harder; probably harder; not known; not known; probably not harder; probably not harder; \
         surely not harder"
    );
}
