//! Recordings that are done, kept so that a run that was killed goes on after them.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use tongue_fit::adapt::Adaptation;
use tongue_fit::body::Body;
use tongue_fit::geometry::Point;
use tongue_fit::measured::recording::Fault;
use tongue_fit::report::batch::journal::Kept;
use tongue_fit::track::{FrameStatus, Tracked};

/// Longer recordings are not kept: their entry would be larger than a journal takes.
pub const MOST_FRAMES: usize = 5000;

/// A recording with the body that it was tracked with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptRecording {
    what: String,
    /// Nodes of the body at rest, m.
    nodes: Vec<[f64; 2]>,
    /// How it came to be; none where it was given.
    pub adaptation: Option<Adaptation>,
    frames: Vec<KeptFrame>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KeptFrame {
    time_s: f64,
    status: FrameStatus,
    scores: Vec<f64>,
    covariance: Vec<f64>,
    tensions_n: Vec<f64>,
    low_n: Vec<f64>,
    high_n: Vec<f64>,
    rms_m: Option<f64>,
    hidden: Vec<(String, f64)>,
    resolved: usize,
    positions: Vec<[f64; 2]>,
    faults: Vec<Fault>,
}

impl Kept for KeptRecording {
    type Digest = ();

    fn digest(&self) -> Self::Digest {}
}

impl KeptRecording {
    /// What was found of a recording.
    pub fn new(body: &Body<2>, adaptation: Option<Adaptation>, frames: &[Tracked]) -> Self {
        let pairs = |points: &[Point]| points.iter().map(|p| [p.x, p.y]).collect::<Vec<_>>();
        let frame = |f: &Tracked| KeptFrame {
            time_s: f.time_s,
            status: f.status,
            scores: f.scores.as_slice().to_vec(),
            covariance: f.covariance.as_slice().to_vec(),
            tensions_n: f.tensions_n.clone(),
            low_n: f.low_n.clone(),
            high_n: f.high_n.clone(),
            rms_m: f.rms_m,
            hidden: f.hidden.clone(),
            resolved: f.resolved,
            positions: pairs(&f.positions),
            faults: f.faults.clone(),
        };
        Self {
            what: body.what.clone(),
            nodes: pairs(&body.mesh.nodes),
            adaptation,
            frames: frames.iter().map(frame).collect(),
        }
    }

    /// The body, made of the one that it was adapted from.
    pub fn body(&self, of: &Body<2>) -> Body<2> {
        let mut body = Body { what: self.what.clone(), ..of.clone() };
        if self.adaptation.is_some() {
            body.palate = None;
        }
        body.mesh.nodes = self.nodes.iter().copied().map(Point::from).collect();
        body
    }

    /// The frames.
    pub fn frames(&self) -> Vec<Tracked> {
        let frame = |f: &KeptFrame| {
            let n = f.scores.len();
            Tracked {
                time_s: f.time_s,
                status: f.status,
                scores: DVector::from_column_slice(&f.scores),
                covariance: DMatrix::from_column_slice(n, f.covariance.len() / n.max(1), &f.covariance),
                tensions_n: f.tensions_n.clone(),
                low_n: f.low_n.clone(),
                high_n: f.high_n.clone(),
                rms_m: f.rms_m,
                hidden: f.hidden.clone(),
                resolved: f.resolved,
                positions: f.positions.iter().copied().map(Point::from).collect(),
                faults: f.faults.clone(),
            }
        };
        self.frames.iter().map(frame).collect()
    }
}
