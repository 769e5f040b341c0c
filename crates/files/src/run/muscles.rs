//! The effect of each muscle of a body alone.

use serde_json::json;
use tongue_core::body::{Body, Mesh};
use tongue_core::geometry::Point;
use tongue_core::statics::SolveStatus;
use tongue_core::system::{Model, SpaceModel};
use tongue_infer::inverse::alarms::Alarm;

use super::equilibrium::Solved;
use crate::report::column::Column;
use crate::report::joined;
use crate::simulation::SimulationError;

#[derive(Debug, Clone)]
pub struct MuscleEffect {
    pub name: String,
    pub status: SolveStatus,
    pub alarms: Vec<Alarm>,
    pub stretch: f64,
    /// By how much the foremost, highest and rearmost node of the surface at rest move forward and up.
    pub moved_mm: [[f64; 2]; 3],
    /// In space, by how much wider the body becomes.
    pub wider_mm: Option<f64>,
    /// Positions of the nodes of the midsagittal section, m.
    pub positions: Vec<Point>,
    /// Tensions of all muscles, N per metre of thickness; empty in space.
    pub tensions: Vec<f64>,
    /// The tension of the muscle, N per metre of thickness, or in space its activation.
    pull: f64,
    /// Lengths of all muscles of the body at rest and now, m; empty in space.
    lengths_m: Vec<(String, [f64; 2])>,
}

impl MuscleEffect {
    /// The effect of the muscles of this name in the plane with a tension, N per metre of thickness.
    pub fn in_plane(
        body: &Body<2>,
        model: &Model,
        name: &str,
        tension: f64,
    ) -> Result<Self, SimulationError> {
        let given: Vec<(usize, f64)> = body.muscles_called(name).map(|m| (m, tension)).collect();
        let solved = Solved::in_plane(body, model, &given, false)?;
        let positions = &solved.positions;
        let lengths_m = Vec::from_iter(body.mesh.muscles.iter().enumerate().map(|(m, muscle)| {
            let both = [solved.system.rest(), positions].map(|x| solved.system.length(x, m));
            (muscle.name.clone(), both)
        }));
        let stretch = given.first().map_or(1.0, |&(m, _)| lengths_m[m].1[1] / lengths_m[m].1[0]);
        let alone = Self::new(name, tension, (&solved, body), stretch, (&body.mesh, positions));
        Ok(Self { tensions: solved.pulls, lengths_m, ..alone })
    }

    /// On the midsagittal `section` of the body, with the muscles of this name on both sides. For `tell` see [`Solved::in_space`].
    pub fn in_space(
        body: &Body<3>,
        model: &SpaceModel,
        section: &Mesh<2>,
        (name, activation): (&str, f64),
        tell: &dyn Fn(&str),
    ) -> Result<Self, SimulationError> {
        let activations = body.activations(&[(name, activation)])?;
        let solved = Solved::in_space(body, model, &activations, false, tell)?;
        let (rest, positions) = (&body.mesh.nodes, &solved.positions);
        let surface = body.mesh.surface_nodes();
        let [before_mm, after_mm] = [rest, positions].map(|x| {
            let sides = surface.iter().map(|&n| 1e3 * x[n].y);
            let [low, high] = sides.fold([0.0_f64; 2], |[low, high], y| [low.min(y), high.max(y)]);
            high - low
        });
        let first = body.both_sides(name)?[0];
        let [a, b] = body.mesh.muscles[first].ends();
        let stretch = (positions[b] - positions[a]).norm() / (rest[b] - rest[a]).norm();
        let flat = solved.midsagittal_positions();
        let alone = Self::new(name, activation, (&solved, body), stretch, (section, &flat));
        Ok(Self { wider_mm: Some(after_mm - before_mm), ..alone })
    }

    fn new<const D: usize>(
        name: &str,
        pull: f64,
        (solved, body): (&Solved<D>, &Body<D>),
        stretch: f64,
        (section, positions): (&Mesh<2>, &[Point]),
    ) -> Self {
        let surface = section.surface_nodes();
        let sides: [fn(&Point) -> f64; 3] = [|p| -p.x, |p| p.y, |p| p.x];
        let moved_mm = sides.map(|of| {
            let at_rest = |node: &usize| of(&section.nodes[*node]);
            let most = surface.iter().max_by(|a, b| at_rest(a).total_cmp(&at_rest(b)));
            let node = most.copied().unwrap_or_default();
            let way = positions[node] - section.nodes[node];
            [-1e3 * way.x, 1e3 * way.y]
        });
        Self {
            name: name.to_owned(),
            status: solved.equilibrium.solution.status,
            alarms: solved.alarms(body),
            stretch,
            moved_mm,
            wider_mm: None,
            positions: positions.to_vec(),
            tensions: Vec::new(),
            pull,
            lengths_m: Vec::new(),
        }
    }

    pub fn alarm_texts(&self) -> String {
        joined(&self.alarms, "; ")
    }

    /// A row for every muscle of the body; in space one for the muscle that contracts.
    pub fn rows(&self) -> Vec<EffectRow<'_>> {
        let own = self.lengths_m.is_empty().then(|| self.own());
        let each = self.lengths_m.iter().map(|muscle| EffectRow { alone: self, muscle: Some(muscle) });
        each.chain(own).collect()
    }

    pub fn own(&self) -> EffectRow<'_> {
        EffectRow { alone: self, muscle: None }
    }
}

/// The effect of one muscle on another one, which is given by its name and its lengths at rest and now, m, or on itself.
#[derive(Debug, Clone, Copy)]
pub struct EffectRow<'a> {
    alone: &'a MuscleEffect,
    muscle: Option<&'a (String, [f64; 2])>,
}

impl EffectRow<'_> {
    fn stretch(&self) -> f64 {
        self.muscle.map_or(self.alone.stretch, |(_, [rest, length])| length / rest)
    }

    /// The columns of `muscles.csv`; the terminal shows those with a heading.
    pub fn columns<'a>(in_space: bool) -> Vec<Column<'a, EffectRow<'a>>> {
        type RowColumn<'a> = Column<'a, EffectRow<'a>>;
        let pull = if in_space { ("activation", "") } else { ("tension_n_per_m", "N/m") };
        let mut columns: Vec<RowColumn<'a>> = vec![
            RowColumn::new("pulling", "", "the muscle that pulls alone", |r| r.alone.name.as_str().into()),
            RowColumn::new(pull.0, pull.1, "how hard it pulls", |r| r.alone.pull.into()).in_csv_alone(),
            RowColumn::new("status", "", "how the solve ended", |r| json!(r.alone.status)).in_csv_alone(),
        ];
        if !in_space {
            let length_mm = |end: usize| move |r: &EffectRow<'a>| json!(r.muscle.map(|m| 1e3 * m.1[end]));
            columns.extend([
                RowColumn::new("muscle", "", "a muscle of the body", |r| json!(r.muscle.map(|m| &m.0)))
                    .in_csv_alone(),
                RowColumn::new("rest_length_mm", "mm", "its length at rest", length_mm(0)).in_csv_alone(),
                RowColumn::new("length_mm", "mm", "its length", length_mm(1)).in_csv_alone(),
            ]);
        }
        columns.push(
            RowColumn::new("stretch", "", "its length over that at rest", |r| r.stretch().into())
                .with_heading("its length")
                .with_text(|r| format!("{:+.1} %", 100.0 * (r.stretch() - 1.0))),
        );
        let what = "displacement of the foremost, highest or rearmost point of the surface at rest";
        for (end, place) in ["tip", "top", "root"].into_iter().enumerate() {
            for (axis, way) in ["forward", "up"].into_iter().enumerate() {
                let heading = if axis == 0 { format!("{place} {way}") } else { way.to_owned() };
                let column = RowColumn::new(format!("{place}_{way}_mm"), "mm", what, move |r| {
                    r.alone.moved_mm[end][axis].into()
                });
                columns.push(column.with_heading(heading).with_number(tenths));
            }
        }
        if in_space {
            let wider =
                RowColumn::new("wider_mm", "mm", "how much wider the body is", |r| json!(r.alone.wider_mm));
            columns.push(wider.with_heading("wider").with_number(tenths));
        }
        columns.push(
            RowColumn::new("alarms", "", "reasons for doubt", |r| r.alone.alarm_texts().into())
                .in_csv_alone(),
        );
        columns
    }
}

/// A distance, mm, with its sign; zero has a plus.
fn tenths(mm: f64) -> String {
    format!("{:+.1} mm", (10.0 * mm).round() / 10.0 + 0.0)
}
