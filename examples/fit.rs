use tongue_fit::{fit, mesh::*, system::*, target::*};
fn main() {
    let mesh = build(&Anatomy::reference().unwrap(), 5.5e-3).unwrap();
    let d = Dataset::reference().unwrap();
    let kinds = [TargetKind::Ratio, TargetKind::Stretch];
    for kind in kinds {
        for s in ["S1", "S2", "S3"] {
            for v in [Vowel::I, Vowel::E, Vowel::A, Vowel::O] {
                let target = Target::new(&d, s, v, kind, &TargetOptions::default()).unwrap();
                let t = std::time::Instant::now();
                let f = fit::fit(&mesh, &Model::default(), &target, &fit::Settings::default()).unwrap();
                println!(
                    "{s} {v} {kind} {:?} {:.1}ms ev {} misfit {:.1e} {:?} T {}",
                    f.status,
                    t.elapsed().as_secs_f64() * 1e3,
                    f.evaluations,
                    f.misfit,
                    f.target.active.iter().map(|m| m.name()).collect::<Vec<_>>(),
                    f.tensions.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>().join(" ")
                );
                for s in &f.starts {
                    println!(
                        "   {:?} {:.3e} ev {} it {} rs {} {}",
                        s.tensions, s.cost, s.evaluations, s.iterations, s.restarts, s.converged
                    );
                }
                if s == "S2" && v == Vowel::A {
                    println!("{:?}\n{:?}", f.identifiability, f.replay);
                }
            }
        }
    }
}
