//! Work on many items at once: on the threads of rayon's pool where the feature `parallel` is on, one after
//! the other where it is not. The results and their order are the same.

use std::sync::{Mutex, PoisonError};

/// Calls `work` with every item; returns its results in the order of the items.
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let places: Vec<_> = items.iter().map(|item| Mutex::new((item, None))).collect();
    each(places.len(), &|number| fill(&places[number], |item| work(item)));
    results(places)
}

/// As [`map`], for work that changes the items. It gets the number of each item too.
pub(crate) fn map_mut<T: Send, R: Send>(items: &mut [T], work: impl Fn(usize, &mut T) -> R + Sync) -> Vec<R> {
    let places: Vec<_> = items.iter_mut().map(|item| Mutex::new((item, None))).collect();
    each(places.len(), &|number| fill(&places[number], |item| work(number, item)));
    results(places)
}

/// Calls `work` with each number below `count`. It has no type parameters, so that what it calls of
/// rayon is compiled once and not for every kind of work.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().for_each(work);
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).for_each(work);
}

/// Puts the result of `work` with an item beside it. Nobody else uses the place: its lock is free.
fn fill<I, R>(place: &Mutex<(I, Option<R>)>, work: impl FnOnce(&mut I) -> R) {
    let (item, result) = &mut *place.lock().unwrap_or_else(PoisonError::into_inner);
    *result = Some(work(item));
}

fn results<I, R>(places: Vec<Mutex<(I, Option<R>)>>) -> Vec<R> {
    let places = places.into_iter().map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner));
    places.filter_map(|(_, result)| result).collect()
}

/// Runs `work` with this number of threads for [`map`]. Where the feature `parallel` is off there is one
/// thread.
///
/// # Errors
/// The message of the operating system if it cannot start the threads.
pub fn with_threads<R: Send>(count: usize, work: impl FnOnce() -> R + Send) -> Result<R, String> {
    #[cfg(feature = "parallel")]
    {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
        pool.map(|pool| pool.install(work)).map_err(|e| e.to_string())
    }
    #[cfg(not(feature = "parallel"))]
    {
        let _ = count;
        Ok(work())
    }
}
