//! Values by muscle name.

use serde::{Serialize, Serializer};

/// A value for each of some muscles, serialised as an object `{GGa: .., ..}` in their order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ByMuscle<T>(pub Vec<(String, T)>);

impl<T> ByMuscle<T> {
    pub fn new(names: &[String], values: impl IntoIterator<Item = T>) -> Self {
        Self(names.iter().cloned().zip(values).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn of(&self, muscle: &str) -> Option<&T> {
        self.0.iter().find(|(name, _)| name == muscle).map(|(_, value)| value)
    }
}

impl<T: Serialize> Serialize for ByMuscle<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(muscle, value)| (muscle, value)))
    }
}
