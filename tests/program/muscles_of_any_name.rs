//! Bodies from Gmsh with fewer, more and other muscles than the eight built-in ones work in every command.

use std::fs;
use std::path::Path;

use super::run::json as run;
use serde_json::Value;
use tongue_fit::body::{Bone, MuscleChain, REFERENCE, gmsh, solid};

/// Muscles that contract in the simulation, with their tensions, N per metre of thickness.
const PULL: [(&str, f64); 3] = [("hyoglossus", 5.0), ("longitudinalis superior", 6.0), ("verticalis", 8.0)];
const FIVE: &str = r#"
    genioglossus = [[0.0, 0.0], [28.9, 50.056]]
    hyoglossus = [[37.625, -3.066], [27.532, 26.245]]
    "longitudinalis superior" = [[-2.0, 36.0], [40.0, 38.0]]
    verticalis = [[14.0, 4.0], [12.0, 42.0]]
    "舌筋" = [[0.0, 0.0], [47.02, 9.14]]
"#;
const SIX_MORE: &str = r#"
    "longitudinalis inferior" = [[-6.0, 22.0], [43.0, 13.0]]
    transversus = [[2.0, 16.0], [44.0, 27.0]]
    "transversus 2" = [[-2.0, 33.0], [31.0, 19.0]]
    palatoglossus = [[34.0, 30.0], [37.62, 45.21]]
    V2 = [[24.0, 0.0], [21.0, 41.0]]
    V3 = [[37.0, 4.0], [39.0, 26.0]]
"#;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn names(by_muscle: &Value) -> Vec<&str> {
    by_muscle.as_object().unwrap().keys().map(String::as_str).collect()
}

fn texts(svg: &Path) -> Vec<String> {
    let text = fs::read_to_string(svg).unwrap();
    let read = roxmltree::Document::parse(&text).unwrap();
    let texts = read.descendants().filter(|n| n.has_tag_name("text"));
    texts.map(|n| n.descendants().filter_map(|d| d.text()).collect()).collect()
}

/// Writes the outline of the reference with muscles of its own to `body.msh`, and its lengths at rest and under tension as the table of a
/// subject to `own.csv`. Returns the names of the muscles.
fn make_body(folder: &Path, muscles: &str) -> Vec<String> {
    let outline = &REFERENCE[..REFERENCE.find("[muscles]").unwrap()];
    let bones = "[bones]\n\"mental spine\" = [[0.0, 0.0]]\nhyoid = [[37.625, -3.066]]\n";
    fs::write(folder.join("own.toml"), format!("{outline}\n[muscles]\n{muscles}\n{bones}")).unwrap();
    run(folder, "mesh --anatomy own.toml --json --out .");
    fs::rename(folder.join("mesh.msh"), folder.join("body.msh")).unwrap();
    let text = fs::read_to_string(folder.join("body.msh")).unwrap();
    assert!(text.contains("\"muscle:verticalis\""), "as whoever draws it in Gmsh would call it");
    let pull: String = PULL.iter().map(|(muscle, n)| format!(" --tension '{muscle}={n}'")).collect();
    let simulated = run(folder, &format!("simulate --mesh body.msh --json --out simulated{pull}"));
    let rest = run(folder, "mesh --mesh body.msh --json");
    let muscles = names(&simulated["lengths_mm"]);
    let each = |of: &dyn Fn(&str) -> String| muscles.iter().map(|m| of(m)).collect::<String>();
    let row = |lengths: &Value| each(&|muscle| format!(",{}", lengths[muscle]));
    let (header, rest) = (each(&|muscle| format!(",{muscle}_mm")), row(&rest["rest_lengths_mm"]));
    let pulled = row(&simulated["lengths_mm"]);
    fs::write(folder.join("own.csv"), format!("subject,vowel{header}\nX,ɯ{rest}\nX,a{pulled}\n")).unwrap();
    muscles.into_iter().map(str::to_owned).collect()
}

fn goes_all_the_way(muscles: &str, count: usize) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let muscles = make_body(folder, muscles);
    assert_eq!(muscles.len(), count);

    let own = "--lengths own.csv --mesh body.msh --json";
    let fit = run(folder, &format!("--vowel a --subject X --out fit --target stretch {own}"));
    assert_eq!(fit["status"], "converged");
    let active = PULL.map(|(muscle, _)| muscle).join(",");
    let ratios =
        format!("--vowel a --subject X --method gauss-newton --muscles '{active}' --out ratio {own}");
    let batch = run(folder, &format!("batch --out batch --target stretch {own}"));
    for found in [&fit, &run(folder, &ratios), &batch["fits"][0]] {
        for muscle in &muscles {
            let pulled = PULL.iter().find(|(m, _)| m == muscle).map_or(0.0, |(_, n)| *n);
            assert!((number(&found["tensions_n"][muscle]) - pulled).abs() < 1e-3, "{muscle}: {found}");
        }
    }
    let moved = "simulate --trajectory --t-end 0.01 --frames 2 --tension hyoglossus=5 --mesh body.msh --json";
    assert_eq!(run(folder, moved)["status"], "completed");

    // Every muscle has its row, its column and its name in every picture and on the page.
    let mut rows = csv::Reader::from_path(folder.join("fit/fit.csv")).unwrap();
    let at = rows.headers().unwrap().iter().position(|h| h == "muscle").unwrap();
    let told: Vec<String> = rows.records().map(|r| r.unwrap()[at].to_owned()).collect();
    assert_eq!(told, muscles);
    let columns = csv::Reader::from_path(folder.join("batch/fits.csv")).unwrap().headers().unwrap().clone();
    let page = fs::read_to_string(folder.join("batch/batch.html")).unwrap();
    let vtu = fs::read_to_string(folder.join("simulated/tongue.vtu")).unwrap();
    assert!(roxmltree::Document::parse(&vtu).is_ok());
    let pictures =
        ["fit/tongue.svg", "fit/changes.svg", "simulated/tongue.svg"].map(|p| texts(&folder.join(p)));
    for muscle in &muscles {
        let column = format!("tension_{muscle}_n_per_m");
        assert!(columns.iter().any(|c| c == column) && page.contains(muscle), "{muscle}: {columns:?}");
        for texts in &pictures {
            assert!(texts.iter().any(|t| t.starts_with(muscle)), "{muscle} is not in {texts:?}");
        }
    }
}

#[test]
fn five_and_eleven_muscles_go_through_every_command() {
    goes_all_the_way(FIVE, 5);
    goes_all_the_way(&format!("{FIVE}{SIX_MORE}"), 11);
}

/// A block on bone with muscles along three upper edges, which have names of Takano's table, meets the lengths measured of these muscles.
#[test]
fn a_scene_fits_a_solid() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = solid::block([0.024, 0.024, 0.012], [2, 2, 1]);
    let edge = |name: &str, nodes: [usize; 3]| MuscleChain { name: name.to_owned(), nodes: nodes.into() };
    mesh.muscles = vec![edge("GGm", [9, 10, 11]), edge("GGp", [15, 16, 17]), edge("HGp", [11, 14, 17])];
    let bone = Bone { name: "hyoid".into(), nodes: mesh.fixed.clone() };
    fs::write(folder.path().join("block.msh"), gmsh::write(&mesh, &[bone])).unwrap();
    let scene = "title = \"t\"\nwant = \"lengths\"\n[body.mesh]\nfile = \"block.msh\"\n\
                 [fit]\nsubject = \"S3\"\nvowel = \"i\"\ntarget = \"stretch\"\n[effects]\nincompressibility = true\n";
    fs::write(folder.path().join("block.toml"), scene).unwrap();
    let answer = run(folder.path(), "scene run block.toml --json");
    assert_eq!(answer["fit"], "converged", "{answer}");
    for (name, measured) in [("GGm", 53.0 / 59.0), ("GGp", 43.0 / 48.0), ("HGp", 28.0 / 30.0)] {
        let muscle = answer["muscles"].as_array().unwrap().iter().find(|m| m["muscle"] == name).unwrap();
        assert!((number(&muscle["stretch"]) - measured).abs() < 1e-4, "{muscle}");
        assert!(number(&muscle["tension_n"]) > 0.0, "{muscle}");
    }
}
