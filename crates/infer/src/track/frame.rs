//! The observations of a frame, and its equilibrium.

use nalgebra::{DVector, SVector};

use crate::acoustics::FormantFrequency;
use crate::adapt::mean_contour;
use crate::inverse::{BONE_SD_M, MovableBone};
use tongue_core::geometry::Point;
use tongue_core::observe::{Contour, NodePosition as Place, Observation, TongueSurface};
use tongue_core::statics::lanes::{LaneGroup, Lanes, Load};
use tongue_core::statics::{self, Response, Solution, SolveSettings, SolveStatus, Workspace};
use tongue_core::system::System;
use tongue_input::measured::recording::{AlignedFrame, AlignedRecording};

use super::ornstein_uhlenbeck::Softplus;
use super::settings::{Followed, TrackingContext};
use crate::error_model::{Along, distances_along};

/// Number of frames over which the place of a bone is averaged, because its keypoint is as noisy as those of the tongue.
const BONE_WINDOW: usize = 7;

#[derive(Debug, Clone, Default)]
pub struct Frame {
    pub time_s: f64,
    /// Fitted observations with their standard deviations; contour points come first, in order along the contour.
    pub observations: Vec<FrameObservation>,
    /// Held-out observations, of weight 1.
    pub hidden: Vec<FrameObservation>,
    /// Formants that are part of the results ([`add_formants()`](super::add_formants())).
    pub formants: Vec<FormantFrequency>,
    /// Shift of every followed bone from rest, m.
    pub shifts: Vec<SVector<f64, 2>>,
    /// Numbers of the labels at this time.
    pub labels: Vec<usize>,
    /// Labels that are compared, with their numbers among these ([`mark()`](super::mark())).
    pub compared: Vec<(usize, usize)>,
}

#[derive(Debug, Clone)]
pub struct FrameObservation {
    pub name: String,
    /// Distance of the point from the surface, or simulated less measured coordinate, m.
    pub observation: Observation<2>,
    pub along: Along,
}

/// The frames of a recording for a body; contour points and coils in `hide` are not fitted.
pub fn frames(
    recording: &AlignedRecording,
    surface: &TongueSurface,
    followed: &[Followed],
    hide: &[String],
) -> Vec<Frame> {
    let means: Vec<Option<Vec<Option<Point>>>> = Vec::from_iter(
        followed.iter().map(|f| Some(recording.bone_means(recording.bone(&f.name)?, BONE_WINDOW))),
    );
    // Noise makes distances along a single contour longer.
    let along = distances_along(mean_contour(recording), 1e3);
    Vec::from_iter(recording.frames.iter().enumerate().map(|(t, frame)| {
        let places = means.iter().map(|means| means.as_ref().and_then(|means| means[t]));
        let shifts =
            followed.iter().zip(places).map(|(f, at)| at.map_or_else(Point::zeros, |at| at - f.mark));
        frame_of(recording, frame, surface, shifts.collect(), hide, &along)
    }))
}

fn frame_of(
    recording: &AlignedRecording,
    frame: &AlignedFrame,
    surface: &TongueSurface,
    shifts: Vec<SVector<f64, 2>>,
    hide: &[String],
    along: &[f64],
) -> Frame {
    let labels = (0..recording.labels.len()).filter(|&l| recording.labels[l].holds(frame.time_s)).collect();
    let mut out = Frame { time_s: frame.time_s, shifts, labels, ..Frame::default() };
    let mut add = |name: &String, observation: Observation<2>, along: Along, sd_m: f64| {
        let name = name.clone();
        if hide.contains(&name) {
            out.hidden.push(FrameObservation { name, observation, along });
        } else {
            let observation = observation.with_standard_deviation(sd_m);
            out.observations.push(FrameObservation { name, observation, along });
        }
    };
    for ((name, mark), &at_mm) in recording.contour.iter().zip(&frame.contour).zip(along) {
        let Some(mark) = mark else { continue };
        let contour = Contour::new(surface.curve.clone(), mark.at);
        let along = Along { channel: 0, at_mm, sd_mm: mark.sd * 1e3 };
        add(name, Observation::new(contour, 0.0), along, mark.sd);
    }
    for ((name, behind), mark) in recording.sensors.iter().zip(&frame.sensors) {
        let Some(mark) = mark else { continue };
        let at = (surface.tip - behind).clamp(0.0, surface.curve.length());
        for (axis, direction) in [SVector::x(), SVector::y()].into_iter().enumerate() {
            let place = Place::on_curve(&surface.curve, at, direction);
            let along = Along { channel: 1 + axis, at_mm: -behind * 1e3, sd_mm: mark.sd * 1e3 };
            add(name, Observation::new(place, mark.at[axis]), along, mark.sd);
        }
    }
    out
}

/// A frame, its unknowns (tensions before the transform, displacements of bones in standard deviations), and the positions from which its solve
/// starts, if any.
pub type FramePosture<'a> = (&'a Frame, &'a DVector<f64>, Option<&'a [Point]>);

pub struct FrameSolver<'a> {
    pub system: &'a System<2>,
    pub followed: &'a [Followed],
    pub(super) freed: &'a [MovableBone<2>],
    pub(super) link: Softplus,
    /// Lanes for several frames, made when they are first used.
    group: Option<LaneGroup<'a, 2>>,
    pub(super) workspace: Workspace<2>,
    pub(super) tensions: Vec<f64>,
}

impl<'a> FrameSolver<'a> {
    /// Solves frames with unknowns for each contracting muscle and then two for each freed bone.
    pub fn new(context: TrackingContext<'a>, link: Softplus) -> Self {
        let TrackingContext { system, followed, freed, .. } = context;
        let workspace = Workspace::new(system);
        let tensions = vec![0.0; system.muscle_count()];
        Self { system, followed, freed, link, group: None, workspace, tensions }
    }

    /// Tensions of all muscles of the body, N per metre of thickness, at these unknowns.
    pub fn tensions_of(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut all = vec![0.0; self.system.muscle_count()];
        for (&muscle, g) in self.system.contracting().iter().zip(x.iter()) {
            all[muscle] = self.link.tension(*g).0;
        }
        all
    }

    /// Solves the equilibrium of the body at these unknowns with the bones of this frame, from given positions or from rest.
    pub fn solve(
        &mut self,
        frame: &Frame,
        x: &DVector<f64>,
        from: Option<&[SVector<f64, 2>]>,
    ) -> Option<&[SVector<f64, 2>]> {
        self.tensions = self.tensions_of(x);
        self.displace_bones(frame, x);
        let warm = from.is_some_and(|positions| {
            self.workspace.start_from(positions);
            self.solve_here().status == SolveStatus::Converged
        });
        if !warm {
            self.workspace.start_from_rest(self.system);
            if self.solve_here().status != SolveStatus::Converged {
                return None;
            }
        }
        Some(self.workspace.positions())
    }

    /// Solves from the present shape with the present tensions and displacements.
    pub(super) fn solve_here(&mut self) -> Solution {
        statics::solve(self.system, &mut self.workspace, &self.tensions, &SolveSettings::default())
    }

    pub(super) fn displace_bones(&mut self, frame: &Frame, x: &DVector<f64>) {
        for (nodes, shift) in self.bones(frame, x) {
            self.workspace.displace_bone(self.system, nodes, shift);
        }
    }

    pub(super) fn group(&mut self) -> &mut LaneGroup<'a, 2> {
        self.group.get_or_insert_with(|| Lanes::new(self.system).group())
    }

    pub(super) fn load<'l>(&self, (frame, x, start): FramePosture<'l>) -> Load<'l, 2>
    where
        'a: 'l,
    {
        Load { bones: self.bones(frame, x), start, ..Load::new(self.tensions_of(x)) }
    }

    /// Nodes and displacements, m, of all moved bones of a frame.
    fn bones(&self, frame: &Frame, x: &DVector<f64>) -> Vec<(&'a [usize], SVector<f64, 2>)> {
        let followed = self.followed.iter().zip(&frame.shifts).map(|(f, shift)| (f.nodes.as_slice(), *shift));
        let displacements = x.as_slice().get(self.system.contracting().len()..).unwrap_or_default();
        let freed = self.freed.iter().zip(displacements.chunks_exact(2));
        let freed = freed.map(|(bone, c)| (bone.nodes(), SVector::from([c[0], c[1]]) * BONE_SD_M));
        followed.chain(freed).collect()
    }

    pub fn response(&mut self) -> Option<Response<'_, 2>> {
        Response::new(self.system, &mut self.workspace)
    }
}

/// Simulated less measured values of all fitted observations, in standard deviations.
pub fn residuals(frame: &Frame, positions: &[SVector<f64, 2>]) -> DVector<f64> {
    let residuals = frame.observations.iter().map(|o| o.observation.residual(positions));
    DVector::from_iterator(frame.observations.len(), residuals)
}
