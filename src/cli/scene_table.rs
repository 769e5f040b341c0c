//! Plans and results of scenes as text for a terminal of 100 columns.

use std::fmt::Write as _;

use tongue_fit::dynamics::MotionOutcome;
use tongue_fit::inner::report;
use tongue_fit::inner::scene::{ScenePlan, force_unit, run::SceneOutcome};

use super::sound;
use super::table::{self, align_left, newtons, rows};

const REASON: usize = 50;

pub fn plan(plan: &ScenePlan) -> String {
    let mut text = format!("{}\n{}\n{}\n\n", plan.title, plan.body, plan.method);
    let mut t = rows(&["effect", "", "elements", "µs", "why"], &plan.effects, |e| {
        let [mark, elements, cost] = if e.simulated {
            ["on".to_owned(), e.elements.to_string(), format!("{:.1}", e.estimated_us)]
        } else {
            ["-".to_owned(), String::new(), String::new()]
        };
        [e.effect.to_owned(), mark, elements, cost, report::wrap_text(&e.why, REASON).join("\n")]
    });
    align_left(&mut t, [4]);
    let _ = writeln!(text, "{t}\n");
    let mut t = rows(&["muscle", "", "why"], &plan.muscles, |m| {
        [m.muscle.as_str(), if m.contracting { "on" } else { "-" }, &m.why]
    });
    align_left(&mut t, [2]);
    if !plan.muscles.is_empty() {
        let _ = writeln!(text, "{t}\n");
    }
    let _ = writeln!(
        text,
        "{} unknowns ({} nodes in {}D); stiffness {} nonzeros, factor {}\n\
         µs: estimated for one iteration (energy, force, stiffness)\n\
         a factorisation: about {:.0} µs, {} operations, {}",
        plan.unknowns,
        plan.nodes,
        plan.dimension,
        plan.nonzeros,
        plan.factor_nonzeros,
        plan.estimated_factor_us,
        plan.factor_operations,
        if plan.factor_in_supernodes { "in supernodes (faer)" } else { "block by block" }
    );
    text
}

pub fn outcome(o: &SceneOutcome) -> String {
    let mut text = format!("{}\n{}\n{}\n\n", o.plan.title, o.plan.body, o.plan.method);
    let unit = force_unit(o.plan.dimension);
    if !o.muscles.is_empty() {
        let is_activated = o.plan.effect("hexahedra").is_some();
        let tension = if is_activated { "activation".to_owned() } else { format!("tension {unit}") };
        let interval = o.points.as_ref().map(|_| "95 % on this body");
        let columns: Vec<&str> = ["muscle", tension.as_str()]
            .into_iter()
            .chain(interval)
            .chain(["rest mm", "length mm", "stretch"])
            .collect();
        let t = rows(&columns, &o.muscles, |m| {
            let interval = m.interval_n.map(|[low, high]| format!("{low:.2} to {high:.2}"));
            let pull = m.pull.value();
            let pull = if is_activated { pull.to_string() } else { newtons(pull) };
            let [rest, length] = [m.rest_mm, m.length_mm].map(|v| format!("{v:.2}"));
            let end = [rest, length, format!("{:.3}", m.stretch)];
            [m.muscle.clone(), pull].into_iter().chain(interval).chain(end)
        });
        let _ = writeln!(text, "{t}\n");
    }
    if let Some(p) = &o.points {
        let muscles = o.plan.muscles.len();
        let _ = writeln!(
            text,
            "points met to {:.2} mm (RMS), {}; {} of {muscles} directions of tension are resolved, the others come from the prior\n",
            p.rms_mm.unwrap_or(f64::NAN),
            report::status_in_words(&p.status),
            p.resolved,
        );
    }
    if let Some(found) = &o.sound {
        text += &sound::formants(found, None);
    }
    let penetrated = o.contact.as_ref().is_some_and(|c| c.edge_through_wall);
    let verdict = match o.converged {
        true => "converged",
        false if penetrated => "PENETRATED (see below; do not trust the shape)",
        false => "NOT CONVERGED (do not trust the shape)",
    };
    let measure = if o.plan.dimension == 2 { "area" } else { "volume" };
    let _ = writeln!(
        text,
        "{verdict}, {:.2} ms; cells at {:.1} % to {:.1} % of their {measure} at rest, the whole at {:.2} %",
        1e3 * o.wall_s,
        100.0 * o.min_cell_ratio,
        100.0 * o.max_cell_ratio,
        100.0 * o.measure_ratio
    );
    if let Some(s) = &o.solution {
        text += table::connection_to_rest(s.connection);
    }
    text += &table::alarms(&o.alarms);
    if o.min_cell_ratio <= 0.0 {
        text += "A CELL IS INVERTED: springs alone do not prevent that; ask for effects.incompressibility = true\n";
    }
    text += &o.operation.as_ref().map_or_else(String::new, table::operation);
    if let Some(c) = &o.contact {
        let _ = writeln!(
            text,
            "{} nodes touch the wall and press on it with {} {unit}; the largest {:.2} {unit}; the closest at {:.3} mm",
            c.touching,
            vector(&c.on_wall_n),
            c.largest_n,
            c.closest_mm
        );
        if c.edge_through_wall {
            text += "PENETRATED: between two nodes the surface passes through a corner of the wall; refine the mesh\n";
        }
    }
    if let Some(force) = &o.on_bones_n {
        let _ = writeln!(text, "force of the body on the bones: {} {unit}", vector(force));
    }
    if let Some(t) = &o.trajectory {
        let MotionOutcome { status, time_s, counts } = t.outcome;
        let _ = writeln!(
            text,
            "{status:?} at {time_s} s: {} steps, {} rejected, {} factorisations",
            counts.steps, counts.rejected, counts.factorisations
        );
        text += &table::way_gone(time_s, t.part_of_way_to_equilibrium);
    }
    if let Some(s) = &o.solution {
        let _ = writeln!(
            text,
            "{} iterations, {} factorisations, {} energies; largest residual force {:.1e} {unit}\n",
            s.iterations, s.factorisations, s.energy_evaluations, s.max_residual_force
        );
    }
    if !o.time_by_effect.is_empty() {
        let whole = if o.trajectory.is_some() { "in all µs" } else { "in the solve µs" };
        let header = ["effect", "energy µs", "force µs", "stiffness µs", whole];
        let t = rows(&header, &o.time_by_effect, |e| {
            let each = [e.energy_us, e.force_us, e.stiffness_us, e.total_us];
            [e.effect.to_owned()].into_iter().chain(each.map(|us| format!("{us:.2}")))
        });
        let _ = writeln!(text, "{t}");
    }
    text
}

pub fn lengths_over_time(o: &SceneOutcome) -> report::Table {
    let lengths = o.muscles.iter().map(|m| format!("{}_mm", m.muscle));
    let rows = o.trajectory.iter().flat_map(|t| &t.moments).map(|m| {
        std::iter::once(m.time_s).chain(m.lengths_mm.iter().copied()).map(|v| v.to_string()).collect()
    });
    report::Table {
        columns: std::iter::once("time_s".to_owned()).chain(lengths).collect(),
        rows: rows.collect(),
    }
}

fn vector(v: &[f64]) -> String {
    format!("({})", report::joined(v.iter().map(|x| report::with_decimals(*x, 3)), ", "))
}
