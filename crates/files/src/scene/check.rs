//! Checks of a scene that need no mesh: numbers in their ranges, then one table of contradictions.

use super::file::{Scene, SceneBody, Want};
use crate::run::Kind;
use crate::simulation::SimulationError;
use tongue_core::dynamics::SHORTEST_S;
use tongue_core::limits::{self, BeyondLimit, Limit};
use tongue_infer::track;
use tongue_sound::profile::LEAST_OPENING_MM;

const LEAST_SEGMENT_MM: f64 = 1e-3;
static LIP_OPENING_MM: Limit = Limit {
    name: "tract.lip_opening_mm",
    least: LEAST_OPENING_MM,
    most: 100.0,
    unit: "",
    reason: "closer lips make a consonant, and no mouth opens wider",
};
/// A contour whose first point lies so far in front of the last one, and below it or farther above it than in front of it, is mirrored, does
/// not begin at the root, or has x and y exchanged.
const AHEAD_MM: f64 = 10.0;
const BELOW_MM: f64 = 5.0;

const NO_MASS: &str = "a body without mass has no motion to follow";
const ONE_TISSUE: &str =
    "a continuum is made of quadratic elements of E and nu, and of nothing else; leave one out";
const IN_PLANE: &str =
    "is of bodies in the plane; `tongue-fit track --body space` finds activations from places";
const OWN_LAW: &str = "a tongue in space has the law of Buchaillard, Perrier and Payan (2009); leave it out";
const FOUND: &str = "tensions are found from points; give one or the other";

fn limit_error(key: &'static str) -> impl Fn(BeyondLimit) -> SimulationError {
    move |limit| SimulationError::Refused(format!("{key}: {limit}"))
}

fn coordinates<'a>(key: &'static str, mut mm: impl Iterator<Item = &'a f64>) -> Result<(), SimulationError> {
    mm.try_for_each(|&x| limits::COORDINATE_MM.check(x)).map_err(limit_error(key))
}

impl Scene {
    /// Checks a scene for contradictions and for numbers out of range.
    pub fn check(&self) -> Result<(), SimulationError> {
        self.check_numbers()?;
        self.contradictions()?;
        self.check_points()
    }

    /// Refuses the first pair of keys that exclude each other, with the reason.
    #[rustfmt::skip]
    fn contradictions(&self) -> Result<(), SimulationError> {
        let (m, e, body) = (&self.material, &self.effects, self.body_key());
        let tension = self.tensions_n.keys().next().map(|muscle| format!("tensions_n.{muscle}"));
        let activation = self.activations.keys().next().map(|muscle| format!("activations.{muscle}"));
        let (pulls, tension) = (tension.is_some(), tension.unwrap_or_default());
        let (activated, activation) = (activation.is_some(), activation.unwrap_or_default());
        let continuum = self.body.kind() == Kind::Continuum;
        let in_space = matches!(self.body, SceneBody::TongueInSpace(_));
        let is_solid = matches!(self.body, SceneBody::Cylinder(_) | SceneBody::Block(_));
        let (moves, sounds) = (self.want == Want::Trajectory, self.want == Want::Sound);
        let (fit, points, tract) = (self.fit.is_some(), self.points.is_some(), self.tract.is_some());
        let weight = e.gravity.as_ref().map(|g| (g.posture.is_some(), g.direction.is_some()));
        let rules: &[(bool, &str, &str, &str)] = &[
            (continuum && e.springs == Some(true), "effects.springs = true", "kind = \"continuum\"", ONE_TISSUE),
            (continuum && e.incompressibility == Some(true), "effects.incompressibility = true", "kind = \"continuum\"", ONE_TISSUE),
            (!continuum && e.springs == Some(false), "effects.springs = false", "kind = \"springs\"",
                "nothing would hold the body together; take kind = \"continuum\" or leave it out"),
            (!moves && self.trajectory.is_some(), "[trajectory]", "want",
                "an equilibrium has no duration; want = \"trajectory\", or remove the table"),
            (moves && self.trajectory.is_none(), "want = \"trajectory\"", "the lack of [trajectory]",
                "say how long: [trajectory] duration_s = 3.0"),
            (moves && e.inertia == Some(false), "want = \"trajectory\"", "effects.inertia = false", NO_MASS),
            (moves && m.density_kg_per_m3 == Some(0.0), "want = \"trajectory\"", "material.density_kg_per_m3 = 0", NO_MASS),
            (moves && e.muscle_dynamics == Some(false), "want = \"trajectory\"", "effects.muscle_dynamics = false",
                "over time a muscle pulls through its series spring and damper; leave them on"),
            (moves && e.viscosity == Some(false), "want = \"trajectory\"", "effects.viscosity = false",
                "without dampers the body would oscillate for ever at frequencies that no step could follow"),
            (self.trajectory.as_ref().is_some_and(|t| t.ramp_s > t.duration_s), "trajectory.ramp_s", "trajectory.duration_s",
                "the tensions would end below their values; let the motion last as long as they grow"),
            (moves && points, "want = \"trajectory\"", "[points]", "points show one posture at rest; want = \"shape\""),
            (moves && fit, "want = \"trajectory\"", "[fit]",
                "lengths are fitted at equilibrium; want = \"lengths\" or \"shape\""),
            (fit && pulls, "[fit]", &tension, "a fit finds the tensions; give one or the other"),
            (!in_space && self.surgery.is_some(), "[surgery]", body, "only [body.tongue-in-space] is operated"),
            (!in_space && activated, &activation, body,
                "only muscles of [body.tongue-in-space] are activated; give tensions_n"),
            (in_space && pulls, "tensions_n", body, "muscles in space have strengths; give [activations] from 0 to 1"),
            (in_space && fit, "[fit]", body, IN_PLANE),
            (in_space && points, "[points]", body, IN_PLANE),
            (in_space && moves, "want = \"trajectory\"", body, "motion in space is not computed; want = \"shape\""),
            (in_space && sounds, "want = \"sound\"", body, "use `tongue-fit sound --body space`"),
            (in_space && m.young_modulus_pa.is_some(), "material.young_modulus_pa", body, OWN_LAW),
            (in_space && m.poisson_ratio.is_some(), "material.poisson_ratio", body, OWN_LAW),
            (in_space && m.viscosity_pa_s.is_some(), "material.viscosity_pa_s", body, OWN_LAW),
            (in_space && e.springs == Some(true), "effects.springs = true", body, OWN_LAW),
            (in_space && e.incompressibility == Some(true), "effects.incompressibility = true", body, OWN_LAW),
            (points && pulls, "[points]", &tension, FOUND),
            (points && fit, "[points]", "[fit]", FOUND),
            (points && continuum, "[points]", "kind = \"continuum\"",
                "tensions are not yet found from points on a continuum; leave one out"),
            (points && e.incompressibility != Some(true), "[points]", "effects.incompressibility = false",
                "cells of springs alone invert at tensions of the search; ask for effects.incompressibility = true"),
            (sounds && !tract, "want = \"sound\"", "the lack of [tract]",
                "describe the tract: [tract] alone takes the built-in one with lips open by 8 mm"),
            (!sounds && !moves && tract, "[tract]", "want",
                "neither shape nor lengths depend on it; want = \"sound\", or remove the table"),
            (matches!(weight, Some((true, true) | (false, false))), "effects.gravity.posture", "effects.gravity.direction",
                "give exactly one of them, since each gives the direction of weight"),
            (matches!(weight, Some((true, _))) && is_solid, "effects.gravity.posture", body,
                "a simple solid has no head; give effects.gravity.direction"),
        ];
        match rules.iter().find(|(is_broken, ..)| *is_broken) {
            Some((_, first, second, why)) => Err(SimulationError::contradiction(first, second, why)),
            None => Ok(()),
        }
    }

    fn check_points(&self) -> Result<(), SimulationError> {
        let Some(points) = &self.points else { return Ok(()) };
        limits::NOISE_MM.check(points.noise_mm).map_err(limit_error("points"))?;
        limits::PRIOR.check(points.prior_n_per_m)?;
        coordinates("points.contour_mm", points.contour_mm.iter().flatten())?;
        for sensor in &points.sensors {
            coordinates("points.sensors.at_mm", sensor.at_mm.iter())?;
            limits::SURFACE_MM.check(sensor.surface_mm).map_err(limit_error("points.sensors"))?;
        }
        if let [first, .., last] = &points.contour_mm[..] {
            let (ahead_mm, below_mm) = (last[0] - first[0], last[1] - first[1]);
            if ahead_mm > AHEAD_MM && (below_mm > BELOW_MM || -below_mm > ahead_mm) {
                let why = "its first point, at the root, lies in front of the last one: x grows to the back and y upwards, from root to tip; \
                           exchange x and y, change the sign of x if the face looks the other way, or reverse the points if they begin at the \
                           tip";
                return Err(SimulationError::contradiction(
                    "points.contour_mm",
                    "the frame of the body",
                    why,
                ));
            }
        }
        let seen = points.contour_mm.len() + 2 * points.sensors.len();
        if seen < track::FEWEST {
            Err(SimulationError::value(
                "the number of points of points.contour_mm and, twice, points.sensors",
                seen as f64,
                "at least 3: fewer do not determine tensions",
            ))
        } else {
            Ok(())
        }
    }

    fn check_numbers(&self) -> Result<(), SimulationError> {
        for &tension in self.tensions_n.values() {
            limits::SCENE_TENSION.check(tension)?;
        }
        if let Some(g) = &self.effects.gravity {
            limits::GRAVITY.check(g.acceleration_m_per_s2)?;
            if let Some(&value) = g.direction.iter().flatten().find(|x| !x.is_finite()) {
                return Err(SimulationError::value("effects.gravity.direction", value, "finite"));
            }
        }
        if let Some(c) = &self.effects.contact {
            limits::REACH_MM.check(c.reach_mm)?;
            c.stiffness_n_per_m.map_or(Ok(()), |stiffness| limits::WALL_STIFFNESS.check(stiffness))?;
            coordinates("effects.contact.outline_mm", c.outline_mm.iter().flatten().flatten())?;
            let points = c.outline_mm.as_deref().unwrap_or(&[[0.0, 0.0], [1.0, 0.0]]);
            if points.len() < 2 {
                let key = "the number of points of effects.contact.outline_mm";
                return Err(SimulationError::value(key, points.len() as f64, "at least 2"));
            }
            let gap = |p: &[[f64; 2]]| (p[0][0] - p[1][0]).hypot(p[0][1] - p[1][1]);
            if let Some(value) = points.windows(2).map(gap).find(|gap| *gap < LEAST_SEGMENT_MM) {
                let key = "the distance in mm between two points of effects.contact.outline_mm";
                return Err(SimulationError::value(key, value, "at least 0.001; drop one of them"));
            }
        }
        if let Some(jaw) = &self.effects.jaw {
            limits::OPENING_DEG.check(jaw.opening_deg)?;
            coordinates("effects.jaw.joint_mm", jaw.joint_mm.iter())?;
        }
        if let Some(hyoid) = &self.effects.hyoid {
            hyoid.shift_mm.iter().try_for_each(|&mm| limits::HYOID_MM.check(mm))?;
        }
        if let Some(t) = &self.trajectory {
            limits::DURATION_S.check(t.duration_s)?;
            limits::RAMP_S.check(t.ramp_s)?;
            if t.ramp_s > 0.0 && t.ramp_s < SHORTEST_S {
                let must = "0 or at least 1e-9: nothing moves faster";
                return Err(SimulationError::value("trajectory.ramp_s", t.ramp_s, must));
            }
            limits::TOLERANCE_MM.check(t.tolerance_mm)?;
        }
        if let Some(tract) = &self.tract {
            LIP_OPENING_MM.check(tract.lip_opening_mm)?;
            limits::LIP_PROTRUSION_MM.check(tract.lip_protrusion_mm)?;
        }
        Ok(())
    }

    pub(super) fn body_key(&self) -> &'static str {
        match self.body {
            SceneBody::Tongue(_) => "[body.tongue]",
            SceneBody::TongueInSpace(_) => "[body.tongue-in-space]",
            SceneBody::Mesh(_) => "[body.mesh]",
            SceneBody::Cylinder(_) => "[body.cylinder]",
            SceneBody::Block(_) => "[body.block]",
        }
    }
}
