//! Roles of channels, by the names that laboratories give them.

use tongue_core::body::{HYOID, MANDIBLE};

#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// A point somewhere on the surface of the tongue.
    Contour,
    /// A material point of the surface at this distance behind the tip along the surface at rest, m.
    Surface(f64),
    /// A material point of the surface at an unknown distance behind the tip; its rank from the tip, if known.
    Coil(Option<u32>),
    Bone(String),
    Reference,
    Ignored,
}

impl Role {
    /// Whether the channel is a sensor that is glued to the tongue.
    pub(super) fn is_sensor(&self) -> bool {
        matches!(self, Self::Surface(_) | Self::Coil(_))
    }

    pub(super) fn is_of_tongue(&self) -> bool {
        *self == Self::Contour || self.is_sensor()
    }

    /// The numbers of the channels with a role that `is_wanted`.
    pub(super) fn channels(roles: &[Self], is_wanted: fn(&Self) -> bool) -> Vec<usize> {
        (0..roles.len()).filter(|&channel| is_wanted(&roles[channel])).collect()
    }
}

/// Names of coils on the tongue in MOCHA, mngu0, the X-ray microbeam, the Haskins comparison and usual protocols of NDI and Carstens, with
/// their rank from the tip backwards: a number in the name, or 1 at the tip, 2 on blade and body, 3 behind them.
#[rustfmt::skip]
const COILS: [(&str, u32); 25] = [
    ("t1", 1), ("t2", 2), ("t3", 3), ("t4", 4), ("t5", 5), ("tt", 1), ("tb", 2), ("tm", 2), ("td", 3), ("tr", 3),
    ("ta", 1), ("tc", 3), ("ttip", 1), ("tbody", 2), ("tdorsum", 3), ("tmid", 2), ("tback", 3), ("tonguetip", 1),
    ("tongueblade", 2), ("tonguebody", 2), ("tonguemid", 2), ("tonguedorsum", 3), ("tongueback", 3),
    ("tonguerear", 3), ("tongueroot", 3),
];
/// Names of coils on the jaw: at the lower incisors, and at molars or beside the incisors.
const INCISORS: [&str; 9] =
    ["li", "jaw", "mani", "lowerincisor", "lowerincisors", "lowincisor", "linc", "lowerjaw", "jawi"];
const BESIDE_INCISORS: [&str; 4] = ["manm", "jawl", "jawr", "jawm"];

/// Beginnings of names of coils on the head and of traces, and whole names of other channels, none of which are of the tongue.
const OF_HEAD: [&str; 9] = ["ref", "head", "nose", "nas", "ear", "mastoid", "palate", "roof", "vel"];
const BESIDE_TONGUE: [&str; 7] =
    ["ui", "upperincisor", "upperincisors", "mandible", "v", "bn", "bridgeofnose"];

/// The name in lower case without punctuation.
pub(super) fn normalised(channel: &str) -> String {
    channel.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase()
}

/// What a channel of this name is: a bone, a point of the contour, a coil, or [`Role::Ignored`].
pub(super) fn role(channel: &str) -> Role {
    if let Some(bone) = bone(channel) {
        return Role::Bone(bone.to_owned());
    }
    let lower = channel.to_lowercase();
    let number = lower.strip_prefix("tongue").and_then(|n| n.strip_prefix(['_', '-', ' ', '.']));
    if number.is_some_and(|n| n.parse::<u32>().is_ok()) {
        return Role::Contour;
    }
    match normalised(channel).as_str() {
        name if rank_of_coil(name).is_some() => Role::Coil(None),
        name if INCISORS.contains(&name) || BESIDE_INCISORS.contains(&name) => {
            Role::Bone(MANDIBLE.to_owned())
        }
        _ => Role::Ignored,
    }
}

/// The bone that a name means, whatever its case and punctuation.
pub fn bone(channel: &str) -> Option<&'static str> {
    match normalised(channel).as_str() {
        "hyoid" => Some(HYOID),
        "mentalspine" | "shorttendon" => Some(MANDIBLE),
        _ => None,
    }
}

/// Whether the name does not even tell that the channel is not of the tongue.
pub(super) fn is_unknown(channel: &str) -> bool {
    let name = normalised(channel);
    let is_beside = BESIDE_TONGUE.contains(&name.as_str()) || OF_HEAD.iter().any(|of| name.starts_with(of));
    role(channel) == Role::Ignored && lip(channel).is_none() && !is_beside
}

fn rank_of_coil(name: &str) -> Option<u32> {
    COILS.iter().find(|(coil, _)| *coil == name).map(|(_, rank)| *rank)
}

/// Rank of a coil from the tip backwards, by its name.
pub(super) fn rank(channel: &str) -> Option<u32> {
    let name = normalised(channel);
    name.strip_prefix('t').and_then(|number| number.parse().ok()).or_else(|| rank_of_coil(&name))
}

pub(super) fn lip(channel: &str) -> Option<bool> {
    let name = normalised(channel);
    match name.as_str() {
        "ul" | "upperlip" | "ulip" | "lipupper" => Some(true),
        "ll" | "lowerlip" | "llip" | "liplower" => Some(false),
        _ => None,
    }
}

/// Whether the channel is in front of the tongue: a lip, an incisor or the jaw.
pub(super) fn is_in_front(channel: &str) -> bool {
    let plain = normalised(channel);
    lip(channel).is_some() || INCISORS.iter().chain(&["ui", "upperincisor"]).any(|name| *name == plain)
}

pub fn is_coil(channel: &str) -> bool {
    role(channel) == Role::Coil(None)
}

pub(super) fn is_tip(channel: &str) -> bool {
    rank_of_coil(&normalised(channel)) == Some(1)
}
