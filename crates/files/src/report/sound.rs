use serde::Serialize;

use tongue_infer::acoustics::{Articulation, Sound, Tract};
use tongue_sound::{Acoustics, chain};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AreaRow {
    /// Distance of the section's middle from the glottis along the midline.
    pub from_glottis_mm: f64,
    pub length_mm: f64,
    pub area_cm2: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormantsByTension {
    pub muscle: String,
    /// Derivative of each formant's frequency, Hz for 1 N per metre of thickness.
    pub hz_per_n: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SoundRecord {
    pub formants_hz: Vec<f64>,
    pub bandwidths_hz: Vec<f64>,
    pub by_tension: Vec<FormantsByTension>,
    pub tract: String,
    pub posture: Articulation,
    /// How the areas were found, if not from the distances across the tract in the midsagittal plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub areas_from: Option<&'static str>,
    pub tract_length_mm: f64,
    pub area_function: Vec<AreaRow>,
    /// Lines across the airway: `[x, y]` at the outer and at the inner wall.
    pub across_mm: Vec<[[f64; 2]; 2]>,
    /// The transfer function from glottis to lips: frequency, Hz, and level, dB.
    pub transfer_db: Vec<[f64; 2]>,
}

/// Step and largest frequency of the reported transfer function.
const STEP_HZ: f64 = 20.0;
const HIGHEST_HZ: f64 = 5000.0;

impl SoundRecord {
    pub fn new(tract: &Tract, acoustics: &Acoustics, sound: &Sound, posture: Articulation) -> Self {
        let sections = &sound.profile.sections;
        let mut from_glottis = 0.0;
        let area_function = sections.iter().map(|s| {
            from_glottis += s.length_m;
            AreaRow {
                from_glottis_mm: 1e3 * (from_glottis - 0.5 * s.length_m),
                length_mm: 1e3 * s.length_m,
                area_cm2: 1e4 * s.area_m2,
            }
        });
        let across_mm = sound.profile.across.iter().map(|a| [a.outer, a.inner].map(|p| p.map(|x| 1e3 * x)));
        Self {
            formants_hz: sound.formants.iter().map(|f| f.frequency_hz).collect(),
            bandwidths_hz: sound.formants.iter().map(|f| f.bandwidth_hz).collect(),
            by_tension: Vec::new(),
            tract: tract.name.clone(),
            posture,
            areas_from: None,
            tract_length_mm: 1e3 * sound.profile.length_m(),
            area_function: area_function.collect(),
            across_mm: across_mm.collect(),
            transfer_db: chain::curve(sections, acoustics, STEP_HZ, HIGHEST_HZ),
        }
    }
}
