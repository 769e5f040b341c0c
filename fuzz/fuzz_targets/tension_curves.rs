//! Whatever the bytes, reading tension curves ends in curves or in an error, and curves give tensions that are finite, not
//! negative and not above the largest in the file, at every time.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::dynamics::{Curves, Tensions};
use tongue_fit::muscle::COUNT;

fuzz_target!(|bytes: &[u8]| {
    let Ok(curves) = Curves::from_reader(bytes, "fuzz.csv") else { return };
    let tensions = curves.tensions(&[0, 1, 2, 3, 4, 5, 6, 7], COUNT);
    let Tensions::Table { times, values } = &tensions else { panic!("curves are a table") };
    let largest = values.iter().flatten().copied().fold(0.0, f64::max);
    let between = times.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]);
    let outside = [f64::MIN, 0.0, f64::MAX, times[0] - 1.0, times[times.len() - 1] + 1.0];
    let mut out = [0.0; COUNT];
    for time in times.iter().copied().chain(between).chain(outside) {
        tensions.at(time, &mut out);
        let fine = |t: &f64| t.is_finite() && *t >= 0.0 && *t <= largest * (1.0 + 1e-12);
        assert!(out.iter().all(fine), "at {time} s: {out:?}, largest {largest}");
        assert!(tensions.next_kink(time) > time);
    }
});
