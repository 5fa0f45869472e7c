//! Tests that nothing overlaps, is cut or scrolls horizontally, on a laptop and on a phone.

use serde_json::json;
use unlift_report::document::{Document, Spread};

use super::{browser, page, sample};

/// Tables that are cut, and the number of those that show this neither by a shade nor by the
/// keyboard.
const CUT: &str =
    "[...document.querySelectorAll('.wide')].filter(s => s.scrollWidth > s.clientWidth)
    .map(s => `${s.ariaLabel}: ${s.scrollWidth} > ${s.clientWidth}`)";
const SILENT: &str =
    "[...document.querySelectorAll('.wide')].filter(s => s.scrollWidth > s.clientWidth
    && !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0)).length";

/// Returns an audit of many schemes with long names, sources, noise models, solvers, thresholds and
/// seeds.
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
                    if let (Some(alone), Some(by)) =
                        (&mut row.records_alone_percent, &mut row.records_alone_by)
                    {
                        alone.insert(typed.into(), 66.6);
                        by.insert(typed.into(), "geometric, joint".into());
                    }
                }
                row.repeats = 3;
                let spread = row.recovered_percent.keys().map(|typed| (typed.clone(), 10.5));
                let recovered_percent = spread.collect();
                row.std = Some(Spread { recovered_percent, ..Spread::default() });
                document.results.push(row);
            }
        }
    }
    document.not_audited.clear();
    document
}

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

const BEYOND: &str = "[...document.querySelectorAll('main *')]
    .filter(n => !n.closest('.wide') && n.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
    .map(n => `${n.tagName}.${n.className?.baseVal ?? n.className}: ${n.textContent.slice(0, 60)}`)";

#[test]
fn pages_keep_their_shape_on_a_laptop_and_on_a_phone() {
    let Some(mut browser) = browser() else { return };
    for (name, document) in [
        ("mixed", sample::mixed(true)),
        ("no scale", sample::mixed(false)),
        ("images", sample::images()),
        ("crowded", crowded()),
    ] {
        let page = page(&document);
        for width in [1280, 390] {
            browser.open(&page, width);
            browser.unfold();
            if width == 1280 && name != "crowded" {
                assert_eq!(browser.evaluate(CUT), json!([]), "{name}");
            }
            assert_eq!(browser.evaluate(SILENT), json!(0), "{name}, {width} px");
            assert_eq!(browser.evaluate(OVERLAPS), json!([]), "{name}, {width} px");
            assert_eq!(browser.evaluate(BEYOND), json!([]), "{name}, {width} px");
            browser.is_fine();
        }
    }
}
