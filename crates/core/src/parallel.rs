//! Work on many items, with the feature `parallel` on the threads of rayon's pool. Results and their order do not depend on it.

#[cfg(feature = "parallel")]
use rayon::prelude::*;

/// Calls `work` with every item; returns the results in the order of the items.
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    return items.par_iter().map(&work).collect();
    #[cfg(not(feature = "parallel"))]
    return items.iter().map(work).collect();
}

/// [`map`] for work that changes the items and gets the number of each.
pub(crate) fn map_mut<T: Send, R: Send>(items: &mut [T], work: impl Fn(usize, &mut T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    return items.par_iter_mut().enumerate().map(|(number, item)| work(number, item)).collect();
    #[cfg(not(feature = "parallel"))]
    return items.iter_mut().enumerate().map(|(number, item)| work(number, item)).collect();
}

/// Runs `work` with this number of threads for [`map`]; without the feature `parallel` there is one.
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
