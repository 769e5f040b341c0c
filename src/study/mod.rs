//! What the program finds out about itself: what accuracy costs in time, and what becomes of hard cases.

pub mod accuracy;
pub mod hard_cases;

use crate::body::Mesh;
use crate::inverse::FitError;

/// The tensions published for /a/ (Kato 2014, 4.4.1), N per metre of thickness.
pub const PUBLISHED_A: [(&str, f64); 3] = [("GGa", 12.0), ("SGm", 11.5), ("HGa", 4.5)];

/// Numbers of the muscles that pull, and the tensions of all muscles of a mesh, N.
///
/// # Errors
/// [`FitError::MissingMuscle`].
pub fn pulling(mesh: &Mesh<2>, pull: &[(&str, f64)]) -> Result<(Vec<usize>, Vec<f64>), FitError> {
    let mut tensions = vec![0.0; mesh.muscles.len()];
    let mut numbers = Vec::with_capacity(pull.len());
    for (name, tension) in pull {
        let number = mesh.muscles.iter().position(|m| m.name == *name);
        let number = number.ok_or_else(|| FitError::MissingMuscle { muscle: (*name).to_owned() })?;
        tensions[number] = *tension;
        numbers.push(number);
    }
    Ok((numbers, tensions))
}
