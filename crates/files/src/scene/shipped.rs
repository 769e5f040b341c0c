//! Built-in scenes.

use super::Scene;
use crate::simulation::SimulationError;
use tongue_core::suggest;

const SHIPPED: [(&str, &str); 17] = [
    ("vowel-a", include_str!("../../../../targets/scenes/vowel-a.toml")),
    ("vowel-a-jaw", include_str!("../../../../targets/scenes/vowel-a-jaw.toml")),
    ("vowel-a-trajectory", include_str!("../../../../targets/scenes/vowel-a-trajectory.toml")),
    ("fit-vowel-a", include_str!("../../../../targets/scenes/fit-vowel-a.toml")),
    ("vowel-i-palate", include_str!("../../../../targets/scenes/vowel-i-palate.toml")),
    ("supine", include_str!("../../../../targets/scenes/supine.toml")),
    ("protrusion", include_str!("../../../../targets/scenes/protrusion.toml")),
    ("only-gga", include_str!("../../../../targets/scenes/only-gga.toml")),
    ("only-ggm", include_str!("../../../../targets/scenes/only-ggm.toml")),
    ("only-ggp", include_str!("../../../../targets/scenes/only-ggp.toml")),
    ("only-sgp", include_str!("../../../../targets/scenes/only-sgp.toml")),
    ("only-sgm", include_str!("../../../../targets/scenes/only-sgm.toml")),
    ("only-sga", include_str!("../../../../targets/scenes/only-sga.toml")),
    ("only-hga", include_str!("../../../../targets/scenes/only-hga.toml")),
    ("only-hgp", include_str!("../../../../targets/scenes/only-hgp.toml")),
    ("cylinder-3d", include_str!("../../../../targets/scenes/cylinder-3d.toml")),
    ("block-3d", include_str!("../../../../targets/scenes/block-3d.toml")),
];

pub fn names() -> impl Iterator<Item = &'static str> + Clone {
    SHIPPED.iter().map(|(name, _)| *name)
}

pub fn shipped(name: &str) -> Result<Scene, SimulationError> {
    let unknown = || format!("unknown scene \"{name}\"; {}", suggest::hint(name, names()));
    let found = SHIPPED.iter().find(|(n, _)| *n == name);
    let (name, text) = found.ok_or_else(|| SimulationError::Refused(unknown()))?;
    Scene::from_toml(text, &format!("targets/scenes/{name}.toml (embedded)"))
}
