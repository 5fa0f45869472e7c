//! The page in a real browser: no errors, no network, and everything is there.
//!
//! Skipped with a message where no Chromium is installed; `CHROMIUM` names one. With
//! `UNLIFT_SCREENSHOTS=DIR` pictures are written there, to be looked at.

mod choices;
mod chromium;
mod content;
#[path = "../sample/mod.rs"]
mod sample;
mod screenshots;
mod shape;

use chromium::Browser;
use unlift_report::document::Document;
use unlift_report::{RenderOptions, render};

fn browser() -> Option<Browser> {
    let found = chromium::find();
    if found.is_none() {
        println!("skipped: no chromium on the PATH; CHROMIUM names one");
    }
    found.map(|program| Browser::start(&program))
}

/// The page of figures alone.
fn page(document: &Document) -> String {
    render(document, None, &RenderOptions::default()).expect("a page")
}

/// The page with so many points.
fn page_with_points(document: &Document, n: usize) -> String {
    let scene = sample::scene(document, n);
    render(document, Some(&scene), &RenderOptions::default()).expect("a page")
}
