//! Work on many items at once: on the threads of rayon's pool where the feature `parallel` is on, one after
//! the other where it is not. The results and their order are the same.

#[cfg(feature = "parallel")]
use rayon::prelude::*;

/// Calls `work` with every item; returns its results in the order of the items.
pub fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    return items.par_iter().map(&work).collect();
    #[cfg(not(feature = "parallel"))]
    return items.iter().map(work).collect();
}

/// As [`map`], for work that changes the items. It gets the number of each item too.
pub(crate) fn map_mut<T: Send, R: Send>(items: &mut [T], work: impl Fn(usize, &mut T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    return items.par_iter_mut().enumerate().map(|(number, item)| work(number, item)).collect();
    #[cfg(not(feature = "parallel"))]
    return items.iter_mut().enumerate().map(|(number, item)| work(number, item)).collect();
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
