//! The tract drawn around the reference tongue: areas and refusals.

#![allow(clippy::unwrap_used, reason = "a failed test panics")]

use tongue_sound::Acoustics;
use tongue_sound::formants::formants;
use tongue_sound::profile::{Articulation, Profile, ProfilePoint, Tract};

fn tract() -> Tract {
    let tract: Tract = toml::from_str(include_str!("../../../targets/tract.toml")).unwrap();
    tract.check().unwrap();
    tract
}

/// The reference outline from the root to the tip, m.
fn tongue() -> Vec<ProfilePoint> {
    let x = [47.02, 47.02, 46.73, 46.20, 42.91, 37.62, 28.90, 19.31, 10.40, 1.49, -7.61, -11.33];
    let y = [9.14, 16.13, 24.45, 32.50, 39.43, 45.21, 50.06, 48.73, 45.79, 42.67, 34.92, 30.03];
    x.into_iter().zip(y).map(|(x, y)| [x * 1e-3, y * 1e-3]).collect()
}

fn formants_hz(tongue: &[ProfilePoint], posture: &Articulation) -> Vec<f64> {
    let profile = Profile::new(&tract(), tongue, posture).unwrap();
    formants(&profile.sections, &Acoustics::default(), 4).unwrap().iter().map(|f| f.frequency_hz).collect()
}

#[test]
fn the_tongue_at_rest_has_the_tract_of_a_man() {
    let profile = Profile::new(&tract(), &tongue(), &Articulation::default()).unwrap();
    assert!((0.16..0.185).contains(&profile.length_m()), "{} m", profile.length_m());
    assert!(profile.sections.iter().all(|s| s.length_m <= 5e-3 && (0.2e-4..12e-4).contains(&s.area_m2)));
    // The lines run from the glottis to the teeth.
    assert!(profile.across.windows(2).all(|w| w[0].outer != w[1].outer));
}

#[test]
fn lips_jaw_and_larynx_do_what_is_known_of_them() {
    let rest = formants_hz(&tongue(), &Articulation::default());
    // A narrower and longer opening lowers every formant (Fant 1960), and so does a lower larynx.
    let rounded = with(|p| (p.lip_opening_mm, p.lip_protrusion_mm) = (4.0, 6.0));
    assert!(rest.iter().zip(&rounded).all(|(r, l)| l < r), "{rest:?} {rounded:?}");
    let lowered = with(|p| p.hyoid_mm = [0.0, -16.0]);
    assert!(rest.iter().zip(&lowered).all(|(r, l)| l < r), "{rest:?} {lowered:?}");
}

fn with(change: fn(&mut Articulation)) -> Vec<f64> {
    let mut posture = Articulation::default();
    change(&mut posture);
    formants_hz(&tongue(), &posture)
}

#[test]
fn walls_that_meet_are_refused_with_their_names_and_places() {
    let refused = |tongue: &[ProfilePoint], posture: &Articulation| {
        Profile::new(&tract(), tongue, posture).unwrap_err().to_string()
    };
    // The blade is raised through the palate.
    let mut raised = tongue();
    raised[7][1] += 0.018;
    let message = refused(&raised, &Articulation::default());
    assert!(message.contains("passes through the hard palate at (20.3, 61.3) mm, by 5.3 mm"), "{message}");
    // The root is moved through the back wall of the pharynx.
    let back: Vec<ProfilePoint> = tongue().iter().map(|p| [p[0] + 0.02, p[1]]).collect();
    assert!(refused(&back, &Articulation::default()).contains("there is no airway"));
    // The lower teeth pass through the upper ones.
    let shut = Articulation { jaw_deg: -8.0, ..Articulation::default() };
    assert!(refused(&tongue(), &shut).contains("there is no airway"));
    for (posture, why) in [
        (Articulation { lip_opening_mm: 0.0, ..Articulation::default() }, "are closed"),
        (
            Articulation { lip_opening_mm: 1.0, lip_protrusion_mm: 30.0, ..Articulation::default() },
            "are closed",
        ),
        (Articulation { lip_protrusion_mm: -9.0, ..Articulation::default() }, "no length"),
        (Articulation { jaw_deg: f64::NAN, ..Articulation::default() }, "finite numbers"),
    ] {
        assert!(refused(&tongue(), &posture).contains(why));
    }
    assert!(refused(&tongue()[..1], &Articulation::default()).contains("two finite points"));
}

#[test]
fn a_placed_tract_has_all_of_its_lengths_scaled() {
    let (tract, placed) = (tract(), tract().placed(2.0, |p| p.map(|mm| 2.0 * mm)));
    for (own, wall) in tract.wall.iter().zip(&placed.wall) {
        assert!(own.half_width_mm.is_some() && own.arch_mm.is_some());
        let twice = |mm: [f64; 2]| mm.map(|mm| 2.0 * mm);
        assert_eq!(wall.half_width_mm, own.half_width_mm.map(twice));
        assert_eq!(wall.arch_mm, own.arch_mm.map(twice));
    }
    let lengths = |t: &Tract| [t.grid.step_mm, t.lips.length_mm, t.lips.width_mm];
    assert_eq!(lengths(&placed), lengths(&tract).map(|mm| 2.0 * mm));
}

#[test]
fn a_tract_that_cannot_be_is_refused() {
    assert!(says(|t| t.wall.clear()).contains("wall"));
    assert!(says(|t| t.wall[0].alpha[0] = -1.0).contains("alpha of wall `larynx`"));
    assert!(says(|t| t.wall[1].points_mm.clear()).contains("points_mm"));
    assert!(says(|t| t.grid.step_mm = 0.0).contains("grid.step_mm"));
    assert!(says(|t| t.grid.step_mm = 1e-9).contains("grid.step_mm"));
    assert!(says(|t| t.jaw.floor_mm.clear()).contains("jaw.floor_mm"));
    assert!(says(|t| t.tongue.tip_mm[0] = f64::NAN).contains("tongue.tip_mm"));
}

fn says(change: fn(&mut Tract)) -> String {
    let mut tract = tract();
    change(&mut tract);
    tract.check().unwrap_err().to_string()
}
