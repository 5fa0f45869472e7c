//! Nothing overlaps, is cut or scrolls sideways, on a laptop or on a phone.

use serde_json::json;
use unlift_report::document::{Document, Spread};
use unlift_report::{RenderOptions, render};

use super::{PageFile, browser, sample};

#[test]
fn tables_fit_a_laptop_and_say_on_a_phone_that_there_is_more() {
    let Some(mut browser) = browser() else { return };
    let pages = [sample::mixed(true), sample::mixed(false), sample::images()]
        .map(|document| render(&document, None, &RenderOptions::default()).expect("a page"));
    for page in pages {
        let file = PageFile::new("tables", &page);
        browser.emulate(1280, 900, "light");
        browser.open(&file.0);
        browser.unfold();
        let cut = "[...document.querySelectorAll('.wide')].filter(s => s.wideWidth > s.clientWidth)
            .map(s => `${s.ariaLabel}: ${s.wideWidth} > ${s.clientWidth}`)";
        assert_eq!(browser.evaluate(cut), json!([]));
        browser.emulate(390, 844, "light");
        browser.open(&file.0);
        browser.unfold();
        let silent = "[...document.querySelectorAll('.wide')].filter(s => s.wideWidth > s.clientWidth
            && !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0)).length";
        assert_eq!(browser.evaluate(silent), json!(0));
        let wider = "document.documentElement.wideWidth > document.documentElement.clientWidth";
        assert_eq!(browser.evaluate(wider), json!(false));
    }
}

/// Many schemes with long names, sources, noise models, solvers, thresholds and seeds.
fn crowded() -> Document {
    let mut document = sample::mixed(true);
    let rows = std::mem::take(&mut document.results);
    for (at, scheme) in ["olc", "ppl+", "ray-voxel", "a-scheme-of-mine", "another-scheme-of-mine"]
        .iter()
        .enumerate()
    {
        for row in rows.iter().filter(|row| row.scheme == sample::SCHEMES[at]) {
            for noise in ["uniform", "near", "clustered"] {
                let mut row = row.clone();
                row.scheme = (*scheme).into();
                match row.neighbors.as_str() {
                    "oracle" => row.oracle_noise = Some(noise.into()),
                    _ if noise == "uniform" => {}
                    own => {
                        row.neighbors = format!(
                            "{own}+{}",
                            if noise == "near" { "similarity" } else { "geometric+similarity" }
                        )
                    }
                }
                for (typed, value) in [("0.50", 98.8), ("1.00", 99.9)] {
                    row.recovered_percent.insert(typed.into(), value);
                    row.blind_percent.insert(typed.into(), 33.3);
                    row.records_alone_percent.as_mut().map(|map| map.insert(typed.into(), 66.6));
                    row.records_alone_by
                        .as_mut()
                        .map(|map| map.insert(typed.into(), "geometric, joint".into()));
                }
                row.repeats = 3;
                row.std = Some(Spread {
                    recovered_percent: row
                        .recovered_percent
                        .keys()
                        .map(|t| (t.clone(), 10.5))
                        .collect(),
                    ..Spread::default()
                });
                document.results.push(row);
            }
        }
    }
    document.not_audited.clear();
    document
}

#[test]
fn a_crowded_page_keeps_its_shape() {
    let Some(mut browser) = browser() else { return };
    let page = render(&crowded(), None, &RenderOptions::default()).expect("a page");
    let file = PageFile::new("crowded", &page);
    for width in [1280, 390] {
        browser.emulate(width, 900, "light");
        browser.open(&file.0);
        browser.unfold();
        let silent = "[...document.querySelectorAll('.wide')].filter(s => s.wideWidth > s.clientWidth
            && !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0)).length";
        assert_eq!(browser.evaluate(silent), json!(0), "{width} px");
        assert_eq!(browser.evaluate(OVERLAPS), json!([]), "{width} px");
        let beyond = "[...document.querySelectorAll('main *')]
            .filter(n => !n.closest('.wide') && n.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
            .map(n => `${n.tagName}.${n.className?.baseVal ?? n.className}: ${n.textContent.slice(0, 60)}`)";
        assert_eq!(browser.evaluate(beyond), json!([]), "{width} px");
        let wider = "document.documentElement.wideWidth > document.documentElement.clientWidth";
        assert_eq!(browser.evaluate(wider), json!(false), "{width} px");
        assert_eq!(browser.complaints, Vec::<String>::new());
    }
}

/// Labels of charts that meet or are cut.
const OVERLAPS: &str = "[...document.querySelectorAll('.chart svg')].flatMap(svg => {
    const frame = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll('text')].filter(t => t.textContent.trim());
    const boxes = texts.map(t => [t.textContent, t.getBoundingClientRect()]);
    const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
    const met = boxes.flatMap(([t, a], i) => boxes.slice(i + 1)
        .filter(([, b]) => !apart(a, b)).map(([u]) => `${svg.closest('.chart').ariaLabel}: ${t} over ${u}`));
    const out = boxes.filter(([, a]) => a.left < frame.left - 1 || a.right > frame.right + 1 || a.top < frame.top - 1)
        .map(([t]) => `${svg.closest('.chart').ariaLabel}: ${t} is cut`);
    return [...met, ...out];
})";

#[test]
fn labels_of_charts_do_not_overlap() {
    let Some(mut browser) = browser() else { return };
    for document in [sample::mixed(true), sample::mixed(false), sample::images()] {
        let page = render(&document, None, &RenderOptions::default()).expect("a page");
        let file = PageFile::new("labels", &page);
        for width in [1280, 390] {
            browser.emulate(width, 900, "light");
            browser.open(&file.0);
            browser.unfold();
            assert_eq!(browser.evaluate(OVERLAPS), json!([]), "{width} px");
        }
    }
}
