//! Tests of the page's content: curves, tables and canvases, without errors and network; parts of it
//! without script.

use serde_json::json;
use unlift_report::{RenderOptions, render};

use super::{browser, page, page_with_points, sample};

const CHARTS: &str = "document.querySelectorAll('.chart svg').length";

#[test]
fn curves_tables_and_canvas_are_there_without_errors_or_network() {
    let Some(mut browser) = browser() else { return };
    let page = page_with_points(&sample::document(true), 4_000);
    for width in [1280, 390] {
        browser.open(&page, width);
        let folded =
            browser.evaluate("document.querySelectorAll('#chart-multiples .chart').length");
        assert_eq!(folded, json!(0));
        browser.unfold();
        assert_eq!(browser.evaluate(CHARTS), json!(10));
        let empty = "[...document.querySelectorAll('.chart')].filter(c => c.querySelectorAll('svg path').length < 10).length";
        assert_eq!(browser.evaluate(empty), json!(0));
        assert_eq!(browser.evaluate("document.querySelectorAll('table').length >= 5"), json!(true));
        assert_eq!(browser.evaluate("document.documentElement.dataset.scene"), json!("drawn"));
        let drawn = browser.evaluate("+document.documentElement.dataset.scenePoints > 3000");
        assert_eq!(drawn, json!(true));
        browser.is_fine();
    }
}

#[test]
fn the_canvas_shows_points_and_answers_every_choice() {
    let Some(mut browser) = browser() else { return };
    browser.open(&page_with_points(&sample::document(true), 4_000), 1280);
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
    // The drawing buffer is lost after the frame, so it is read in the same turn as the drawing.
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
    browser.open(&render(&document, Some(&scene), &options).expect("a page"), 1280);
    browser.unfold();
    assert_eq!(browser.evaluate(CHARTS), json!(10));
    assert_eq!(browser.evaluate("document.querySelector('canvas')"), json!(null));
    browser.is_fine();
}

#[test]
fn pictures_of_images_are_drawn_for_every_choice() {
    let Some(mut browser) = browser() else { return };
    let options = RenderOptions { pictures: vec![sample::picture()], ..RenderOptions::default() };
    let page = render(&sample::images(), None, &options).expect("a page");
    for width in [1280, 390] {
        browser.open(&page, width);
        browser.evaluate("document.querySelectorAll('.controls input').forEach(i => i.click())");
        assert_eq!(browser.evaluate("document.documentElement.dataset.pictures"), json!("drawn"));
        let lit = "[...document.querySelectorAll('.pictures canvas')].map(canvas => {
            const [w, h] = [canvas.width, canvas.height];
            const pixels = canvas.getContext('2d').getImageData(0, 0, w, h).data;
            return new Set(new Uint32Array(pixels.buffer)).size > 2;
        }).join()";
        assert_eq!(browser.evaluate(lit), json!("true,true,true,true"));
        browser.is_fine();
    }
}

#[test]
fn the_page_can_be_read_without_script() {
    let Some(mut browser) = browser() else { return };
    browser.emulate(1280, 900, "light");
    browser.call("Emulation.setScriptExecutionDisabled", json!({"value": true}));
    browser.navigate(&page_with_points(&sample::mixed(false), 300));
    browser.wait_for("document.readyState === 'complete' && !!document.getElementById('use')");
    let seen = "['.card', '.finding', '#gates li', '#numbers details', '.stage', '.chart'].map(s =>
        [...document.querySelectorAll(s)].filter(n => n.getClientRects().length && n.clientHeight > 0).length)";
    let seen = browser.evaluate(seen);
    // Cards, findings, gates and folded tables are visible; parts that need script are not.
    assert_eq!(seen, json!([7, 14, 2, 7, 0, 0]));
}

#[test]
fn tables_are_sorted_by_the_column_that_is_chosen() {
    let Some(mut browser) = browser() else { return };
    browser.open(&page(&sample::document(true)), 1280);
    browser.unfold();
    let sort = "(t => { t.tHead.rows[0].cells[6].querySelector('button').click();
        return [...t.tBodies[0].rows].map(r => +r.cells[6].textContent); })(document.getElementById('table-recovered'))";
    let mut shares = || -> Vec<f64> { serde_json::from_value(browser.evaluate(sort)).unwrap() };
    let falling = shares();
    assert!(falling.len() == 84 && falling.is_sorted_by(|a, b| a >= b), "{falling:?}");
    assert!(shares().is_sorted());
    browser.is_fine();
}

#[test]
fn a_page_of_the_size_of_the_demos_is_short() {
    let Some(mut browser) = browser() else { return };
    browser.open(&page_with_points(&sample::mixed(true), 4_000), 1280);
    let height = browser.evaluate("document.documentElement.scrollHeight");
    assert!(height.as_f64().is_some_and(|height| height < 5_300.0), "{height} px");
}
