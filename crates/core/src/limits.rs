//! Limits of numbers that a user gives, so that no run needs more than about 1 GB of memory.

/// The range of a number that a user gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    pub name: &'static str,
    pub least: f64,
    pub most: f64,
    pub unit: &'static str,
    /// Why the range has these limits, or what to do.
    pub reason: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{} is {value}{}; it must be from {} to {}{}: {}", .limit.name, .limit.unit, round(.limit.least), round(.limit.most), .limit.unit, .limit.reason)]
pub struct BeyondLimit {
    pub limit: &'static Limit,
    pub value: f64,
}

/// A limit in few digits: `1e12` instead of `1000000000000`.
fn round(limit: f64) -> String {
    if (1e-5..1e7).contains(&limit.abs()) || limit == 0.0 { limit.to_string() } else { format!("{limit:e}") }
}

impl Limit {
    pub fn check(&'static self, value: f64) -> Result<(), BeyondLimit> {
        if (self.least..=self.most).contains(&value) {
            Ok(())
        } else {
            Err(BeyondLimit { limit: self, value })
        }
    }
}

const fn limit(name: &'static str, range: [f64; 2], unit: &'static str, reason: &'static str) -> Limit {
    Limit { name, least: range[0], most: range[1], unit, reason }
}

const MUCH_MEMORY: &str = "more need over 1 GB of memory; take a larger spacing or a coarser mesh";
const NO_TONGUE: &str = "a tongue is smaller; is the unit right?";

// Constants of the tissue.
pub static YOUNG_MODULUS: Limit = limit("Young's modulus", [1e-6, 1e12], " Pa", "the tongue's is 6900 Pa");
pub static POISSON_RATIO: Limit = limit(
    "Poisson's ratio",
    [-0.999_999, 0.499_999_9],
    "",
    "it lies between -1 and 0.5; the tongue's is 0.49",
);
pub static DENSITY: Limit = limit(
    "the density",
    [100.0, 1e4],
    " kg/m^3",
    "the tongue's is 1000 kg/m^3; multiply one in g/cm^3 by 1000",
);
pub static VISCOSITY: Limit = limit("the viscosity", [0.0, 1e12], " N s/m^2", "the tongue's is 3000 N s/m^2");
pub static STIFFENING: Limit =
    limit("--stiffening", [0.0, 1000.0], "", "it is a multiple of the passive stiffness, 9 in ArtiSynth");

// Sizes of bodies.
pub static CONTINUUM_ELEMENTS: Limit =
    limit("the number of elements of the continuum", [1.0, 25_000.0], "", MUCH_MEMORY);
pub static PLANE_NODES: Limit =
    limit("the number of nodes of the body in the plane", [1.0, 60_000.0], "", MUCH_MEMORY);
pub static FACTOR_ENTRIES: Limit =
    limit("the number of entries of the factorised stiffness matrix", [0.0, 1.3e7], "", MUCH_MEMORY);
pub static COORDINATE_MM: Limit = limit("a coordinate", [-1000.0, 1000.0], " mm", NO_TONGUE);

// Fits and posteriors.
pub static POSTERIOR_DRAWS: Limit = limit(
    "--posterior",
    [100.0, 200_000.0],
    " draws",
    "fewer do not show whether the chains have mixed, and more need much memory",
);
pub static STARTS: Limit = limit("the number of starts", [1.0, 10_000.0], "", "more do not improve a fit");
pub static UPPER_BOUND: Limit =
    limit("the upper bound of the tensions", [1e-9, 1e9], " N", "no muscle of the tongue pulls as hard");
pub static TENSION_TOLERANCE: Limit =
    limit("the tension tolerance", [1e-15, 1e9], " N", "below it tensions count as equal");
pub static MISFIT_TOLERANCE: Limit =
    limit("the misfit tolerance", [1e-30, 1e9], "", "below it a target counts as met");
pub static COST_TOLERANCE: Limit =
    limit("the cost tolerance", [0.0, 1e9], "", "below it two answers count as equally good");

// Maps of recordings.
const PRECISION: &str = "outside it rounding falsifies coordinates and times";
pub static UNIT_MM: Limit = limit("unit_mm", [1e-6, 1e4], "", PRECISION);
pub static RATE_HZ: Limit = limit("rate_hz", [1e-6, 1e5], "", PRECISION);
pub static NOISE_MM: Limit = limit("noise_mm", [1e-3, 100.0], "", "it is the error of one point");
pub static SCALE: Limit = limit("scale", [0.5, 2.0], "", "tongues of other speakers differ less in size");
pub static TURN_DEG: Limit = limit("turn_deg", [-180.0, 180.0], "", "it is an angle");
pub static SHIFT_MM: Limit = limit("shift_mm", [-1e4, 1e4], "", NO_TONGUE);
pub static SURFACE_MM: Limit =
    limit("surface_mm", [0.0, 150.0], "", "it is measured from the tip along the tongue");

// Scenes.
pub static SIZE_MM: Limit = limit("a size of the body", [1e-3, 1000.0], " mm", NO_TONGUE);
pub static SPACING_MM: Limit = limit("h_mm", [1e-3, 1000.0], " mm", NO_TONGUE);
const NO_MUSCLE: &str = "a muscle does not push, and none of the tongue pulls harder than that";
pub static TENSION: Limit = limit("a tension", [0.0, 1e4], " N", NO_MUSCLE);
pub static SCENE_TENSION: Limit = limit("a tension of tensions_n", [0.0, 1e4], " N", NO_MUSCLE);
pub static GRAVITY: Limit =
    limit("effects.gravity.acceleration_m_per_s2", [0.0, 1e6], "", "that of the earth is 9.81");
pub static REACH_MM: Limit = limit(
    "effects.contact.reach_mm",
    [1e-3, 1000.0],
    "",
    "a wall with a smaller reach is too stiff for double precision",
);
pub static WALL_STIFFNESS: Limit = limit(
    "effects.contact.stiffness_n_per_m",
    [1e-6, 1e12],
    "",
    "a softer wall has no effect, and a stiffer one makes forces overflow",
);
pub static OPENING_DEG: Limit = limit("effects.jaw.opening_deg", [-60.0, 60.0], "", "no jaw opens further");
pub static HYOID_MM: Limit =
    limit("effects.hyoid.shift_mm", [-30.0, 30.0], " mm", "no hyoid moves further, even in swallowing");
pub static DURATION_S: Limit =
    limit("trajectory.duration_s", [1e-9, 1e6], "", "motions of a tongue are neither shorter nor longer");
pub static RAMP_S: Limit = limit("trajectory.ramp_s", [0.0, 1e6], "", "it must not exceed the duration");
pub static TOLERANCE_MM: Limit = limit(
    "trajectory.tolerance_mm",
    [1e-9, 1.0],
    "",
    "it is the error of a step, and a tongue moves by some millimetres",
);
pub static LIP_PROTRUSION_MM: Limit =
    limit("tract.lip_protrusion_mm", [-100.0, 100.0], "", "no lips reach as far");
pub static PRIOR: Limit =
    limit("points.prior_n_per_m", [1e-6, 1e9], "", "it is the scale of a muscle's tension");
