//! Accuracy and time of the continuum by mesh spacing, compared with springs; locking; and the effect of settings that were chosen without
//! data. Errors are differences from the finest mesh of the same body. Meshes are nested, and all have the outline of the anatomy.

use std::fmt::Write as _;

use serde::Serialize;

use crate::measure::{Effort, ONE_PER_CENT, Timed, measure};
use crate::table::{curves, duration, markdown, number};
use crate::test_tensions::{largest_difference, target, with_poisson_ratio};
use crate::{Error, PUBLISHED_A, TestTensions, tell};
use tongue_core::body::{Anatomy, Body, ContinuumSettings, Mesh};
use tongue_core::statics::{SolveSettings, SolveStatus, Workspace, solve};
use tongue_core::system::Model;
use tongue_files::report::{ReportError, Svg, work_precision};
use tongue_infer::inverse::{self, Fit, FitSettings as Search, Method};
use tongue_input::measured::thesis::Thesis;
use tongue_input::measured::{Target, TargetKind};

/// A control whose lengths should not converge: muscles are thin, and each bone holds one node.
const CONTROL: ContinuumSettings =
    ContinuumSettings { bundle_width_m: 0.5e-3, fibres: 9, patch_radius_m: 0.0, patch_stiffness: 50.0 };
const COARSEST_M: f64 = 11e-3;
/// Default spacing of a continuum, m, which is not one of the nested meshes.
const DEFAULT_M: f64 = 4e-3;
const POISSON_RATIOS: [f64; 6] = [0.3, 0.45, 0.49, 0.499, 0.4998, 0.4999];
const NEARLY_INCOMPRESSIBLE: f64 = 0.4998;
/// Number of nested meshes, from 11 mm to 1.4 mm.
const LEVELS: usize = 4;
const FITS: Effort = Effort { repeats: 3, ..Effort::FULL };

/// A body on a mesh, at the tensions published for /a/.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Spacing {
    pub body: &'static str,
    pub h_mm: f64,
    pub unknown_nodes: usize,
    /// Largest change of a ratio from the next coarser mesh.
    pub change_of_ratio: Option<f64>,
    /// Largest change of a ratio from the next coarser mesh at twice the tensions.
    pub change_at_twice: Option<f64>,
    /// Order of convergence from the last two changes.
    pub order: Option<f64>,
    /// Largest difference of a ratio from the finest mesh.
    pub error_of_ratio: f64,
    /// Largest relative difference of a tension from that of the finest mesh, in the fit to the stretches of S2 /a/.
    pub error_of_tension: Option<f64>,
    /// Median time of an equilibrium from rest, s.
    pub solve_s: f64,
    /// Median time of the fit to the stretches of S2 /a/ (Gauss-Newton, one start), s.
    pub fit_s: f64,
    pub status: String,
    /// Ratios at the tensions and at twice the tensions; empty if there is no equilibrium.
    #[serde(skip)]
    ratios: [Vec<f64>; 2],
    /// Fitted tensions; `None` if the fit does not reach its stretches.
    #[serde(skip)]
    tensions: Option<Vec<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Locking {
    pub poisson_ratio: f64,
    /// Largest difference of a ratio between spacings of 4 mm (the default) and 2 mm, which is large where elements lock.
    pub error_of_default_spacing: f64,
    /// Largest difference of a ratio from that at [`NEARLY_INCOMPRESSIBLE`], at the default spacing.
    pub difference_from_nearly_incompressible: f64,
}

/// Fitted tensions over those with the default settings; their quantiles are over all muscles of the fits of S1 to S3 that reach their
/// stretches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingSensitivity {
    pub setting: String,
    /// The 10 % quantile.
    pub low: f64,
    pub median: f64,
    pub high: f64,
    /// Number of fits that reach their stretches.
    pub reached: usize,
    /// Root mean square difference from the ratios of table 4.8, at the published tensions.
    pub rms_to_published_ratios: f64,
    /// Factor of the published tensions at which this difference is smallest.
    pub best_factor: f64,
    pub rms_at_best: f64,
}

#[derive(Debug, Clone)]
pub struct ContinuumStudy {
    pub spacings: Vec<Spacing>,
    pub locking: Vec<Locking>,
    /// Settings without data, the default ones first.
    pub sensitivity: Vec<SettingSensitivity>,
}

/// Ratios at `load` times the tensions, and how the solve ended with its median time.
fn ratios(scene: &TestTensions, load: f64) -> (Vec<f64>, Timed<SolveStatus>) {
    let tensions: Vec<f64> = scene.tensions.iter().map(|t| t * load).collect();
    let mut workspace = Workspace::new(&scene.system);
    let solved = measure(&Effort::FULL, || {
        workspace.start_from_rest(&scene.system);
        solve(&scene.system, &mut workspace, &tensions, &SolveSettings::default()).status
    });
    (scene.ratios(workspace.positions()), solved)
}

/// `None` if the solve did not converge.
fn ratios_if_converged(scene: &TestTensions, load: f64) -> Option<Vec<f64>> {
    let (ratios, solved) = ratios(scene, load);
    (solved.result == SolveStatus::Converged).then_some(ratios)
}

fn fit_target(body: &Body<2>, model: &Model, target: &Target) -> Result<Fit, Error> {
    let search = Search { method: Method::GaussNewton, starts: 1, ..Search::default() };
    Ok(inverse::fit(&body.mesh, model, target, &search)?)
}

fn tensions_if_converged(fit: &Fit) -> Option<Vec<f64>> {
    (fit.answer.status == inverse::FitStatus::Converged).then(|| fit.active_tensions())
}

pub fn run() -> Result<ContinuumStudy, Error> {
    let mut spacings = Vec::new();
    let bodies: [(&'static str, Option<ContinuumSettings>); 3] = [
        ("springs", None),
        ("continuum", Some(ContinuumSettings::default())),
        ("control: 0.5 mm on one node", Some(CONTROL)),
    ];
    for (name, settings) in bodies {
        tell(name);
        spacings.extend(spacings_of_nested_meshes(name, settings.as_ref())?);
    }
    tell("Poisson's ratios");
    let locking = locking()?;
    let default = ContinuumSettings::default();
    let variants = [
        ("default settings, nu 0.49", default, 0.49),
        ("muscles 4 mm wide", ContinuumSettings { bundle_width_m: 4e-3, ..default }, 0.49),
        ("muscles 8 mm wide", ContinuumSettings { bundle_width_m: 8e-3, ..default }, 0.49),
        ("patches of radius 7 mm", ContinuumSettings { patch_radius_m: 7e-3, ..default }, 0.49),
        ("patches of radius 14 mm", ContinuumSettings { patch_radius_m: 14e-3, ..default }, 0.49),
        ("patches with 20 mu/r", ContinuumSettings { patch_stiffness: 20.0, ..default }, 0.49),
        ("patches with 200 mu/r", ContinuumSettings { patch_stiffness: 200.0, ..default }, 0.49),
        ("nu 0.45", default, 0.45),
        ("nu 0.499", default, 0.499),
    ];
    let mut reference = Vec::new();
    let sensitivity = variants.into_iter().map(|(name, settings, nu)| {
        tell(name);
        sensitivity_row(name, &settings, nu, &mut reference)
    });
    let sensitivity = sensitivity.collect::<Result<_, _>>()?;
    Ok(ContinuumStudy { spacings, locking, sensitivity })
}

fn spacings_of_nested_meshes(
    name: &'static str,
    settings: Option<&ContinuumSettings>,
) -> Result<Vec<Spacing>, Error> {
    let (anatomy, target) = (Anatomy::reference()?, target("S2", "a", TargetKind::Stretch, &[])?);
    let measure_on = |mesh: Mesh<2>, h_mm: f64| -> Result<Spacing, Error> {
        let plain = Body::new(name, mesh);
        let body = match settings {
            Some(settings) => plain.into_continuum_of(&anatomy, settings)?,
            None => plain,
        };
        let scene = TestTensions::new(&body.mesh, &Model::default(), &PUBLISHED_A)?;
        let (once, solved) = ratios(&scene, 1.0);
        // On fine meshes no equilibrium of the control at twice the tensions can be found in useful time.
        let twice = if settings == Some(&CONTROL) { None } else { ratios_if_converged(&scene, 2.0) };
        let fitted = measure(&FITS, || fit_target(&body, &Model::default(), &target));
        Ok(Spacing {
            body: name,
            h_mm,
            unknown_nodes: scene.system.pattern().unknowns(),
            solve_s: solved.seconds,
            fit_s: fitted.seconds,
            status: format!("{:?}", solved.result),
            ratios: [once, twice.unwrap_or_default()],
            tensions: tensions_if_converged(&fitted.result?),
            ..Spacing::default()
        })
    };
    let mut mesh = Body::tongue(COARSEST_M)?.mesh.on_outline(anatomy.outline());
    let mut all: Vec<Spacing> = Vec::new();
    for level in 0..LEVELS {
        let mut here = measure_on(mesh.clone(), 1e3 * COARSEST_M / f64::from(1 << level))?;
        if let Some(coarser) = all.last() {
            let [once, twice] = [0, 1].map(|i| largest_difference(&coarser.ratios[i], &here.ratios[i]));
            let has_twice = !coarser.ratios[1].is_empty() && !here.ratios[1].is_empty();
            here.change_of_ratio = Some(once);
            here.change_at_twice = has_twice.then_some(twice);
            here.order = coarser.change_of_ratio.map(|before| (before / once).log2());
        }
        all.push(here);
        mesh = mesh.refined().on_outline(anatomy.outline());
    }
    if settings == Some(&ContinuumSettings::default()) {
        let mesh = Body::tongue(DEFAULT_M)?.mesh.on_outline(anatomy.outline());
        let finer = all.iter().position(|row| row.h_mm < 1e3 * DEFAULT_M).unwrap_or(all.len());
        all.insert(finer, measure_on(mesh, 1e3 * DEFAULT_M)?);
    }
    let Some(finest) = all.last() else { return Ok(Vec::new()) };
    let (finest, best) = (finest.ratios[0].clone(), finest.tensions.clone());
    for row in &mut all {
        row.error_of_ratio = largest_difference(&row.ratios[0], &finest);
        row.error_of_tension = row.tensions.as_ref().zip(best.as_ref()).map(|(found, best)| {
            found.iter().zip(best).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        });
    }
    Ok(all)
}

fn locking() -> Result<Vec<Locking>, Error> {
    let near = ratios_at(DEFAULT_M, NEARLY_INCOMPRESSIBLE)?;
    let rows = POISSON_RATIOS.into_iter().map(|poisson_ratio| {
        let coarse = ratios_at(DEFAULT_M, poisson_ratio)?;
        Ok(Locking {
            poisson_ratio,
            error_of_default_spacing: largest_difference(&coarse, &ratios_at(2e-3, poisson_ratio)?),
            difference_from_nearly_incompressible: largest_difference(&coarse, &near),
        })
    });
    rows.collect()
}

fn ratios_at(h: f64, nu: f64) -> Result<Vec<f64>, Error> {
    let body = Body::continuum(h, &ContinuumSettings::default())?;
    let model = with_poisson_ratio(nu);
    let ratios = ratios_if_converged(&TestTensions::new(&body.mesh, &model, &PUBLISHED_A)?, 1.0);
    ratios.ok_or_else(|| format!("no equilibrium at a spacing of {h} m and a Poisson's ratio of {nu}").into())
}

/// `reference` is filled by the first call.
fn sensitivity_row(
    name: &str,
    settings: &ContinuumSettings,
    nu: f64,
    reference: &mut Vec<Option<Vec<f64>>>,
) -> Result<SettingSensitivity, Error> {
    let body = Body::continuum(DEFAULT_M, settings)?;
    let model = with_poisson_ratio(nu);
    let mut tensions = Vec::new();
    for subject in ["S1", "S2", "S3"] {
        for vowel in ["i", "e", "a", "o"] {
            let fit = fit_target(&body, &model, &target(subject, vowel, TargetKind::Stretch, &[])?)?;
            tensions.push(tensions_if_converged(&fit));
        }
    }
    if reference.is_empty() {
        reference.clone_from(&tensions);
    }
    let both = tensions.iter().zip(reference.iter()).filter_map(|(a, b)| a.as_ref().zip(b.as_ref()));
    let mut parts: Vec<f64> =
        both.flat_map(|(a, b)| a.iter().zip(b)).filter(|(_, b)| **b > 0.5).map(|(a, b)| a / b).collect();
    parts.sort_by(f64::total_cmp);
    let [low, median, high] = [0.1, 0.5, 0.9].map(|q| {
        parts.get((q * (parts.len().max(1) - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
    });
    let scene = TestTensions::new(&body.mesh, &model, &PUBLISHED_A)?;
    let table = Thesis::reference().ratios_a(&scene.muscles).unwrap_or_default();
    let rms = |load: f64| {
        let Some(ratios) = ratios_if_converged(&scene, load) else { return f64::NAN };
        let squares: f64 = ratios.iter().zip(&table).map(|(a, b)| (a - b).powi(2)).sum();
        // The first ratio is 1 by definition.
        (squares / (table.len() - 1) as f64).sqrt()
    };
    let loads = (20..=50).map(|i| 0.05 * f64::from(i));
    let best = loads.map(|load| (load, rms(load))).min_by(|a, b| a.1.total_cmp(&b.1));
    let (best_factor, rms_at_best) = best.unwrap_or((f64::NAN, f64::NAN));
    Ok(SettingSensitivity {
        setting: name.to_owned(),
        low,
        median,
        high,
        reached: tensions.iter().flatten().count(),
        rms_to_published_ratios: rms(1.0),
        best_factor,
        rms_at_best,
    })
}

/// The coarsest mesh whose tensions are within 1 % of those of the finest or, if there is none, the nearest one. The finest mesh itself has
/// no error.
fn verdict(spacings: &[Spacing]) -> String {
    let of_continuum = spacings.iter().filter(|r| r.body == "continuum");
    let known = of_continuum.filter_map(|r| Some((r, r.error_of_tension.filter(|e| *e > 0.0)?)));
    let first = known.clone().find(|(_, error)| *error <= ONE_PER_CENT);
    let Some((r, error)) = first.or_else(|| known.min_by(|a, b| a.1.total_cmp(&b.1))) else {
        return "No mesh of this study has tensions to compare.".to_owned();
    };
    let (per_cent, note) = if error <= ONE_PER_CENT {
        ("1".to_owned(), "")
    } else {
        let note = " Errors are differences from the finest mesh; no other mesh is nearer to it.";
        (format!("{:.1}", 100.0 * error), note)
    };
    let (h, solve, fit) = (number(r.h_mm), duration(r.solve_s), duration(r.fit_s));
    format!(
        "**For {per_cent} % of a tension take --body continuum at h = {h} mm: an equilibrium costs {solve}, a fit {fit}.**{note}"
    )
}

pub fn picture(spacings: &[Spacing]) -> Result<Svg, ReportError> {
    let curves = curves(spacings, |row| row.body, |row| Some((row.fit_s, row.error_of_tension?)));
    let title = "Fits of S2 /a/: difference from the finest mesh of the same body";
    work_precision(title, "time of a fit, s", "error of a tension, as a part of it", &curves)
}

pub fn page(study: &ContinuumStudy, made: &str) -> Result<String, Error> {
    let mut p = format!(
        "# The continuum: accuracy, time, and what was chosen\n\n{made}\n\n{}\n\n",
        verdict(&study.spacings)
    );
    if let Some(default) = study.sensitivity.first() {
        let _ = write!(
            p,
            "This body is stiffer than springs on connections. **The tensions published for /a/ (12.0, 11.5, 4.5 N) are {} away from \
             table 4.8 here (RMS over seven ratios); {:.2} times as much is nearest, at {}.**\n\n",
            number(default.rms_to_published_ratios),
            default.best_factor,
            number(default.rms_at_best)
        );
    }
    let _ = write!(
        p,
        "![Error of a fitted tension against time](spacings.svg)\n\n## Mesh\n\n/a/ at the published tensions on nested meshes; errors against the finest mesh of the same body; the default spacing, 4 mm, \
         is not one of them. The tension is the worst of the three that are fitted to the stretches of S2 /a/. The control is expected not to converge. Times are medians of up to 15 solves and \
         3 fits (Gauss-Newton, one start).\n\n{}",
        markdown(&study.spacings, &[])?
    );
    let _ = write!(
        p,
        "## Locking\n\nThe same ratios at other Poisson's ratios: at 4 mm, the default spacing, against 2 mm, and against those of {NEARLY_INCOMPRESSIBLE}.\n\n{}",
        markdown(&study.locking, &[])?
    );
    let _ = write!(
        p,
        "## What has no data\n\nThe width of muscles and how bones hold are chosen, not measured: {}. Tensions fitted to the stretches of S1 to \
         S3 (12 rows, 4 mm), over those with the default settings. They were not tuned on muscles that a fit does not see.\n\n{}",
        ContinuumSettings::default(),
        markdown(&study.sensitivity, &[])?
    );
    Ok(p)
}
