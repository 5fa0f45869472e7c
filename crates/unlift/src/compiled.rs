//! Functions of two and of three dimensions, compiled here once.
//!
//! A function that is generic over the number of dimensions is compiled anew in every crate that calls it: programs and
//! tests that recover would each compile recovery.

use std::any::Any;

/// That of `two` and `three` which is of type `F`, as only one can be.
///
/// A constant cannot choose between two types; `Any` asks whether they are the same.
pub(crate) fn which<F: Any + Copy>(two: &dyn Any, three: &dyn Any) -> Option<F> {
    two.downcast_ref::<F>().or_else(|| three.downcast_ref::<F>()).copied()
}

/// The error of a number of dimensions that nobody compiled.
pub(crate) fn no_such<const D: usize>() -> crate::Error {
    crate::Error::new("dimensions", "2 or 3", D.to_string())
}
