//! Pictures of what came back, and what the page says about them.

mod sample;

use unlift_report::document::{Document, Row};
use unlift_report::inversions::{Inversion, InvertedView, Object, Painted};
use unlift_report::{Given, RenderOptions, render};

#[test]
fn pictures_lead_with_what_comes_back_today_and_by_the_attack_that_is_shown() {
    let mut document = sample::images();
    let view = |row: &Row| InvertedView {
        scheme: row.scheme.clone(),
        given: Given::of(row),
        solver: row.solver.clone(),
        painted: Painted {
            jpeg: vec![1],
            objects: vec![Object { class: "chair".into(), sides: [0.25, -0.5, 0.75, 0.5] }],
            ..Painted::default()
        },
    };
    for row in &mut document.results {
        row.metrics.insert("ssim".into(), 0.48);
        row.metrics.insert("ssim_baseline".into(), 0.5);
        row.metrics.insert("objects_found".into(), 0.2);
        row.metrics.insert("objects_found_of_tv".into(), 0.25);
        row.metrics.insert("objects_found_of_tv_baseline".into(), 0.75);
    }
    // Rows of the images are not asked here, and are as many as results or none.
    document.images.iter_mut().for_each(|image| image.rows.clear());
    let page = |document: &Document, rows: &[Row], share_safe| {
        let views = rows.iter().map(view).collect();
        let inversions = vec![Inversion { views, ..Inversion::default() }];
        let options = RenderOptions { inversions, share_safe, ..RenderOptions::default() };
        render(document, None, &options).expect("a page")
    };
    let rows = document.results.clone();
    let found = page(&document, &rows, false);
    assert!(found.contains("With 50 % of the neighbors known, a network paints as good a picture"));
    assert!(!found.contains("<figure class=\"today\""));
    assert!(!page(&document, &rows, true).contains("a network paints"));
    let frame = "style=\"left:25.0%;top:0.0%;width:50.0%;height:50.0%\"><b>chair</b>";
    assert!(found.contains(frame), "{found}");
    assert!(found.contains("tv, %"), "{found}");
    // The paper's figures of the same cell stand beside ours.
    assert!(found.contains("<td>0.480</td><td>0.020</td><td>0.62</td>"), "{found}");
    assert!(!found.contains("ssim_baseline"));
    assert!(found.contains("<td>75.0</td>") && found.contains("<td>25.0</td>"));
    // A solver that is not painted does not speak for one that is.
    document.results[0].metrics["ssim"] = 0.9;
    document.results[0].solver = "other".into();
    assert!(!page(&document, &rows, false).contains("SSIM 0.90"));
    // What needs no oracle comes first, and gets a frame.
    let mut own = document.results[1].clone();
    (own.neighbors, own.oracle_noise, own.inlier_ratio) = ("overlap".into(), None, 0.2);
    own.metrics["ssim"] = 0.3;
    document.results.push(own);
    let found = page(&document, &document.results, false);
    let sentence = "From the released data alone, a network paints a worse picture than without";
    assert!(found.contains(sentence) && found.contains("<figure class=\"today\""), "{found}");
    let mut lists = document.results.pop().expect("a row");
    lists.neighbors = "file".into();
    document.results = vec![lists];
    let found = page(&document, &document.results, false);
    assert!(!found.contains(sentence) && !found.contains("<figure class=\"today\""));
}
