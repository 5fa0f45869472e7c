//! The page in a real browser: no errors, no network, and everything is there.
//!
//! Skipped with a message where no Chromium is installed; `CHROMIUM` names one. With
//! `UNLIFT_SCREENSHOTS=DIR` pictures are written there, to be looked at.

mod chromium;
mod sample;

use std::path::PathBuf;

use chromium::Browser;
use serde_json::{Value, json};
use unlift_report::document::{Document, Spread};
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

#[test]
fn curves_tables_and_canvas_are_there_without_errors_or_network() {
    let Some(mut browser) = browser() else { return };
    let file = PageFile::new("private", &private_page(true));
    for (width, height) in [(1280, 900), (390, 844)] {
        browser.emulate(width, height, "light");
        browser.open(&file.0);
        // One overview, one chart per scheme, one of errors; each with drawn curves.
        assert_eq!(browser.evaluate("document.documentElement.dataset.charts"), json!("10"));
        let empty = "[...document.querySelectorAll('.chart')].filter(c => c.querySelectorAll('svg path').length < 10).length";
        assert_eq!(browser.evaluate(empty), json!(0));
        assert_eq!(browser.evaluate("document.querySelectorAll('table').length >= 5"), json!(true));
        assert_eq!(browser.evaluate("document.documentElement.dataset.scene"), json!("drawn"));
        assert_eq!(
            browser.evaluate("+document.documentElement.dataset.scenePoints > 3000"),
            json!(true)
        );
        let wider = "document.documentElement.scrollWidth > document.documentElement.clientWidth";
        assert_eq!(
            browser.evaluate(wider),
            json!(false),
            "the page scrolls sideways at {width} px"
        );
        assert_eq!(browser.complaints, Vec::<String>::new());
    }
}

#[test]
fn the_canvas_shows_points_and_answers_every_choice() {
    let Some(mut browser) = browser() else { return };
    let file = PageFile::new("choices", &private_page(true));
    browser.emulate(1280, 900, "dark");
    browser.open(&file.0);
    let choose_all = "document.querySelectorAll('.controls input').forEach(input => input.click())";
    browser.evaluate(choose_all);
    browser.evaluate("document.querySelector('#scene-controls input').click()");
    browser.evaluate("document.querySelector('#stage').scrollIntoView()");
    for key in ["ArrowLeft", "ArrowUp", "+", "-"] {
        let press = format!(
            "document.getElementById('canvas').dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}))"
        );
        browser.evaluate(&press);
    }
    // The drawing buffer is gone after the frame: read it in the same turn as the drawing.
    let lit = "(() => {
        const canvas = document.getElementById('canvas');
        canvas.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}));
        const copy = document.createElement('canvas');
        copy.width = canvas.width; copy.height = canvas.height;
        const context = copy.getContext('2d');
        context.drawImage(canvas, 0, 0);
        const pixels = context.getImageData(0, 0, copy.width, copy.height).data;
        let lit = 0;
        for (let i = 0; i < pixels.length; i += 4) lit += pixels[i] + pixels[i + 1] + pixels[i + 2] > 150;
        return lit;
    })()";
    let lit = browser.evaluate(lit).as_f64().expect("a number of pixels");
    assert!(lit > 5_000.0, "{lit} pixels are lit");
    assert_eq!(browser.complaints, Vec::<String>::new());
}

#[test]
fn a_page_of_figures_only_has_curves_and_no_canvas() {
    let Some(mut browser) = browser() else { return };
    let document = sample::document(false);
    let scene = sample::scene(&document, 500);
    let options = RenderOptions { share_safe: true, ..RenderOptions::default() };
    let file =
        PageFile::new("figures", &render(&document, Some(&scene), &options).expect("a page"));
    browser.emulate(1280, 900, "light");
    browser.open(&file.0);
    assert_eq!(browser.evaluate("document.documentElement.dataset.charts"), json!("10"));
    assert_eq!(browser.evaluate("document.querySelector('canvas')"), json!(null));
    assert_eq!(browser.complaints, Vec::<String>::new());
}

#[test]
fn pictures_of_images_are_drawn_for_every_choice() {
    let Some(mut browser) = browser() else { return };
    let options = RenderOptions { pictures: vec![sample::picture()], ..RenderOptions::default() };
    let page = render(&sample::images(), None, &options).expect("a page");
    let file = PageFile::new("images", &page);
    for (width, height) in [(1280, 900), (390, 844)] {
        browser.emulate(width, height, "light");
        browser.open(&file.0);
        browser.evaluate("document.querySelectorAll('.controls input').forEach(i => i.click())");
        assert_eq!(browser.evaluate("document.documentElement.dataset.pictures"), json!("drawn"));
        let lit = "[...document.querySelectorAll('.pictures canvas')].map(canvas => {
            const [w, h] = [canvas.width, canvas.height];
            const pixels = canvas.getContext('2d').getImageData(0, 0, w, h).data;
            return new Set(new Uint32Array(pixels.buffer)).size > 2;
        }).join()";
        assert_eq!(browser.evaluate(lit), json!("true,true,true,true"));
        let wider = "document.documentElement.scrollWidth > document.documentElement.clientWidth";
        assert_eq!(browser.evaluate(wider), json!(false), "sideways at {width} px");
        assert_eq!(browser.complaints, Vec::<String>::new());
    }
}

/// Picks every option of a form's menus `keys`, one after the other, and says what the page shows then:
/// an array of `[labels of the options, what "show" returns]`.
const WALK: &str = "((form, keys, show) => {
    const controls = document.getElementById(form);
    const options = (key) => [...controls.querySelectorAll(`[name='${form}-${key}'] option, input[name='${form}-${key}']`)];
    const label = (o) => o.tagName === 'OPTION' ? o.textContent : o.nextElementSibling.textContent;
    const pick = (key, at) => {
        const option = options(key)[at];
        if (option.tagName !== 'OPTION') return option.click();
        const select = option.closest('select');
        select.value = option.value;
        select.dispatchEvent(new Event('change'));
    };
    const seen = [];
    const walk = (left, labels) => {
        if (!left.length) return seen.push([labels, show()]);
        const [key, ...others] = left;
        const n = options(key).length;
        if (!n) return walk(others, [...labels, '']);
        for (let at = 0; at < n; at++) {
            pick(key, at);
            walk(others, [...labels, label(options(key)[at])]);
        }
    };
    walk(keys, []);
    return seen;
})";

fn text(value: &Value) -> &str {
    value.as_str().expect("a text")
}

/// What a row of `document` is called in menus: its neighborhoods with their source's name.
fn called(document: &Document, row: usize) -> (String, String, String) {
    let row = &document.results[row];
    let percent = format!("{:.1}", 100.0 * row.inlier_ratio);
    let right = percent.trim_end_matches(".0");
    let measured = if row.neighbors == "oracle" { "" } else { " (measured)" };
    let given = format!("{}, {right} % right{measured}", row.neighbors);
    (row.scheme.clone(), given, row.solver.clone())
}

#[test]
fn every_choice_of_the_view_names_its_source_and_shows_points_or_words() {
    let Some(mut browser) = browser() else { return };
    let document = sample::mixed(true);
    let mut scene = sample::scene(&document, 600);
    // One cell has no points in the page, and of one cell nothing came back.
    let gone = scene.views.pop().expect("a view");
    scene.views[0].recovered.fill([f32::NAN; 3]);
    let page = render(&document, Some(&scene), &RenderOptions::default()).expect("a page");
    let file = PageFile::new("mixed-view", &page);
    browser.emulate(1280, 900, "light");
    browser.open(&file.0);
    let show = "() => [+document.documentElement.dataset.sceneRow, +document.documentElement.dataset.scenePoints, \
        document.getElementById('panes').textContent, document.getElementById('scene-status').textContent]";
    let seen = browser
        .evaluate(&format!("{WALK}('scene-controls', ['scheme', 'given', 'solver'], {show})"));
    let seen = seen.as_array().expect("choices");
    assert_eq!(seen.len(), document.results.len() - 1, "all cells but the one without points");
    for choice in seen {
        let labels = [0, 1, 2].map(|at| text(&choice[0][at]));
        let row = choice[1][0].as_u64().expect("a row") as usize;
        let (scheme, given, solver) = called(&document, row);
        assert_eq!(labels[0], scheme);
        assert_eq!(labels[1], given);
        // A menu of one entry is not drawn.
        assert!(labels[2] == solver || labels[2].is_empty(), "{labels:?}");
        let (panes, status) = (text(&choice[1][2]), text(&choice[1][3]));
        assert!(panes.contains(&format!("recovered, {given}, {solver}")), "{panes}");
        assert!(status.contains("released") && status.contains("drawn"), "{status}");
        let drawn = choice[1][1].as_u64().expect("points");
        let lost = panes.contains("None of 600 points drawn; 600 lost");
        assert!((drawn > 0) != lost, "{labels:?}: {drawn} points, {panes}");
        assert_eq!(lost, row == 0);
    }
    let (scheme, given, solver) = (&gone.scheme, &gone.given.neighbors, &gone.solver);
    let offered = seen.iter().any(|choice| {
        let row = &document.results[choice[1][0].as_u64().unwrap() as usize];
        row.scheme == *scheme && row.neighbors == *given && row.solver == *solver
    });
    assert!(!offered);
    assert_eq!(browser.complaints, Vec::<String>::new());
}

#[test]
fn charts_show_the_rows_that_are_chosen() {
    let Some(mut browser) = browser() else { return };
    let document = sample::mixed(true);
    let page = render(&document, None, &RenderOptions::default()).expect("a page");
    let file = PageFile::new("mixed-charts", &page);
    browser.emulate(1280, 900, "light");
    browser.open(&file.0);
    for (form, chart) in [("error-controls", "errors"), ("reliability-controls", "reliability")] {
        let show = format!(
            "() => [document.getElementById('chart-{chart}').dataset.rows, \
            document.getElementById('{chart}-shown').textContent]"
        );
        let seen = browser.evaluate(&format!("{WALK}('{form}', ['given', 'solver'], {show})"));
        let seen = seen.as_array().expect("choices");
        // Six ratios of the oracle, overlap and geometric, by two solvers.
        assert_eq!(seen.len(), 8 * 2, "{chart}");
        for choice in seen {
            let (given, solver) = (text(&choice[0][0]), text(&choice[0][1]));
            let (source, _) = given.split_once(',').expect("a source and a share");
            assert!(["oracle", "overlap", "geometric"].contains(&source), "{given}");
            let rows =
                text(&choice[1][0]).split(' ').map(|row| row.parse::<usize>().expect("a row"));
            let rows: Vec<usize> = rows.collect();
            assert_eq!(rows.len(), if source == "geometric" { 6 } else { 7 });
            for &row in &rows {
                let row = &document.results[row];
                assert_eq!((row.neighbors.as_str(), row.solver.as_str()), (source, solver));
                let asked = format!("oracle, {} % right", 100.0 * row.inlier_ratio);
                assert!(source != "oracle" || given == asked, "{given}, {}", row.inlier_ratio);
            }
            let said = text(&choice[1][1]);
            assert!(said.starts_with(&format!("Shown: {given}, by {solver}.")), "{said}");
            assert_eq!(
                said.contains("Not tried with these: plane."),
                source == "geometric",
                "{said}"
            );
        }
    }
    // Today's attack comes first, and no menu knows a solver that is none.
    let first =
        "document.querySelector('[name=error-controls-given]').selectedOptions[0].textContent";
    let browser_first = {
        browser.open(&file.0);
        browser.evaluate(first)
    };
    assert_eq!(browser_first, json!("overlap, 8 to 9.2 % right (measured)"));
    let names = browser.evaluate("[...document.querySelectorAll('[name$=-solver]')].map(i => i.nextElementSibling?.textContent ?? '').join()");
    assert!(!text(&names).contains("overlap"), "{names}");
}

#[test]
fn tables_fit_a_laptop_and_say_on_a_phone_that_there_is_more() {
    let Some(mut browser) = browser() else { return };
    let pages = [sample::mixed(true), sample::mixed(false), sample::images()]
        .map(|document| render(&document, None, &RenderOptions::default()).expect("a page"));
    for page in pages {
        let file = PageFile::new("tables", &page);
        browser.emulate(1280, 900, "light");
        browser.open(&file.0);
        browser.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })");
        let cut =
            "[...document.querySelectorAll('.scroll')].filter(s => s.scrollWidth > s.clientWidth)
            .map(s => `${s.ariaLabel}: ${s.scrollWidth} > ${s.clientWidth}`)";
        assert_eq!(browser.evaluate(cut), json!([]));
        browser.emulate(390, 844, "light");
        browser.open(&file.0);
        let silent = "[...document.querySelectorAll('.scroll')].filter(s => s.scrollWidth > s.clientWidth
            && !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0)).length";
        assert_eq!(browser.evaluate(silent), json!(0));
        let wider = "document.documentElement.scrollWidth > document.documentElement.clientWidth";
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
        let silent = "[...document.querySelectorAll('.scroll')].filter(s => s.scrollWidth > s.clientWidth
            && !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0)).length";
        assert_eq!(browser.evaluate(silent), json!(0), "{width} px");
        assert_eq!(browser.evaluate(OVERLAPS), json!([]), "{width} px");
        let beyond = "[...document.querySelectorAll('main *')]
            .filter(n => !n.closest('.scroll') && n.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
            .map(n => `${n.tagName}.${n.className?.baseVal ?? n.className}: ${n.textContent.slice(0, 60)}`)";
        assert_eq!(browser.evaluate(beyond), json!([]), "{width} px");
        let wider = "document.documentElement.scrollWidth > document.documentElement.clientWidth";
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
            assert_eq!(browser.evaluate(OVERLAPS), json!([]), "{width} px");
        }
    }
}

#[test]
fn the_page_can_be_read_without_script() {
    let Some(mut browser) = browser() else { return };
    let document = sample::mixed(false);
    let scene = sample::scene(&document, 300);
    let page = render(&document, Some(&scene), &RenderOptions::default()).expect("a page");
    let file = PageFile::new("no-script", &page);
    browser.emulate(1280, 900, "light");
    browser.call("Emulation.setScriptExecutionDisabled", json!({"value": true}));
    browser.call("Page.navigate", json!({"url": format!("file://{}", file.0.display())}));
    browser.wait_for("document.readyState === 'complete' && !!document.getElementById('use')");
    let seen = "['.card', '.finding', '#gates li', 'table', '.stage', '.chart'].map(s =>
        [...document.querySelectorAll(s)].filter(n => n.getClientRects().length && n.clientHeight > 0).length)";
    let seen = browser.evaluate(seen);
    // Cards, findings, gates and tables are there (seconds are folded away); nothing that needs script is.
    assert_eq!(seen, json!([7, 14, 2, 7, 0, 0]));
}

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
