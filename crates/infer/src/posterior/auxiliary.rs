//! Data other than muscle lengths: numbers that follow from shapes, such as distances of contour points, and muscle activity (EMG).

use std::sync::Arc;

use nalgebra::{DMatrix, SVector, stack};

use tongue_core::observe::Observable;

use crate::standard_deviations::{EMG, EMG_GAIN};

use super::parameters::{Parameter, ParameterValues};

/// Muscles whose activity was measured together in one posture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Active {
    /// Number of the posture; `None` for the baseline.
    pub posture: Option<usize>,
    /// Numbers of the muscles, whose mean tension an electrode measures.
    pub muscles: Vec<usize>,
}

/// Tension below which an electrode cannot tell pulling from rest, N per metre of thickness.
const LEAST_TENSION: f64 = 1.0;

impl Active {
    fn mean(&self, values: &ParameterValues) -> f64 {
        let tensions = &values.postures[self.index(values)].tensions;
        self.muscles.iter().map(|&m| tensions[m]).sum::<f64>() / self.muscles.len() as f64
    }

    fn index(&self, values: &ParameterValues) -> usize {
        self.posture.unwrap_or(values.postures.len() - 1)
    }

    /// Logarithm of one plus the mean tension over [`LEAST_TENSION`].
    pub(super) fn value(&self, values: &ParameterValues) -> f64 {
        (self.mean(values) / LEAST_TENSION).ln_1p()
    }

    pub(super) fn slope(&self, values: &ParameterValues, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Tension(posture, m) if posture == self.index(values) && self.muscles.contains(&m) => {
                1.0 / self.muscles.len() as f64 / (self.mean(values) + LEAST_TENSION)
            }
            _ => 0.0,
        }
    }
}

#[derive(Debug, Clone)]
pub struct PostureView {
    pub posture: Option<usize>,
    pub observables: Vec<Arc<dyn Observable<2>>>,
    /// Matrix that takes the observables to the numbers; `None` where these are the same.
    pub averages: Option<DMatrix<f64>>,
}

impl PostureView {
    pub(super) fn len(&self) -> usize {
        self.averages.as_ref().map_or(self.observables.len(), DMatrix::nrows)
    }

    fn values(&self, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let values = self.observables.iter().map(|observable| observable.value(positions));
        self.averaged(DMatrix::from_iterator(self.observables.len(), 1, values)).data.into()
    }

    /// Multiplies a matrix with one row for each observable by [`Self::averages`].
    pub(super) fn averaged(&self, of_observables: DMatrix<f64>) -> DMatrix<f64> {
        match &self.averages {
            None => of_observables,
            Some(averages) => averages * of_observables,
        }
    }

    /// The gradient of one of the numbers by the positions of the nodes.
    pub(super) fn gradient_of(&self, number: usize, positions: &[SVector<f64, 2>]) -> Vec<SVector<f64, 2>> {
        let mut by_node = vec![SVector::zeros(); positions.len()];
        for (i, observable) in self.observables.iter().enumerate() {
            let weight = match &self.averages {
                None => f64::from(u8::from(i == number)),
                Some(averages) => averages[(number, i)],
            };
            if weight != 0.0 {
                observable.gradient(positions, &mut |node, slope| by_node[node] += slope * weight);
            }
        }
        by_node
    }
}

/// What auxiliary numbers are computed from.
#[derive(Debug, Clone)]
pub enum DataSource {
    /// The shape of a posture, which gives one or more numbers.
    Shape(PostureView),
    /// Tensions, which give one number: their logarithm, so that an unknown gain is a summand.
    Activity(Active),
}

/// Where a number comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum NumberOrigin<'a> {
    /// A shape, numbered as in [`super::PosteriorModel::load`], and the place of the number among those of the shape: all lengths, then
    /// these numbers.
    Shape(usize, usize),
    Activity(&'a Active),
}

#[derive(Debug, Clone, Default)]
pub struct AuxiliaryData {
    pub sources: Vec<DataSource>,
    /// The measured numbers, source by source.
    pub measured: Vec<f64>,
    pub errors: DMatrix<f64>,
}

/// Relative activity below which an electrode cannot tell pulling from rest.
const LEAST_ACTIVITY: f64 = 0.025;

/// Numbers of an electrode's muscles, and the relative activity, 0 to 1, in each posture (`None`: in the baseline).
pub type Electrode = (Vec<usize>, Vec<(Option<usize>, f64)>);

impl AuxiliaryData {
    /// Muscle activity: its logarithm is that of the mean tension of the muscles plus that of the electrode's gain. An electrode with a
    /// single measurement contains no information and is left out.
    pub fn emg(electrodes: &[Electrode]) -> Self {
        let informative = electrodes.iter().filter(|(_, each)| each.len() > 1).enumerate();
        let rows = informative.flat_map(|(e, (muscles, each))| {
            each.iter()
                .map(move |&(posture, activity)| (e, Active { posture, muscles: muscles.clone() }, activity))
        });
        let rows: Vec<(usize, Active, f64)> = rows.collect();
        Self {
            measured: rows.iter().map(|(.., activity)| (activity / LEAST_ACTIVITY).ln_1p()).collect(),
            errors: DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
                let of_gain = if rows[i].0 == rows[j].0 { EMG_GAIN * EMG_GAIN } else { 0.0 };
                of_gain + if i == j { EMG * EMG } else { 0.0 }
            }),
            sources: rows.into_iter().map(|(_, active, _)| DataSource::Activity(active)).collect(),
        }
    }

    /// These data and then others, whose errors are independent of theirs.
    pub fn and(mut self, more: Self) -> Self {
        self.errors = stack![self.errors, 0; 0, more.errors];
        self.sources.extend(more.sources);
        self.measured.extend(more.measured);
        self
    }

    pub fn len(&self) -> usize {
        self.measured.len()
    }

    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
    }

    /// For every number its source, and its index in that.
    pub fn numbers(&self) -> impl Iterator<Item = (&DataSource, usize)> {
        self.sources.iter().flat_map(|source| {
            let count = if let DataSource::Shape(view) = source { view.len() } else { 1 };
            (0..count).map(move |number| (source, number))
        })
    }

    /// The origin of every number, for this number of postures and of lengths in a shape.
    pub(super) fn origins(&self, postures: usize, lengths: usize) -> impl Iterator<Item = NumberOrigin<'_>> {
        let mut next = vec![lengths; postures + 1];
        self.numbers().map(move |(source, _)| match source {
            DataSource::Activity(active) => NumberOrigin::Activity(active),
            DataSource::Shape(view) => {
                let index = view.posture.unwrap_or(postures);
                next[index] += 1;
                NumberOrigin::Shape(index, next[index] - 1)
            }
        })
    }

    /// All numbers, from the tensions and the positions of all nodes (m) in each posture (`None`: the baseline).
    pub fn values<'p>(
        &self,
        values: &ParameterValues,
        shape: impl Fn(Option<usize>) -> &'p [SVector<f64, 2>],
    ) -> Vec<f64> {
        let each = self.sources.iter().flat_map(|source| match source {
            DataSource::Shape(view) => view.values(shape(view.posture)),
            DataSource::Activity(active) => vec![active.value(values)],
        });
        each.collect()
    }

    /// The numbers that follow from the shape of one posture.
    pub(super) fn of_shape(&self, posture: Option<usize>, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let own = self.sources.iter().map(|source| match source {
            DataSource::Shape(view) if view.posture == posture => view.values(positions),
            _ => Vec::new(),
        });
        own.flatten().collect()
    }
}
