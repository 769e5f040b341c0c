//! A record as it stands in JSON and in the journal: what tables and pages are made of.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A record of a fit as a JSON object, in the order of its fields.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Told(Value);

impl Told {
    pub fn new(record: &impl Serialize) -> serde_json::Result<Self> {
        serde_json::to_value(record).map(Self)
    }

    #[cfg(feature = "files")]
    #[must_use]
    pub(crate) fn with_first(self, name: &str, number: f64) -> Self {
        let Value::Object(fields) = self.0 else { return self };
        Self(std::iter::once((name.to_owned(), number.into())).chain(fields).collect())
    }

    /// The value at a JSON pointer such as `/passive/rms_stretch`; null where there is none.
    pub fn at(&self, pointer: &str) -> &Value {
        self.0.pointer(pointer).unwrap_or(&Value::Null)
    }

    pub fn text(&self, pointer: &str) -> &str {
        self.at(pointer).as_str().unwrap_or_default()
    }

    pub fn number(&self, pointer: &str) -> Option<f64> {
        self.at(pointer).as_f64()
    }

    pub fn is(&self, pointer: &str) -> bool {
        self.at(pointer).as_bool().unwrap_or(false)
    }

    pub fn list(&self, pointer: &str) -> &[Value] {
        self.at(pointer).as_array().map_or(&[], Vec::as_slice)
    }

    pub fn names(&self, pointer: &str) -> Vec<&str> {
        self.list(pointer).iter().filter_map(Value::as_str).collect()
    }

    pub fn lists(&self, pointer: &str, muscle: &str) -> bool {
        self.list(pointer).iter().any(|name| name == muscle)
    }

    pub fn of(&self, pointer: &str, muscle: &str) -> &Value {
        self.at(pointer).get(muscle).unwrap_or(&Value::Null)
    }

    pub fn number_of(&self, pointer: &str, muscle: &str) -> Option<f64> {
        self.of(pointer, muscle).as_f64()
    }

    pub fn muscles(&self, pointer: &str) -> Vec<&str> {
        self.at(pointer).as_object().map_or_else(Vec::new, |all| all.keys().map(String::as_str).collect())
    }
}

impl std::fmt::Display for Told {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
