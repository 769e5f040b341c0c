//! The standard deviations of the model, with lengths and times over which errors are correlated. `tongue-fit priors` prints them below
//! [`Priors`](crate::posterior::Priors), some of whose defaults are rows of this table; the other rows are changed by no file of priors.

use tongue_input::measured::recording::{CONTOUR_SD_M, SENSOR_SD_M};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandardDeviation {
    /// Name of its constant, which ends with its unit: `MM`, `M`, `DEG`, `S`, `N` (per metre of thickness); others are ratios.
    pub name: &'static str,
    pub value: f64,
    pub what: &'static str,
}

/// A line `NAME = value, "what it is";` becomes a constant and a row of the table.
macro_rules! table {
    ($($name:ident = $value:expr, $what:literal;)*) => {
        $(#[doc = $what] pub const $name: f64 = $value;)*

        /// Rows in the order in which they are printed.
        pub const TABLE: &[StandardDeviation] =
            &[$(StandardDeviation { name: stringify!($name), value: $value, what: $what },)*];
    };
}

table! {
    TENSION_N = 20.0, "scale of tensions: of the half-normal ones of a posterior, and of those of `track`, whose other numbers are for this scale";
    BEND_N = 3.0, "`track`: tension at which its transform turns from an exponential into a straight line";
    LEVEL_MIDDLE_N = 13.456, "`track`: middle of a level, which makes its median that of a half-normal tension, 0.674 of the scale";
    LEVEL_N = 16.0, "`track`: level of a muscle; 97.5 % of levels lie below 2.241 of the scale, as of half-normal tensions";
    SHOWN_LEVEL = 0.5, "`track`: level while the shape of the pictures is found, as a part of the scale";
    COURSE_N = 12.0, "`track`: course of a muscle about its level";
    MEMORY_S = 0.1, "`track`: time over which the course of a muscle and the displacement of a bone are correlated";
    ACTIVATION = 0.5, "activation of a muscle in space";
    STRETCH = 0.03, "error of the model in a stretch";
    STRETCH_OF_BASELINE = 0.045, "further error of the model in a stretch of a vowel alone against a baseline in which muscles pull";
    STRETCH_OF_BASELINE_IN_SPACE = 0.065, "the same in space, where the hyoid stays in its place";
    HYOID_MM = 5.0, "displacement of a movable bone, and distance of the hyoid at rest from where it is seen";
    SPINE_MM = 2.5, "distance of the mental spine at rest from where it is seen";
    CONTOUR_MM = 3.0, "distance of a mean contour from the surface at rest, by which a body is placed";
    TURN_DEG = 20.0, "turn of a body placed by a contour";
    LN_SCALE = 0.15, "logarithm of the scale of a body placed by a contour";
    COILS_TURN_DEG = 15.0, "turn of a body placed by coils";
    COILS_LN_SCALE = 0.1, "logarithm of the scale of a body placed by coils";
    COILS_SHIFT_M = 0.1, "shift of a body placed by coils; it is so large that it has no effect";
    FIRST_COIL_MM = 4.0, "distance of the first coil behind the tip";
    COIL_GAP_MM = 2.0, "distance of a coil behind the one before it";
    MEASURED_COIL_MM = 1.0, "a measured distance of a coil";
    POSTURE_MM = 5.0, "difference from rest of a posture by which points are placed: of the mean one of coils, and of each beside lengths";
    POSTURE_FAR_MM = 20.0, "length over which the difference of a posture from rest is correlated";
    POSTURE_ALONE_MM = 1.0, "difference of a posture from rest, of each point independently";
    PALATE_MM = 3.0, "difference of a palate from that of the body";
    PALATE_FAR_MM = 15.0, "length over which the difference of a palate is correlated";
    PALATE_ALONE_MM = 0.5, "difference of a palate from that of the body, of each point independently";
    PALATE_TILT_DEG = 4.0, "tilt of a palate";
    LEFT_SHIFT_MM = 5.0, "shift along an axis that placing by a contour leaves open";
    LEFT_TURN_DEG = 9.0, "turn that placing by a contour leaves open";
    LEFT_SCALE = 0.1, "scale that placing by a contour leaves open";
    SHEAR = 0.08, "shear of the shape at rest";
    CONTROL_MM = 5.0, "displacement of a control point of the shape at rest";
    CONTROL_BONE_MM = 2.0, "displacement of a control point on a bone";
    CONTROL_FAR_MM = 15.0, "length over which displacements of control points are correlated";
    CONTROL_ALONE_MM = 0.7, "displacement of a control point, of each point independently";
    LN_AREA = 0.4, "logarithm of the area of a cell of the shape at rest";
    MUSCLE_END_MM = 3.0, "displacement of the end of a muscle";
    FAR_END_MM = 8.0, "displacement of the end of a muscle on a bone that is not seen";
    CONTOUR_POINT_M = CONTOUR_SD_M, "own error of a contour point of a recording, where its file gives none";
    COIL_M = SENSOR_SD_M, "own error of a coil of a recording, where its file gives none";
    SLOW_MM = 0.7, "error of a contour that is remembered from frame to frame";
    STATIC_MM = 0.7, "error of a contour that all frames share";
    ERRORS_FAR_MM = 15.0, "length over which the two errors of a contour are correlated";
    POINTS_APART_MM = 9.0, "distance of points whose own errors are independent";
    FRAMES_APART_S = 0.0125, "time between frames whose own errors are independent";
    SPACE_MARK_MM = 0.5, "a coordinate, distance or length in space, where its table gives none";
    DRAWN_CONTOUR_MM = 0.5, "a contour that was drawn for a body";
    DRAWN_SPINE_MM = 1.0, "a mental spine that was drawn for a body";
    EMG = 0.4, "logarithm of an activity";
    EMG_GAIN = 30.0, "logarithm of the gain of an electrode, which is free";
    FORMANT = 0.15, "error of the walls of a vocal tract in a formant, as a part of its frequency";
}
