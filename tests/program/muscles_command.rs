//! `tongue-fit muscles`: the effect of each muscle, side by side.

use super::run::json;

#[test]
fn every_muscle_shortens_where_it_pulls_and_all_are_drawn_with_the_same_axes() {
    let folder = tempfile::tempdir().unwrap();
    let json = json(folder.path(), "muscles --json --out out");
    let rows = json["muscles"].as_array().unwrap();
    assert_eq!(rows.len(), 8 * 8);
    for row in rows.iter().filter(|r| r["pulling"] == r["muscle"]) {
        assert_eq!(row["status"], "converged");
        assert!(row["stretch"].as_f64().unwrap() < 0.95, "{row}");
    }
    // The posterior genioglossus pushes the tongue forward, the styloglossus pulls its tip back (Takano and
    // Honda 2007).
    let tip =
        |name: &str| rows.iter().find(|r| r["pulling"] == name).unwrap()["tip_forward_mm"].as_f64().unwrap();
    assert!(tip("GGp") > 1.0 && tip("SGa") < -1.0);

    let mut table = csv::Reader::from_path(folder.path().join("out/muscles.csv")).unwrap();
    assert_eq!(table.records().count(), rows.len());
    let svg = std::fs::read_to_string(folder.path().join("out/muscles.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let told: Vec<&str> =
        document.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for name in ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"] {
        assert_eq!(told.iter().filter(|t| t.starts_with(name)).count(), 1, "{name}");
    }
    // The outline at rest is the same path in every picture, except for the picture's place.
    let shapes: Vec<Vec<[f64; 2]>> = document
        .descendants()
        .filter(|n| n.attribute("fill") == Some("#f1f1f1"))
        .map(|n| {
            let path = n.attribute("d").unwrap().trim_start_matches('M').trim_end_matches('Z');
            let point = |p: &str| {
                let (x, y) = p.split_once(' ').unwrap();
                [x, y].map(|v| v.parse::<f64>().unwrap())
            };
            let points: Vec<[f64; 2]> = path.split('L').map(point).collect();
            let from = points[0];
            points.iter().map(|p| [0, 1].map(|i| p[i] - from[i])).collect()
        })
        .collect();
    // Numbers are rounded to a tenth of a pixel.
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    let furthest = shapes.iter().flat_map(|s| s.iter().zip(&shapes[0]).map(|(a, b)| apart(a, b)));
    let furthest = furthest.fold(0.0, f64::max);
    assert!(shapes.len() == 8 && furthest < 0.21, "{} shapes, {furthest} px apart", shapes.len());
}
