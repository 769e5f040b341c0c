//! Places a body by coils on the tongue (electromagnetic articulography, X-ray microbeam).
//!
//! ```text
//! minimise  |L^-1 (mean places - places on the placed surface)|² + (turn / 15°)² + (ln scale / 0.10)²
//!         + ((first - 8 mm) / 4 mm)² + sum ((gap_i - 1.03 chord_i) / 2 mm)² + |M^-1 (trace - vault)|²
//! ```
//! over shift, turn, scale and the distance of each coil behind the tip. The mean posture differs from rest by a Gaussian process along the
//! tongue (5 mm, correlated over 20 mm, and 1 mm for each coil: `L L'`). The palate of a speaker differs from that of the body by another
//! one (3 mm, correlated over 15 mm, and a tilt of 4°, the variation of the palatal plane in cephalometry: `M M'`). Three coils determine
//! the turn to about 9°, the shift to 5 mm and the scale to a tenth, so intervals of tensions include this uncertainty ([`Placement`]).

use nalgebra::{DMatrix, DVector};

use tongue_core::body::Body;
use tongue_core::geometry::{NaturalSpline, Point, Similarity};
use tongue_core::statistics::{TWO_SIDED_95, least_by};
use tongue_input::measured::recording::{AlignedRecording, FIRST_COIL_M, LONGER_THAN_CHORD};

use super::{RestError, centre_of, median_point, outline_of};
use crate::error_model::{bell, distances_along};
use crate::least_squares::{jacobian_by_differences, minimise};
use crate::standard_deviations as sd;

pub(super) const FEWEST_COILS: usize = 3;
/// Standard deviation of the turn relative to the axes of the recording, rad.
const TURN_SD: f64 = sd::COILS_TURN_DEG.to_radians();
/// Standard deviation, correlation length and independent standard deviation of each point: of the mean posture about rest, and of the
/// palate about that of the body.
const POSTURE_MM: [f64; 3] = [sd::POSTURE_MM, sd::POSTURE_FAR_MM, sd::POSTURE_ALONE_MM];
const PALATE_MM: [f64; 3] = [sd::PALATE_MM, sd::PALATE_FAR_MM, sd::PALATE_ALONE_MM];
const PALATE_POINTS: usize = 9;
/// A palate that is steeper than this relative to its rear half is gum and teeth, which differ more between speakers.
const STEEPEST: f64 = 0.8;
/// Length by which a palate is extended in a straight line beyond its ends, m.
const BEYOND_M: f64 = 30e-3;
/// Units of the search: of shifts and of distances, m.
pub(super) const SHIFT_UNIT_M: f64 = 10e-3;
const COIL_UNIT_M: f64 = 4e-3;
/// Turns from which the search begins, rad.
pub(super) const TURNS: [f64; 3] = [0.0, -0.3, 0.3];

#[derive(Debug, Clone, PartialEq)]
pub struct Coil {
    pub name: String,
    /// Its median place, m.
    pub at: Point,
    /// Its distance behind the tip along the tongue, m, if it was measured.
    pub behind: Option<f64>,
    /// Whether only its distance from its neighbours is used.
    pub is_hidden: bool,
}

/// A placement of a body by coils, with its uncertainty.
#[derive(Debug, Clone)]
pub struct Placement {
    /// Brings the body into the frame of the recording.
    pub similarity: Similarity,
    /// The middle of the placed body's outline, about which it is turned and scaled, m.
    pub centre: Point,
    /// For every coil, its distance behind the tip along the placed body at rest, m.
    pub coils: Vec<(String, f64)>,
    /// Standard deviations of the shift of the centre along both axes (m), of the turn (rad) and of the logarithm of the scale.
    pub sd: [f64; 4],
    /// Precision and gradient of the placement from all but the places of the coils, relative to the placed body, in units of one metre of
    /// shift along each axis, one radian of turn, one of the logarithm of the scale, and one metre of each coil along the surface.
    pub known: (DMatrix<f64>, DVector<f64>),
}

/// The coils of recordings in order from the tip; coils with one name in several recordings are one coil.
pub(super) fn coils(recordings: &[&AlignedRecording], hide: &[String]) -> Vec<Coil> {
    let mut out: Vec<(f64, Coil)> = Vec::new();
    for one in recordings {
        for (n, (name, behind)) in one.sensors.iter().enumerate() {
            if out.iter().any(|(_, c)| c.name == *name) {
                continue;
            }
            let places = recordings
                .iter()
                .filter_map(|s| Some((s, s.sensors.iter().position(|(other, _)| other == name)?)))
                .flat_map(|(s, n)| s.frames.iter().filter_map(move |f| Some(f.sensors.get(n)?.as_ref()?.at)));
            if let Some(at) = median_point(places) {
                let measured = one.measured.get(n).copied().unwrap_or(false);
                let (name, is_hidden) = (name.clone(), hide.contains(name));
                out.push((*behind, Coil { name, at, behind: measured.then_some(*behind), is_hidden }));
            }
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    if out.iter().filter(|(_, coil)| !coil.is_hidden).count() < FEWEST_COILS {
        out.iter_mut().for_each(|(_, coil)| coil.is_hidden = false);
    }
    out.into_iter().map(|(_, coil)| coil).collect()
}

/// Points at equal distances along a polyline; `None` for fewer than two different points.
pub(super) fn resample(points: &[Point], count: usize) -> Option<Vec<Point>> {
    let steps: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
    let whole: f64 = steps.iter().sum();
    if points.len() < 2 || whole.is_nan() || whole <= 0.0 {
        return None;
    }
    let places = (0..count).map(|i| {
        let (mut left, mut piece) = (whole * i as f64 / (count - 1) as f64, 0);
        while piece + 1 < steps.len() && left > steps[piece] {
            left -= steps[piece];
            piece += 1;
        }
        let part = if steps[piece] > 0.0 { (left / steps[piece]).min(1.0) } else { 0.0 };
        points[piece] + (points[piece + 1] - points[piece]) * part
    });
    Some(places.collect())
}

/// The part of a palate behind the gum, as points at equal distances, m; empty if there is none.
fn vault(palate: &[Point]) -> Vec<Point> {
    let (first, last) = (palate.first(), palate.last());
    let backwards = first.zip(last).is_some_and(|(a, b)| a.x > b.x);
    let ordered: Vec<Point> =
        if backwards { palate.iter().rev().copied().collect() } else { palate.to_vec() };
    // Long pieces are not made steep by noise. Slopes are relative to the rear half, because the axes of instruments may be turned.
    let Some(pieces) = resample(&ordered, 2 * PALATE_POINTS - 1) else { return Vec::new() };
    let along = pieces[pieces.len() - 1] - pieces[PALATE_POINTS - 1];
    let steep = (1..PALATE_POINTS).rev().find(|&i| {
        let piece = pieces[i] - pieces[i - 1];
        let (forth, up) = (piece.dot(&along), along.perp(&piece));
        forth <= 0.0 || up.abs() > STEEPEST * forth
    });
    resample(pieces.get(steep.unwrap_or(0)..).unwrap_or_default(), PALATE_POINTS).unwrap_or_default()
}

/// Distance of a point from a curve, m, which is positive to the left of its direction.
fn signed_distance(curve: &NaturalSpline, p: Point) -> f64 {
    let nearest = curve.polygon.windows(2).map(|w| {
        let (a, way) = (w[0], w[1] - w[0]);
        let part = ((p - a).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        let away = p - (a + way * part);
        (away.norm(), way.perp(&away).signum())
    });
    least_by(nearest, |(far, _)| *far).map_or(0.0, |(far, side)| far * side)
}

/// Cholesky factor of the covariance of points along a line.
fn whitener(points: &[Point], mm: [f64; 3], tilt: f64) -> Option<nalgebra::Cholesky<f64, nalgebra::Dyn>> {
    let [sd, length, alone] = mm.map(|mm| 1e-3 * mm);
    let at = distances_along(points.iter().copied().map(Some), 1.0);
    let n = at.len();
    let half = 0.5 * at[n - 1];
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let tilted = tilt * tilt * (at[i] - half) * (at[j] - half);
        sd * sd * bell(at[i] - at[j], length) + tilted + if i == j { alone * alone } else { 0.0 }
    });
    covariance.cholesky()
}

/// The palate of a speaker beside that of a body.
pub(super) struct Vault {
    line: NaturalSpline,
    trace: Vec<Point>,
    factor: nalgebra::Cholesky<f64, nalgebra::Dyn>,
}

impl Vault {
    /// `None` if one of the two is missing.
    pub fn of(body: &Body<2>, palate: &[Point]) -> Option<Self> {
        let trace = vault(palate);
        let line = NaturalSpline::through(&vault(body.palate.as_deref()?)).filter(|_| trace.len() > 2)?;
        let line = line.extended(BEYOND_M);
        Some(Self { line, factor: whitener(&trace, PALATE_MM, sd::PALATE_TILT_DEG.to_radians())?, trace })
    }

    /// Distances of the trace from the palate of the placed body, in independent standard deviations.
    pub fn residuals(&self, to: &Similarity) -> DVector<f64> {
        let away = self.trace.iter().map(|p| to.scale() * signed_distance(&self.line, to.place_back(*p)));
        let mut away = DVector::from_iterator(self.trace.len(), away);
        self.factor.l_dirty().solve_lower_triangular_mut(&mut away);
        away
    }
}

/// Places a body by the observed coils and, if there is one, a palate trace.
pub(super) fn place(body: &Body<2>, coils: &[Coil], palate: &[Point]) -> Result<Placement, RestError> {
    let (surface, centre) = (outline_of(body)?, centre_of(&body.mesh));
    let places: Vec<Point> = coils.iter().map(|c| c.at).collect();
    let coincide = || failed("coils lie in the same place");
    let shown: Vec<usize> = (0..coils.len()).filter(|&i| !coils[i].is_hidden).collect();
    let measured: Vec<Point> = shown.iter().map(|&i| places[i]).collect();
    let posture = whitener(&measured, POSTURE_MM, 0.0).ok_or_else(coincide)?;
    let of_palate = Vault::of(body, palate);
    // Unknowns: shift of the centre, turn and logarithm of the scale, and for every coil its distance behind the tip before scaling, in
    // units of the search.
    let similarity = |x: &DVector<f64>| {
        let turned = Similarity::new((sd::COILS_LN_SCALE * x[3]).exp(), TURN_SD * x[2], Point::zeros());
        let shift = centre + Point::new(x[0], x[1]) * SHIFT_UNIT_M - turned.place(centre);
        Similarity::new((sd::COILS_LN_SCALE * x[3]).exp(), TURN_SD * x[2], shift)
    };
    let on_surface = |behind: f64| surface.curve.place(surface.tip - behind, &body.mesh.nodes);
    let of_coils = |x: &DVector<f64>| {
        let to = similarity(x);
        let away = |i: usize| places[i] - to.place(on_surface(x[4 + i] * COIL_UNIT_M));
        let mut out = DMatrix::from_fn(shown.len(), 2, |i, axis| away(shown[i])[axis]);
        posture.l_dirty().solve_lower_triangular_mut(&mut out);
        out.as_slice().to_vec()
    };
    let of_the_rest = |x: &DVector<f64>| {
        let to = similarity(x);
        let scale = to.scale();
        let behind = |i: usize| scale * x[4 + i] * COIL_UNIT_M;
        let mut out = vec![x[2], x[3]];
        for (i, coil) in coils.iter().enumerate() {
            out.push(match (coil.behind, i.checked_sub(1)) {
                (Some(measured), _) => (behind(i) - measured) / (1e-3 * sd::MEASURED_COIL_MM),
                (None, None) => (behind(i) - FIRST_COIL_M) / (1e-3 * sd::FIRST_COIL_MM),
                (None, Some(before)) => {
                    let chord = (places[i] - places[before]).norm();
                    (behind(i) - behind(before) - LONGER_THAN_CHORD * chord) / (1e-3 * sd::COIL_GAP_MM)
                }
            });
        }
        of_palate.iter().for_each(|vault| out.extend(vault.residuals(&to).iter()));
        Some(DVector::from_vec(out))
    };
    let residuals = |x: &DVector<f64>| {
        let mut out = of_coils(x);
        out.extend(of_the_rest(x)?.iter());
        Some(DVector::from_vec(out))
    };
    let mut along = 0.0;
    let usual: Vec<f64> = Vec::from_iter((0..coils.len()).map(|i| {
        along +=
            i.checked_sub(1).map_or(FIRST_COIL_M, |b| LONGER_THAN_CHORD * (places[i] - places[b]).norm());
        coils[i].behind.unwrap_or(along)
    }));
    let middle = measured.iter().sum::<Point>() / measured.len() as f64;
    let starts = TURNS.map(|turn| {
        let mut x = DVector::zeros(4 + coils.len());
        x[2] = turn / TURN_SD;
        usual.iter().enumerate().for_each(|(i, behind)| x[4 + i] = behind / COIL_UNIT_M);
        let there: Point = shown.iter().map(|&i| similarity(&x).place(on_surface(usual[i]))).sum();
        let shift = (middle - there / measured.len() as f64) / SHIFT_UNIT_M;
        (x[0], x[1]) = (shift.x, shift.y);
        x
    });
    let nowhere = || failed("no place of it can be compared with the coils");
    let best = minimise(starts, &residuals, &|_| true, (1e-5, 1e-7)).ok_or_else(nowhere)?;
    let found = similarity(&best.x);
    let all = jacobian_by_differences(&best.x, &residuals, 1e-5).ok_or_else(nowhere)?;
    let rest = jacobian_by_differences(&best.x, &of_the_rest, 1e-5).ok_or_else(nowhere)?;
    // From units of the search to metres and radians of the placed body.
    let scale = found.scale();
    let units = DVector::from_fn(best.x.len(), |i, _| match i {
        0 | 1 => SHIFT_UNIT_M,
        2 => TURN_SD,
        3 => sd::COILS_LN_SCALE,
        _ => COIL_UNIT_M * scale,
    });
    let whole = with_shift_prior(all.tr_mul(&all)).cholesky().ok_or_else(coincide)?.inverse();
    let sd = [0, 1, 2, 3].map(|i| whole[(i, i)].sqrt() * units[i]);
    let precision = with_shift_prior(rest.tr_mul(&rest));
    let gradient = of_the_rest(&best.x).map(|r| rest.tr_mul(&r)).ok_or_else(coincide)?;
    let n = best.x.len();
    let known = (
        DMatrix::from_fn(n, n, |i, j| precision[(i, j)] / (units[i] * units[j])),
        DVector::from_fn(n, |i, _| gradient[i] / units[i]),
    );
    let behind = best.x.iter().skip(4).map(|x| x * COIL_UNIT_M * scale);
    let coils = coils.iter().map(|c| c.name.clone()).zip(behind).collect();
    Ok(Placement { similarity: found, centre: found.place(centre), coils, sd, known })
}

fn failed(what: &str) -> RestError {
    RestError::Body(what.to_owned())
}

fn with_shift_prior(mut square: DMatrix<f64>) -> DMatrix<f64> {
    (0..2).for_each(|i| square[(i, i)] += (SHIFT_UNIT_M / sd::COILS_SHIFT_M).powi(2));
    square
}

impl Placement {
    /// The recording with its coils where this placement has them on the tongue.
    #[must_use]
    pub fn with_coil_positions(&self, recording: &AlignedRecording) -> AlignedRecording {
        recording.with_coils(|name, _| self.coils.iter().find(|(n, _)| n == name).map(|(_, behind)| *behind))
    }

    /// The place of the centre along both axes (m), the turn (rad) and the scale, each with the ends of its 95 % interval.
    pub fn intervals(&self) -> [[f64; 3]; 4] {
        let middles = [self.centre.x, self.centre.y, self.similarity.angle(), self.similarity.scale().ln()];
        let [x, y, turn, ln_scale] = [0, 1, 2, 3].map(|i| {
            let (middle, half) = (middles[i], TWO_SIDED_95 * self.sd[i]);
            [middle, middle - half, middle + half]
        });
        [x, y, turn, ln_scale.map(f64::exp)]
    }
}
