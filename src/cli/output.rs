//! What reaches the terminal.

use std::io::{self, Write};

use miette::{IntoDiagnostic, WrapErr};

/// Writes to stdout. That nobody reads it any more (`| head`) is no error: the run goes on and ends as it would have.
///
/// # Errors
/// As the operating system, but for a closed pipe.
pub fn print(text: &str) -> miette::Result<()> {
    stream(|out| out.write_all(text.as_bytes()))
}

/// As [`print`], for what is too large to be held: `write` writes it.
///
/// # Errors
/// As [`print`].
pub fn stream(write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> miette::Result<()> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    match write(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result.into_diagnostic().wrap_err("cannot write to stdout"),
    }
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
