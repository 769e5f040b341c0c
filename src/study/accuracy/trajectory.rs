//! Axis 2: the way there, to t = 3 s, where the thesis stops.

use nalgebra::SVector;

use crate::dynamics::{Control, Method, Motion, Tensions};

use super::StudyError;
use super::equilibrium::in_words;
use super::ladder::{Effort, Ended, Run};
use super::march::{Marched, march};
use super::scene::Scene;

/// Times at which trajectories are compared, s; the last is their end.
const TIMES: [f64; 7] = [0.03, 0.1, 0.3, 0.6, 1.0, 2.0, 3.0];
/// Steps of backward Euler, s.
const IMPLICIT_STEPS: [f64; 6] = [0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4];
/// Tolerances of the adaptive methods, m.
const STEP_TOLERANCES: [f64; 6] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];
/// Tolerances of the reference and of the one that it is checked against, m. The error along the way goes with the power 2/3 of
/// the tolerance of a step, so the reference is a hundred times better than the tightest rung.
const REFERENCE: [f64; 2] = [1e-12, 1e-11];
/// Parts of the stability limit that explicit methods step with; two is refused.
const PARTS: [f64; 3] = [2.0, 0.99, 0.05];

/// The ladder of every method, and how far the reference is from one of ten times its tolerance, mm.
///
/// # Errors
/// [`StudyError`] where there is no reference.
pub fn ladder(scene: &Scene, effort: &Effort) -> Result<(Vec<Run>, f64), StudyError> {
    let motion = Motion::new(&scene.system, Tensions::Constant(scene.tensions.clone()))?;
    let once = Effort { repeats: 1, longest_run_s: f64::INFINITY, ..*effort };
    let [reference, check] =
        REFERENCE.map(|t| march(&motion, Method::TrBdf2, Control::Adaptive(t), &TIMES, &once));
    if let Some((_, why)) = reference.missing.or(check.missing) {
        return Err(StudyError::Trajectory(why));
    }
    let reference: Vec<_> = reference.stops.into_iter().map(|s| s.positions).collect();
    let doubt = along(scene, check.stops.iter().map(|s| &s.positions), &reference).0;
    let mut runs = Vec::new();
    for method in Method::ALL {
        let limit = method.step_limit(&motion);
        let controls: Vec<Control> = match limit {
            _ if method.is_adaptive() => STEP_TOLERANCES.map(Control::Adaptive).to_vec(),
            Some(limit) => PARTS.map(|p| Control::Fixed(p * limit)).to_vec(),
            None => IMPLICIT_STEPS.map(Control::Fixed).to_vec(),
        };
        for control in controls {
            let marched = march(&motion, method, control, &TIMES, effort);
            runs.push(row(scene, method, control, marched, &reference));
        }
    }
    Ok((runs, doubt))
}

fn row(
    scene: &Scene,
    method: Method,
    control: Control,
    marched: Marched,
    reference: &[Vec<SVector<f64, 2>>],
) -> Run {
    let empty = Run::refused(method.name(), in_words(control), String::new());
    match (marched.missing, marched.stops.last()) {
        (None, Some(last)) => {
            let (error, ratio) = along(scene, marched.stops.iter().map(|s| &s.positions), reference);
            Run {
                error_mm: Some(error),
                ratio_error: Some(ratio),
                seconds: Some(last.seconds),
                repeats: marched.repeats,
                steps: last.counts.steps,
                force_evaluations: last.counts.force_evaluations,
                factorisations: last.counts.factorisations,
                ended: Ended::Done,
                ..empty
            }
        }
        (Some((false, why)), _) => Run { ended: Ended::Failed(why), ..empty },
        (Some((true, why)), _) => Run { ended: Ended::Refused(why), ..empty },
        (None, None) => Run { ended: Ended::Failed("no state".into()), ..empty },
    }
}

/// Largest errors over all times: of a node's position, mm, and of a ratio.
fn along<'a>(
    scene: &Scene,
    shapes: impl Iterator<Item = &'a Vec<SVector<f64, 2>>>,
    reference: &[Vec<SVector<f64, 2>>],
) -> (f64, f64) {
    shapes.zip(reference).fold((0.0, 0.0), |(e, r): (f64, f64), (shape, expected)| {
        (e.max(scene.distance_mm(shape, expected)), r.max(scene.ratio_difference(shape, expected)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::PUBLISHED_A;
    use crate::study::accuracy::ladder::observed_order;
    use crate::study::accuracy::scene;
    use crate::system::Model;

    #[test]
    fn on_a_coarse_tongue_the_ladder_shows_the_known_orders_and_lists_what_was_refused() {
        let scene = Scene::new(&scene::mesh(11e-3).unwrap(), &Model::default(), &PUBLISHED_A).unwrap();
        let (runs, doubt) = ladder(&scene, &Effort::TINY).unwrap();
        let errors = |method: &str| -> Vec<f64> {
            runs.iter().filter(|r| r.method == method).filter_map(|r| r.error_mm).collect()
        };
        let euler: Vec<(f64, f64)> = IMPLICIT_STEPS.into_iter().zip(errors("backward-euler")).collect();
        let order = observed_order(&euler[2..5]).unwrap();
        assert!((order - 1.0).abs() < 0.1, "backward Euler: order {order}");
        let adaptive = errors("tr-bdf2");
        let order =
            observed_order(&STEP_TOLERANCES.into_iter().zip(adaptive.clone()).collect::<Vec<_>>()).unwrap();
        assert!((order - 2.0 / 3.0).abs() < 0.1, "TR-BDF2: power {order} of the tolerance");
        // The error of the looser of the two references is nearly all of their difference, and 10^(2/3) times the other's.
        assert!(
            doubt / 4.6 * 50.0 < adaptive[adaptive.len() - 1],
            "the reference is not tight enough: {doubt}"
        );
        let verlet: Vec<_> = runs.iter().filter(|r| r.method == "verlet").collect();
        assert_eq!(verlet.len(), PARTS.len(), "refused runs are rows too");
        let words = verlet[0].ended.words();
        assert!(words.starts_with("refused: ") && words.contains("stability limit"), "{words}");
    }
}
