//! Activations of bodies in space are found from positions of their nodes.

use std::path::Path;

use nalgebra::Vector3;
use tongue_fit::body::{Body, artisynth};
use tongue_fit::inverse::{FitSettings, FitStatus, SpaceSearch};
use tongue_fit::system::{MusclesAs, SpaceModel, System};
use tongue_input::measured::SpaceMark;

use crate::fixtures::solved;
use crate::fixtures::space_block::space_block;
use crate::tongue_in_space::{RECORDED, folder, recording};

/// Positions of nodes at given activations, with a standard deviation of 0.5 mm.
fn marks(body: &Body<3>, system: &System<3>, given: &[(&str, f64)], nodes: &[usize]) -> Vec<SpaceMark> {
    let w = solved(system, &body.activations(given).unwrap());
    nodes.iter().map(|&node| SpaceMark::node(node, w.positions()[node], 5e-4)).collect()
}

#[test]
fn activations_come_back_from_the_surface_that_they_made() {
    let body = space_block(1e-2);
    let system = System::in_space(&body, &SpaceModel::default()).unwrap();
    let free: Vec<usize> = (0..body.mesh.nodes.len()).filter(|n| !body.mesh.fixed.contains(n)).collect();
    let truth = [("A_L", 0.12), ("A_R", 0.03), ("M", 0.07)];
    let target = marks(&body, &system, &truth, &free);
    let search = SpaceSearch { sides_apart: true, prior_sd: 100.0, ..SpaceSearch::default() };
    let fit = search.fit(&body, &system, &target, None).unwrap();
    for (found, (name, truth)) in fit.answer.tensions.iter().zip(truth) {
        assert!((found - truth).abs() < 1e-3, "{name} {found}");
    }
    assert_eq!(fit.answer.status, FitStatus::Converged);
    assert_eq!(fit.starts.len(), 4);
    assert!(fit.others_as_good().next().is_none());

    // If the sides are alike, A has one unknown, which its two muscles share.
    let target = marks(&body, &system, &[("A", 0.1), ("M", 0.05)], &free);
    let search = SpaceSearch { sides_apart: false, ..search };
    let fit = search.fit(&body, &system, &target, None).unwrap();
    assert_eq!(fit.activations.0.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["A", "M"]);
    assert_eq!(fit.answer.tensions[0], fit.answer.tensions[1]);
    assert!((fit.answer.tensions[0] - 0.1).abs() < 1e-3 && (fit.answer.tensions[2] - 0.05).abs() < 1e-3);

    // From the last answer the search takes one start and fewer factorisations.
    let next = search.fit(&body, &system, &target, Some(&fit.answer)).unwrap();
    assert_eq!(next.starts.len(), 1);
    assert!(next.factorisations < fit.factorisations / 2, "{} {}", next.factorisations, fit.factorisations);
}

#[test]
fn what_the_middle_cannot_know_is_open() {
    let body = space_block(1e-2);
    let system = System::in_space(&body, &SpaceModel::default()).unwrap();
    let middle = |n: &usize| body.mesh.nodes[*n].y.abs() < 1e-9 && !body.mesh.fixed.contains(n);
    let middle: Vec<usize> = (0..body.mesh.nodes.len()).filter(middle).collect();
    // Only x and z of the middle are given, because y would tell one side from the other.
    let target = marks(&body, &system, &[("A", 0.1)], &middle);
    let search = SpaceSearch { sides_apart: true, ..SpaceSearch::default() };
    let fit = search.fit(&body, &system, &target, None).unwrap();
    assert_eq!(fit.combinations.len(), 3);
    assert!(fit.combinations.is_sorted_by(|a, b| a.sd <= b.sd));
    let length = |of: &[(String, f64)]| of.iter().map(|(_, d)| d * d).sum::<f64>();
    assert!(fit.combinations.iter().all(|c| (length(&c.direction.0) - 1.0).abs() < 1e-9));
}

/// Positions of the recorded nodes at half the time of a file of ArtiSynth, with a standard deviation of 0.5 mm.
fn at_the_turning_point(file: &Path) -> Vec<SpaceMark> {
    let rows = recording(file);
    let row = &rows[rows.len() / 2].1;
    let place = |i: usize| Vector3::from_column_slice(&row[3 * i..3 * i + 3]);
    RECORDED.iter().enumerate().map(|(i, &node)| SpaceMark::node(node, place(i), 5e-4)).collect()
}

#[test]
fn artisynths_target_is_met_as_well_as_by_artisynth() {
    let Some(folder) = folder() else { return };
    let body = artisynth::read(&folder).unwrap();
    // The target has the tip 10 mm to the front, and the sides at rest.
    let target = at_the_turning_point(&folder.join("protrude_ref_target_position.txt"));
    let usual = SpaceSearch::default();
    let search = SpaceSearch { settings: FitSettings { starts: 3, ..usual.settings }, ..usual };
    let system = System::in_space(&body, &SpaceModel::default()).unwrap();
    let fit = search.fit(&body, &system, &target, None).unwrap();
    // One half of the body gives the same answer.
    let half = body.half().unwrap();
    let left = System::of_half(&half, &SpaceModel::default()).unwrap();
    let alike = search.fit_alike((&body, &system), (&half, &left), &target, None).unwrap();
    assert!((alike.rms_m - fit.rms_m).abs() < 1e-5, "{} {}", alike.rms_m, fit.rms_m);
    assert!(alike.answer.tensions.iter().zip(&fit.answer.tensions).all(|(a, b)| (a - b).abs() < 1e-2));
    // ArtiSynth's own answer leaves 3.38 mm.
    assert!((fit.rms_m - 2.05e-3).abs() < 5e-6, "{}", fit.rms_m);
    assert!(fit.starts.iter().all(|s| (s.misfit / fit.answer.misfit - 1.0).abs() < 0.05), "from every start");
    assert!(fit.open().next().is_some(), "MH and GH are told to be open");

    // The target is the tip alone, 8.5 mm to the front.
    let by = Vector3::new(-8.5e-3, 0.0, 0.0);
    let of_tip = |&node: &usize| SpaceMark::node(node, body.mesh.nodes[node] + by, 5e-4);
    let tip: Vec<SpaceMark> = RECORDED[..14].iter().map(of_tip).collect();
    let search = SpaceSearch { settings: FitSettings { starts: 1, ..search.settings }, ..search };
    let fit = search.fit(&body, &system, &tip, None).unwrap();
    assert!((fit.rms_m - 4.6e-4).abs() < 5e-6, "{}", fit.rms_m);
}

#[test]
fn a_start_amid_strong_muscles_finds_those_of_a_recorded_protrusion() {
    let Some(folder) = folder() else { return };
    let body = artisynth::read(&folder).unwrap();
    let half = body.half().unwrap();
    let model = SpaceModel { muscles: MusclesAs::Lines, stiffening: 9.0, ..SpaceModel::default() };
    let (system, left) = (System::in_space(&body, &model).unwrap(), System::of_half(&half, &model).unwrap());
    let marks = at_the_turning_point(&folder.join("protrude_model_target_position.txt"));
    let usual = SpaceSearch::default();
    let search = SpaceSearch { settings: FitSettings { starts: 2, ..usual.settings }, ..usual };
    let fit = search.fit_alike((&body, &system), (&half, &left), &marks, None).unwrap();
    // A search from rest alone would end at 0.35 mm, with VERT at 0.
    assert!((fit.rms_m - 1.4e-4).abs() < 5e-6 && fit.ended_here() == 1, "{} {}", fit.rms_m, fit.ended_here());
    // ArtiSynth's excitations at that time.
    let truth = [("GGM", 1.0), ("MH", 1.0), ("HG", 0.028), ("VERT", 0.788), ("TRANS", 1.0), ("SL", 0.024)];
    for (name, [low, high]) in &fit.interval_95.0 {
        let truth = truth.iter().find(|(known, _)| known == name).map_or(0.0, |(_, a)| *a);
        assert!((*low..=*high).contains(&truth), "{name} {truth} {low} {high}");
    }
}
