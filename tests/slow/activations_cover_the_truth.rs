//! The 95 % intervals of activations in space contain activations drawn from their prior, in a tissue that is stiffer or softer than
//! assumed.

use fastrand::Rng;
use nalgebra::Vector3;
use tongue_core::body::Body;
use tongue_core::random::normal;
use tongue_core::statics::{self, SolveSettings, SolveStatus, Workspace};
use tongue_core::system::{SpaceModel, System};
use tongue_infer::inverse::FitSettings;
use tongue_infer::inverse::in_space::SpaceSearch;
use tongue_infer::posterior::Priors;
use tongue_input::measured::{Marked, SpaceMark};

use crate::cases;
use crate::fixtures::space_block::space_block;

const SD_M: f64 = 5e-4;

/// Number of intervals that contain the truth, and number of intervals: of all muscles, and of those with an activation above 0.1.
/// `stiffness_ln` gives the logarithm of the true stiffness over the assumed one, `seen` the marks on a shape.
fn held(
    (body, sides_apart): (&Body<3>, bool),
    seeds: std::ops::Range<u64>,
    stiffness_ln: impl Fn(&mut Rng) -> f64,
    seen: impl Fn(&[Vector3<f64>], &mut dyn FnMut(Vector3<f64>) -> Vector3<f64>) -> Vec<Marked>,
) -> [[usize; 2]; 2] {
    let system = System::in_space(body, &SpaceModel::default()).unwrap();
    let usual = SpaceSearch::default();
    let settings = FitSettings { starts: 2, ..usual.settings };
    let search = SpaceSearch { sides_apart, settings, ..usual };
    let names: Vec<String> = match sides_apart {
        true => body.muscles.iter().map(|m| m.name.clone()).collect(),
        false => body.groups(),
    };
    let mut counts = [[0; 2]; 2];
    for seed in seeds {
        let mut random = Rng::with_seed(seed);
        let (truth, positions) = loop {
            let factor = stiffness_ln(&mut random).exp();
            let drawn: Vec<f64> =
                names.iter().map(|_| (search.prior_sd * normal(&mut random)).abs()).collect();
            let assumed: Vec<f64> = drawn.iter().map(|a| a / factor).collect();
            if drawn.iter().chain(&assumed).any(|a| *a > 1.0) {
                continue;
            }
            let assumed: Vec<(&str, f64)> = names.iter().map(String::as_str).zip(assumed).collect();
            let mut workspace = Workspace::new(&system);
            let activations = body.activations(&assumed).unwrap();
            let solution = statics::solve(&system, &mut workspace, &activations, &SolveSettings::default());
            if solution.status == SolveStatus::Converged {
                break (drawn, workspace.positions().to_vec());
            }
        };
        let mut noisy = |p: Vector3<f64>| p.map(|x| x + SD_M * normal(&mut random));
        let marks = seen(&positions, &mut noisy).into_iter().map(|what| SpaceMark { what, sd_m: SD_M });
        let fit = search.fit(body, &system, &marks.collect::<Vec<_>>(), None).unwrap();
        for (truth, (name, [low, high])) in truth.iter().zip(&fit.interval_95.0) {
            let holds = (*low..=*high).contains(truth);
            eprint!("{}{name} {truth:.2} [{low:.2} {high:.2}] ", if holds { "" } else { "*" });
            for (count, is_counted) in counts.iter_mut().zip([true, *truth > 0.1]) {
                count[0] += usize::from(holds && is_counted);
                count[1] += usize::from(is_counted);
            }
        }
        eprintln!("| {seed}: {:?}, {} of 2 starts", fit.answer.status, fit.ended_here());
    }
    eprintln!("{counts:?}");
    counts
}

/// A logarithm of the stiffness from its prior.
fn stiffness_ln(random: &mut Rng) -> f64 {
    Priors::default().young_modulus.sd_ln * normal(random)
}

fn share([held, all]: [usize; 2]) -> f64 {
    held as f64 / all as f64
}

/// Shares of intervals that contain the truth, from the places of all free nodes of a small body, with sides apart.
fn of_block(seeds: std::ops::Range<u64>, stiffness_ln: impl Fn(&mut Rng) -> f64) -> [f64; 2] {
    let body = space_block(1e-2);
    let free: Vec<usize> = (0..body.mesh.nodes.len()).filter(|n| !body.mesh.fixed.contains(n)).collect();
    let seen = |positions: &[Vector3<f64>], noisy: &mut dyn FnMut(Vector3<f64>) -> Vector3<f64>| {
        free.iter().map(|&node| Marked::Node { node, place: noisy(positions[node]) }).collect()
    };
    held((&body, true), seeds, stiffness_ln, seen).map(share)
}

#[test]
fn intervals_of_activations_hold_what_they_say() {
    let [all, _] = of_block(0..150, stiffness_ln);
    assert!((0.93..=0.97).contains(&all), "{all}");
}

#[test]
fn intervals_of_activations_hold_where_the_tissue_is_half_as_stiff_again() {
    let [_, active] = of_block(1000..1100, |_| 1.5f64.ln());
    assert!((0.9..=0.98).contains(&active), "{active}");
}

/// Half of the tongues are seen by their surface, half by their midsagittal contour.
#[test]
fn intervals_of_activations_of_the_tongue_hold_what_they_say() {
    let body = Body::tongue_in_space(1).unwrap();
    let is_free = |n: &usize| body.mesh.fixed.binary_search(n).is_err();
    let faces: Vec<[usize; 3]> =
        body.mesh.outward_faces().into_iter().filter(|t| t.iter().all(is_free)).step_by(5).collect();
    let mut outline = body.midsagittal_mesh().outlines().remove(0);
    outline.retain(|n| is_free(n) && body.mesh.nodes[*n].z > 0.0);
    let surface = |at: &[Vector3<f64>], noisy: &mut dyn FnMut(Vector3<f64>) -> Vector3<f64>| {
        let middle = |t: &[usize; 3]| t.map(|n| at[n]).iter().sum::<Vector3<f64>>() / 3.0;
        faces.iter().map(|t| Marked::Surface(noisy(middle(t)))).collect()
    };
    let contour = |at: &[Vector3<f64>], noisy: &mut dyn FnMut(Vector3<f64>) -> Vector3<f64>| {
        outline.iter().map(|&n| Marked::Contour(noisy(at[n]).xz())).collect()
    };
    let count = cases(2) as u64;
    let of_surface = held((&body, false), 2000..2000 + count, stiffness_ln, surface);
    let of_contour = held((&body, false), 3000..3000 + count, stiffness_ln, contour);
    // Three binomial standard errors.
    let all = [0, 1].map(|i| of_surface[0][i] + of_contour[0][i]);
    let error = 3.0 * (0.95 * 0.05 / all[1] as f64).sqrt();
    assert!(share(all) > 0.95 - error, "{all:?}");
}
