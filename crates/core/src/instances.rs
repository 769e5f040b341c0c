//! Compiles the entry points of the physics in this crate, for the plane and for space. Each crate that calls a generic function compiles
//! it again, unless it is marked `#[inline(never)]` and listed here, or called by what is listed, as the methods of effects are.

use crate::body::continuum;
use crate::dynamics::{self, IntegrationMethod};
use crate::statics;
use crate::statics::lanes::{LaneGroup, Lanes};
use crate::system::{Additions, System};

#[doc(hidden)]
pub fn instances() -> [[*const (); 14]; 2] {
    [of_dimension::<2>(), of_dimension::<3>()]
}

fn of_dimension<const D: usize>() -> [*const (); 14] {
    [
        continuum::from_mesh::<D> as *const (),
        System::<D>::with_additions as *const (),
        System::<D>::from_effects as *const (),
        Additions::<D>::add_contact as *const (),
        Additions::<D>::add_gravity as *const (),
        statics::solve_and_trace::<D> as *const (),
        statics::position_rates::<D> as *const (),
        Lanes::<D>::group as *const (),
        Lanes::<D>::reshaped as *const (),
        LaneGroup::<D>::solve_from_rest as *const (),
        LaneGroup::<D>::motions as *const (),
        LaneGroup::<D>::adjoint as *const (),
        IntegrationMethod::checked_integrator::<D> as *const (),
        dynamics::run::<D> as *const (),
    ]
}
