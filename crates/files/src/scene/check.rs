//! Consistency of a scene, as far as it can be checked without the mesh.

use super::SceneError;
use super::file::{Scene, SceneBody, Want};
use crate::run::Kind;
use tongue_core::dynamics::SHORTEST_S;
use tongue_core::limits::{self, BeyondLimit};
use tongue_infer::track;

const LEAST_SEGMENT_MM: f64 = 1e-3;

/// The error for a number of a key.
fn of(key: &'static str) -> impl Fn(BeyondLimit) -> SceneError {
    move |beyond| SceneError::Beyond { key, beyond }
}

fn coordinates<'a>(key: &'static str, mut mm: impl Iterator<Item = &'a f64>) -> Result<(), SceneError> {
    mm.try_for_each(|&x| limits::COORDINATE_MM.check(x)).map_err(of(key))
}

impl Scene {
    /// Checks a scene for contradictions and for numbers out of range.
    pub fn check(&self) -> Result<(), SceneError> {
        self.check_numbers()?;
        self.check_tissue()?;
        self.check_motion()?;
        if let (Some(_), Some(muscle)) = (&self.fit, self.tensions_n.keys().next()) {
            let why = "a fit finds the tensions; give one or the other";
            return Err(contradiction("[fit]", format!("tensions_n.{muscle}"), why));
        }
        self.check_space()?;
        self.check_points()?;
        self.check_tract()?;
        match &self.effects.gravity {
            Some(g) if g.posture.is_some() == g.direction.is_some() => {
                let why = "give exactly one of them, since each gives the direction of weight";
                Err(contradiction("effects.gravity.posture", "effects.gravity.direction", why))
            }
            Some(g) if g.posture.is_some() && self.is_solid() => {
                let why = "a simple solid has no head; give effects.gravity.direction";
                Err(contradiction("effects.gravity.posture", self.body_key(), why))
            }
            _ => Ok(()),
        }
    }

    /// What a tongue in space does not have in scenes, and what only it has.
    fn check_space(&self) -> Result<(), SceneError> {
        let (m, e) = (&self.material, &self.effects);
        if !matches!(self.body, SceneBody::TongueInSpace(_)) {
            if self.surgery.is_some() {
                let why = "only [body.tongue-in-space] is operated";
                return Err(contradiction("[surgery]", self.body_key(), why));
            }
            let given = self.activations.keys().next();
            let why = "only muscles of [body.tongue-in-space] are activated; give tensions_n";
            return given.map_or(Ok(()), |muscle| {
                Err(contradiction(format!("activations.{muscle}"), self.body_key(), why))
            });
        }
        let in_plane =
            "is of bodies in the plane; `tongue-fit track --body space` finds activations from places";
        let law = "a tongue in space has the law of Buchaillard, Perrier and Payan (2009); leave it out";
        let rules = [
            (
                !self.tensions_n.is_empty(),
                "tensions_n",
                "muscles in space have strengths; give [activations] from 0 to 1",
            ),
            (self.fit.is_some(), "[fit]", in_plane),
            (self.points.is_some(), "[points]", in_plane),
            (
                self.want == Want::Trajectory,
                "want = \"trajectory\"",
                "motion in space is not computed; want = \"shape\"",
            ),
            (self.want == Want::Sound, "want = \"sound\"", "use `tongue-fit sound --body space`"),
            (m.young_modulus_pa.is_some(), "material.young_modulus_pa", law),
            (m.poisson_ratio.is_some(), "material.poisson_ratio", law),
            (m.viscosity_pa_s.is_some(), "material.viscosity_pa_s", law),
            (e.springs == Some(true), "effects.springs = true", law),
            (e.incompressibility == Some(true), "effects.incompressibility = true", law),
        ];
        first_broken(&rules.map(|(broken, key, why)| (broken, key, "[body.tongue-in-space]", why)))
    }

    fn check_points(&self) -> Result<(), SceneError> {
        let Some(points) = &self.points else { return Ok(()) };
        let why = "tensions are found from points; give one or the other";
        if let Some(muscle) = self.tensions_n.keys().next() {
            return Err(contradiction("[points]", format!("tensions_n.{muscle}"), why));
        }
        if self.fit.is_some() {
            return Err(contradiction("[points]", "[fit]", why));
        }
        if self.body.kind() == Kind::Continuum {
            let why = "tensions are not yet found from points on a continuum; leave one out";
            return Err(contradiction("[points]", "kind = \"continuum\"", why));
        }
        if self.effects.incompressibility != Some(true) {
            let why = "cells of springs alone invert at tensions of the search; ask for effects.incompressibility = true";
            return Err(contradiction("[points]", "effects.incompressibility = false", why));
        }
        limits::NOISE_MM.check(points.noise_mm).map_err(of("points"))?;
        limits::PRIOR.check(points.prior_n_per_m)?;
        coordinates("points.contour_mm", points.contour_mm.iter().flatten())?;
        for sensor in &points.sensors {
            coordinates("points.sensors.at_mm", sensor.at_mm.iter())?;
            limits::SURFACE_MM.check(sensor.surface_mm).map_err(of("points.sensors"))?;
        }
        let seen = points.contour_mm.len() + 2 * points.sensors.len();
        if seen < track::FEWEST {
            let key = "the number of points of points.contour_mm and, twice, points.sensors";
            return Err(SceneError::Value {
                key,
                value: seen as f64,
                must: "at least 3: fewer do not determine tensions",
            });
        }
        Ok(())
    }

    fn check_tract(&self) -> Result<(), SceneError> {
        let wanted = self.want == Want::Sound;
        if let Some(tract) = &self.tract {
            limits::LIP_OPENING_MM.check(tract.lip_opening_mm)?;
            limits::LIP_PROTRUSION_MM.check(tract.lip_protrusion_mm)?;
        }
        first_broken(&[
            (
                wanted && self.tract.is_none(),
                "want = \"sound\"",
                "the lack of [tract]",
                "describe the tract: [tract] alone takes the built-in one with lips open by 8 mm",
            ),
            (
                !wanted && self.tract.is_some() && self.want != Want::Trajectory,
                "[tract]",
                "want",
                "neither shape nor lengths depend on it; want = \"sound\", or remove the table",
            ),
        ])
    }

    fn check_numbers(&self) -> Result<(), SceneError> {
        for &tension in self.tensions_n.values() {
            limits::SCENE_TENSION.check(tension)?;
        }
        if let Some(g) = &self.effects.gravity {
            limits::GRAVITY.check(g.acceleration_m_per_s2)?;
            if let Some(&value) = g.direction.iter().flatten().find(|x| !x.is_finite()) {
                return Err(SceneError::Value { key: "effects.gravity.direction", value, must: "finite" });
            }
        }
        if let Some(c) = &self.effects.contact {
            limits::REACH_MM.check(c.reach_mm)?;
            limits::WALL_STIFFNESS.check(c.stiffness_n_per_m.unwrap_or_default())?;
            coordinates("effects.contact.outline_mm", c.outline_mm.iter().flatten().flatten())?;
            let points = c.outline_mm.as_deref().unwrap_or(&[[0.0, 0.0], [1.0, 0.0]]);
            if points.len() < 2 {
                let key = "the number of points of effects.contact.outline_mm";
                return Err(SceneError::Value { key, value: points.len() as f64, must: "at least 2" });
            }
            let gap = |p: &[[f64; 2]]| (p[0][0] - p[1][0]).hypot(p[0][1] - p[1][1]);
            if let Some(value) = points.windows(2).map(gap).find(|gap| *gap < LEAST_SEGMENT_MM) {
                let key = "the distance in mm between two points of effects.contact.outline_mm";
                return Err(SceneError::Value { key, value, must: "at least 0.001; drop one of them" });
            }
        }
        if let Some(jaw) = &self.effects.jaw {
            limits::OPENING_DEG.check(jaw.opening_deg)?;
            coordinates("effects.jaw.joint_mm", jaw.joint_mm.iter())?;
        }
        if let Some(hyoid) = &self.effects.hyoid {
            coordinates("effects.hyoid.shift_mm", hyoid.shift_mm.iter())?;
        }
        if let Some(t) = &self.trajectory {
            limits::DURATION_S.check(t.duration_s)?;
            limits::RAMP_S.check(t.ramp_s)?;
            if t.ramp_s > 0.0 && t.ramp_s < SHORTEST_S {
                let must = "0 or at least 1e-9: nothing moves faster";
                return Err(SceneError::Value { key: "trajectory.ramp_s", value: t.ramp_s, must });
            }
            limits::TOLERANCE_MM.check(t.tolerance_mm)?;
        }
        Ok(())
    }

    fn check_tissue(&self) -> Result<(), SceneError> {
        let e = &self.effects;
        let continuum = self.body.kind() == Kind::Continuum;
        let why = "a continuum is made of quadratic elements of E and nu, and of nothing else; leave one out";
        first_broken(&[
            (continuum && e.springs == Some(true), "effects.springs = true", "kind = \"continuum\"", why),
            (
                continuum && e.incompressibility == Some(true),
                "effects.incompressibility = true",
                "kind = \"continuum\"",
                why,
            ),
            (
                !continuum && e.springs == Some(false),
                "effects.springs = false",
                "kind = \"springs\"",
                "nothing would hold the body together; take kind = \"continuum\" or leave it out",
            ),
        ])
    }

    fn check_motion(&self) -> Result<(), SceneError> {
        let e = &self.effects;
        if self.want != Want::Trajectory {
            let why = "an equilibrium has no duration; want = \"trajectory\", or remove the table";
            return first_broken(&[(self.trajectory.is_some(), "[trajectory]", "want", why)]);
        }
        let massless = "a body without mass has no motion to follow";
        let rules = [
            (
                self.trajectory.is_none(),
                "the lack of [trajectory]",
                "say how long: [trajectory] duration_s = 3.0",
            ),
            (e.inertia == Some(false), "effects.inertia = false", massless),
            (self.material.density_kg_per_m3 == Some(0.0), "material.density_kg_per_m3 = 0", massless),
            (
                e.muscle_dynamics == Some(false),
                "effects.muscle_dynamics = false",
                "over time a muscle pulls through its series spring and damper; leave them on",
            ),
            (
                e.viscosity == Some(false),
                "effects.viscosity = false",
                "without dampers the body would oscillate for ever at frequencies that no step could follow",
            ),
            (self.points.is_some(), "[points]", "points show one posture at rest; want = \"shape\""),
            (
                self.fit.is_some(),
                "[fit]",
                "lengths are fitted at equilibrium; want = \"lengths\" or \"shape\"",
            ),
        ];
        first_broken(&rules.map(|(broken, other, why)| (broken, "want = \"trajectory\"", other, why)))
    }

    /// Whether the body is in space.
    pub(crate) fn is_solid(&self) -> bool {
        matches!(self.body, SceneBody::Cylinder(_) | SceneBody::Block(_))
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

pub(super) fn contradiction(first: impl Into<String>, second: impl Into<String>, why: &str) -> SceneError {
    SceneError::contradiction(first, second, why)
}

/// Checks the rules in order: whether one is broken, the two things that exclude each other, and why.
fn first_broken(rules: &[(bool, &str, &str, &str)]) -> Result<(), SceneError> {
    match rules.iter().find(|(broken, ..)| *broken) {
        Some((_, first, second, why)) => Err(contradiction(*first, *second, why)),
        None => Ok(()),
    }
}
