//! Functions of two and of three dimensions, compiled in this crate once.
//!
//! A function that is generic over the number of dimensions is compiled anew in every crate that calls it: programs and
//! tests that recover would each compile recovery. A pointer to it in a `static` is not.

use std::any::Any;

use crate::Error;

/// A function of two dimensions, and the one of three.
pub struct Both<A, B>(pub A, pub B);

impl<A: Any, B: Any> Both<A, B> {
    /// The one of the two that is of type `F`, as only one can be.
    ///
    /// # Errors
    /// When `F` is for another number of dimensions.
    pub fn of<F: Any + Copy>(&self) -> Result<F, Error> {
        // A constant cannot choose between two types; `Any` asks whether they are the same.
        let (two, three): (&dyn Any, &dyn Any) = (&self.0, &self.1);
        let found = two.downcast_ref().or_else(|| three.downcast_ref()).copied();
        found.ok_or_else(|| Error::new("dimensions", "2 or 3", "another number"))
    }
}
