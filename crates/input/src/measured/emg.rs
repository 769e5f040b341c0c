//! Relative muscle activity (EMG) by vowel: a table with a row for each muscle and a column for each vowel, in the formats of tables of
//! lengths.

use std::collections::BTreeMap;

use super::error::{Malformed, SourcePlace};
use super::lengths::Vowel;
use super::lengths::number::is_missing;
use super::lengths::text::clip;
use super::muscles::Muscles;
use super::table::{TableLine, TableLines};
use tongue_core::limits::TENSION;

/// Activity of muscles in vowels, relative to the largest of each muscle: 0 to 1, without a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Activity {
    origin: String,
    header: u64,
    vowels: Vec<Vowel>,
    rows: Vec<ActivityRow>,
}

#[derive(Debug, Clone, PartialEq)]
struct ActivityRow {
    line: u64,
    muscle: String,
    /// Tension at activity 1, N per metre of thickness.
    full: ActivityCell,
    activity: Vec<ActivityCell>,
}

/// `None` where nothing was measured.
type ActivityCell = Result<Option<f64>, Malformed>;

#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredActivity {
    pub name: String,
    pub muscles: Vec<usize>,
    /// Relative activity, 0 to 1, in each vowel in which it was measured.
    pub by_vowel: Vec<(Vowel, f64)>,
}

enum ActivityMeaning {
    Muscle,
    Full,
    /// A vowel, and the number of the column that stands for an activity of 1: 1 or 100.
    Activity(Vowel, f64),
}

fn meaning(name: &str) -> Option<ActivityMeaning> {
    let words = name.to_lowercase();
    let words: Vec<&str> =
        words.split(|c: char| !c.is_alphanumeric() && c != '%').filter(|w| !w.is_empty()).collect();
    match &words[..] {
        ["muscle" | "muskel" | "筋" | "筋肉"] => Some(ActivityMeaning::Muscle),
        ["full", "n", "per", "m"] | ["full", "n", "m"] => Some(ActivityMeaning::Full),
        [.., unit @ ("%" | "percent")] => {
            let label = name[..name.to_ascii_lowercase().rfind(unit)?].trim_end_matches([' ', '_', '(', '[']);
            Some(ActivityMeaning::Activity(Vowel::new(label).ok()?, 100.0))
        }
        _ => Some(ActivityMeaning::Activity(Vowel::new(name).ok()?, 1.0)),
    }
}

impl Activity {
    /// Reads a table with a column `muscle` and a column for each vowel, of activities from 0 to 1, or to 100 where the name of the column
    /// ends in `%`. A column `full_n_per_m` may have the tension of a muscle at activity 1, N per metre of thickness. Encodings,
    /// separators, decimal marks, a title and missing values are as in tables of lengths. A cell that is no activity is an error only where
    /// it is used.
    pub fn read(bytes: &[u8], origin: &str) -> Result<Self, Malformed> {
        let wanted = "muscle,i,a, then a line for each muscle with its activity in each vowel, 0 to 1";
        let mut cells = TableLines::read(bytes, origin, wanted, |name: &str| {
            matches!(meaning(name), Some(ActivityMeaning::Muscle | ActivityMeaning::Full))
        })?;
        let (mut of_muscle, mut of_full) = (None, None);
        let mut columns: Vec<(usize, Vowel, f64)> = Vec::new();
        for (field, meaning) in cells.header.cells.iter().map(meaning).enumerate() {
            let first = match meaning {
                None => None,
                Some(ActivityMeaning::Muscle) => of_muscle.replace(field),
                Some(ActivityMeaning::Full) => of_full.replace(field),
                Some(ActivityMeaning::Activity(vowel, unit)) => {
                    let first =
                        columns.iter().find(|(_, other, _)| *other == vowel).map(|(field, ..)| *field);
                    columns.push((field, vowel, unit));
                    first
                }
            };
            if let Some(first) = first {
                return Err(cells.twice(first, field));
            }
        }
        let (Some(of_muscle), false, false) = (of_muscle, columns.is_empty(), cells.rows.is_empty()) else {
            let lists = if cells.header.cells.iter().any(|name| name == "vowel") {
                "; a list of the active muscles of each vowel does not say how active they are"
            } else {
                ""
            };
            let what = format!("it has no column muscle, no vowel or no row; {}", cells.header_quoted());
            let help = "write a header like muscle,i,a and a row for each muscle with its activity, 0 to 1";
            return Err(cells.header.place(0).error(what, format!("{help}{lists}")));
        };
        cells.find_decimal_mark(columns.iter().map(|(field, ..)| *field));
        let (mut rows, mut lines) = (Vec::new(), BTreeMap::new());
        for line in &cells.rows {
            cells.check_shape(line)?;
            let (muscle, at) = (line.cell(of_muscle).to_owned(), line.place(of_muscle));
            if muscle.is_empty() || muscle.contains(char::is_control) {
                let what = format!("the muscle is {:?}", clip(&muscle));
                return Err(at.error(what, "give it a name, like GGa"));
            }
            if let Some(first) = lines.insert(muscle.to_ascii_lowercase(), line.at.line) {
                let what = format!("{muscle} is given twice, here and on line {first}");
                return Err(at.error(what, "keep one row of each muscle"));
            }
            let full = of_full.map_or(Ok(None), |field| cell(&cells, line, field, f64::INFINITY, 1.0));
            let activity =
                columns.iter().map(|(field, _, unit)| cell(&cells, line, *field, 1.0, *unit)).collect();
            rows.push(ActivityRow { line: line.at.line, full, activity, muscle });
        }
        let vowels = columns.into_iter().map(|(_, vowel, _)| vowel).collect();
        Ok(Self { origin: origin.to_owned(), header: cells.header.at.line, vowels, rows })
    }

    /// Tensions of a vowel, N per metre of thickness: activity times the tension at activity 1, which is that of the row or else `full`. A
    /// row is of the muscle of its name or, if `names` has none, of every portion of the muscle group of its name, such as `HG`. Returns
    /// positions in `names` with their tensions, without muscles that have no row or an empty cell.
    pub fn tensions(
        &self,
        vowel: &Vowel,
        full: Option<f64>,
        names: &[String],
    ) -> Result<Vec<(usize, f64)>, Malformed> {
        let portions = self.portions(names)?;
        let column = self.column(vowel).ok_or_else(|| {
            let known = Vowel::list(&self.vowels);
            self.at(self.header).error(format!("it has no column /{vowel}/"), format!("it has {known}"))
        })?;
        let mut out: Vec<(usize, f64)> = Vec::new();
        for (row, portions) in self.rows.iter().zip(portions) {
            let Some(activity) = row.activity[column].clone()? else { continue };
            let full = row.full.clone()?.or(full).ok_or_else(|| {
                let what = format!("{} has no tension at activity 1", row.muscle);
                self.at(row.line).error(what, "fill its cell of full_n_per_m, or give --full")
            })?;
            TENSION.check(full).map_err(|beyond| {
                let help = "give its tension at activity 1 in N per metre of thickness, like 30";
                self.at(row.line).error(format!("{}: {beyond}", row.muscle), help)
            })?;
            out.extend(portions.into_iter().map(|m| (m, activity * full)));
        }
        Ok(out)
    }

    fn column(&self, vowel: &Vowel) -> Option<usize> {
        let position = |is: fn(&Vowel, &Vowel) -> bool| self.vowels.iter().position(|v| is(v, vowel));
        position(Vowel::eq).or_else(|| position(Vowel::is_like))
    }

    /// The label that the table has for a vowel; upper and lower case may differ.
    pub fn label_of(&self, vowel: &Vowel) -> Option<&Vowel> {
        Some(&self.vowels[self.column(vowel)?])
    }

    /// Activities of each row, with the positions in `names` of its muscles: one, or all portions of a muscle group. Cells that are no
    /// activities are left out; [`Activity::bad_cells`] has them.
    pub fn relative(&self, names: &[String]) -> Result<Vec<MeasuredActivity>, Malformed> {
        let measured = self.rows.iter().zip(self.portions(names)?).map(|(row, muscles)| {
            let each = self.vowels.iter().zip(&row.activity);
            let by_vowel = each.filter_map(|(vowel, a)| Some((vowel.clone(), a.clone().ok()??))).collect();
            MeasuredActivity { name: row.muscle.clone(), muscles, by_vowel }
        });
        Ok(measured.collect())
    }

    /// Faults of the cells that are no activities, with their vowels.
    pub fn bad_cells(&self) -> impl Iterator<Item = (&Vowel, &Malformed)> {
        let cells = self.rows.iter().flat_map(|row| self.vowels.iter().zip(&row.activity));
        cells.filter_map(|(vowel, cell)| Some((vowel, cell.as_ref().err()?)))
    }

    fn at(&self, line: u64) -> SourcePlace<'_> {
        SourcePlace { origin: &self.origin, line, column: 1 }
    }

    fn portions(&self, names: &[String]) -> Result<Vec<Vec<usize>>, Malformed> {
        let groups: Vec<String> =
            Muscles::built_in().info(names).into_iter().map(|info| info.group).collect();
        let mut out: Vec<Vec<usize>> = Vec::new();
        for row in &self.rows {
            let alike = |all: &[String]| -> Vec<usize> {
                (0..names.len()).filter(|m| all[*m].eq_ignore_ascii_case(&row.muscle)).collect()
            };
            let portions = Some(alike(names)).filter(|all| !all.is_empty()).unwrap_or_else(|| alike(&groups));
            if portions.is_empty() {
                let what = format!("the body has no muscle {}", clip(&row.muscle));
                return Err(self.at(row.line).error(what, format!("it has {}", names.join(", "))));
            }
            if let Some(&twice) = portions.iter().find(|m| out.iter().flatten().any(|other| other == *m)) {
                let what = format!("two rows give {}: one by its name, one by its group", names[twice]);
                return Err(self.at(row.line).error(what, "keep one"));
            }
            out.push(portions);
        }
        Ok(out)
    }
}

/// The number in a cell divided by `unit`, which must be from 0 to `most`.
fn cell(cells: &TableLines<'_>, line: &TableLine<'_>, field: usize, most: f64, unit: f64) -> ActivityCell {
    let (name, text) = (cells.header.cell(field), line.cell(field));
    if is_missing(text) {
        return Ok(None);
    }
    let value = cells.number(line, field, "a number from 0 to 1")? / unit;
    if value.is_finite() && (0.0..=most).contains(&value) {
        return Ok(Some(value));
    }
    let (what, at) = (format!("{} is {}", clip(name), clip(text)), line.place(field));
    Err(if most.is_finite() {
        let help = "divide by the largest activity of the muscle, or end the column's name with (%)";
        at.error(format!("{what}, but an activity lies between 0 and 1"), help)
    } else {
        at.error(what, "write a finite tension that is not negative")
    })
}
