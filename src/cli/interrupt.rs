//! Signals: Ctrl-C leaves no unfinished files and ends the program by the signal, as shells expect; reaching the limit of file sizes is an
//! error with a message.

#[cfg(unix)]
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

static STOP_MESSAGE: Mutex<Option<String>> = Mutex::new(None);

/// Sets what an interruption prints at a terminal.
pub fn set_stop_message(message: Option<String>) {
    *STOP_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) = message;
}

/// On SIGINT and SIGTERM, removes unfinished files and then lets the signal end the program, because a shell stops a series of commands
/// only if the interrupted one was ended by the signal. A write beyond the limit of file sizes (`ulimit -f`) fails with an error, which is
/// reported like any other; by default SIGXFSZ ends the program without a message. Systems other than Unix keep their default.
#[cfg(unix)]
pub fn handle_signals() {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    // The signal only needs a handler; the flag is never read.
    let _ = signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default());
    let wanted = [SIGINT, SIGTERM].into_iter().filter(|signal| !is_ignored(*signal));
    let Ok(mut signals) = Signals::new(wanted) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let _guard = tongue_fit::inner::report::discard_unfinished();
            // Only at a terminal, because writing to a full pipe would wait for ever.
            if std::io::stderr().is_terminal()
                && let Some(message) = STOP_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner).as_deref()
            {
                super::output::note(&format!("\n{message}"));
            }
            let _ = emulate_default_handler(signal);
        }
    });
}

/// Whether the signal was ignored when the program was started, as SIGINT is for background jobs; only Linux reports it.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}
