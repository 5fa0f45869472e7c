//! Parallel work on many photos, in order and in constant memory.

use rayon::prelude::*;

/// Items per thread that are processed before results are passed on.
const PER_THREAD: usize = 8;

/// Calls `work` on all items in parallel, and `sink` on the results, one at a time and in order.
///
/// At most 8 items per thread are in memory at once. Runs on rayon's current pool. Ends with the
/// first error of `sink`.
///
/// # Errors
/// Those of `sink`.
///
/// ```
/// use unlift_vision::features::batch::in_order;
///
/// let mut squares = Vec::new();
/// in_order(&[1, 2, 3], |n| n * n, |at, square| {
///     squares.push((at, square));
///     Ok::<(), std::convert::Infallible>(())
/// })?;
/// assert_eq!(squares, [(0, 1), (1, 4), (2, 9)]);
/// # Ok::<(), std::convert::Infallible>(())
/// ```
pub fn in_order<T: Sync, R: Send, E>(
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut sink: impl FnMut(usize, R) -> Result<(), E>,
) -> Result<(), E> {
    let size = PER_THREAD * rayon::current_num_threads();
    for (chunk, items) in items.chunks(size).enumerate() {
        // One item per job, because photos differ in cost.
        let results: Vec<R> = items.par_iter().with_max_len(1).map(&work).collect();
        for (at, result) in results.into_iter().enumerate() {
            sink(chunk * size + at, result)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_and_a_failing_sink_ends_it() {
        let items: Vec<usize> = (0..1000).collect();
        let mut seen = Vec::new();
        let result = in_order(
            &items,
            |item| item * 2,
            |at, value| {
                assert_eq!(value, 2 * at);
                seen.push(at);
                if at == 500 { Err("full") } else { Ok(()) }
            },
        );
        assert_eq!(result, Err("full"));
        assert_eq!(seen, items[..501]);
    }
}
