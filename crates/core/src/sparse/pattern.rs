//! The blocks of the stiffness matrix and of its factor that can be nonzero, and where each is stored.

use std::ops::Range;

use super::ordering;

/// The place of a block in a [`super::BlockMatrix`], and whether the block is transposed there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot(u32);

impl Slot {
    const TRANSPOSED: u32 = 1 << 31;
    /// The value before a slot is looked up in a pattern.
    pub(crate) const UNBOUND: Self = Self(0);

    fn new(position: usize, transposed: bool) -> Self {
        Self(position as u32 | if transposed { Self::TRANSPOSED } else { 0 })
    }

    #[inline]
    pub(super) fn position(self) -> usize {
        (self.0 & !Self::TRANSPOSED) as usize
    }

    #[inline]
    pub(super) fn is_transposed(self) -> bool {
        self.0 & Self::TRANSPOSED != 0
    }
}

/// The numbering of the unknown nodes (elimination order) and the places of the factor's blocks.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// Number of each node as an unknown; `NONE` for other nodes.
    unknown: Vec<u32>,
    node: Vec<usize>,
    /// Column `j` occupies places `start[j]..start[j + 1]`, its diagonal block first, then ascending rows.
    start: Vec<usize>,
    row: Vec<u32>,
    /// Blocks left of the diagonal in row `i`, as `(column, place)` in ascending order: `row_start[i]..row_start[i + 1]`.
    row_start: Vec<usize>,
    row_blocks: Vec<(u32, u32)>,
    /// Number of off-diagonal blocks of the matrix, without fill-in.
    couplings: usize,
}

const NONE: u32 = u32::MAX;

impl Pattern {
    /// The pattern of `nodes` nodes, of which those with `is_unknown` are coupled within each of `cliques`; others there are ignored.
    pub fn new(nodes: usize, is_unknown: &[bool], cliques: &[Vec<usize>]) -> Self {
        let mut number = vec![NONE; nodes];
        let free: Vec<usize> = (0..nodes).filter(|&i| is_unknown[i]).collect();
        for (u, &i) in free.iter().enumerate() {
            number[i] = u as u32;
        }
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); free.len()];
        for clique in cliques {
            for &a in clique {
                for &b in clique {
                    if number[a] != NONE && number[b] != NONE && a != b {
                        neighbours[number[a] as usize].push(number[b]);
                    }
                }
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        let couplings = neighbours.iter().map(Vec::len).sum::<usize>() / 2;

        let (order, rows_below) = ordering::order(&neighbours);
        let node: Vec<usize> = order.iter().map(|&u| free[u]).collect();
        let mut unknown = vec![NONE; nodes];
        for (k, &i) in node.iter().enumerate() {
            unknown[i] = k as u32;
        }
        let mut start = vec![0];
        let mut row = Vec::new();
        let mut rows = vec![Vec::new(); order.len()];
        for (j, below) in rows_below.into_iter().enumerate() {
            row.push(j as u32);
            for i in below {
                rows[i as usize].push((j as u32, row.len() as u32));
                row.push(i);
            }
            start.push(row.len());
        }
        let mut row_start = vec![0];
        let mut row_blocks = Vec::with_capacity(row.len() - order.len());
        for list in rows {
            row_blocks.extend(list);
            row_start.push(row_blocks.len());
        }
        Self { unknown, node, start, row, row_start, row_blocks, couplings }
    }

    pub fn unknowns(&self) -> usize {
        self.node.len()
    }

    /// Number of blocks in the lower triangle of the factor, with the diagonal and fill-in.
    pub fn blocks(&self) -> usize {
        self.row.len()
    }

    /// Number of blocks in the lower triangle of the matrix, with the diagonal and without fill-in.
    pub fn matrix_blocks(&self) -> usize {
        self.couplings + self.node.len()
    }

    /// Number of scalar entries in one triangle of the factor, with fill-in, for blocks of `D x D`.
    pub fn factor_entries<const D: usize>(&self) -> usize {
        D * D * self.blocks() - D * (D - 1) / 2 * self.unknowns()
    }

    /// Number of floating-point operations of one factorisation, for blocks of `D x D`.
    pub fn factor_operations<const D: usize>(&self) -> usize {
        let columns = (0..self.unknowns()).map(|j| {
            let below = self.column(j).len() - 1;
            // A multiplication and an addition for each product of two blocks below the diagonal, and for the division of each by the
            // diagonal block.
            D * D * D * (below * (below + 1) + 2 * below + 1)
        });
        columns.sum()
    }

    #[inline]
    pub fn nodes(&self) -> &[usize] {
        &self.node
    }

    pub fn unknown(&self, node: usize) -> Option<usize> {
        let u = self.unknown[node];
        (u != NONE).then_some(u as usize)
    }

    /// Places of the blocks of column `j`: the diagonal block, then those below it.
    #[inline]
    pub fn column(&self, j: usize) -> Range<usize> {
        self.start[j]..self.start[j + 1]
    }

    /// Row (number of the unknown) of the block at a place.
    #[inline]
    pub fn row(&self, place: usize) -> usize {
        self.row[place] as usize
    }

    #[inline]
    pub(super) fn rows(&self, places: Range<usize>) -> &[u32] {
        &self.row[places]
    }

    /// `(column, place)` of the blocks left of the diagonal in row `i`.
    #[inline]
    pub(super) fn left_of(&self, i: usize) -> &[(u32, u32)] {
        &self.row_blocks[self.row_start[i]..self.row_start[i + 1]]
    }

    /// Where the block of nodes `a` (rows) and `b` (columns) is stored: the bin if a node is fixed or the two are not coupled.
    pub fn slot(&self, a: usize, b: usize) -> Slot {
        let bin = Slot::new(self.blocks(), false);
        let (Some(i), Some(j)) = (self.unknown(a), self.unknown(b)) else { return bin };
        let (low, high) = (i.min(j), i.max(j));
        let column = self.column(low);
        match self.row[column.clone()].binary_search(&(high as u32)) {
            Ok(p) => Slot::new(column.start + p, i < j),
            Err(_) => bin,
        }
    }

    /// The slots of all pairs of nodes in this order: those of the first node with itself and the others, of the second with itself and
    /// later ones, and so on.
    pub fn pair_slots<'a>(&'a self, nodes: &'a [usize]) -> impl Iterator<Item = Slot> + 'a {
        pairs(nodes.len()).map(|(a, b)| self.slot(nodes[a], nodes[b]))
    }
}

/// The pairs of so many nodes in the order of [`Pattern::pair_slots`].
pub(crate) fn pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |a| (a..count).map(move |b| (a, b)))
}
