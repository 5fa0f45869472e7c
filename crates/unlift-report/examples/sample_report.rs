//! Renders a synthetic audit of a synthetic room, for a look at the page during work on it.
//!
//! ```text
//! cargo run -p unlift-report --example sample_report -- report.html [--mixed] [--no-scale] [--share-safe]
//! ```
//!
//! No figure of it was measured.

#[path = "../tests/sample/mod.rs"]
mod sample;

use unlift_report::{RenderOptions, render, text_table};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let path = arguments.iter().find(|argument| !argument.starts_with("--"));
    let make = if has("--mixed") { sample::mixed } else { sample::document };
    let document = make(!has("--no-scale"));
    let scene = sample::scene(&document, 12_000);
    let options = RenderOptions { share_safe: has("--share-safe"), ..RenderOptions::default() };
    let page = render(&document, Some(&scene), &options)?;
    print!("{}", text_table(&document));
    std::fs::write(path.map_or("sample-report.html", |path| path.as_str()), page)?;
    Ok(())
}
