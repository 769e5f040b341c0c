//! Facts about muscles (full names, groups, force capacities, colours), from `targets/takano2007_muscles.csv`, and values by muscle name.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize, Serializer};

use super::built_in_rows;
use super::lengths::position_of;

const REFERENCE: &str = include_str!("../../../../targets/takano2007_muscles.csv");

/// Colours that colour-blind readers can distinguish (Okabe and Ito 2008), for muscles that the table lacks.
pub const PALETTE: [&str; 8] = [
    "#D55E00", // vermillion
    "#E69F00", // orange
    "#F0E442", // yellow
    "#56B4E9", // sky blue
    "#0072B2", // blue
    "#CC79A7", // reddish purple
    "#009E73", // bluish green
    "#000000", // black
];

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct MuscleInfo {
    #[serde(rename = "muscle")]
    pub name: String,
    pub full_name: String,
    /// The whole muscle of this portion, as published patterns of activation name it.
    pub group: String,
    /// The whole muscle whose force capacity its portions share.
    pub capacity_group: Option<String>,
    /// Largest force of the capacity group, all portions and both sides together, N.
    pub capacity_n: Option<f64>,
    /// As in SVG and HTML, like `#D55E00`.
    pub colour: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Capacity {
    pub muscle: String,
    /// Positions of its portions in the given names.
    pub portions: Vec<usize>,
    /// Largest force of both sides together, N.
    pub capacity_n: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Muscles(Vec<MuscleInfo>);

impl Muscles {
    /// The eight portions that Takano and Honda (2007) measured; capacities are those of the public ArtiSynth tongue.
    pub fn built_in() -> &'static Self {
        static BUILT_IN: LazyLock<Muscles> = LazyLock::new(|| Muscles(built_in_rows(REFERENCE)));
        &BUILT_IN
    }

    pub fn all(&self) -> &[MuscleInfo] {
        &self.0
    }

    /// Case does not matter.
    pub fn get(&self, name: &str) -> Option<&MuscleInfo> {
        self.0.iter().find(|m| m.name.eq_ignore_ascii_case(name))
    }

    /// Place of a muscle in the published tables, and its published spelling; case does not matter.
    pub fn published(&self, name: &str) -> Option<(usize, &str)> {
        let place = self.0.iter().position(|m| m.name.eq_ignore_ascii_case(name.trim()))?;
        Some((place, &self.0[place].name))
    }

    /// The facts about `names`, in their order. An unknown muscle has its own name, is a group of its own without capacity, and gets the
    /// next colour of [`PALETTE`] that no known muscle of `names` has; when these are used up, colours repeat.
    pub fn info(&self, names: &[String]) -> Vec<MuscleInfo> {
        let taken: Vec<&str> = names.iter().filter_map(|n| self.get(n)).map(|m| m.colour.as_str()).collect();
        let free = PALETTE.into_iter().filter(|c| !taken.contains(c));
        let mut colours = free.chain(PALETTE.into_iter().cycle());
        Vec::from_iter(names.iter().map(|name| match self.get(name) {
            Some(known) => MuscleInfo { name: name.clone(), ..known.clone() },
            None => MuscleInfo {
                name: name.clone(),
                full_name: name.clone(),
                group: name.clone(),
                capacity_group: None,
                capacity_n: None,
                colour: colours.next().unwrap_or(PALETTE[0]).to_owned(),
            },
        }))
    }

    /// The known force capacities of the muscles with a portion among `names`, in the order of the published tables.
    pub fn capacities(&self, names: &[String]) -> Vec<Capacity> {
        let mut all: Vec<Capacity> = Vec::new();
        for info in &self.0 {
            let (Some(group), Some(capacity_n)) = (&info.capacity_group, info.capacity_n) else { continue };
            let Some(portion) = position_of(names, &info.name) else { continue };
            match all.iter_mut().find(|c| c.muscle == *group) {
                Some(capacity) => capacity.portions.push(portion),
                None => all.push(Capacity { muscle: group.clone(), portions: vec![portion], capacity_n }),
            }
        }
        all
    }
}

/// A value for each muscle. It is serialised as an object `{GGa: .., ..}` in this order, and read in the order of the names.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(from = "BTreeMap<String, T>")]
pub struct ByMuscle<T>(pub Vec<(String, T)>);

impl<T> ByMuscle<T> {
    pub fn new(names: &[String], values: impl IntoIterator<Item = T>) -> Self {
        Self(names.iter().cloned().zip(values).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn get(&self, muscle: &str) -> Option<&T> {
        self.0.iter().find(|(name, _)| name == muscle).map(|(_, value)| value)
    }
}

impl<T> From<BTreeMap<String, T>> for ByMuscle<T> {
    fn from(all: BTreeMap<String, T>) -> Self {
        Self(all.into_iter().collect())
    }
}

impl<T: Serialize> Serialize for ByMuscle<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(muscle, value)| (muscle, value)))
    }
}
