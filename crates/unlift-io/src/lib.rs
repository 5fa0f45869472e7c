//! unlift: io.
