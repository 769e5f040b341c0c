//! Labels of recordings that repeat, in tiers that distinguish: an interval that has the same label in every recording says nothing.

use tongue_input::measured::recording::Label;

/// A tier with no more labels than this is preferred to one with more.
const FEW: usize = 12;

/// The labels of a tier that repeat: for each its name, and the recording, beginning and end of every repetition, s.
pub(super) type Groups = Vec<(String, Vec<(usize, f64, f64)>)>;

/// Tiers with at least two labels that repeat, the one that is compared first: few labels before many, then most repetitions. A repetition
/// has at least so many frames; recordings are given by the times of their frames, s, and their labels.
pub(super) fn distinguishing(recordings: &[(Vec<f64>, &[Label])], fewest: usize) -> Vec<(String, Groups)> {
    let mut tiers: Vec<(String, Groups)> = Vec::new();
    for (number, (times, labels)) in recordings.iter().enumerate() {
        for label in labels.iter() {
            if times.iter().filter(|t| label.holds(**t)).count() < fewest {
                continue;
            }
            let tier = tiers.iter().position(|(name, _)| *name == label.tier).unwrap_or_else(|| {
                tiers.push((label.tier.clone(), Vec::new()));
                tiers.len() - 1
            });
            let (groups, place) = (&mut tiers[tier].1, (number, label.from_s, label.to_s));
            match groups.iter_mut().find(|(name, _)| *name == label.name) {
                Some((_, all)) => all.push(place),
                None => groups.push((label.name.clone(), vec![place])),
            }
        }
    }
    tiers.iter_mut().for_each(|(_, groups)| groups.retain(|(_, all)| all.len() > 1));
    tiers.retain(|(_, groups)| groups.len() > 1);
    let repetitions = |groups: &Groups| groups.iter().map(|(_, all)| all.len()).sum::<usize>();
    tiers.sort_by_key(|(_, groups)| (groups.len() > FEW, std::cmp::Reverse(repetitions(groups))));
    tiers
}
