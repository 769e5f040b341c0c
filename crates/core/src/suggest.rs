//! "Did you mean ...?": the nearest known name to one that was not understood.

/// The candidate nearest to `name`, if any is near enough to be a plausible misspelling.
///
/// Case is ignored; at most half of the letters of `name` (and at least one) may differ.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = name.to_lowercase();
    let limit = (wanted.chars().count() / 2).max(1);
    candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(&wanted, &c.to_lowercase()), c))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, c)| c)
}

/// The end of an error message: `; did you mean "GGa"?` if a name is near, and the names that exist.
pub fn hint<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    let known = candidates.clone().into_iter().collect::<Vec<_>>().join(", ");
    match nearest(name, candidates) {
        Some(near) => format!("did you mean \"{near}\"? (known: {known})"),
        None => format!("known: {known}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_the_nearest_name_and_nothing_far() {
        let names = ["GGa", "GGm", "SGp"];
        assert_eq!(nearest("gga", names), Some("GGa"));
        assert_eq!(nearest("SGpp", names), Some("SGp"));
        assert_eq!(nearest("masseter", names), None);
    }
}
