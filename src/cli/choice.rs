//! Options whose values are choices of the library.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use tongue_fit::choice::{named, names};

/// A parser of the names of a choice.
pub fn choice<T: DeserializeOwned + Clone + Send + Sync + 'static>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names::<T>()).try_map(|name| named(&name).ok_or("not one of them"))
}
