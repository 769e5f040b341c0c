//! tongue-fit behind a C interface, for a page without a server.
//!
//! A page writes a request (JSON) to the address of [`input`], calls [`call`], and reads the answer (JSON) at the address of [`output`]; an
//! answer that begins with `{"error":` contains the program's message. Frames of a moving slider need no text: they are numbers at the
//! address of [`numbers`], solved by [`frame`].

#![deny(unsafe_code)]

mod engine;
mod fits;
mod request;
mod space;

use std::cell::RefCell;

use engine::Engine;

/// Memory shared with the page.
struct State {
    input: Vec<u8>,
    output: Vec<u8>,
    numbers: Vec<f64>,
    engine: Option<Engine>,
}

thread_local! {
    static STATE: RefCell<State> =
        const { RefCell::new(State { input: Vec::new(), output: Vec::new(), numbers: Vec::new(), engine: None }) };
}

/// Makes room for a request of this number of bytes, and returns its address.
#[allow(unsafe_code, reason = "the name under which a page finds it")]
#[unsafe(no_mangle)]
pub extern "C" fn input(bytes: usize) -> *mut u8 {
    STATE.with_borrow_mut(|state| {
        state.input.clear();
        state.input.resize(bytes, 0);
        state.input.as_mut_ptr()
    })
}

/// Answers the request, and returns the number of bytes of the answer.
#[allow(unsafe_code, reason = "the name under which a page finds it")]
#[unsafe(no_mangle)]
pub extern "C" fn call() -> usize {
    STATE.with_borrow_mut(|state| {
        let text = std::mem::take(&mut state.input);
        let answer = request::answer(&text, &mut state.engine);
        state.output =
            answer.unwrap_or_else(|error| serde_json::json!({"error": error}).to_string()).into_bytes();
        let numbers = state.engine.as_ref().map_or(0, Engine::numbers);
        state.numbers.resize(numbers, 0.0);
        state.output.len()
    })
}

/// The address of the answer.
#[allow(unsafe_code, reason = "the name under which a page finds it")]
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    STATE.with_borrow(|state| state.output.as_ptr())
}

/// The address of the numbers of [`frame`]; [`Engine::frame`] describes them.
#[allow(unsafe_code, reason = "the name under which a page finds it")]
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> *mut f64 {
    STATE.with_borrow_mut(|state| state.numbers.as_mut_ptr())
}

/// Solves the next posture from the last one; 1 if it is an equilibrium, otherwise 0.
#[allow(unsafe_code, reason = "the name under which a page finds it")]
#[unsafe(no_mangle)]
pub extern "C" fn frame() -> u32 {
    STATE.with_borrow_mut(|state| match &mut state.engine {
        Some(engine) => u32::from(engine.frame(&mut state.numbers)),
        None => 0,
    })
}
