//! The best solved candidates, kept as starts for their neighbours.

use nalgebra::SVector;

#[derive(Debug, Clone)]
pub(super) struct WarmStarts<const D: usize> {
    pub x: Vec<f64>,
    pub cost: f64,
    pub positions: Vec<SVector<f64, D>>,
}

/// The best candidates, as many as a simplex has corners.
#[derive(Debug, Clone)]
pub(super) struct BestKnown<const D: usize> {
    most: usize,
    list: Vec<WarmStarts<D>>,
}

impl<const D: usize> BestKnown<D> {
    pub fn new(dimension: usize) -> Self {
        Self { most: dimension + 1, list: Vec::with_capacity(dimension + 1) }
    }

    /// Keeps the candidate in place of the worst, if it is among the best.
    pub(crate) fn remember(&mut self, x: &[f64], cost: f64, positions: &[SVector<f64, D>]) {
        if self.list.len() < self.most {
            self.list.push(WarmStarts { x: x.to_vec(), cost, positions: positions.to_vec() });
        } else if let Some(worst) = self.list.iter_mut().max_by(|a, b| a.cost.total_cmp(&b.cost))
            && cost < worst.cost
        {
            worst.x.copy_from_slice(x);
            worst.cost = cost;
            worst.positions.copy_from_slice(positions);
        }
    }

    pub fn best(&self) -> Option<&WarmStarts<D>> {
        self.list.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    pub fn nearest(&self, x: &[f64]) -> Option<&WarmStarts<D>> {
        let distance = |k: &WarmStarts<D>| distance_squared(&k.x, x);
        self.list.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Largest distance of a candidate from the best one, in units of the unknowns; infinite until there are
    /// as many as a simplex has corners.
    pub fn spread(&self) -> f64 {
        match self.best() {
            Some(best) if self.list.len() == self.most => {
                let distances = self.list.iter().map(|k| distance_squared(&k.x, &best.x));
                distances.fold(0.0, f64::max).sqrt()
            }
            _ => f64::INFINITY,
        }
    }

    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Removes all but the best, so that [`BestKnown::spread`] is that of a new simplex.
    pub(crate) fn keep_best(&mut self) {
        let best = self.best().cloned();
        self.list.clear();
        self.list.extend(best);
    }
}

/// Squared distance between candidates, in units of the unknowns.
pub(super) fn distance_squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}
