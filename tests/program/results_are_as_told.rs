//! The files in `results/` were made by the commands that `results/README.md` names, with the same options.

use std::collections::BTreeMap;
use std::path::Path;

/// Options that do not influence a result, each with the number of its values.
const WITHOUT_INFLUENCE: [(&str, usize); 6] =
    [("--out", 1), ("--threads", 1), ("-q", 0), ("--quiet", 0), ("-v", 0), ("--json", 0)];

/// The words of a command line that influence the result.
fn words(command: &str) -> Vec<String> {
    let mut words = command.split_whitespace();
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        match WITHOUT_INFLUENCE.iter().find(|(option, _)| *option == word) {
            Some((_, values)) => drop(words.by_ref().take(*values).last()),
            None => kept.push(word.to_owned()),
        }
    }
    kept
}

/// Folder and command of every row of the README's table that names a command.
fn commands_in(readme: &str) -> Vec<(String, String)> {
    let rows = readme.lines().filter_map(|line| line.strip_prefix("| `"));
    let cells = rows.filter_map(|row| row.split_once("/` | `"));
    cells.map(|(folder, rest)| (folder.to_owned(), rest.split('`').next().unwrap().to_owned())).collect()
}

/// All commands that a file records.
fn recorded(path: &Path) -> Vec<String> {
    let Ok(text) = std::fs::read_to_string(path) else { return Vec::new() };
    if path.extension().is_some_and(|e| e == "csv") {
        let mut table = csv::Reader::from_reader(text.as_bytes());
        let column = table.headers().unwrap().iter().position(|name| name == "command");
        let of = |row: csv::StringRecord| column.map(|at| row[at].to_owned());
        return table.records().filter_map(|row| of(row.unwrap())).collect();
    }
    let ends = ['"', '<', '\n'];
    let after = ["\"command\":\"", "\"command\": \"", "command: "];
    let found = after.iter().flat_map(|key| text.split(key).skip(1));
    let commands = found.map(|rest| rest.split(ends).next().unwrap().trim().to_owned());
    commands.filter(|command| command.starts_with("tongue-")).collect()
}

#[test]
fn every_file_of_the_results_records_the_command_that_the_readme_names() {
    let results = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    let read = |name: &str| commands_in(&std::fs::read_to_string(results.join(name)).unwrap());
    let in_space = read("space/README.md").into_iter().map(|(folder, by)| (format!("space/{folder}"), by));
    let table: Vec<(String, String)> = read("README.md").into_iter().chain(in_space).collect();
    assert!(table.len() >= 12, "{table:?}");
    let mut wrong = Vec::new();
    let mut compared = 0;
    for (folder, command) in &table {
        for entry in std::fs::read_dir(results.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let commands = recorded(&path);
            compared += commands.len();
            let other = commands.iter().find(|by| words(by) != words(command));
            wrong.extend(other.map(|by| format!("{}: `{by}`, in the README `{command}`", path.display())));
        }
    }
    assert!(compared > 500, "{compared}");
    assert!(wrong.is_empty(), "make these again:\n{}", wrong.join("\n"));
}

#[test]
fn every_picture_of_a_scene_records_that_scene() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("results/scenes");
    let mut pictures = 0;
    for entry in std::fs::read_dir(scenes).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "svg") {
            let scene = path.file_stem().unwrap().to_str().unwrap();
            let commands = recorded(&path);
            assert_eq!(commands.len(), 1, "{}", path.display());
            assert_eq!(words(&commands[0]), ["tongue-fit", "scene", "run", scene], "{}", path.display());
            pictures += 1;
        }
    }
    assert!(pictures >= 17, "{pictures}");
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The rows of a table of the results.
fn rows(path: &str) -> Vec<BTreeMap<String, String>> {
    let mut table = csv::Reader::from_path(root().join("results").join(path)).unwrap();
    table.deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, key: &str) -> f64 {
    row[key].parse().unwrap()
}

/// The text of a page in one line.
fn page(path: &str) -> String {
    let text = std::fs::read_to_string(root().join(path)).unwrap();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn what_pages_tell_of_the_plane_of_continua_and_of_locking_is_that_of_the_results() {
    let mut errors: Vec<f64> = rows("plane/alone.csv").iter().map(|row| number(row, "error")).collect();
    errors.sort_by(f64::total_cmp);
    let missed = format!("misses {:.0} % of the motion of", 100.0 * errors[errors.len() / 2]);
    for path in ["README.md", "docs/model.md", "docs/space.md"] {
        assert!(page(path).contains(&missed), "{missed} in {path}");
    }
    let settings = rows("continuum/sensitivity.csv");
    let of = |name: &str| settings.iter().find(|row| row["setting"] == name).unwrap();
    let times = number(of("default settings, nu 0.49"), "best_factor");
    let by = 100.0 * (number(of("nu 0.499"), "median") - 1.0);
    let passive = ["batch/fits.csv", "batch/nu-0.499/fits.csv"].map(|path| {
        let all = rows(path);
        let own = all.iter().filter(|r| r["target_kind"] == "stretch" && r["subject"] != "S4");
        let errors: Vec<f64> = own.filter_map(|row| row["passive_rms_stretch"].parse().ok()).collect();
        (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
    });
    for told in [
        format!("needs {times:.2} times the tensions published for /a/"),
        format!("moves the tensions by about {by:.0} %"),
        format!("by {:.3} there and by {:.3} at 0.49", passive[1], passive[0]),
    ] {
        assert!(page("docs/model.md").contains(&told), "{told}");
    }
}

#[test]
fn the_signs_that_survive_the_plane_are_those_of_its_study() {
    let rows = rows("plane/signs.csv");
    let count = |row: &BTreeMap<String, String>, key: &str| row[key].parse::<usize>().unwrap();
    let right_of_all = |how: &str, is_of: &dyn Fn(&str) -> bool| {
        let own: Vec<_> = rows.iter().filter(|row| is_of(&row["muscle"])).collect();
        let sum = |end: &str| own.iter().map(|row| count(row, &format!("{how}_{end}"))).sum::<usize>();
        format!("{} of {}", sum("right"), sum("right") + sum("wrong"))
    };
    let (sure, probable) = (right_of_all("surely", &|_| true), right_of_all("probably", &|_| true));
    let without = right_of_all("surely", &|muscle| muscle != "GGa");
    let told = page("docs/model.md");
    let [alike, alarms] =
        ["alike", "surely_where_alike"].map(|key| rows.iter().map(|row| count(row, key)).sum::<usize>());
    let wanted = format!(
        "{sure} differences that are called sure have the right sign ({without} without GGa), and {probable} that are called probable; \
         {alarms} of {alike} differences too small to count are called sure"
    );
    assert!(told.contains(&wanted), "{wanted}");
}
