//! The SVG figures and a body for ParaView are well-formed, correct and readable, and have the same bytes every time.

use nalgebra::SVector;
use roxmltree::{Document, Node};
use tongue_files::report::{
    AnimationFrame, Export, PrecisionCurve, Provenance, ReportError, Scatter, SectionPicture, Series, Vtu,
    animation, changes, parts, probability, scatter, solid, tongue, work_precision,
};
use tongue_fit::body::{self, Cells, Mesh, MuscleChain};

fn number(node: Node, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

fn all<'a>(document: &'a Document, tag: &str) -> Vec<Node<'a, 'a>> {
    document.descendants().filter(|n| n.has_tag_name(tag)).collect()
}

fn texts(document: &Document) -> Vec<String> {
    all(document, "text").iter().map(|n| n.text().unwrap().trim().to_owned()).collect()
}

/// The polylines of a path, px.
fn chains(path: Node) -> Vec<Vec<[f64; 2]>> {
    let data = path.attribute("d").unwrap().replace('Z', "");
    let pair = |p: &str| {
        let (x, y) = p.split_once(' ').unwrap();
        [x.parse().unwrap(), y.parse().unwrap()]
    };
    data.split('M').skip(1).map(|chain| chain.split('L').map(pair).collect()).collect()
}

/// The paths with a stroke of this colour and width.
fn stroked<'a>(document: &'a Document, colour: &str, width: &str) -> Vec<Node<'a, 'a>> {
    let is = |n: &Node| n.attribute("stroke") == Some(colour) && n.attribute("stroke-width") == Some(width);
    all(document, "path").into_iter().filter(is).collect()
}

/// Left, top, right and bottom of a text, by the mean width of sans-serif letters; `None` if it is rotated.
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
    let foot = number(node, "y");
    Some([left, foot - 0.75 * size, left + width, foot + 0.05 * size])
}

/// Checks that hold for every figure.
fn check_figure(svg: &str) {
    let document = Document::parse(svg).unwrap();
    let root = document.root_element();
    let (right, bottom) = (number(root, "width"), number(root, "height"));
    assert!(right <= 900.0);
    assert_eq!(root.attribute("viewBox"), Some(format!("0 0 {right} {bottom}").as_str()));

    for tag in ["title", "desc"] {
        assert!(!all(&document, tag)[0].text().unwrap().is_empty(), "{tag}");
    }
    for text in all(&document, "text") {
        assert!(number(text, "font-size") >= 24.0);
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
    for path in all(&document, "path") {
        for [x, y] in chains(path).into_iter().flatten() {
            assert!((0.0..=right).contains(&x) && (0.0..=bottom).contains(&y), "({x}, {y}) is off the sheet");
        }
    }
}

const REST: &str = "#b4b4b4";
const DEFORMED: &str = "#555555";
const EDGES: &str = "#c9c9c9";
const INK: &str = "#222222";
const ORANGE: &str = "#e69f00";
const VERMILLION: &str = "#d55e00";

/// A square of 20 mm in 8 triangles with nodes `3 row + column`, and a node outside at (30, 30) mm. `GGa` is the lower edge, `GGm` the
/// diagonal and its continuation to the node outside.
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

/// The picture of a shape whose muscles have these tensions.
fn drawn(mesh: &Mesh<2>, positions: &[SVector<f64, 2>], tensions: &[f64], title: &str) -> String {
    tongue(&SectionPicture::new(mesh, positions, tensions, &[], title)).unwrap().to_string()
}

fn picture() -> String {
    let mesh = patch();
    drawn(&mesh, &moved(&mesh), &[0.0, 2.5], "S2 /ɯ/")
}

#[test]
fn a_probability_does_not_seem_to_reach_the_limit_of_a_word_that_it_stays_below() {
    // The limits are 0.8 (probably) and 0.95 (surely).
    let words =
        [0.949, 0.95, 0.796, 0.8, 0.5, 0.204, 0.2, 0.051, 0.05, 0.29, 0.58, 1.0, 0.0, 0.999].map(probability);
    let wanted = [
        "0.94", "0.95", "0.79", "0.80", "0.50", "0.21", "0.20", "0.06", "0.05", "0.29", "0.58", "1.00",
        "0.00", "0.99",
    ];
    assert_eq!(words, wanted);
}

#[test]
fn the_picture_shows_every_connection_muscle_and_bone_once() {
    let svg = picture();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    let edges = stroked(&document, EDGES, "1");
    assert_eq!(patch().connections.len(), 17);
    assert_eq!(chains(edges[0]).len(), 16, "all but the one out of the tissue, which is a muscle's");
    for colour_width in [(REST, "2"), (DEFORMED, "2.6")] {
        let outline = chains(stroked(&document, colour_width.0, colour_width.1)[0]);
        assert_eq!(outline.iter().map(Vec::len).collect::<Vec<_>>(), [8], "one ring of eight nodes");
    }
    let contracting = stroked(&document, ORANGE, "8");
    assert_eq!(contracting.len(), 1);
    assert!(contracting[0].attribute("stroke-dasharray").is_none());
    let passive = stroked(&document, VERMILLION, "3.5");
    assert_eq!((passive.len(), chains(passive[0])[0].len()), (1, 3));
    assert!(passive[0].attribute("stroke-dasharray").is_some());
    let bones = all(&document, "rect").into_iter().filter(|n| n.attribute("fill") == Some(INK)).count();
    assert_eq!(bones, 1 + 1, "the one in view, and one in the legend");
    let words = texts(&document);
    let contracts = "contracting, with its tension in N per metre of thickness";
    let names =
        ["GGa", "GGm 2.5", "rest", "deformed", "bone", "to its bone, out of view", contracts, "S2 /ɯ/"];
    for name in names {
        assert_eq!(words.iter().filter(|t| *t == name).count(), 1, "{name}: {words:?}");
    }
    assert!(words.iter().any(|t| t.contains("front") && t.contains("back")));
}

#[test]
fn pictures_of_one_body_have_the_same_axes() {
    let mesh = patch();
    let axes = |svg: &str| {
        let document = Document::parse(svg).unwrap();
        let numbers = all(&document, "text")
            .into_iter()
            .filter(|n| n.text().unwrap().replace('\u{2212}', "-").parse::<f64>().is_ok());
        numbers.map(|n| ["x", "y"].map(|a| n.attribute(a).unwrap().to_owned())).collect::<Vec<_>>()
    };
    let rest = axes(&drawn(&mesh, &mesh.nodes, &[0.0, 0.0], "a"));
    assert!(rest.len() > 8);
    assert_eq!(rest, axes(&drawn(&mesh, &moved(&mesh), &[1.0, 0.0], "a")));
    let mut far = mesh.nodes.clone();
    far[6].x -= 0.05;
    assert_ne!(rest, axes(&drawn(&mesh, &far, &[0.0, 0.0], "a")), "unless the tissue would leave them");
}

#[test]
fn the_picture_has_one_scale_x_to_the_right_and_y_up() {
    let svg = picture();
    let document = Document::parse(&svg).unwrap();
    let ring = |colour, width| {
        let ring = chains(stroked(&document, colour, width)[0]).remove(0);
        let bound = |i: usize, pick: fn(f64, f64) -> f64| ring.iter().map(|p| p[i]).reduce(pick).unwrap();
        [bound(0, f64::min), bound(0, f64::max), bound(1, f64::min), bound(1, f64::max)]
    };
    let [left, right, top, bottom] = ring(REST, "2");
    assert!((right - left - (bottom - top)).abs() <= 0.2, "a square is a square");
    let unit = (right - left) / 20.0;
    // Only the top left corner moved, by 3 mm to the left.
    let [moved, ..] = ring(DEFORMED, "2.6");
    assert!((left - moved - 3.0 * unit).abs() <= 0.2);
    let corner = chains(stroked(&document, DEFORMED, "2.6")[0]).remove(0);
    let [_, y] = corner.into_iter().min_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
    assert_eq!(y, top);
}

#[test]
fn the_palate_is_a_band_on_the_far_side_and_stretch_has_a_scale() {
    let mesh = patch();
    let palate = [[-0.004, 0.022], [0.01, 0.023], [0.024, 0.022]].map(SVector::from);
    let positions = moved(&mesh);
    let section = SectionPicture::new(&mesh, &positions, &[0.0, 1.0], &palate, "palate");
    let section = SectionPicture { contact: true, stretch: true, ..section };
    let svg = tongue(&section).unwrap().to_string();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    let words = texts(&document);
    assert!(words.iter().any(|t| t == "palate") && words.iter().any(|t| t.starts_with("largest stretch")));
    let grey = all(&document, "path").into_iter().find(|n| n.attribute("fill") == Some("#a8a8a8")).unwrap();
    let highest =
        |chains: Vec<Vec<[f64; 2]>>| chains.into_iter().flatten().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let outline = stroked(&document, DEFORMED, "2");
    assert!(highest(chains(grey)) < highest(chains(outline[0])) - 5.0, "the band lies above the outline");
}

#[test]
fn a_picture_of_anything_fits_a_page() {
    let mut mesh = patch();
    for stretch in [[1e-6, 1.0], [100.0, 1.0], [1.0, 100.0], [0.0, 0.0]] {
        mesh.nodes = patch().nodes.iter().map(|p| p.component_mul(&SVector::from(stretch))).collect();
        let svg = drawn(&mesh, &mesh.nodes, &[0.0, 0.0], "");
        let document = Document::parse(&svg).unwrap();
        assert!(number(document.root_element(), "height") < 1400.0);
    }
    drawn(&Mesh::default(), &[], &[], "nothing");
}

#[test]
fn a_picture_names_each_of_eight_muscles_and_of_muscles_that_cross() {
    let named = |muscles: &[(&str, &[usize])], tensions: &[f64]| {
        let mut mesh = patch();
        let chain =
            |(name, nodes): &(&str, &[usize])| MuscleChain { name: (*name).into(), nodes: nodes.to_vec() };
        mesh.muscles = muscles.iter().map(chain).collect();
        let svg = drawn(&mesh, &mesh.nodes, tensions, "all");
        check_figure(&svg);
        let document = Document::parse(&svg).unwrap();
        for (name, _) in muscles {
            let words = texts(&document);
            assert_eq!(words.iter().filter(|t| t.split(' ').next() == Some(*name)).count(), 1, "{words:?}");
        }
        all(&document, "desc")[0].text().unwrap().to_owned()
    };
    named(&[("GGa", &[0, 4, 8]), ("GGm", &[6, 4, 2]), ("GGp", &[1, 4, 7])], &[12.0; 3]);
    let ends: [&[usize]; 8] = [&[0, 4], &[1, 5], &[3, 7], &[4, 8], &[1, 2], &[3, 6], &[6, 7], &[2, 5]];
    let eight: Vec<_> = LABELS.map(|label| label.trim_end_matches('*')).into_iter().zip(ends).collect();
    let description = named(&eight, &[12.0, 0.0, 0.0, 0.0, 11.5, 0.0, 4.5, 0.0]);
    assert!(description.contains("Contracting muscles: GGa, SGm, HGa."), "{description}");
    assert!(named(&eight, &[0.0; 8]).contains("Contracting muscles: none."));
}

#[test]
fn hostile_titles_stay_well_formed_and_readable() {
    let (hostile, clean) = ("a < b & \"c\" > 'd' \u{0}\u{1b}\u{ffff} /ɯ/", "a < b & \"c\" > 'd' /ɯ/");
    let mesh = patch();
    let svg = drawn(&mesh, &mesh.nodes, &[0.0, 0.0], hostile);
    let document = Document::parse(&svg).unwrap();
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(all(&document, "title")[0].text().unwrap()).contains(clean), "{svg}");
    assert!(words(&texts(&document).join(" ")).contains(clean), "{svg}");
}

#[test]
fn every_frame_of_an_animation_is_there_and_the_last_one_shows_without_it() {
    let mesh = patch();
    let frame = |i: u8| {
        let mut positions = mesh.nodes.clone();
        positions[6].x -= 1e-3 * f64::from(i);
        AnimationFrame { time: f64::from(i), positions, tensions: vec![f64::from(i), 0.0] }
    };
    let svg = animation(&mesh, &[], &[0, 1, 2].map(frame), &[], false, "a < b").unwrap().to_string();
    let document = Document::parse(&svg).unwrap();
    let groups: Vec<_> = document.descendants().filter(|n| n.has_attribute("visibility")).collect();
    let ring = |n: &Node| {
        let path = n.children().find(|c| c.attribute("stroke") == Some(DEFORMED)).unwrap();
        path.attribute("d").unwrap().to_owned()
    };
    assert_ne!(ring(&groups[0]), ring(&groups[2]));
    assert!(groups.iter().all(|g| g.first_element_child().unwrap().has_tag_name("animate")));
    let visible: Vec<_> = groups.iter().map(|g| g.attribute("visibility").unwrap()).collect();
    assert_eq!(visible, ["hidden", "hidden", "visible"]);
    let words = texts(&document);
    assert!(["0.00 s", "1.00 s", "2.00 s"].iter().all(|time| words.iter().any(|t| t == time)), "{words:?}");
    assert!(matches!(animation(&mesh, &[], &[], &[], false, ""), Err(ReportError::NoFrame)));
}

#[test]
fn a_block_shows_one_side_in_each_view() {
    let mesh = body::solid::block([1.0, 1.0, 1.0], [2, 2, 2]);
    let svg = solid(&mesh, &mesh.nodes, "block").unwrap().to_string();
    let document = Document::parse(&svg).unwrap();
    let faces = document.descendants().filter(|n| n.attribute("stroke-width") == Some("0.7"));
    let faces: Vec<&str> = faces.filter_map(|n| n.attribute("fill")).collect();
    assert_eq!(faces.len(), mesh.surface().len() / 2, "three of six sides");
    assert!(faces.iter().all(|fill| *fill == faces[0]), "each is turned to the viewer: {faces:?}");
}

#[test]
fn a_solid_is_written_as_tetrahedra() {
    let mesh = body::solid::cylinder(0.01, 0.02, 1, 2);
    let text = Vtu::new(&mesh, &mesh.nodes, &[0.5; 7]).unwrap().text(&Provenance::new("")).unwrap();
    let document = Document::parse(&text).unwrap();
    let values = |name: &str| -> Vec<f64> {
        let array = document.descendants().find(|n| n.attribute("Name") == Some(name)).unwrap();
        array.text().unwrap().split_whitespace().map(|w| w.parse().unwrap()).collect()
    };
    assert_eq!(values("types").iter().filter(|k| **k == 10.0).count(), mesh.cells.len());
    let lines: usize = mesh.muscles.iter().map(|m| m.nodes.len() - 1).sum();
    assert_eq!(values("volume_ratio"), vec![1.0; mesh.cells.len() + lines]);
    assert_eq!(values("tension_n").last(), Some(&0.5));
    assert_eq!(values("position").len(), 3 * mesh.nodes.len());
}

#[test]
fn what_is_predicted_exactly_lies_on_the_diagonal() {
    let muscles = ["GGa", "mine"].map(String::from);
    let panel = |title: &str, points| Scatter { title: title.into(), line: "0.1 RMS".into(), points };
    let panels = [panel("exact", vec![(0, 1.1, 1.1), (1, 0.9, 0.9)]), panel("high", vec![(0, 1.1, 1.3)])];
    let svg = scatter(&muscles, &panels, "Predicted").to_string();
    let document = Document::parse(&svg).unwrap();
    // The first two dots are those of the legend.
    let dots: Vec<_> = all(&document, "circle").iter().map(|n| ["cx", "cy"].map(|c| number(*n, c))).collect();
    assert_eq!(dots.len(), 5);
    assert!((dots[2][0] - dots[3][0] + dots[2][1] - dots[3][1]).abs() < 0.3, "{dots:?}");
    assert!(dots[4][1] < dots[2][1] - 20.0, "higher than measured");
    assert!(svg.contains("exact: 0.1 RMS."));
}

#[test]
fn every_curve_of_precision_is_told_and_what_has_no_place_is_left_out() {
    let curve =
        |name: &str, points: &[(f64, f64)]| PrecisionCurve { name: name.into(), points: points.to_vec() };
    let curves = [curve("Newton", &[(1e-4, 1e-2), (2e-4, 0.0)]), curve("<Verlet>", &[(1.0, 1e-3)])];
    let svg = work_precision("T", "time, s", "error, mm", &curves).unwrap().to_string();
    let words = texts(&Document::parse(&svg).unwrap());
    for name in ["Newton", "<Verlet>", "time, s", "error, mm"] {
        assert!(words.iter().any(|t| t == name), "{name}");
    }
    assert!(svg.contains("Newton: (1.00e-4, 1.00e-2)."), "the zero has no place");
    assert!(matches!(work_precision("T", "x", "y", &[]), Err(ReportError::Curves { curves: 0, .. })));
}

#[test]
fn a_picture_of_inconsistent_data_is_refused() {
    type Breaks = fn(&mut Mesh<2>, &mut Vec<SVector<f64, 2>>, &mut Vec<f64>);
    let cases: [(Breaks, &str); 6] = [
        (|_, positions, _| positions.truncate(9), "NodeCount { nodes: 10, deformed: 9 }"),
        (|_, positions, _| positions[3].y = f64::NAN, "Position { shape: \"deformed\", node: 3"),
        (|_, _, tensions| tensions.truncate(1), "kind: \"muscle\", number: 1, count: 2"),
        (|mesh, _, _| mesh.muscles[1].nodes[2] = 10, "muscle GGm names node 10, but the mesh has 10"),
        (|mesh, _, _| mesh.connections[4][1] = 77, "connection 4 names node 77"),
        (|mesh, _, _| mesh.fixed.push(10), "the list of fixed nodes names node 10"),
    ];
    for (breaks, expected) in cases {
        let mut mesh = patch();
        let (mut positions, mut tensions) = (moved(&mesh), vec![0.0; 2]);
        breaks(&mut mesh, &mut positions, &mut tensions);
        let refused = tongue(&SectionPicture::new(&mesh, &positions, &tensions, &[], "")).unwrap_err();
        assert!(format!("{refused:?} {refused}").contains(expected), "{refused:?} {refused}");
    }
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
    let svg = changes(&labels(), &both, "ɯ", "Figure 4.9: changes relative to /ɯ/").unwrap().to_string();
    check_figure(&svg);
    let document = Document::parse(&svg).unwrap();
    // The first three are the sheet and the legend; bars follow by series, in the order of the labels.
    let bars = all(&document, "rect").split_off(3);
    assert_eq!(bars.len(), 16);
    let edges = |bar: Node| (number(bar, "y"), number(bar, "y") + number(bar, "height"));
    // The bar of 1.178 goes up from the baseline, that of 0.719 down.
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
    let words = texts(&document);
    for label in LABELS.into_iter().chain(["measured", "simulated", "* contracting", "0.6", "1.0", "1.3"]) {
        assert_eq!(words.iter().filter(|t| *t == label).count(), 1, "{label}: {words:?}");
    }
    assert!(words.iter().any(|t| t == "length relative to /ɯ/"));
    let description = all(&document, "desc")[0].text().unwrap();
    assert!(description.contains("measured: GGa* 0.89, GGm 1.03"), "{description}");
}

#[test]
fn charts_of_any_range_and_legend_are_readable() {
    for values in [[1.0; 8], [0.999; 8], [0.01; 8], [2.7; 8], [13.0; 8], [100.0; 8]] {
        let svg = changes(&labels(), &[series("measured", &values)], "ɯ", "range").unwrap().to_string();
        check_figure(&svg);
        let ticks =
            texts(&Document::parse(&svg).unwrap()).iter().filter(|t| t.parse::<f64>().is_ok()).count();
        assert!((3..=12).contains(&ticks), "{ticks} ticks for {}", values[0]);
    }
    let names =
        ["measured by Takano and Honda (2007)", "simulated here", "simulated by Kato (2014)", "no change"];
    let many = names.map(|name| series(name, &MEASURED));
    let title = "a title that is so long that it needs more than a single line to be shown";
    check_figure(&changes(&labels(), &many, "ɯ", title).unwrap().to_string());
    let none_active = LABELS.map(|l| l.trim_end_matches('*').to_owned());
    let svg = changes(&none_active, &many[..1], "ɯ", "passive").unwrap().to_string();
    check_figure(&svg);
    assert!(!svg.contains("contracting"));
}

#[test]
fn a_bar_without_a_height_is_refused() {
    for value in [f64::NAN, f64::INFINITY, 0.0, -0.3, 101.0] {
        let mut values = MEASURED;
        values[4] = value;
        let error = changes(&labels(), &[series("measured", &values)], "ɯ", "").unwrap_err();
        assert!(matches!(&error, ReportError::BarHeight { label, .. } if label == "SGm*"), "{error}");
    }
}

#[test]
fn bars_of_parts_begin_at_zero_and_reach_their_values() {
    let labels = ["GGP", "TRANS"].map(str::to_owned);
    let svg = parts(&labels, &[series("missed", &[0.25, 1.0])], "error", "t").unwrap().to_string();
    let heights: Vec<f64> = svg
        .split("height=\"")
        .filter_map(|part| part.split_once("\" fill=\"#0072b2\"")?.0.parse().ok())
        .collect();
    // The first one is that of the legend.
    assert!((heights[1] / heights[2] - 0.25).abs() < 1e-3, "{heights:?}");
    assert!(matches!(
        parts(&labels, &[series("x", &[0.5, -0.1])], "", ""),
        Err(ReportError::BarHeight { .. })
    ));
}
