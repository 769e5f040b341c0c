//! Muscle activity, tension curves and labels of recordings are read, and faults are reported with line and column.

use tongue_fit::dynamics::Curves;
use tongue_fit::measured::{Activity, Muscles};
use tongue_input::measured::lengths::Malformed;
use tongue_input::measured::recording::{Label, text_grid};

use crate::fixtures::{says, vowel};

const TABLE: &str = "# mine\nmuscle,i,a,full_n_per_m\nGGa,0.2,,\n# of both\nHG,0,0.5,40\nSGm,0.1,1,\n";

fn tensions(table: &str, label: &str, full: Option<f64>) -> Result<Vec<(usize, f64)>, Malformed> {
    let muscles = Muscles::built_in();
    let names: Vec<String> = muscles.all().iter().map(|m| m.name.clone()).collect();
    Activity::read(table.as_bytes(), "t.csv")?.tensions(&vowel(label), full, &names)
}

fn curves(text: &str) -> Result<Curves, Malformed> {
    Curves::read(text.as_bytes(), "t.csv", &["GGa", "GGm", "SGm"].map(String::from))
}

#[test]
fn activity_times_full_tension_by_name_or_by_group_however_the_table_is_written() {
    // GGa has an empty cell; both portions of the hyoglossus have the row HG, with a full tension of its own.
    let (a, i) = ([(6, 20.0), (7, 20.0), (4, 30.0)], [(0, 6.0), (6, 0.0), (7, 0.0), (4, 3.0)]);
    let german = TABLE.replace(',', ";").replace('.', ",").replace('\n', "\r\n");
    let japanese =
        TABLE.replace("# mine\n", "筋電図\n").replace("muscle,i,a", "筋,い,あ").replace("0.5", "０．５");
    let percent = TABLE.replace("i,a,full_n_per_m", "i (%),a_%,Full (N/m)").replace("0.2", "20");
    let percent = percent.replace("0.1,1", "10,100").replace("0.5", "50");
    let marked = TABLE.replace("0.2,,", "0.2,NA,");
    for table in [TABLE, &german, &format!("\u{feff}{german}"), &japanese, &percent, &marked] {
        assert_eq!(tensions(table, "a", Some(30.0)).unwrap(), a, "{table}");
        assert_eq!(tensions(table, "i", Some(30.0)).unwrap(), i, "{table}");
    }
    // Without a full tension for the other muscles, only muscles that have one can be used.
    assert_eq!(tensions("muscle,a,full_n_per_m\nHG,0.5,40\n", "a", None).unwrap(), a[..2]);
    // In lower case this label has more bytes.
    assert_eq!(tensions("muscle,İİ (%)\nGGa,50\n", "İİ", Some(30.0)).unwrap(), [(0, 15.0)]);
    // A bad cell is an error only if it is used.
    assert_eq!(tensions("muscle,a,note\nGGa,1,left side\n", "a", Some(30.0)).unwrap(), [(0, 30.0)]);
}

#[test]
fn columns_of_curves_may_come_in_any_order() {
    let read = curves("SGm, time_s, GGa\n1, 0, 2\n3, 0.5, 4\n").unwrap();
    assert_eq!(read.muscles, [2, 0]);
    let mut out = [0.0; 3];
    read.tensions.write_at(0.25, &mut out);
    assert_eq!(out, [3.0, 0.0, 2.0]);
    assert_eq!(curves("SGm;time_s;GGa\n1;0;2\n3;0,5;4\n"), Ok(read));
}

#[test]
fn faults_are_named_with_line_and_column() {
    let of_activity = [
        ("muscle,a\nGGa,1.2\n", "2:2: a is 1.2, but an activity lies between 0 and 1; divide by"),
        ("muscle,a\nGGa,much\n", "2:2: a is \"much\", not a number; write a number from 0 to 1 with"),
        ("muscle;a;o\nGGa;0,5;0,7\nHG;0.5;0,1\n", "3:2: a is \"0.5\", with a decimal point"),
        ("muscle,a\nGGa,1\ngga,1\n", "3:1: gga is given twice, here and on line 2"),
        ("muscle,a\nHG,1\nHGa,1\n", "3:1: two rows give HGa"),
        ("muscle,a\nmasseter,1\n", "2:1: the body has no muscle masseter"),
        ("muscle,o\nGGa,1\n", "1:1: it has no column /a/; it has /o/"),
        ("a,GGa\n1,1\n", "1:1: it has no column muscle, no vowel or no row; line 1 was taken"),
        ("muscle,a\n", "1:1: it has no column muscle, no vowel or no row"),
        ("muscle,a,a\nGGa,1,1\n", "1:3: column a appears twice, here and as column 2"),
        ("muscle,a,full_n_per_m\nGGa,1,-3\n", "2:3: full_n_per_m is -3; write a finite tension"),
        (
            "muscle,a,full_n_per_m\nGGa,1,1e9\n",
            "2:1: GGa: a tension is 1000000000 N; it must be from 0 to 10000 N",
        ),
        (TABLE, "6:1: SGm has no tension at activity 1; fill its cell of full_n_per_m, or give --full"),
    ];
    let of_curves = [
        ("time_s,GGa\n0,1\n0.2,1\n0.1,1\n", "4:1: time_s is 0.1; it does not come after"),
        ("time_s,GGa\n0,1\n0,2\n", "3:1: time_s is 0; it does not come after"),
        ("time_s,GGa\n0,1\n,1\n", "3:1: time_s is missing"),
        ("time_s,GGa\n0,inf\n", "2:2: GGa is inf; it must be finite"),
        ("time_s,GGa\n0,-1\n", "2:2: GGa is -1; it must not be negative"),
        ("time_s,GGa\n0,x\n", "2:2: GGa is \"x\", not a number"),
        ("time_s,GGa\n0\n", "2:2: the line has 1 fields where the header, line 1, has 2"),
        ("time_s,GGaa\n0,1\n", "1:2: unknown muscle \"GGaa\"; did you mean \"GGa\"?"),
        ("time_s,GGa,gga\n0,1,1\n", "1:3: column gga says the same as column 2 (GGa)"),
        ("GGa,GGm\n1,2\n", "1:1: there is no column time_s"),
        ("time_s\n1\n", "1:1: the table has fewer than two columns"),
        ("time_s,GGa\n", "2:1: no row below the header"),
    ];
    let of_activity = of_activity.map(|(table, expected)| {
        let full = (table != TABLE).then_some(30.0);
        (tensions(table, "a", full).unwrap_err(), expected)
    });
    let of_curves = of_curves.map(|(table, expected)| (curves(table).unwrap_err(), expected));
    for (fault, expected) in of_activity.into_iter().chain(of_curves) {
        assert!(fault.to_string().starts_with(&format!("t.csv:{expected}")), "{fault}");
    }
    says(tensions(include_str!("../../targets/fang2009_patterns.csv"), "a", None), "not say how active");
}

/// A TextGrid of Praat with a tier of intervals and a tier of points; the short form has the same intervals.
const LONG: &str = include_str!("../praat/long.TextGrid");
pub const TEXT_GRID: &str = include_str!("../praat/short.TextGrid");

#[test]
fn long_and_short_text_grids_say_the_same_and_cut_ones_are_refused_with_a_line() {
    let read = |text: &str| text_grid(text.as_bytes(), "a.TextGrid").map_err(|e| e.to_string());
    let found = read(LONG).unwrap();
    let label = Label { tier: "phones".into(), name: "a \"1\"".into(), from_s: 0.4, to_s: 1.5 };
    assert_eq!((&found, &read(TEXT_GRID).unwrap()), (&vec![label], &found));
    assert!(found[0].holds(0.4) && found[0].holds(1.5) && !found[0].holds(0.39));
    for end in [30, 200, LONG.len() - 4, LONG.len() - 30] {
        assert!(read(&LONG[..end]).unwrap_err().starts_with("a.TextGrid:"));
    }
    assert!(read(&TEXT_GRID.replace("\n2\n", "\n1e300\n")).unwrap_err().contains("missing"));
}

#[cfg(unix)]
#[test]
fn devices_pipes_and_large_files_are_refused() {
    use std::path::Path;
    let refused = |path: &Path| tongue_input::files::read_text(path).unwrap_err().to_string();
    assert_eq!(refused(Path::new("/dev/zero")), "it is a pipe or a device, which may never end");
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(refused(folder.path()), "it is a folder");
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    assert_eq!(refused(&pipe), "it is a pipe or a device, which may never end");
    let long = folder.path().join("long");
    std::fs::File::create(&long).unwrap().set_len((16 << 20) + 1).unwrap();
    assert_eq!(refused(&long), "it is larger than 16 MiB");
}
