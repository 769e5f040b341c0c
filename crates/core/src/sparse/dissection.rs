//! Nested dissection (George 1973): a few unknowns that separate the others into two halves are eliminated last, and each half is ordered
//! in the same way. Large meshes in space fill in less than by minimum degree.
//!
//! A half is found without coordinates: a number for each unknown, from its distances to two far ends of the mesh, is averaged over
//! neighbours until it varies slowly, as an eigenvector of the graph would (Pothen, Simon and Liou 1990), and the unknowns are split there
//! where the separator is small.

use super::ordering::minimum_degree;

/// Parts of at most as many unknowns are ordered by minimum degree.
const LEAF: usize = 100;
/// How often the number is averaged.
const AVERAGED: usize = 60;
/// Splits that are tried, as parts of the unknowns in per cent.
const SPLITS: std::ops::RangeInclusive<usize> = 34..=66;

/// The order of elimination; `neighbours[i]` lists the unknowns coupled to `i`, without `i` itself.
pub(super) fn nested_dissection(neighbours: &[Vec<u32>]) -> Vec<usize> {
    let mut graph = Graph { neighbours, inside: vec![false; neighbours.len()] };
    // From the last to be eliminated on.
    let mut backwards = Vec::with_capacity(neighbours.len());
    let mut parts: Vec<Vec<usize>> = vec![(0..neighbours.len()).collect()];
    while let Some(part) = parts.pop() {
        if part.len() <= LEAF {
            backwards.extend(graph.leaf(&part).into_iter().rev());
            continue;
        }
        part.iter().for_each(|&v| graph.inside[v] = true);
        let separated = graph.separated(&part);
        part.iter().for_each(|&v| graph.inside[v] = false);
        backwards.extend(separated.separator);
        parts.extend(separated.halves);
    }
    backwards.reverse();
    backwards
}

/// A part without its separator.
struct Separated {
    separator: Vec<usize>,
    halves: [Vec<usize>; 2],
}

struct Graph<'a> {
    neighbours: &'a [Vec<u32>],
    /// Whether an unknown belongs to the part at hand.
    inside: Vec<bool>,
}

impl Graph<'_> {
    /// A small part in the order of minimum degree.
    fn leaf(&self, part: &[usize]) -> Vec<usize> {
        let number = |v: u32| part.binary_search(&(v as usize)).ok().map(|n| n as u32);
        let own = |&v: &usize| self.neighbours[v].iter().filter_map(|&w| number(w)).collect();
        minimum_degree(part.iter().map(own).collect()).0.into_iter().map(|i| part[i]).collect()
    }

    /// Unknowns of the part in the order of their distance from one, and these distances.
    fn distances(&self, from: usize) -> (Vec<usize>, Vec<u32>) {
        let mut away = vec![u32::MAX; self.neighbours.len()];
        away[from] = 0;
        let (mut reached, mut next) = (vec![from], 0);
        while let Some(&v) = reached.get(next) {
            next += 1;
            for &w in &self.neighbours[v] {
                let w = w as usize;
                if self.inside[w] && away[w] == u32::MAX {
                    away[w] = away[v] + 1;
                    reached.push(w);
                }
            }
        }
        (reached, away)
    }

    /// Splits a part, whose unknowns ascend.
    fn separated(&self, part: &[usize]) -> Separated {
        let ascending = |mut unknowns: Vec<usize>| {
            unknowns.sort_unstable();
            unknowns
        };
        let (reached, _) = self.distances(part[0]);
        if reached.len() < part.len() {
            // It does not hang together, so nothing has to separate it.
            let reached = ascending(reached);
            let rest = part.iter().copied().filter(|v| reached.binary_search(v).is_err()).collect();
            return Separated { separator: Vec::new(), halves: [reached, rest] };
        }
        let (from_end, end_away) = self.distances(reached[reached.len() - 1]);
        let (_, other_away) = self.distances(from_end[from_end.len() - 1]);
        let mut at: Vec<f64> = vec![0.0; self.neighbours.len()];
        part.iter().for_each(|&v| at[v] = f64::from(end_away[v]) - f64::from(other_away[v]));
        let mut averaged = vec![0.0; part.len()];
        for _ in 0..AVERAGED {
            for (mean, &v) in averaged.iter_mut().zip(part) {
                let near = self.neighbours[v].iter().map(|&w| w as usize).filter(|&w| self.inside[w]);
                let (sum, count) = near.fold((at[v], 1.0), |(s, n), w| (s + at[w], n + 1.0));
                *mean = sum / count;
            }
            // It shrinks towards its mean, and is stretched again.
            let middle = averaged.iter().sum::<f64>() / part.len() as f64;
            let widest = averaged.iter().map(|a| (a - middle).abs()).fold(f64::MIN_POSITIVE, f64::max);
            part.iter().zip(&averaged).for_each(|(&v, a)| at[v] = (a - middle) / widest);
        }
        let mut sorted = part.to_vec();
        sorted.sort_by(|&a, &b| at[a].total_cmp(&at[b]).then(a.cmp(&b)));
        let mut rank = vec![usize::MAX; self.neighbours.len()];
        sorted.iter().enumerate().for_each(|(n, &v)| rank[v] = n);
        // Those before a cut that touch one behind it.
        let touching = |cut: usize| -> Vec<usize> {
            let beyond = |w: &u32| self.inside[*w as usize] && rank[*w as usize] >= cut;
            sorted[..cut].iter().copied().filter(|&v| self.neighbours[v].iter().any(beyond)).collect()
        };
        let uneven = |cut: usize| (cut as f64 / part.len() as f64 - 0.5).abs();
        let cuts = SPLITS.step_by(2).map(|percent| (part.len() * percent / 100).max(1));
        let cost = |cut: usize| touching(cut).len() as f64 * (1.0 + uneven(cut));
        let cut =
            cuts.map(|cut| (cost(cut), cut)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(1, |(_, cut)| cut);
        let separator = touching(cut);
        let below = sorted[..cut].iter().copied().filter(|v| !separator.contains(v)).collect();
        let halves = [ascending(below), ascending(sorted[cut..].to_vec())];
        Separated { separator, halves }
    }
}
