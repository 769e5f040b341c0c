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
