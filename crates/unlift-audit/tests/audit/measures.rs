//! A third-party measure, from the plan to the files.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use unlift::audit::{Cell, Counts, Item, Measure, Plan, Silent, run_many};
use unlift::geometry::frame::Bounds;
use unlift::recover::Builtin;
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit};
use unlift_audit::{
    Audit, Error as AuditError, Finished, Input, Map, Output, Preparation, Quiet, maps,
};
use unlift_io::outputs::Rules;
use unlift_report::Document;

use crate::{schemes, write_map};

/// Measures the number of recovered points as `found`, and a third of it.
#[derive(Debug)]
struct Found;

impl Measure<3> for Found {
    fn measure(&self, cell: &Cell<'_>) -> Result<Vec<(String, f64)>, Error> {
        let n = cell.recovered.positions().len();
        let found = (0..n).filter(|&slot| cell.recovered.position(slot).is_some()).count() as f64;
        Ok(vec![("found".to_owned(), found), ("thirds".to_owned(), found / 3.0)])
    }
}

/// Audits a small room with this measure, in `folder`.
fn audit(folder: &Path) -> Result<Finished, AuditError> {
    let map = write_map(folder, &unlift::synthetic::room(1, 400).points);
    let preparation = Preparation { scale: Some(1.0), k: 10, ..Preparation::default() };
    let prepared = maps::open(&map, None, &preparation)?;
    let usual = Plan::new(Unit::Meter);
    let plan = Plan {
        schemes: schemes(&["cp"], Unit::Meter),
        inlier_ratios: vec![1.0, 0.1],
        k: 10,
        solvers: vec![Arc::new(Builtin::Joint), Arc::new(Builtin::Ransac)],
        measures: vec![Arc::new(Found)],
        ..usual
    };
    let out = folder.join("audit");
    let output = Output::new(&out);
    let files = output.open(Rules::new([map.as_path()], false))?;
    let input = Input::Map(Map { plan, ..Map::new(&prepared) });
    Audit::of_map(&prepared, output).run(&input, &Quiet)?.write(files)
}

#[test]
fn figures_of_a_measure_stand_in_the_files() {
    let place = tempfile::tempdir().expect("a temporary folder");
    audit(place.path()).expect("an audit");
    let text = fs::read_to_string(place.path().join("audit/audit.json")).expect("audit.json");
    let document = Document::from_json(&text).expect("a document");
    assert_eq!(document.results.len(), 4);
    for row in &document.results {
        assert_eq!(row.metrics.keys().collect::<Vec<_>>(), ["found", "thirds"]);
        let found = (row.n_points - row.n_lost) as f64;
        assert!(found > 0.0, "{} {}", row.solver, row.inlier_ratio);
        assert_eq!(row.metrics["found"], found, "{} {}", row.solver, row.inlier_ratio);
        assert!((row.metrics["thirds"] - found / 3.0).abs() < 1e-3, "{}", row.metrics["thirds"]);
    }
    // Rows differ, so a constant would fail.
    let lost: Vec<usize> = document.results.iter().map(|row| row.n_lost).collect();
    assert!(lost.iter().any(|&n| n != lost[0]), "{lost:?}");
}

/// Measures the number of points of images whose names do not begin with `none`.
#[derive(Debug)]
struct Size(Counts);

impl Measure<2> for Size {
    fn counts(&self) -> Counts {
        self.0
    }

    fn measure(&self, cell: &Cell<'_, 2>) -> Result<Vec<(String, f64)>, Error> {
        let named = cell.name.expect("one of many").starts_with("none");
        let n = cell.original.len() as f64;
        Ok(if named { Vec::new() } else { vec![("size".to_owned(), n)] })
    }
}

/// Returns the mean over images with these names and numbers of points.
fn size(counts: Counts, images: &[(&str, usize)]) -> Option<f64> {
    let usual = Plan::<2>::new(Unit::Pixel);
    let plan = Plan {
        schemes: usual.schemes.iter().filter(|s| s.name() == "cp2d").cloned().collect(),
        inlier_ratios: vec![1.0],
        k: 5,
        solvers: vec![Arc::new(Builtin::Consensus)],
        measures: vec![Arc::new(Size(counts))],
        ..usual
    };
    let images = images.iter().map(|&(name, n)| {
        let place = |at: usize| [(at * 37 % 101) as f64, (at * 53 % 89) as f64];
        let points = PointSet::try_new((0..n).map(place).collect(), Unit::Pixel)?;
        let bounds = Bounds::try_new([-0.5; 2], [127.5; 2])?;
        let original = Original::within(points, bounds)?;
        Ok::<_, Error>(Item { name: name.to_owned(), original, descriptors: None })
    });
    let outcome = run_many(images, &plan, &mut Silent).unwrap();
    outcome.rows[0].metrics.get("size").copied()
}

#[test]
fn a_mean_over_images_counts_points_or_images() {
    let images = [("a", 40), ("b", 80)];
    assert_eq!(size(Counts::Points, &images), Some((40.0 * 40.0 + 80.0 * 80.0) / 120.0));
    assert_eq!(size(Counts::Images, &images), Some(60.0));
    // A mean over points needs all images; a mean over images uses those that have the figure.
    let images = [("a", 40), ("none", 80)];
    assert_eq!(size(Counts::Points, &images), None);
    assert_eq!(size(Counts::Images, &images), Some(40.0));
}
