//! Whatever the bytes, reading tension curves ends in curves or in an error, and curves give tensions that are finite, not
//! negative and not above the largest in the file, at every time.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tongue_fit::dynamics::{Curves, Tensions};

fuzz_target!(|bytes: &[u8]| {
    let names = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"].map(String::from);
    let Ok(Curves { tensions, .. }) = Curves::from_reader(bytes, "fuzz.csv", &names) else { return };
    let Tensions::Table { times, values } = &tensions else { panic!("curves are a table") };
    let largest = values.iter().flatten().copied().fold(0.0, f64::max);
    let between = times.windows(2).map(|w| 0.5 * w[0] + 0.5 * w[1]);
    let outside = [f64::MIN, 0.0, f64::MAX, times[0] - 1.0, times[times.len() - 1] + 1.0];
    let mut out = [0.0; 8];
    for time in times.iter().copied().chain(between).chain(outside) {
        tensions.at(time, &mut out);
        let fine = |t: &f64| t.is_finite() && *t >= 0.0 && *t <= largest * (1.0 + 1e-12);
        assert!(out.iter().all(fine), "at {time} s: {out:?}, largest {largest}");
        assert!(tensions.next_kink(time) > time);
    }
});
