//! The SVG figures: well-formed, true to the numbers, readable, the same bytes every time.

use std::collections::BTreeMap;

use nalgebra::SVector;
use roxmltree::{Document, Node};
use tongue_fit::body::{Cells, Mesh, MuscleChain};
use tongue_fit::report::{ReportError, Series, changes, tongue};

/// Canvas units in a pixel, as the root element tells.
fn fineness(document: &Document) -> f64 {
    let root = document.root_element();
    let view: Vec<f64> = root.attribute("viewBox").unwrap().split(' ').map(|v| v.parse().unwrap()).collect();
    let [width, height] = ["width", "height"].map(|name| number(root, name));
    assert_eq!(view[0..2], [0.0, 0.0]);
    assert_eq!(view[2] / width, view[3] / height);
    view[2] / width
}

fn number(node: Node, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

fn all<'a>(document: &'a Document, tag: &str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|n| n.has_tag_name(tag)).collect()
}

fn texts(document: &Document) -> Vec<String> {
    all(document, "text").iter().map(|n| n.text().unwrap().trim().to_owned()).collect()
}

fn points(node: Node) -> Vec<[f64; 2]> {
    node.attribute("points")
        .unwrap()
        .split_whitespace()
        .map(|pair| {
            let (x, y) = pair.split_once(',').unwrap();
            [x.parse().unwrap(), y.parse().unwrap()]
        })
        .collect()
}

/// Left, top, right, bottom of a text, by the mean width of sans-serif letters; none if it is rotated.
fn text_box(node: Node) -> Option<[f64; 4]> {
    if node.has_attribute("transform") {
        return None;
    }
    let size = number(node, "font-size");
    let width = 0.5 * size * node.text().unwrap().trim().chars().count() as f64;
    let left = number(node, "x")
        - match node.attribute("text-anchor").unwrap() {
            "start" => 0.0,
            "middle" => 0.5 * width,
            _ => width,
        };
    let middle = number(node, "y");
    Some([left, middle - 0.4 * size, left + width, middle + 0.4 * size])
}

/// What every figure must be, whatever it shows.
fn check_figure(svg: &str) {
    let document = Document::parse(svg).unwrap();
    let fine = fineness(&document);
    let root = document.root_element();
    assert!(number(root, "width") <= 900.0);
    let (right, bottom) = (fine * number(root, "width"), fine * number(root, "height"));

    for tag in ["title", "desc"] {
        assert!(!all(&document, tag)[0].text().unwrap().is_empty(), "{tag}");
    }
    for text in all(&document, "text") {
        assert!(number(text, "font-size") / fine >= 11.0);
        assert_eq!(text.attribute("font-family"), Some("sans-serif"));
    }
    for node in document.descendants() {
        assert!(!node.has_attribute("href") && !node.has_tag_name("image"), "not self-contained");
    }

    let boxes: Vec<_> = all(&document, "text").into_iter().filter_map(|n| Some((n, text_box(n)?))).collect();
    for (nth, (text, a)) in boxes.iter().enumerate() {
        assert!(a[0] >= 0.0 && a[1] >= 0.0 && a[2] <= right && a[3] <= bottom, "clipped: {:?}", text.text());
        for (other, b) in &boxes[..nth] {
            let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
            assert!(apart, "{:?} overlaps {:?}", text.text(), other.text());
        }
    }
    for path in all(&document, "polyline") {
        for [x, y] in points(path) {
            assert!((0.0..=right).contains(&x) && (0.0..=bottom).contains(&y), "({x}, {y}) is off the sheet");
        }
    }
}

const GREY: &str = "#C4C4C4";
const DARK: &str = "#555555";
const INK: &str = "#222222";
const ORANGE: &str = "#E69F00";
const VERMILLION: &str = "#D55E00";

/// A square of 20 mm in 8 triangles, node `3 row + column`, and a node outside it at (30, 30) mm. `GGa` lies along the
/// lower edge, `GGm` along the diagonal and out to the lone node.
fn patch() -> Mesh<2> {
    let mut nodes: Vec<_> =
        (0..9).map(|n| SVector::from([0.01 * f64::from(n % 3), 0.01 * f64::from(n / 3)])).collect();
    nodes.push(SVector::from([0.03, 0.03]));
    let mut cells = Cells::new();
    for corner in [0, 1, 3, 4] {
        for cell in [[corner, corner + 1, corner + 4], [corner, corner + 4, corner + 3]] {
            assert!(cells.push(&cell));
        }
    }
    let chain = |name: &str, nodes: &[usize]| MuscleChain { name: name.to_owned(), nodes: nodes.to_vec() };
    let muscles = vec![chain("GGa", &[0, 1, 2]), chain("GGm", &[0, 4, 8, 9])];
    let mut mesh = Mesh { nodes, cells, muscles, fixed: vec![0, 9], ..Mesh::default() };
    mesh.connect();
    mesh
}

/// The patch with its top left corner moved 3 mm to the left.
fn moved(mesh: &Mesh<2>) -> Vec<SVector<f64, 2>> {
    let mut positions = mesh.nodes.clone();
    positions[6].x -= 0.003;
    positions
}

fn picture() -> String {
    let mesh = patch();
    tongue(&mesh, &moved(&mesh), &[1], "S2 /ɯ/").unwrap()
}

#[test]
fn the_picture_shows_every_connection_muscle_and_bone_once() {
    let svg = picture();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    let mut lines = BTreeMap::<_, Vec<_>>::new();
    for path in all(&document, "polyline") {
        lines.entry(path.attribute("stroke").unwrap()).or_default().push(path);
    }
    let connections = patch().connections.len();
    assert_eq!(connections, 17);
    // One more each for the legend.
    assert_eq!(lines[GREY].len(), connections + 1);
    assert_eq!(lines[DARK].len(), connections + 1);
    assert_eq!(lines[ORANGE].len(), 2, "a contracting muscle is one solid line");
    assert_eq!(points(lines[ORANGE][0]).len(), 4);
    assert!(lines[VERMILLION].len() > 10, "a passive muscle is dashed");
    assert!(number(lines[ORANGE][0], "stroke-width") >= 2.0 * number(lines[VERMILLION][0], "stroke-width"));
    let bones = all(&document, "rect").into_iter().filter(|n| n.attribute("fill") == Some(INK)).count();
    assert_eq!(bones, 2 + 1);
    let told = texts(&document);
    for name in ["GGa", "GGm", "rest", "deformed", "bone", "S2 /ɯ/"] {
        assert_eq!(told.iter().filter(|t| *t == name).count(), 1, "{name}");
    }
    assert!(told.iter().any(|t| t.contains("front") && t.contains("back")));
}

#[test]
fn the_picture_has_one_scale_x_to_the_right_and_y_up() {
    let svg = picture();
    let document = Document::parse(&svg).unwrap();
    let edge = |color: &str, nth: usize| {
        let paths = all(&document, "polyline");
        let path = paths.into_iter().filter(|n| n.attribute("stroke") == Some(color)).nth(nth).unwrap();
        let ends = points(path);
        [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]]
    };
    let nth = |pair| patch().connections.iter().position(|c| *c == pair).unwrap();
    let [right, level] = edge(GREY, nth([0, 1]));
    let [upright, up] = edge(GREY, nth([0, 3]));
    assert!(right > 0.0 && up < 0.0);
    assert!((right + up).abs() <= 2.0, "10 mm are {right} across and {} up", -up);
    assert_eq!([level, upright], [0.0, 0.0]);
    let [left, _] = edge(DARK, nth([3, 6]));
    assert!((left + 0.3 * right).abs() <= 2.0, "3 mm to the left are {left} of {right} for 10 mm");
}

#[test]
fn a_picture_of_anything_fits_a_page() {
    let mut mesh = patch();
    for stretch in [[1e-6, 1.0], [100.0, 1.0], [1.0, 100.0], [0.0, 0.0]] {
        mesh.nodes = patch().nodes.iter().map(|p| p.component_mul(&SVector::from(stretch))).collect();
        let svg = tongue(&mesh, &mesh.nodes, &[], "").unwrap();
        let document = Document::parse(&svg).unwrap();
        assert!(number(document.root_element(), "height") < 1400.0);
    }
    tongue(&Mesh::default(), &[], &[], "nothing").unwrap();
}

#[test]
fn a_picture_of_eight_muscles_names_each() {
    let mut mesh = patch();
    let names = ["GGa", "GGm", "GGp", "SGp", "SGm", "SGa", "HGa", "HGp"];
    mesh.muscles = names
        .map(|name| MuscleChain { name: name.to_owned(), nodes: mesh.muscles[1].nodes.clone() })
        .to_vec();
    let svg = tongue(&mesh, &mesh.nodes, &[0, 4, 6], "all").unwrap();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    let told = texts(&document);
    assert!(names.iter().all(|name| told.iter().filter(|t| t == name).count() == 1), "{told:?}");
    let told = all(&document, "desc")[0].text().unwrap();
    assert!(told.contains("Contracting muscles: GGa, SGm, HGa."), "{told}");
}

#[test]
fn a_picture_of_inconsistent_data_is_refused() {
    let mesh = patch();
    let good = moved(&mesh);
    let refused =
        |mesh: &Mesh<2>, deformed: &[_], active: &[_]| tongue(mesh, deformed, active, "").unwrap_err();

    assert!(matches!(refused(&mesh, &good[1..], &[]), ReportError::NodeCount { nodes: 10, deformed: 9 }));
    let mut bad = good.clone();
    bad[3].y = f64::NAN;
    assert!(matches!(refused(&mesh, &bad, &[]), ReportError::Position { shape: "deformed", node: 3, .. }));
    assert!(matches!(
        refused(&mesh, &good, &[2]),
        ReportError::Number { kind: "muscle", number: 2, count: 2, .. }
    ));

    let mut bad = mesh.clone();
    bad.muscles[1].nodes[2] = 10;
    assert_eq!(
        refused(&bad, &good, &[]).to_string(),
        "muscle GGm names node 10, but the mesh has 10 (counted from 0); correct the number"
    );
    let mut bad = mesh.clone();
    bad.connections[4][1] = 77;
    assert!(refused(&bad, &good, &[]).to_string().starts_with("connection 4 names node 77"));
    let mut bad = mesh.clone();
    bad.fixed.push(10);
    assert!(refused(&bad, &good, &[]).to_string().starts_with("the list of fixed nodes names node 10"));
}

const LABELS: [&str; 8] = ["GGa*", "GGm", "GGp", "SGp", "SGm*", "SGa", "HGa*", "HGp"];
const MEASURED: [f64; 8] = [0.891, 1.033, 1.178, 1.0, 0.719, 1.048, 0.786, 1.129];
const SIMULATED: [f64; 8] = [0.889, 1.041, 1.201, 0.983, 0.721, 0.961, 0.791, 1.192];

fn labels() -> Vec<String> {
    LABELS.map(str::to_owned).to_vec()
}

fn series(name: &str, values: &[f64]) -> Series {
    Series { name: name.to_owned(), values: values.to_vec() }
}

#[test]
fn bars_are_as_long_as_the_change_and_on_its_side_of_one() {
    let both = [series("measured", &MEASURED), series("simulated", &SIMULATED)];
    let svg = changes(&labels(), &both, "ɯ", "Figure 4.9: changes relative to /ɯ/").unwrap();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    // The sheet itself, two samples in the legend, then the bars of each series in the order of the labels.
    let bars = all(&document, "rect").split_off(3);
    assert_eq!(bars.len(), 16);
    let edges = |bar: Node| (number(bar, "y"), number(bar, "y") + number(bar, "height"));
    // 1.178 grows up from the baseline, 0.719 down from it.
    let (top, baseline) = edges(bars[2]);
    assert_eq!(edges(bars[4]).0, baseline);
    let unit = (baseline - top) / 0.178;
    for (bar, value) in bars.into_iter().zip(MEASURED.into_iter().chain(SIMULATED)) {
        let (top, bottom) = edges(bar);
        if value == 1.0 {
            assert!(top < baseline && bottom > baseline, "no change is a sliver on the line");
        } else {
            let tip = if value > 1.0 { top } else { bottom };
            let drawn = 1.0 + (baseline - tip) / unit;
            assert!((drawn - value).abs() < 2e-3, "{drawn} for {value}");
        }
    }
    let told = texts(&document);
    for label in LABELS.into_iter().chain(["measured", "simulated", "* contracting", "0.6", "1.0", "1.3"]) {
        assert_eq!(told.iter().filter(|t| *t == label).count(), 1, "{label}: {told:?}");
    }
    assert!(told.iter().any(|t| t == "length relative to /ɯ/"));
    let told = all(&document, "desc")[0].text().unwrap();
    assert!(told.contains("measured: GGa* 0.89, GGm 1.03"), "{told}");
}

#[test]
fn legends_of_any_length_stay_apart() {
    let names =
        ["measured by Takano and Honda (2007)", "simulated here", "simulated by Kato (2014)", "no change"];
    let many = names.map(|name| series(name, &MEASURED));
    let svg = changes(
        &labels(),
        &many,
        "ɯ",
        "a title that is so long that it needs more than a single line to be shown",
    )
    .unwrap();
    check_figure(&svg);
    let none_active = LABELS.map(|l| l.trim_end_matches('*').to_owned());
    let svg = changes(&none_active, &many[..1], "ɯ", "passive").unwrap();
    check_figure(&svg);
    assert!(!svg.contains("contracting"));
}

#[test]
fn every_range_of_ratios_has_a_readable_axis() {
    for values in [[1.0; 8], [0.999; 8], [0.01; 8], [2.7; 8], [13.0; 8], [100.0; 8]] {
        let svg = changes(&labels(), &[series("measured", &values)], "ɯ", "range").unwrap();
        check_figure(&svg);
        let document = Document::parse(&svg).unwrap();
        let ticks = texts(&document).iter().filter(|t| t.parse::<f64>().is_ok()).count();
        assert!((3..=12).contains(&ticks), "{ticks} ticks for {}", values[0]);
    }
}

#[test]
fn a_chart_of_inconsistent_data_is_refused() {
    let good = series("measured", &MEASURED);
    let refused = |labels: &[String], series: &[Series]| changes(labels, series, "ɯ", "").unwrap_err();
    let (five, none) = (vec![good.clone(); 5], ReportError::ChartShape { labels: 8, series: 0, most: 4 });
    assert_eq!(refused(&labels(), &[]).to_string(), none.to_string());
    assert!(matches!(refused(&labels(), &five), ReportError::ChartShape { series: 5, most: 4, .. }));
    assert!(matches!(refused(&[], &[series("x", &[])]), ReportError::ChartShape { labels: 0, .. }));
    assert!(matches!(
        refused(&labels(), &[good, series("short", &MEASURED[..7])]),
        ReportError::SeriesLength { series, values: 7, labels: 8 } if series == "short"
    ));
    for value in [f64::NAN, f64::INFINITY, 0.0, -0.3, 101.0] {
        let mut values = MEASURED;
        values[4] = value;
        let error = refused(&labels(), &[series("measured", &values)]);
        assert!(matches!(&error, ReportError::Ratio { label, .. } if label == "SGm*"), "{error}");
    }
}

#[test]
fn the_same_numbers_give_the_same_bytes() {
    assert_eq!(picture(), picture());
    let chart = || changes(&labels(), &[series("measured", &MEASURED)], "ɯ", "t").unwrap();
    assert_eq!(chart(), chart());
}
