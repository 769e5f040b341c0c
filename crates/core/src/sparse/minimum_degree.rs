//! Exact minimum degree, the order of elimination of small and medium meshes.

use std::collections::BTreeSet;

/// Eliminates the unknown with the fewest remaining neighbours in each step; of several it takes the lowest number, so that the result is
/// the same on every machine. Returns the unknowns in this order.
///
/// `neighbours[i]` lists the unknowns coupled to `i`, sorted, without `i`. The cost is about that of one factorisation.
pub fn minimum_degree(mut neighbours: Vec<Vec<u32>>) -> Vec<usize> {
    let n = neighbours.len();
    let mut queue: BTreeSet<(usize, usize)> =
        neighbours.iter().enumerate().map(|(i, a)| (a.len(), i)).collect();
    let mut order = Vec::with_capacity(n);
    let mut merged = Vec::new();
    while let Some((_, i)) = queue.pop_first() {
        let front = std::mem::take(&mut neighbours[i]);
        for &j in &front {
            let j = j as usize;
            queue.remove(&(neighbours[j].len(), j));
            union_without(&neighbours[j], &front, [i as u32, j as u32], &mut merged);
            std::mem::swap(&mut neighbours[j], &mut merged);
            queue.insert((neighbours[j].len(), j));
        }
        order.push(i);
    }
    order
}

/// Writes the union of two sorted lists without the two numbers of `without` to `out`.
fn union_without(a: &[u32], b: &[u32], without: [u32; 2], out: &mut Vec<u32>) {
    out.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(x), Some(y)) => *x.min(y),
            (Some(x), None) => *x,
            (None, Some(y)) => *y,
            (None, None) => break,
        };
        i += usize::from(a.get(i) == Some(&next));
        j += usize::from(b.get(j) == Some(&next));
        if !without.contains(&next) {
            out.push(next);
        }
    }
}
