//! `tongue-fit --vowel a`: one fit.

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueEnum;
use miette::{IntoDiagnostic, miette};
use tongue_fit::body::{Mesh, Point};
use tongue_fit::inverse::{self, Fit, Method, Settings, Status};
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
use tongue_fit::report::{self, Export, FitRecord, OutputDir, Section, Series, Svg};

use super::published::{self, Published};
use super::{Global, Outcome, body, output, table};

/// The folder for outputs where none is named.
const DEFAULT_OUT: &str = "results";
/// More starting points than this are surely a slip.
const MOST_STARTS: usize = 10_000;
/// The subject of the thesis's experiment.
const PUBLISHED_SUBJECT: &str = "S2";

/// Options of the fit.
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Fit")]
pub struct Arguments {
    /// Vowel to fit: i, e, a, o or ɯ (u is taken for ɯ)
    #[arg(long, value_name = "V")]
    vowel: Option<String>,
    /// Subject whose lengths are fitted
    #[arg(long, value_name = "NAME", default_value = PUBLISHED_SUBJECT)]
    subject: String,
    /// Quantity to hit: ratio (to GGa, as in the thesis) or stretch (to the subject's own /ɯ/)
    #[arg(long, value_name = "KIND", default_value = "ratio")]
    target: String,
    /// Contracting muscles in place of the rule "shorter than in /ɯ/", such as GGa,SGm,HGa
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    muscles: Option<Vec<String>>,
    /// Vowel taken as rest in place of ɯ
    #[arg(long, value_name = "V")]
    baseline: Option<String>,
    /// Measured lengths (CSV) in place of the built-in ones
    #[arg(long, value_name = "FILE")]
    lengths: Option<PathBuf>,
    /// What searches: the simplex of the thesis, or the derivatives of the equilibrium, which find the same tensions ten
    /// times faster (and are what batch takes)
    #[arg(long, value_enum, default_value = "nelder-mead")]
    method: MethodName,
    /// Number of starting points of the search
    #[arg(long, value_name = "N", default_value_t = Settings::default().starts)]
    starts: usize,
    /// Upper bound of every tension, N per metre of thickness
    #[arg(long, value_name = "N", default_value_t = Settings::default().upper_bound, allow_hyphen_values = true)]
    upper_bound: f64,
    #[command(flatten)]
    body: body::Arguments,
}

/// Names of [`Method`] on the command line.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum MethodName {
    NelderMead,
    GaussNewton,
}

impl std::fmt::Display for MethodName {
    /// As it is typed.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.to_possible_value().as_ref().map_or("", |v| v.get_name()))
    }
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::NelderMead => Self::NelderMead,
            MethodName::GaussNewton => Self::GaussNewton,
        }
    }
}

impl Arguments {
    /// Whether a fit was asked for.
    pub fn is_given(&self) -> bool {
        self.vowel.is_some()
    }

    fn target(&self) -> miette::Result<Target> {
        let vowel: Vowel = self.vowel.as_deref().unwrap_or_default().parse().into_diagnostic()?;
        let kind: TargetKind = self.target.parse().into_diagnostic()?;
        let baseline = self.baseline.as_deref().map(str::parse::<Vowel>).transpose().into_diagnostic()?;
        let data = match &self.lengths {
            Some(path) => Dataset::from_path(path),
            None => Dataset::reference(),
        };
        let options = TargetOptions { muscles: self.muscles.clone(), baseline };
        Target::new(&data.into_diagnostic()?, &self.subject, &vowel, kind, &options).into_diagnostic()
    }
}

/// Runs it.
pub fn run(arguments: &Arguments, global: &Global) -> miette::Result<Outcome> {
    let clock = Instant::now();
    if arguments.starts > MOST_STARTS {
        return Err(miette!("--starts is {}; more than {MOST_STARTS} gain nothing", arguments.starts));
    }
    let settings = Settings {
        method: arguments.method.into(),
        starts: arguments.starts,
        upper_bound: arguments.upper_bound,
        ..Settings::default()
    };
    settings.check().into_diagnostic()?;
    let target = arguments.target()?;
    let tongue = arguments.body.body()?;
    let mesh = &tongue.mesh;
    let palate = tongue.palate.as_deref().unwrap_or_default();
    let out =
        OutputDir::prepare(global.out.clone().unwrap_or_else(|| DEFAULT_OUT.into())).into_diagnostic()?;
    let model = arguments.body.model();
    output::step(|| {
        format!(
            "{} from {} starts for {} /{}/, {}; contracting: {}",
            arguments.method,
            settings.starts,
            target.subject,
            target.vowel,
            target.kind,
            target.active_names().join(", ")
        )
    });
    let fit = inverse::fit(mesh, &model, &target, &settings).into_diagnostic()?;
    output::step(|| format!("{:?}: misfit {:.1e}, {} equilibria", fit.status, fit.misfit, fit.evaluations));
    let published = match arguments.lengths {
        None => published::answer(mesh, &model, &fit.target)?,
        Some(_) => None,
    };

    let by = super::provenance().with_tissue(model.tissue);
    let record = FitRecord::new(&fit, by.clone(), clock.elapsed().as_secs_f64());
    let json = record.to_json().into_diagnostic()?;
    let csv = record.to_csv().into_diagnostic()?;
    let (picture, chart) = pictures(mesh, palate, &fit, published.as_ref())?;
    let files: [(&str, &dyn Export); 4] =
        [("fit.json", &json), ("fit.csv", &csv), ("tongue.svg", &picture), ("changes.svg", &chart)];
    let written = out.export(&files, &by).into_diagnostic()?;
    if global.json {
        output::print(&json)?;
    } else {
        let seconds = clock.elapsed().as_secs_f64();
        output::summary(&table::fit(&fit, published.as_ref(), &written, seconds), &written)?;
    }
    Ok(if fit.status == Status::Converged { Outcome::Good } else { Outcome::Untrustworthy })
}

/// The deformed mesh, and figure 4.9 of the thesis.
fn pictures(
    mesh: &Mesh<2>,
    palate: &[Point],
    fit: &Fit,
    published: Option<&Published>,
) -> miette::Result<(Svg, Svg)> {
    let target = &fit.target;
    let what = format!("{} /{}/", target.subject, target.vowel);
    let title = format!("{what}: at rest (grey) and at the tensions found");
    let section = Section {
        mesh,
        positions: &fit.positions,
        tensions: &fit.body_tensions,
        palate,
        contact: false,
        stretch: false,
        title: &title,
    };
    let picture = report::tongue(&section).into_diagnostic()?;
    let measured = target.muscles.len();
    let labels: Vec<String> = (0..measured)
        .map(|m| format!("{}{}", target.muscles[m], if fit.tensions[m] > 0.0 { "*" } else { "" }))
        .collect();
    let stretches =
        |lengths: &[f64], over: &[f64]| TargetKind::Stretch.values(lengths, over, target.reference);
    let mut series = vec![
        Series {
            name: format!("measured ({})", target.subject),
            values: stretches(&target.measured_mm, &target.baseline_mm),
        },
        Series {
            name: "simulated".into(),
            values: stretches(&fit.lengths[..measured], &fit.rest_lengths[..measured]),
        },
    ];
    if let Some(p) = published {
        series.push(Series { name: p.name(), values: p.stretches.clone() });
    }
    let title = format!("{what}: change of every muscle relative to /{}/", target.baseline);
    let chart = report::changes(&labels, &series, target.baseline.label(), &title).into_diagnostic()?;
    Ok((picture, chart))
}
