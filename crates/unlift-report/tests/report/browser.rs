//! Tests of the page in a headless Chromium. They are skipped with a message where none is installed; `CHROMIUM` can name one.

use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::{Value, json};
use unlift_report::document::{Document, Spread};
use unlift_report::{RenderOptions, render};

use crate::page::page;
use crate::sample;

const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// Runs in the page before all else, because complaints of its scripts are failures.
const LISTEN: &str = "<head><script>window.complaints = [];
    addEventListener('error', e => complaints.push(e.message));
    addEventListener('securitypolicyviolation', e => complaints.push(`${e.violatedDirective} ${e.blockedURI}`));
    console.error = (...all) => complaints.push(all.join(' '));</script>";

/// Returns the value of an expression in a frame of `width` pixels with `page`, when its script is done; `None` without a browser.
fn evaluate(page: &str, width: u32, scripts: bool, expression: &str) -> Option<Value> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let installed =
        NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    let Some(program) = named.or_else(|| installed.into_iter().find(|file| file.is_file())) else {
        println!("skipped: no chromium on the PATH; CHROMIUM names one");
        return None;
    };
    let page = page.replacen("<head>", LISTEN, 1).replace('&', "&amp;").replace('"', "&quot;");
    let sandbox = if scripts { "" } else { "sandbox=\"allow-same-origin\"" };
    let ready = if scripts { "document.documentElement.dataset.ready === '1'" } else { "true" };
    let wrapper = format!(
        "<!doctype html><body style='margin:0'><iframe {sandbox} width={width} height=900 style='border:0' srcdoc=\"{page}\"></iframe><script>
        const frame = document.querySelector('iframe');
        const sleep = ms => new Promise(done => setTimeout(done, ms));
        frame.onload = async () => {{
            const window = frame.contentWindow, document = window.document, root = document.documentElement;
            const unfold = async () => {{ document.querySelectorAll('details').forEach(part => {{ part.open = true; }}); await sleep(300); }};
            const innerHeight = window.innerHeight, getComputedStyle = window.getComputedStyle.bind(window);
            let value;
            try {{ while (!({ready})) await sleep(20); value = await ({expression}); }} catch (error) {{ value = `failed: ${{error.stack}}`; }}
            const sideways = root.scrollWidth > root.clientWidth;
            const result = self.document.createElement('pre');
            result.textContent = JSON.stringify({{ value, sideways, complaints: window.complaints ?? [] }});
            self.document.body.replaceChildren(result);
        }};</script>"
    );
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("unlift-page-{}-{number}", std::process::id()));
    std::fs::create_dir(&folder).expect("a temporary folder");
    let file = folder.join("page.html");
    std::fs::write(&file, wrapper).expect("a file");
    let run = Command::new(program)
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--disable-background-networking",
        ])
        .args([
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--window-size=1400,1000",
        ])
        .args(["--virtual-time-budget=60000", "--dump-dom"])
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("the browser runs");
    std::fs::remove_dir_all(&folder).expect("the folder is ours");
    let text = String::from_utf8_lossy(&run.stdout);
    let (_, result) = text
        .split_once("<pre>")
        .unwrap_or_else(|| panic!("no result: {}", &text[..text.len().min(2_000)]));
    let result = result.split_once("</pre>").expect("an end").0;
    let result = result
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&nbsp;", "\u{a0}")
        .replace("&amp;", "&");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["complaints"], json!([]), "{expression}");
    assert_eq!(result["sideways"], json!(false), "the page scrolls sideways at {width} px");
    Some(result["value"].clone())
}

/// Picks every combination of options of a form's menus `keys`; returns an array of `[labels of the options, result of "show"]`.
const WALK: &str = "((form, keys, show) => {
    const controls = document.getElementById(form);
    const options = (key) => [...controls.querySelectorAll(`[name='${form}-${key}'] option, input[name='${form}-${key}']`)];
    const label = (o) => o.tagName === 'OPTION' ? o.textContent : o.nextElementSibling.textContent;
    const pick = (key, at) => {
        const option = options(key)[at];
        if (option.tagName !== 'OPTION') return option.click();
        const select = option.closest('select');
        select.value = option.value;
        select.dispatchEvent(new window.Event('change'));
    };
    const seen = [];
    const walk = (left, labels) => {
        if (!left.length) return seen.push([labels, show()]);
        const [key, ...others] = left;
        const n = options(key).length;
        if (!n) return walk(others, [...labels, '']);
        for (let at = 0; at < n; at++) { pick(key, at); walk(others, [...labels, label(options(key)[at])]); }
    };
    walk(keys, []);
    return seen;
})";

/// Returns the neighborhoods of a row as menus have them.
fn given(document: &Document, row: usize) -> String {
    let row = &document.results[row];
    let source = match row.neighbors.as_str() {
        "oracle" => "known neighbors",
        "overlap" => "neighbors by descriptor overlap",
        _ => "neighbors by record geometry",
    };
    let percent = format!("{:.1}", 100.0 * row.inlier_ratio);
    format!("{source}, {} % right", percent.trim_end_matches(".0"))
}

#[test]
fn every_choice_of_the_view_names_its_source_and_shows_points_or_words() {
    let document = sample::mixed(true);
    let mut scene = sample::scene(&document, 600);
    // One row has no points in the page, and one row has no recovered points.
    scene.views.pop();
    scene.views[0].recovered.fill([f32::NAN; 3]);
    let show = "() => [+root.dataset.sceneRow, +root.dataset.scenePoints, document.getElementById('panes').textContent]";
    let walk = format!("{WALK}('scene-controls', ['scheme', 'given', 'solver'], {show})");
    let Some(seen) = evaluate(&page(&document, Some(&scene), false), 1280, true, &walk) else {
        return;
    };
    let seen = seen.as_array().expect("choices");
    assert_eq!(seen.len(), document.results.len() - 1, "all cells but the one without points");
    for choice in seen {
        let row = choice[1][0].as_u64().expect("a row") as usize;
        let (given, solver) = (given(&document, row), &document.results[row].solver);
        assert_eq!(choice[0][0], document.results[row].scheme.as_str());
        assert_eq!(choice[0][1], given.as_str());
        let panes = choice[1][2].as_str().expect("a text");
        assert!(panes.contains(&format!("recovered, {given}, solver {solver}")), "{panes}");
        let lost = panes.contains("None of 600 points drawn; 600 lost");
        assert_eq!((lost, choice[1][1].as_u64() == Some(0)), (row == 0, row == 0), "{panes}");
    }
}

#[test]
fn curves_tables_and_canvas_are_drawn_without_complaints_or_network() {
    let document = sample::document(true);
    let scene = sample::scene(&document, 4_000);
    let drawn = "unfold().then(() => [document.querySelectorAll('.chart svg').length,
        [...document.querySelectorAll('.chart')].filter(c => c.querySelectorAll('svg path').length < 10).length,
        root.dataset.scene, +root.dataset.scenePoints > 3000])";
    for width in [1280, 390] {
        let Some(found) = evaluate(&page(&document, Some(&scene), false), width, true, drawn)
        else {
            return;
        };
        assert_eq!(found, json!([10, 0, "drawn", true]));
    }
    // The drawing buffer is lost after the frame, so it is read in the same turn as the drawing.
    let lit = "(() => {
        const canvas = document.getElementById('canvas');
        for (const key of ['ArrowLeft', 'ArrowUp', '+', '-']) canvas.dispatchEvent(new window.KeyboardEvent('keydown', {key}));
        const copy = document.createElement('canvas');
        copy.width = canvas.width; copy.height = canvas.height;
        const context = copy.getContext('2d');
        context.drawImage(canvas, 0, 0);
        const pixels = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
        return pixels.filter(p => (p & 255) + (p >> 8 & 255) + (p >> 16 & 255) > 150).length;
    })()";
    let found =
        evaluate(&page(&document, Some(&scene), false), 1280, true, lit).expect("a browser");
    assert!(found.as_f64().is_some_and(|lit| lit > 5_000.0), "{found} pixels are lit");
    let safe = page(&document, Some(&scene), true);
    let shown =
        "[document.querySelectorAll('.chart svg').length > 0, document.querySelector('canvas')]";
    assert_eq!(evaluate(&safe, 1280, true, shown), Some(json!([true, null])));
}

#[test]
fn pictures_of_images_are_drawn_for_every_choice() {
    let options = RenderOptions { pictures: vec![sample::picture()], ..RenderOptions::default() };
    let page = render(&sample::images(), &options).expect("a page");
    let drawn = "(() => {
        document.querySelectorAll('.controls input').forEach(i => i.click());
        return [root.dataset.pictures, ...[...document.querySelectorAll('.pictures canvas')].map(canvas => {
            const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
            return new Set(new Uint32Array(pixels.buffer)).size > 2;
        })];
    })()";
    for width in [1280, 390] {
        let Some(found) = evaluate(&page, width, true, drawn) else { return };
        assert_eq!(found, json!(["drawn", true, true, true, true]));
    }
}

#[test]
fn the_page_can_be_read_without_script_and_its_tables_be_sorted_with_it() {
    let document = sample::mixed(false);
    let scene = sample::scene(&document, 300);
    let seen = "['.card', '.finding', '#gates li', '#numbers details', '.stage', '.chart'].map(s =>
        [...document.querySelectorAll(s)].filter(n => n.getClientRects().length && n.clientHeight > 0).length)";
    let Some(found) = evaluate(&page(&document, Some(&scene), false), 1280, false, seen) else {
        return;
    };
    // Cards, findings, gates and folded tables are visible; parts that need script are not.
    assert_eq!(found, json!([7, 14, 2, 6, 0, 0]));
    let sort = "unfold().then(() => [0, 1].map(() => {
        const table = document.getElementById('table-recovered');
        table.tHead.rows[0].cells[6].querySelector('button').click();
        return [...table.tBodies[0].rows].map(r => +r.cells[6].textContent);
    }))";
    let found = evaluate(&page(&sample::document(true), None, false), 1280, true, sort);
    let [falling, rising]: [Vec<f64>; 2] =
        serde_json::from_value(found.expect("a browser")).unwrap();
    assert!(falling.len() == 84 && falling.is_sorted_by(|a, b| a >= b), "{falling:?}");
    assert!(rising.is_sorted());
}

/// Returns an audit with long names, several noise models, and seeds.
fn crowded() -> Document {
    let mut document = sample::mixed(true);
    for (at, row) in document.results.iter_mut().enumerate() {
        let long = ["olc", "a-scheme-of-mine", "another-scheme-of-mine"][at % 3];
        row.scheme = format!("{long}{}", at % 7);
        row.oracle_noise = row.oracle_noise.as_ref().map(|_| ["near", "clustered"][at % 2].into());
        row.repeats = 3;
        let spread = row.recovered_percent.keys().map(|typed| (typed.clone(), 10.5));
        row.std = Some(Spread { recovered_percent: spread.collect(), ..Spread::default() });
        row.k += at;
    }
    document.not_audited.clear();
    document
}

/// Tables that are cut; those that show this neither by a shade nor by the keyboard; texts of charts that overlap or are cut; and what
/// is wider than the page.
const SHAPE: &str = "unfold().then(() => {
    const cut = [...document.querySelectorAll('.wide')].filter(s => s.scrollWidth > s.clientWidth);
    const silent = cut.filter(s => !(getComputedStyle(s).backgroundImage.includes('gradient') && s.tabIndex === 0));
    const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
    const overlaps = [...document.querySelectorAll('.chart svg')].flatMap(svg => {
        const frame = svg.getBoundingClientRect();
        const boxes = [...svg.querySelectorAll('text')].filter(t => t.textContent.trim()).map(t => [t.textContent, t.getBoundingClientRect()]);
        return [...boxes.flatMap(([t, a], i) => boxes.slice(i + 1).filter(([, b]) => !apart(a, b)).map(([u]) => `${t} over ${u}`)),
            ...boxes.filter(([, a]) => a.left < frame.left - 1 || a.right > frame.right + 1 || a.top < frame.top - 1).map(([t]) => `${t} is cut`)];
    });
    const beyond = [...document.querySelectorAll('main *')].filter(n => !n.closest('.wide') && n.getBoundingClientRect().right > root.clientWidth + 1);
    return { cut: cut.map(s => s.ariaLabel), bad: [...silent.map(s => s.ariaLabel), ...overlaps, ...beyond.map(n => n.textContent.slice(0, 60))] };
})";

#[test]
fn pages_keep_their_shape_on_a_laptop_and_on_a_phone() {
    let [mixed, no_scale] = [true, false].map(sample::mixed);
    let pages = [
        ("mixed", mixed),
        ("no scale", no_scale),
        ("images", sample::images()),
        ("crowded", crowded()),
    ];
    for (name, document) in pages {
        for width in [1280, 390] {
            let Some(found) = evaluate(&page(&document, None, false), width, true, SHAPE) else {
                return;
            };
            assert_eq!(found["bad"], json!([]), "{name}, {width} px");
            assert!(
                width < 1280 || name == "crowded" || found["cut"] == json!([]),
                "{name}: {found}"
            );
        }
    }
}
