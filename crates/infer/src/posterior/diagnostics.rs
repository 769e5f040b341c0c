//! Diagnostics of mixing: rank-normalised split R-hat, bulk and tail effective sample size (Vehtari, Gelman, Simpson, Carpenter and
//! Bürkner, Bayesian Analysis 16, 2021).

use super::parameters::normal_quantile;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixing {
    /// Rank-normalised split R-hat: the larger of those of the values and of their distances from the median.
    pub r_hat: f64,
    /// Effective sample size of the rank-normalised values.
    pub bulk: f64,
    /// Effective sample size of the tails: the smaller of those of the 5 % and the 95 % quantile.
    pub tail: f64,
}

/// Chains have equal lengths of at least four draws.
pub fn mixing(chains: &[Vec<f64>]) -> Mixing {
    let split = halves(chains);
    let ranked = rank_normalised(&split);
    let mut all: Vec<f64> = split.iter().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    let at = |p: f64| all[((all.len() - 1) as f64 * p).round() as usize];
    let median = at(0.5);
    let folded: Vec<Vec<f64>> =
        split.iter().map(|c| c.iter().map(|x| (x - median).abs()).collect()).collect();
    let tails = [at(0.05), at(0.95)].map(|limit| {
        let below = split.iter().map(|c| c.iter().map(|x| f64::from(u8::from(*x <= limit))).collect());
        effective(&below.collect::<Vec<Vec<f64>>>())
    });
    Mixing {
        r_hat: r_hat(&ranked).max(r_hat(&rank_normalised(&folded))),
        bulk: effective(&ranked),
        tail: tails[0].min(tails[1]),
    }
}

/// Limit of R-hat over `quantities` of `chains` with this many draws each: 1.01 (Vehtari and others 2021), or what independent draws exceed
/// in one run of a hundred. The variance of the means of half chains of `n` independent draws is `chi²/(f n)` times that within, with `f`
/// degrees of freedom (quantile of chi² by Wilson and Hilferty 1931), for each quantity and for its distances from the median.
pub fn most_r_hat(chains: usize, draws: usize, quantities: usize) -> f64 {
    let z = normal_quantile(1.0 - 0.01 / (2.0 * quantities as f64));
    let part = 2.0 / (9.0 * (2 * chains - 1) as f64);
    let ratio = (1.0 - part + z * part.sqrt()).powi(3);
    (1.0 + (ratio - 1.0) / (draws / 2) as f64).sqrt().max(1.01)
}

fn halves(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let half = chains.iter().map(Vec::len).min().unwrap_or(0) / 2;
    chains.iter().flat_map(|c| [c[..half].to_vec(), c[c.len() - half..].to_vec()]).collect()
}

/// Normal scores of the ranks among all values; equal values get the mean of their ranks.
fn rank_normalised(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let length = chains.first().map_or(0, Vec::len);
    let all: Vec<f64> = chains.iter().flatten().copied().collect();
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| all[*a].total_cmp(&all[*b]));
    let mut out = vec![0.0; all.len()];
    let mut first = 0;
    while first < order.len() {
        let ties = order[first..].iter().take_while(|&&i| all[i] == all[order[first]]).count();
        let rank = first as f64 + 0.5 * (ties as f64 + 1.0);
        let score = normal_quantile((rank - 0.375) / (all.len() as f64 + 0.25));
        order[first..first + ties].iter().for_each(|&i| out[i] = score);
        first += ties;
    }
    out.chunks(length.max(1)).map(<[f64]>::to_vec).collect()
}

/// Mean of the variances within chains, and the variance that infinitely long chains would have.
fn variances(chains: &[Vec<f64>]) -> (f64, f64) {
    let n = chains.first().map_or(0, Vec::len) as f64;
    let means: Vec<f64> = chains.iter().map(|c| c.iter().sum::<f64>() / n).collect();
    let variance = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)
    };
    let within = chains.iter().map(|c| variance(c)).sum::<f64>() / chains.len() as f64;
    let between = if means.len() > 1 { variance(&means) } else { 0.0 };
    (within, within * (n - 1.0) / n + between)
}

fn r_hat(chains: &[Vec<f64>]) -> f64 {
    let (within, whole) = variances(chains);
    // Equal values count as mixed.
    if whole <= 0.0 { 1.0 } else { (whole / within).sqrt() }
}

/// Effective sample size by Geyer's initial monotone sequence (1992).
fn effective(chains: &[Vec<f64>]) -> f64 {
    let (m, n) = (chains.len(), chains.first().map_or(0, Vec::len));
    let total = (m * n) as f64;
    let (within, whole) = variances(chains);
    if n < 4 || whole <= 0.0 {
        return total;
    }
    let centred: Vec<Vec<f64>> = chains
        .iter()
        .map(|c| {
            let mean = c.iter().sum::<f64>() / n as f64;
            c.iter().map(|x| x - mean).collect()
        })
        .collect();
    let correlation = |lag: usize| {
        let sum = |c: &Vec<f64>| c.iter().zip(&c[lag..]).map(|(a, b)| a * b).sum::<f64>() / n as f64;
        let covariance = centred.iter().map(sum).sum::<f64>() / m as f64;
        1.0 - (within - covariance) / whole
    };
    let (mut sum, mut least) = (0.0, f64::INFINITY);
    for pair in 0..(n - 1) / 2 {
        let both = if pair == 0 { 1.0 } else { correlation(2 * pair) } + correlation(2 * pair + 1);
        if both <= 0.0 {
            break;
        }
        least = both.min(least);
        sum += least;
    }
    let time = (2.0 * sum - 1.0).max(1.0 / total.log10());
    total / time
}
