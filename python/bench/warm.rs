//! The time of one warm equilibrium through the library, µs, with which `bench/compare.py` compares that of the module.
#![allow(clippy::print_stdout, reason = "that is its result")]

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use tongue_fit::prelude::*;

const LOADS: [[f64; 3]; 2] = [[12.0, 11.5, 4.5], [12.3, 11.3, 4.7]];
const MUSCLES: [&str; 3] = ["GGa", "SGm", "HGa"];

fn main() -> Result<(), Box<dyn Error>> {
    let model = Assembly::new(&Model::default(), &Body::tongue(5.5 * MM)?, MUSCLES)?;
    let mut solver = model.solver();
    let named = LOADS.map(|load| [0, 1, 2].map(|m| (MUSCLES[m], load[m])));
    let mut shape = solver.equilibrium(&named[0])?;
    let mut times = Vec::new();
    for _ in 0..15 {
        let clock = Instant::now();
        for n in 0..500 {
            shape = black_box(solver.equilibrium_from(&shape, &named[(n + 1) % 2])?);
        }
        times.push(1e6 * clock.elapsed().as_secs_f64() / 500.0);
    }
    times.sort_by(f64::total_cmp);
    println!("{}", times[times.len() / 2]);
    Ok(())
}
