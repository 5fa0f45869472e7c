//! Tests of the page in a real browser.
//!
//! They are skipped with a message if no Chromium is installed; `CHROMIUM` can name one. With
//! `UNLIFT_SCREENSHOTS=DIR` they write screenshots to that folder.

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

fn page(document: &Document) -> String {
    render(document, None, &RenderOptions::default()).expect("a page")
}

fn page_with_points(document: &Document, n: usize) -> String {
    let scene = sample::scene(document, n);
    render(document, Some(&scene), &RenderOptions::default()).expect("a page")
}
