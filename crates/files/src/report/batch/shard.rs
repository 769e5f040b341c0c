//! Shards: parts of a batch that run separately, each as one task of a cluster's engine.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// One of several parts of a batch: every `of`th job, so that all parts take about equally long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    pub number: usize,
    pub of: usize,
}

const MOST: usize = 100_000;

impl Shard {
    pub fn has(self, job: usize) -> bool {
        job % self.of == self.number - 1
    }

    pub fn journal(self) -> String {
        format!("batch-{}-of-{}.journal", self.number, self.of)
    }

    pub fn of_journal(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?.strip_prefix("batch-")?.strip_suffix(".journal")?;
        let (number, of) = name.split_once("-of-")?;
        let shard: Self = format!("{number}/{of}").parse().ok()?;
        (shard.journal() == path.file_name()?.to_str()?).then_some(shard)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let parsed = word.split_once('/').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match parsed {
            Some((number, of)) if number >= 1 && number <= of && of <= MOST => Ok(Self { number, of }),
            _ => Err(format!(
                "a shard is its number and how many there are, such as 3/16: from 1/1 to {MOST}/{MOST}"
            )),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_job_is_in_one_shard_and_its_journal_tells_which() {
        for of in 1..8 {
            let shards: Vec<Shard> = (1..=of).map(|number| Shard { number, of }).collect();
            for job in 0..30 {
                assert_eq!(shards.iter().filter(|s| s.has(job)).count(), 1);
            }
            for shard in shards {
                assert_eq!(shard.to_string().parse(), Ok(shard));
                assert_eq!(Shard::of_journal(Path::new("a").join(shard.journal()).as_path()), Some(shard));
            }
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3", "1/3/5", "", "1/1000000"] {
            assert!(word.parse::<Shard>().is_err(), "{word}");
        }
        for name in ["batch.journal", "batch-1-of-3.json", "batch-01-of-3.journal", "batch-4-of-3.journal"] {
            assert_eq!(Shard::of_journal(Path::new(name)), None, "{name}");
        }
    }
}
