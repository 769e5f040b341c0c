//! Exact minimum degree, the order of elimination of small and medium meshes.

use std::collections::BTreeSet;

/// Eliminates the unknown with the fewest remaining neighbours in each step; of several it takes the lowest number, so that the result is
/// the same on every machine. Returns the unknowns in this order.
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
            merged.clear();
            merged
                .extend(neighbours[j].iter().chain(&front).filter(|&&k| k as usize != i && k as usize != j));
            // The stable sort merges the two sorted lists.
            merged.sort();
            merged.dedup();
            std::mem::swap(&mut neighbours[j], &mut merged);
            queue.insert((neighbours[j].len(), j));
        }
        order.push(i);
    }
    order
}
