//! A vocal tract as a chain of cylinders: their ABCD matrices, the transfer function from the flow at the glottis to that at the lips, and
//! the characteristic function whose zeros are its poles.
//!
//! A section of length l and area A maps pressure and volume velocity at its lip side to those at its glottis side:
//! `[p, U]' = [[c, a S], [b S, c]] [p, U]`, with series impedance `a` and shunt admittance `b` of the whole section, `c = cosh sqrt(ab)`
//! and `S = sinh sqrt(ab) / sqrt(ab)`, which are analytic in `ab`. With a closed glottis the flow at the lips for a unit of flow at the
//! glottis is `1 / E(s)`, `E = C Z + D` with the radiation impedance `Z`.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

// Moist air at body temperature (Flanagan 1972, table 3.1 and section 3.2).
/// Speed of sound, m/s.
const SPEED: f64 = 350.0;
/// Density, kg/m^3.
const DENSITY: f64 = 1.14;
/// Viscosity, Pa s.
const VISCOSITY: f64 = 1.86e-5;
/// Conductivity of heat, W/(m K).
const CONDUCTION: f64 = 0.0230;
/// Specific heat at constant pressure, J/(kg K).
const SPECIFIC_HEAT: f64 = 1005.0;
/// Ratio of specific heats.
const ADIABATIC: f64 = 1.4;

// Mass, kg/m^2, resistance, kg/(m^2 s), and stiffness, N/m^3, of the soft wall per area, in series (Maeda 1982: 1.5 g/cm^2,
// 1600 g/(s cm^2), 3.0e5 dyn/cm^3).
const WALL_MASS: f64 = 15.0;
const WALL_RESISTANCE: f64 = 16_000.0;
const WALL_STIFFNESS: f64 = 3.0e6;

/// Effects that the acoustic model includes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acoustics {
    /// Whether air loses energy to the wall by viscosity and heat.
    pub friction: bool,
    /// Whether the wall yields.
    pub wall: bool,
    /// Whether the lips radiate as a piston in a plane baffle (Flanagan 1972, 3.33); otherwise the pressure at the lips is zero.
    pub radiation: bool,
    /// Circumference of a cross-section over that of a circle of the same area: cross-sections of a tract are not circles.
    pub shape_factor: f64,
}

impl Default for Acoustics {
    fn default() -> Self {
        Self { friction: true, wall: true, radiation: true, shape_factor: 1.3 }
    }
}

/// `cosh sqrt(q)`, `sinh sqrt(q) / sqrt(q)` and the derivative of the latter by `q`.
fn cosh_and_sinhc(q: Complex64) -> (Complex64, Complex64, Complex64) {
    if q.norm() < 1e-2 {
        // The sum of powers of `q`, each over a number.
        let series =
            |over: [f64; 6]| over.iter().rev().fold(Complex64::new(0.0, 0.0), |sum, n| sum * q + 1.0 / n);
        return (
            series([1.0, 2.0, 24.0, 720.0, 40_320.0, 3_628_800.0]),
            series([1.0, 6.0, 120.0, 5_040.0, 362_880.0, 39_916_800.0]),
            series([6.0, 60.0, 1_680.0, 90_720.0, 7_983_360.0, 1_037_836_800.0]),
        );
    }
    let root = q.sqrt();
    let grown = root.exp();
    let shrunk = grown.inv();
    let c = (grown + shrunk) * 0.5;
    let s = (grown - shrunk) * 0.5 / root;
    (c, s, (c - s) / (q * 2.0))
}

/// A value with its derivatives by the complex frequency, the area and the length.
#[derive(Debug, Clone, Copy)]
struct WithDerivatives {
    value: Complex64,
    by_s: Complex64,
    by_area: Complex64,
    by_length: Complex64,
}

/// Series impedance and shunt admittance of a section. `share`, 0 to 1, multiplies all losses and the admittance of the wall.
fn immittance(section: &Section, s: Complex64, acoustics: &Acoustics, share: f64) -> [WithDerivatives; 2] {
    let Section { length_m: l, area_m2: area } = *section;
    // Circumference, to which the losses in the boundary layer and the admittance of the wall are proportional.
    let perimeter = acoustics.shape_factor * 2.0 * (PI * area).sqrt();
    let diffusivities = [VISCOSITY / DENSITY, CONDUCTION / (SPECIFIC_HEAT * DENSITY)];
    let [viscous, thermal] = diffusivities.map(|diffusivity| {
        let kept = if acoustics.friction { share * perimeter / area } else { 0.0 };
        (Complex64::new(diffusivity, 0.0) / s).sqrt() * kept
    });
    let thermal = thermal * (ADIABATIC - 1.0);
    let mass = l * DENSITY / area;
    let a = WithDerivatives {
        value: s * mass * (viscous + 1.0),
        by_s: (viscous * 0.5 + 1.0) * mass,
        by_area: -s * mass / area * (viscous * 1.5 + 1.0),
        by_length: s * (DENSITY / area) * (viscous + 1.0),
    };
    let spring = area / (DENSITY * SPEED * SPEED);
    let [mut give, mut give_by_s] = [Complex64::default(); 2];
    if acoustics.wall {
        let impedance = s * s * WALL_MASS + s * WALL_RESISTANCE + WALL_STIFFNESS;
        give = s / impedance * (share * perimeter);
        give_by_s = (-s * s * WALL_MASS + WALL_STIFFNESS) / (impedance * impedance) * (share * perimeter);
    }
    let b = WithDerivatives {
        value: (s * spring * (thermal + 1.0) + give) * l,
        by_s: ((thermal * 0.5 + 1.0) * spring + give_by_s) * l,
        by_area: (s * (spring / area) * (thermal * 0.5 + 1.0) + give / (2.0 * area)) * l,
        by_length: s * spring * (thermal + 1.0) + give,
    };
    [a, b]
}

/// Impedance at the lips, an inductance parallel to a resistance, with its derivatives by the complex frequency and by the last area.
fn radiation(area: f64, s: Complex64, acoustics: &Acoustics, share: f64) -> [Complex64; 3] {
    if !acoustics.radiation {
        return [Complex64::default(); 3];
    }
    let l = inertance(area);
    let r = 128.0 * DENSITY * SPEED / (9.0 * PI * PI * area);
    let w = s * (share * l / r);
    let z = s * l / (w + 1.0);
    let by_s = (w + 1.0).powi(-2) * l;
    [z, by_s, -z / (2.0 * area) * (w / (w + 1.0) + 1.0)]
}

fn inertance(area: f64) -> f64 {
    8.0 * DENSITY / (3.0 * PI * (PI * area).sqrt())
}

/// `E(s)` and its derivative by `s`.
pub(crate) fn characteristic(
    sections: &[Section],
    s: Complex64,
    acoustics: &Acoustics,
    share: f64,
) -> (Complex64, Complex64) {
    let [mut p, mut p_s, _] = radiation(sections.last().map_or(1.0, |x| x.area_m2), s, acoustics, share);
    let (mut u, mut u_s) = (Complex64::new(1.0, 0.0), Complex64::new(0.0, 0.0));
    for section in sections.iter().rev() {
        let [a, b] = immittance(section, s, acoustics, share);
        let (c, h, h_q) = cosh_and_sinhc(a.value * b.value);
        let q_s = a.by_s * b.value + a.value * b.by_s;
        let (c_s, h_s) = (h * 0.5 * q_s, h_q * q_s);
        let (ah, bh) = (a.value * h, b.value * h);
        let (ah_s, bh_s) = (a.by_s * h + a.value * h_s, b.by_s * h + b.value * h_s);
        (p_s, u_s) = (c_s * p + c * p_s + ah_s * u + ah * u_s, bh_s * p + bh * p_s + c_s * u + c * u_s);
        (p, u) = (c * p + ah * u, bh * p + c * u);
    }
    (u, u_s)
}

/// Derivatives of `E(s)` by the area and by the length of every section.
pub(crate) fn by_sections(sections: &[Section], s: Complex64, acoustics: &Acoustics) -> Vec<[Complex64; 2]> {
    let one = Complex64::new(1.0, 0.0);
    let [z, _, z_area] = radiation(sections.last().map_or(1.0, |x| x.area_m2), s, acoustics, 1.0);
    // Pressure and flow at the lip side of each section.
    let mut states = vec![(z, one); sections.len()];
    let steps: Vec<_> = sections.iter().map(|x| immittance(x, s, acoustics, 1.0)).collect();
    let hyperbolic: Vec<_> = steps.iter().map(|[a, b]| cosh_and_sinhc(a.value * b.value)).collect();
    for i in (1..sections.len()).rev() {
        let ([a, b], (c, h, _), (p, u)) = (steps[i], hyperbolic[i], states[i]);
        states[i - 1] = (c * p + a.value * h * u, b.value * h * p + c * u);
    }
    // The row (0 1) times the matrices of all sections nearer to the glottis.
    let (mut row_p, mut row_u) = (Complex64::default(), one);
    let mut out = Vec::with_capacity(sections.len());
    for ((&[a, b], &(c, h, h_q)), &(p, u)) in steps.iter().zip(&hyperbolic).zip(&states) {
        let rate = |a_x: Complex64, b_x: Complex64| {
            let q_x = a_x * b.value + a.value * b_x;
            let (c_x, h_x) = (h * 0.5 * q_x, h_q * q_x);
            let (ah_x, bh_x) = (a_x * h + a.value * h_x, b_x * h + b.value * h_x);
            row_p * (c_x * p + ah_x * u) + row_u * (bh_x * p + c_x * u)
        };
        out.push([rate(a.by_area, b.by_area), rate(a.by_length, b.by_length)]);
        (row_p, row_u) = (row_p * c + row_u * b.value * h, row_p * a.value * h + row_u * c);
    }
    if let Some(last) = out.last_mut() {
        last[0] += row_p * z_area;
    }
    out
}

/// `E` without losses and walls as a real function of the squared angular frequency, with its derivative.
pub(crate) fn without_losses(sections: &[Section], square: f64, acoustics: &Acoustics) -> (f64, f64) {
    let end = sections.last().filter(|_| acoustics.radiation);
    // Pressure is divided by `i omega`, so that all numbers are real.
    let (mut p, mut p_x) = (end.map_or(0.0, |x| inertance(x.area_m2)), 0.0);
    let (mut u, mut u_x) = (1.0, 0.0);
    for section in sections.iter().rev() {
        let a = section.length_m * DENSITY / section.area_m2;
        let b = section.length_m * section.area_m2 / (DENSITY * SPEED * SPEED);
        let q_x = -a * b;
        let q = square * q_x;
        let (c, h, h_q) = if -q < 1e-2 {
            let (c, h, h_q) = cosh_and_sinhc(Complex64::new(q, 0.0));
            (c.re, h.re, h_q.re)
        } else {
            let root = (-q).sqrt();
            let (c, h) = (root.cos(), root.sin() / root);
            (c, h, (c - h) / (2.0 * q))
        };
        let (c_x, h_x) = (h * 0.5 * q_x, h_q * q_x);
        let (down, down_x) = (-square * b * h, -b * (h + square * h_x));
        (p_x, u_x) =
            (c_x * p + c * p_x + a * (h_x * u + h * u_x), down_x * p + down * p_x + c_x * u + c * u_x);
        (p, u) = (c * p + a * h * u, down * p + c * u);
    }
    (u, u_x)
}

/// Magnitude of the transfer function at a frequency, dB.
pub fn level_db(sections: &[Section], acoustics: &Acoustics, frequency_hz: f64) -> f64 {
    let s = Complex64::new(0.0, TAU * frequency_hz);
    -20.0 * characteristic(sections, s, acoustics, 1.0).0.norm().log10()
}

/// Pairs of frequency, Hz, and [`level_db`], from `step_hz` to `highest_hz` in steps of `step_hz`.
pub fn curve(sections: &[Section], acoustics: &Acoustics, step_hz: f64, highest_hz: f64) -> Vec<[f64; 2]> {
    let count = (highest_hz / step_hz).floor() as usize;
    (1..=count).map(|i| i as f64 * step_hz).map(|f| [f, level_db(sections, acoustics, f)]).collect()
}

/// A short cylinder of the tract. A tract is a list of them from the glottis to the lips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Length along the midline, m.
    pub length_m: f64,
    pub area_m2: f64,
}
