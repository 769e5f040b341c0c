/// Tensions of all muscles of the mesh over time, N (2D: per metre of thickness): linear between given times, constant before the first
/// and after the last.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensions {
    /// At least one time, in ascending order, s.
    pub times: Vec<f64>,
    /// Tension of each muscle at each time, N.
    pub values: Vec<Vec<f64>>,
}

impl Tensions {
    /// Tensions that are constant from time zero.
    pub fn constant(to: Vec<f64>) -> Self {
        Self { times: vec![0.0], values: vec![to] }
    }

    /// Tensions that grow linearly from zero to `to` in the time `duration`, s, and then are constant; zero makes it a step.
    pub fn ramp(to: Vec<f64>, duration: f64) -> Self {
        Self { times: vec![0.0, duration], values: vec![vec![0.0; to.len()], to] }
    }

    pub fn muscle_count(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// Writes the tension of every muscle at `time`, N.
    pub fn write_at(&self, time: f64, out: &mut [f64]) {
        let Self { times, values } = self;
        let next = times.partition_point(|&t| t <= time);
        let (Some(a), Some(b)) = (values.get(next.max(1) - 1), values.get(next).or(values.last())) else {
            return out.fill(0.0);
        };
        let part = match (next.checked_sub(1).and_then(|i| times.get(i)), times.get(next)) {
            (Some(from), Some(to)) => (time - from) / (to - from),
            _ => 0.0,
        };
        out.iter_mut().zip(a.iter().zip(b)).for_each(|(o, (a, b))| *o = a + part * (b - a));
    }

    /// The tensions, N, whose sum is largest.
    pub fn strongest(&self) -> &[f64] {
        let strongest =
            self.values.iter().max_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum::<f64>()));
        strongest.map_or(&[], Vec::as_slice)
    }

    /// The first time after `time` at which a tension changes its slope, s, across which a method of high order must not step; infinite
    /// without one.
    pub fn next_kink(&self, time: f64) -> f64 {
        self.times.get(self.times.partition_point(|&t| t <= time)).copied().unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_between_its_times_and_constant_outside() {
        let table = Tensions { times: vec![1.0, 2.0, 4.0], values: vec![vec![0.0], vec![10.0], vec![6.0]] };
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
        let ramp = Tensions::ramp(vec![8.0], 0.5);
        ramp.write_at(0.125, &mut out);
        assert_eq!(out, [2.0]);
        ramp.write_at(0.5, &mut out);
        assert_eq!(out, [8.0]);
        Tensions::ramp(vec![8.0], 0.0).write_at(0.0, &mut out);
        assert_eq!(out, [8.0]);
    }
}
