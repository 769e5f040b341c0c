//! Permuted names of muscles.

use tongue_input::measured::Lengths;

pub fn orders(muscles: usize, count: u64, seed: u64) -> Vec<Vec<usize>> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut orders = Vec::new();
    while muscles > 2 && (orders.len() as u64) < count {
        let mut order: Vec<usize> = (0..muscles).collect();
        random.shuffle(&mut order);
        if order.iter().enumerate().any(|(i, o)| i != *o) {
            orders.push(order);
        }
    }
    orders
}

pub fn renamed(lengths: &Lengths, order: &[usize]) -> Lengths {
    Lengths {
        length_mm: order.iter().map(|&o| lengths.length_mm[o]).collect(),
        half_width_mm: order.iter().map(|&o| lengths.half_width_mm[o]).collect(),
        ..lengths.clone()
    }
}
