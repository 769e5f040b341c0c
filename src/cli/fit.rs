//! `tongue-fit --vowel a`: one fit.

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueEnum;
use miette::{IntoDiagnostic, miette};
use tongue_fit::body::Mesh;
use tongue_fit::inverse::{self, Fit, Method, Settings, Status};
use tongue_fit::measured::published::{self, Tables};
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
use tongue_fit::muscle::{Muscle, PerMuscle};
use tongue_fit::report::{self, Export, FitRecord, OutputDir, Section, Series, Svg};
use tongue_fit::statics::{self, Workspace};
use tongue_fit::system::{Model, System};

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
        let muscles = self
            .muscles
            .as_ref()
            .map(|names| names.iter().map(|n| n.parse::<Muscle>()).collect::<Result<Vec<_>, _>>())
            .transpose()
            .into_diagnostic()?;
        let data = match &self.lengths {
            Some(path) => Dataset::from_path(path),
            None => Dataset::reference(),
        };
        let options = TargetOptions { muscles, baseline };
        Target::new(&data.into_diagnostic()?, &self.subject, vowel, kind, &options).into_diagnostic()
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
    let mesh = arguments.body.mesh()?;
    let out =
        OutputDir::prepare(global.out.clone().unwrap_or_else(|| DEFAULT_OUT.into())).into_diagnostic()?;
    let model = arguments.body.model();
    output::step(|| {
        let contracting: Vec<&str> = target.active.iter().map(|m| m.name()).collect();
        format!(
            "{} from {} starts for {} /{}/, {}; contracting: {}",
            arguments.method,
            settings.starts,
            target.subject,
            target.vowel,
            target.kind,
            contracting.join(", ")
        )
    });
    let fit = inverse::fit(&mesh, &model, &target, &settings).into_diagnostic()?;
    output::step(|| format!("{:?}: misfit {:.1e}, {} equilibria", fit.status, fit.misfit, fit.evaluations));
    let published = match arguments.lengths {
        None => published_answer(&mesh, &model, &target)?,
        Some(_) => None,
    };

    let record = FitRecord::new(&fit, &super::command_line(), clock.elapsed().as_secs_f64());
    let json = record.to_json().into_diagnostic()?;
    let csv = record.to_csv().into_diagnostic()?;
    let (picture, chart) = pictures(&mesh, &fit, published.as_ref())?;
    let by = super::provenance().with_tissue(model.tissue);
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

/// The published answer, simulated here.
#[derive(Debug, Clone)]
pub struct Published {
    /// The tensions of thesis 4.4.1, N.
    pub tensions: PerMuscle<f64>,
    /// Simulated here: lengths to GGa.
    pub ratios: PerMuscle<f64>,
    /// Simulated here: lengths to rest.
    pub stretches: PerMuscle<f64>,
    /// Table 4.8: the thesis's own simulation, lengths to GGa.
    pub thesis_ratios: PerMuscle<f64>,
    /// The same as stretches of its own rest lengths, taking GGa as stretched as it is here.
    pub thesis_stretches: PerMuscle<f64>,
    /// Root mean square difference of the two over the seven ratios.
    pub rms: f64,
}

/// Solves the published tensions, where the target is the one that they were published for.
fn published_answer(mesh: &Mesh<2>, model: &Model, target: &Target) -> miette::Result<Option<Published>> {
    let muscles = published::TENSIONS_A_N.map(|(m, _)| m);
    if target.subject != PUBLISHED_SUBJECT
        || (target.vowel, target.baseline) != (Vowel::A, Vowel::U)
        || target.active != muscles
    {
        return Ok(None);
    }
    let numbers = inverse::muscle_numbers(mesh).into_diagnostic()?;
    let active: Vec<usize> = published::TENSIONS_A_N.iter().map(|(m, _)| numbers[m.index()]).collect();
    let system = System::new(mesh, model, &active).into_diagnostic()?;
    let mut tensions = [0.0; tongue_fit::muscle::COUNT];
    let mut all = vec![0.0; system.muscle_count()];
    for (m, tension) in published::TENSIONS_A_N {
        tensions[m.index()] = tension;
        all[numbers[m.index()]] = tension;
    }
    let mut workspace = Workspace::new(&system);
    let solution = statics::solve(&system, &mut workspace, &all, &statics::Settings::default());
    if solution.status != statics::Status::Converged {
        return Ok(None);
    }
    let lengths = numbers.map(|n| system.length(workspace.positions(), n));
    let rest = numbers.map(|n| system.length(system.rest(), n));
    let ratios = TargetKind::Ratio.values(&lengths, &rest);
    let stretches = TargetKind::Stretch.values(&lengths, &rest);
    let tables = Tables::reference().into_diagnostic()?;
    let thesis_ratios = tables.simulated_ratio_a;
    let gga_mm = stretches[Muscle::GGa.index()] * tables.rest_length_mm[Muscle::GGa.index()];
    let thesis_stretches =
        Muscle::ALL.map(|m| thesis_ratios[m.index()] * gga_mm / tables.rest_length_mm[m.index()]);
    let others = Muscle::ALL.into_iter().filter(|m| *m != Muscle::GGa);
    let squares: f64 = others.map(|m| (ratios[m.index()] - thesis_ratios[m.index()]).powi(2)).sum();
    let rms = (squares / 7.0).sqrt();
    Ok(Some(Published { tensions, ratios, stretches, thesis_ratios, thesis_stretches, rms }))
}

/// The published tensions in a few characters, for the legend.
fn published_name() -> String {
    let tensions = published::TENSIONS_A_N.map(|(_, t)| format!("{t:.1}"));
    format!("{} N", tensions.join("/"))
}

/// The deformed mesh, and figure 4.9 of the thesis.
fn pictures(mesh: &Mesh<2>, fit: &Fit, published: Option<&Published>) -> miette::Result<(Svg, Svg)> {
    let target = &fit.target;
    let numbers = inverse::muscle_numbers(mesh).into_diagnostic()?;
    let mut tensions = vec![0.0; mesh.muscles.len()];
    numbers.iter().zip(fit.tensions).for_each(|(&n, tension)| tensions[n] = tension);
    let what = format!("{} /{}/", target.subject, target.vowel);
    let title = format!("{what}: at rest (grey) and at the tensions found");
    let section = Section {
        mesh,
        positions: &fit.positions,
        tensions: &tensions,
        palate: &[],
        stretch: false,
        title: &title,
    };
    let picture = report::tongue(&section).into_diagnostic()?;
    let labels: Vec<String> = Muscle::ALL
        .iter()
        .map(|m| format!("{m}{}", if target.active.contains(m) { "*" } else { "" }))
        .collect();
    let of = TargetKind::Stretch;
    let mut series = vec![
        Series {
            name: format!("measured ({})", target.subject),
            values: of.values(&target.measured_mm, &target.baseline_mm).to_vec(),
        },
        Series { name: "simulated".into(), values: of.values(&fit.lengths, &fit.rest_lengths).to_vec() },
    ];
    if let Some(p) = published {
        series.push(Series { name: published_name(), values: p.stretches.to_vec() });
    }
    let title = format!("{what}: change of every muscle relative to /{}/", target.baseline);
    let chart = report::changes(&labels, &series, target.baseline.symbol(), &title).into_diagnostic()?;
    Ok((picture, chart))
}
