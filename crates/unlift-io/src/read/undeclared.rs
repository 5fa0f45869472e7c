//! Files that hold more points than they say.

/// What to say of a file with room for so many `more` points behind the `n` that it declares.
pub(in crate::read) fn undeclared(n: u64, more: u64) -> Option<String> {
    (more > 0).then(|| {
        format!("{n} points are declared, and {more} more seem to follow, which are not read: a part of the map at most")
    })
}
