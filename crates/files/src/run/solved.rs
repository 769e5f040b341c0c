//! One equilibrium of a body in the plane or in space, at given tensions or activations.

use std::time::Instant;

use nalgebra::{SVector, Vector2, Vector3};
use tongue_core::body::Body;
use tongue_core::statics::Workspace;
use tongue_core::system::{Model, SpaceModel, System, SystemError};
use tongue_infer::inverse::alarms::{self, Alarm};

use super::equilibrium::Equilibrium;

/// A body at equilibrium.
pub struct Solved<const D: usize> {
    pub found: Equilibrium,
    /// Positions of all nodes, m.
    pub positions: Vec<SVector<f64, D>>,
    /// In space, that of one half where both sides are alike.
    pub system: System<D>,
    pub wall_s: f64,
}

impl<const D: usize> Solved<D> {
    fn of(system: System<D>, pulls: &[f64], direct: bool) -> Self {
        let mut workspace = Workspace::new(&system);
        let clock = Instant::now();
        let found = Equilibrium::of(&system, &mut workspace, pulls, direct);
        let wall_s = clock.elapsed().as_secs_f64();
        Self { found, positions: workspace.positions().to_vec(), system, wall_s }
    }

    /// What to doubt: the equilibrium, and tissue that is strained too much.
    pub fn alarms(&self, body: &Body<D>) -> Vec<Alarm> {
        let strain = alarms::of_shape(body, &self.system, &self.positions);
        self.found.alarms.iter().cloned().chain(strain).collect()
    }
}

impl Solved<2> {
    /// The equilibrium at these tensions of all muscles of the mesh, N per metre of thickness, of which those of `pulling` contract; unless
    /// `direct`, the equilibria from rest are followed as the tensions grow.
    pub fn in_plane(
        body: &Body<2>,
        model: &Model,
        (pulling, tensions): (&[usize], &[f64]),
        direct: bool,
    ) -> Result<Self, SystemError> {
        Ok(Self::of(System::new(&body.mesh, model, pulling)?, tensions, direct))
    }
}

impl Solved<3> {
    /// The equilibrium at these activations of all muscles, of one half of a body whose sides are alike; unless `direct`, the equilibria
    /// from rest are followed as the activations grow. `tell` gets the size of the system once it is set up.
    pub fn in_space(
        body: &Body<3>,
        model: &SpaceModel,
        activations: &[f64],
        direct: bool,
        tell: &dyn Fn(&str),
    ) -> Result<Self, SystemError> {
        let half = body.half().and_then(|half| Some((half.activations(activations)?, half)));
        let clock = Instant::now();
        let system = match &half {
            Some((_, half)) => System::of_half(half, model),
            None => System::in_space(body, model),
        }?;
        let (unknowns, entries) = (3 * system.pattern().unknowns(), system.pattern().factor_entries::<3>());
        let made = clock.elapsed().as_secs_f64();
        let what = if half.is_some() { "only one half is solved: " } else { "" };
        tell(&format!(
            "{}: {what}{unknowns} unknowns, {entries} entries of the factor, set up in {made:.2} s",
            body.what
        ));
        let Some((own, half)) = half else { return Ok(Self::of(system, activations, direct)) };
        let solved = Self::of(system, &own, direct);
        Ok(Self { positions: half.whole(&solved.positions), ..solved })
    }

    /// Positions in the midsagittal plane, m: forward is towards smaller x.
    pub fn midsagittal_positions(&self) -> Vec<Vector2<f64>> {
        self.positions.iter().map(|p: &Vector3<f64>| Vector2::new(p.x, p.z)).collect()
    }
}
