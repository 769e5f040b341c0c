//! A body with its contracting muscles, ready to be solved, and its observables by name.

use std::sync::Arc;

use nalgebra::SVector;

use tongue_core::body::Body;
use tongue_core::choice;
use tongue_core::observe::{Contour, Curve, Length, Ratio, Stretch, Surface};
use tongue_core::statistics::distinct;
use tongue_core::system::{Model, System};

use super::SimulationError;
use super::error::check_tension;

/// A body of which some muscles can contract, made into a [`System`]. Clones share its data.
#[derive(Debug, Clone)]
pub struct Assembly<const D: usize> {
    pub body: Arc<Body<D>>,
    pub model: Model,
    pub system: Arc<System<D>>,
}

/// Indices of the chains of a muscle, of which there is at least one.
fn fibres<const D: usize>(body: &Body<D>, muscle: &str) -> Result<Vec<usize>, SimulationError> {
    let first = body.muscle(muscle)?;
    Ok(body.muscles_called(&body.mesh.muscles[first].name).collect())
}

impl<const D: usize> Assembly<D> {
    /// Makes `body` ready to be solved, with all fibres of the named muscles contracting. All other muscles are passive tissue.
    ///
    /// # Errors
    /// For an unknown muscle, with the nearest name, for a muscle given twice, and where [`System::new`] fails.
    pub fn new(
        model: &Model,
        body: &Body<D>,
        muscles: impl IntoIterator<Item = impl AsRef<str>>,
    ) -> Result<Self, SimulationError> {
        let mut contracting = Vec::new();
        for name in muscles {
            let fibres = fibres(body, name.as_ref())?;
            if contracting.contains(&fibres[0]) {
                return Err(SimulationError::repeated_name(name.as_ref()));
            }
            contracting.extend(fibres);
        }
        let system = Arc::new(System::new(&body.mesh, model, &contracting)?);
        Ok(Self { body: Arc::new(body.clone()), model: *model, system })
    }

    /// Names of the muscles that can contract, each once, in the given order.
    pub fn contracting(&self) -> Vec<&str> {
        distinct(self.system.contracting().iter().map(|&m| self.body.mesh.muscles[m].name.as_str()))
    }

    /// The length of a muscle, m.
    pub fn length(&self, muscle: &str) -> Result<Length, SimulationError> {
        Ok(Length::new(self.system.muscle_ends(self.line(muscle)?)))
    }

    pub fn stretch(&self, muscle: &str) -> Result<Stretch, SimulationError> {
        let rest = self.system.length(self.system.rest(), self.line(muscle)?);
        Ok(Stretch::new(self.length(muscle)?, rest))
    }

    pub fn ratio(&self, muscle: &str, over: &str) -> Result<Ratio, SimulationError> {
        Ok(Ratio::new(self.length(muscle)?, self.length(over)?))
    }

    /// The length of a muscle in a shape, m; the mean over its fibres.
    pub fn mean_length(&self, muscle: &str, positions: &[SVector<f64, D>]) -> Result<f64, SimulationError> {
        let fibres = self.fibres(muscle)?;
        let sum: f64 = fibres.iter().map(|&m| self.system.length(positions, m)).sum();
        Ok(sum / fibres.len() as f64)
    }

    pub(super) fn fibres(&self, muscle: &str) -> Result<Vec<usize>, SimulationError> {
        fibres(&self.body, muscle)
    }

    /// Index of the chain of a muscle that has only one.
    fn line(&self, muscle: &str) -> Result<usize, SimulationError> {
        match self.fibres(muscle)?[..] {
            [line] => Ok(line),
            ref all => Err(SimulationError::fibres(
                muscle,
                all.len(),
                "an observable needs a muscle with one line; give the fibres different names",
            )),
        }
    }

    /// Indices of the chains of a muscle that contracts.
    pub(super) fn pulling(&self, muscle: &str) -> Result<Vec<usize>, SimulationError> {
        let fibres = self.fibres(muscle)?;
        if self.system.contracting().contains(&fibres[0]) {
            Ok(fibres)
        } else {
            Err(SimulationError::Refused(format!(
                "{muscle} does not contract in this model; name it when the model is assembled (contracting: {})",
                self.contracting().join(", ")
            )))
        }
    }

    /// Tensions of all chains of the body, N, from those given by name; all others are zero.
    pub(super) fn tensions(&self, given: &[(&str, f64)]) -> Result<Vec<f64>, SimulationError> {
        let mut all = vec![0.0; self.system.muscle_count()];
        let mut seen = Vec::with_capacity(given.len());
        for &(muscle, tension) in given {
            check_tension(muscle, tension)?;
            let fibres = self.pulling(muscle)?;
            if seen.contains(&fibres[0]) {
                return Err(SimulationError::repeated_name(muscle));
            }
            fibres.iter().for_each(|&fibre| all[fibre] = tension);
            seen.extend(fibres);
        }
        Ok(all)
    }

    pub(super) fn bone(&self, name: &str) -> Result<&[usize], SimulationError> {
        let known: Vec<&str> = self.body.bones.iter().map(|b| b.name.as_str()).collect();
        let hint =
            if known.is_empty() { "it has no named bones".to_owned() } else { choice::hint(name, known) };
        match self.body.bone(name) {
            [] => Err(SimulationError::Refused(format!("there is no bone \"{name}\" in this body; {hint}"))),
            nodes => Ok(nodes),
        }
    }
}

impl Assembly<2> {
    /// The signed distance of a measured point, m, from the outline of the tissue, or from the longest of several outlines: positive
    /// outside.
    ///
    /// # Errors
    /// For a point that is not finite or a body without an outline.
    pub fn contour(&self, point: SVector<f64, 2>) -> Result<Contour, SimulationError> {
        let mesh = &self.body.mesh;
        let mut outline = mesh.outlines().into_iter().max_by_key(Vec::len).unwrap_or_default();
        // The curve is straight at its two ends, which meet, so they are put on a bone.
        let seam = outline.iter().position(|n| mesh.fixed.binary_search(n).is_ok()).unwrap_or(0);
        outline.rotate_left(seam);
        outline.extend(outline.first().copied());
        let curve = Curve::through(outline, &mesh.nodes).filter(|_| point.iter().all(|x| x.is_finite()));
        curve.map(|curve| Contour::new(curve, point)).ok_or_else(|| nowhere(point.as_slice()))
    }
}

impl Assembly<3> {
    /// The signed distance of a measured point, m, from the surface of the tissue: positive outside. The point must be finite,
    /// and the body must have cells.
    pub fn surface(&self, point: SVector<f64, 3>) -> Result<Surface, SimulationError> {
        let faces = self.body.mesh.outward_faces();
        if !faces.is_empty() && point.iter().all(|x| x.is_finite()) {
            Ok(Surface::new(faces, point))
        } else {
            Err(nowhere(point.as_slice()))
        }
    }
}

fn nowhere(point: &[f64]) -> SimulationError {
    let value = point.iter().copied().find(|x| !x.is_finite()).unwrap_or(f64::NAN);
    SimulationError::value("the distance of the point from the surface", value, "a number")
}
