//! Provenance of files, files as JSON, Markdown and WAV, and the errors of making and writing outputs.

use std::io::{self, Write};
use std::path::PathBuf;

use serde::Serialize;
use serde_json::{Value, json};

use tongue_core::body::ContinuumSettings;
use tongue_core::system::TissueModel;
use tongue_sound::voice;

/// Version and command that made a file. Every format has them in its own way: fields of JSON, columns of CSV, metadata of SVG, an
/// instruction in VTK's XML, comments of Gmsh, header lines of OpenSim.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Provenance {
    pub version: &'static str,
    /// The command line, or a description by a program that uses the library.
    pub command: String,
    /// Model of the tissue: `springs`, `continuum` or `hexahedra`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tissue: Option<&'static str>,
    /// Kind of body: `springs`, `continuum` or `space`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<&'static str>,
    /// For a continuum, the widths and patches that are chosen and not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<String>,
    /// Hash of all inputs (SHA-256, hexadecimal), for results of many inputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inputs_sha256: Option<String>,
}

impl Provenance {
    pub fn new(command: impl Into<String>) -> Self {
        Self { version: crate::VERSION, command: command.into(), ..Self::default() }
    }

    pub fn with_tissue(self, tissue: TissueModel) -> Self {
        let (name, body, settings) = match tissue {
            TissueModel::MassSpring => ("springs", "springs", None),
            TissueModel::Continuum => ("continuum", "continuum", Some(&ContinuumSettings::default())),
            TissueModel::Hexahedra => ("hexahedra", "space", None),
        };
        Self { tissue: Some(name), body: Some(body), ..self }.with_chosen(settings)
    }

    pub fn with_chosen(self, settings: Option<&ContinuumSettings>) -> Self {
        Self { chosen: settings.map(ContinuumSettings::to_string), ..self }
    }

    /// Names and values, each value on one line.
    pub(super) fn entries(&self) -> impl Iterator<Item = (String, String)> {
        let fields = json!(self).as_object().cloned().unwrap_or_default();
        fields.into_iter().map(|(name, value)| (name, text(value).replace(char::is_control, " ")))
    }
}

/// A value as a cell; empty if there is none.
pub(super) fn text(value: Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text,
        other => other.to_string(),
    }
}

pub fn joined(items: impl IntoIterator<Item = impl ToString>, separator: &str) -> String {
    items.into_iter().map(|item| item.to_string()).collect::<Vec<_>>().join(separator)
}

pub(crate) fn names_or_none(names: impl IntoIterator<Item = impl ToString>) -> String {
    Some(joined(names, ", ")).filter(|text| !text.is_empty()).unwrap_or_else(|| "none".to_owned())
}

pub type Files<'a> = Vec<(&'static str, Box<dyn Export + 'a>)>;

pub trait Export {
    /// Writes the content with its provenance.
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()>;

    fn text(&self, by: &Provenance) -> io::Result<String> {
        let mut bytes = Vec::new();
        self.write(&mut bytes, by)?;
        String::from_utf8(bytes).map_err(io::Error::other)
    }
}

impl<F: Fn(&mut dyn Write, &Provenance) -> io::Result<()>> Export for F {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        self(out, by)
    }
}

/// A text that already contains its provenance.
impl Export for String {
    fn write(&self, out: &mut dyn Write, _: &Provenance) -> io::Result<()> {
        out.write_all(self.as_bytes())
    }
}

/// A record as one indented JSON object. The fields of its [`Provenance`] come first; its own fields must have other names.
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

#[derive(Debug, Clone)]
pub struct Markdown(pub String);

impl Export for Markdown {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        writeln!(out, "{}\n\n<sub>tongue-fit {}: `{}`</sub>", self.0.trim_end(), by.version, by.command)
    }
}

/// A voice as a WAV file, with samples between -1 and 1, and with the provenance in its list of information.
#[derive(Debug, Clone, PartialEq)]
pub struct Wav {
    pub samples: Vec<f64>,
    pub rate_hz: u32,
}

impl Export for Wav {
    fn write(&self, out: &mut dyn Write, by: &Provenance) -> io::Result<()> {
        let entries = joined(by.entries().map(|(name, value)| format!("{name}: {value}")), "; ");
        out.write_all(&voice::wav(&self.samples, self.rate_hz, &entries))
    }
}

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    #[error(
        "cannot write into the output folder \"{}\": {reason}; choose another folder, or make this one writable",
        path.display()
    )]
    Folder { path: PathBuf, reason: String, source: io::Error },
    #[error(
        "cannot write the file \"{}\": {source}; {} (an earlier file of that name is unchanged)",
        path.display(),
        remedy(source)
    )]
    File { path: PathBuf, source: io::Error },
    #[error("cannot use the journal \"{}\": {source}{}", path.display(), remedy_of_journal(source))]
    Journal { path: PathBuf, source: io::Error },
    #[error("\"{name}\" is not a plain file name; give a name without a folder")]
    Name { name: String },
    #[error("the mesh has {nodes} nodes, but the deformed shape {deformed}; pass the positions of this mesh")]
    NodeCount { nodes: usize, deformed: usize },
    #[error("the {shape} position of node {node} is ({x}, {y}) m; it must be finite and within 1000 m")]
    Position { shape: &'static str, node: usize, x: f64, y: f64 },
    #[error("cannot write the record of a fit: {reason}; please report this as a defect")]
    Record { reason: String },
    #[error("{what} names {kind} {number}, but the mesh has {count} (counted from 0); correct the number")]
    Number { what: String, kind: &'static str, number: usize, count: usize },
    #[error("a motion needs at least one frame; got none")]
    NoFrame,
    #[error(
        "the value of \"{label}\" in the series \"{series}\" is {value}; \
         a bar must be positive, finite and at most 100"
    )]
    BarHeight { series: String, label: String, value: f64 },
    #[error("a diagram needs 1 to {most} curves with a positive, finite point each; got {curves}")]
    Curves { curves: usize, most: usize },
}

/// Advice for a journal that cannot grow; other errors contain their advice.
fn remedy_of_journal(refusal: &io::Error) -> String {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    if !matches!(refusal.kind(), StorageFull | QuotaExceeded | FileTooLarge) {
        return String::new();
    }
    format!("; {}. The fits that it has are kept: the same command resumes after them", remedy(refusal))
}

fn remedy(refusal: &io::Error) -> &'static str {
    use io::ErrorKind::{FileTooLarge, PermissionDenied, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    match refusal.kind() {
        StorageFull | QuotaExceeded => "free some space or choose another folder",
        FileTooLarge => "raise the limit of file sizes (ulimit -f) or choose another folder",
        PermissionDenied | ReadOnlyFilesystem => "choose another folder, or make this one writable",
        // EMFILE and ENFILE have no `ErrorKind`.
        _ if matches!(refusal.raw_os_error(), Some(23 | 24)) => {
            "allow the program more open files (ulimit -n) or close others"
        }
        _ => "choose another folder",
    }
}
