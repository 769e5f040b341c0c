use nalgebra::SVector;
use std::time::Instant;
use tongue_fit::dynamics::*;
use tongue_fit::equilibrium;
use tongue_fit::material::Preset;
use tongue_fit::mesh::{self, Anatomy};
use tongue_fit::system::{Model, System};
struct Keep(Vec<Vec<SVector<f64, 2>>>);
impl Observer<2> for Keep {
    fn sample(&mut self, _t: f64, x: &[SVector<f64, 2>]) {
        self.0.push(x.to_vec());
    }
}
fn main() {
    let mesh = mesh::build(&Anatomy::reference().unwrap(), 5.5e-3).unwrap();
    let n = tongue_fit::fit::muscle_numbers(&mesh).unwrap();
    let act = [n[0], n[4], n[6]];
    for preset in [Preset::Consistent, Preset::AsPrinted] {
        let model = Model { preset, ..Model::default() };
        let system = System::new(&mesh, &model, &act).unwrap();
        let mut t = vec![0.0; system.muscle_count()];
        for (i, f) in act.iter().zip([12.0, 11.5, 4.5]) {
            t[*i] = f;
        }
        let motion = Motion::new(&system, Tensions::Constant(t.clone())).unwrap();
        let s = Spectrum::of(&motion, &motion.at_rest());
        println!("{preset:?} {s:?}");
        for m in Method::ALL {
            println!("  {m} {:?}", m.stability_limit(&motion));
        }
        if preset == Preset::AsPrinted {
            continue;
        }
        let times = sample_times(3.0, 61);
        let go = |m: Method, c: Control| {
            let mut i = m.integrator(&motion, c).unwrap();
            let mut st = motion.at_rest();
            let mut k = Keep(vec![]);
            let clock = Instant::now();
            let o = run(&motion, i.as_mut(), &mut st, 3.0, &times, &mut k);
            (clock.elapsed().as_secs_f64(), o, k.0, st)
        };
        let (w, o, reference, st) = go(Method::Esdirk4, Control::Adaptive(1e-11));
        println!("ref {w:.3} {o:?}");
        let err = |a: &Vec<Vec<SVector<f64, 2>>>| {
            a.iter()
                .zip(&reference)
                .flat_map(|(a, b)| a.iter().zip(b))
                .map(|(p, q)| (p - q).norm())
                .fold(0.0, f64::max)
        };
        for m in [Method::TrBdf2, Method::Esdirk4] {
            for tol in [1e-5, 1e-6, 1e-7, 3e-8, 1e-8, 1e-9, 1e-10] {
                let (w, o, x, _) = go(m, Control::Adaptive(tol));
                println!(
                    "{m} tol {tol:e}: err {:.3e} mm  {:.1} ms {:?} {:?}",
                    err(&x) * 1e3,
                    w * 1e3,
                    o.status,
                    o.counts
                );
            }
        }
        for dt in [0.3, 0.1, 0.01, 0.001] {
            let (w, o, x, _) = go(Method::BackwardEuler, Control::Fixed(dt));
            println!(
                "be dt {dt:e}: err {:.3e} mm  {:.1} ms {:?} {:?}",
                err(&x) * 1e3,
                w * 1e3,
                o.status,
                o.counts
            );
        }
        let mut ws = equilibrium::Workspace::new(&system);
        let sol = equilibrium::solve(&system, &mut ws, &t, &equilibrium::Settings::default());
        println!("{:?}", sol.status);
        let far = |x: &[SVector<f64, 2>]| {
            x.iter().zip(ws.positions()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
        };
        let d0 = far(system.rest());
        println!("left at 3 s: {:.4} of {:.3} mm", far(&st.positions) / d0, d0 * 1e3);
        let mut st2 = motion.at_rest();
        let mut i = Method::Esdirk4.integrator(&motion, Control::Adaptive(1e-9)).unwrap();
        let mut last = d0;
        for t in [1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 20.0, 30.0] {
            let o = run(&motion, i.as_mut(), &mut st2, t, &[], &mut ());
            let f = far(&st2.positions);
            println!("t {t} left {:.4e} ({:.4}) rate {:.3} {:?}", f * 1e3, f / d0, (last / f).ln(), o.status);
            last = f;
        }
    }
}
