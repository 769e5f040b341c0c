#![no_main]

#[path = "../../tests/fixtures/inputs.rs"]
#[allow(dead_code, reason = "one reader a target")]
mod inputs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| inputs::recording(bytes));
