//! Detects files with more points than they declare.

/// Returns a doubt if `more` points follow the `n` declared ones.
pub(crate) fn undeclared(n: u64, more: u64) -> Option<String> {
    (more > 0).then(|| {
        format!("{n} points are declared, and {more} more seem to follow, which are not read: results are about a part of the map")
    })
}
