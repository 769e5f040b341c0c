/// Tensions of all muscles of the mesh over time, N (2D: per metre of thickness).
#[derive(Debug, Clone, PartialEq)]
pub enum Tensions {
    /// Constant from time zero.
    Constant(Vec<f64>),
    /// Growing linearly from zero, then constant.
    Ramp {
        /// Tension of each muscle after the ramp, N.
        to: Vec<f64>,
        /// Duration of the growth, s; zero makes it a step.
        duration: f64,
    },
    /// Linear between given times, constant before the first and after the last.
    Table {
        /// At least one time, in ascending order, s.
        times: Vec<f64>,
        /// Tension of each muscle at each time, N.
        values: Vec<Vec<f64>>,
    },
}

impl Tensions {
    pub fn muscle_count(&self) -> usize {
        match self {
            Self::Constant(to) | Self::Ramp { to, .. } => to.len(),
            Self::Table { values, .. } => values.first().map_or(0, Vec::len),
        }
    }

    /// Writes the tension of every muscle at `time`, N.
    pub fn write_at(&self, time: f64, out: &mut [f64]) {
        match self {
            Self::Constant(to) => out.copy_from_slice(to),
            Self::Ramp { to, duration } => {
                let part = if time < *duration { (time / duration).max(0.0) } else { 1.0 };
                out.iter_mut().zip(to).for_each(|(o, t)| *o = part * t);
            }
            Self::Table { times, values } => {
                let next = times.partition_point(|&t| t <= time);
                let (Some(a), Some(b)) = (values.get(next.max(1) - 1), values.get(next).or(values.last()))
                else {
                    return out.fill(0.0);
                };
                let part = match (next.checked_sub(1).and_then(|i| times.get(i)), times.get(next)) {
                    (Some(from), Some(to)) => (time - from) / (to - from),
                    _ => 0.0,
                };
                out.iter_mut().zip(a.iter().zip(b)).for_each(|(o, (a, b))| *o = a + part * (b - a));
            }
        }
    }

    /// The tensions, N, whose sum is largest.
    pub fn strongest(&self) -> &[f64] {
        match self {
            Self::Constant(to) | Self::Ramp { to, .. } => to,
            Self::Table { values, .. } => values
                .iter()
                .max_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum::<f64>()))
                .map_or(&[], Vec::as_slice),
        }
    }

    /// The first time after `time` at which a tension changes its slope, s, across which a method of high order must not step; infinite
    /// without one.
    pub fn next_kink(&self, time: f64) -> f64 {
        match self {
            Self::Constant(_) => f64::INFINITY,
            Self::Ramp { duration, .. } if time < *duration => *duration,
            Self::Ramp { .. } => f64::INFINITY,
            Self::Table { times, .. } => {
                times.get(times.partition_point(|&t| t <= time)).copied().unwrap_or(f64::INFINITY)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_between_its_times_and_constant_outside() {
        let table =
            Tensions::Table { times: vec![1.0, 2.0, 4.0], values: vec![vec![0.0], vec![10.0], vec![6.0]] };
        let at = |t| {
            let mut out = [f64::NAN];
            table.write_at(t, &mut out);
            out[0]
        };
        assert_eq!([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(at), [0.0, 0.0, 5.0, 10.0, 8.0, 6.0, 6.0]);
        assert_eq!([0.0, 1.0, 3.9, 4.0].map(|t| table.next_kink(t)), [1.0, 2.0, 4.0, f64::INFINITY]);
    }

    #[test]
    fn a_ramp_ends_where_it_says_and_a_ramp_of_no_time_is_a_step() {
        let mut out = [0.0];
        let ramp = Tensions::Ramp { to: vec![8.0], duration: 0.5 };
        ramp.write_at(0.125, &mut out);
        assert_eq!(out, [2.0]);
        ramp.write_at(0.5, &mut out);
        assert_eq!(out, [8.0]);
        Tensions::Ramp { to: vec![8.0], duration: 0.0 }.write_at(0.0, &mut out);
        assert_eq!(out, [8.0]);
    }
}
