//! Curves, which Gmsh stores as lines of two nodes in any order and direction, joined to chains.

use std::collections::{BTreeMap, BTreeSet};

/// The neighbours of each node; a line from a node to itself is left out.
fn neighbours(lines: &[[u64; 2]]) -> BTreeMap<u64, BTreeSet<u64>> {
    let mut meeting: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for &[a, b] in lines.iter().filter(|[a, b]| a != b) {
        meeting.entry(a).or_default().insert(b);
        meeting.entry(b).or_default().insert(a);
    }
    meeting
}

/// Joins lines to runs, which end at nodes of the mesh and where one line or more than two meet.
pub(super) fn runs(lines: &[[u64; 2]], is_of_mesh: impl Fn(&u64) -> bool) -> Vec<Vec<u64>> {
    let meeting = neighbours(lines);
    let is_stop = |tag: &u64| is_of_mesh(tag) || meeting[tag].len() != 2;
    let mut seen: BTreeSet<[u64; 2]> = BTreeSet::new();
    let mut runs = Vec::new();
    let (stops, others): (Vec<u64>, Vec<u64>) = meeting.keys().copied().partition(&is_stop);
    // The lines that are on no run from a stop form circles, which may begin at any node.
    for start in stops.into_iter().chain(others) {
        for &next in &meeting[&start] {
            let mut run = vec![start];
            let (mut from, mut to) = (start, next);
            while seen.insert([from.min(to), from.max(to)]) {
                run.push(to);
                let on = meeting[&to].iter().copied().find(|n| *n != from);
                match on.filter(|_| !is_stop(&to)) {
                    Some(on) => (from, to) = (to, on),
                    None => break,
                }
            }
            if run.len() > 1 {
                runs.push(run);
            }
        }
    }
    runs
}

/// The nodes of a muscle from one end to the other. The chain begins at the end where a line starts; if that is none or both of them, at
/// the end with the lower tag. The error is the rest of a sentence that begins with the name of the muscle.
pub(super) fn chain(lines: &[[u64; 2]]) -> Result<Vec<u64>, String> {
    let help = "a muscle is one chain with two ends: leave out one curve";
    let in_circle = |node: u64| Err(format!("runs in a circle through node {node}; {help}"));
    if let Some([node, _]) = lines.iter().find(|[a, b]| a == b) {
        return in_circle(*node);
    }
    let meeting = neighbours(lines);
    if let Some((node, of)) = meeting.iter().find(|(_, of)| of.len() > 2) {
        let count = of.len();
        return Err(format!(
            "branches at node {node}, where {count} of its lines meet; a muscle is one chain: leave out the curves that branch off"
        ));
    }
    let ends: Vec<u64> = meeting.iter().filter(|(_, of)| of.len() == 1).map(|(n, _)| *n).collect();
    let mut runs = runs(lines, |_| false).into_iter();
    let (mut chain, second) = match (runs.next(), &ends[..]) {
        (Some(chain), [_, second]) => (chain, *second),
        (_, []) => return in_circle(meeting.keys().next().copied().unwrap_or_default()),
        _ => {
            return Err(format!(
                "has gaps: it ends at the nodes {ends:?}; a muscle is one chain with two ends: add the curves between, or make two groups"
            ));
        }
    };
    if lines.iter().any(|[a, _]| *a == second) && !lines.iter().any(|[a, _]| *a == chain[0]) {
        chain.reverse();
    }
    match runs.flatten().min() {
        Some(node) => in_circle(node),
        None => Ok(chain),
    }
}

pub(super) fn connected_components<T: Copy + Ord>(lines: &[[T; 2]]) -> Vec<Vec<[T; 2]>> {
    let mut components: Vec<(BTreeSet<T>, Vec<[T; 2]>)> = Vec::new();
    for &line in lines {
        let (joined, apart): (Vec<_>, Vec<_>) =
            components.into_iter().partition(|(nodes, _)| line.iter().any(|n| nodes.contains(n)));
        let mut component = (BTreeSet::from(line), vec![line]);
        for (nodes, lines) in joined {
            component.0.extend(nodes);
            component.1.extend(lines);
        }
        components = apart;
        components.push(component);
    }
    components.into_iter().map(|(_, lines)| lines).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_in_any_order_and_direction_become_one_chain_or_are_told_why_not() {
        for (lines, expected) in [
            (&[[4, 9], [1, 4], [9, 2]][..], Ok([1, 4, 9, 2])),
            // No line starts at an end, so the chain begins at the lower tag.
            (&[[4, 1], [9, 4], [9, 2]], Ok([1, 4, 9, 2])),
            // A line starts at the end 2, so the chain begins there.
            (&[[4, 1], [9, 4], [2, 9]], Ok([2, 9, 4, 1])),
            (&[[1, 2], [2, 1], [2, 3], [3, 4]], Ok([1, 2, 3, 4])),
            (&[[1, 2], [2, 3], [2, 4]], Err("branches at node 2, where 3 of its lines meet")),
            (&[[1, 2], [3, 4]], Err("has gaps: it ends at the nodes [1, 2, 3, 4]")),
            (&[[1, 2], [2, 3], [3, 1]], Err("runs in a circle through node 1")),
            (&[[1, 2], [5, 6], [6, 7], [7, 5]], Err("runs in a circle through node 5")),
            (&[[1, 1]], Err("runs in a circle through node 1")),
            (&[], Err("runs in a circle through node 0")),
        ] {
            match (chain(lines), expected) {
                (Ok(chain), Ok(expected)) => assert_eq!(chain, expected),
                (found, expected) => {
                    assert!(found.unwrap_err().starts_with(expected.unwrap_err()), "{lines:?}")
                }
            }
        }
    }

    #[test]
    fn lines_in_any_order_are_runs_between_nodes_of_the_mesh() {
        let mut found = runs(&[[3, 2], [1, 2], [3, 9], [9, 7], [7, 8]], |tag| [1, 9].contains(tag));
        found.sort();
        assert_eq!(found, [vec![1, 2, 3, 9], vec![8, 7, 9]]);
        assert_eq!(runs(&[[1, 2], [2, 3], [3, 1]], |_| false), [vec![1, 2, 3, 1]]);
    }
}
