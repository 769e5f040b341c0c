//! Equilibria by name.

use nalgebra::SVector;

use tongue_core::statics::{self, SolveSettings, Workspace};

use super::error::check_number;
use super::{Assembly, Shape, SimulationError};

/// Solves equilibria of an [`Assembly`], one after another. Each thread needs one of its own, since a solve writes to its memory.
#[derive(Debug)]
pub struct Solver<const D: usize> {
    pub settings: SolveSettings,
    assembly: Assembly<D>,
    workspace: Workspace<D>,
}

impl<const D: usize> Assembly<D> {
    /// A solver of this assembly; each thread needs its own.
    pub fn solver(&self) -> Solver<D> {
        let workspace = Workspace::new(self.system());
        Solver { settings: SolveSettings::default(), assembly: self.clone(), workspace }
    }
}

impl<const D: usize> Solver<D> {
    /// The equilibrium at these tensions (N; 2D: per metre of thickness), solved from rest. All other muscles have no tension. The result
    /// does not depend on earlier solves.
    ///
    /// # Errors
    /// A name that the body does not have, that was not assembled, or that is given twice; a tension that is negative or not finite.
    /// [`Shape::is_converged`] says whether there is an equilibrium.
    pub fn equilibrium(&mut self, tensions: &[(&str, f64)]) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        self.workspace.start_from_rest(self.assembly.system());
        Ok(self.solve(tensions))
    }

    /// Like [`Solver::equilibrium`], but starts from an earlier shape, for small changes of the tensions. Of several equilibria one near
    /// that shape is found.
    pub fn equilibrium_from(
        &mut self,
        start: &Shape<D>,
        tensions: &[(&str, f64)],
    ) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        self.check_body(start)?;
        self.workspace.start_from_rest(self.assembly.system());
        self.workspace.start_from(start.positions());
        Ok(self.solve(tensions))
    }

    /// Like [`Solver::equilibrium`], and also follows the equilibria from rest as the tensions grow, to check that the shape lies on that
    /// branch ([`Shape::is_traced`]). For the cost see [`statics::trace()`].
    pub fn follow_from_rest(&mut self, tensions: &[(&str, f64)]) -> Result<Shape<D>, SimulationError> {
        let tensions = self.assembly.tensions(tensions)?;
        let (system, w) = (self.assembly.system(), &mut self.workspace);
        w.start_from_rest(system);
        let trace = statics::solve_and_trace(system, w, &tensions, &self.settings);
        Ok(Shape::new(&self.assembly, trace.into(), tensions, w.positions().to_vec()))
    }

    /// Derivatives of the positions of the nodes of an equilibrium by each tension, m/N (2D: per newton per metre of thickness): a list for
    /// each contracting muscle, in their order, with an entry for each node. `None` if the shape is not a stable equilibrium.
    pub fn position_rates(
        &mut self,
        shape: &Shape<D>,
    ) -> Result<Option<Vec<Vec<SVector<f64, D>>>>, SimulationError> {
        self.check_body(shape)?;
        if !shape.is_converged() {
            return Ok(None);
        }
        let muscles = self.assembly.contracting().into_iter().map(|m| self.assembly.fibres(m));
        let muscles = muscles.collect::<Result<Vec<_>, _>>()?;
        let (system, at) = (self.assembly.system(), (shape.positions(), &shape.solved.pulls[..]));
        Ok(statics::position_rates(system, &mut self.workspace, at, &muscles))
    }

    fn check_body(&self, shape: &Shape<D>) -> Result<(), SimulationError> {
        let (given, nodes) = (shape.positions().len(), self.workspace.positions().len());
        (given == nodes).then_some(()).ok_or_else(|| {
            SimulationError::Refused(format!(
                "the shape to start from has {given} nodes, the body {nodes}; take a shape of the same body"
            ))
        })
    }

    /// Displaces a bone by `shift` (m) from its place at rest in all later solves.
    pub fn shift_bone(&mut self, bone: &str, shift: SVector<f64, D>) -> Result<(), SimulationError> {
        let nodes = self.assembly.bone(bone)?;
        for &part in shift.iter() {
            check_number(&format!("the shift of {bone}"), part, part.is_finite(), "finite")?;
        }
        self.workspace.displace_bone(self.assembly.system(), nodes, shift);
        Ok(())
    }

    fn solve(&mut self, tensions: Vec<f64>) -> Shape<D> {
        let solution = statics::solve(self.assembly.system(), &mut self.workspace, &tensions, &self.settings);
        Shape::new(&self.assembly, solution.into(), tensions, self.workspace.positions().to_vec())
    }
}
