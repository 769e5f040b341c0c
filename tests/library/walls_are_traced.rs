//! The walls of the tract are Maeda's, placed by the tongue alone, and the tables of docs/sound.md have the vowels of S2 in it.

use nalgebra::{Rotation2, Vector2};
use tongue_fit::acoustics::{Articulation, MeanVowel, Tract, VocalTract, mean_vowels, nearest_vowel};
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::report::SoundRecord;
use tongue_fit::scene::{self, JOINT_MM, Scene, SceneOutcome};
use tongue_sound::formants::formants;
use tongue_sound::{Acoustics, Section};

/// Means of the tongue and of the walls on 25 lines of a semipolar grid, the edge of the upper incisors and the ends of the glottis, in
/// 1/188.679245 cm (pb1_spec.dat of VTCalcs; S. Maeda, S. Ghosh, Apache License 2.0).
const PER_MM: f64 = 18.867_924_5;
const TONGUE: [f64; 25] = [
    443.99, 450.48, 399.94, 348.60, 351.18, 365.40, 370.29, 356.20, 341.89, 332.12, 326.83, 326.51, 331.63,
    343.18, 361.27, 385.23, 411.83, 435.69, 455.04, 462.74, 453.03, 432.25, 407.36, 384.55, 363.84,
];
const WALL: [f64; 25] = [
    550.20, 604.88, 674.13, 678.78, 665.91, 653.31, 643.22, 633.84, 636.99, 668.83, 703.10, 657.82, 649.92,
    565.19, 529.82, 573.25, 603.02, 621.43, 643.06, 650.14, 630.81, 589.87, 556.13, 541.55, 525.21,
];
const INCISORS: [f64; 2] = [2212.354 - 3000.0, 1999.574 - 1850.0];

/// Points of the grid at these distances, mm: on 14 parallel lines 5 mm apart, 11 lines around the origin and 6 parallel ones, turned by
/// -11.25 degrees.
fn on_grid(along: &[f64; 25]) -> Vec<Vector2<f64>> {
    let step = 11.25_f64.to_radians();
    (6..31)
        .zip(along)
        .map(|(line, &a)| {
            let (angle, shift) = match line {
                0..14 => (-step, -5.0 * f64::from(13 - line)),
                14..25 => (step * f64::from(line - 14), 0.0),
                _ => (step * 10.0, 5.0 * f64::from(line - 24)),
            };
            Rotation2::new(angle) * Vector2::new(a / PER_MM, shift)
        })
        .collect()
}

/// Distance from a polyline.
fn distance(p: Vector2<f64>, line: &[Vector2<f64>]) -> f64 {
    let to = |pair: &[Vector2<f64>]| {
        let way = pair[1] - pair[0];
        let part = ((p - pair[0]).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        (p - pair[0] - part * way).norm()
    };
    line.windows(2).map(to).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_walls_are_those_of_maeda_placed_where_her_mean_tongue_lies_nearest_to_the_reference_tongue() {
    let body = Body::tongue(2e-3).unwrap();
    let tract = VocalTract::reference().unwrap();
    let surface = body.mesh.surface_nodes();
    let mm = |n: usize| body.mesh.nodes[n] * 1e3;
    let nearest = |at: [f64; 2]| {
        let apart = |&n: &usize| (mm(n) - Vector2::from(at)).norm();
        *surface.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap()
    };
    let (root, tip) = (mm(nearest(tract.tongue.root_mm)), mm(nearest(tract.tongue.tip_mm)));
    // The part of the surface above the straight line from root to tip.
    let chord = tip - root;
    let seen: Vec<Vector2<f64>> =
        surface.iter().map(|&n| mm(n)).filter(|p| chord.perp(&(p - root)) <= 1e-9).collect();
    assert!(seen.len() > 30, "{}", seen.len());
    let placed = |[turn, x, y]: [f64; 3], points: &[Vector2<f64>]| -> Vec<Vector2<f64>> {
        points.iter().map(|p| 1.1 * (Rotation2::new(turn) * p) + Vector2::new(x, y)).collect()
    };
    let tongue = on_grid(&TONGUE);
    let cost = |place: [f64; 3]| {
        let line = placed(place, &tongue);
        (seen.iter().map(|p| distance(*p, &line).powi(2)).sum::<f64>() / seen.len() as f64).sqrt()
    };
    // A pattern search that starts without rotation.
    let mut place = [0.0, 25.0, 25.0];
    let mut steps = [0.1, 3.0, 3.0];
    while steps[1] > 1e-3 {
        let mut better = false;
        for (axis, sign) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            let mut moved = place;
            moved[axis] += sign * steps[axis];
            if cost(moved) < cost(place) {
                (place, better) = (moved, true);
            }
        }
        if !better {
            steps = steps.map(|s| 0.5 * s);
        }
    }
    assert!(cost(place) < 1.3, "{} at {place:?}", cost(place));
    let mut wall = on_grid(&WALL);
    wall.push(Vector2::from(INCISORS) / PER_MM);
    let rows: Vec<[f64; 4]> = tract.wall.iter().flat_map(|w| w.points_mm.clone()).collect();
    assert_eq!(rows.len(), 1 + wall.len());
    // The mesh has other points than the outline, but the placement is the same to half a millimetre.
    for (row, ours) in rows[1..].iter().zip(placed(place, &wall)) {
        let off = (Vector2::new(row[0], row[1]) - ours).norm();
        assert!(off < 0.6, "{row:?} and {ours:?}: {off} mm");
    }
    assert_eq!(tract.jaw.joint_mm, JOINT_MM);
    // The palate and the upper teeth that stop a tongue are the same walls.
    for p in body.palate.as_ref().unwrap().iter().skip(4) {
        let own = p * 1e3;
        assert!(rows.iter().any(|r| (Vector2::new(r[0], r[1]) - own).norm() < 1e-9), "{own:?}");
    }
}

fn spoken(vowel: &str) -> SoundRecord {
    in_posture("S2", vowel, |_| ()).sound.unwrap()
}

/// A scene with the sound of a vowel in a changed posture.
fn in_posture(subject: &str, vowel: &str, change: impl Fn(&mut Articulation)) -> SceneOutcome {
    let tract = VocalTract::reference().unwrap();
    let mut posture = tract.posture[vowel];
    change(&mut posture);
    let fit = match vowel {
        "ɯ" => String::new(),
        _ => format!("[fit]\nsubject = \"{subject}\"\nvowel = \"{vowel}\"\ntarget = \"stretch\"\n"),
    };
    let text = format!("title = \"t\"\nwant = \"shape\"\n[body.tongue]\n{fit}");
    let scene = Scene::from_toml(&text, "t.toml").unwrap().spoken(&posture, tract.jaw.joint_mm);
    scene::simulate(&scene).unwrap()
}

#[test]
fn the_jaw_opens_to_fifteen_degrees_and_raises_the_first_formant() {
    let tract = VocalTract::reference().unwrap();
    let first = |jaw_deg: f64| {
        let scene = Scene::from_toml("title = \"t\"\nwant = \"shape\"\n[body.tongue]\n", "t.toml").unwrap();
        let scene = scene.spoken(&Articulation { jaw_deg, ..Articulation::default() }, tract.jaw.joint_mm);
        scene::simulate(&scene).unwrap().sound.unwrap().formants_hz[0]
    };
    let all: Vec<f64> = (0..=4).map(|i| first(3.75 * f64::from(i))).collect();
    assert!(all[1..].iter().all(|f| *f > all[0]), "{all:?}");
    for vowel in ["a", "e", "i", "o", "ɯ"] {
        let found = in_posture("S2", vowel, |posture| posture.jaw_deg = 15.0).sound.unwrap();
        assert!(found.formants_hz.windows(2).all(|f| f[0] < f[1]), "{vowel}: {:?}", found.formants_hz);
    }
}

/// The rows of the document with this beginning.
fn rows(beginning: &str) -> Vec<Vec<String>> {
    include_str!("../../docs/sound.md")
        .lines()
        .filter(|l| l.starts_with(beginning))
        .map(|l| l.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect())
        .collect()
}

#[test]
fn four_of_five_vowels_are_nearest_to_their_own_mean() {
    let means = mean_vowels().unwrap();
    let (mut own, mut near) = (0, 0);
    for MeanVowel { vowel, f1_hz, f2_hz } in &means {
        let f = spoken(vowel).formants_hz;
        let nearest = &nearest_vowel(&means, f[0], f[1]).unwrap().vowel;
        own += usize::from(nearest == vowel);
        near += [f[0] / f1_hz, f[1] / f2_hz].iter().filter(|r| (*r - 1.0).abs() <= 0.2).count();
        let cells = [
            format!("/{vowel}/"),
            format!("{:.0}", f[0]),
            format!("{f1_hz}"),
            format!("{:+.0} %", 100.0 * (f[0] / f1_hz - 1.0)),
            format!("{:.0}", f[1]),
            format!("{f2_hz}"),
            format!("{:+.0} %", 100.0 * (f[1] / f2_hz - 1.0)),
            format!("/{nearest}/"),
        ];
        assert_eq!(rows(&format!("| /{vowel}/ | ")), [cells.to_vec()]);
    }
    assert!(own >= 4 && near >= 8, "{own} of 5 vowels, {near} of 10 formants");
    // The /ɯ/ of S1 and S3 is the same tongue at rest, which is left out.
    for (subject, vowel) in ["S1", "S3"].iter().flat_map(|s| ["e", "a", "o"].map(|v| (*s, v))) {
        let f = in_posture(subject, vowel, |_| ()).sound.unwrap().formants_hz;
        assert_eq!(nearest_vowel(&means, f[0], f[1]).unwrap().vowel, vowel, "{subject}: {f:?}");
    }
}

#[test]
fn estimates_of_walls_jaw_and_lips_change_the_formants_compare() {
    let (body, drawn) = (Body::tongue(5.5e-3).unwrap(), VocalTract::reference().unwrap());
    let vowels = ["i", "e", "a", "o", "ɯ"].map(|vowel| {
        let positions = in_posture("S2", vowel, |_| ()).positions_m;
        (positions.iter().map(|p| Point::new(p[0], p[1])).collect::<Vec<_>>(), drawn.posture[vowel])
    });
    let heard = |tract: &Tract, change: &dyn Fn(&mut Articulation), larger: f64| {
        let airway = VocalTract::round(&body, tract.clone()).unwrap();
        vowels.each_ref().map(|(positions, posture)| -> Vec<f64> {
            let mut posture = *posture;
            change(&mut posture);
            let mut sections = airway.sound(positions, &posture).unwrap().profile.sections;
            sections.iter_mut().for_each(|s| s.area_m2 *= larger);
            formants(&sections, &Acoustics::default(), 2).unwrap().iter().map(|f| f.frequency_hz).collect()
        })
    };
    let usual = heard(&drawn, &|_| (), 1.0);
    let (mut found_rows, mut documented_rows) = (Vec::new(), Vec::new());
    let mut compare = |what: &str, found: [Vec<f64>; 5]| {
        let most = |k: usize| {
            let parts = found.iter().zip(&usual).map(|(a, b)| (a[k] / b[k] - 1.0).abs());
            format!("{:.0} %", 100.0 * parts.fold(0.0, f64::max))
        };
        found_rows.push(vec![what.to_owned(), most(0), most(1)]);
        documented_rows.extend(rows(&format!("| {what} | ")));
    };
    compare("all areas 20 % larger", heard(&drawn, &|_| (), 1.2));
    for (what, walls, by) in [
        ("back wall and velum 2 mm further back", 1..3, [2.0, 0.0]),
        ("velum, palate and upper teeth 2 mm higher", 2..5, [0.0, 2.0]),
    ] {
        let mut tract = drawn.clone();
        for point in tract.wall[walls].iter_mut().flat_map(|wall| &mut wall.points_mm) {
            (point[0], point[1]) = (point[0] + by[0], point[1] + by[1]);
        }
        compare(what, heard(&tract, &|_| (), 1.0));
    }
    type Change = fn(&mut Articulation);
    let of_posture: [(&str, Change); 4] = [
        ("lower teeth 1 degree lower, same tongue", |posture| posture.jaw_deg += 1.0),
        ("lips 2 mm wider open", |posture| posture.lip_opening_mm += 2.0),
        ("lips 2 mm further out", |posture| posture.lip_protrusion_mm += 2.0),
        // The larynx follows half of the hyoid's displacement.
        ("larynx 5 mm lower", |posture| posture.hyoid_mm[1] -= 10.0),
    ];
    for (what, change) in of_posture {
        compare(what, heard(&drawn, &change, 1.0));
    }
    assert_eq!(documented_rows, found_rows);
}

/// Areas from the glottis to the lips, cm^2, and the length of each section, cm: Fant (1960), printed in the order from the lips; Story,
/// Titze and Hoffman (1996).
const FANT_A: &str =
    "5 5 5 5 6.5 8 8 8 8 8 8 8 8 6.5 5 4 3.2 1.6 2.6 2.6 2 1.6 1.3 1 .65 .65 .65 1 1.6 2.6 4 1 1.3 1.6 2.6";
const FANT_I: &str = "4 4 3.2 1.6 1.3 1 .65 .65 .65 .65 .65 .65 .65 1.3 2.6 4 6.5 8 8 10.5 10.5 10.5 10.5 10.5 10.5 10.5 10.5 10.5 8 8 2 2 2.6 3.2";
const STORY_A: &str = ".45 .2 .26 .21 .32 .3 .33 1.05 1.12 .85 .63 .39 .26 .28 .23 .32 .29 .28 .4 .66 1.2 1.05 1.62 2.09 2.56 2.78 2.86 3.02 3.75 4.6 5.09 6.02 6.55 6.29 6.27 5.94 5.28 4.7 3.87 4.13 4.25 4.27 4.69 5.03";
const STORY_I: &str = ".33 .3 .36 .34 .68 .5 2.43 3.15 2.66 2.49 3.39 3.8 3.78 4.35 4.5 4.43 4.68 4.52 4.15 4.09 3.51 2.95 2.03 1.66 1.38 1.05 .6 .35 .32 .12 .1 .16 .25 .24 .38 .28 .36 .65 1.58 2.05 2.01 1.58";

/// Mean areas of the four quarters of a tract, cm^2, and its first two formants, Hz.
fn row_of(name: &str, sections: &[Section]) -> Vec<String> {
    let length: f64 = sections.iter().map(|s| s.length_m).sum();
    let mut quarters = [0.0; 4];
    let mut at = 0.0;
    for s in sections {
        for (k, sum) in quarters.iter_mut().enumerate() {
            let (low, high) = (length * k as f64 / 4.0, length * (k + 1) as f64 / 4.0);
            *sum += s.area_m2 * 1e4 * ((at + s.length_m).min(high) - at.max(low)).max(0.0) * 4.0 / length;
        }
        at += s.length_m;
    }
    let f = formants(sections, &Acoustics::default(), 2).unwrap();
    let cells =
        quarters.iter().map(|a| format!("{a:.1}")).chain(f.iter().map(|f| format!("{:.0}", f.frequency_hz)));
    [name.to_owned(), format!("{:.1}", 100.0 * length)].into_iter().chain(cells).collect()
}

#[test]
fn areas_are_told_beside_those_of_fant_and_of_story() {
    let read = |text: &str, cm: f64, from_lips: bool| -> Vec<Section> {
        let mut areas: Vec<f64> = text.split(' ').map(|a| a.parse().unwrap()).collect();
        if from_lips {
            areas.reverse();
        }
        areas.iter().map(|a| Section { length_m: cm * 1e-2, area_m2: a * 1e-4 }).collect()
    };
    let ours = |vowel: &str| -> Vec<Section> {
        let sound = spoken(vowel);
        sound
            .area_function
            .iter()
            .map(|r| Section { length_m: r.length_mm * 1e-3, area_m2: r.area_cm2 * 1e-4 })
            .collect()
    };
    let mut all = Vec::new();
    for (vowel, fant, story) in [("a", FANT_A, STORY_A), ("i", FANT_I, STORY_I)] {
        all.push(row_of(&format!("/{vowel}/, S2 here"), &ours(vowel)));
        all.push(row_of(&format!("/{vowel}/, Fant"), &read(fant, 0.5, true)));
        all.push(row_of(&format!("/{vowel}/, Story"), &read(story, 0.397, false)));
    }
    for row in all {
        assert_eq!(rows(&format!("| {} | ", row[0])), [row]);
    }
}
