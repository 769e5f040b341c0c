//! Compiles the entry points of the physics in this crate, for the plane and for space. Each crate that calls a generic function compiles
//! it again, unless it is marked `#[inline(never)]` and listed here, or called by what is listed, as the methods of effects are.

use crate::body::continuum;
use crate::dynamics::{self, IntegrationMethod};
use crate::sparse::cholesky::Factor;
use crate::statics::lanes::{LaneGroup, Lanes};
use crate::statics::{self, Response, Workspace};
use crate::system::{Additions, System};

#[doc(hidden)]
pub fn instances() -> [[*const (); 26]; 2] {
    [of_dimension::<2>(), of_dimension::<3>()]
}

fn of_dimension<const D: usize>() -> [*const (); 26] {
    [
        continuum::from_mesh::<D> as *const (),
        System::<D>::with_additions as *const (),
        System::<D>::from_effects as *const (),
        Additions::<D>::add_contact as *const (),
        Additions::<D>::add_gravity as *const (),
        Workspace::<D>::new as *const (),
        statics::solve::<D> as *const (),
        statics::trace::<D> as *const (),
        statics::solve_and_trace::<D> as *const (),
        statics::trace_beside::<D> as *const (),
        statics::position_rates::<D> as *const (),
        statics::smallest_eigenvalue::<D> as *const (),
        Response::<D>::new as *const (),
        Factor::<D>::new as *const (),
        Factor::<D>::factorise as *const (),
        Factor::<D>::negative_curvature as *const (),
        Factor::<D>::solve as *const (),
        Lanes::<D>::group as *const (),
        Lanes::<D>::reshaped as *const (),
        LaneGroup::<D>::solve as *const (),
        LaneGroup::<D>::solve_from_rest as *const (),
        LaneGroup::<D>::motions as *const (),
        LaneGroup::<D>::adjoint as *const (),
        IntegrationMethod::integrator::<D> as *const (),
        IntegrationMethod::checked_integrator::<D> as *const (),
        dynamics::run::<D> as *const (),
    ]
}
