//! `--posterior`: what is printed, written and refused. Where numbers do not matter the mesh is coarse (`--h`), with which a posterior
//! takes at most a third of the time.

use std::path::Path;

use serde_json::Value;
use tongue_infer::posterior::diagnostics::{Mixing, mixing};
use tongue_infer::posterior::{Certainty, MuscleVerdict, Verdict, VerdictFrom};

use super::run::{record, refused, run, sources};

/// `posterior` in tests/library shows what the README's command `tongue-fit --vowel a --posterior 1000` finds.
#[test]
fn a_posterior_is_told_in_json_and_its_draws_fill_an_array() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--vowel a --h 10 --posterior 1000 --out out");
    assert_eq!(output.status, Some(0), "{}", output.err);
    let out = folder.path().join("out");
    let fit = record(&out, "fit.json");
    let posterior = &fit["posterior"];
    assert_eq!(posterior["status"], "mixed", "{}", posterior["why"]);
    for size in ["bulk", "tail"] {
        assert!(posterior["ess"][size].as_f64().unwrap() > 400.0);
    }
    let summary = &posterior["summary"];
    let stretches = summary["stretches"].as_object().unwrap().values();
    assert_eq!(stretches.filter(|s| s["left_out"]["spread"]["interval_95"][1].is_number()).count(), 8);

    // A row for each draw, one chain after another, with as many draws in each, as xarray and ArviZ need for an array.
    let mut reader = csv::Reader::from_path(out.join("posterior.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let column = |name: &str| header.iter().position(|h| h == name).expect(name);
    let [chain, draw, gga, ..] =
        ["chain", "draw", "change_GGa_n_per_m", "version", "log_likelihood_HGp"].map(column);
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let length = rows.iter().filter(|r| &r[chain] == "0").count();
    assert!(length > 100 && rows.len() == 8 * length, "{length} of {}", rows.len());
    for (i, row) in rows.iter().enumerate() {
        assert_eq!((&row[chain], &row[draw]), (&*(i / length).to_string(), &*(i % length).to_string()));
    }
    // The reported effective draws are the fewest, and R-hat is the largest, over all sampled and reported quantities of the draws in the
    // file.
    let of_column = |at: usize| {
        let chain =
            |of: &[csv::StringRecord]| of.iter().map(|r| r[at].parse().unwrap()).collect::<Vec<f64>>();
        mixing(&rows.chunks(length).map(chain).collect::<Vec<_>>())
    };
    let all: Vec<_> = (column("log_density")..column("stretch_GGa")).map(of_column).collect();
    let fewest = |of: fn(&Mixing) -> f64| all.iter().map(of).fold(f64::INFINITY, f64::min);
    let largest = all.iter().map(|m| m.r_hat).fold(1.0, f64::max);
    let mean = rows.iter().map(|r| r[gga].parse::<f64>().unwrap()).sum::<f64>() / rows.len() as f64;
    for (found, told, room) in [
        (fewest(|m| m.bulk), &posterior["ess"]["bulk"], 1e-4),
        (fewest(|m| m.tail), &posterior["ess"]["tail"], 1e-4),
        (largest, &posterior["r_hat"], 1e-6),
        (mean, &summary["changes_n"]["GGa"]["mean"], 1.0),
    ] {
        assert!((found - told.as_f64().unwrap()).abs() < room, "{found} {told}");
    }
    let ridges = std::fs::read_to_string(out.join("ridges.svg")).unwrap();
    roxmltree::Document::parse(&ridges).unwrap();
    // The figure has the probabilities of the table.
    for change in summary["changes_n"].as_object().unwrap().values() {
        let rises = tongue_files::report::probability(change["probability_rises"].as_f64().unwrap());
        assert!(ridges.contains(&format!(">{rises}<")), "{rises}");
    }
    assert!(!out.join("pairs.svg").exists() && !out.join("outlines.svg").exists());
    // What another run leaves in the folder is told.
    let other = run(folder.path(), "--vowel i --h 10 --out out");
    assert!(
        other.err.contains("not written by this run: out/posterior.csv, out/ridges.svg"),
        "{}",
        other.err
    );
}

#[test]
fn the_page_of_a_batch_has_the_ridges_of_every_row_and_what_they_say() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "batch --subjects S2 --vowels a,u --h 10 --posterior 1000 --out out");
    let batch = record(folder.path(), "out/batch.json");
    let fits = batch["fits"].as_array().unwrap();
    let page = std::fs::read_to_string(folder.path().join("out/batch.html")).unwrap();
    // Two fits of one row, of ratios and of stretches, share one posterior, which is reported with the second.
    let ridges = page.matches("change of every tension from the baseline</title>").count();
    assert_eq!((fits.len(), ridges), (2, 1));
    assert!(fits[0]["posterior"].is_null() && fits[0]["verdict"].is_null());
    assert!(page.contains("), 1 baseline, 0 not fitted"));
    // The terminal has the tensions of the fit, and in a column of their own the medians and intervals of the posterior.
    let row = output.out.split("| S2 /a/ stretch |").nth(1).unwrap().lines().next().unwrap();
    let cells: Vec<&str> = row.split('|').map(str::trim).collect();
    let drawn = fits[1]["active"].as_array().unwrap()[..2].iter().map(|m| {
        let of = &fits[1]["posterior"]["summary"]["tensions_n"][m.as_str().unwrap()];
        let [median, low, high] = ["/median", "/interval_95/0", "/interval_95/1"]
            .map(|part| of.pointer(part).unwrap().as_f64().unwrap());
        format!("{median:.0} ({low:.0}–{high:.0})")
    });
    assert!(cells[0].starts_with("GGa ") && !cells[0].contains('('), "{row}");
    assert_eq!(cells[1], drawn.collect::<Vec<_>>().join(", "));
    let mut tables = output.out.lines().filter(|line| line.starts_with('|'));
    assert!(tables.all(|line| line.chars().count() <= 100), "{}", output.out);
    // The sentences are those with which a fit of the row begins.
    let said: Vec<MuscleVerdict> = serde_json::from_value(fits[1]["verdict"].clone()).unwrap();
    let sentences = Verdict { from: VerdictFrom::Draws, hyoid_mm: None, muscles: said }.sentences("ɯ");
    let detail = page.split("<details id=\"fit-1\">").nth(1).unwrap().split("</details>").next().unwrap();
    assert!(sentences[0].starts_with("Harder") && detail.contains(&sentences.join(" ")), "{sentences:?}");
    let changes = &fits[1]["posterior"]["summary"]["changes_n"];
    let table = page.split("id=\"posteriors\"").nth(1).unwrap().split("</table>").next().unwrap();
    assert_eq!(table.matches("#fit-1").count(), 1);
    for muscle in changes.as_object().unwrap().values() {
        let rises = muscle["probability_rises"].as_f64().unwrap();
        let word = Certainty::of(rises).text().replace(" harder", "");
        let cell = table.split(&format!("data-v=\"{rises}\"")).nth(1).unwrap();
        assert!(cell.split("</td>").next().unwrap().contains(&format!(">{word}<")), "{rises}: {cell}");
        let [low, high] = [0, 1].map(|end| muscle["interval_95"][end].as_f64().unwrap().round() + 0.0);
        assert!(table.contains(&format!(" [{low:.0}, {high:.0}]")), "{low} {high} in {table}");
    }
}

#[test]
fn intervals_that_cannot_be_trusted_are_not_printed_and_bad_priors_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "--vowel a --h 10 --posterior 100");
    assert_eq!(output.status, Some(3));
    let printed = output.out;
    let told = printed.split("POSTERIOR").nth(1).unwrap();
    assert!(told.contains("NOT MIXED") && !told.contains("95 %"), "{told}");
    for (priors, part) in [
        ("tension.scale_n_per_m = -1.0", "tension.scale_n_per_m is -1; it must be above 0"),
        ("bundle_width.median_mm = 0.0", "bundle_width.median_mm is 0; it must be above 0"),
        ("[tensoin]", "priors.toml:1: unknown field `tensoin`"),
        ("baseline.fixed_n_per_m = { Nobody = 3.0 }", "fix Nobody, a muscle that this body does not have"),
        ("discrepancy.off = true\nrounding.off = true", "one of them is needed"),
        ("tension.fixed_n_per_m = { GGa = 5.0, gga = 6.0 }", "tension.fixed_n_per_m gives gga twice"),
        ("tension.fixed_n_per_m = { GGa = 30000.0 }", "GGa is 30000; it must be from 0 to 10000"),
        (
            "hyoid.off = true\nbaseline.off = true\n[tension.fixed_n_per_m]\n\"*\" = 8.0",
            "leave at least one of them free",
        ),
    ] {
        std::fs::write(folder.path().join("priors.toml"), priors).unwrap();
        let message = refused(folder.path(), "--vowel a --posterior 400 --priors priors.toml");
        assert!(message.contains(part), "{message}");
    }
    // Numbers in kN and in m are refused. A contour that does not exist ends the run before the draws.
    for (priors, part) in [
        ("tension.scale_n_per_m = 0.02", "tension.scale_n_per_m is 0.02, where 1 to 200 are usual"),
        ("muscle_ends.sd_mm = 0.003", "muscle_ends.sd_mm is 0.003, where 0.3 to 15 are usual"),
    ] {
        std::fs::write(folder.path().join("priors.toml"), priors).unwrap();
        let line = "--vowel a --posterior 400 --priors priors.toml --contour none.csv";
        let message = refused(folder.path(), line);
        assert!(message.contains(part), "{message}");
    }
    // With slack muscles in the baseline every tension is a rise.
    std::fs::write(folder.path().join("priors.toml"), "baseline.fixed_n_per_m = { \"*\" = 0.008 }").unwrap();
    let output = run(folder.path(), "--vowel a --h 10 --posterior 600 --priors priors.toml");
    assert_eq!(output.status, Some(0), "{}", output.err);
    assert!(
        output.out.contains("every tension is a rise") && !output.out.contains("Harder"),
        "{}",
        output.out
    );
    // A change between two tensions that are fixed has no probability.
    let fixed = "tension.fixed_n_per_m = { GGa = 5.0 }\nbaseline.fixed_n_per_m = { GGa = 5.0, SGp = 3.0 }";
    std::fs::write(folder.path().join("priors.toml"), fixed).unwrap();
    let line = "--vowels a --subjects S2 --h 10 --posterior 1000 --priors priors.toml --out fixed";
    let output = run(folder.path(), &format!("batch --target stretch {line}"));
    assert!(
        output.out.contains("Fixed by the priors: GGa.") && output.out.contains("5 (fixed)"),
        "{}",
        output.out
    );
    let fit = &record(folder.path(), "fixed/batch.json")["fits"][0];
    assert_eq!((&fit["verdict"][0]["p_rises"], &fit["verdict"][0]["word"]), (&Value::Null, &"fixed".into()));
    assert!(fit["posterior"]["summary"]["changes_n"]["GGa"]["probability_rises"].is_null());
    let page = std::fs::read_to_string(folder.path().join("fixed/batch.html")).unwrap();
    assert_eq!((page.matches(">F fixed").count(), page.matches(">F0 fixed").count()), (1, 2));
}

#[test]
fn a_posterior_that_cannot_be_told_leaves_its_fit_in_a_batch_and_is_an_alarm_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/gmsh/second_order.msh");
    std::fs::write(folder.path().join("gga.csv"), "subject,vowel,GGa_mm\nX,ɯ,20\nX,a,18\n").unwrap();
    let rows = "batch --target stretch --out out --json";
    // The mesh names no hyoid.
    let of_mesh = format!("{rows} --lengths gga.csv --mesh {} --posterior 1000", mesh.display());
    let too_few = format!("{rows} --h 10 --posterior 100 --subjects S2 --vowels a");
    let missed_too = format!("{rows} --h 10 --posterior 100 --subjects S3 --vowels e");
    let untold = "error: 1 posterior cannot be reported; see";
    let both =
        "error: 1 of the 1 fits cannot be trusted (1 target not met); 1 posterior cannot be reported; see";
    for (line, reason, last) in [
        (of_mesh, "this body names no bone \"hyoid\"", untold),
        (too_few, "ask for more", untold),
        (missed_too, "ask for more", both),
    ] {
        let output = run(folder.path(), &line);
        assert_eq!(output.status, Some(3), "{}", output.err);
        assert!(output.message().contains(last), "{}", output.err);
        let batch = output.record();
        assert_eq!(batch["summary"]["posteriors_untold"], 1, "{}", batch["summary"]);
        let alarms = batch["fits"][0]["alarms"].as_array().unwrap();
        let alarm = alarms.iter().find(|a| a["kind"] == "no_posterior").unwrap();
        assert!(alarm["text"].as_str().unwrap().contains(reason), "{alarm}");
    }
}

#[test]
fn lengths_that_contradict_the_model_end_with_3_and_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    // The row /a/ of S2 is in another scale than /ɯ/: all muscles are shorter, which no tongue can be.
    let rows = "a,35,53,45,50,20,37,28,30\nS2,ɯ,46,60,45,59,32,42,42,31\n";
    let header = "subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm,HGp_mm";
    std::fs::write(folder.path().join("my.csv"), format!("{header}\nS2,{rows}")).unwrap();
    let done = run(folder.path(), "--vowel a --lengths my.csv --h 10 --posterior 1500 --out out");
    assert_eq!(done.status, Some(3), "{}", done.err);
    assert!(done.err.contains("stretches lie outside what the others predict"), "{}", done.err);
    assert_eq!(
        done.err.matches("in S2 /a/ all muscles together are 18 % shorter than in /ɯ/").count(),
        1,
        "{}",
        done.err
    );
    let fit = record(folder.path(), "out/fit.json");
    assert_eq!(
        (&fit["conclusion"]["trusted"], &fit["conclusion"]["decided_by"]),
        (&false.into(), &"posterior".into())
    );
    let short = run(folder.path(), "--vowel a --lengths my.csv --h 10 --out short");
    assert!(
        short.status == Some(3) && short.err.contains("fewer than one of a hundred speakers"),
        "{}",
        short.err
    );
    assert!(short.out.contains("No verdict"), "{}", short.out);
    for kind in ["contradicted", "no_verdict"] {
        assert!(fit["alarms"].as_array().unwrap().iter().any(|alarm| alarm["kind"] == kind), "{kind}");
    }
    let batch = "batch --lengths my.csv --vowels a --target stretch --h 10 --posterior 1500 --json --out all";
    let done = run(folder.path(), batch);
    assert_eq!(done.status, Some(3), "{}", done.err);
    assert_eq!(done.record()["summary"]["posteriors_contradicted"], 1);
    assert!(done.message().contains("1 row of lengths that the model contradicts"), "{}", done.err);
}

#[test]
fn the_priors_that_are_printed_are_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let priors = run(folder.path(), "priors").out;
    let read = tongue_infer::posterior::Priors::from_toml(&priors, "printed").unwrap();
    assert_eq!(read, tongue_infer::posterior::Priors::default());
    let printed = |name: &str| -> f64 {
        let line = priors.lines().find_map(|l| l.strip_prefix(&format!("# {name} = "))).unwrap();
        line.split_once(" # ").unwrap().0.parse().unwrap()
    };
    let (errors, link) =
        (tongue_infer::track::ErrorModel::default(), tongue_infer::track::Softplus::default());
    let space = tongue_infer::inverse::in_space::SpaceSearch::default();
    for (name, used) in [
        ("slow_mm", errors.slow_mm),
        ("static_mm", errors.static_mm),
        ("points_apart_mm", errors.apart_mm),
        ("tension_n", link.scale_n()),
        ("level_n", link.level_sd_n),
        ("course_n", link.deviation_sd_n),
        ("activation", space.prior_sd),
        ("stretch", read.discrepancy.sd),
        ("hyoid_mm", read.hyoid.sd_mm),
        ("hyoid_mm", 1e3 * tongue_infer::inverse::BONE_SD_M),
        ("muscle_end_mm", read.muscle_ends.sd_mm),
        ("formant", tongue_infer::acoustics::TRACT_SD),
    ] {
        assert!((printed(name) - used).abs() < 1e-12, "{name}: {} is printed, {used} used", printed(name));
    }
}

/// A limit counted in standard deviations (`MOST_SD`) is not a standard deviation.
#[test]
fn no_standard_deviation_stands_outside_the_table_that_is_printed() {
    let mut found = Vec::new();
    for (path, source) in sources("crates/infer/src") {
        let constant = |l: &&str| l.contains("const ") && l.contains("SD") && !l.contains("const M");
        let own = |l: &&str| l.split_once('=').is_some_and(|(_, v)| !v.contains("sd::") && !v.contains("MM"));
        if !path.ends_with("standard_deviations.rs") {
            found.extend(source.lines().filter(constant).filter(own).map(|l| format!("{path}: {l}")));
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_fit_of_a_continuum_names_one_number_of_draws() {
    let folder = tempfile::tempdir().unwrap();
    let printed = run(folder.path(), "--vowel a --body continuum --h 14").out;
    assert_eq!(
        (printed.matches("--posterior 2000").count(), printed.matches("--posterior").count()),
        (1, 1),
        "{printed}"
    );
}

/// The posterior was asked for and is reported, so the fit, which ends on its bound, does not lead to status 3.
#[test]
fn data_beside_the_lengths_are_taken_or_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("emg.csv"), "muscle,I,U\nGGp,0.9,0.3\nHG,0.2,0.1\nSGm,1,\n").unwrap();
    // The contour of the baseline is that of the body at rest, 2 mm away. The coil lies on it.
    let body = tongue_fit::body::Body::tongue(10e-3).unwrap();
    let surface = tongue_fit::track::TongueSurface::of(&body).unwrap();
    let point = |at: f64| -> tongue_fit::geometry::Point {
        surface.curve.weights(at).iter().map(|(n, w)| body.mesh.nodes[*n] * *w).sum()
    };
    let row =
        |name: &str, at: tongue_fit::geometry::Point| format!("{name},{},{}\n", 1e3 * at.x + 2.0, 1e3 * at.y);
    let write = |name: &str, rows: &str| {
        std::fs::write(folder.path().join(name), format!("point,x_mm,y_mm\n{rows}")).unwrap();
    };
    let rows = (1..=12).map(|i| row(&i.to_string(), point(0.02 + 5e-3 * f64::from(i))));
    write("rest.csv", &rows.collect::<String>());
    write(
        "coils.csv",
        &(row("TT", point(surface.tip - 0.01)) + &row("TD", point(surface.tip - 0.04)) + "rim,0,0\n"),
    );
    write("far.csv", "1,20,160\n2,30,162\n3,40,164\n");
    write("two.csv", "1,20,60\n2,30,62\n");
    let in_metres = (2..=7).map(|i| format!("{i},0.0{i},0.06\n"));
    write("metres.csv", &in_metres.collect::<String>());
    let mixed = [20, 50, 30, 60, 25, 55].iter().enumerate().map(|(i, x)| format!("{i},{x},60\n"));
    write("mixed.csv", &mixed.collect::<String>());
    let line = "--points ɯ=coils.csv --vowel i --h 10 --posterior 1000 --contour ɯ=rest.csv --contour rest.csv --emg emg.csv --json --out out";
    let output = run(folder.path(), line);
    assert!(output.err.contains("rim left out: not a usual name of a coil"), "{}", output.err);
    assert!(output.status == Some(0) && output.record()["posterior"]["status"] == "mixed", "{}", output.err);

    std::fs::write(folder.path().join("one.csv"), "muscle,a\nGGa,0.9\n").unwrap();
    std::fs::write(folder.path().join("silent.csv"), "muscle,a,ɯ\nGGa,0,0\nHG,0.9,0.3\n").unwrap();
    std::fs::write(folder.path().join("small.csv"), "muscle,a (%),ɯ (%)\nGGa,0.9,0.3\n").unwrap();
    for (emg, told) in [
        ("silent.csv", "GGa left out: no activity in any vowel"),
        ("small.csv", "the largest activity is 0.009, where that of each muscle is about 1"),
    ] {
        // A contour that is refused ends the run before the posterior.
        let message =
            refused(folder.path(), &format!("--vowel a --posterior 600 --emg {emg} --contour two.csv"));
        assert!(message.contains(told), "{emg}: {message}");
    }
    for (options, reason) in [
        ("--emg one.csv", "no muscle has activity in both /a/ and /ɯ/"),
        ("--emg none.csv", "cannot read --emg \"none.csv\""),
        ("--contour two.csv", "it has 2 points; three are needed"),
        ("--contour i=rest.csv", "/i/ is not sampled; sampled are /a/ and the baseline /ɯ/"),
        ("--contour rest.csv --contour a=rest.csv", "there is another file of the same posture"),
        ("--points two.csv", "a contour is read with --contour"),
        ("--contour coils.csv", "TD is the name of a coil; coils are read with --points"),
        ("--contour metres.csv", "mm, where 10 to 200 are possible"),
        ("--contour mixed.csv", "not in their order along the tongue"),
        ("--contour far.csv", "mm from the surface of the body at rest"),
        ("--points missing=1.csv", "there is no file of this name, and /missing/ is not sampled"),
    ] {
        let message = refused(folder.path(), &format!("--vowel a --posterior 600 {options}"));
        assert!(message.contains(reason), "{options}: {message}");
    }
}
