//! Records and tables as CSV.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use super::cells;
use super::export::{Export, Provenance};

/// Records as CSV: a column for each field, then `version`, `command` and, if it is known, `tissue`.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a, T>(pub &'a [T]);

impl<T: Serialize> Export for Rows<'_, T> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let mut writer = cells::writer(out);
        self.0.iter().try_for_each(|row| writer.serialize((row, by)))?;
        writer.flush()
    }
}

/// A CSV table whose columns are not known at compile time, such as those of muscles; then `version`,
/// `command` and, if it is known, `tissue`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Table {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

#[cfg(feature = "files")]
impl Table {
    pub fn csv(self) -> io::Result<String> {
        let mut out = Vec::new();
        super::column::lines(&mut out, std::iter::once(self.columns).chain(self.rows))?;
        String::from_utf8(out).map_err(io::Error::other)
    }
}

impl Export for Table {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        write(out, by, self.columns.iter().map(String::as_str), self.rows.iter())
    }
}

/// Writes a table row by row, with the provenance behind every row.
pub(super) fn write<'a>(
    out: &mut dyn Write,
    by: &Provenance,
    columns: impl Iterator<Item = &'a str>,
    rows: impl Iterator<Item = impl IntoIterator<Item = impl AsRef<[u8]>>>,
) -> io::Result<()> {
    let (names, values): (Vec<_>, Vec<_>) = by.entries().unzip();
    let mut writer = cells::writer(out);
    writer.write_record(columns.chain(names))?;
    for row in rows {
        row.into_iter().try_for_each(|cell| writer.write_field(cell))?;
        writer.write_record(&values)?;
    }
    writer.flush()
}

#[cfg(test)]
mod tests {
    use super::super::export::Json;
    use super::*;
    use tongue_core::system::TissueModel;

    #[derive(Serialize)]
    struct Row {
        muscle: &'static str,
        stretch: f64,
    }

    #[test]
    fn json_and_csv_say_who_made_them_and_keep_every_bit() {
        let by = Provenance::new("me, \"quoted\"").with_tissue(TissueModel::FiniteElement);
        let row = Row { muscle: "GGa", stretch: 0.1 + 0.2 };
        let json: serde_json::Value = serde_json::from_str(&Json(&row).text(&by).unwrap()).unwrap();
        assert_eq!(json["stretch"].as_f64(), Some(0.1 + 0.2));
        assert_eq!(
            (json["command"].as_str(), json["version"].as_str()),
            (Some(&*by.command), Some(crate::VERSION))
        );
        assert_eq!(json["tissue"], "finite_elements");
        let rows = Rows(&[row]).text(&by).unwrap();
        let table = Table {
            columns: ["muscle", "stretch"].map(String::from).to_vec(),
            rows: vec![vec!["GGa".into(), (0.1 + 0.2f64).to_string()]],
        };
        assert_eq!(rows, table.text(&by).unwrap());
        assert!(
            rows.starts_with("muscle,stretch,version,command,tissue,body\nGGa,0.30000000000000004,"),
            "{rows}"
        );
    }
}
