//! The built-in tongue in space: the midsagittal outline with a width, divided into hexahedra.

use nalgebra::Vector3;
use serde::Deserialize;

use super::{Directions, Segment, Side};
use crate::body::solid::{grid, grid_node};
use crate::body::{Anatomy, Body, BodyError, Bone, Mesh, Muscle, MuscleChain};
use crate::geometry::{ClosedSpline, Point, hexahedron, simplex};
use crate::observe::{Line, LineEnd};

/// Widths, bones and muscles, as text.
const REFERENCE: &str = include_str!("../../../../../targets/tongue_in_space.toml");
const FILE: &str = "targets/tongue_in_space.toml (embedded)";
/// Tolerance of comparisons of the coordinates u, v and t.
const TOLERANCE: f64 = 1e-9;
/// Least barycentric coordinate, in its triangle of the midsagittal plane, of a point that moves with the tissue.
const LEAST_COORDINATE: f64 = -0.5;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpaceFile {
    corners_mm: [[f64; 2]; 4],
    elements: [usize; 3],
    half_width_top_mm: Vec<[f64; 2]>,
    half_width_floor_mm: Vec<[f64; 2]>,
    rounding: f64,
    bone: Vec<BoneParts>,
    muscle: Vec<GivenMuscle>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoneParts {
    name: String,
    parts: Vec<BoxRegion>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GivenMuscle {
    name: String,
    force_n: f64,
    course: FibreDirection,
    region: BoxRegion,
    fibre: [[f64; 3]; 2],
    #[serde(default)]
    middle: bool,
    outside: Option<Outside>,
}

/// The course of fibres: along u, v or t, or in a fan.
#[derive(Deserialize)]
#[serde(untagged)]
enum FibreDirection {
    Along(char),
    Fan { from_mm: [f64; 2], sector: [f64; 2] },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Outside {
    from_mm: [f64; 3],
    bone: String,
    to: BoxRegion,
}

/// A box in the coordinates u (length), v (height) and t (half width), each from 0 to 1.
#[derive(Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
struct BoxRegion {
    u: [f64; 2],
    v: [f64; 2],
    t: [f64; 2],
}

impl BoxRegion {
    /// Whether a place [u, v, t] is in the box, on either side.
    fn holds(&self, [u, v, t]: [f64; 3]) -> bool {
        within(u, self.u) && within(v, self.v) && within(t.abs(), self.t)
    }
}

fn within(x: f64, [low, high]: [f64; 2]) -> bool {
    (low - TOLERANCE..=high + TOLERANCE).contains(&x)
}

impl Body<3> {
    /// The built-in tongue with `fine` times as many elements in each direction as in `targets/tongue_in_space.toml`, which has 672.
    pub fn tongue_in_space(fine: usize) -> Result<Self, BodyError> {
        let wrong = |problem: String| BodyError::file(FILE, problem);
        let file: SpaceFile = toml::from_str(REFERENCE).map_err(|e| wrong(e.message().to_owned()))?;
        let anatomy = Anatomy::reference()?;
        let [u, v, t] = file.elements.map(|n| n * fine.max(1));
        let counts = [u, v, 2 * t];
        let (mut mesh, mut at, middles) = hexahedra(&file, anatomy.outline(), counts);
        let in_tissue = at.len();
        let mut bones: Vec<Bone> = Vec::new();
        for BoneParts { name, parts } in &file.bone {
            let nodes = (0..in_tissue).filter(|&n| parts.iter().any(|p| p.holds(at[n]))).collect();
            bones.push(Bone { name: name.clone(), nodes });
        }
        let mut muscles = Vec::new();
        for given in &file.muscle {
            let sides = if given.middle { vec![Side::Middle] } else { vec![Side::Left, Side::Right] };
            for side in sides {
                let sign = if side == Side::Left { -1.0 } else { 1.0 };
                let own = |t: f64| side == Side::Middle || t * sign > -TOLERANCE;
                let nearest = given.fibre.map(|[u, v, t]| {
                    let steps = [
                        u * counts[0] as f64,
                        v * counts[1] as f64,
                        (1.0 + sign * t) * 0.5 * counts[2] as f64,
                    ];
                    grid_node(counts, steps.map(|s| s.round() as usize))
                });
                let mut chain = nearest.to_vec();
                let force_n = if given.middle { given.force_n } else { 0.5 * given.force_n };
                let mut segments = vec![Segment { nodes: nearest, force_n, outside: false }];
                let length = mesh.distance(nearest);
                if let Some(outside) = &given.outside {
                    let [x, z, y] = outside.from_mm.map(|c| 1e-3 * c);
                    mesh.nodes.push(Vector3::new(x, sign * y, z));
                    let bone_node = mesh.nodes.len() - 1;
                    at.push([f64::NAN; 3]);
                    match bones.iter_mut().find(|b| b.name == outside.bone) {
                        Some(bone) => bone.nodes.push(bone_node),
                        None => bones.push(Bone { name: outside.bone.clone(), nodes: vec![bone_node] }),
                    }
                    let to: Vec<usize> =
                        (0..in_tissue).filter(|&n| outside.to.holds(at[n]) && own(at[n][2])).collect();
                    let force_n = force_n / to.len() as f64;
                    segments.extend(to.iter().map(|&n| Segment {
                        nodes: [bone_node, n],
                        force_n,
                        outside: true,
                    }));
                    chain.push(bone_node);
                }
                let mut muscle = Muscle {
                    name: match side {
                        Side::Left => format!("{}_L", given.name),
                        Side::Right => format!("{}_R", given.name),
                        Side::Middle => given.name.clone(),
                    },
                    group: given.name.clone(),
                    side,
                    segments,
                    region: Vec::new(),
                    stress_pa: 0.0,
                    directions: Vec::new(),
                };
                let mut volume = 0.0;
                for (element, corners) in mesh.hexahedra.iter().enumerate() {
                    let x = hexahedron::corners(&mesh.nodes, corners);
                    let middle: Vector3<f64> = x.iter().sum::<Vector3<f64>>() / 8.0;
                    let place = middles[element];
                    if given.region.holds(place) && own(place[2]) && given.course.passes(&middle) {
                        muscle.region.push(element);
                        muscle.directions.push(given.course.directions(&x));
                        volume += hexahedron::volume(&x);
                    }
                }
                muscle.stress_pa = force_n * length / volume.max(f64::MIN_POSITIVE);
                mesh.muscles.push(MuscleChain { name: muscle.name.clone(), nodes: chain });
                muscles.push(muscle);
            }
        }
        mesh.fixed = bones.iter().flat_map(|b| b.nodes.iter().copied()).collect();
        mesh.fixed.sort_unstable();
        mesh.fixed.dedup();
        mesh.connect();
        let what = format!("the built-in tongue in space, {} hexahedra", mesh.hexahedra.len());
        let mut body = Self { what, mesh, bones, muscles, ..Self::default() };
        body.lines = anatomy.muscles().iter().map(|line| (line.name.clone(), body.line(line.ends))).collect();
        body.check().map_err(|fault| wrong(fault.to_string()))?;
        Ok(body)
    }

    /// The line between two places of the midsagittal plane, m: each moves with the tissue near it, or is on bone outside of it.
    fn line(&self, ends: [Point; 2]) -> Line<3> {
        let section = self.midsagittal_mesh();
        Line {
            ends: ends.map(|at| {
                let nearest = section.cells.iter().map(|cell| {
                    let shares = simplex::barycentric(&simplex::corners(&section.nodes, cell), &at);
                    (shares[..3].iter().copied().fold(f64::INFINITY, f64::min), cell.to_vec(), shares)
                });
                let nearest = nearest.max_by(|a, b| a.0.total_cmp(&b.0));
                match nearest.filter(|(least, ..)| *least > LEAST_COORDINATE) {
                    Some((_, nodes, shares)) => {
                        LineEnd { weights: nodes.into_iter().zip(shares).collect(), fixed: Vector3::zeros() }
                    }
                    None => LineEnd { weights: Vec::new(), fixed: Vector3::new(at.x, 0.0, at.y) },
                }
            }),
        }
    }
}

/// The tissue of so many elements along u, v, and t on both sides, and the coordinates [u, v, t] of its nodes and of elements' middles.
fn hexahedra(
    file: &SpaceFile,
    outline: &ClosedSpline,
    counts: [usize; 3],
) -> (Mesh<3>, Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let section = MidsagittalSection::new(file, outline);
    let (mut mesh, mut at) = (Mesh::<3>::default(), Vec::new());
    for steps in grid(counts.map(|n| n + 1)) {
        let [u, v, t]: [f64; 3] = std::array::from_fn(|d| steps[d] as f64 / counts[d] as f64);
        let place = [u, v, 2.0 * t - 1.0];
        mesh.nodes.push(section.place(file, place));
        at.push(place);
    }
    let mut middles = Vec::new();
    for [i, j, k] in grid(counts) {
        let floor = [[i, j, k], [i + 1, j, k], [i + 1, j, k + 1], [i, j, k + 1]];
        let top = floor.map(|[i, j, k]| [i, j + 1, k]);
        let corners = [floor, top].concat();
        mesh.hexahedra.push(std::array::from_fn(|c| grid_node(counts, corners[c])));
        let [a, b] = [at[grid_node(counts, floor[0])], at[grid_node(counts, top[2])]];
        middles.push(std::array::from_fn(|d| 0.5 * (a[d] + b[d])));
    }
    (mesh, at, middles)
}

/// The midsagittal section between its four corners.
struct MidsagittalSection<'a> {
    outline: &'a ClosedSpline,
    /// Distances along the outline, m, of the four corners and, after a whole turn, of the first one again.
    ways: [f64; 5],
    middle: Point,
}

impl<'a> MidsagittalSection<'a> {
    fn new(file: &SpaceFile, outline: &'a ClosedSpline) -> Self {
        let whole = outline.perimeter;
        let way = |[x, y]: [f64; 2]| outline.nearest(Point::new(x, y) * 1e-3).0;
        let first = way(file.corners_mm[0]);
        let mut ways = [first; 5];
        for (i, corner) in file.corners_mm.into_iter().enumerate().skip(1) {
            // The distances are those in the direction of the outline first.
            ways[i] = first + (way(corner) - first).rem_euclid(whole);
        }
        ways[4] = first + whole;
        if !ways.is_sorted() {
            ways[1..4].iter_mut().for_each(|way| *way -= whole);
            ways[4] = first - whole;
        }
        let polygon = &outline.polygon;
        let middle = polygon.iter().sum::<Point>() / polygon.len() as f64;
        Self { outline, ways, middle }
    }

    /// The point of the outline at `part` between corner `side` and the next one, m.
    fn on(&self, side: usize, part: f64) -> Point {
        let [from, to] = [self.ways[side], self.ways[side + 1]];
        self.outline.point((from + part * (to - from)).rem_euclid(self.outline.perimeter))
    }

    /// The point at u, v between the four sides (transfinite interpolation, Gordon and Hall 1973), m.
    fn point(&self, u: f64, v: f64) -> Point {
        let [floor, top] = [self.on(3, 1.0 - u), self.on(1, u)];
        let [front, back] = [self.on(0, v), self.on(2, 1.0 - v)];
        let corners = (self.on(0, 0.0) * (1.0 - u) + self.on(3, 0.0) * u) * (1.0 - v)
            + (self.on(1, 0.0) * (1.0 - u) + self.on(2, 0.0) * u) * v;
        floor * (1.0 - v) + top * v + front * (1.0 - u) + back * u - corners
    }

    fn place(&self, file: &SpaceFile, [u, v, t]: [f64; 3]) -> Vector3<f64> {
        let [floor, top] =
            [&file.half_width_floor_mm, &file.half_width_top_mm].map(|profile| 1e-3 * between(profile, u));
        let flat = self.middle + (self.point(u, v) - self.middle) * (1.0 - file.rounding * t * t);
        Vector3::new(flat.x, t * (floor * (1.0 - v) + top * v), flat.y)
    }
}

fn between(table: &[[f64; 2]], x: f64) -> f64 {
    let after = table.iter().position(|p| p[0] >= x).unwrap_or(table.len() - 1).max(1);
    let [[x0, y0], [x1, y1]] = [table[after - 1], table[after]];
    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
}

impl FibreDirection {
    /// Whether an element with this middle is in the sector of the fan.
    fn passes(&self, middle: &Vector3<f64>) -> bool {
        let Self::Fan { from_mm: [x, z], sector: [low, high] } = self else { return true };
        let angle = (middle.z - 1e-3 * z).atan2(middle.x - 1e-3 * x).to_degrees();
        (*low..*high).contains(&angle)
    }

    /// Unit directions at the Gauss points of an element with these corners, m.
    fn directions(&self, x: &hexahedron::PerCorner<Vector3<f64>>) -> Directions {
        hexahedron::points().map(|at| match self {
            Self::Along(axis) => {
                let column = match axis {
                    'u' => 0,
                    't' => 1,
                    _ => 2,
                };
                hexahedron::jacobian(x, at).column(column).into_owned().try_normalize(0.0)
            }
            Self::Fan { from_mm: [fx, fz], .. } => {
                let place: Vector3<f64> = x.iter().zip(hexahedron::values(at)).map(|(x, n)| x * n).sum();
                // Fibres of a fan keep their distance from the midsagittal plane.
                Vector3::new(place.x - 1e-3 * fx, 0.0, place.z - 1e-3 * fz).try_normalize(0.0)
            }
        })
    }
}
