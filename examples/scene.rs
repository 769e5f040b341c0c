//! A scene: loads and targets described in TOML; the simulation contains only what the scene asks for.
//!
//!     cargo run --example scene [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::env;
use std::error::Error;

use tongue_fit::prelude::*;
use tongue_fit::scene::{self, Scene};

/// An upright tongue with its weight, pressed against the palate as in /i/. `tongue-fit scene schema` prints
/// all keys.
const SCENE: &str = r#"
title = "upright, against the palate"
want = "shape"
[body.tongue]
h_mm = 5.5
[tensions_n]
GGp = 60.0
SGa = 50.0
[effects]
incompressibility = true
gravity = { posture = "upright" }
contact = {}
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).unwrap_or_else(|| "target/scene".into());
    let outcome = scene::simulate(&Scene::from_toml(SCENE, "my scene")?)?;
    for effect in &outcome.plan.effects {
        println!("{:<18}{:<4}{}", effect.effect, if effect.simulated { "yes" } else { "no" }, effect.why);
    }
    println!("converged: {}", outcome.converged);
    for muscle in &outcome.muscles {
        println!(
            "{} {:4.1} N per metre, {:.3} of its length",
            muscle.muscle,
            muscle.pull.value(),
            muscle.stretch
        );
    }
    if let Some(palate) = &outcome.contact {
        let force = &palate.on_wall_n;
        println!("on the palate: {:.2} N per metre upwards, at {} nodes", force[1], palate.touching);
    }
    report::write(&folder, "scene", &[("scene.json", &Json(&outcome))])?;
    Ok(())
}
