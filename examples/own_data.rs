//! Measurements of your own: a table from a spreadsheet, and the tensions that explain it.
//!
//!     cargo run --example own_data [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::error::Error;
use std::{env, fs};

use tongue_fit::prelude::*;

/// Straight lengths of the muscles of one speaker at rest (here /ɯ/) and in /a/, with decimal commas. Columns
/// are named `NAME_mm`.
const TABLE: &str = "\
speaker;vowel;GGa_mm;GGm_mm;GGp_mm;SGp_mm;SGm_mm;SGa_mm;HGa_mm;HGp_mm
X;ɯ;44,0;59,5;50,0;57,5;24,0;35,0;32,5;34,0
X;a;40,5;60,0;51,5;58,0;22,5;37,0;31,5;35,0
";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).unwrap_or_else(|| "target/own_data".into());
    fs::create_dir_all(&folder)?;
    fs::write(format!("{folder}/my.csv"), TABLE)?;

    // The target: for each muscle that shortened, its length over that in /ɯ/.
    let data = Dataset::from_path(format!("{folder}/my.csv"))?;
    let target = data.stretches("X", "a")?;
    println!("shorter than in /ɯ/, so contracting: {}", target.active_names().join(", "));

    // The same muscles contract in the model.
    let body = Body::tongue(5.5 * MM)?;
    let model = Assembly::new(&Model::default(), &body, target.active_names())?;
    let estimate = InverseProblem::new(&model, model.observations(&target)?).fit()?;
    println!("{:?}, misfit {:.1e}", estimate.answer.status, estimate.answer.misfit);
    for (muscle, tension) in estimate.tensions() {
        println!("{muscle} {tension:6.2} N per metre, {:.3} of its length", estimate.shape.stretch(muscle)?);
    }

    // Muscles that did not contract were not fitted, so that the model's predictions can be compared with the data.
    for muscle in ["GGp", "SGa"] {
        let rows = ["a", "ɯ"].map(|v| data.row("X", &v.parse().ok()?).ok()?.length_mm_of(muscle));
        if let [Some(now), Some(rest)] = rows {
            println!(
                "{muscle}: simulated {:.3}, measured {:.3}",
                estimate.shape.stretch(muscle)?,
                now / rest
            );
        }
    }
    let picture = estimate.shape.picture("X /a/")?;
    report::write(&folder, "own_data", &[("fit.json", &Json(&estimate.record())), ("tongue.svg", &picture)])?;
    Ok(())
}
