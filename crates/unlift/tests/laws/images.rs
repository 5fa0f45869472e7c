//! Tests of audits of images: pooled rows, coincident keypoints, images with few keypoints.

use unlift::audit::{ByThreshold, NeighborsBy, Observer, PointNeighbors, Watcher};
use unlift::neighbors::sources::Named;
use unlift::neighbors::{Overlap, Similarity};

use crate::maps::{self, *};

const SIZE: [f64; 2] = [320.0, 240.0];

fn image_of(name: &str, points: Vec<[f64; 2]>) -> Item<2> {
    let mut draws = Draws::new(points.len() as u64, Stage::Synthetic, 1);
    let values: Vec<u8> = (0..128 * points.len()).map(|_| draws.below(200) as u8).collect();
    let descriptors = Descriptors::try_new(Values::U8(values), 128).unwrap();
    Item { descriptors: Some(descriptors), ..image(name, points, SIZE) }
}

/// Returns keypoints in clusters of twelve; of the first ones, `twins` have a second keypoint at the same place.
fn keypoints(seed: u64, n: usize, twins: usize) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = piles(seed, n.div_ceil(12), 12, 0.3);
    points.truncate(n - twins);
    points.extend_from_within(..twins);
    points.iter().map(|point| point.map(|x| 20.0 + 45.0 * x)).collect()
}

fn run(
    images: &[Item<2>],
    plan: &Plan<2>,
    watcher: &mut impl Watcher<2>,
) -> Result<Outcome, Error> {
    run_many(images.iter().cloned().map(Ok::<_, Error>), plan, watcher)
}

/// Receives the rows of each image, and its messages of progress.
#[derive(Default)]
struct Each(Vec<(Vec<Row>, Messages)>);

#[derive(Default)]
struct Messages(Vec<(usize, usize)>);

impl Observer<2> for Messages {
    fn progress(&mut self, done: usize, total: usize, _: &str) {
        self.0.push((done, total));
    }
}

impl Watcher<2> for Each {
    type OfItem = Messages;

    fn begin(&mut self) -> Messages {
        Messages::default()
    }

    fn item(&mut self, _: &str, rows: &[Row], messages: Messages) {
        self.0.push((rows.to_vec(), messages));
    }
}

/// The pooled row of one image equals its own row. That of two images lies between theirs.
#[test]
fn rows_are_pooled_over_keypoints() {
    let plan = maps::plan(Unit::Pixel, &[], &[1.0, 0.5], &[Builtin::Joint]);
    let plan = Plan { repeats: 2, ..plan };
    let images = [image_of("a", keypoints(1, 300, 50)), image_of("b", keypoints(2, 150, 0))];
    let mut each = Each::default();
    let pooled = run(&images, &plan, &mut each).unwrap().rows;
    for (at, row) in pooled.iter().enumerate() {
        let [a, b] = [0, 1].map(|image: usize| &each.0[image].0[at]);
        assert_eq!(row.n_points, a.n_points + b.n_points);
        let (n, m) = (a.n_points as f64, b.n_points as f64);
        for c in 0..4 {
            let of = |r: &Row| r.recovered_percent[c];
            let mean = (n * of(a) + m * of(b)) / (n + m);
            assert!((of(row) - mean).abs() < 1e-9, "{}: {} {mean}", row.scheme, of(row));
        }
        let places = |r: &Row| r.distinct.as_ref().unwrap().n_places;
        assert_eq!(places(row), places(a) + places(b));
        assert!(places(b) == b.n_points && places(a) < a.n_points);
        let median = |r: &Row| r.median_error.unwrap();
        let (low, high) = (median(a).min(median(b)), median(a).max(median(b)));
        let slack = 1.0 + 1e-3;
        assert!(median(row) >= low / slack && median(row) <= high * slack, "{}", row.scheme);
    }
    // Rows depend neither on the order of images, nor on threads, nor on other images.
    let rows = |images: &[Item<2>]| run(images, &plan, &mut Silent).unwrap().rows;
    let turned = rows(&[images[1].clone(), images[0].clone()]);
    let shares = |rows: &[Row]| -> Vec<ByThreshold> {
        rows.iter().map(|row| row.recovered_percent.clone()).collect()
    };
    assert_eq!(shares(&pooled), shares(&turned));
    let on = |threads| on_threads(threads, || rows(&images));
    assert_eq!(on(1), on(3));
}

/// Images with at most K keypoints are attacked with shorter lists, or they would look protected.
#[test]
fn images_with_few_keypoints_are_attacked() {
    let mut plan = maps::plan(Unit::Pixel, &[], &[1.0, 0.5, 0.1], &Builtin::FROM_LISTS);
    plan.oracle_noise = Noise::ALL.to_vec();
    plan.neighbors.push(NeighborsBy::Source(Arc::new(Similarity)));
    for n in [4, 12, plan.k, plan.k + 3] {
        let outcome = run(&[image_of("few", keypoints(3, n, 0))], &plan, &mut Silent).unwrap();
        assert_eq!(outcome.n_too_small, usize::from(n <= plan.k));
        for row in &outcome.rows {
            let names = [&row.scheme, &row.neighbors, &row.solver];
            let what = format!("{n}: {names:?} at {}", row.inlier_ratio);
            assert!(row.k == plan.k || row.neighbors != "oracle", "{what}");
            // All of four keypoints with wrong neighbors may be lost.
            let sure = n > 4 && row.inlier_ratio >= 0.5 && row.solver != "ransac";
            assert!(!sure || 2 * row.n_lost < row.n_points, "{what}: {:?}", row.lost);
        }
        let best = outcome.rows.iter().filter(|row| row.scheme == "lines2d");
        let best = best.map(|row| row.recovered_percent[3]).fold(0.0, f64::max);
        assert!(n < 12 || best > 50.0, "{n}: {best}");
    }
}

/// Images with no, one, two or few keypoints, all at one place or on one line: every keypoint is
/// counted, if necessary as lost. An observer receives every row of every image when it is finished, not only when the next images begin.
#[test]
fn images_with_hardly_any_keypoints_are_counted() {
    let images = [
        image_of("none", Vec::new()),
        image_of("one", vec![[5.0, 6.0]]),
        image_of("two", vec![[5.0, 6.0], [7.0, 6.0]]),
        image_of("twenty", keypoints(3, 20, 0)),
        image_of("a few more", keypoints(4, 23, 5)),
        image_of("one place", vec![[33.0, 44.0]; 50]),
        image_of("upright", (0..60).map(|i| [160.0, 2.0 + 3.0 * f64::from(i)]).collect()),
        image_of("one line", (0..60).map(|i| [10.0 + 3.0 * f64::from(i), 50.0]).collect()),
        image_of("enough", keypoints(5, 200, 30)),
    ];
    let mut plan = maps::plan(Unit::Pixel, &[], &[1.0, 0.1], &Builtin::FROM_LISTS);
    plan.neighbors.push(NeighborsBy::Source(Arc::new(Similarity)));
    plan.neighbors.push(NeighborsBy::Source(Arc::new(Overlap)));
    let mut each = Each::default();
    let outcome = run(&images, &plan, &mut each).unwrap();
    for (image, (_, Messages(messages))) in images.iter().zip(&each.0) {
        let (last, total) = *messages.last().unwrap();
        assert!(last == total && messages.is_sorted(), "{}: {messages:?}", image.name);
        // Lists cost, too.
        let n_rows = 3 * 4 * Builtin::FROM_LISTS.len();
        assert!(image.original.len() < 3 || total > n_rows, "{}: {total}", image.name);
    }
    assert_eq!((outcome.n_items, outcome.n_too_small), (9, 4));
    let n: usize = images.iter().map(|image| image.original.len()).sum();
    assert_eq!(outcome.rows.len(), 3 * 4 * Builtin::FROM_LISTS.len());
    for row in &outcome.rows {
        let what = format!("{} by {} with {}", row.scheme, row.neighbors, row.solver);
        assert_eq!(row.n_points + row.dropped.values().sum::<usize>(), n, "{what}");
        assert!(row.recovered_percent.values().all(|p| (0.0..=100.0).contains(p)), "{what}");
        assert!(row.delta.is_finite(), "{what}");
    }
    for image in &images {
        run(std::slice::from_ref(image), &plan, &mut Silent).unwrap();
    }
}

#[test]
fn what_is_not_for_images_is_refused() {
    let message = |plan: &Plan<2>| {
        let images = [image_of("a", keypoints(1, 100, 0))];
        run(&images, plan, &mut Silent).unwrap_err().to_string()
    };
    let alone = Plan { solvers: vec![Arc::new(Builtin::Density)], ..Plan::new(Unit::Pixel) };
    assert_eq!(message(&alone), "solver: expected one that recovers from lists, found density");
    let (name, offsets, neighbors) = ("file".to_owned(), vec![0], Vec::new());
    let given = NeighborsBy::Given(PointNeighbors { name, offsets, neighbors, scores: None });
    let given = Plan { neighbors: vec![given], ..Plan::new(Unit::Pixel) };
    let expected =
        "neighbors: expected the oracle, or a source that works on single items, found file";
    assert_eq!(message(&given), expected);
    // Sources for maps only have no type for a plan of images.
    let geometric = Named::parse("geometric").unwrap().of_dimension::<2>().unwrap_err();
    let expected = "source: expected one that is defined in 2 dimensions, found geometric";
    assert_eq!(geometric.to_string(), expected);
    let outside = PointSet::try_new(vec![[1.0, 2.0], [400.0, 2.0]], Unit::Pixel).unwrap();
    let error = Original::within(outside, Bounds::try_new([0.0; 2], SIZE).unwrap()).unwrap_err();
    let line = "point 1: expected between [0.0, 0.0] and [320.0, 240.0], found [400.0, 2.0]";
    assert_eq!(error.to_string(), line);
}
