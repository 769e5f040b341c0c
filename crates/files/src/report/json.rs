//! Records as JSON.

use std::io::{self, Write};

use serde::Serialize;

use super::export::{Export, Provenance};

/// A record as one indented JSON object: `version`, `command` and, if it is known, `tissue` come before its
/// own fields, which must not have these names.
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
