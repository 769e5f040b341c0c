//! Statistics over the frames of recordings.

use serde::Serialize;

use super::interval::Interval;
use super::results::Tracked;
use super::softplus::Softplus;

/// What is known of the course of one muscle over all frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CourseSummary {
    pub muscle: String,
    /// Whether its course can be read: it varies by more than it is uncertain, and single frames are narrow enough.
    pub known: bool,
    /// Variance of its course over the frames as part of that and the mean variance of its draws.
    pub reliability: f64,
    /// Mean width of the 95 % intervals of its course, N per metre of thickness.
    pub course_width_n: f64,
    pub level_width_n: f64,
    /// That as part of the prior's width: 1 is all prior, 0 all data.
    pub unknown_part: f64,
}

/// A course is known whose reliability is above this,
const RELIABLE: f64 = 0.5;
/// and whose intervals are narrower than this part of the prior's scale on average: 24 N/m at 20 N/m.
pub const NARROW: f64 = 1.2;
/// Half width of the 95 % interval of a normal distribution in standard deviations.
pub const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// What is known of every muscle over all frames.
pub fn course_summaries(names: &[String], frames: &[&Tracked], link: &Softplus) -> Vec<CourseSummary> {
    let each: Vec<_> = frames.iter().map(|f| (f.levels.as_slice(), f.courses.as_slice())).collect();
    summaries(names, &each, link)
}

/// The same of anything that has levels and courses of all muscles.
pub(super) fn summaries(
    names: &[String],
    all: &[(&[Interval], &[Interval])],
    link: &Softplus,
) -> Vec<CourseSummary> {
    let count = all.len().max(1) as f64;
    let prior_width = link.prior_quantile(TWO_SIDED_95) - link.prior_quantile(-TWO_SIDED_95);
    let course = |(i, name): (usize, &String)| {
        let mean = |of: &dyn Fn(&Interval) -> f64| all.iter().map(|(_, c)| of(&c[i])).sum::<f64>() / count;
        let middle = mean(&|c| c.median);
        let varies = mean(&|c| (c.median - middle).powi(2));
        let unsure = mean(&|c| c.variance);
        let reliability = if varies > 0.0 { varies / (varies + unsure) } else { 0.0 };
        let course_width_n = mean(&Interval::width);
        let level_width_n = all.iter().map(|(l, _)| l[i].width()).sum::<f64>() / count;
        CourseSummary {
            muscle: name.clone(),
            known: reliability > RELIABLE && course_width_n < NARROW * link.scale_n(),
            reliability,
            course_width_n,
            level_width_n,
            unknown_part: level_width_n / prior_width,
        }
    };
    names.iter().enumerate().map(course).collect()
}

/// Part of the frames of a recording that may be untrusted before the recording is.
pub const MOST_UNTRUSTED: f64 = 0.05;

/// Whether too many frames of a recording cannot be trusted.
pub fn is_untrusted(frames: &[Tracked]) -> bool {
    let bad = frames.iter().filter(|f| !f.status.is_trusted()).count();
    bad as f64 > MOST_UNTRUSTED * frames.len() as f64
}
