//! Outputs of a run: figures, tables and files for other programs. Each is written completely or not at all.
//!
//! Everything that can be a file is an [`Export`]: it writes itself in its format, with its provenance.
//! [`OutputDir`] gives files their names, whatever they contain.

#[cfg(feature = "files")]
mod atomic_write;
#[cfg(feature = "files")]
pub mod batch;
#[cfg(feature = "files")]
mod clean;
pub mod column;
mod conclusion;
mod csv;
mod draws;
mod error;
mod export;
#[cfg(feature = "files")]
mod file;
mod msh;
mod muscle_columns;
#[cfg(feature = "files")]
mod page;
mod plane;
mod record;
mod sound;
mod space;
mod space_fit;
mod ssff;
mod sto;
mod svg;
#[cfg(feature = "files")]
mod tongue_page;
mod track;
mod trajectory;
mod vtu;

#[cfg(feature = "files")]
pub use atomic_write::{InterruptGuard, discard_unfinished};
#[cfg(feature = "files")]
pub use clean::Clean;
pub use conclusion::{Conclusion, DecidedBy};
pub use csv::{Rows, Table};
pub use draws::Draws;
pub use error::ReportError;
pub use export::{Export, Json, Markdown, Provenance, Wav};
#[cfg(feature = "files")]
pub use file::{OutputDir, Writes, write};
pub use msh::Msh;
pub use plane::{MISSED_BY_PLANE, limit_of_plane};
pub use record::{FitRecord, ValleyPointRecord, ValleyRecord};
pub use sound::{AreaRow, FormantsByTension, SoundRecord};
pub use space::{HexahedraRecord, OfBody, OperationRecord, SimulationRecord};
pub use space_fit::{SpaceFitRecord, SpaceTrackRecord};
pub use ssff::Ssff;
pub use sto::StoTable;
pub use svg::{
    AnimationFrame, Panel, PrecisionCurve, Scatter, SectionPicture, Series, Svg, VowelPicture, animation,
    changes, panels, parts, ridges, scatter, solid, timelines, tongue, valley, views, vowel, work_precision,
    wrapped,
};
pub use tongue_input::measured::ByMuscle;
#[cfg(feature = "files")]
pub use tongue_page::{PageBody, PageTable, TonguePage};
pub use track::{
    FormantsRecord, REPEATED, RecordingResult, TrackRecord, TrackResults, contrasts, draws_csv, formants_csv,
    over_speakers, placed, prior_interval_n, repeated, repeats_table, segments_csv, status_name, track_csv,
};
#[cfg(feature = "files")]
pub use track::{TrackPage, fixed};
pub use trajectory::TrajectoryRecord;
pub use vtu::{Pvd, Vtu};
