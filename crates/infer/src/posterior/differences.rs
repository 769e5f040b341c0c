//! How the lengths of muscles answer to the shape of the body at rest and to its constants, in any body: from the adjoint of every length
//! and differences of forces. No equilibrium is solved anew.
//!
//! With the displacements `u` of the nodes held, a body beside this one (displaced at rest, or with other constants, `p`) leaves forces
//! `f(p, u)` on them and has lengths `L(p, u)`. At equilibrium `f(p, u(p)) = 0`, so `dL/dp = ∂L/∂p + a·∂f/∂p` with the adjoint `a`
//! of the length, its answer to a force on every node. Both partial derivatives are central differences of one evaluation each. Bodies of
//! springs have formulas of their own (`shape`), which give the same.

use nalgebra::{DMatrix, DVector, SVector};

use tongue_core::body::{Body, HYOID};
use tongue_core::effect::Configuration;
use tongue_core::material::Constants;
use tongue_core::parallel;
use tongue_core::statics::lanes::Adjoint;
use tongue_core::system::{Model, System};

use super::PosteriorError;
use super::density::Place;
use super::ground::{Field, Ground, laid_anew};
use super::priors::Priors;

/// Bodies that are moved are so by this part of a standard deviation to either side, and so is kappa.
const STEP: f64 = 1e-3;
/// Widths and patches by more: their points pass from one element to another, and over the outline, one after the other.
const WIDE_STEP: f64 = 0.5;

/// A body beside the one of a posterior: the same unknowns.
#[derive(Debug)]
struct Beside {
    system: System<2>,
    hyoid: Vec<usize>,
}

impl Beside {
    fn new(body: &Body<2>, model: &Model) -> Result<Self, PosteriorError> {
        let all: Vec<usize> = (0..body.mesh.muscles.len()).collect();
        Ok(Self { system: System::new(&body.mesh, model, &all)?, hyoid: body.bone(HYOID).to_vec() })
    }

    /// Forces on all nodes of the unknowns, N, and lengths, m, where these are displaced as the unknowns of `ground` are at `positions`.
    fn at(
        &self,
        ground: &Ground,
        positions: &[SVector<f64, 2>],
        tensions: &[f64],
    ) -> (Vec<SVector<f64, 2>>, Vec<f64>) {
        let (own, system) = (&ground.system, &self.system);
        let moved = |n: usize| positions[n] - own.rest()[n];
        let mut x = system.rest().to_vec();
        // Nodes of the tissue have the same numbers; those of bones need not.
        own.pattern().nodes().iter().for_each(|&n| x[n] += moved(n));
        if let Some(&first) = ground.hyoid.first() {
            self.hyoid.iter().for_each(|&n| x[n] += moved(first));
        }
        system.place_path_nodes(&mut x);
        let mut force = vec![SVector::zeros(); x.len()];
        system.force(Configuration { positions: &x, tensions }, &mut force);
        (force, system.lengths(&x))
    }
}

/// Two bodies, by so many standard deviations to either side.
type Pair = ([Beside; 2], f64);

/// The sources that are no fields; none of what is known or has no part in the body.
#[derive(Debug)]
pub struct Sides {
    kappa: Option<Pair>,
    width: Option<Pair>,
    patch: Option<Pair>,
}

impl Sides {
    /// Of a body under priors.
    ///
    /// # Errors
    /// As [`Ground::new`].
    pub fn new(body: &Body<2>, model: &Model, priors: &Priors) -> Result<Self, PosteriorError> {
        type Side<'a> = &'a dyn Fn(f64) -> Result<Beside, PosteriorError>;
        let pair = |sd: f64, step: f64, side: Side<'_>| -> Result<Option<Pair>, PosteriorError> {
            Ok(if sd == 0.0 { None } else { Some(([side(-step * sd)?, side(step * sd)?], step)) })
        };
        let kappa = &priors.compressibility;
        let sd_ln_kappa = if kappa.off { 0.0 } else { kappa.sd_ln_kappa };
        let settings = body.mesh.continuum.as_ref().map(|c| c.settings);
        let laid = |change: &dyn Fn(&mut tongue_core::body::ContinuumSettings)| {
            let mut settings = settings.unwrap_or_default();
            change(&mut settings);
            Beside::new(&laid_anew(body, &settings)?, model)
        };
        let of_continuum = |sd: f64| if settings.is_some() { sd } else { 0.0 };
        Ok(Self {
            kappa: pair(sd_ln_kappa, STEP, &|by| {
                Beside::new(body, &Model { constants: with_lambda(&model.constants, by.exp()), ..*model })
            })?,
            width: pair(of_continuum(priors.sd_ln_width()), WIDE_STEP, &|by| {
                laid(&|s| s.bundle_width_m *= by.exp())
            })?,
            patch: pair(of_continuum(priors.sd_ln_patch()), WIDE_STEP, &|by| {
                laid(&|s| s.patch_radius_m *= by.exp())
            })?,
        })
    }
}

/// Constants with so many times the first of Lamé's, and the same second: what keeps areas, and nothing else.
fn with_lambda(constants: &Constants, times: f64) -> Constants {
    let (lambda, mu) = constants.lame();
    let poisson_ratio = lambda * times / (2.0 * (lambda * times + mu));
    Constants { poisson_ratio, young_modulus: 2.0 * mu * (1.0 + poisson_ratio), ..*constants }
}

/// How the stretches of all muscles answer, by one standard deviation of each source; a row a muscle.
#[derive(Debug, Clone)]
pub struct Answers {
    /// To the ends of the muscles.
    pub ends: DMatrix<f64>,
    /// To the outline.
    pub outline: DMatrix<f64>,
    /// To what keeps areas.
    pub kappa: DMatrix<f64>,
    /// To the width of muscles.
    pub width: DMatrix<f64>,
    /// To the patches of bones.
    pub patch: DMatrix<f64>,
}

impl Answers {
    /// To no source.
    pub fn none(muscles: usize) -> Self {
        let none = || DMatrix::zeros(muscles, 0);
        Self { ends: none(), outline: none(), kappa: none(), width: none(), patch: none() }
    }
}

/// A solved shape: its positions, tensions, and the adjoints of all lengths.
pub type Shape<'a> = (&'a [SVector<f64, 2>], &'a [f64], &'a [Adjoint<2>]);

/// How the stretches answer at a place; `None` where a body beside this one cannot be made.
pub fn answers(ground: &Ground, place: &Place, vowel: Shape<'_>, baseline: Shape<'_>) -> Option<Answers> {
    let sides = ground.sides.as_ref()?;
    let of_pair = |([low, high], step): &Pair| {
        let [own, over] = [vowel, baseline]
            .map(|shape| length_slopes(ground, [low, high], shape).map(|s| s / (2.0 * step)));
        let (own, over) = (own?, over?);
        Some(DVector::from_fn(own.len(), |m, _| {
            (own[m] - place.lengths[m] / place.baseline_lengths[m] * over[m]) / place.baseline_lengths[m]
        }))
    };
    let of_fields = |fields: &[Field], ends: bool| {
        let numbers: Vec<usize> = (0..fields.len()).collect();
        let columns = parallel::map(&numbers, |&f| {
            let side = |by: f64| {
                let mut along = vec![0.0; fields.len()];
                along[f] = by;
                let (of_ends, of_outline) = if ends { (&along[..], &[][..]) } else { (&[][..], &along[..]) };
                Beside::new(&ground.displaced(of_ends, of_outline)?, &ground.model).ok()
            };
            of_pair(&([side(-STEP)?, side(STEP)?], STEP))
        });
        matrix(ground, columns)
    };
    let of_side = |side: &Option<Pair>| matrix(ground, side.iter().map(of_pair).collect());
    Some(Answers {
        ends: of_fields(&ground.ends, true)?,
        outline: of_fields(&ground.outline, false)?,
        kappa: of_side(&sides.kappa)?,
        width: of_side(&sides.width)?,
        patch: of_side(&sides.patch)?,
    })
}

fn matrix(ground: &Ground, columns: Vec<Option<DVector<f64>>>) -> Option<DMatrix<f64>> {
    let columns: Vec<DVector<f64>> = columns.into_iter().collect::<Option<_>>()?;
    let count = ground.muscles.len();
    Some(DMatrix::from_fn(count, columns.len(), |m, c| columns[c][m]))
}

/// By how much more every length is in the second body than in the first, m, to first order.
fn length_slopes(
    ground: &Ground,
    [low, high]: [&Beside; 2],
    (positions, tensions, adjoints): Shape<'_>,
) -> Option<DVector<f64>> {
    let unknowns = ground.system.pattern().nodes();
    let same = |beside: &Beside| {
        let pattern = beside.system.pattern();
        pattern.unknowns() == unknowns.len() && unknowns.iter().all(|&n| pattern.unknown(n).is_some())
    };
    if !(same(low) && same(high)) {
        return None;
    }
    let ((force_low, low), (force_high, high)) =
        (low.at(ground, positions, tensions), high.at(ground, positions, tensions));
    let slope = |m: usize| {
        let by_force: f64 =
            unknowns.iter().map(|&n| adjoints[m].by_node[n].dot(&(force_high[n] - force_low[n]))).sum();
        high[m] - low[m] + by_force
    };
    Some(DVector::from_fn(adjoints.len(), |m, _| slope(m)))
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::posterior::{Density, Evaluator, Mode, Seen};

    #[test]
    fn bodies_of_springs_get_what_their_formulas_say() {
        let body = Body::tongue(8e-3).unwrap();
        let mut ground = Ground::new(&body, &Model::default(), &Priors::default()).unwrap();
        let seen = || Seen { names: vec![], muscles: vec![], stretches: vec![], rounding: vec![] };
        let at = |ground: &Ground| {
            let mut density = Density::new(ground, seen()).unwrap();
            let mode = Mode::find(&mut density).unwrap();
            let n = density.parameters.len();
            let scores = DVector::from_fn(n, |i, _| 0.3 * (i as f64).sin());
            Evaluator::new(&density).linearise(&scores, &mode.place).unwrap().0.geometry
        };
        let by_formulas = at(&ground);
        ground.sides = Some(Sides::new(&ground.body, &ground.model, &ground.priors).unwrap());
        let by_differences = at(&ground);
        // In springs kappa goes with λ - μ.
        let (lambda, mu) = ground.model.constants.lame();
        let kappa = &by_formulas.kappa * (lambda / (lambda - mu));
        for (formulas, differences) in [
            (&by_formulas.ends, &by_differences.ends),
            (&by_formulas.outline, &by_differences.outline),
            (&kappa, &by_differences.kappa),
        ] {
            let error = (formulas - differences).amax();
            assert_eq!(formulas.shape(), differences.shape());
            assert!(
                formulas.amax() > 1e-3 && error < 1e-5 * formulas.amax(),
                "{error} of {}",
                formulas.amax()
            );
        }
    }
}
