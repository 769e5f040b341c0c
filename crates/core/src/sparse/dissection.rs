//! Nested dissection (George 1973): a few unknowns that separate the others into two halves are eliminated last, and each half is ordered
//! in the same way. Large meshes in space have less fill-in than by minimum degree.
//!
//! No coordinates are needed. Each unknown has a number, the difference of its distances to two far ends of the mesh, which is averaged
//! over neighbours until it varies as slowly as an eigenvector of the graph (Pothen, Simon and Liou 1990). The unknowns are split at the
//! number for which the separator is small.

use std::collections::BTreeSet;

/// Parts with at most this number of unknowns are ordered by minimum degree.
const LEAF: usize = 100;
const AVERAGED: usize = 30;
/// Number of pairs of far ends for which a part is split; the best split is taken.
const DIRECTIONS: usize = 3;
/// Splits that are tried: the part of the unknowns on one side, per cent.
const SPLITS: std::ops::RangeInclusive<usize> = 34..=66;

/// The order of elimination; `neighbours[i]` lists the unknowns coupled to `i`, without `i`.
pub fn nested_dissection(neighbours: &[Vec<u32>]) -> Vec<usize> {
    let mut graph = Graph { neighbours, inside: vec![false; neighbours.len()] };
    // The order from the last unknown that is eliminated to the first.
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

struct Separated {
    separator: Vec<usize>,
    halves: [Vec<usize>; 2],
}

struct Graph<'a> {
    neighbours: &'a [Vec<u32>],
    /// Whether each unknown belongs to the part that is being split.
    inside: Vec<bool>,
}

impl Graph<'_> {
    /// The unknowns of a small part in the order of minimum degree.
    fn leaf(&self, part: &[usize]) -> Vec<usize> {
        let number = |v: u32| part.binary_search(&(v as usize)).ok().map(|n| n as u32);
        let own = part.iter().map(|&v| self.neighbours[v].iter().filter_map(|&w| number(w)).collect());
        minimum_degree(own.collect()).into_iter().map(|i| part[i]).collect()
    }

    /// The unknowns of the part in the order of their distance from `from`, and the distance of each unknown, in couplings.
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

    /// Splits a part, whose unknowns are in ascending order.
    fn separated(&self, part: &[usize]) -> Separated {
        let (reached, _) = self.distances(part[0]);
        if reached.len() < part.len() {
            // The part consists of pieces that are not coupled, so it needs no separator.
            let reached = ascending(reached);
            let rest = part.iter().copied().filter(|v| reached.binary_search(v).is_err()).collect();
            return Separated { separator: Vec::new(), halves: [reached, rest] };
        }
        let all = Separated { separator: part.to_vec(), halves: [Vec::new(), Vec::new()] };
        let mut best = (f64::INFINITY, all);
        let mut from = reached[reached.len() - 1];
        let mut least = vec![u32::MAX; self.neighbours.len()];
        for _ in 0..DIRECTIONS {
            let (from_end, end_away) = self.distances(from);
            let (_, other_away) = self.distances(from_end[from_end.len() - 1]);
            // The next pair begins at the unknown that is farthest from the ends of the pairs before.
            part.iter().for_each(|&v| least[v] = least[v].min(end_away[v]).min(other_away[v]));
            from = part.iter().copied().max_by_key(|&v| least[v]).unwrap_or(from);
            let cut = self.cut(part, |v| f64::from(end_away[v]) - f64::from(other_away[v]));
            if cut.0 < best.0 {
                best = cut;
            }
        }
        best.1
    }

    /// The cheapest split of a part that is sorted by the averaged `along` of each unknown, with its cost.
    fn cut(&self, part: &[usize], along: impl Fn(usize) -> f64) -> (f64, Separated) {
        let mut at: Vec<f64> = vec![0.0; self.neighbours.len()];
        part.iter().for_each(|&v| at[v] = along(v));
        let mut averaged = vec![0.0; part.len()];
        for _ in 0..AVERAGED {
            for (mean, &v) in averaged.iter_mut().zip(part) {
                let near = self.neighbours[v].iter().map(|&w| w as usize).filter(|&w| self.inside[w]);
                let (sum, count) = near.fold((at[v], 1.0), |(s, n), w| (s + at[w], n + 1.0));
                *mean = sum / count;
            }
            // Averaging moves the numbers towards their mean, so they are scaled to the range from -1 to 1 again.
            let middle = averaged.iter().sum::<f64>() / part.len() as f64;
            let widest = averaged.iter().map(|a| (a - middle).abs()).fold(f64::MIN_POSITIVE, f64::max);
            part.iter().zip(&averaged).for_each(|(&v, a)| at[v] = (a - middle) / widest);
        }
        let mut sorted = part.to_vec();
        sorted.sort_by(|&a, &b| at[a].total_cmp(&at[b]).then(a.cmp(&b)));
        let mut rank = vec![usize::MAX; self.neighbours.len()];
        sorted.iter().enumerate().for_each(|(n, &v)| rank[v] = n);
        // Whether an unknown before the cut has a neighbour in the part after the cut.
        let touches = |v: usize, cut: usize| {
            self.neighbours[v].iter().any(|&w| self.inside[w as usize] && rank[w as usize] >= cut)
        };
        let cuts = SPLITS.step_by(2).map(|percent| (part.len() * percent / 100).max(1));
        let cost = |cut: usize| {
            let separator = sorted[..cut].iter().filter(|&&v| touches(v, cut)).count();
            separator as f64 * (1.0 + (cut as f64 / part.len() as f64 - 0.5).abs())
        };
        let priced = cuts.map(|cut| (cost(cut), cut)).min_by(|a, b| a.0.total_cmp(&b.0));
        let (cost, cut) = priced.unwrap_or((f64::INFINITY, 1));
        let (separator, below) = sorted[..cut].iter().partition(|&&v| touches(v, cut));
        let halves = [ascending(below), ascending(sorted[cut..].to_vec())];
        (cost, Separated { separator, halves })
    }
}

fn ascending(mut unknowns: Vec<usize>) -> Vec<usize> {
    unknowns.sort_unstable();
    unknowns
}

/// Exact minimum degree: eliminates the unknown with the fewest remaining neighbours in each step; of several it takes the lowest number,
/// so that the result is the same on every machine. Returns the unknowns in this order.
///
/// `neighbours[i]` lists the unknowns coupled to `i`, sorted, without `i`.
pub fn minimum_degree(mut neighbours: Vec<Vec<u32>>) -> Vec<usize> {
    let n = neighbours.len();
    let mut queue: BTreeSet<(usize, usize)> =
        neighbours.iter().enumerate().map(|(i, a)| (a.len(), i)).collect();
    let mut order = Vec::with_capacity(n);
    let mut merged: Vec<u32> = Vec::new();
    while let Some((_, i)) = queue.pop_first() {
        let front = std::mem::take(&mut neighbours[i]);
        for &j in &front {
            let j = j as usize;
            queue.remove(&(neighbours[j].len(), j));
            merge(&neighbours[j], &front, &mut merged);
            merged.retain(|&k| k as usize != i && k as usize != j);
            std::mem::swap(&mut neighbours[j], &mut merged);
            queue.insert((neighbours[j].len(), j));
        }
        order.push(i);
    }
    order
}

/// Writes the union of two sorted lists, sorted.
fn merge(a: &[u32], b: &[u32], union: &mut Vec<u32>) {
    union.clear();
    let (mut i, mut j) = (0, 0);
    while let (Some(&x), Some(&y)) = (a.get(i), b.get(j)) {
        union.push(x.min(y));
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    union.extend(&a[i..]);
    union.extend(&b[j..]);
}
