//! Chains of a muscle from line elements in any order and direction.

use std::collections::{BTreeMap, BTreeSet};

/// Why lines do not form a chain, by node tags.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum NoChain {
    /// More than two lines meet at a node.
    Branch { node: u64, lines: usize },
    /// There are more than two ends.
    Gap { ends: Vec<u64> },
    /// A part without ends runs through this node.
    Loop { node: u64 },
}

/// The nodes of `lines` from one end to the other. The chain begins at the end that is the start of a line;
/// if both or neither are, at the one with the lower tag.
pub(super) fn chain(lines: &[[u64; 2]]) -> Result<Vec<u64>, NoChain> {
    let mut neighbours: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for &[a, b] in lines {
        if a == b {
            return Err(NoChain::Loop { node: a });
        }
        neighbours.entry(a).or_default().insert(b);
        neighbours.entry(b).or_default().insert(a);
    }
    if let Some((&node, of)) = neighbours.iter().find(|(_, of)| of.len() > 2) {
        return Err(NoChain::Branch { node, lines: of.len() });
    }
    let ends: Vec<u64> = neighbours.iter().filter(|(_, of)| of.len() == 1).map(|(n, _)| *n).collect();
    let (first, second) = match ends[..] {
        [first, second] => (first, second),
        [] => return Err(NoChain::Loop { node: neighbours.keys().next().copied().unwrap_or_default() }),
        _ => return Err(NoChain::Gap { ends }),
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
        Some(&node) => Err(NoChain::Loop { node }),
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
        assert_eq!(chain(&[[1, 2], [2, 3], [2, 4]]), Err(NoChain::Branch { node: 2, lines: 3 }));
        assert_eq!(chain(&[[1, 2], [3, 4]]), Err(NoChain::Gap { ends: vec![1, 2, 3, 4] }));
        assert_eq!(chain(&[[1, 2], [2, 3], [3, 1]]), Err(NoChain::Loop { node: 1 }));
        assert_eq!(chain(&[[1, 2], [5, 6], [6, 7], [7, 5]]), Err(NoChain::Loop { node: 5 }));
        assert_eq!(chain(&[[1, 1]]), Err(NoChain::Loop { node: 1 }));
        assert_eq!(chain(&[]), Err(NoChain::Loop { node: 0 }), "which no group of lines is");
    }
}
