//! Relative muscle activity (EMG) by vowel: a table with a row for each muscle and a column for each vowel.

use super::TableError;
use super::lengths::Vowel;
use super::muscles::Muscles;

/// The column that may give a muscle's own tension at activity 1.
const FULL: &str = "full_n_per_m";

/// Activity of muscles in vowels, relative to the largest of each muscle: 0 to 1, without a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Activity {
    origin: String,
    vowels: Vec<Vowel>,
    rows: Vec<Row>,
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    muscle: String,
    /// Tension at activity 1, N per metre of thickness.
    full: Option<f64>,
    /// One for each vowel; empty cells are `None`.
    activity: Vec<Option<f64>>,
}

/// What a row of the table says.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Name of the muscle or group.
    pub name: String,
    /// The muscles that it is of.
    pub muscles: Vec<usize>,
    /// Relative activity in each vowel that has one, 0 to 1.
    pub by_vowel: Vec<(Vowel, f64)>,
}

impl Activity {
    /// Reads a table whose first column is `muscle` and whose other columns are vowels. A column `full_n_per_m` may hold
    /// the tension of a muscle at activity 1, N per metre of thickness. Lines that begin with `#` are skipped.
    ///
    /// # Errors
    /// [`TableError`] for another format, a muscle or vowel given twice, and activity outside 0 to 1.
    pub fn read(text: &str, origin: &str) -> Result<Self, TableError> {
        let wrong = |problem: String| TableError::malformed(origin, None, problem);
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| wrong(e.to_string()))?.clone();
        if header.get(0).map(str::to_ascii_lowercase).as_deref() != Some("muscle") {
            return Err(wrong(
                "write a table whose first column is muscle and whose other columns are vowels".into(),
            ));
        }
        let mut vowels: Vec<Vowel> = Vec::new();
        for name in header.iter().skip(1).filter(|name| *name != FULL) {
            let vowel = Vowel::new(name).map_err(|e| wrong(format!("column \"{name}\": {e}")))?;
            if vowels.contains(&vowel) {
                return Err(wrong(format!("the column /{vowel}/ is there twice; keep one")));
            }
            vowels.push(vowel);
        }
        let mut rows: Vec<Row> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| wrong(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let muscle = record.get(0).unwrap_or_default().to_owned();
            if rows.iter().any(|row| row.muscle.eq_ignore_ascii_case(&muscle)) {
                return Err(wrong(format!(
                    "line {line}: {muscle} is given twice; keep one row of each muscle"
                )));
            }
            let mut row = Row { muscle, full: None, activity: Vec::new() };
            for (name, cell) in header.iter().zip(record.iter()).skip(1) {
                let number = (!cell.is_empty()).then(|| cell.parse::<f64>()).transpose().map_err(|_| {
                    wrong(format!(
                        "line {line}, column {name}: \"{cell}\" is not a number; write 0 to 1, like 0.6"
                    ))
                })?;
                if name == FULL {
                    row.full = number;
                } else if number.is_some_and(|a| !(0.0..=1.0).contains(&a)) {
                    return Err(wrong(format!(
                        "line {line}, column {name}: activity {cell} lies outside 0 to 1; divide by the largest of {}",
                        row.muscle
                    )));
                } else {
                    row.activity.push(number);
                }
            }
            if row.full.is_some_and(|full| !(full.is_finite() && full >= 0.0)) {
                return Err(wrong(format!(
                    "line {line}: {FULL} of {} must be finite and not negative",
                    row.muscle
                )));
            }
            rows.push(row);
        }
        if rows.is_empty() || vowels.is_empty() {
            return Err(wrong(
                "it has no muscle or no vowel; write a row for each muscle, a column for each vowel".into(),
            ));
        }
        Ok(Self { origin: origin.to_owned(), vowels, rows })
    }

    /// Tensions of a vowel: activity times the tension at activity 1, N per metre of thickness. A row is of the muscle of
    /// that name or, where `names` has none, of every portion of the muscle group of that name, such as `HG`. Returns
    /// positions in `names` with their tensions; muscles without a row, and empty cells, are left out.
    ///
    /// # Errors
    /// [`TableError`] for a vowel without a column, a muscle that `names` does not have, and a muscle that two rows give.
    pub fn tensions(
        &self,
        vowel: &Vowel,
        full: f64,
        names: &[String],
        muscles: &Muscles,
    ) -> Result<Vec<(usize, f64)>, TableError> {
        let wrong = |problem: String| TableError::malformed(&self.origin, None, problem);
        let portions = self.portions(names, muscles)?;
        let Some(column) = self.vowels.iter().position(|v| v == vowel) else {
            let known: Vec<String> = self.vowels.iter().map(|v| format!("/{v}/")).collect();
            return Err(wrong(format!("it has no column /{vowel}/; it has {}", known.join(", "))));
        };
        let mut out: Vec<(usize, f64)> = Vec::new();
        for (row, portions) in self.rows.iter().zip(portions) {
            let Some(activity) = row.activity.get(column).copied().flatten() else { continue };
            out.extend(portions.into_iter().map(|m| (m, activity * row.full.unwrap_or(full))));
        }
        Ok(out)
    }

    /// Activity by row and vowel, for each row the positions in `names` of the muscles that it is of: one, or all portions of a muscle
    /// group.
    ///
    /// # Errors
    /// [`TableError`] for a muscle that `names` does not have, and a muscle that two rows give.
    pub fn relative(&self, names: &[String], muscles: &Muscles) -> Result<Vec<Measured>, TableError> {
        let of_row = |(row, muscles): (&Row, Vec<usize>)| {
            let each = self.vowels.iter().zip(&row.activity);
            let by_vowel = each.filter_map(|(vowel, a)| Some((vowel.clone(), (*a)?))).collect();
            Measured { name: row.muscle.clone(), muscles, by_vowel }
        };
        Ok(self.rows.iter().zip(self.portions(names, muscles)?).map(of_row).collect())
    }

    /// Of every row the positions in `names` of its muscles.
    fn portions(&self, names: &[String], muscles: &Muscles) -> Result<Vec<Vec<usize>>, TableError> {
        let wrong = |problem: String| TableError::malformed(&self.origin, None, problem);
        let groups: Vec<String> = muscles.of(names).into_iter().map(|info| info.group).collect();
        let mut out: Vec<Vec<usize>> = Vec::new();
        for row in &self.rows {
            let called = |m: &usize| names[*m].eq_ignore_ascii_case(&row.muscle);
            let grouped = |m: &usize| groups[*m].eq_ignore_ascii_case(&row.muscle);
            let mut portions: Vec<usize> = (0..names.len()).filter(called).collect();
            if portions.is_empty() {
                portions = (0..names.len()).filter(grouped).collect();
            }
            if portions.is_empty() {
                return Err(wrong(format!(
                    "the body has no muscle {}; it has {}",
                    row.muscle,
                    names.join(", ")
                )));
            }
            if let Some(&twice) = portions.iter().find(|m| out.iter().flatten().any(|other| other == *m)) {
                return Err(wrong(format!(
                    "two rows give {}: one by its name, one by its group; keep one",
                    names[twice]
                )));
            }
            out.push(portions);
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "# mine\nmuscle,i,a,full_n_per_m\nGGa,0.2,,\nHG,0,0.5,40\nSGm,0.1,1,\n";

    fn tensions(table: &str, vowel: &str) -> Result<Vec<(usize, f64)>, TableError> {
        let muscles = Muscles::reference().unwrap();
        let names: Vec<String> = muscles.all().iter().map(|m| m.name.clone()).collect();
        Activity::read(table, "mine.csv")?.tensions(&Vowel::new(vowel).unwrap(), 30.0, &names, &muscles)
    }

    #[test]
    fn activity_times_full_tension_by_name_or_by_group() {
        // GGa has an empty cell; both portions of the hyoglossus have its row, with its own full tension.
        assert_eq!(tensions(TABLE, "a").unwrap(), [(6, 20.0), (7, 20.0), (4, 30.0)]);
        assert_eq!(tensions(TABLE, "i").unwrap(), [(0, 6.0), (6, 0.0), (7, 0.0), (4, 3.0)]);
    }

    #[test]
    fn bad_tables_are_told_with_line_and_column() {
        let told = |table: &str| tensions(table, "a").unwrap_err().to_string();
        assert!(told("muscle,a\nGGa,1.2\n").contains("line 2, column a: activity 1.2 lies outside 0 to 1"));
        assert!(told("muscle,a\nGGa,much\n").contains("\"much\" is not a number"));
        assert!(told("muscle,a\nGGa,1\ngga,1\n").contains("line 3: gga is given twice"));
        assert!(told("muscle,a\nHG,1\nHGa,1\n").contains("two rows give HGa"));
        assert!(told("muscle,a\nmasseter,1\n").contains("no muscle masseter"));
        assert!(told("muscle,o\nGGa,1\n").contains("no column /a/; it has /o/"));
        assert!(told("a,GGa\n1,1\n").contains("first column is muscle"));
        assert!(told("muscle,a\n").contains("no muscle or no vowel"));
        assert!(told("muscle,a,a\nGGa,1,1\n").contains("/a/ is there twice"));
        assert!(told("muscle,a,full_n_per_m\nGGa,1,-3\n").contains("full_n_per_m of GGa"));
    }
}
