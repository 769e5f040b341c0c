use tongue_fit::{equilibrium::*, mesh::*, system::*};
fn main() {
    let a = Anatomy::reference().unwrap();
    let h: f64 = std::env::args().nth(1).map_or(5.5, |s| s.parse().unwrap());
    let t = std::time::Instant::now();
    let mesh = build(&a, h * 1e-3).unwrap();
    eprintln!("mesh {:?}", t.elapsed());
    println!("{:?}", Quality::of(&mesh));
    for outside in [OutsidePath::Straight, OutsidePath::Chain] {
        let model = Model { outside, ..Default::default() };
        let s = System::new(&mesh, &model, &[0, 4, 6]).unwrap();
        println!(
            "unknowns {} matrix blocks {} factor blocks {}",
            s.pattern().unknowns(),
            s.pattern().matrix_blocks(),
            s.pattern().blocks()
        );
        let mut w = Workspace::new(&s);
        let f = [12.0, 0., 0., 0., 11.5, 0., 4.5, 0.];
        let sol = solve(&s, &mut w, &f, &Settings::default());
        println!("{sol:?} {:?}", s.cell_ratios(w.positions()));
        let l: Vec<f64> = (0..8).map(|m| s.length(w.positions(), m)).collect();
        let pubd = [1., 1.52, 1.31, 1.54, 0.56, 0.97, 0.80, 0.91];
        let r: Vec<f64> = l.iter().map(|x| x / l[0]).collect();
        let rms = (r.iter().zip(&pubd).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 7.).sqrt();
        println!(
            "{} rms {rms:.4} GGa stretch {:.4}",
            r.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" "),
            l[0] / s.length(s.rest(), 0)
        );
        if let Ok(j) = length_sensitivities(&s, &mut w) {
            println!("{:.5}", j * 1e3);
        }
        // timing
        let near = w.positions().to_vec();
        let n = 2000;
        let t = std::time::Instant::now();
        let mut it = 0;
        for _ in 0..n {
            w.start_from_rest(&s);
            it += solve(&s, &mut w, &f, &Settings::default()).iterations;
        }
        println!("cold {:.1} us, {} it", t.elapsed().as_secs_f64() / n as f64 * 1e6, it / n);
        let t = std::time::Instant::now();
        let mut it = 0;
        let mut fa = 0;
        let f2 = [12.3, 0., 0., 0., 11.3, 0., 4.7, 0.];
        for _ in 0..n {
            w.start_from(&near);
            let r = solve(&s, &mut w, &f2, &Settings::default());
            it += r.iterations;
            fa += r.factorisations
        }
        println!("warm {:.1} us, {} it {} fact", t.elapsed().as_secs_f64() / n as f64 * 1e6, it / n, fa / n);
    }
}
