//! The program `tongue-fit` as its users run it: output, files and answers.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a test says by panicking"
)]

mod batch_page_works;
mod browser;
mod contracts;
mod docs_are_true;
mod examples_work;
mod files_say_who_made_them;
mod installed;
mod layers_hold;
mod lengths_check;
mod limits_are_told;
mod muscles_of_any_name;
mod nonsense_is_noticed;
mod other_peoples_names;
mod outputs_read_back;
mod page_in_space;
mod page_moves;
mod posterior_command;
mod refusals;
mod results_are_as_told;
mod run;
mod scene_command;
mod simulate_command;
mod sound_command;
mod space_command;
mod terminal_manners;
mod track_command;
mod track_page;
mod track_speakers;
mod validate_command;

#[path = "../fixtures/program.rs"]
mod program;
