//! Places and words of mistakes in TOML.

use tongue_core::toml_text::{Misread, line_and_column, read};

#[test]
fn a_mistake_has_its_line_and_column_in_characters() {
    let read = |text: &str| read::<std::collections::BTreeMap<String, f64>>(text).unwrap_err();
    let Misread { line, column, problem } = read("a = 1.0\n\"ä\" = x\n");
    assert_eq!((line, column), (2, 7), "{problem}");
    let Misread { problem, .. } = read("a = true");
    assert_eq!(problem, "there is a wrong kind of value, boolean `true`; needed is a number");
    for (text, expected) in
        [("a = 1.0\na = 2.0", "this name is given a second time"), ("ä = 1.0", "must be in double quotes")]
    {
        let Misread { problem, .. } = read(text);
        assert!(problem.contains(expected), "{problem}");
    }
    assert_eq!(line_and_column("ä\nb", 3), (2, 1));
}
