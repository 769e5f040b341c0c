//! A table of measured muscle lengths, looked up by subject and vowel.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use super::record::{read, read_each};
use super::{Error, Lengths, Row, Vowel};
use crate::{files, suggest};

/// Takano and Honda (2007), from thesis table 4.4.
const REFERENCE: &str = include_str!("../../targets/takano2007_lengths.csv");
const REFERENCE_ORIGIN: &str = "targets/takano2007_lengths.csv (built in)";

/// Above this many subjects a message counts them instead of naming them all.
const NAMED_SUBJECTS: usize = 12;

/// Measured muscle lengths: at least one row, no subject and vowel twice.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    origin: String,
    rows: Vec<Row>,
    /// Row number of each vowel of each subject.
    index: BTreeMap<String, [Option<usize>; Vowel::COUNT]>,
}

impl Dataset {
    /// The built-in lengths of Takano and Honda (2007), thesis table 4.4: subjects S1 to S4, 19 rows (S4 has no
    /// /ɯ/).
    ///
    /// # Errors
    /// As [`Dataset::from_reader`]; a test holds that the built-in table has none.
    pub fn reference() -> Result<Self, Error> {
        Self::parse(REFERENCE.as_bytes(), REFERENCE_ORIGIN)
    }

    /// Reads the CSV file at `path`; see [`Dataset::from_reader`] for the format.
    ///
    /// # Errors
    /// [`Error::Unreadable`] or [`Error::Malformed`], naming the file as `path` shows it.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self, Error> {
        let origin = path.as_ref().display().to_string();
        let bytes =
            files::read(path).map_err(|source| Error::Unreadable { origin: origin.clone(), source })?;
        Self::parse(&bytes, &origin)
    }

    /// Reads a comma-separated table, UTF-8 without byte order mark and with LF line ends, whose header names, in
    /// any order, `subject`, `vowel` and the eight lengths in mm, `GGa_mm` to `HGp_mm`. A length is a decimal
    /// number from 10 to 200 (so that centimetres and metres are refused), and a subject and vowel may come
    /// once. Spaces around fields and blank lines are ignored. `origin` names the table in errors.
    ///
    /// # Errors
    /// [`Error::Unreadable`] when reading fails, [`Error::Malformed`] with line and column for everything else.
    ///
    /// # Example
    /// ```
    /// use tongue_fit::muscle::Muscle;
    /// use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions, Vowel};
    ///
    /// let table = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm\n\
    ///              X,ɯ,46,56,46,56,25,40,36,31\n\
    ///              X,a,38,57,50,54,21,47,33,33\n";
    /// let data = Dataset::from_reader(table.as_bytes(), "my.csv")?;
    /// let target = Target::new(&data, "X", Vowel::A, TargetKind::Stretch, &TargetOptions::default())?;
    /// assert_eq!(target.active, [Muscle::GGa, Muscle::SGp, Muscle::SGm, Muscle::HGa]); // shorter than in /ɯ/
    /// # Ok::<(), tongue_fit::measured::Error>(())
    /// ```
    pub fn from_reader(mut reader: impl Read, origin: &str) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        reader
            .read_to_end(&mut bytes)
            .map_err(|source| Error::Unreadable { origin: origin.to_owned(), source })?;
        Self::parse(&bytes, origin)
    }

    /// As [`Dataset::from_path`], but a broken row is left out and told in the second half of the answer, in file order. What is
    /// wrong with the file as a whole (encoding, line ends, header) still refuses it, and so does a table with no good row.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Malformed`] for the whole file, or for the first row where none is good.
    pub fn from_path_leaving_out_broken_rows(path: impl AsRef<Path>) -> Result<(Self, Vec<Error>), Error> {
        let origin = path.as_ref().display().to_string();
        let bytes =
            files::read(path).map_err(|source| Error::Unreadable { origin: origin.clone(), source })?;
        let mut broken = Vec::new();
        let rows = read_each(&bytes, &origin, &mut |e| {
            broken.push(e);
            Ok(())
        });
        match rows {
            Err(_) if !broken.is_empty() => Err(broken.swap_remove(0)),
            Err(e) => Err(e),
            Ok(rows) => Ok((Self::of(rows, &origin), broken)),
        }
    }

    fn parse(bytes: &[u8], origin: &str) -> Result<Self, Error> {
        Ok(Self::of(read(bytes, origin)?, origin))
    }

    fn of(rows: Vec<Row>, origin: &str) -> Self {
        let mut index = BTreeMap::<_, [Option<usize>; Vowel::COUNT]>::new();
        for (number, row) in rows.iter().enumerate() {
            let of_subject = index.entry(row.lengths.subject.clone()).or_default();
            of_subject[row.lengths.vowel.index()] = Some(number);
        }
        Self { origin: origin.to_owned(), rows, index }
    }

    /// Where the data came from: the path as given, or what [`Dataset::from_reader`] was told.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// All rows, in file order.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The subjects, in the order of their first rows.
    pub fn subjects(&self) -> Vec<&str> {
        let mut by_first_row: Vec<_> =
            self.index.iter().map(|(name, rows)| (rows.iter().flatten().min(), name.as_str())).collect();
        by_first_row.sort_unstable();
        by_first_row.into_iter().map(|(_, name)| name).collect()
    }

    /// The vowels that `subject` has a row for, in the order of [`Vowel::ALL`].
    ///
    /// # Errors
    /// [`Error::UnknownSubject`].
    pub fn vowels(&self, subject: &str) -> Result<Vec<Vowel>, Error> {
        let rows = self.of_subject(subject)?;
        Ok(Vowel::ALL.into_iter().filter(|v| rows[v.index()].is_some()).collect())
    }

    /// The lengths of `subject` saying `vowel`.
    ///
    /// # Errors
    /// [`Error::UnknownSubject`] with the nearest name, or [`Error::MissingRow`] with the vowels that exist.
    pub fn row(&self, subject: &str, vowel: Vowel) -> Result<&Lengths, Error> {
        self.find(subject, vowel)?.ok_or_else(|| Error::MissingRow {
            origin: self.origin.clone(),
            subject: subject.to_owned(),
            vowel,
            has: self.vowels(subject).unwrap_or_default(),
        })
    }

    /// The lengths that `subject`'s other vowels are compared with: its own /ɯ/, as in thesis 4.3.2.
    ///
    /// # Errors
    /// As [`Dataset::baseline_vowel`].
    pub fn baseline(&self, subject: &str) -> Result<&Lengths, Error> {
        self.baseline_vowel(subject, Vowel::U)
    }

    /// The lengths of `subject` in the baseline vowel `vowel`.
    ///
    /// # Errors
    /// [`Error::UnknownSubject`], or [`Error::MissingBaseline`] with the vowels to choose from instead.
    pub fn baseline_vowel(&self, subject: &str, vowel: Vowel) -> Result<&Lengths, Error> {
        self.find(subject, vowel)?.ok_or_else(|| Error::MissingBaseline {
            origin: self.origin.clone(),
            subject: subject.to_owned(),
            vowel,
            has: self.vowels(subject).unwrap_or_default(),
        })
    }

    fn find(&self, subject: &str, vowel: Vowel) -> Result<Option<&Lengths>, Error> {
        let number = self.of_subject(subject)?[vowel.index()];
        Ok(number.and_then(|n| self.rows.get(n)).map(|row| &row.lengths))
    }

    fn of_subject(&self, subject: &str) -> Result<&[Option<usize>; Vowel::COUNT], Error> {
        self.index.get(subject).ok_or_else(|| {
            let known = self.subjects();
            let hint = match suggest::nearest(subject, known.iter().copied()) {
                Some(near) if known.len() > NAMED_SUBJECTS => {
                    format!("did you mean \"{near}\"? (one of {} subjects)", known.len())
                }
                None if known.len() > NAMED_SUBJECTS => format!("it has {} other subjects", known.len()),
                _ => suggest::hint(subject, known.iter().copied()),
            };
            Error::UnknownSubject { origin: self.origin.clone(), name: subject.to_owned(), hint }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_table_is_that_of_the_thesis() {
        let data = Dataset::reference().unwrap();
        assert_eq!(data.rows().len(), 19);
        assert_eq!(data.subjects(), ["S1", "S2", "S3", "S4"]);
        let cells = |subject, vowel| data.row(subject, vowel).unwrap().length_mm;
        assert_eq!(cells("S1", Vowel::I), [47.0, 49.0, 49.0, 51.0, 28.0, 42.0, 38.0, 30.0]);
        assert_eq!(cells("S2", Vowel::A), [41.0, 62.0, 53.0, 59.0, 23.0, 44.0, 33.0, 35.0]);
        assert_eq!(cells("S4", Vowel::O), [35.0, 66.0, 59.0, 46.0, 28.0, 45.0, 23.0, 25.0]);
        assert_eq!(data.baseline("S2").unwrap().length_mm, [46.0, 60.0, 45.0, 59.0, 32.0, 42.0, 42.0, 31.0]);
        assert_eq!(data.vowels("S4").unwrap(), [Vowel::I, Vowel::E, Vowel::A, Vowel::O]);
    }

    #[test]
    fn what_is_not_there_is_told_with_what_is() {
        let data = Dataset::reference().unwrap();
        assert_eq!(
            data.row("S22", Vowel::A).unwrap_err().to_string(),
            "unknown subject \"S22\" in targets/takano2007_lengths.csv (built in); did you mean \"S2\"? (known: \
             S1, S2, S3, S4)"
        );
        assert_eq!(
            data.row("S4", Vowel::U).unwrap_err().to_string(),
            "S4 has no row for /ɯ/ in targets/takano2007_lengths.csv (built in); it has /i/, /e/, /a/, /o/"
        );
        assert!(matches!(data.baseline("S4"), Err(Error::MissingBaseline { has, .. }) if has.len() == 4));
        assert_eq!(data.baseline_vowel("S4", Vowel::E).unwrap().vowel, Vowel::E);
    }

    #[test]
    fn ten_thousand_subjects_are_counted_not_listed() {
        let header = REFERENCE.lines().next().unwrap();
        let rows: String = (0..10_000).map(|n| format!("P{n},a,47,49,49,51,28,42,38,30\n")).collect();
        let data = Dataset::from_reader(format!("{header}\n{rows}").as_bytes(), "many.csv").unwrap();
        assert_eq!(data.subjects()[9_999], "P9999");
        assert_eq!(
            data.row("p77x", Vowel::A).unwrap_err().to_string(),
            "unknown subject \"p77x\" in many.csv; did you mean \"P77\"? (one of 10000 subjects)"
        );
    }

    #[test]
    fn a_file_takes_the_place_of_the_built_in_table() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), REFERENCE).unwrap();
        let data = Dataset::from_path(file.path()).unwrap();
        assert_eq!(data.rows(), Dataset::reference().unwrap().rows());
        assert_eq!(data.origin(), file.path().display().to_string());

        let message = Dataset::from_path("no/such.csv").unwrap_err().to_string();
        assert!(message.starts_with("cannot read no/such.csv: "), "{message}");
    }
}
