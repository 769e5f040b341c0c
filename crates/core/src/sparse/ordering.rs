//! The order of elimination, chosen for little fill-in.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::amd;

pub use super::dissection::{minimum_degree, nested_dissection};

/// Numbers of unknowns, and of neighbours of each, above which the order is approximate, since exact degrees take longer and leave more
/// work. Hexahedra have up to 26 neighbours, tetrahedra in a block about 12, quadratic triangles in the plane at most 10.5.
const MANY: [(usize, usize); 3] = [(300, 20), (1_000, 11), (20_000, 0)];

/// The order of elimination, and the rows below the diagonal in it; `neighbours[i]` lists the unknowns coupled to `i`, sorted, without `i`.
/// Bodies in the plane and small ones are ordered by exact minimum degree; large bodies in space by faer's approximate minimum degree
/// (Amestoy, Davis and Duff 1996) or nested dissection, whichever leaves less work.
pub fn order(neighbours: &[Vec<u32>]) -> (Vec<usize>, Vec<Vec<u32>>) {
    let with_rows = |order: Vec<usize>| {
        let rows = rows_below(neighbours, &order);
        (order, rows)
    };
    let n = neighbours.len();
    let couplings: usize = neighbours.iter().map(Vec::len).sum();
    let is_large = MANY.iter().any(|&(unknowns, each)| n > unknowns && couplings > each * n);
    if !is_large {
        return with_rows(minimum_degree(neighbours.to_vec()));
    }
    let dissected = with_rows(nested_dissection(neighbours));
    let by_degree = approximate_minimum_degree(neighbours).map(with_rows);
    by_degree.filter(|(_, rows)| work(rows) <= work(&dissected.1)).unwrap_or(dissected)
}

/// The work of a factorisation, in proportion: the squares of the numbers of rows below the diagonal.
pub fn work(rows_below: &[Vec<u32>]) -> usize {
    rows_below.iter().map(|rows| rows.len().pow(2)).sum()
}

/// faer's approximate minimum degree; `None` if its memory cannot be allocated.
pub fn approximate_minimum_degree(neighbours: &[Vec<u32>]) -> Option<Vec<usize>> {
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
