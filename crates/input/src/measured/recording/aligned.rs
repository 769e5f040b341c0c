//! A recording in the frame of a body: metres, x to the back of the head, y up.

use tongue_core::geometry::Point;

use super::Label;
use super::map::{BONE_POINT_SD_M, CONTOUR_SD_M, Stated};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    pub at: Point,
    pub sd: f64,
}

/// Its lists are in the order of those of [`AlignedRecording`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedFrame {
    pub time_s: f64,
    pub contour: Vec<Option<Mark>>,
    pub sensors: Vec<Option<Mark>>,
    pub bones: Vec<Option<Point>>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct AlignedRecording {
    pub name: String,
    pub speaker: Option<String>,
    pub contour: Vec<String>,
    /// Names of the sensors, and the distance of each behind the tip along the surface at rest, m; if distances were not measured, in order
    /// from the tip.
    pub sensors: Vec<(String, f64)>,
    /// Whether the distance of each sensor was measured; otherwise it is a usual one.
    pub measured: Vec<bool>,
    pub bones: Vec<String>,
    pub ignored: Vec<String>,
    /// Whether the axis to the back of the head is reversed against the file, so that the face looks to the right.
    pub mirrored: bool,
    pub notes: Vec<String>,
    /// What the map states; plausibility checks do not contradict it.
    pub stated: Stated,
    pub labels: Vec<Label>,
    pub frames: Vec<AlignedFrame>,
}

impl AlignedFrame {
    /// The points of the contour, then the sensors.
    pub fn points(&self) -> impl Iterator<Item = Option<Mark>> {
        self.contour.iter().chain(&self.sensors).copied()
    }

    /// The points of the tongue, then the bones, in the order of [`AlignedRecording::names`].
    pub(super) fn all(&self) -> impl Iterator<Item = Option<Mark>> {
        self.points().chain(self.bones.iter().map(|bone| bone.map(|at| Mark { at, sd: BONE_POINT_SD_M })))
    }

    /// Removes a point, by its number in [`AlignedRecording::names`].
    pub(super) fn remove_point(&mut self, point: usize) {
        let tongue = self.contour.len() + self.sensors.len();
        match self.contour.iter_mut().chain(&mut self.sensors).nth(point) {
            Some(mark) => *mark = None,
            None => self.bones[point - tongue] = None,
        }
    }
}

impl AlignedRecording {
    /// The points of the contour, then the sensors, then the bones.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        self.contour.iter().chain(self.sensors.iter().map(|(name, _)| name)).chain(&self.bones)
    }

    /// Times and positions of a point (its number in `names`) in the frames that show it.
    pub(super) fn positions_over_time(&self, point: usize) -> impl Iterator<Item = (f64, Mark)> {
        self.frames.iter().filter_map(move |f| Some((f.time_s, f.all().nth(point)??)))
    }

    /// A recording of contours in the frame of a body, m; each is a frame.
    pub fn of_contours(contours: &[&[Point]]) -> Self {
        let most = contours.iter().map(|c| c.len()).max().unwrap_or(0);
        let frames = contours.iter().map(|points| AlignedFrame {
            contour: (0..most).map(|i| points.get(i).map(|&at| Mark { at, sd: CONTOUR_SD_M })).collect(),
            ..AlignedFrame::default()
        });
        Self {
            contour: (1..=most).map(|i| format!("point {i}")).collect(),
            frames: frames.collect(),
            ..Self::default()
        }
    }

    pub fn bone(&self, name: &str) -> Option<usize> {
        self.bones.iter().position(|b| b == name)
    }

    /// The recording with other distances of coils behind the tip, m: those that `behind` returns for a name and whether its distance was
    /// measured. A coil for which it returns `None` keeps its distance.
    #[must_use]
    pub fn with_coils(&self, behind: impl Fn(&str, bool) -> Option<f64>) -> Self {
        let mut recording = self.clone();
        for ((name, at), measured) in recording.sensors.iter_mut().zip(&recording.measured) {
            *at = behind(name, *measured).unwrap_or(*at);
        }
        recording
    }

    pub fn shows_bone(&self, name: &str) -> bool {
        self.bone(name).is_some_and(|b| self.frames.iter().any(|f| f.bones[b].is_some()))
    }

    /// Mean position of a bone over `window` frames around each frame (fewer at the ends and where it was not seen), m; if it was seen in
    /// none of them, that in the nearest frame; `None` if it was never seen.
    pub fn bone_means(&self, bone: usize, window: usize) -> Vec<Option<Point>> {
        let at = |f: usize| self.frames[f].bones.get(bone).copied().flatten();
        let count = self.frames.len();
        let seen: Vec<usize> = (0..count).filter(|&f| at(f).is_some()).collect();
        let half = window / 2;
        Vec::from_iter((0..count).map(|f| {
            let near = (f.saturating_sub(half)..(f + half + 1).min(count)).filter_map(at);
            let near: Vec<Point> = near.collect();
            let nearest = || seen.iter().min_by_key(|s| s.abs_diff(f)).and_then(|&s| at(s));
            if near.is_empty() { nearest() } else { Some(near.iter().sum::<Point>() / near.len() as f64) }
        }))
    }
}
