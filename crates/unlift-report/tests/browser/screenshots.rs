//! Pictures of the page, to be looked at; taken only where `UNLIFT_SCREENSHOTS` names a folder.

use std::path::PathBuf;

use unlift_report::{RenderOptions, render};

use super::{PageFile, browser, private_page, sample};

#[test]
fn pictures_are_taken_when_asked_for() {
    let Some(folder) = std::env::var_os("UNLIFT_SCREENSHOTS") else {
        return;
    };
    let Some(mut browser) = browser() else { return };
    let folder = PathBuf::from(folder);
    let mixed = |metric| {
        let document = sample::mixed(metric);
        let scene = sample::scene(&document, 4_000);
        render(&document, Some(&scene), &RenderOptions::default()).expect("a page")
    };
    let pages =
        [("metric", private_page(true)), ("mixed", mixed(true)), ("mixed-no-scale", mixed(false))];
    for (name, page) in pages {
        let file = PageFile::new(name, &page);
        for (width, color_scheme) in
            [(1280, "light"), (1280, "dark"), (390, "light"), (390, "dark")]
        {
            browser.emulate(width, 1000, color_scheme);
            browser.open(&file.0);
            let shot =
                |kind: &str| folder.join(format!("{name}-{width}-{color_scheme}-{kind}.png"));
            std::fs::write(shot("fold"), browser.screenshot()).expect("a picture");
            for section in ["curves", "distribution", "scene", "numbers", "losses", "reading"] {
                browser.emulate(width, 1400, color_scheme);
                browser.evaluate(&format!(
                    "document.getElementById('{section}').scrollIntoView({{behavior: 'instant'}})"
                ));
                std::thread::sleep(std::time::Duration::from_millis(300));
                std::fs::write(shot(section), browser.screenshot()).expect("a picture");
            }
        }
    }
}
