//! The command line of unlift.

fn main() {}
