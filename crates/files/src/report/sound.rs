//! The sound of a tongue as a record.

use serde::Serialize;

use tongue_infer::heard::Articulation;

/// A section of a vocal tract.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AreaRow {
    /// Distance of its middle from the glottis along the midline, mm.
    pub from_glottis_mm: f64,
    /// Its length, mm.
    pub length_mm: f64,
    /// Its area, cm^2.
    pub area_cm2: f64,
}

/// Derivatives of the formants by the tension of a muscle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormantsByTension {
    /// The muscle.
    pub muscle: String,
    /// Derivative of each formant's frequency, Hz for 1 N per metre of thickness.
    pub hz_per_n: Vec<f64>,
}

/// The sound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SoundRecord {
    /// Frequencies of the formants, Hz.
    pub formants_hz: Vec<f64>,
    /// Their bandwidths, Hz.
    pub bandwidths_hz: Vec<f64>,
    /// Derivatives by the tensions of the contracting muscles.
    pub by_tension: Vec<FormantsByTension>,
    /// Name of the tract.
    pub tract: String,
    /// Posture of jaw, hyoid and lips.
    pub posture: Articulation,
    /// Distance from the glottis to the lips along the midline, mm.
    pub tract_length_mm: f64,
    /// Areas from the glottis to the lips.
    pub area_function: Vec<AreaRow>,
    /// Lines across the airway, mm: `[x, y]` at the outer and at the inner wall.
    pub across_mm: Vec<[[f64; 2]; 2]>,
    /// The transfer function from glottis to lips: frequency, Hz, and level, dB.
    pub transfer_db: Vec<[f64; 2]>,
}
