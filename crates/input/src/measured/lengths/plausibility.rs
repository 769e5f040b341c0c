//! Plausibility of a table of lengths: proportions and size of a tongue, and rows that cannot be of one speaker.

use std::collections::BTreeMap;

use super::read::DEFAULT_HALF_WIDTH_MM;
use super::{Dataset, Lengths, Row};
use crate::measured::muscles::Muscles;
use crate::measured::thesis::Thesis;
use tongue_core::statistics::{mean_and_variance, median};

/// Tables and rows with fewer muscles are not checked.
const FEWEST: usize = 5;

/// Name of a muscle, logarithm of the median of its lengths, and logarithm of its length at rest in the thesis (table 4.5), mm.
type MuscleColumn<'a> = (&'a str, f64, f64);

/// A doubt about the lengths (mm) of the muscles of a body: exchanged names, or a muscle or tongue of another size.
pub(crate) fn doubt_of_lengths<'a>(lengths_mm: impl Iterator<Item = (&'a str, f64)>) -> Option<String> {
    doubt_of_proportions(&columns(lengths_mm)?)
}

fn doubt_of_proportions(columns: &[MuscleColumn<'_>]) -> Option<String> {
    exchanged_names(columns)
        .or_else(|| muscle_of_another_size(columns))
        .or_else(|| tongue_of_another_size(columns))
}

/// All doubts about a table: numbers that are no lengths, exchanged names, a muscle or tongue of another size, repeated rows, and rows in
/// which all muscles are shorter or longer than in the baseline.
pub fn doubts(data: &Dataset) -> Vec<String> {
    if let Some(message) = percentages(data) {
        return vec![message];
    }
    let medians = data.muscles.iter().enumerate().filter_map(|(n, name)| {
        Some((name.as_str(), median(data.rows.iter().filter_map(|row| *row.lengths.length_mm.get(n)?))?))
    });
    let proportions =
        columns(medians).and_then(|columns| alike(&columns).or_else(|| doubt_of_proportions(&columns)));
    let proportions = proportions.into_iter().chain(without_unit(data));
    proportions.chain(repeated_rows(data)).chain(rows_of_another_size(data)).collect()
}

/// Doubts about columns that are left out although they have the names of published muscles.
fn without_unit(data: &Dataset) -> impl Iterator<Item = String> {
    let known = Muscles::built_in();
    let columns = data.reading.set_aside.iter();
    let named = columns.filter_map(move |column| {
        let muscle = known.all().iter().find(|m| m.name.eq_ignore_ascii_case(&column.name))?;
        Some((column, muscle.name.clone()))
    });
    let missing = named.filter(|(_, muscle)| !data.muscles.contains(muscle));
    missing.map(|(column, muscle)| {
        format!("the column {:?} is left out: {}; write {muscle}_mm", column.name, column.why)
    })
}

fn columns<'a>(lengths_mm: impl Iterator<Item = (&'a str, f64)>) -> Option<Vec<MuscleColumn<'a>>> {
    let thesis = Thesis::reference();
    let column = |(name, mm): (&'a str, f64)| Some((name, mm.ln(), thesis.row(name)?.rest_length_mm.ln()));
    let columns: Vec<MuscleColumn<'a>> = lengths_mm.filter_map(column).collect();
    (columns.len() >= FEWEST).then_some(columns)
}

/// A doubt if the largest number of every row is exactly 100.
fn percentages(data: &Dataset) -> Option<String> {
    let is_of_longest = data.rows.iter().all(|Row { lengths, .. }| {
        let longest = lengths.measured().map(|(_, mm)| mm).fold(0.0, f64::max);
        longest == 100.0 && lengths.measured().count() >= FEWEST
    });
    (is_of_longest && data.rows.len() > 1).then(|| {
        "the longest muscle of every row has exactly 100 mm, so these seem to be percentages of it: give lengths in millimetres".to_owned()
    })
}

/// A doubt if all muscles have nearly the same length. The logarithms of a tongue's lengths have a standard deviation of 0.31.
fn alike(columns: &[MuscleColumn<'_>]) -> Option<String> {
    const ALIKE: f64 = 0.1;
    (mean_and_variance(columns.iter().map(|c| c.1)).1.sqrt() < ALIKE).then(|| {
        "all muscles have nearly the same length, where the longest of a tongue is more than twice the shortest: give lengths in millimetres, not \
         percentages or other parts of a length"
            .to_owned()
    })
}

/// A doubt if the lengths would have the proportions of a tongue only under exchanged names. The standard deviation of the logarithm of
/// length over length at rest is 0.10 to 0.27 in published rows, and 0.28 to 0.65 where names are shifted or two are exchanged.
fn exchanged_names(columns: &[MuscleColumn<'_>]) -> Option<String> {
    const SPREAD: f64 = 0.27;
    const PART: f64 = 0.6;
    let count = columns.len();
    let spread = |at: &dyn Fn(usize) -> usize| {
        mean_and_variance((0..count).map(|n| columns[n].1 - columns[at(n)].2)).1.sqrt()
    };
    let as_named = spread(&|n| n);
    let shifts = (1..count).map(|by| {
        let columns_by = match by.min(count - by) {
            1 => "one column".to_owned(),
            by => format!("{by} columns"),
        };
        let message = format!(
            "are shifted by {columns_by}: {} seems to have the lengths of {}, and so on",
            columns[0].0, columns[by].0
        );
        (spread(&|n| (n + by) % count), message)
    });
    let pairs = (0..count).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| {
        let exchanged = spread(&|n| match n {
            n if n == a => b,
            n if n == b => a,
            n => n,
        });
        (exchanged, format!("{} and {} are exchanged", columns[b].0, columns[a].0))
    });
    let best = shifts.chain(pairs).min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, message) = best.filter(|(spread, _)| as_named > SPREAD && *spread < PART * as_named)?;
    Some(format!(
        "the lengths have the proportions of a tongue if the names of its muscles {message}; check them"
    ))
}

/// A doubt if a muscle differs from the median of all muscles by more than a factor of 2. The largest factor is 1.4 in published tables,
/// 1.7 in single rows.
fn muscle_of_another_size(columns: &[MuscleColumn<'_>]) -> Option<String> {
    const FACTOR: f64 = 2.0;
    let size = median(columns.iter().map(|c| c.1 - c.2))?;
    let out = columns.iter().map(|c| (c.0, c.1 - c.2 - size)).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (muscle, by) = out.filter(|(_, by)| by.abs() > FACTOR.ln())?;
    let (times, side) = (by.abs().exp(), if by > 0.0 { "long" } else { "short" });
    Some(format!(
        "compared with the other muscles {muscle} is {times:.1} times as {side} as in a tongue; check its unit and its name, since ratios depend on it"
    ))
}

/// A doubt if the tongue is much smaller or larger than an adult's. Published speakers are 0.97 to 1.12 times as large as the thesis's
/// tongue.
fn tongue_of_another_size(columns: &[MuscleColumn<'_>]) -> Option<String> {
    let times = mean_and_variance(columns.iter().map(|c| c.1 - c.2)).0.exp();
    (!(0.55..=1.6).contains(&times)).then(|| {
        format!("all muscles are {times:.1} times as long as an adult's; check the unit, and that it is not pixels")
    })
}

/// A doubt if two rows have the same length in every muscle. Rows rounded more coarsely than to 1 mm are not compared, because some
/// published ones are the same by chance.
fn repeated_rows(data: &Dataset) -> Option<String> {
    let mut firsts = BTreeMap::new();
    let rows =
        data.rows.iter().filter(|row| is_fine(&row.lengths) && row.lengths.measured().count() >= FEWEST);
    let twins = rows.filter_map(|row| {
        let lengths: Vec<_> = row.lengths.length_mm.iter().map(|mm| mm.map(f64::to_bits)).collect();
        let first = *firsts.entry(lengths).or_insert(row);
        let places = [first, row].map(|row| format!("{} on line {}", name(&row.lengths), row.line));
        (!std::ptr::eq(first, row)).then(|| places.join(" and "))
    });
    let twins: Vec<String> = twins.collect();
    let first = twins.first()?;
    let others = match twins.len() - 1 {
        0 => String::new(),
        more => format!(" (and {more} more)"),
    };
    Some(format!(
        "{first} have the same length in every muscle{others}, which no two measurements have: one seems to be a copy"
    ))
}

/// Whether no length is rounded more coarsely than to 1 mm.
fn is_fine(lengths: &Lengths) -> bool {
    lengths.half_width_mm.iter().all(|half| *half <= DEFAULT_HALF_WIDTH_MM)
}

/// A doubt if the mean logarithm of stretch in a row is more than 0.09, or 0.125 in rows rounded more coarsely than to 1 mm. A tongue keeps
/// its volume: in published rows it is -0.07 to 0.03 over the thesis's eight muscles (rounded to whole centimetres -0.12 to 0.04), and down
/// to -0.13 without one of them, so rows with fewer are not checked.
fn rows_of_another_size(data: &Dataset) -> Option<String> {
    const MUSCLES: usize = 8;
    let is_known: Vec<bool> =
        data.muscles.iter().map(|name| Thesis::reference().row(name).is_some()).collect();
    let mut changes: Vec<(&Lengths, &Lengths, f64)> = Vec::new();
    for subject in data.subjects() {
        let mut rows = data.of_subject(subject).ok()?.peekable();
        let Some(own) = data.baseline(subject).ok().or(rows.peek().copied()) else { continue };
        for row in rows {
            let both = row.length_mm.iter().zip(&own.length_mm).zip(&is_known).filter(|(_, known)| **known);
            let logs: Vec<f64> =
                both.filter_map(|((mm, own), _)| Some((mm.as_ref()? / own.as_ref()?).ln())).collect();
            let (mean, _) = mean_and_variance(logs.iter().copied());
            let largest = if is_fine(row) { 0.09 } else { 0.125 };
            if logs.len() >= MUSCLES && mean.abs() > largest {
                changes.push((row, own, mean));
            }
        }
    }
    let (row, own, mean) = changes.first()?;
    let others = match changes.len() - 1 {
        0 => String::new(),
        1 => " (and so in another row)".to_owned(),
        more => format!(" (and so in {more} more rows)"),
    };
    Some(format!(
        "in {} all muscles together are {:.0} % {} than in /{}/{others}; a tongue keeps its volume, and in published rows the difference is at most 7 %: \
         one of the two rows seems to have another scale",
        name(row),
        100.0 * (mean.exp() - 1.0).abs(),
        if *mean < 0.0 { "shorter" } else { "longer" },
        own.vowel
    ))
}

fn name(lengths: &Lengths) -> String {
    format!("{} /{}/", lengths.subject, lengths.vowel)
}
