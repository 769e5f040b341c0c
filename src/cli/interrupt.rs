//! Signals: after Ctrl-C no half-written file stays behind, and the program ends as a shell expects of one that was interrupted; a
//! file that reaches the limit of file sizes is an error with a message.

#[cfg(unix)]
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};

/// What to say to someone who interrupts.
static LAST_WORDS: Mutex<Option<String>> = Mutex::new(None);

/// From now on, an interruption at a terminal is answered with this.
pub fn set_last_words(words: Option<String>) {
    *LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner) = words;
}

/// On SIGINT and SIGTERM, removes unfinished files and then lets the signal end the program as it would have: a shell that
/// runs several commands stops only if the one it interrupted died of the signal. Elsewhere than on Unix the system's own
/// way is left alone.
#[cfg(unix)]
pub fn tidy_up_when_told_to_stop() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::emulate_default_handler;

    let wanted = [SIGINT, SIGTERM].into_iter().filter(|signal| !is_ignored(*signal));
    // Without it a signal just ends the program.
    let Ok(mut signals) = Signals::new(wanted) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let _standstill = tongue_fit::report::discard_unfinished();
            // Only to a terminal: to a pipe that nobody empties, the words would wait for ever.
            if std::io::stderr().is_terminal()
                && let Some(words) = LAST_WORDS.lock().unwrap_or_else(PoisonError::into_inner).as_deref()
            {
                super::output::note(&format!("\n{words}"));
            }
            let _ = emulate_default_handler(signal);
        }
    });
}

/// From now on a write beyond the limit of file sizes (`ulimit -f`) fails with an error, which is reported like any other. Without it the
/// signal SIGXFSZ would end the program without a word.
#[cfg(unix)]
pub fn report_files_that_become_too_large() {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;
    // That the signal has a handler is all that is wanted; the flag is read by nobody.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

#[cfg(not(unix))]
pub fn report_files_that_become_too_large() {}

#[cfg(not(unix))]
pub fn tidy_up_when_told_to_stop() {}

/// Whether the signal was to be ignored when the program was started, as background jobs are told for SIGINT; Linux alone
/// says so.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}
