//! A third-party measure, from the plan to the rows.

use std::sync::Arc;

use unlift::audit::{Cell, Item, Measure, Plan, Silent, run, run_many};
use unlift::geometry::frame::Bounds;
use unlift::recover::Builtin;
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit, synthetic};

use crate::schemes;

/// Measures the number of points and of recovered ones, but not of images whose names begin with `none`.
#[derive(Debug)]
struct Counts {
    is_of_images: bool,
}

impl<const D: usize> Measure<D> for Counts {
    fn is_of_images(&self) -> bool {
        self.is_of_images
    }

    fn measure(&self, cell: &Cell<'_, D>) -> Result<Vec<(String, f64)>, Error> {
        if cell.name.is_some_and(|name| name.starts_with("none")) {
            return Ok(Vec::new());
        }
        let recovered = (0..cell.recovered.n_slots()).filter_map(|at| cell.recovered.position(at));
        let n = [recovered.count(), cell.original.len()].map(|n| n as f64);
        Ok(vec![("recovered".to_owned(), n[0]), ("size".to_owned(), n[1])])
    }
}

#[test]
fn figures_of_a_measure_stand_in_the_rows() {
    let plan = Plan {
        schemes: schemes(&["cp"], Unit::Meter),
        inlier_ratios: vec![1.0, 0.1],
        k: 10,
        solvers: vec![Arc::new(Builtin::Joint), Arc::new(Builtin::Ransac)],
        measures: vec![Arc::new(Counts { is_of_images: false })],
        ..Plan::new(Unit::Meter)
    };
    let points = PointSet::try_new(synthetic::room(1, 400).points, Unit::Meter).unwrap();
    let rows = run(&Original::new(points), None, &plan, &mut Silent).unwrap().rows;
    assert_eq!(rows.len(), 4);
    for row in &rows {
        let n = (row.n_points - row.n_lost) as f64;
        assert!(n > 0.0, "{} {}", row.solver, row.inlier_ratio);
        let expected = [("recovered", n), ("size", 400.0)];
        let metrics = row.metrics.iter().map(|(name, value)| (name.as_str(), *value));
        assert!(metrics.eq(expected), "{:?}, {n}", row.metrics);
    }
    // Rows differ, so a constant would fail.
    assert!(rows.iter().any(|row| row.n_lost != rows[0].n_lost));
}

/// Returns the mean over images with these names and numbers of points.
fn size(is_of_images: bool, images: &[(&str, usize)]) -> Option<f64> {
    let usual = Plan::<2>::new(Unit::Pixel);
    let plan = Plan {
        schemes: usual.schemes.iter().filter(|s| s.name() == "cp2d").cloned().collect(),
        inlier_ratios: vec![1.0],
        k: 5,
        solvers: vec![Arc::new(Builtin::Consensus)],
        measures: vec![Arc::new(Counts { is_of_images })],
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
    assert_eq!(size(false, &images), Some((40.0 * 40.0 + 80.0 * 80.0) / 120.0));
    assert_eq!(size(true, &images), Some(60.0));
    // A mean over points needs all images; a mean over images uses those that have the figure.
    let images = [("a", 40), ("none", 80)];
    assert_eq!(size(false, &images), None);
    assert_eq!(size(true, &images), Some(40.0));
}
