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

use std::path::PathBuf;

use chromium::Browser;
use unlift_report::{RenderOptions, render};

/// A file that is removed when the test is over.
struct PageFile(PathBuf);

impl PageFile {
    fn new(name: &str, page: &str) -> Self {
        let name = format!("unlift-report-{}-{name}.html", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, page).expect("the temporary folder takes a file");
        Self(path)
    }
}

impl Drop for PageFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn browser() -> Option<Browser> {
    let found = chromium::find();
    if found.is_none() {
        println!("skipped: no chromium on the PATH; CHROMIUM names one");
    }
    found.map(|program| Browser::start(&program))
}

fn private_page(metric: bool) -> String {
    let document = sample::document(metric);
    let scene = sample::scene(&document, 4_000);
    render(&document, Some(&scene), &RenderOptions::default()).expect("a page")
}
