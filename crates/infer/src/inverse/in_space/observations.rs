//! Observations of a body in space from marks.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use tongue_core::body::space::{Half, Side};
use tongue_core::body::{Body, Mesh};
use tongue_core::observe::{
    Contour, Curve, Line, LineEnd, Midsagittal, NodePosition, Observable, Observation, Ratio, Stretch,
    Surface, TongueSurface,
};
use tongue_input::measured::{LengthMeasure, Marked, SpaceMark};

use crate::inverse::{FitError, refused};

/// The muscle by whose length ratios are divided if no other is named, and the line by which lines are divided (Kato 2014, 4.3.1).
const OVER: &str = "GGA";
const OVER_LINE: &str = "GGa";

/// A body whose marks become observations. The surface and the midline are made when the first mark needs them.
pub(super) struct Observed<'a> {
    body: &'a Body<3>,
    surface: Option<Arc<[[usize; 3]]>>,
    midline: Option<Midline>,
}

/// The midsagittal surface curve of a body.
struct Midline {
    nodes: Arc<[usize]>,
    /// The curve through them, with the numbers of that list.
    curve: Curve,
    /// Distance along the curve of the tip at rest, m.
    tip: f64,
}

/// Observations of one mark: their sum of squared residuals, times the square of its standard deviation, is the squared distance to it, m².
type OfMark = Vec<Observation<3>>;

impl<'a> Observed<'a> {
    pub(super) fn new(body: &'a Body<3>) -> Self {
        Self { body, surface: None, midline: None }
    }

    pub(super) fn observations_of(&mut self, mark: &SpaceMark) -> Result<OfMark, FitError> {
        let SpaceMark { what, sd_m } = mark;
        let sd_m = *sd_m;
        if !(sd_m.is_finite() && sd_m > 0.0 && is_finite(what)) {
            return refused(format!("{} or its standard deviation is no number", description(what)));
        }
        match what {
            Marked::Node { node, place } => {
                let count = self.body.mesh.nodes.len();
                if *node >= count {
                    return refused(format!("node {} was seen, but the body has {count} nodes", node + 1));
                }
                Ok(coordinates(|axis| NodePosition::node(*node, axis), &[0, 1, 2], place, sd_m))
            }
            Marked::Surface(place) => Ok(vec![observation(Surface::new(self.surface(), *place), 0.0, sd_m)]),
            Marked::Contour(place) => {
                let midline = self.midline()?;
                let contour = Contour::new(midline.curve.clone(), *place);
                Ok(vec![observation(Midsagittal::new(midline.nodes.clone(), contour), 0.0, sd_m)])
            }
            Marked::Coil { behind_tip_m, place } => {
                let Midline { nodes, curve, tip } = self.midline()?;
                if behind_tip_m > tip {
                    return refused(format!(
                        "a coil lies {:.0} mm behind the tip, but the surface is {:.0} mm long from there to the hyoid",
                        1e3 * behind_tip_m,
                        1e3 * *tip
                    ));
                }
                let weights: Vec<(usize, f64)> =
                    curve.weights(tip - behind_tip_m).into_iter().map(|(i, w)| (nodes[i], w)).collect();
                let place = Vector3::new(place.x, 0.0, place.y);
                Ok(coordinates(|axis| NodePosition::mean(weights.clone(), axis), &[0, 2], &place, sd_m))
            }
            Marked::Muscle { muscle, measure } => {
                let sides = self.measured(muscle)?;
                // Each side of a pair has the measured length, and both together count as one measurement.
                let sd_m = sd_m * (sides.len() as f64).sqrt();
                let usual = if self.line(muscle).is_some() { OVER_LINE } else { OVER };
                let over = match measure {
                    LengthMeasure::Ratio(_, over) => self.measured(over.as_deref().unwrap_or(usual))?,
                    _ => Vec::new(),
                };
                let marks = sides.into_iter().enumerate().map(|(number, (length, rest))| match measure {
                    LengthMeasure::Length(m) => Ok(observation(length, *m, sd_m)),
                    LengthMeasure::Stretch(stretch) => {
                        Ok(observation(Stretch::new(length, rest), *stretch, sd_m / rest))
                    }
                    LengthMeasure::Ratio(ratio, _) => match over.get(number).or(over.first()) {
                        Some((other, rest)) => {
                            Ok(observation(Ratio::new(length, other.clone()), *ratio, sd_m / rest))
                        }
                        None => {
                            refused(format!("nothing is known of the length that {muscle} is compared with"))
                        }
                    },
                });
                marks.collect()
            }
        }
    }

    fn line(&self, name: &str) -> Option<&Line<3>> {
        let is_muscle = self.body.muscles.iter().any(|m| m.name == name || m.group == name);
        self.body.lines.iter().find(|(known, _)| known == name && !is_muscle).map(|(_, line)| line)
    }

    /// The measuring fibres of a muscle, or the line of this name, with their lengths at rest, m.
    fn measured(&self, name: &str) -> Result<Vec<(Line<3>, f64)>, FitError> {
        let Mesh { nodes, muscles, .. } = &self.body.mesh;
        let with_rest = |line: Line<3>| {
            let rest = line.value(nodes);
            (line, rest)
        };
        if let Some(line) = self.line(name) {
            return Ok(vec![with_rest(line.clone())]);
        }
        // A line and a fibre may have names that differ only by case, as GGa and GGA; any other spelling may mean either.
        let is_like = |known: &&str| known.eq_ignore_ascii_case(name);
        let groups = self.body.groups();
        let muscle = groups.iter().map(String::as_str).find(is_like).filter(|known| *known != name);
        let line = self.body.lines.iter().map(|(known, _)| known.as_str()).find(is_like);
        if let (Some(line), Some(muscle)) = (line, muscle) {
            return refused(format!(
                "\"{name}\" may be {line} or {muscle}; write {line} (line of the plane) or {muscle} (fibre in space)"
            ));
        }
        let numbers = self.body.both_sides(name).or_else(|error| refused(error.to_string()))?;
        let fibres =
            numbers.into_iter().map(|m| with_rest(Line { ends: muscles[m].ends().map(LineEnd::node) }));
        Ok(fibres.collect())
    }

    /// Triangles of the surface; of a half without its midsagittal cut.
    fn surface(&mut self) -> Arc<[[usize; 3]]> {
        let Mesh { nodes, .. } = &self.body.mesh;
        let near = 1e-6 * self.body.mesh.extent();
        let is_cut = |t: &[usize; 3]| t.iter().all(|&n| nodes[n].y.abs() <= near);
        let made = || self.body.mesh.outward_faces().into_iter().filter(|t| !is_cut(t)).collect();
        self.surface.get_or_insert_with(made).clone()
    }

    fn midline(&mut self) -> Result<&Midline, FitError> {
        if self.midline.is_none() {
            self.midline = Midline::of(self.body);
        }
        let why = "the body has no faces in its midsagittal plane (y = 0), so it has no contour there";
        self.midline.as_ref().map_or_else(|| refused(why), Ok)
    }
}

impl Midline {
    fn of(body: &Body<3>) -> Option<Self> {
        let section = body.section();
        let TongueSurface { curve, tip } = TongueSurface::with_tip(&section, body.tip_node)?;
        let nodes = curve.nodes().to_vec();
        let rest: Vec<Vector2<f64>> = nodes.iter().map(|&n| section.mesh.nodes[n]).collect();
        Some(Self { curve: Curve::through((0..nodes.len()).collect(), &rest)?, nodes: nodes.into(), tip })
    }
}

fn observation(observable: impl Observable<3> + 'static, measured: f64, sd: f64) -> Observation<3> {
    Observation::new(observable, measured).with_standard_deviation(sd)
}

fn coordinates(
    point: impl Fn(Vector3<f64>) -> NodePosition<3>,
    axes: &[usize],
    place: &Vector3<f64>,
    sd_m: f64,
) -> OfMark {
    axes.iter().map(|&axis| observation(point(Vector3::ith(axis, 1.0)), place[axis], sd_m)).collect()
}

fn is_finite(what: &Marked) -> bool {
    match what {
        Marked::Node { place, .. } | Marked::Surface(place) => place.iter().all(|c| c.is_finite()),
        Marked::Contour(place) => place.iter().all(|c| c.is_finite()),
        Marked::Coil { behind_tip_m, place } => {
            behind_tip_m.is_finite() && place.iter().all(|c| c.is_finite())
        }
        Marked::Muscle {
            measure: LengthMeasure::Length(v) | LengthMeasure::Stretch(v) | LengthMeasure::Ratio(v, _),
            ..
        } => v.is_finite(),
    }
}

fn description(what: &Marked) -> String {
    match what {
        Marked::Node { node, .. } => format!("the place of node {}", node + 1),
        Marked::Surface(_) => "a point of the surface".to_owned(),
        Marked::Contour(_) => "a point of the contour".to_owned(),
        Marked::Coil { .. } => "the place of a coil".to_owned(),
        Marked::Muscle { muscle, .. } => format!("the length of {muscle}"),
    }
}

/// A mark of the whole as a mark of its left half; `None` where a node has no image there.
pub(super) fn on_half(half: &Half, whole: &Body<3>, mark: &SpaceMark) -> Option<SpaceMark> {
    let name = |name: &str| {
        let right = whole.muscles.iter().find(|m| m.side == Side::Right && m.name.eq_ignore_ascii_case(name));
        right.map_or_else(|| name.to_owned(), |right| right.group.clone())
    };
    let what = match &mark.what {
        Marked::Node { node, place } => {
            let (node, place) = half.place_on_half(*node, place)?;
            Marked::Node { node, place }
        }
        Marked::Surface(place) => Marked::Surface(Vector3::new(place.x, -place.y.abs(), place.z)),
        Marked::Muscle { muscle, measure } => {
            let measure = match measure {
                LengthMeasure::Ratio(ratio, over) => LengthMeasure::Ratio(*ratio, over.as_deref().map(name)),
                other => other.clone(),
            };
            Marked::Muscle { muscle: name(muscle), measure }
        }
        other => other.clone(),
    };
    Some(SpaceMark { what, ..*mark })
}
