//! The order of elimination, chosen for little fill-in.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::amd;

use super::dissection::nested_dissection;
use super::minimum_degree::minimum_degree;

/// Numbers of unknowns, and of neighbours of each, above which the order is approximate, since exact degrees take longer than they save.
const MANY: usize = 300;
const MANY_NEIGHBOURS: usize = 20;
/// Number of unknowns above which the order is always approximate.
const VERY_MANY: usize = 20_000;

/// The order of elimination; `neighbours[i]` lists the unknowns coupled to `i`, sorted, without `i`. It is by exact degrees for bodies in
/// the plane and small ones; for large bodies in space by faer's approximate minimum degree (Amestoy, Davis and Duff 1996) or nested
/// dissection, whichever leaves less work.
pub fn order(neighbours: &[Vec<u32>]) -> Vec<usize> {
    let n = neighbours.len();
    let couplings: usize = neighbours.iter().map(Vec::len).sum();
    let is_large = n > VERY_MANY || (n > MANY && couplings > MANY_NEIGHBOURS * n);
    if !is_large {
        return minimum_degree(neighbours.to_vec());
    }
    let dissected = nested_dissection(neighbours);
    let by_degree = approximate_minimum_degree(neighbours);
    by_degree.filter(|other| work(neighbours, other) <= work(neighbours, &dissected)).unwrap_or(dissected)
}

/// The work of a factorisation in an order, in proportion: the squares of the numbers of rows below the diagonal.
fn work(neighbours: &[Vec<u32>], order: &[usize]) -> usize {
    rows_below(neighbours, order).iter().map(|rows| rows.len().pow(2)).sum()
}

/// faer's approximate minimum degree; `None` if its memory cannot be allocated.
fn approximate_minimum_degree(neighbours: &[Vec<u32>]) -> Option<Vec<usize>> {
    let n = neighbours.len();
    let (mut start, mut row) = (vec![0], Vec::new());
    for list in neighbours {
        row.extend(list.iter().map(|&i| i as usize));
        start.push(row.len());
    }
    let count = row.len();
    let matrix = SymbolicSparseColMat::new_checked(n, n, start, None, row);
    let (mut order, mut place) = (vec![0; n], vec![0; n]);
    let mut scratch = MemBuffer::try_new(amd::order_scratch::<usize>(n, count)).ok()?;
    let stack = MemStack::new(&mut scratch);
    amd::order(&mut order, &mut place, matrix.as_ref(), amd::Control::default(), stack).ok()?;
    Some(order)
}

/// The rows below the diagonal in each column of the factor, ascending, where rows and columns are places in the order: the later
/// neighbours of the unknown, and the rows of earlier columns in which it is the first row.
pub fn rows_below(neighbours: &[Vec<u32>], order: &[usize]) -> Vec<Vec<u32>> {
    let mut place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, &u)| place[u] = k as u32);
    let mut columns: Vec<Vec<u32>> = Vec::with_capacity(order.len());
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); order.len()];
    for (k, &u) in order.iter().enumerate() {
        let own = neighbours[u].iter().map(|&v| place[v as usize]);
        let of_children = children[k].iter().flat_map(|&child| columns[child].iter().copied());
        let mut rows: Vec<u32> = own.chain(of_children).filter(|&row| row as usize > k).collect();
        rows.sort_unstable();
        rows.dedup();
        if let Some(&parent) = rows.first() {
            children[parent as usize].push(k);
        }
        columns.push(rows);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_orders_fill_in_little_more_than_exact_minimum_degree() {
        // A grid of 7 by 9 nodes, each joined to its eight neighbours.
        let (rows, columns) = (7i32, 9i32);
        let grid: Vec<Vec<u32>> = Vec::from_iter((0..rows * columns).map(|i| {
            let (r, c) = (i / columns, i % columns);
            let near = (-1..=1).flat_map(move |a| (-1..=1).map(move |b| (r + a, c + b)));
            let inside = move |&(a, b): &(i32, i32)| {
                (0..rows).contains(&a) && (0..columns).contains(&b) && (a, b) != (r, c)
            };
            near.filter(inside).map(move |(a, b)| (a * columns + b) as u32).collect::<Vec<_>>()
        }));
        let order = minimum_degree(grid.clone());
        let fill = |order: &[usize]| rows_below(&grid, order).iter().map(Vec::len).sum::<usize>();
        for mut other in [approximate_minimum_degree(&grid).unwrap(), nested_dissection(&grid)] {
            assert!(fill(&other) < fill(&order) * 5 / 4);
            other.sort_unstable();
            assert_eq!(other, (0..grid.len()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_block_in_space_fills_in_less_by_nested_dissection() {
        // Two separate blocks of 16 by 12 by 10 nodes, each joined to its 26 neighbours.
        let sides = [16i32, 12, 10];
        let count = sides.iter().product::<i32>();
        let grid: Vec<Vec<u32>> = Vec::from_iter((0..2 * count).map(|n| {
            let (block, i) = (n / count, n % count);
            let at = [i % sides[0], i / sides[0] % sides[1], i / (sides[0] * sides[1])];
            let mut near = Vec::new();
            for by in (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).filter(|by| *by != [0; 3]) {
                let to: [i32; 3] = std::array::from_fn(|d| at[d] + by[d]);
                if (0..3).all(|d| (0..sides[d]).contains(&to[d])) {
                    near.push((block * count + to[0] + sides[0] * (to[1] + sides[1] * to[2])) as u32);
                }
            }
            near.sort_unstable();
            near
        }));
        let mut dissected = nested_dissection(&grid);
        let by_degree = approximate_minimum_degree(&grid).unwrap();
        let [by_halves, by_degree] = [&dissected, &by_degree].map(|order| work(&grid, order));
        assert!(by_halves < by_degree, "{by_halves} {by_degree}");
        assert_eq!(order(&grid), dissected);
        dissected.sort_unstable();
        assert!(dissected.into_iter().eq(0..grid.len()));
    }
}
