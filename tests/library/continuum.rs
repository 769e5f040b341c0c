//! The continuum of quadratic elements is exact for homogeneous strain and of third order for smooth strain, and the forces of muscles and
//! bones do not depend on the mesh.

use crate::fixtures::{self, solved};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector};
use tongue_core::body::continuum;
use tongue_core::geometry::{quadratic, simplex};
use tongue_fit::body::{Anatomy, Body, ContinuumSettings, Mesh, MuscleChain, solid};
use tongue_fit::effect::{Configuration, Effect};
use tongue_fit::material::NeoHookean;
use tongue_fit::statics::SolveStatus;
use tongue_fit::system::{Additions, Model, System};

/// The system of a body with the published tensions of /a/.
fn pulled(mesh: &Mesh<2>) -> (System<2>, Vec<f64>) {
    let (contracting, tensions) = fixtures::pulling(mesh, &fixtures::PUBLISHED_A);
    (System::new(mesh, &Model::default(), &contracting).unwrap(), tensions)
}

/// The mesh as a continuum whose whole surface is fixed.
fn held_all_around<const D: usize>(mut mesh: Mesh<D>) -> Mesh<D> {
    mesh.fixed = mesh.surface_nodes();
    mesh.muscles.clear();
    continuum::from_mesh(&mesh, None, &ContinuumSettings::default()).unwrap().0
}

fn patch_test<const D: usize>(mut mesh: Mesh<D>, side: f64, stretch: SMatrix<f64, D, D>) {
    mesh.nodes = fixtures::shaken(&mesh, 0.2 * side);
    let mesh = held_all_around(mesh);
    let system = System::new(&mesh, &Model::default(), &[]).unwrap();
    let x: Vec<_> = mesh.nodes.iter().map(|p| stretch * p).collect();
    let mut force = vec![SVector::zeros(); x.len()];
    system.force(Configuration { positions: &x, tensions: &[] }, &mut force);
    let largest = |nodes: &mut dyn Iterator<Item = usize>| nodes.map(|n| force[n].norm()).fold(0.0, f64::max);
    let inner = largest(&mut system.pattern().nodes().iter().copied());
    let held = largest(&mut mesh.fixed.iter().copied());
    assert!(inner < 1e-12 * held, "{D}D: {inner} beside {held}");
    let exact = NeoHookean::from(&Model::default()).displaced(&(stretch - SMatrix::identity())).state();
    for stress in system.stresses(&x) {
        assert!((stress.cauchy_pa - exact.cauchy_pa).norm() < 1e-9 * exact.cauchy_pa.norm());
    }
    // The stress balances the forces on all nodes (Clausius's virial): `sum f xᵀ = - V σ`.
    let volume = determinant(&stretch) * system.measure(system.rest());
    let virial: SMatrix<f64, D, D> = force.iter().zip(&x).map(|(f, x)| f * x.transpose()).sum();
    let error = (virial + exact.cauchy_pa * volume).norm();
    assert!(error < 1e-9 * virial.norm(), "{D}D: {error}");
    // At the velocities `G x` the viscous forces have the power of Newtonian stress, `-2 η d:d V`, and do not resist a rotation.
    let tissue = system.effects().iter().find(|e| e.name() == "quadratic elements").unwrap();
    let forces = |gradient: SMatrix<f64, D, D>| {
        let velocities: Vec<_> = x.iter().map(|x| gradient * x).collect();
        let mut force = vec![SVector::zeros(); x.len()];
        tissue.add_viscous_force(Configuration { positions: &x, tensions: &[] }, &velocities, &mut force);
        let power: f64 = force.iter().zip(&velocities).map(|(f, v)| f.dot(v)).sum();
        (power, force.iter().map(SVector::norm).fold(0.0, f64::max))
    };
    let gradient = SMatrix::<f64, D, D>::from_fn(|i, j| (1.0 + i as f64 + 2.0 * j as f64).sin());
    let rate = 0.5 * (gradient + gradient.transpose());
    let ((power, largest), (_, turning)) = (forces(gradient), forces(gradient - rate));
    let expected = -2.0 * Model::default().viscosity * rate.norm_squared() * volume;
    assert!((power / expected - 1.0).abs() < 1e-9, "{D}D: {power} W, not {expected}");
    assert!(turning < 1e-9 * largest, "{D}D: a turning body is held by {turning:e} N");
}

fn determinant<const D: usize>(f: &SMatrix<f64, D, D>) -> f64 {
    nalgebra::DMatrix::from_column_slice(D, D, f.as_slice()).determinant()
}

#[test]
fn a_homogeneous_stretch_of_irregular_elements_is_in_balance_to_rounding() {
    patch_test(fixtures::lattice(6, 6, 5e-3), 5e-3, Matrix2::new(1.2, 0.1, -0.05, 0.9));
    let stretch = Matrix3::new(1.2, 0.1, 0.0, -0.05, 0.9, 0.1, 0.02, 0.0, 0.95);
    patch_test(fixtures::block(2, 5e-3), 5e-3, stretch);
}

/// A constant force on nodes.
#[derive(Debug)]
struct Load<const D: usize>(Vec<SVector<f64, D>>);

impl<const D: usize> Effect<D> for Load<D> {
    fn name(&self) -> &'static str {
        "load"
    }

    fn energy(&self, at: Configuration<'_, D>) -> f64 {
        -self.0.iter().zip(at.positions).map(|(f, x)| f.dot(x)).sum::<f64>()
    }

    fn add_force(&self, _at: Configuration<'_, D>, force: &mut [SVector<f64, D>]) {
        force.iter_mut().zip(&self.0).for_each(|(force, load)| *force += load);
    }
}

/// A smooth displacement field, m, on a body of this size; `deformed` has its gradient, `stress` its stress.
const SIZE: f64 = 0.02;

fn field<const D: usize>(p: &SVector<f64, D>) -> SVector<f64, D> {
    let q = p / SIZE;
    let mut u = SVector::zeros();
    u[0] = 0.04 * SIZE * (2.0 * q[0] + 3.0 * q[1]).sin();
    u[1] = 0.04 * SIZE * (3.0 * q[0] - q[1]).cos();
    if D == 3 {
        u[2] = 0.04 * SIZE * (q[0] + q[1] + 2.0 * q[2]).sin();
    }
    u
}

/// The deformation gradient of the field.
fn deformed<const D: usize>(p: &SVector<f64, D>) -> SMatrix<f64, D, D> {
    let q = p / SIZE;
    let mut f = SMatrix::<f64, D, D>::identity();
    let mut add = |row: usize, slope: f64, by: [f64; 3]| {
        (0..D).for_each(|d| f[(row, d)] += 0.04 * slope * by[d]);
    };
    add(0, (2.0 * q[0] + 3.0 * q[1]).cos(), [2.0, 3.0, 0.0]);
    add(1, -(3.0 * q[0] - q[1]).sin(), [3.0, -1.0, 0.0]);
    if D == 3 {
        add(2, (q[0] + q[1] + 2.0 * q[2]).cos(), [1.0, 1.0, 2.0]);
    }
    f
}

/// First Piola-Kirchhoff stress, from Cauchy's.
fn stress<const D: usize>(law: NeoHookean, p: &SVector<f64, D>) -> SMatrix<f64, D, D> {
    let f = deformed(p);
    let ratio = determinant(&f);
    law.displaced(&(f - SMatrix::identity())).state().cauchy_pa * ratio * f.try_inverse().unwrap().transpose()
}

fn held_by<const D: usize>(law: NeoHookean, p: &SVector<f64, D>) -> SVector<f64, D> {
    let step = 1e-3 * SIZE;
    let mut out = SVector::zeros();
    for d in 0..D {
        let mut by = SVector::zeros();
        by[d] = step;
        let near = stress(law, &(p + by)) - stress(law, &(p - by));
        let far = stress(law, &(p + by * 2.0)) - stress(law, &(p - by * 2.0));
        out -= (near.column(d) * 8.0 - far.column(d)) / (12.0 * step);
    }
    out
}

/// Barycentric coordinates and weights of many points of a cell, from repeated subdivision.
fn fine_points<const D: usize>(depth: usize) -> Vec<([f64; 4], f64)> {
    let mut cells = vec![std::array::from_fn::<[f64; 4], 4, _>(|i| {
        std::array::from_fn(|j| f64::from(u8::from(i == j && i <= D)))
    })];
    for _ in 0..depth {
        let divide = |corners: &[[f64; 4]; 4]| {
            let mut nodes: Vec<[f64; 4]> = corners[..=D].to_vec();
            for &[i, j] in quadratic::edges::<D>() {
                nodes.push(std::array::from_fn(|k| 0.5 * (corners[i][k] + corners[j][k])));
            }
            let of = |part: &&[usize]| std::array::from_fn(|i| part.get(i).map_or([0.0; 4], |&n| nodes[n]));
            quadratic::parts::<D>().iter().map(of).collect::<Vec<_>>()
        };
        cells = cells.iter().flat_map(divide).collect();
    }
    let points = quadratic::points::<D>();
    let weight = 1.0 / (cells.len() * points.len()) as f64;
    let within = |corners: [[f64; 4]; 4]| {
        points
            .iter()
            .map(move |at| (std::array::from_fn(|k| (0..=D).map(|i| at[i] * corners[i][k]).sum()), weight))
    };
    cells.into_iter().flat_map(within).collect()
}

/// Errors of displacement (root mean square, m) and of strain energy (J) of a manufactured solution: its displacements are given on the
/// surface, its body force inside.
fn errors<const D: usize>(mut mesh: Mesh<D>) -> (f64, f64) {
    // The elements are irregular in the same way at every spacing.
    for p in &mut mesh.nodes {
        let q = *p / SIZE;
        p[0] += 0.1 * SIZE * (2.0 * q[1]).sin();
        p[1] += 0.1 * SIZE * (3.0 * q[0]).sin();
    }
    let mesh = held_all_around(mesh);
    let law = NeoHookean::from(&Model::default());
    let (coarse, fine) = (fine_points::<D>(1), fine_points::<D>(if D == 2 { 3 } else { 1 }));
    let (mut load, mut energy) = (vec![SVector::zeros(); mesh.nodes.len()], 0.0);
    let elements = mesh.continuum.clone().unwrap();
    for element in elements.elements() {
        let corners = simplex::corners(&mesh.nodes, &element[..=D]);
        let measure = simplex::measure(&corners);
        for (at, weight) in &coarse {
            let p: SVector<f64, D> = corners.iter().zip(at).map(|(x, l)| x * *l).sum();
            let force = held_by(law, &p) * (weight * measure);
            for (&node, value) in element.iter().zip(quadratic::values::<D>(at)) {
                load[node] += force * value;
            }
        }
        for (at, weight) in &fine {
            let p: SVector<f64, D> = corners.iter().zip(at).map(|(x, l)| x * *l).sum();
            let f = deformed(&p);
            energy += law.displaced_energy(&(f - SMatrix::identity())) * weight * measure;
        }
    }
    let displaced = mesh.fixed.iter().map(|&n| (n, mesh.nodes[n] + field(&mesh.nodes[n]))).collect();
    let additions = Additions { effects: vec![Box::new(Load(load))], displaced, ..Additions::default() };
    let system = System::with_additions(&mesh, &Model::default(), &[], additions).unwrap();
    let workspace = solved(&system, &[]);
    let x = workspace.positions();
    let (mut squares, mut all) = (0.0, 0.0);
    for element in elements.elements() {
        let corners = simplex::corners(&mesh.nodes, &element[..=D]);
        let measure = simplex::measure(&corners);
        for (at, weight) in &fine {
            let p: SVector<f64, D> = corners.iter().zip(at).map(|(x, l)| x * *l).sum();
            let values = quadratic::values::<D>(at);
            let here: SVector<f64, D> = element.iter().zip(values).map(|(&n, v)| x[n] * v).sum();
            squares += (here - p - field(&p)).norm_squared() * weight * measure;
            all += weight * measure;
        }
    }
    let at = Configuration { positions: x, tensions: &[] };
    let stored: f64 = system.effects().iter().filter(|e| e.name() != "load").map(|e| e.energy(at)).sum();
    ((squares / all).sqrt(), (stored - energy).abs())
}

#[test]
fn a_smooth_field_is_met_with_the_third_order_in_displacement_and_more_in_energy() {
    let order = |errors: &[(f64, f64)]| {
        let last = &errors[errors.len() - 2..];
        ((last[0].0 / last[1].0).log2(), (last[0].1 / last[1].1).log2())
    };
    let flat = [4, 8, 16].map(|n| errors(fixtures::lattice(n + 1, n + 1, SIZE / n as f64)));
    let (displacement, energy) = order(&flat);
    assert!(displacement > 2.7 && energy > 2.7, "{displacement} {energy}");
    let solid = [3, 6].map(|n| errors(fixtures::block(n, SIZE / n as f64)));
    let (displacement, energy) = order(&solid);
    assert!(displacement > 2.5 && energy > 2.5, "{displacement} {energy}");
}

/// A cylinder of ten-node tetrahedra with a contracting bundle of fibres along its axis: the ratio of its volume to that at rest, and the
/// relative shortening of the axis.
fn contracted_cylinder(rings: usize, layers: usize) -> (f64, f64) {
    let length = 20e-3;
    // The cross-section has the same area at every resolution, although it is a regular polygon.
    let corners = 6.0 * rings as f64;
    let polygon = 0.5 * corners * (std::f64::consts::TAU / corners).sin();
    let radius = 10e-3 * (std::f64::consts::PI / polygon).sqrt();
    let mut base = solid::cylinder(radius, length, rings, layers);
    let on_axis = |n: usize| base.nodes[n].fixed_rows::<2>(0).norm() < 1e-9;
    let axial: Vec<MuscleChain> = base.muscles.iter().filter(|m| on_axis(m.nodes[0])).cloned().collect();
    base.muscles = axial;
    let settings = ContinuumSettings { bundle_width_m: 12e-3, fibres: 30, ..Default::default() };
    let mesh = continuum::from_mesh(&base, None, &settings).unwrap().0;
    let model = Model { poisson_ratio: 0.499, ..Model::default() };
    let system = System::new(&mesh, &model, &[0]).unwrap();
    let (solution, workspace) = fixtures::solve(&system, &[0.3]);
    assert_eq!((solution.status, solution.guarded), (SolveStatus::Converged, 0));
    let (mut volume, mut before) = (0.0, 0.0);
    let points = fine_points::<3>(1);
    for element in mesh.continuum.as_ref().unwrap().elements() {
        let corners = simplex::corners(&mesh.nodes, &element[..=3]);
        let measure = simplex::measure(&corners);
        let of_coordinates = simplex::gradient(&corners).map(|g| g / measure);
        for (at, weight) in &points {
            let slopes = quadratic::gradients::<3>(at, &of_coordinates);
            let f: Matrix3<f64> =
                element.iter().zip(slopes).map(|(&n, g)| workspace.positions()[n] * g.transpose()).sum();
            volume += determinant(&f) * weight * measure;
            before += weight * measure;
        }
    }
    let top = |x: &[SVector<f64, 3>]| {
        let at = (0..x.len()).find(|&n| (mesh.nodes[n] - SVector::from([0.0, 0.0, length])).norm() < 1e-9);
        x[at.unwrap()][2]
    };
    (volume / before, 1.0 - top(workspace.positions()) / length)
}

#[test]
fn a_cylinder_of_contracting_fibres_keeps_its_volume_and_converges_under_refinement() {
    let all = [(1, 2), (2, 4), (4, 8)].map(|(rings, layers)| contracted_cylinder(rings, layers));
    assert!(all.iter().all(|(volume, shorter)| (volume - 1.0).abs() < 1e-3 && *shorter > 0.05), "{all:?}");
    let order = |of: fn(&(f64, f64)) -> f64| {
        let [a, b, c] = all.each_ref().map(of);
        ((b - a).abs() / (c - b).abs()).log2()
    };
    let (volume, shortening) = (order(|x| x.0), order(|x| x.1));
    assert!(volume > 1.5 && shortening > 1.5, "{all:?}");
}

/// The reference tongue at a spacing (m), in which `muscles` contract.
fn tongue(h: f64, muscles: &[&str]) -> (Body<2>, System<2>) {
    let body = Body::continuum(h, &ContinuumSettings::default()).unwrap();
    let contracting: Vec<usize> = muscles.iter().map(|m| body.muscle(m).unwrap()).collect();
    let system = System::new(&body.mesh, &Model::default(), &contracting).unwrap();
    (body, system)
}

#[test]
fn a_bundle_in_a_homogeneous_stretch_has_the_energy_of_its_line_whatever_the_mesh() {
    let stretch = Matrix2::new(1.1, 0.2, -0.1, 0.95);
    let energies = [8e-3, 4e-3].map(|h| -> f64 {
        let (body, system) = tongue(h, &["GGm"]);
        let x: Vec<_> = body.mesh.nodes.iter().map(|p| stretch * p).collect();
        let tensions = fixtures::pulling(&body.mesh, &[("GGm", 3.0)]).1;
        let at = Configuration { positions: &x, tensions: &tensions };
        system.effects().iter().filter(|e| e.name() == "fibres").map(|e| e.energy(at)).sum()
    });
    // GGm is a straight line; the directions of its fibres differ by 1 %, and the outline cuts them off.
    let way = SVector::from([28.9e-3, 50.056e-3]);
    let line = 3.0 * ((stretch * way).norm() - way.norm());
    assert!(energies.iter().all(|e| (e / line - 1.0).abs() < 0.05), "{energies:?} {line}");
    assert!((energies[0] / energies[1] - 1.0).abs() < 0.02, "{energies:?}");
}

#[test]
fn a_patch_on_a_straight_edge_holds_with_sixteen_fifteenths_of_its_radius() {
    let mut mesh = fixtures::lattice(9, 4, 5e-3);
    mesh.fixed = vec![4];
    mesh.muscles.clear();
    let settings = ContinuumSettings { patch_radius_m: 12e-3, ..ContinuumSettings::default() };
    let mesh = continuum::from_mesh(&mesh, None, &settings).unwrap().0;
    let ties = &mesh.continuum.as_ref().unwrap().ties;
    // If all tissue is displaced by one, the sum is the integral of the profile.
    let pairs = (0..9).map(|n| (n / 3, n % 3));
    let held: f64 =
        ties.iter().flat_map(|tie| pairs.clone().map(|(i, j)| tie.form[i * tie.nodes.len() + j])).sum();
    assert!((held / (16.0 / 15.0 * 12e-3) - 1.0).abs() < 1e-6, "{held}");
}

#[test]
fn a_displaced_bone_takes_a_body_along_that_nothing_else_holds() {
    let mesh = fixtures::held_at_a_corner(fixtures::lattice(4, 4, 5e-3), 5e-3);
    let by = SVector::from([1e-3, -2e-3]);
    let displaced = mesh.fixed.iter().map(|&n| (n, mesh.nodes[n] + by)).collect();
    let system = System::with_additions(
        &mesh,
        &Model::default(),
        &[0],
        Additions { displaced, ..Additions::default() },
    )
    .unwrap();
    for (x, rest) in solved(&system, &[0.0]).positions().iter().zip(&mesh.nodes) {
        assert!((x - rest - by).norm() < 1e-9, "{x} {rest}");
    }
}

#[test]
fn forces_of_muscles_end_on_the_bones() {
    let (body, system) = tongue(5.5e-3, &["GGa", "SGp", "HGp"]);
    let tensions = fixtures::pulling(&body.mesh, &[("GGa", 12.0), ("SGp", 5.0), ("HGp", 4.0)]).1;
    let workspace = solved(&system, &tensions);
    let on = |bone: &str| body.bone(bone).iter().map(|&n| workspace.force()[n]).sum::<SVector<f64, 2>>();
    let [spine, hyoid, styloid] = ["mental_spine", "hyoid", "styloid"].map(on);
    assert!((spine + hyoid + styloid).norm() < 1e-9, "reactions cancel: {spine} {hyoid} {styloid}");
    // All of SGp is outside the tissue, so it pulls at the styloid process with its whole tension.
    assert!((styloid.norm() - 5.0).abs() < 1e-12, "{styloid}");
    assert!(body.bone("hyoid").len() > 2 && body.bone("styloid").len() == 1);
}

#[test]
fn bodies_that_cannot_be_a_continuum_are_refused_with_the_reason() {
    let settings = ContinuumSettings::default();
    let refused = |mesh: &Mesh<2>, settings: &ContinuumSettings, says: &str| {
        let error = continuum::from_mesh(mesh, None, settings).unwrap_err().to_string();
        assert!(error.contains(says), "expected \"{says}\": {error}");
    };
    refused(&fixtures::rope(3, 1e-2), &settings, "no triangles or tetrahedra");
    let mut mesh = fixtures::held_at_a_corner(fixtures::lattice(4, 4, 5e-3), 5e-3);
    refused(&mesh, &settings, "is a continuum already");
    mesh.continuum = None;
    let wide = ContinuumSettings { bundle_width_m: f64::NAN, ..settings };
    refused(&mesh, &wide, "the width of a muscle (m) is NaN; give 0 to 1");
}

#[test]
fn ratios_of_area_are_those_of_the_tissue_within_its_elements() {
    let body = Body::continuum(8e-3, &ContinuumSettings::default()).unwrap();
    let (system, tensions) = pulled(&body.mesh);
    let stretched: Vec<_> =
        system.rest().iter().map(|x| SVector::from([1.2 * x[0] + 0.1 * x[1], 0.9 * x[1]])).collect();
    let (low, high) = system.tissue_ratios(&stretched);
    assert!((low - 1.08).abs() < 1e-12 && (high - 1.08).abs() < 1e-12, "{low} {high}");
    let workspace = solved(&system, &tensions);
    // The areas of cells, whose sides are straight, change by more than the tissue does at any point.
    let [(low, high), (of_cells, to_cells)] =
        [system.tissue_ratios(workspace.positions()), system.cell_ratios(workspace.positions())];
    assert!([of_cells, low, 1.0, high, to_cells].is_sorted_by(|a, b| a < b), "{low} {high}");
    assert!(high - low < 0.5 * (to_cells - of_cells), "{low} {high} {of_cells} {to_cells}");
}

/// The reference tongue on nested meshes of 11, 5.5, 2.75 mm and so on, with the outline of the anatomy.
fn nested(levels: usize) -> Vec<Body<2>> {
    let anatomy = Anatomy::reference().unwrap();
    let on_outline = |mesh: Mesh<2>, body: Body<2>| Body { mesh: mesh.on_outline(anatomy.outline()), ..body };
    let coarse = Body::tongue(11e-3).unwrap();
    let coarse = on_outline(coarse.mesh.clone(), coarse);
    std::iter::successors(Some(coarse), |b| Some(on_outline(b.mesh.refined(), b.clone())))
        .take(levels)
        .collect()
}

#[test]
fn ratios_settle_on_nested_meshes_but_not_of_a_thin_bundle_on_one_node() {
    let anatomy = Anatomy::reference().unwrap();
    let changes = |settings: ContinuumSettings, load: f64| {
        let ratios = |body: Body<2>| {
            let body = body.into_continuum_of(&anatomy, &settings).unwrap();
            let (system, tensions) = pulled(&body.mesh);
            let tensions: Vec<f64> = tensions.iter().map(|t| t * load).collect();
            let lengths = system.lengths(solved(&system, &tensions).positions());
            lengths.iter().map(|l| l / lengths[0]).collect::<Vec<f64>>()
        };
        let all: Vec<Vec<f64>> = nested(4).into_iter().map(ratios).collect();
        let change =
            |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        all.windows(2).map(change).collect::<Vec<f64>>()
    };
    let thin = ContinuumSettings { bundle_width_m: 0.5e-3, patch_radius_m: 0.0, ..Default::default() };
    let order = |c: &[f64]| (c[1] / c[2]).log2();
    for load in [1.0, 2.0] {
        let good = changes(ContinuumSettings::default(), load);
        assert!(order(&good) > 1.5 && good[2] < 0.0015 * load, "{good:?}");
    }
    let bad = changes(thin, 1.0);
    assert!(order(&bad) < 0.5 && bad[2] > 0.02, "the control settles: {bad:?}");
}
