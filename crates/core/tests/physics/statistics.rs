//! Medians and quantiles.

use tongue_core::statistics::{median, student_95};

#[test]
fn the_median_is_the_middle_value_or_the_mean_of_the_two() {
    assert_eq!(median([9.0, 1.0, 2.0]), Some(2.0));
    assert_eq!(median([4.0, 1.0, 2.0, 1e9]), Some(3.0));
    assert_eq!(median([]), None);
}

#[test]
fn the_quantiles_are_those_of_students_table() {
    for (degrees, table) in [(2.0, 4.303), (3.0, 3.182), (4.0, 2.776), (8.0, 2.306), (30.0, 2.042)] {
        assert!((student_95(degrees) - table).abs() < 4e-3, "{degrees}: {}", student_95(degrees));
    }
}
