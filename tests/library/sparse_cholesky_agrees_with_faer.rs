//! The block Cholesky factorisation against faer's sparse one, and against the residual of its solution. Of the largest matrix only the
//! residual is checked, because faer, without optimisation in this test, takes two minutes for it.

use crate::fixtures;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use nalgebra::SVector;
use tongue_core::sparse::BlockMatrix;
use tongue_core::sparse::cholesky::Factor;
use tongue_fit::body::Mesh;
use tongue_fit::effect::{Configuration, Tangent};
use tongue_fit::system::{Model, System};

fn solves<const D: usize>(mesh: &Mesh<D>, side: f64, compare: bool) {
    let system = System::new(mesh, &Model::default(), &[0]).unwrap();
    let x = fixtures::shaken(mesh, 0.001 * side);
    let at = Configuration { positions: &x, tensions: &[1.0] };
    let pattern = system.pattern();
    let mut k = BlockMatrix::zeros(pattern);
    system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut k));
    let n = pattern.unknowns();
    let b: Vec<SVector<f64, D>> =
        (0..n).map(|i| SVector::from_fn(|d, _| ((i * D + d) as f64).cos())).collect();

    let mut factor = Factor::new(pattern);
    assert!(factor.factorise(pattern, &k));
    let mut ours = b.clone();
    factor.solve(pattern, &mut ours);

    let mut back = vec![SVector::zeros(); n];
    k.multiply(pattern, &ours, &mut back);
    for (back, b) in back.iter().zip(&b) {
        assert!((back - b).norm() < 1e-8, "residual {:e}", (back - b).norm());
    }
    if !compare {
        return;
    }

    let dense = fixtures::dense(pattern, &k);
    let triplets: Vec<_> = (0..n * D * n * D)
        .map(|i| Triplet::new(i % (n * D), i / (n * D), dense[(i % (n * D), i / (n * D))]))
        .filter(|t| t.val != 0.0)
        .collect();
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n * D, n * D, &triplets).unwrap();
    let theirs =
        matrix.sp_cholesky(faer::Side::Lower).unwrap().solve(faer::Col::from_fn(n * D, |i| b[i / D][i % D]));
    let largest = ours.iter().map(|v| v.amax()).fold(0.0, f64::max);
    for i in 0..n * D {
        let error = (ours[i / D][i % D] - theirs[i]).abs() / largest;
        assert!(error < 1e-11, "entry {i} differs by {error:e}");
    }
}

#[test]
fn in_the_plane_and_in_space() {
    solves(&fixtures::lattice(12, 9, 5.5e-3), 5.5e-3, true);
    solves(&fixtures::block(4, 5.5e-3), 5.5e-3, true);
    // This matrix is so dense that it is factorised in supernodes.
    solves(&fixtures::block(8, 5.5e-3), 5.5e-3, false);
}

#[test]
fn an_indefinite_matrix_is_refused() {
    refuses(&fixtures::lattice(5, 5, 5.5e-3));
    refuses(&fixtures::block(8, 5.5e-3));
}

fn refuses<const D: usize>(mesh: &Mesh<D>) {
    let system = System::new(mesh, &Model::default(), &[]).unwrap();
    let pattern = system.pattern();
    let mut k = BlockMatrix::zeros(pattern);
    let tensions = vec![0.0; system.muscle_count()];
    let at = Configuration { positions: &mesh.nodes, tensions: &tensions };
    system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut k));
    let mut factor = Factor::new(pattern);
    assert!(factor.factorise(pattern, &k));
    k.shift(pattern, -1.0e4);
    assert!(!factor.factorise(pattern, &k));
    // The reported direction proves the failure, because the matrix is not positive along it.
    let mut d = vec![SVector::zeros(); pattern.unknowns()];
    factor.negative_curvature(pattern, &k, &mut d);
    let mut image = vec![SVector::zeros(); pattern.unknowns()];
    k.multiply(pattern, &d, &mut image);
    assert!(d.iter().zip(&image).map(|(d, k)| d.dot(k)).sum::<f64>() < 0.0);
    k.shift(pattern, f64::NAN);
    assert!(!factor.factorise(pattern, &k));
}
