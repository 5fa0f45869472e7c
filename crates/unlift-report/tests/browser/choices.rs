//! Tests of the menus: their options, and the rows that the page shows.

use serde_json::{Value, json};
use unlift_report::document::Document;
use unlift_report::{RenderOptions, render};

use super::{browser, page, sample};

/// Picks every combination of options of a form's menus `keys`; returns an array of
/// `[labels of the options, result of "show"]`.
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

/// Returns the name of a source in menus.
fn plain(neighbors: &str) -> &str {
    match neighbors {
        "oracle" => "known neighbors",
        "overlap" => "neighbors by descriptor overlap",
        "geometric" => "neighbors by record geometry",
        other => other,
    }
}

/// Returns the scheme, neighborhoods and solver of a row, as in menus.
fn called(document: &Document, row: usize) -> (String, String, String) {
    let row = &document.results[row];
    let percent = format!("{:.1}", 100.0 * row.inlier_ratio);
    let share = percent.trim_end_matches(".0");
    let given = format!("{}, {share} % right", plain(&row.neighbors));
    (row.scheme.clone(), given, row.solver.clone())
}

#[test]
fn every_choice_of_the_view_names_its_source_and_shows_points_or_words() {
    let Some(mut browser) = browser() else { return };
    let document = sample::mixed(true);
    let mut scene = sample::scene(&document, 600);
    // One row has no points in the page, and one row has no recovered points.
    let gone = scene.views.pop().expect("a view");
    scene.views[0].recovered.fill([f32::NAN; 3]);
    let page = render(&document, Some(&scene), &RenderOptions::default()).expect("a page");
    browser.open(&page, 1280);
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
        assert!(panes.contains(&format!("recovered, {given}, solver {solver}")), "{panes}");
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
    let page = page(&document);
    browser.open(&page, 1280);
    browser.unfold();
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
            let (called, _) = given.split_once(',').expect("a source and a share");
            let mut sources = ["oracle", "overlap", "geometric"].into_iter();
            let source = sources.find(|source| plain(source) == called).expect("a known source");
            let rows =
                text(&choice[1][0]).split(' ').map(|row| row.parse::<usize>().expect("a row"));
            let rows: Vec<usize> = rows.collect();
            assert_eq!(rows.len(), if source == "geometric" { 6 } else { 7 });
            for &row in &rows {
                let row = &document.results[row];
                assert_eq!((row.neighbors.as_str(), row.solver.as_str()), (source, solver));
                let asked = format!("known neighbors, {} % right", 100.0 * row.inlier_ratio);
                assert!(source != "oracle" || given == asked, "{given}, {}", row.inlier_ratio);
            }
            let said = text(&choice[1][1]);
            assert!(said.starts_with(&format!("Shown: {given}, solver {solver}.")), "{said}");
            assert_eq!(
                said.contains("Not tried with these: plane."),
                source == "geometric",
                "{said}"
            );
        }
    }
    // Today's attack comes first, and the menus of solvers contain no source.
    let first =
        "document.querySelector('[name=error-controls-given]').selectedOptions[0].textContent";
    browser.open(&page, 1280);
    assert_eq!(browser.evaluate(first), json!("neighbors by descriptor overlap, 8 to 9.2 % right"));
    let names = browser.evaluate("[...document.querySelectorAll('[name$=-solver]')].map(i => i.nextElementSibling?.textContent ?? '').join()");
    assert!(!text(&names).contains("overlap"), "{names}");
}
