//! Functions for two and three dimensions that are compiled once, in this crate.
//!
//! A generic function is compiled again in every crate that calls it. A pointer to its versions in a `static` avoids that:
//! [`both!`](crate::both).

use std::any::Any;

use crate::Error;

/// Declares a [`Both`] of the two versions of a function: a `static`, which compiles them in this crate; in unit tests a constant.
#[macro_export]
macro_rules! both {
    ($name:ident: $type:ident = $function:ident) => {
        #[cfg(not(test))]
        static $name: $crate::compiled::Both<$type<2>, $type<3>> =
            $crate::compiled::Both($function::<2>, $function::<3>);
        #[cfg(test)]
        const $name: $crate::compiled::Both<$type<2>, $type<3>> =
            $crate::compiled::Both($function::<2>, $function::<3>);
    };
}

/// A function for two dimensions, and the one for three.
pub struct Both<A, B>(pub A, pub B);

impl<A: Any, B: Any> Both<A, B> {
    /// Returns the function that has type `F`; only one can.
    ///
    /// # Errors
    /// When `F` is for another number of dimensions.
    pub fn of<F: Any + Copy>(&self) -> Result<F, Error> {
        // A constant cannot select one of two types, so `Any` compares them.
        let (two, three): (&dyn Any, &dyn Any) = (&self.0, &self.1);
        let found = two.downcast_ref().or_else(|| three.downcast_ref()).copied();
        found.ok_or_else(|| Error::new("dimensions", "2 or 3", "another number"))
    }
}
