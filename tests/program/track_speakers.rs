//! Recordings of several speakers in one run.

use std::collections::BTreeMap;
use std::fs;

use super::run::run;

type Row = BTreeMap<String, String>;

#[test]
fn several_speakers_are_tracked_apart_and_their_differences_counted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv");
    let own = fs::read_to_string(recording).unwrap();
    let (head, rows) = own.split_once('\n').unwrap();
    // The third speaker's numbers have no decimal points, and that speaker is left out.
    let of = |name: &str| rows.replace("synthetic\t", &format!("{name}\t"));
    let without_points = |line: &str| {
        let (start, places) = line.split_at(line.match_indices('\t').nth(3).unwrap().0);
        format!("{start}{}\n", places.replace('.', ""))
    };
    let bad: String = of("third").lines().map(without_points).collect();
    fs::write(at.join("all.tsv"), format!("{head}\n{}{}{bad}", of("first"), of("the second"))).unwrap();
    let done = run(at, "track all.tsv --draws 400 --also draws --out out --json");
    assert_eq!(done.status, Some(1), "{}", done.err);
    assert!(done.err.contains("left out: speaker third: "), "{}", done.err);
    let found = done.record();
    let folders = ["first", "speaker_2"];
    for (speaker, folder) in found["speakers"].as_array().unwrap().iter().zip(folders) {
        assert_eq!((&speaker["frames"], &speaker["problem"]), (&90.into(), &().into()), "{speaker}");
        assert!(speaker["folder"].as_str().unwrap().ends_with(folder));
    }
    let table = |name: &str| -> Vec<Row> {
        csv::Reader::from_path(at.join("out").join(name)).unwrap().deserialize().map(Result::unwrap).collect()
    };
    // Draws of two speakers with the same data are independent.
    let draws = folders.map(|folder| {
        let mut all: BTreeMap<(String, String), Vec<f64>> = BTreeMap::new();
        for row in table(&format!("{folder}/draws.csv"))
            .iter()
            .filter(|row| row["part"] == "0.000" && row["tier"] == "annotation")
        {
            let key = (row["label"].clone() + &row["repetition"], row["muscle"].clone());
            all.entry(key).or_default().push(row["tension_n_per_m"].parse().unwrap());
        }
        all
    });
    let mut correlations = 0.0;
    for (key, a) in &draws[0] {
        let b = &draws[1][key];
        assert_eq!((a.len(), b.len()), (100, 100));
        let [mean_a, mean_b] = [a, b].map(|all| all.iter().sum::<f64>() / 100.0);
        let sum = |x: &[f64], x0: f64, y: &[f64], y0: f64| {
            x.iter().zip(y).map(|(x, y)| (x - x0) * (y - y0)).sum::<f64>()
        };
        correlations +=
            sum(a, mean_a, b, mean_b) / (sum(a, mean_a, a, mean_a) * sum(b, mean_b, b, mean_b)).sqrt();
    }
    // Each correlation has a standard deviation of 0.1.
    assert!((correlations / draws[0].len() as f64).abs() < 0.15, "{correlations} of {}", draws[0].len());
    // `over_speakers` in crates/infer shows how differences are counted over speakers.
    let all = table("over_speakers.csv");
    assert_eq!((all.len(), found["over_speakers"].as_array().unwrap().len()), (24, 24));
    assert!(all.iter().all(|row| row["speakers"] == "2" && row["low_n_per_m"].is_empty()), "{all:?}");
}
