//! The published answer for /a/ of S2, simulated in the model at hand, to compare a fit with.

use miette::IntoDiagnostic;
use tongue_fit::body::Mesh;
use tongue_fit::inverse::TargetOnBody;
use tongue_fit::measured::{Target, TargetKind, Thesis};
use tongue_fit::statics::{self, Workspace};
use tongue_fit::system::{Model, System};

#[derive(Debug, Clone)]
pub struct Published {
    pub thesis: Thesis,
    pub ratios: Vec<f64>,
    pub stretches: Vec<f64>,
    /// Table 4.8: lengths over that of GGa in the thesis's own simulation.
    pub thesis_ratios: Vec<f64>,
    /// These ratios as stretches of the thesis's rest lengths, with the stretch of GGa of this simulation.
    pub thesis_stretches: Vec<f64>,
    pub rms: f64,
}

impl Published {
    /// The values simulated here and in the thesis, for a kind of target.
    pub fn values(&self, kind: TargetKind) -> (&[f64], &[f64]) {
        match kind {
            TargetKind::Ratio => (&self.ratios, &self.thesis_ratios),
            TargetKind::Stretch => (&self.stretches, &self.thesis_stretches),
        }
    }
}

pub fn answer(mesh: &Mesh<2>, model: &Model, target: &Target) -> miette::Result<Option<Published>> {
    let thesis = Thesis::reference().into_diagnostic()?;
    let published = thesis.tensions_a();
    if !thesis.simulated(target)
        || target.active_names() != published.iter().map(|(m, _)| *m).collect::<Vec<_>>()
    {
        return Ok(None);
    }
    let matched = TargetOnBody::new(mesh, target).into_diagnostic()?;
    let system = System::new(mesh, model, &matched.contracting()).into_diagnostic()?;
    let mut all = vec![0.0; system.muscle_count()];
    for (number, (_, tension)) in matched.contracting().into_iter().zip(&published) {
        all[number] = *tension;
    }
    let mut workspace = Workspace::new(&system);
    let solution = statics::solve(&system, &mut workspace, &all, &statics::SolveSettings::default());
    if solution.status != statics::SolveStatus::Converged {
        return Ok(None);
    }
    let measured = target.muscles.len();
    let mut lengths = matched.pick(&system.lengths(workspace.positions()));
    let mut rest = matched.pick(&system.lengths(system.rest()));
    [&mut lengths, &mut rest].into_iter().for_each(|list| list.truncate(measured));
    let [ratios, stretches] =
        [TargetKind::Ratio, TargetKind::Stretch].map(|kind| kind.values(&lengths, &rest, target.reference));
    let thesis_stretches = thesis.stretches_a(&target.muscles, stretches[target.reference]);
    let (Some(thesis_ratios), Some(thesis_stretches)) = (thesis.ratios_a(&target.muscles), thesis_stretches)
    else {
        return Ok(None);
    };
    let others: Vec<usize> = (0..measured).filter(|&m| m != target.reference).collect();
    let squares: f64 = others.iter().map(|&m| (ratios[m] - thesis_ratios[m]).powi(2)).sum();
    let rms = (squares / others.len() as f64).sqrt();
    Ok(Some(Published { thesis, ratios, stretches, thesis_ratios, thesis_stretches, rms }))
}
