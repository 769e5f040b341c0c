//! Orders of elimination and their fill-in.

use std::collections::BTreeSet;

use tongue_core::sparse::ordering::{
    approximate_minimum_degree, minimum_degree, nested_dissection, order, rows_below, work,
};

#[test]
fn a_star_is_eliminated_from_its_tips_without_fill() {
    // Node 0 is joined to nodes 1 to 5. If the tips are eliminated first, each column has one row, that of node 0.
    let mut neighbours = vec![vec![1, 2, 3, 4, 5]];
    neighbours.extend((1..=5).map(|_| vec![0]));
    let order = minimum_degree(neighbours.clone());
    assert_eq!(order[..4], [1, 2, 3, 4]);
    assert_eq!(rows_below(&neighbours, &order).concat().len(), 5);
}

/// The rows below the diagonal, by joining all later neighbours of each unknown that is eliminated.
fn eliminated_one_by_one(neighbours: &[Vec<u32>], order: &[usize]) -> Vec<Vec<u32>> {
    let place = |unknown: usize| order.iter().position(|&u| u == unknown).unwrap() as u32;
    let mut left: Vec<BTreeSet<u32>> =
        Vec::from_iter(order.iter().map(|&u| neighbours[u].iter().map(|&v| place(v as usize)).collect()));
    Vec::from_iter((0..order.len()).map(|k| {
        let later: Vec<u32> = left[k].iter().copied().filter(|&row| row as usize > k).collect();
        later.iter().for_each(|&row| left[row as usize].extend(&later));
        later
    }))
}

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
    assert_eq!(rows_below(&grid, &order), eliminated_one_by_one(&grid, &order));
    let fill = |order: &[usize]| rows_below(&grid, order).iter().map(Vec::len).sum::<usize>();
    for mut other in [approximate_minimum_degree(&grid).unwrap(), nested_dissection(&grid)] {
        assert!(fill(&other) < fill(&order) * 5 / 4);
        other.sort_unstable();
        assert_eq!(other, (0..grid.len()).collect::<Vec<_>>());
    }
}

/// Separate blocks of nodes; a node is joined to those of its 26 neighbours whose direction `joins` allows.
fn blocks(copies: i32, sides: [i32; 3], joins: fn([i32; 3]) -> bool) -> Vec<Vec<u32>> {
    let count = sides.iter().product::<i32>();
    Vec::from_iter((0..copies * count).map(|n| {
        let (block, i) = (n / count, n % count);
        let at = [i % sides[0], i / sides[0] % sides[1], i / (sides[0] * sides[1])];
        let ways = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        let mut near = Vec::new();
        for by in ways.filter(|by| *by != [0; 3] && joins(*by)) {
            let to: [i32; 3] = std::array::from_fn(|d| at[d] + by[d]);
            if (0..3).all(|d| (0..sides[d]).contains(&to[d])) {
                near.push((block * count + to[0] + sides[0] * (to[1] + sides[1] * to[2])) as u32);
            }
        }
        near.sort_unstable();
        near
    }))
}

#[test]
fn a_block_in_space_fills_in_less_by_nested_dissection() {
    let grid = blocks(2, [16, 12, 10], |_| true);
    let mut dissected = nested_dissection(&grid);
    let by_degree = approximate_minimum_degree(&grid).unwrap();
    let [by_halves, by_degree] = [&dissected, &by_degree].map(|order| work(&rows_below(&grid, order)));
    assert!(by_halves < by_degree, "{by_halves} {by_degree}");
    assert_eq!(order(&grid).0, dissected);
    dissected.sort_unstable();
    assert!(dissected.into_iter().eq(0..grid.len()));
}

#[test]
fn a_large_block_of_tetrahedra_is_ordered_with_less_work_than_by_exact_minimum_degree() {
    // Each cube is divided into six tetrahedra around one diagonal. Their edges lead from a node to the neighbours of which no coordinate
    // is smaller, and to those of which none is larger.
    let grid = blocks(1, [6, 26, 20], |by| by.iter().all(|d| *d >= 0) || by.iter().all(|d| *d <= 0));
    let [by_order, exact] =
        [order(&grid).0, minimum_degree(grid.clone())].map(|order| work(&rows_below(&grid, &order)));
    assert!(10 * by_order < 8 * exact, "{by_order} {exact}");
}
