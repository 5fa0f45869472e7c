//! Screenshots of the page: every section is visible, in light and dark mode. If `UNLIFT_SCREENSHOTS` names a folder,
//! screenshots of more pages and of narrow screens are written to it.

use std::path::PathBuf;

use serde_json::json;

use super::chromium::Browser;
use super::{browser, page_with_points, sample};

const SECTIONS: [&str; 6] = ["verdict", "next", "scene", "curves", "distribution", "numbers"];

/// Returns screenshots of an open page with their scroll positions: as it opens, then at each section.
fn pictures(browser: &mut Browser, (width, colors): (u32, &str)) -> Vec<(Vec<u8>, i64)> {
    let mut pictures = vec![(browser.screenshot(), -1)];
    for section in SECTIONS {
        browser.emulate(width, 1400, colors);
        let place = format!("document.getElementById('{section}')");
        browser.evaluate(&format!("{place}.scrollIntoView({{behavior: 'instant'}})"));
        std::thread::sleep(std::time::Duration::from_millis(300));
        let seen = format!(
            "(r => r.top < innerHeight && r.bottom > 0 && r.width > 0)({place}.getBoundingClientRect())"
        );
        assert_eq!(browser.evaluate(&seen), json!(true), "{section} at {width} px");
        let down = browser.evaluate("Math.round(scrollY)").as_i64().expect("pixels");
        pictures.push((browser.screenshot(), down));
    }
    pictures
}

fn size(picture: &[u8]) -> [u32; 2] {
    assert!(picture.starts_with(b"\x89PNG"));
    [16, 20].map(|at| u32::from_be_bytes(picture[at..at + 4].try_into().expect("four bytes")))
}

#[test]
fn every_section_is_seen_in_light_and_dark() {
    let Some(mut browser) = browser() else { return };
    let asked = std::env::var_os("UNLIFT_SCREENSHOTS").map(PathBuf::from);
    let mixed = |metric| page_with_points(&sample::mixed(metric), 4_000);
    let mut pages = vec![("metric", page_with_points(&sample::document(true), 4_000))];
    let mut screens = vec![(1280, "light"), (1280, "dark")];
    if asked.is_some() {
        pages.extend([("mixed", mixed(true)), ("mixed-no-scale", mixed(false))]);
        screens.extend([(390, "light"), (390, "dark")]);
    }
    for (name, page) in pages {
        let mut all: Vec<Vec<u8>> = Vec::new();
        let mut n_places = 0;
        for screen in screens.iter().copied() {
            browser.open(&page, screen.0);
            browser.emulate(screen.0, 1000, screen.1);
            let pictures = pictures(&mut browser, screen);
            for (at, (picture, down)) in pictures.iter().enumerate() {
                let kind = at.checked_sub(1).map_or("fold", |section| SECTIONS[section]);
                assert_eq!(size(picture), [screen.0, if at == 0 { 1000 } else { 1400 }]);
                // Equal screenshots mean that nothing is drawn or that dark mode looks like light mode. Only the last
                // sections may share the end of the page.
                if pictures[..at].iter().all(|(_, other)| other != down) {
                    assert!(!all.contains(picture), "{name}, {kind}, {screen:?}: seen before");
                    all.push(picture.clone());
                    n_places += 1;
                }
                if let Some(folder) = &asked {
                    let shot = format!("{name}-{}-{}-{kind}.png", screen.0, screen.1);
                    std::fs::write(folder.join(shot), picture).expect("a folder that takes files");
                }
            }
        }
        assert!(n_places >= 5 * screens.len(), "{name}: {n_places} places of the page");
        assert_eq!(browser.complaints, Vec::<String>::new());
    }
}
