//! Tests of painted pictures on the page.

use unlift_report::document::{Document, Row};
use unlift_report::inversions::{Inversion, InvertedView, Likeness, Painted};
use unlift_report::{Given, RenderOptions, render};

use crate::sample;

/// Returns an audit of images, with rows by an attacker's own lists for both schemes.
fn document() -> Document {
    let mut document = sample::images();
    for (row, ssim) in document.results.iter_mut().zip([0.48, 0.33].into_iter().cycle()) {
        row.metrics.insert("ssim".into(), ssim);
        row.metrics.insert("ssim_baseline".into(), 0.5);
        row.metrics.insert("objects_found".into(), 0.2);
        row.metrics.insert("objects_found_of_tv".into(), 0.25);
        row.metrics.insert("objects_found_of_tv_baseline".into(), 0.75);
    }
    for scheme in ["lines2d", "cp2d"] {
        let mut row = document.results.iter().find(|row| row.scheme == scheme).unwrap().clone();
        (row.neighbors, row.oracle_noise, row.inlier_ratio) = ("overlap".into(), None, 0.2);
        document.results.push(row);
    }
    // Rows of images must match the results in number, or be absent.
    document.images.iter_mut().for_each(|image| image.rows.clear());
    document
}

fn inversion(document: &Document, ssim: impl Fn(&Row) -> f64) -> Inversion {
    let view = |row: &Row| InvertedView {
        scheme: row.scheme.clone(),
        given: Given::of(row),
        solver: row.solver.clone(),
        painted: Painted { jpeg: vec![1], likeness: Likeness { ssim: ssim(row), lpips: 0.3 } },
    };
    let picture = sample::picture();
    Inversion {
        name: picture.name,
        size: picture.size,
        baseline: Painted { likeness: Likeness { ssim: 0.5, lpips: 0.2 }, ..Painted::default() },
        released: picture.released,
        views: document.results.iter().map(view).collect(),
        ..Inversion::default()
    }
}

fn page(document: &Document, inversions: Vec<Inversion>, share_safe: bool) -> String {
    let options = RenderOptions { inversions, share_safe, ..RenderOptions::default() };
    render(document, None, &options).expect("a page")
}

#[test]
fn the_page_begins_with_what_an_attacker_paints_from_the_released_data() {
    let document = document();
    let ssim = |row: &Row| if row.neighbors == "overlap" { 0.48 } else { 0.2 };
    let found = page(&document, vec![inversion(&document, ssim)], false);
    let rebuilt =
        "<strong>An attacker can rebuild the picture.</strong> From the released data alone, ";
    let not = "<strong>The picture does not come back well by this attack.</strong> If half of the neighbors were known: ";
    let (first, second) = (found.find(rebuilt), found.find(not));
    assert!(first.is_some() && first < second, "{found}");
    assert!(found.contains(
        "% of the keypoints come back within 10\u{a0}px (LINES2D, neighbors by descriptor overlap)."
    ));
    assert!(found.contains("What the service receives") && found.contains("<path d=\"M"));
    assert!(!found.to_lowercase().contains("worse picture"));
    let safe = page(&document, vec![inversion(&document, ssim)], true);
    assert!(!safe.contains("class=\"exhibit") && !safe.contains("src=\"data:image/jpeg"));
}

#[test]
fn a_picture_that_was_poor_without_protection_is_called_so() {
    let document = document();
    let mut poor = inversion(&document, |_| 0.4);
    let said = "Even from the true points this network paints a poor picture (similarity to the photo: SSIM 0.43 of 1).";
    assert!(!page(&document, vec![poor.clone()], false).contains("Even from the true points"));
    poor.baseline.likeness.ssim = 0.43;
    assert!(page(&document, vec![poor], false).contains(said));
}

#[test]
fn two_photos_show_two_schemes() {
    let document = document();
    let all = || inversion(&document, |_| 0.48);
    let found = page(&document, vec![all(), all(), all()], false);
    assert_eq!(found.matches("<div class=\"exhibit").count(), 3);
    assert!(
        found.contains("(LINES2D, neighbors by descriptor overlap)")
            && found.contains("(CP2D, neighbors by descriptor overlap)")
    );
}

#[test]
fn only_the_strongest_attacks_are_shown_at_first() {
    let document = document();
    let found = page(&document, vec![inversion(&document, |_| 0.4)], false);
    let (_, section) = found.split_once("id=\"inversions\"").expect("pictures");
    let (_, row) = section.split_once("<h3>LINES2D</h3>").expect("a scheme");
    let (main, others) = row.split_once("<details>").expect("the others are folded away");
    assert_eq!(main.matches("<img").count(), 2, "released data alone, and half of the neighbors");
    assert!(main.contains("neighbors by descriptor overlap, 20 % right"));
    assert!(main.contains("known neighbors, 50 % right"));
    let (others, _) = others.split_once("</details>").expect("an end");
    assert_eq!(others.matches("<img").count(), 5);
}

#[test]
fn figures_of_pictures_stand_beside_the_papers() {
    let found = page(&document(), Vec::new(), false);
    assert!(found.contains("tv, %"), "{found}");
    // The published figures of the same case are beside ours.
    assert!(found.contains("<td>0.480</td><td>0.020</td><td>0.62</td>"), "{found}");
    assert!(!found.contains("ssim_baseline"));
    assert!(found.contains("<td>75.0</td>") && found.contains("<td>25.0</td>"));
}
