//! Tests of `audit.json`, the page and the files of gates, without a browser.

#[path = "../sample/mod.rs"]
mod sample;

mod cost;
mod document;
mod gate_files;
mod inversions;
mod page;
mod schema;
