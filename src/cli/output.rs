//! What reaches the terminal.

use std::io::{self, Write};

use miette::{IntoDiagnostic, WrapErr};

/// Writes to stdout.
///
/// # Errors
/// As the operating system; a closed pipe (`| head`) is told apart by [`is_closed_pipe`].
pub fn print(text: &str) -> miette::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .into_diagnostic()
        .wrap_err("cannot write to stdout")
}

/// Whether an error only says that nobody reads stdout any more.
pub fn is_closed_pipe(error: &miette::Report) -> bool {
    error
        .chain()
        .any(|e| e.downcast_ref::<io::Error>().is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe))
}

/// One message on stderr, causes included, each said once.
pub fn error(report: &miette::Report) {
    let mut message = String::new();
    for cause in report.chain() {
        let cause = cause.to_string();
        // Errors that quote their cause need not be followed by it.
        if !message.contains(&cause) {
            message = if message.is_empty() { cause } else { format!("{message}: {cause}") };
        }
    }
    note(&format!("error: {message}"));
}

/// A line on stderr. If even that cannot be written there is nobody to tell.
pub fn note(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
