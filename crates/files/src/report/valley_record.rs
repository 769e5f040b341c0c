//! The curve of tensions that meet a target as well as the answer, by muscle.

use serde::Serialize;

use super::ByMuscle;
use super::Table;
use super::by_muscle::{by, mm};
use tongue_infer::inverse;
use tongue_infer::inverse::valley::Valley;

/// All tensions that meet an undetermined target as well as the answer: points on a curve from end to end.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValleyRecord {
    pub points: Vec<ValleyPointRecord>,
    pub answer: usize,
    /// Why the curve ends before the first point and after the last.
    pub ends: [String; 2],
}

impl ValleyRecord {
    /// The record of a curve over `unknowns` in a body with these muscles; `of_body` selects their lengths
    /// from those of all chains.
    pub fn new(
        valley: &Valley,
        unknowns: &[String],
        muscles: &[String],
        of_body: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Self {
        let point = |p: &inverse::valley::ValleyPoint| ValleyPointRecord {
            tensions_n: by(unknowns, &p.x),
            lengths_mm: mm(muscles, &of_body(&p.lengths)),
            misfit: p.misfit,
            passive_rms: p.other_rms,
        };
        Self {
            points: valley.points.iter().map(point).collect(),
            answer: valley.answer,
            ends: valley.ends.map(|end| end.text(unknowns)),
        }
    }

    /// A row for each point: its number, tension and length of every muscle, misfit and passive residual.
    pub fn table(&self) -> Table {
        let Some(first) = self.points.first() else { return Table::default() };
        let tensions = first.tensions_n.0.iter().map(|(m, _)| format!("tension_{m}_n_per_m"));
        let lengths = first.lengths_mm.0.iter().map(|(m, _)| format!("{m}_mm"));
        let columns = ["point", "is_answer"].map(str::to_owned).into_iter().chain(tensions).chain(lengths);
        let columns = columns.chain(["misfit", "passive_rms"].map(str::to_owned)).collect();
        let row = |(number, p): (usize, &ValleyPointRecord)| {
            let values = p.tensions_n.0.iter().chain(&p.lengths_mm.0).map(|(_, v)| v.to_string());
            let first = [number.to_string(), (number == self.answer).to_string()];
            let rms = p.passive_rms.map(|r| r.to_string()).unwrap_or_default();
            first.into_iter().chain(values).chain([p.misfit.to_string(), rms]).collect()
        };
        Table { columns, rows: self.points.iter().enumerate().map(row).collect() }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValleyPointRecord {
    pub tensions_n: ByMuscle<f64>,
    pub lengths_mm: ByMuscle<f64>,
    pub misfit: f64,
    /// Root mean square residual of the other measured muscles, in the fitted quantity.
    pub passive_rms: Option<f64>,
}
