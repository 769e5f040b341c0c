//! Options that say how strongly each muscle contracts: tensions, or measured activity.

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow, bail, ensure};
use tongue_fit::body::Body;
use tongue_fit::measured::{Activity, Vowel};
use tongue_fit::simulation::read_tensions;

use super::inputs;

#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
pub struct Arguments {
    /// Tension of a muscle, N per metre of thickness; may be given several times
    #[arg(long, value_name = "MUSCLE=N")]
    tension: Vec<String>,
    /// Relative muscle activity of a vowel, 0 to 1: a table with a column muscle, a column for each vowel and, if known, full_n_per_m, the
    /// tension of a muscle at activity 1; --tension gives the muscles that the table lacks
    #[arg(long, value_name = "FILE", requires = "vowel", hide_short_help = true)]
    emg: Option<PathBuf>,
    /// Vowel of --emg
    #[arg(long, value_name = "V", requires = "emg", hide_short_help = true)]
    vowel: Option<String>,
    /// Tension at activity 1 of muscles without a tension of their own in --emg, N per metre of thickness
    #[arg(long, value_name = "N", requires = "emg", hide_short_help = true)]
    full: Option<f64>,
}

impl Arguments {
    /// Indices of the body's muscles with their tensions, N per metre of thickness.
    pub fn tensions<const D: usize>(&self, body: &Body<D>) -> Result<Vec<(usize, f64)>> {
        let given = read_tensions(&self.tension, body).map_err(|error| anyhow!("--tension {error}"))?;
        let (Some(file), Some(vowel)) = (&self.emg, &self.vowel) else { return Ok(given) };
        if let Some(full) = self.full.filter(|full| !(full.is_finite() && *full >= 0.0)) {
            bail!("--full {full}: write a tension in N per metre that is not negative, like 30");
        }
        let vowel = Vowel::new(vowel).context("--vowel")?;
        let origin = file.display().to_string();
        let bytes = inputs::bytes("--emg", file)?;
        let activity = Activity::read(&bytes, &origin)?;
        let names = body.mesh.muscle_names();
        let mut tensions = activity.tensions(&vowel, self.full, &names)?;
        if let Some((twice, _)) = given.iter().find(|(m, _)| has(&tensions, *m)) {
            bail!("{origin} and --tension both give {}; give it once", names[*twice]);
        }
        tensions.extend(given);
        let missing: Vec<&str> =
            (0..names.len()).filter(|m| !has(&tensions, *m)).map(|m| names[m].as_str()).collect();
        ensure!(
            missing.is_empty(),
            "{origin} has no activity in /{vowel}/ of {}: a muscle that was not measured may have been active; write 0 where a muscle was \
                  silent, or give its tension: --tension {}=0",
            missing.join(", "),
            missing[0]
        );
        Ok(tensions)
    }
}

fn has(all: &[(usize, f64)], muscle: usize) -> bool {
    all.iter().any(|(m, _)| *m == muscle)
}

/// Names of muscles and numbers from texts such as `GGP=0.1`; `like` is the example in the message about a wrong one.
pub fn pairs(option: &str, words: &[String], like: &str) -> Result<Vec<(String, f64)>> {
    let pairs = words.iter().map(|word| {
        let pair = word.split_once('=');
        let pair = pair.and_then(|(name, value)| Some((name.trim().to_owned(), value.trim().parse().ok()?)));
        pair.with_context(|| format!("{option} {word}: write a muscle and a number, like {like}"))
    });
    pairs.collect()
}
