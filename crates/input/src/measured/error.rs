//! Errors of small tables.

/// Why a table of nodes, activity or tension curves cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error("cannot read {origin}: {source}")]
    Unreadable { origin: String, source: std::io::Error },
    #[error("{origin}{}{}: {problem}", behind(", line ", line), behind(", column ", column))]
    Malformed {
        origin: String,
        /// Line, from 1, if one is to blame.
        line: Option<u64>,
        /// Number (from 1) and name of the column, if one is to blame.
        column: Option<String>,
        problem: String,
    },
}

impl TableError {
    pub(crate) fn malformed(origin: &str, line: Option<u64>, problem: String) -> Self {
        Self::Malformed { origin: origin.to_owned(), line, column: None, problem }
    }
}

fn behind<T: std::fmt::Display>(word: &str, value: &Option<T>) -> String {
    value.as_ref().map_or_else(String::new, |v| format!("{word}{v}"))
}
