//! Tests of the program: exit codes, one-line errors, complete outputs, identical bytes.

mod again;
mod audit_map;
mod common;
mod compare;
mod corpus;
mod export;
mod features;
mod gates;
mod help;
mod images;
mod invert;
mod outputs;
#[cfg(unix)]
mod readme;
mod sequence;
mod stages;
#[cfg(unix)]
mod streams;
mod supply;
mod table;
