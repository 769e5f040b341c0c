//! Outputs of a run. Each is an [`Export`], which writes itself in its format with its provenance; [`OutputDir`] makes files of them.

#[cfg(feature = "files")]
pub mod batch;
pub mod column;
mod csv;
#[cfg(feature = "files")]
mod escape_control;
mod export;
#[cfg(feature = "files")]
mod file;
mod muscle_columns;
mod numbers;
mod record;
mod simulation;
mod sound;
mod ssff;
mod svg;
#[cfg(feature = "files")]
mod tongue_page;
mod track;
mod vtu;

pub use csv::{Draws, Rows, Table};
#[cfg(feature = "files")]
pub use escape_control::EscapeControl;
pub(crate) use export::names_or_none;
pub use export::{Export, Files, Json, Markdown, Provenance, ReportError, Wav, joined};
#[cfg(feature = "files")]
pub use file::{OutputDir, discard_unfinished, write};
pub use numbers::{probability, range, with_decimals};
pub use record::{Conclusion, DecidedBy, FitRecord, SolutionCurveRecord, TrajectoryRecord};
pub use simulation::{HexahedraRecord, OfBody, Pulls, SimulationRecord};
pub use sound::{AreaRow, FormantsByTension, SoundRecord};
pub use ssff::{Ssff, StoTable};
pub use svg::*;
pub use tongue_input::measured::ByMuscle;
#[cfg(feature = "files")]
pub use tongue_page::TonguePage;
pub use track::*;
pub use vtu::{Msh, Pvd, Vtu};
