//! Chains of a muscle from line elements in any order and direction.

use std::collections::{BTreeMap, BTreeSet};

/// Lines of which a part without ends runs through a node.
fn in_circle(node: u64) -> String {
    format!("runs in a circle through node {node}; a muscle is one chain with two ends: leave out one curve")
}

/// The nodes of `lines` from one end to the other. The chain begins at the end that is the start of a line;
/// if both or neither are, at the one with the lower tag.
///
/// # Errors
/// Why the lines of a muscle are no chain, to follow its name.
pub(super) fn chain(lines: &[[u64; 2]]) -> Result<Vec<u64>, String> {
    let mut neighbours: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for &[a, b] in lines {
        if a == b {
            return Err(in_circle(a));
        }
        neighbours.entry(a).or_default().insert(b);
        neighbours.entry(b).or_default().insert(a);
    }
    if let Some((&node, of)) = neighbours.iter().find(|(_, of)| of.len() > 2) {
        return Err(format!(
            "branches at node {node}, where {} of its lines meet; a muscle is one chain: leave out the curves that branch off",
            of.len()
        ));
    }
    let ends: Vec<u64> = neighbours.iter().filter(|(_, of)| of.len() == 1).map(|(n, _)| *n).collect();
    let (first, second) = match ends[..] {
        [first, second] => (first, second),
        [] => return Err(in_circle(neighbours.keys().next().copied().unwrap_or_default())),
        _ => {
            return Err(format!(
                "has gaps: it ends at the nodes {ends:?}; a muscle is one chain with two ends: add the curves between, or make two groups"
            ));
        }
    };
    let begins = |end: u64| lines.iter().any(|[a, _]| *a == end);
    let start = if begins(second) && !begins(first) { second } else { first };
    let mut chain = vec![start];
    let mut before = None;
    let mut at = start;
    while let Some(&next) = neighbours.get(&at).and_then(|of| of.iter().find(|n| Some(**n) != before)) {
        chain.push(next);
        before = Some(at);
        at = next;
    }
    let visited: BTreeSet<u64> = chain.iter().copied().collect();
    match neighbours.keys().find(|n| !visited.contains(n)) {
        Some(&node) => Err(in_circle(node)),
        None => Ok(chain),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_in_any_order_and_direction_become_one_chain() {
        assert_eq!(chain(&[[4, 9], [1, 4], [9, 2]]), Ok(vec![1, 4, 9, 2]));
        assert_eq!(
            chain(&[[4, 1], [9, 4], [9, 2]]),
            Ok(vec![1, 4, 9, 2]),
            "no end begins: the lower tag first"
        );
        assert_eq!(chain(&[[4, 1], [9, 4], [2, 9]]), Ok(vec![2, 9, 4, 1]), "as the lines run");
        assert_eq!(chain(&[[1, 2], [2, 1], [2, 3]]), Ok(vec![1, 2, 3]), "a line given twice is one");
    }

    #[test]
    fn lines_that_are_not_a_chain_are_distinguished() {
        for (lines, told) in [
            (&[[1, 2], [2, 3], [2, 4]][..], "branches at node 2, where 3 of its lines meet"),
            (&[[1, 2], [3, 4]], "has gaps: it ends at the nodes [1, 2, 3, 4]"),
            (&[[1, 2], [2, 3], [3, 1]], "runs in a circle through node 1"),
            (&[[1, 2], [5, 6], [6, 7], [7, 5]], "runs in a circle through node 5"),
            (&[[1, 1]], "runs in a circle through node 1"),
            (&[], "runs in a circle through node 0"),
        ] {
            let why = chain(lines).unwrap_err();
            assert!(why.starts_with(told), "{why}");
        }
    }
}
