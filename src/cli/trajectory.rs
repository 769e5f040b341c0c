//! `tongue-fit simulate --trajectory`: the body in motion.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, ensure};
use indicatif::ProgressBar;
use tongue_fit::body::Mesh;
use tongue_fit::dynamics::Curves;
use tongue_fit::effect::Configuration;
use tongue_fit::geometry::Point;
use tongue_fit::inner::dynamics::{
    self, Control, IntegrationMethod, Integrator, Motion, MotionStatus, SHORTEST_S, Tensions,
};
use tongue_fit::inner::inverse::alarms;
use tongue_fit::inner::limits::TOLERANCE_MM;
use tongue_fit::inner::report::{
    self, AnimationFrame, Export, Json, OutputDir, Provenance, Pvd, ReportError, StoTable, Table,
    TrajectoryRecord, Vtu,
};
use tongue_fit::inner::run::{STEP_ERROR_MM, SampledMotion};
use tongue_fit::measured::ByMuscle;
use tongue_fit::system::System;

use super::inputs::choice;
use super::invocation::stop_if_asked;
use super::{Global, Outcome, body, drive, output, table};

/// Fixed step of an explicit method, as a part of its stability limit.
const PART_OF_LIMIT: f64 = 0.9;
/// Times at which lengths are written, for each frame.
const LENGTHS_PER_FRAME: usize = 10;
const MOST_FRAMES: usize = 2000;
const LONGEST_RUN: Duration = Duration::from_secs(30 * 60);
const BAR_AFTER: Duration = Duration::from_secs(1);

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
#[command(next_help_heading = "Trajectory")]
pub struct Arguments {
    /// Follow the motion from rest over time instead of solving for the equilibrium; writes to --out [default: results]
    #[arg(long)]
    pub trajectory: bool,
    /// End of the motion, s
    #[arg(long, value_name = "S", default_value_t = 3.0, requires = "trajectory")]
    t_end: f64,
    /// Integrator
    #[arg(long, value_name = "NAME", value_parser = choice::<IntegrationMethod>(), default_value = "tr-bdf2", requires = "trajectory", hide_short_help = true)]
    method: IntegrationMethod,
    /// Fixed step, s [default: error control; 0.9 of the stability limit for verlet]
    #[arg(long, value_name = "S", requires = "trajectory", hide_short_help = true)]
    dt: Option<f64>,
    /// Largest error of a node in one step of tr-bdf2, mm [default: 1e-6]
    #[arg(long, value_name = "MM", requires = "trajectory", conflicts_with = "dt", hide_short_help = true)]
    tolerance: Option<f64>,
    /// Time in which the tensions grow to the values of --tension, s
    #[arg(long, value_name = "S", default_value_t = 0.0, requires = "trajectory", hide_short_help = true)]
    ramp: f64,
    /// Tensions over time instead of --tension: CSV with the columns time_s, GGa, ... (N per metre of thickness)
    #[arg(long, value_name = "FILE", requires = "trajectory", conflicts_with_all = ["tension", "emg", "ramp"], hide_short_help = true)]
    tension_curves: Option<PathBuf>,
    /// Number of frames for ParaView and the animation, with the first and the last time
    #[arg(long, value_name = "N", default_value_t = 31, requires = "trajectory", hide_short_help = true)]
    frames: usize,
    /// Run even beyond the stability limit, and however long it takes
    #[arg(long, requires = "trajectory", hide_short_help = true)]
    force: bool,
}

impl Arguments {
    fn check(&self) -> Result<()> {
        let is_time = |t: f64| t >= SHORTEST_S && t.is_finite();
        let Self { t_end, ramp, dt, frames, .. } = self;
        ensure!(
            is_time(*t_end),
            "--t-end is {t_end:?}; it must be a time in seconds, like 3, and at least {SHORTEST_S:e}"
        );
        ensure!(
            *ramp == 0.0 || is_time(*ramp),
            "--ramp is {ramp:?}; it must be a time in seconds: 0 for a step, or at least {SHORTEST_S:e}"
        );
        let dt_s = dt.unwrap_or(*t_end);
        ensure!(dt_s > 0.0 && dt_s.is_finite(), "--dt is {dt_s}; it must be a positive number of seconds");
        ensure!(
            *ramp <= *t_end,
            "--ramp is {ramp} s, longer than the motion (--t-end {t_end} s), so that the tensions would end below those of --tension"
        );
        ensure!(dt_s <= *t_end, "--dt is {dt_s} s, longer than the motion (--t-end {t_end} s)");
        let tolerance = self.tolerance.unwrap_or(STEP_ERROR_MM);
        TOLERANCE_MM.check(tolerance).map_err(|beyond| anyhow!("--tolerance: {beyond}"))?;
        ensure!((2..=MOST_FRAMES).contains(frames), "--frames is {frames}; take 2 to {MOST_FRAMES}");
        Ok(())
    }

    fn control(&self, motion: &Motion<'_, 2>) -> Control {
        match (self.dt, self.method.step_limit(motion)) {
            (Some(dt), _) => Control::Fixed(dt),
            (None, Some(limit)) if self.tolerance.is_none() => Control::Fixed(PART_OF_LIMIT * limit),
            (None, _) => Control::Adaptive(1e-3 * self.tolerance.unwrap_or(STEP_ERROR_MM)),
        }
    }

    /// The integrator, unless its step is beyond its limit or the run would take too long.
    fn integrator(&self, control: Control, motion: &Motion<'_, 2>) -> Result<Box<dyn Integrator<2>>> {
        let method = self.method;
        if self.force {
            return Ok(method.integrator(motion, control)?);
        }
        let mut integrator = method.checked_integrator(motion, control).map_err(|e| {
            anyhow!("{e}{}", if method.is_explicit() { " (--force runs it all the same)" } else { "" })
        })?;
        if let Control::Fixed(dt) = control {
            let cost = dynamics::cost_per_step(motion, integrator.as_mut(), &motion.at_rest(), self.t_end);
            let seconds = cost.as_secs_f64() * self.t_end / dt;
            ensure!(
                seconds <= LONGEST_RUN.as_secs_f64(),
                "{method} with a step of {dt:.2e} s would take about {} for {} s ({:.1e} steps of {:.1} us each): \
                     take --method tr-bdf2, which needs a few hundred steps (or --force to run it all the same)",
                output::duration(seconds),
                self.t_end,
                self.t_end / dt,
                cost.as_secs_f64() * 1e6
            );
        }
        Ok(method.integrator(motion, control)?)
    }
}

pub fn run(
    arguments: &Arguments,
    pulls: &drive::Arguments,
    body: &body::Arguments,
    global: &Global,
) -> Result<Outcome> {
    arguments.check()?;
    let method = arguments.method;
    let tongue = body.body()?;
    let given = pulls.tensions(&tongue)?;
    let (mesh, palate) = (tongue.mesh, tongue.palate.unwrap_or_default());
    let names = mesh.muscle_names();
    let Curves { muscles: active, tensions } = match &arguments.tension_curves {
        Some(file) => Curves::from_path(file, &names)?,
        None => {
            let mut to = vec![0.0; names.len()];
            given.iter().for_each(|(m, tension)| to[*m] = *tension);
            let muscles = given.iter().map(|(m, _)| *m).collect();
            Curves { muscles, tensions: Tensions::ramp(to, arguments.ramp) }
        }
    };
    let system = System::new(&mesh, &body.model(), &active)?;
    if let Some(file) = &arguments.tension_curves
        && let Some(last) = tensions.times.last().filter(|last| **last > arguments.t_end)
    {
        output::note(&format!(
            "the motion ends at {} s (--t-end), before the last time of {}, {last} s; its times are in seconds",
            arguments.t_end,
            file.display()
        ));
    }
    let motion = Motion::new(&system, tensions)?;
    let control = arguments.control(&motion);
    let mut integrator = arguments.integrator(control, &motion)?;
    let out = global.folder("results")?;

    output::step(|| format!("{method} with {control:?} over {} s", arguments.t_end));
    let (clock, t_end_s) = (Instant::now(), arguments.t_end);
    let kept = [(arguments.frames - 1) * LENGTHS_PER_FRAME + 1, LENGTHS_PER_FRAME];
    let mut bar: Option<ProgressBar> = None;
    let sampled = SampledMotion::follow(&motion, None, t_end_s, kept, integrator.as_mut(), &mut |time| {
        stop_if_asked();
        if bar.is_none() && clock.elapsed() > BAR_AFTER {
            let begun = output::bar(1000, "{bar:40} {percent:>3} %, {eta} left");
            bar = begun.ok().map(|bar| bar.with_elapsed(clock.elapsed()));
        }
        bar.iter().for_each(|bar| bar.set_position((1000.0 * time / t_end_s) as u64));
    });
    bar.iter().for_each(ProgressBar::finish_and_clear);
    let (outcome, state) = (sampled.outcome, &sampled.end);
    output::step(|| format!("{:?} after {} steps", outcome.status, outcome.counts.steps));
    let mut tensions = vec![0.0; system.muscle_count()];
    motion.tensions.write_at(state.time, &mut tensions);
    let at_the_end = Configuration { positions: &state.positions, tensions: &tensions };
    let (dt_s, tolerance_mm) = match control {
        Control::Fixed(dt) => (Some(dt), None),
        Control::Adaptive(tolerance) => (None, Some(tolerance * 1e3)),
    };
    let (min_area_ratio, max_area_ratio) = system.tissue_ratios(&state.positions);
    let strain = alarms::of_strain(&mesh, [min_area_ratio, max_area_ratio], &state.positions);
    let record = TrajectoryRecord {
        outcome,
        method,
        dt_s,
        tolerance_mm,
        t_end_s,
        part_of_way_to_equilibrium: sampled.part_of_way,
        guarded: system.barrier_active(at_the_end),
        lengths_mm: ByMuscle::new(&names, system.lengths(&state.positions).into_iter().map(|l| l * 1e3)),
        min_area_ratio,
        max_area_ratio,
        wall_s: clock.elapsed().as_secs_f64(),
    };
    let by = super::provenance().with_tissue(system.tissue());
    let written = write(&out, &record, &by, (&mesh, &palate), &motion, sampled)?;
    output::answer(global, &Json(&record), &by, &written, || table::trajectory(&record))?;
    Ok(match outcome.status {
        MotionStatus::Completed => {
            let alarms = alarms::barrier(record.guarded).into_iter().chain(strain);
            Outcome::of_reasons(alarms.map(|alarm| alarm.to_string()))
        }
        other => {
            Outcome::of_reasons([format!("the motion stopped early ({})", report::status_in_words(&other))])
        }
    })
}

fn write(
    out: &OutputDir,
    record: &TrajectoryRecord,
    by: &Provenance,
    (mesh, palate): (&Mesh<2>, &[Point]),
    motion: &Motion<'_, 2>,
    sampled: SampledMotion<2>,
) -> Result<Vec<PathBuf>> {
    let at = |time| {
        let mut tensions = vec![0.0; mesh.muscles.len()];
        motion.tensions.write_at(time, &mut tensions);
        tensions
    };
    let rows = sampled.lengths.into_iter().map(|(time, lengths)| [vec![time], lengths, at(time)].concat());
    let rows = rows.collect();
    let title = "tongue-fit: muscle lengths and tensions over time".to_owned();
    let sto = StoTable { title, labels: columns(mesh, "time", ["length_m", "tension_n_per_m"]), rows };
    let in_mm = 1..=mesh.muscles.len();
    let cells = sto.rows.iter().map(|row| row.iter().enumerate());
    let cells = cells
        .map(|row| row.map(|(i, v)| if in_mm.contains(&i) { v * 1e3 } else { *v }.to_string()).collect());
    let table = Table { columns: columns(mesh, "time_s", ["mm", "n_per_m"]), rows: cells.collect() };
    let frames = sampled.shapes.into_iter();
    let frames = frames.map(|(time, positions)| AnimationFrame { time, positions, tensions: at(time) });
    let frames: Vec<AnimationFrame> = frames.collect();
    let names: Vec<&str> = (0..mesh.muscles.len())
        .filter(|m| frames.iter().any(|f| f.tensions[*m] > 0.0))
        .map(|m| mesh.muscles[m].name.as_str())
        .collect();
    let title = if names.is_empty() {
        "At rest; nothing pulls".to_owned()
    } else {
        format!("Pulling: {} (grey: at rest)", names.join(", "))
    };
    let svg = report::animation(mesh, palate, &frames, &[], false, &title)?;
    let shapes = frames.iter().map(|f| {
        Ok(Vtu::new(mesh, &f.positions, &f.tensions)?.with_stresses(motion.system.stresses(&f.positions)))
    });
    let shapes = shapes.collect::<Result<Vec<_>, ReportError>>()?;
    let pvd =
        Pvd(frames.iter().enumerate().map(|(nth, f)| (f.time, format!("trajectory_{nth:04}.vtu"))).collect());
    let json = Json(record);
    let mut files: Vec<(&str, &dyn Export)> = vec![
        ("trajectory.json", &json),
        ("trajectory.csv", &table),
        ("trajectory.sto", &sto),
        ("trajectory.svg", &svg),
        ("trajectory.pvd", &pvd),
    ];
    files.extend(pvd.0.iter().zip(&shapes).map(|((_, name), vtu)| (name.as_str(), vtu as &dyn Export)));
    let mut written = out.export(&files, by)?;
    written.truncate(5);
    Ok(written)
}

/// The column of times, then those of the lengths of all muscles, then those of their tensions.
fn columns(mesh: &Mesh<2>, time: &str, names: [&str; 2]) -> Vec<String> {
    let of_muscles =
        names.into_iter().flat_map(|what| mesh.muscles.iter().map(move |m| format!("{}_{what}", m.name)));
    std::iter::once(time.to_owned()).chain(of_muscles).collect()
}
