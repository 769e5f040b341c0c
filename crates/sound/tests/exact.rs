//! Formants of tubes with exact solutions, Fant's vowels, and derivatives against differences.

#![allow(clippy::unwrap_used, reason = "a failed test panics")]

use tongue_sound::formants::{formants, rates};
use tongue_sound::{Acoustics, Section};

fn sections(length_m: f64, areas_cm2: &[f64]) -> Vec<Section> {
    areas_cm2.iter().map(|a| Section { length_m, area_m2: a * 1e-4 }).collect()
}

/// A rigid tube without losses whose pressure is zero at the lips.
fn without_losses() -> Acoustics {
    Acoustics { friction: false, wall: false, radiation: false, ..Acoustics::default() }
}

fn frequencies(sections: &[Section], acoustics: &Acoustics, count: usize) -> Vec<f64> {
    formants(sections, acoustics, count).unwrap().iter().map(|f| f.frequency_hz).collect()
}

/// Fant (1960), cm^2 from the lips in steps of 0.5 cm.
const A: [f64; 35] = [
    5.0, 5.0, 5.0, 5.0, 6.5, 8.0, 8.0, 8.0, 8.0, 8.0, 8.0, 8.0, 8.0, 6.5, 5.0, 4.0, 3.2, 1.6, 2.6, 2.6, 2.0,
    1.6, 1.3, 1.0, 0.65, 0.65, 0.65, 1.0, 1.6, 2.6, 4.0, 1.0, 1.3, 1.6, 2.6,
];
const I: [f64; 34] = [
    4.0, 4.0, 3.2, 1.6, 1.3, 1.0, 0.65, 0.65, 0.65, 0.65, 0.65, 0.65, 0.65, 1.3, 2.6, 4.0, 6.5, 8.0, 8.0,
    10.5, 10.5, 10.5, 10.5, 10.5, 10.5, 10.5, 10.5, 10.5, 8.0, 8.0, 2.0, 2.0, 2.6, 3.2,
];

fn fant(from_lips: &[f64]) -> Vec<Section> {
    let mut areas = from_lips.to_vec();
    areas.reverse();
    sections(0.005, &areas)
}

#[test]
fn a_uniform_tube_has_odd_quarter_waves() {
    let found = frequencies(&sections(0.005, &[3.0; 35]), &without_losses(), 6);
    for (k, f) in found.iter().enumerate() {
        let exact = 350.0 / (4.0 * 0.175) * (2 * k + 1) as f64;
        assert!((f / exact - 1.0).abs() < 1e-9, "{f} Hz, exactly {exact}");
    }
}

/// Zeros, Hz, of `A2 cos(k l1) cos(k l2) - A1 sin(k l1) sin(k l2)` (1 at the glottis), by bisection.
fn two_tube(l: [f64; 2], area: [f64; 2], count: usize) -> Vec<f64> {
    let f = |hz: f64| {
        let k = std::f64::consts::TAU * hz / 350.0;
        (k * l[0]).cos() * (k * l[1]).cos() - area[0] / area[1] * (k * l[0]).sin() * (k * l[1]).sin()
    };
    let mut out = Vec::new();
    let mut low = 0.0;
    while out.len() < count {
        let high = low + 1.0;
        if f(low) * f(high) <= 0.0 {
            let (mut a, mut b) = (low, high);
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if f(a) * f(m) <= 0.0 { b = m } else { a = m }
            }
            out.push(a);
        }
        low = high;
    }
    out
}

#[test]
fn two_tubes_have_the_zeros_of_their_equation() {
    for (l, area) in [([0.09, 0.08], [1.0, 7.0]), ([0.08, 0.06], [8.0, 1.0]), ([0.09, 0.085], [0.2, 8.0])] {
        let (n, m) = ((l[0] / 0.005_f64).round() as usize, (l[1] / 0.005_f64).round() as usize);
        let mut tube = sections(l[0] / n as f64, &vec![area[0]; n]);
        tube.extend(sections(l[1] / m as f64, &vec![area[1]; m]));
        for (found, exact) in frequencies(&tube, &without_losses(), 5).iter().zip(two_tube(l, area, 5)) {
            assert!((found / exact - 1.0).abs() < 1e-8, "{found} Hz, exactly {exact}");
        }
    }
}

/// The published values are of two programs with circular cross-sections, no losses and the mass of air at the lips; the second has a
/// yielding wall too.
#[test]
fn fants_vowels_agree_with_determinant_methods() {
    let mut hard = Acoustics { friction: false, wall: false, shape_factor: 1.0, ..Acoustics::default() };
    let cases = [
        (&A[..], false, [619.0, 1041.0, 2419.0]),
        (&I[..], false, [225.0, 2263.0, 2831.0]),
        (&A[..], true, [656.0, 1056.0, 2412.0]),
        (&I[..], true, [272.0, 2256.0, 2840.0]),
    ];
    for (areas, wall, published) in cases {
        hard.wall = wall;
        let found = frequencies(&fant(areas), &hard, 3);
        for (f, p) in found.iter().zip(published) {
            assert!((f / p - 1.0).abs() < 0.01, "{found:?} beside {published:?}");
        }
    }
}

#[test]
fn losses_walls_and_lips_move_formants_as_they_do_in_a_tract() {
    let ideal = formants(&fant(&A), &without_losses(), 4).unwrap();
    let real = formants(&fant(&A), &Acoustics::default(), 4).unwrap();
    assert!(ideal.iter().all(|f| f.bandwidth_hz.abs() < 1e-6));
    assert!(real.iter().all(|f| (20.0..500.0).contains(&f.bandwidth_hz)));
    // The mass of air at the lips lowers the second formant, which the wall hardly raises.
    assert!(real[1].frequency_hz < ideal[1].frequency_hz);
    let hard = Acoustics { wall: false, ..Acoustics::default() };
    assert!(real[0].frequency_hz > formants(&fant(&A), &hard, 1).unwrap()[0].frequency_hz);
}

#[test]
fn rates_are_the_differences() {
    for acoustics in [Acoustics::default(), without_losses()] {
        for tube in [fant(&A), fant(&I)] {
            let found = formants(&tube, &acoustics, 4).unwrap();
            for (k, formant) in found.iter().enumerate() {
                let exact = rates(&tube, &acoustics, formant);
                let of = |k: usize| exact.iter().fold(0.0, |m: f64, rate| m.max(rate[k].abs()));
                let (by_area, by_length) = (of(0), of(1));
                for (i, rate) in exact.iter().enumerate() {
                    let moved = |by: f64, is_area: bool| {
                        let mut tube = tube.clone();
                        let what = if is_area { &mut tube[i].area_m2 } else { &mut tube[i].length_m };
                        *what *= 1.0 + by;
                        formants(&tube, &acoustics, 4).unwrap()[k]
                    };
                    // Central differences of fourth order.
                    let difference = |is_area: bool| {
                        let h = 3e-4;
                        let x = if is_area { tube[i].area_m2 } else { tube[i].length_m };
                        let at = |by: f64| moved(by, is_area).frequency_hz;
                        (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h * x)
                    };
                    assert!(near(rate[0], difference(true), by_area));
                    assert!(near(rate[1], difference(false), by_length));
                }
            }
        }
    }
}

fn near(a: f64, b: f64, scale: f64) -> bool {
    (a - b).abs() <= 1e-7 * scale
}

#[test]
fn a_closed_or_empty_tract_is_refused() {
    let refusal = |tube: &[Section]| formants(tube, &Acoustics::default(), 3).unwrap_err().to_string();
    assert_eq!(refusal(&[]), "the tract has no sections");
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refusal(&sections(0.01, &[2.0, bad, 2.0])).starts_with("section 2 "));
    }
}

#[test]
fn random_tracts_keep_all_their_formants() {
    let mut seed = 7_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..100 {
        let count = 4 + (draw() * 40.0) as usize;
        let areas: Vec<f64> = (0..count).map(|_| 0.05 * 200.0_f64.powf(draw())).collect();
        let tube = sections(0.17 / count as f64, &areas);
        let ideal = formants(&tube, &without_losses(), 4).unwrap();
        assert!(ideal.windows(2).all(|w| w[0].frequency_hz < w[1].frequency_hz));
        // No formant is skipped: up to the fourth formant the level has at most four peaks.
        let level = |hz: f64| tongue_sound::chain::level_db(&tube, &without_losses(), hz);
        let peaks = (1..).map(f64::from).take_while(|hz| *hz <= ideal[3].frequency_hz);
        let peaks: Vec<f64> = peaks.filter(|&hz| level(hz) > level(hz - 1.0).max(level(hz + 1.0))).collect();
        assert!(peaks.len() <= 4, "{peaks:?} {ideal:?}");
        formants(&tube, &Acoustics::default(), 4).unwrap();
    }
}
