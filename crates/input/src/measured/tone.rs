//! Tensions of muscles in the baseline, by name. The data are in `targets/takano2007_tone.csv`.

use serde::Deserialize;

use super::TableError;

const REFERENCE: &str = include_str!("../../../../targets/takano2007_tone.csv");

#[derive(Debug, Deserialize)]
struct Row {
    muscle: String,
    tone_n_per_m: f64,
}

/// The built-in tones, N per metre of thickness: fitted at 2d1a5d4 to the passive muscles of S1
/// to S3 of Takano and Honda (2007).
pub fn reference() -> Result<Vec<(String, f64)>, TableError> {
    read(REFERENCE, "targets/takano2007_tone.csv (built in)")
}

/// Reads a table of tones; lines that begin with `#` are skipped and further columns ignored.
///
/// # Errors
/// [`TableError`] for another format, a muscle given twice, or a tone that is negative or not finite.
pub fn read(text: &str, origin: &str) -> Result<Vec<(String, f64)>, TableError> {
    let wrong = |problem: String| {
        let problem = format!("{problem}; write a table of muscle,tone_n_per_m with a row for each muscle");
        TableError::malformed(origin, None, problem)
    };
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let mut out: Vec<(String, f64)> = Vec::new();
    for row in reader.deserialize() {
        let Row { muscle, tone_n_per_m } = row.map_err(|e| wrong(e.to_string()))?;
        if !(tone_n_per_m.is_finite() && tone_n_per_m >= 0.0) {
            return Err(wrong(format!(
                "the tone of {muscle} is {tone_n_per_m}; it must be finite and not negative"
            )));
        }
        if out.iter().any(|(m, _)| m.eq_ignore_ascii_case(&muscle)) {
            return Err(wrong(format!("{muscle} is given twice")));
        }
        out.push((muscle, tone_n_per_m));
    }
    if out.is_empty() { Err(wrong("no muscle in it".to_owned())) } else { Ok(out) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_table_has_takanos_muscles_and_bad_tables_are_told() {
        let muscles: Vec<String> = reference().unwrap().into_iter().map(|(m, _)| m).collect();
        assert_eq!(muscles, ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"]);
        let message = |text: &str| read(text, "mine.csv").unwrap_err().to_string();
        assert!(message("muscle,tone_n_per_m\nGGa,-1\n").contains("the tone of GGa is -1"));
        assert!(message("muscle,tone_n_per_m\nGGa,1\ngga,2\n").contains("gga is given twice"));
        assert!(message("muscle\nGGa\n").contains("tone_n_per_m"));
        assert!(message("muscle,tone_n_per_m\n").contains("no muscle in it"));
    }
}
