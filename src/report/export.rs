//! What all files have in common: each is written with who made it.

use std::io::{self, Write};

use serde::Serialize;

use crate::system::TissueModel;

/// Who made a file. Every exporter writes it in its format's way: fields of JSON, columns of CSV, metadata of SVG, an instruction of
/// VTK's XML, comments of Gmsh, header lines of OpenSim.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Provenance {
    /// Version of tongue-fit.
    pub version: &'static str,
    /// The command line, or what a program says of itself.
    pub command: String,
    /// What the tissue was made of, where there is any: `springs` or `finite_elements`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tissue: Option<&'static str>,
}

impl Provenance {
    /// This version, on the given command.
    pub fn new(command: impl Into<String>) -> Self {
        Self { version: crate::VERSION, command: command.into(), tissue: None }
    }

    /// The same for results of this tissue.
    #[must_use]
    pub fn with_tissue(mut self, tissue: TissueModel) -> Self {
        self.tissue = Some(match tissue {
            TissueModel::MassSpring => "springs",
            TissueModel::FiniteElement => "finite_elements",
        });
        self
    }

    /// Names and values, each value on one line.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, String)> {
        let line = |text: &str| text.replace(char::is_control, " ");
        let tissue = self.tissue.map(|t| ("tissue", t.to_owned()));
        [("version", line(self.version)), ("command", line(&self.command))].into_iter().chain(tissue)
    }
}

/// Content of a file.
pub trait Export {
    /// Writes the content, which says who it is made `by`.
    ///
    /// # Errors
    /// As `out`.
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()>;

    /// The same as text.
    ///
    /// # Errors
    /// None that can happen: every format is text, and memory can be written to.
    fn text(&self, by: &Provenance) -> io::Result<String> {
        let mut bytes = Vec::new();
        self.write(&mut bytes, by)?;
        String::from_utf8(bytes).map_err(io::Error::other)
    }
}

/// A record as one JSON object, indented: `version`, `command` and, where it is known, `tissue` come before its own fields, which
/// must not have these names.
#[derive(Debug, Clone, Copy)]
pub struct Json<'a, T>(pub &'a T);

impl<T: Serialize> Export for Json<'_, T> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        #[derive(Serialize)]
        struct Made<'a, T> {
            #[serde(flatten)]
            by: &'a Provenance,
            #[serde(flatten)]
            content: &'a T,
        }
        serde_json::to_writer_pretty(&mut *out, &Made { by, content: self.0 })?;
        out.write_all(b"\n")
    }
}

/// Records as CSV: a column for each field, then `version`, `command` and, where it is known, `tissue`.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a, T>(pub &'a [T]);

impl<T: Serialize> Export for Rows<'_, T> {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(out);
        self.0.iter().try_for_each(|row| writer.serialize((row, by)))?;
        writer.flush()
    }
}

/// A CSV table of columns that are not known in advance, such as those of muscles; `version`, `command` and, where it is known,
/// `tissue` come behind.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    /// The header.
    pub columns: Vec<String>,
    /// One value for each column.
    pub rows: Vec<Vec<String>>,
}

impl Export for Table {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let (names, values): (Vec<_>, Vec<_>) = by.entries().unzip();
        let mut writer = csv::Writer::from_writer(out);
        writer.write_record(self.columns.iter().map(String::as_str).chain(names))?;
        for row in &self.rows {
            writer.write_record(row.iter().chain(&values))?;
        }
        writer.flush()
    }
}

/// Text that says itself who made it.
impl Export for String {
    fn write(&self, out: &mut dyn Write, _: &Provenance) -> io::Result<()> {
        out.write_all(self.as_bytes())
    }
}

/// A page of Markdown; who made it is its last line.
#[derive(Debug, Clone)]
pub struct Markdown(pub String);

impl Export for Markdown {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        writeln!(out, "{}\n\n<sub>tongue-fit {}: `{}`</sub>", self.0.trim_end(), by.version, by.command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            rows.starts_with("muscle,stretch,version,command,tissue\nGGa,0.30000000000000004,"),
            "{rows}"
        );
    }
}
