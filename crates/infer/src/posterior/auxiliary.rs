//! Data other than muscle lengths: numbers that follow from shapes, such as distances of contour points, and muscle activity (EMG).

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVectorView, SVector};

use tongue_core::observe::Observable;

use crate::standard_deviations::{EMG, EMG_GAIN};

use super::parameters::{Parameter, ParameterValues, SolvedPoint};

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
        let tensions = self.posture.map_or(&values.tones, |p| &values.postures[p].tensions);
        self.muscles.iter().map(|&m| tensions[m]).sum::<f64>() / self.muscles.len() as f64
    }

    /// Logarithm of one plus the mean tension over [`LEAST_TENSION`].
    fn value(&self, values: &ParameterValues) -> f64 {
        (self.mean(values) / LEAST_TENSION).ln_1p()
    }

    fn slope(&self, values: &ParameterValues, parameter: Parameter) -> f64 {
        let own = match (parameter, self.posture) {
            (Parameter::Tension(posture, m), Some(own)) if posture == own => m,
            (Parameter::Tone(m), None) => m,
            _ => return 0.0,
        };
        let part = if self.muscles.contains(&own) { 1.0 / self.muscles.len() as f64 } else { 0.0 };
        part / (self.mean(values) + LEAST_TENSION)
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
    fn len(&self) -> usize {
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

    /// Multiplies weights of the numbers by the transpose of [`Self::averages`].
    fn of_observables(&self, weights: &[f64]) -> Vec<f64> {
        match &self.averages {
            None => weights.to_vec(),
            Some(averages) => averages.tr_mul(&DVectorView::from(weights)).data.into(),
        }
    }
}

#[derive(Debug, Clone)]
pub enum DataSource {
    /// Shapes; the numbers are ordered view by view.
    Shapes(Vec<PostureView>),
    /// Tensions. Their logarithms are used, so that an unknown gain is a summand.
    Activity(Vec<Active>),
}

#[derive(Debug, Clone)]
pub struct AuxiliaryData {
    pub of: DataSource,
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
            of: DataSource::Activity(rows.iter().map(|(_, active, _)| active.clone()).collect()),
            measured: rows.iter().map(|(.., activity)| (activity / LEAST_ACTIVITY).ln_1p()).collect(),
            errors: DMatrix::from_fn(rows.len(), rows.len(), |i, j| {
                let of_gain = if rows[i].0 == rows[j].0 { EMG_GAIN * EMG_GAIN } else { 0.0 };
                of_gain + if i == j { EMG * EMG } else { 0.0 }
            }),
        }
    }

    pub fn len(&self) -> usize {
        self.measured.len()
    }

    pub fn is_empty(&self) -> bool {
        self.measured.is_empty()
    }

    /// Views of shapes, each with the range of its numbers.
    pub fn views(&self) -> impl Iterator<Item = (Range<usize>, &PostureView)> {
        let views = match &self.of {
            DataSource::Shapes(views) => views.as_slice(),
            DataSource::Activity(_) => &[],
        };
        views.iter().scan(0, |from, view| {
            let own = *from..*from + view.len();
            *from = own.end;
            Some((own, view))
        })
    }

    /// Posture whose shape a number follows from (`Some(None)`: the baseline); `None` where it follows from tensions.
    pub fn posture(&self, number: usize) -> Option<Option<usize>> {
        self.views().find(|(own, _)| own.contains(&number)).map(|(_, view)| view.posture)
    }

    /// All numbers, from the positions of all nodes (m) in each posture (`None`: the baseline); zero for those that follow from tensions.
    pub fn of_shapes<'p>(&self, shape: impl Fn(Option<usize>) -> &'p [SVector<f64, 2>]) -> Vec<f64> {
        match &self.of {
            DataSource::Shapes(views) => views.iter().flat_map(|v| v.values(shape(v.posture))).collect(),
            DataSource::Activity(all) => vec![0.0; all.len()],
        }
    }

    pub(super) fn of_shape(&self, posture: Option<usize>, positions: &[SVector<f64, 2>]) -> Vec<f64> {
        let own = self.views().filter(|(_, view)| view.posture == posture);
        own.flat_map(|(_, view)| view.values(positions)).collect()
    }

    /// Adds to `by_node` the derivatives of the sum of `weights` times the numbers by the positions in one posture.
    pub(super) fn gradient(
        &self,
        (posture, positions): (Option<usize>, &[SVector<f64, 2>]),
        weights: &[f64],
        by_node: &mut [SVector<f64, 2>],
    ) {
        for (own, view) in self.views().filter(|(_, view)| view.posture == posture) {
            for (observable, weight) in view.observables.iter().zip(view.of_observables(&weights[own])) {
                observable.gradient(positions, &mut |node, slope| by_node[node] += slope * weight);
            }
        }
    }

    pub(super) fn only(&self, number: usize) -> Vec<f64> {
        (0..self.len()).map(|n| f64::from(u8::from(n == number))).collect()
    }

    pub(super) fn values(&self, values: &ParameterValues, solved: &SolvedPoint) -> Vec<f64> {
        match &self.of {
            DataSource::Shapes(_) => self.of_shapes(|p| solved.shape(p.unwrap_or(solved.shapes.len() - 1)).0),
            DataSource::Activity(all) => all.iter().map(|active| active.value(values)).collect(),
        }
    }

    /// Derivative of the sum of `weights` times the numbers by a tension at fixed shapes.
    pub(super) fn slope(&self, values: &ParameterValues, weights: &[f64], parameter: Parameter) -> f64 {
        match &self.of {
            DataSource::Shapes(_) => 0.0,
            DataSource::Activity(all) => {
                all.iter().zip(weights).map(|(active, w)| w * active.slope(values, parameter)).sum()
            }
        }
    }
}
