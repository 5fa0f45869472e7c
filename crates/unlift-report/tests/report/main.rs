//! Tests of `audit.json`, the page, the files of gates, and the page in a browser.

mod browser;
mod document;
mod page;
mod parts;
mod sample;
