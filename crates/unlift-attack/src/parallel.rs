//! Parallel loops. All of them run through one function that calls closures by pointer: rayon's iterators compile some hundred functions
//! anew for every loop, half of what the compiler would have to do for this crate.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// Number of parts of a loop per thread: some take longer than others.
const PARTS: usize = 64;

/// Returns `of(at)` for every `at` below `n`, in order.
pub fn map<T: Send>(n: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    map_with(n, || (), |(), at| of(at))
}

/// Returns `of(buffers, at)` for every `at` below `n`, in order. `buffers` makes what consecutive calls share; no result may depend on it.
pub fn map_with<S, T: Send>(
    n: usize,
    buffers: impl Fn() -> S + Sync,
    of: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let parts = parts(n);
    let found: Vec<Mutex<Vec<T>>> = parts.iter().map(|_| Mutex::default()).collect();
    run(parts.len(), &|part| {
        let mut buffers = buffers();
        let values = parts[part].clone().map(|at| of(&mut buffers, at)).collect();
        *lock(&found[part]) = values;
    });
    let mut all = Vec::with_capacity(n);
    for part in found {
        all.append(&mut part.into_inner().unwrap_or_else(PoisonError::into_inner));
    }
    all
}

/// Calls `of(buffers, at, value)` for every value, which it may change.
pub fn for_each_mut<S, T: Send>(
    values: &mut [T],
    buffers: impl Fn() -> S + Sync,
    of: impl Fn(&mut S, usize, &mut T) + Sync,
) {
    let parts = parts(values.len());
    let len = parts.first().map_or(1, Range::len);
    let values: Vec<Mutex<&mut [T]>> = values.chunks_mut(len).map(Mutex::new).collect();
    run(parts.len(), &|part| {
        let mut buffers = buffers();
        for (at, value) in parts[part].clone().zip(lock(&values[part]).iter_mut()) {
            of(&mut buffers, at, value);
        }
    });
}

/// Calls `of` for every number below `n`.
pub fn for_each(n: usize, of: &(dyn Fn(usize) + Sync)) {
    let parts = parts(n);
    run(parts.len(), &|part| parts[part].clone().for_each(of));
}

/// Divides `n` into parts of equal length; the last one may be shorter.
fn parts(n: usize) -> Vec<Range<usize>> {
    let len = n.div_ceil(PARTS * rayon::current_num_threads()).max(1);
    (0..n).step_by(len).map(|start| start..n.min(start + len)).collect()
}

fn run(n: usize, of: &(dyn Fn(usize) + Sync)) {
    (0..n).into_par_iter().with_max_len(1).for_each(of);
}

/// Locks a mutex. A panic of another thread ends the loop, so data behind a poisoned lock is never used.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_is_visited_once_in_order() {
        for n in [0, 1, 2, 63, 64, 65, 1000, 4097] {
            let squares: Vec<usize> = (0..n).map(|at| at * at).collect();
            assert_eq!(map(n, |at| at * at), squares);
            let mut values: Vec<usize> = (0..n).collect();
            for_each_mut(&mut values, || 0, |_, at, value| *value *= at);
            assert_eq!(values, squares);
            let sum = Mutex::new(0);
            for_each(n, &|at| *lock(&sum) += at * at);
            assert_eq!(sum.into_inner().unwrap(), squares.iter().sum::<usize>());
        }
    }
}
