//! Tensions as words: `GGa=12`.

use tongue_core::body::Body;
use tongue_core::limits;

use super::{SimulationError, check_tension};

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{word}: {why}")]
pub struct BadTension {
    pub word: String,
    pub why: String,
}

/// Reads words such as `GGa=12` into numbers of the body's muscles and tensions, N (2D: per metre of
/// thickness).
pub fn read_tensions<const D: usize>(
    words: &[String],
    body: &Body<D>,
) -> Result<Vec<(usize, f64)>, BadTension> {
    let mut out: Vec<(usize, f64)> = Vec::new();
    for word in words {
        let bad = |why: String| BadTension { word: word.clone(), why };
        let (name, value) =
            word.split_once('=').ok_or_else(|| bad("write MUSCLE=NEWTONS, like GGa=12".to_owned()))?;
        let muscle = body.muscle(name.trim()).map_err(|e| bad(e.to_string()))?;
        let name = &body.mesh.muscles[muscle].name;
        let tension: f64 = value
            .trim()
            .parse()
            .map_err(|_| bad(format!("\"{value}\" is not a number; write newtons, like {name}=12")))?;
        check_tension(name, tension).map_err(|e| bad(e.to_string()))?;
        limits::TENSION.check(tension).map_err(|beyond| bad(beyond.to_string()))?;
        if out.iter().any(|(m, _)| *m == muscle) {
            return Err(bad(SimulationError::repeated(name).to_string()));
        }
        out.push((muscle, tension));
    }
    Ok(out)
}
