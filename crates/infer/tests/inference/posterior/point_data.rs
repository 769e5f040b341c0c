//! Errors of coils' places on the tongue.

use tongue_infer::posterior::point_data::glue;
use tongue_input::measured::recording::AlignedRecording;

#[test]
fn a_coil_behind_a_measured_one_is_as_uncertain_as_the_gap() {
    let mut recording = AlignedRecording {
        sensors: (1..).zip([0.01, 0.026, 0.042]).map(|(i, behind)| (format!("T{i}"), behind)).collect(),
        measured: vec![false; 3],
        ..AlignedRecording::of_contours(&[])
    };
    let sds = |recording: &AlignedRecording, coil| {
        glue(recording, coil).iter().map(|(_, sd)| *sd).collect::<Vec<_>>()
    };
    assert_eq!(sds(&recording, 2), [4e-3, 2e-3, 2e-3]);
    recording.measured[1] = true;
    assert_eq!(sds(&recording, 2), [1e-3, 2e-3]);
    assert_eq!(sds(&recording, 0), [4e-3]);
}
