//! The tensions that ratios leave undetermined: all tensions of three muscles that meet the two ratios of S2
//! /a/ equally well, as a table and a picture.
//!
//!     cargo run --example valley [FOLDER]
#![allow(clippy::print_stdout, reason = "a program says what it found")]

use std::env;
use std::error::Error;

use tongue_fit::inverse::FitSettings;
use tongue_fit::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = env::args().nth(1).unwrap_or_else(|| "target/valley".into());
    let target = Dataset::reference()?.ratios("S2", "a")?;
    let body = Body::tongue(5.5 * MM)?;
    let model = Assembly::new(&Model::default(), &body, target.active_names())?;

    // Two equations for three tensions leave one direction undetermined, which the fit follows to both ends.
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    let fit = InverseProblem::new(&model, model.observations(&target)?).with_settings(settings).fit()?;
    println!(
        "{} ratios, {} tensions, directions left open: {:?}; {:?}",
        fit.measured().len(),
        fit.tensions().len(),
        fit.answer.undetermined(),
        fit.answer.status
    );
    let Some(found) = fit.solution_curve() else { return Err("nothing is open".into()) };
    for point in found.curve.points.iter().step_by(8) {
        let tensions = found.unknowns.iter().zip(&point.x).map(|(m, n)| format!("{m} {n:5.2}"));
        let tensions: Vec<String> = tensions.collect();
        let others = point.other_rms.unwrap_or(f64::NAN);
        println!(
            "{} N per metre: misfit {:.0e}, other ratios {others:.3}",
            tensions.join(", "),
            point.misfit
        );
    }
    let [before, after] = found.ends();
    println!("it ends: {before}; {after}");
    let (table, picture) = (found.table(), report::solution_curve(&found, "GGa"));
    report::write(&folder, "valley", &[("valley.csv", &table), ("valley.svg", &picture)])?;
    Ok(())
}
