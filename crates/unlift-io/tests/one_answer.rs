//! Tests that stages through files and an audit in memory give the same row, bit for bit, for every
//! scheme and source.
//!
//! The trials of `ransac`, which files do not store, are left out.

use std::sync::Arc;

use std::path::Path;

use unlift::audit::staged::{Pooled, key_of, oracle_lists, oracle_seed};
use unlift::audit::{
    self, Cell, NeighborsBy, Observer, Plan, PointNeighbors, Row, Variant, measure,
};
use unlift::descriptors::Values;
use unlift::evaluate::blind;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
use unlift::neighbors::sources::Named;
use unlift::neighbors::{Neighborhoods, of_what_there_is};
use unlift::obfuscate::{SCHEMES, Scheme, obfuscate};
use unlift::recover::{Builtin, RecoverOptions, recover};
use unlift::seed::{Draws, Key, Stage};
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_io::atomic::{Access, OutputFile};
use unlift_io::stage::{self, ImageFile, ImageWriter, Kind};

/// A seed that is nowhere the default.
const SEED: u64 = 7;

/// Creates SIFT-like bytes that change slowly over the map.
fn descriptors<const D: usize>(points: &[[f64; D]], extent: f64) -> Descriptors {
    let value = |point: &[f64; D], bin: usize| {
        let mut draws = Draws::new(99, Stage::Synthetic, bin as u64);
        let phase: f64 = point.iter().map(|x| draws.between(-9.0, 9.0) * x / extent).sum();
        (60.0 + 55.0 * (phase + draws.between(0.0, 6.0)).sin()) as u8
    };
    let bytes = points.iter().flat_map(|point| (0..128).map(|bin| value(point, bin)));
    Descriptors::try_new(Values::U8(bytes.collect()), 128).unwrap()
}

fn sources<const D: usize>(k: usize) -> Vec<NeighborsBy<D>> {
    let names = ["similarity", "overlap", "geometric"];
    let named = names.map(|name| Named::parse(name).unwrap().with_k(k));
    let own = named.into_iter().filter_map(|named| named.of_dimension::<D>().ok());
    [NeighborsBy::Oracle].into_iter().chain(own.map(NeighborsBy::Source)).collect()
}

/// Lists by point: the next rows of the map, some lists empty.
fn given(n: usize) -> NeighborsBy<3> {
    let row = |point: usize| (1..=(point % 9)).map(move |step| ((point + step) % n) as u32);
    let mut offsets = vec![0];
    let mut neighbors: Vec<u32> = Vec::new();
    for point in 0..n {
        neighbors.extend(row(point));
        offsets.push(neighbors.len() as u64);
    }
    NeighborsBy::Given(PointNeighbors { name: "file".into(), offsets, neighbors, scores: None })
}

/// Returns the rows of the stages. All data between two stages goes through a file.
fn staged<const D: usize>(
    folder: &Path,
    scheme: &dyn Scheme<D>,
    original: &Original<D>,
    descriptors: &Descriptors,
    plan: &Plan<D>,
    (key, owner): (&Key, u64),
) -> Vec<Row> {
    let path = |name: &str| folder.join(name);
    let (released, secret) = obfuscate(scheme, original, Some(descriptors), key).unwrap();
    stage::write_released(&path("released.npz"), &released).unwrap();
    stage::write_truth(&path("truth.npz"), original, &secret).unwrap();
    drop((released, secret));
    let mut rows = Vec::new();
    for variant in &plan.variants() {
        let lists = lists::<D>(folder, variant, plan, owner);
        stage::write_neighborhoods(&path("lists.npz"), &lists).unwrap();
        for solver in &plan.solvers {
            let released = stage::read_released::<D>(&path("released.npz")).unwrap();
            let (n, slots) = (released.n_records(), released.slots_per_record());
            let lists = stage::read_neighborhoods(&path("lists.npz"), n, slots).unwrap();
            let options = RecoverOptions { seed: SEED, ..RecoverOptions::default() };
            let recovered = recover(&released, &lists, &**solver, &options).unwrap();
            stage::write_recovered(&path("back.npz"), &recovered).unwrap();
            let back = stage::read_recovered::<D>(&path("back.npz")).unwrap();
            let (original, secret) = stage::read_truth::<D>(&path("truth.npz")).unwrap();
            let baseline = blind(&released, &original, &secret);
            let measured =
                measure(&back, &original, &secret, Some(&baseline), &plan.thresholds).unwrap();
            rows.push(measured.0);
        }
    }
    rows
}

fn lists<const D: usize>(
    folder: &Path,
    variant: &Variant<'_, D>,
    plan: &Plan<D>,
    owner: u64,
) -> Neighborhoods {
    let released = stage::read_released::<D>(&folder.join("released.npz")).unwrap();
    let (original, secret) = stage::read_truth::<D>(&folder.join("truth.npz")).unwrap();
    let slots = secret.slots_per_record();
    match variant.by {
        NeighborsBy::Source(source) => source.lists(&released, source.k(&released), SEED).unwrap(),
        NeighborsBy::Given(points) => {
            oracle::from_points(&points.offsets, &points.neighbors, None, &secret, slots).unwrap()
        }
        NeighborsBy::Oracle => {
            let knn = oracle::search(&original).unwrap();
            let near = TrueNeighbors::new(&knn, &secret, slots, plan.k).unwrap();
            let noise = variant.noise.unwrap();
            let outliers = Outliers::new(noise, &near, &knn, &secret, owner).unwrap();
            near.lists(variant.inlier_ratio.unwrap(), &outliers, owner).unwrap()
        }
    }
}

/// Removes the fields of `row` that a file of recovered points does not store.
fn without_name(row: &Row) -> Row {
    Row {
        scheme: String::new(),
        neighbors: String::new(),
        oracle_noise: None,
        inlier_ratio: 0.0,
        k: 0,
        solver: String::new(),
        distinct: None,
        // These depend on the lists only.
        metrics: Default::default(),
        ..row.clone()
    }
}

fn plan<const D: usize>(unit: Unit, name: &str, sources: Vec<NeighborsBy<D>>) -> Plan<D> {
    let mut plan = Plan::new(unit);
    plan.schemes.retain(|scheme| scheme.name() == name);
    plan.neighbors = sources;
    // Records of planes alone say nothing about neighbors.
    plan.neighbors.retain(|by| name != "plane" || !by.name().contains("geometric"));
    plan.k = 8;
    plan.oracle_noise = vec![Noise::Uniform, Noise::Near, Noise::Clustered];
    plan.inlier_ratios = vec![1.0, 0.3];
    plan.solvers =
        vec![Arc::new(Builtin::Joint), Arc::new(Builtin::JointStart), Arc::new(Builtin::Consensus)];
    plan.records_alone = false;
    plan.seed = SEED;
    plan
}

fn assert_equal(scheme: &str, audited: &[Row], staged: &[Row]) {
    assert_eq!(audited.len(), staged.len(), "{scheme}");
    for (audited, staged) in audited.iter().zip(staged) {
        let what = format!("{scheme} {} {}", audited.neighbors, audited.solver);
        assert_eq!(
            without_name(audited),
            without_name(staged),
            "{what} {:?}",
            audited.oracle_noise
        );
    }
}

#[test]
fn maps() {
    let folder = tempfile::tempdir().unwrap();
    let points = unlift::synthetic::room(4, 260).points;
    let descriptors = descriptors(&points, 3.0);
    let original = Original::new(PointSet::try_new(points.clone(), Unit::Meter).unwrap());
    for entry in SCHEMES.iter().filter(|entry| entry.in_3d.is_some()) {
        let mut all = sources::<3>(9);
        all.push(given(points.len()));
        let plan = plan(Unit::Meter, entry.name, all);
        let audited = audit::run(&original, Some(&descriptors), &plan, &mut audit::Silent).unwrap();
        let staged = staged(
            folder.path(),
            &*plan.schemes[0],
            &original,
            &descriptors,
            &plan,
            (&Key::from_seed(SEED), SEED),
        );
        assert!(audited.rows.iter().any(|row| row.recovered_percent[1] > 5.0), "{}", entry.name);
        assert_equal(entry.name, &audited.rows, &staged);
    }
}

struct Unseen;

impl Observer<2> for Unseen {
    fn cell(&mut self, _: &Cell<'_, 2>) {}
}

struct Rows(Vec<Row>);

impl audit::Watcher<2> for Rows {
    type OfItem = Unseen;

    fn begin(&mut self) -> Unseen {
        Unseen
    }

    fn item(&mut self, _: &str, rows: &[Row], _: Unseen) {
        self.0.extend_from_slice(rows);
    }
}

fn keypoints(seed: u64, n: usize) -> (Original<2>, Descriptors) {
    let mut draws = Draws::new(seed, Stage::Synthetic, 1);
    let points: Vec<[f64; 2]> =
        (0..n).map(|_| [draws.between(0.0, 639.0), draws.between(0.0, 479.0)]).collect();
    let descriptors = descriptors(&points, 200.0);
    let bounds = Bounds::try_new([-0.5, -0.5], [639.5, 479.5]).unwrap();
    let set = PointSet::try_new(points, Unit::Pixel).unwrap();
    (Original::within(set, bounds).unwrap(), descriptors)
}

/// One image has fewer records than a list has entries, one has a single keypoint, which some
/// schemes do not release.
#[test]
fn many_images_in_one_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let images: Vec<(String, Original<2>, Descriptors)> = [(1, 90), (2, 5), (3, 1), (4, 70)]
        .map(|(seed, n)| {
            let (original, descriptors) = keypoints(seed, n);
            (format!("{seed}.png"), original, descriptors)
        })
        .into();
    let overlap = Named::parse("overlap").unwrap().with_k(9).of_dimension::<2>().unwrap();
    for entry in SCHEMES.iter().filter(|entry| entry.in_2d.is_some()) {
        let sources = vec![NeighborsBy::Oracle, NeighborsBy::Source(overlap.clone())];
        let mut plan = plan(Unit::Pixel, entry.name, sources);
        plan.solvers = vec![Arc::new(Builtin::Joint)];
        plan.oracle_noise = vec![Noise::Uniform];
        plan.inlier_ratios = vec![0.5];
        let of_audit = images.iter().map(|(name, original, descriptors)| {
            let (original, descriptors) = (original.clone(), Some(descriptors.clone()));
            Ok(audit::Item { name: name.clone(), original, descriptors })
        });
        let audited =
            audit::run_many::<2, unlift::Error>(of_audit, &plan, &mut audit::Silent).unwrap();
        for (row, source) in audited.rows.iter().zip(["oracle", "overlap"]) {
            let mut truth = OutputFile::create(&path("truth"), Access::Private).unwrap();
            let mut released = OutputFile::create(&path("released"), Access::Usual).unwrap();
            let mut truths = ImageWriter::start(&mut truth);
            let mut maps = ImageWriter::start(&mut released);
            for (name, original, descriptors) in &images {
                let key = key_of(&Key::from_seed(SEED), name);
                let hidden =
                    obfuscate(&*plan.schemes[0], original, Some(descriptors), &key).unwrap();
                truths.truth(name, original, &hidden.1).unwrap();
                maps.released(name, &hidden.0).unwrap();
            }
            truths.finish().unwrap();
            maps.finish().unwrap();
            truth.commit().unwrap();
            released.commit().unwrap();
            let (truth, released) = (path("truth"), path("released"));
            assert!(stage::has_images(&truth).unwrap());
            let mut truths = ImageFile::open(&truth, Kind::Truth).unwrap();
            let mut maps = ImageFile::open(&released, Kind::Released).unwrap();
            let mut output = OutputFile::create(&path("lists"), Access::Private).unwrap();
            let mut lists = ImageWriter::start(&mut output);
            while let Some(rows) = truths.next_image().unwrap() {
                let name = rows.name().to_owned();
                let (original, secret) = rows.truth().unwrap();
                if secret.n_slots() == 0 {
                    continue;
                }
                let map = maps.expect(&name, &truth).unwrap().released().unwrap();
                let made = match source {
                    "oracle" => {
                        let how = (Noise::Uniform, 0.5, plan.k);
                        oracle_lists(&original, &(map, secret), how, oracle_seed(SEED, &name))
                    }
                    _ => of_what_there_is(&*overlap, &map, SEED),
                };
                lists.neighborhoods(&name, &made.unwrap()).unwrap();
            }
            lists.finish().unwrap();
            output.commit().unwrap();
            let lists = path("lists");
            let mut lists = ImageFile::open(&lists, Kind::Neighborhoods).unwrap();
            let mut maps = ImageFile::open(&released, Kind::Released).unwrap();
            let mut output = OutputFile::create(&path("back"), Access::Private).unwrap();
            let mut back = ImageWriter::start(&mut output);
            while let Some(rows) = maps.next_image().unwrap() {
                let name = rows.name().to_owned();
                let map = rows.released().unwrap();
                let lists = lists.expect(&name, &released).unwrap();
                let lists = lists.neighborhoods(map.n_records(), 1).unwrap();
                let options = RecoverOptions { seed: SEED, ..Default::default() };
                back.recovered(&name, &recover(&map, &lists, &Builtin::Joint, &options).unwrap())
                    .unwrap();
            }
            back.finish().unwrap();
            output.commit().unwrap();
            let back = path("back");
            let mut back = ImageFile::open(&back, Kind::Recovered).unwrap();
            let mut truths = ImageFile::open(&truth, Kind::Truth).unwrap();
            let mut maps = ImageFile::open(&released, Kind::Released).unwrap();
            let mut pooled = Pooled::new(&plan.thresholds);
            while let Some(rows) = truths.next_image().unwrap() {
                let name = rows.name().to_owned();
                let (original, secret) = rows.truth().unwrap();
                if secret.n_slots() == 0 {
                    pooled.add_unreleased(&secret);
                    continue;
                }
                let map = maps.expect(&name, &truth).unwrap().released().unwrap();
                let back = back.expect(&name, &truth).unwrap().recovered().unwrap();
                pooled.add(&back, &original, &secret, Some(&map)).unwrap();
            }
            let staged = pooled.row().unwrap();
            assert_eq!(without_name(row), without_name(&staged), "{} {source}", entry.name);
            assert_eq!(row.distinct, staged.distinct, "{} {source}", entry.name);
        }
    }
}

#[test]
fn images() {
    let folder = tempfile::tempdir().unwrap();
    let (original, descriptors) = keypoints(5, 220);
    for entry in SCHEMES.iter().filter(|entry| entry.in_2d.is_some()) {
        let plan = plan(Unit::Pixel, entry.name, sources::<2>(9));
        let image = audit::Item {
            name: String::new(),
            original: original.clone(),
            descriptors: Some(descriptors.clone()),
        };
        let mut audited = Rows(Vec::new());
        audit::run_many::<2, unlift::Error>([Ok(image)], &plan, &mut audited).unwrap();
        // The seed of an image depends on its name: FNV-1a of no bytes.
        let name = 0xCBF2_9CE4_8422_2325;
        let key = Key::from_seed(SEED).of_item(Stage::Image, name);
        let owner = (&key, Draws::new(SEED, Stage::Image, name).bits());
        let staged =
            staged(folder.path(), &*plan.schemes[0], &original, &descriptors, &plan, owner);
        assert_equal(entry.name, &audited.0, &staged);
    }
}
