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
    // The third speaker has no decimal points in the places, and is left out.
    let of = |name: &str| rows.replace("synthetic\t", &format!("{name}\t"));
    let without_points = |line: &str| {
        let cells = line.split('\t').enumerate();
        cells
            .map(|(i, cell)| if i < 4 { cell.to_owned() } else { cell.replace('.', "") })
            .collect::<Vec<_>>()
            .join("\t")
    };
    let bad: Vec<String> = of("third").lines().map(without_points).collect();
    let bad = bad.join("\n");
    fs::write(at.join("all.tsv"), format!("{head}\n{}{}{bad}\n", of("first"), of("the second"))).unwrap();
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
    // Draws of two speakers who are seen alike are independent.
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
    // Each has a standard deviation of 0.1.
    assert!((correlations / draws[0].len() as f64).abs() < 0.15, "{correlations} of {}", draws[0].len());
    let contrasts = folders.map(|folder| table(&format!("{folder}/contrasts.csv")));
    let all = table("over_speakers.csv");
    assert_eq!((all.len(), contrasts[0].len()), (24, 24));
    assert_eq!(found["over_speakers"].as_array().unwrap().len(), 24);
    for row in &all {
        let is_same = |c: &&Row| ["tier", "muscle", "a", "b"].iter().all(|key| c[*key] == row[*key]);
        let own: Vec<&Row> = contrasts.iter().map(|c| c.iter().find(is_same).unwrap()).collect();
        let words = |word: &str| own.iter().filter(|c| c["word"] == word).count().to_string();
        assert_eq!((&row["speakers"], &row["low_n_per_m"]), (&"2".to_owned(), &String::new()));
        assert_eq!(
            [&row["surely_harder_in_a"], &row["surely_harder_in_b"]],
            [&words("surely harder"), &words("surely not harder")]
        );
        let number = |text: &String| text.parse::<f64>().unwrap();
        let mean = own.iter().map(|c| number(&c["difference_n_per_m"])).sum::<f64>() / 2.0;
        assert!((number(&row["mean_difference_n_per_m"]) - mean).abs() < 1e-9, "{row:?}");
    }
}
