//! Statistics of lists.

/// The median, or the mean of the two middle values. `None` for an empty list.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut all: Vec<f64> = values.into_iter().collect();
    all.sort_by(f64::total_cmp);
    let upper = *all.get(all.len() / 2)?;
    Some(if all.len() % 2 == 1 { upper } else { 0.5 * (all[all.len() / 2 - 1] + upper) })
}

/// The first item with the least `number`. `None` for an empty list.
pub fn least_by<T>(items: impl IntoIterator<Item = T>, number: impl Fn(&T) -> f64) -> Option<T> {
    items.into_iter().min_by(|a, b| number(a).total_cmp(&number(b)))
}

/// The mean, and the mean square deviation from it; NaN for no values.
pub fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / count)
}

/// Half width of the 95 % interval of a normal distribution, in standard deviations.
pub const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// Half width of the 95 % interval of Student's distribution with at least two degrees of freedom (Abramowitz and Stegun 1964, eq. 26.7.5;
/// exact for two).
pub fn student_95(degrees: f64) -> f64 {
    if degrees < 2.5 {
        return 4.302_653;
    }
    let z = TWO_SIDED_95;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
            / 92_160.0,
    ];
    terms.iter().rev().fold(0.0, |sum, term| (sum + term) / degrees) + z
}

/// The items in groups of the same key; groups, and items within them, are in the order of appearance.
pub fn grouped<T, K: PartialEq>(items: impl IntoIterator<Item = T>, key: impl Fn(&T) -> K) -> Vec<Vec<T>> {
    let mut groups: Vec<Vec<T>> = Vec::new();
    for item in items {
        match groups.iter_mut().find(|group| key(&group[0]) == key(&item)) {
            Some(group) => group.push(item),
            None => groups.push(vec![item]),
        }
    }
    groups
}

/// Each item once, in the order of first appearance.
pub fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for item in items {
        if !all.contains(&item) {
            all.push(item);
        }
    }
    all
}
