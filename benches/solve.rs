//! Times of the computations that take most of the program's time: `cargo bench`.
//!
//! - `equilibrium`: one solve of springs and of the continuum (`benches/scikit_fem.rs` has scikit-fem's).
//! - `many`: a thousand solves on one thread, one by one and in lanes, from rest and from the shape at the middle of the loads.
//! - `factorise`: the block Cholesky factorisation, faer's sparse one (which orders the unknowns itself) and nalgebra's dense one.
//! - `factorise_in_space`: the block Cholesky factorisation and the program's choice, which is faer's supernodes from a few hundred
//!   unknowns on.
//! - `fit`: a fit with several starts on one and two threads.
#![allow(clippy::unwrap_used, reason = "a bench that cannot begin has failed")]

#[path = "../tests/fixtures/mod.rs"]
mod fixtures;

use divan::Bencher;
use faer::sparse::{SparseColMat, Triplet};
use tongue_core::sparse::BlockMatrix;
use tongue_core::sparse::cholesky::Factor;
use tongue_core::statics::lanes::{Lanes, Load};
use tongue_fit::body::{self, Anatomy, Body, ContinuumSettings, solid};
use tongue_fit::effect::{Configuration, Tangent};
use tongue_fit::inverse;
use tongue_fit::measured::TargetKind;
use tongue_fit::statics::{SolveSettings, Workspace, solve};
use tongue_fit::system::{Model, System};

const PUBLISHED: [f64; 8] = [12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0];
const NEIGHBOUR: [f64; 8] = [12.3, 0.0, 0.0, 0.0, 11.3, 0.0, 4.7, 0.0];
const ACTIVE: [usize; 3] = [0, 4, 6];
/// Mesh spacings in units of 0.1 mm.
const SPACINGS: [u32; 3] = [55, 27, 14];

fn main() {
    divan::main();
}

fn system(h_tenths: u32) -> System<2> {
    let mesh = body::build(&Anatomy::reference().unwrap(), f64::from(h_tenths) * 1e-4).unwrap();
    System::new(&mesh, &Model::default(), &ACTIVE).unwrap()
}

fn stiffness<const D: usize>(system: &System<D>, tensions: &[f64]) -> BlockMatrix<D> {
    let at = Configuration { positions: system.rest(), tensions };
    let mut k = BlockMatrix::zeros(system.pattern());
    system.effects().iter().for_each(|e| e.add_stiffness(at, Tangent::Exact, &mut k));
    k
}

mod equilibrium {
    use super::*;

    #[divan::bench(args = SPACINGS)]
    fn from_rest(bencher: Bencher, h_tenths: u32) {
        let system = system(h_tenths);
        let mut w = Workspace::new(&system);
        bencher.bench_local(|| {
            w.start_from_rest(&system);
            solve(&system, &mut w, &PUBLISHED, &SolveSettings::default())
        });
    }

    #[divan::bench(args = SPACINGS)]
    fn from_a_neighbour(bencher: Bencher, h_tenths: u32) {
        let system = system(h_tenths);
        let mut w = Workspace::new(&system);
        solve(&system, &mut w, &NEIGHBOUR, &SolveSettings::default());
        let there = w.positions().to_vec();
        w.start_from_rest(&system);
        solve(&system, &mut w, &PUBLISHED, &SolveSettings::default());
        let here = w.positions().to_vec();
        // Two loads alternate, so that each solve starts from the shape and the factor of the other.
        let mut forth = false;
        bencher.bench_local(|| {
            forth = !forth;
            w.start_from(if forth { &here } else { &there });
            solve(&system, &mut w, if forth { &NEIGHBOUR } else { &PUBLISHED }, &SolveSettings::default())
        });
    }
}

mod equilibrium_of_the_continuum {
    use super::*;

    #[divan::bench(args = [55, 40])]
    fn from_rest(bencher: Bencher, h_tenths: u32) {
        let body = Body::continuum(f64::from(h_tenths) * 1e-4, &ContinuumSettings::default()).unwrap();
        let model = Model::default();
        let system = System::new(&body.mesh, &model, &ACTIVE).unwrap();
        let mut w = Workspace::new(&system);
        bencher.bench_local(|| {
            w.start_from_rest(&system);
            solve(&system, &mut w, &PUBLISHED, &SolveSettings::default())
        });
    }
}

mod many {
    use super::*;

    const COUNT: usize = 1000;

    fn all_can_pull() -> System<2> {
        System::new(&fixtures::tongue(), &Model::default(), &[0, 1, 2, 3, 4, 5, 6, 7]).unwrap()
    }

    /// The published load with random changes of every tension by up to `part` of it (of 1 N/m if it is zero).
    fn loads(part: f64) -> Vec<Vec<f64>> {
        let mut random = fastrand::Rng::with_seed(1);
        let mut draw = |t: f64| (t + part * t.max(1.0) * (2.0 * random.f64() - 1.0)).max(0.0);
        (0..COUNT).map(|_| PUBLISHED.map(&mut draw).to_vec()).collect()
    }

    fn one_by_one(bencher: Bencher, part: f64, is_warm: bool) {
        let (system, loads) = (all_can_pull(), loads(part));
        let mut w = Workspace::new(&system);
        solve(&system, &mut w, &PUBLISHED, &SolveSettings::default());
        let middle = w.positions().to_vec();
        bencher.counter(COUNT).bench_local(|| {
            for load in &loads {
                if is_warm {
                    w.start_from(&middle);
                } else {
                    w.start_from_rest(&system);
                }
                divan::black_box(solve(&system, &mut w, load, &SolveSettings::default()));
            }
        });
    }

    fn in_lanes(bencher: Bencher, part: f64, is_warm: bool) {
        let (system, loads) = (all_can_pull(), loads(part));
        let mut w = Workspace::new(&system);
        solve(&system, &mut w, &PUBLISHED, &SolveSettings::default());
        let middle = w.positions().to_vec();
        let lanes = Lanes::new(&system);
        let load = |i: usize| {
            let load = Load::new(loads[i].clone());
            Load { start: is_warm.then_some(&middle[..]), ..load }
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        bencher.counter(COUNT).bench_local(|| {
            pool.install(|| {
                lanes.map(COUNT, &SolveSettings::default(), load, |_, shape| shape.solution.iterations)
            })
        });
    }

    #[divan::bench]
    fn warm_one_at_a_time(bencher: Bencher) {
        one_by_one(bencher, 0.03, true);
    }

    #[divan::bench]
    fn warm_in_lanes(bencher: Bencher) {
        in_lanes(bencher, 0.03, true);
    }

    #[divan::bench]
    fn from_rest_one_at_a_time(bencher: Bencher) {
        one_by_one(bencher, 0.2, false);
    }

    #[divan::bench]
    fn from_rest_in_lanes(bencher: Bencher) {
        in_lanes(bencher, 0.2, false);
    }
}

mod factorise {
    use super::*;

    #[divan::bench(args = SPACINGS)]
    fn block_cholesky(bencher: Bencher, h_tenths: u32) {
        let system = system(h_tenths);
        let k = stiffness(&system, &PUBLISHED);
        let mut factor = Factor::block_by_block(system.pattern());
        bencher.bench_local(|| factor.factorise(system.pattern(), &k));
    }

    #[divan::bench(args = SPACINGS)]
    fn faer_sparse(bencher: Bencher, h_tenths: u32) {
        let system = system(h_tenths);
        let k = fixtures::dense(system.pattern(), &stiffness(&system, &PUBLISHED));
        let n = k.nrows();
        let triplets: Vec<_> = (0..n * n)
            .map(|i| Triplet::new(i % n, i / n, k[(i % n, i / n)]))
            .filter(|t| t.val != 0.0)
            .collect();
        let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(n, n, &triplets).unwrap();
        let symbolic =
            faer::sparse::linalg::solvers::SymbolicLlt::try_new(matrix.symbolic(), faer::Side::Lower)
                .unwrap();
        faer::set_global_parallelism(faer::Par::Seq);
        bencher.bench_local(|| {
            faer::sparse::linalg::solvers::Llt::try_new_with_symbolic(
                symbolic.clone(),
                matrix.as_ref(),
                faer::Side::Lower,
            )
        });
    }

    #[divan::bench(args = [55])]
    fn nalgebra_dense(bencher: Bencher, h_tenths: u32) {
        let system = system(h_tenths);
        let k = fixtures::dense(system.pattern(), &stiffness(&system, &PUBLISHED));
        bencher.with_inputs(|| k.clone()).bench_local_values(|k| k.cholesky());
    }
}

mod factorise_in_space {
    use super::*;

    /// Numbers of cells along the shorter edges of a block of 30 x 30 x 50 mm, with 192 to 6912 unknowns.
    const CELLS: [usize; 6] = [3, 4, 5, 6, 9, 11];

    fn block(cells: usize) -> System<3> {
        let mesh = solid::block([0.03, 0.03, 0.05], [cells, cells, cells + cells / 2]);
        System::new(&mesh, &Model::default(), &[]).unwrap()
    }

    #[divan::bench(args = CELLS)]
    fn block_by_block(bencher: Bencher, cells: usize) {
        let system = block(cells);
        let k = stiffness(&system, &[]);
        let mut factor = Factor::block_by_block(system.pattern());
        bencher.bench_local(|| factor.factorise(system.pattern(), &k));
    }

    #[divan::bench(args = CELLS)]
    fn as_chosen(bencher: Bencher, cells: usize) {
        let system = block(cells);
        let k = stiffness(&system, &[]);
        let mut factor = Factor::new(system.pattern());
        bencher.bench_local(|| factor.factorise(system.pattern(), &k));
    }
}

mod fit_s2_a {
    use super::*;

    #[divan::bench(args = [1, 2])]
    fn eight_starts_on_threads(bencher: Bencher, threads: usize) {
        let mesh = fixtures::tongue();
        let target = fixtures::target("S2", "a", TargetKind::Ratio);
        let settings = inverse::FitSettings { starts: 8, ..Default::default() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        bencher.bench_local(|| pool.install(|| inverse::fit(&mesh, &Model::default(), &target, &settings)));
    }
}
