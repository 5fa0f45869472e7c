//! The source `learned` with the embedded networks.

use std::env;
use std::process::Command;

use rayon::prelude::*;
use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::oracle::{self, TrueNeighbors};
use unlift::neighbors::{Overlap, Similarity, Source};
use unlift::obfuscate::{obfuscate, olc, ppl};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_testkit::{described_map, source_laws};
use unlift_vision::features::{Extraction, Extractor};
use unlift_vision::network::Learned;

use crate::shared;

/// Hides points on a line that have these descriptors.
fn line(descriptors: &Descriptors) -> Released<3> {
    let points = (0..descriptors.len()).map(|at| [at as f64, (at % 7) as f64, 0.0]).collect();
    let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
    obfuscate(&olc::ENTRY, &original, Some(descriptors), &Key::from_seed(1)).unwrap().0
}

/// Descriptors of `dim` floats that change slowly along a line of points.
fn slow_floats(n: usize, dim: usize) -> Descriptors {
    let value =
        |at: usize, c: usize| libm::sin(at as f64 / 40.0 * (1 + c % 7) as f64 + c as f64) as f32;
    let values = (0..n).flat_map(|at| (0..dim).map(move |c| value(at, c))).collect();
    Descriptors::try_new(Values::F32(values), dim).unwrap()
}

#[test]
fn the_laws_of_sources_hold_for_every_kind_of_descriptors() {
    let floats = line(&slow_floats(300, 128));
    for released in [described_map(&olc::ENTRY, 300).1, described_map(&ppl::ENTRY, 300).1, floats] {
        source_laws(&Learned, &released);
    }
}

/// A map large enough to be split into sets.
#[test]
fn a_blank_descriptor_is_near_none_and_spoils_nothing() {
    let byte = |at: usize, bin: usize| match at {
        5 => 0,
        _ => (60.0 + 50.0 * libm::sin(at as f64 / 90.0 * (1 + bin % 9) as f64 + bin as f64)) as u8,
    };
    let bytes = (0..3200).flat_map(|at| (0..128).map(move |bin| byte(at, bin))).collect();
    let descriptors = Descriptors::try_new(Values::U8(bytes), 128).unwrap();
    let lists = Learned.lists(&line(&descriptors), 5, 0).unwrap();
    assert_eq!(lists.longest(), 5);
}

#[test]
fn descriptors_without_a_network_are_refused() {
    let takes = |dim| {
        let result = Source::<3>::takes(&Learned, &slow_floats(5, dim));
        result.map_err(|error| error.to_string())
    };
    assert_eq!(
        takes(64).unwrap_err(),
        "learned: expected descriptors of SIFT (128 values, none negative), ALIKED (128 floats) or SuperPoint \
         (256 floats), found 64 floats"
    );
    let message = takes(256).unwrap_err();
    assert!(message.starts_with("neighbors-superpoint.onnx: expected"), "{message}");
    assert_eq!(takes(128), Ok(()));
}

/// Several tasks of one pool request the network at the same time. If a thread waited for rten's
/// pool, it could start the next task, which needs the network that the thread is loading: a
/// deadlock. The test runs in its own process, where the network is not loaded yet.
#[test]
fn many_maps_may_request_the_network_at_once() {
    const ALONE: &str = "UNLIFT_TEST_ALONE";
    if env::var_os(ALONE).is_none() {
        let mut alone = Command::new(env::current_exe().unwrap());
        alone.args(["--exact", "learned::many_maps_may_request_the_network_at_once"]);
        let output = alone.env(ALONE, "1").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        return;
    }
    let maps: Vec<_> = (0..6).map(|at| described_map(&olc::ENTRY, 60 + at).1).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let lists = |map: &Released<3>| Learned.lists(map, 5, 0);
    let together: Vec<_> = pool.install(|| maps.par_iter().map(lists).collect());
    for (lists, map) in together.iter().zip(&maps) {
        assert_eq!(lists.as_ref(), Learned.lists(map, 5, 0).as_ref());
    }
}

/// The inlier ratio among the first 20 entries of every list, on a photo outside the training data.
#[test]
fn the_network_names_more_neighbors_than_its_inputs_do() {
    const K: usize = 20;
    let Some(photo) = shared("data/redkitchen/images/frame-000500.color.jpg") else { return };
    let aliked = Extraction { min_score: 0.02, ..Extraction::ALIKED };
    let kinds: [(_, &dyn Source<2>, f64); 2] =
        [(Extraction::SIFT, &Overlap, 0.03), (aliked, &Similarity, 0.2)];
    for (extraction, plain, gain) in kinds {
        let photo = Extractor::try_new(&extraction).unwrap().read(&photo).unwrap();
        let points = photo.keypoints.iter().map(|place| place.map(f64::from)).collect();
        let points = PointSet::try_new(points, Unit::Pixel).unwrap();
        let bounds = Bounds::try_new([-0.5; 2], photo.size.map(|side| side as f64 - 0.5)).unwrap();
        let original = Original::within(points, bounds).unwrap();
        let descriptors = Descriptors::try_new(photo.descriptors, 128).unwrap();
        let key = Key::from_seed(1);
        let (released, secret) =
            obfuscate(&olc::LINES2D, &original, Some(&descriptors), &key).unwrap();
        let search = oracle::search(&original).unwrap();
        let near = TrueNeighbors::new(&search, &secret, K).unwrap();
        let ratio = |source: &dyn Source<2>| {
            near.measured_inlier_ratio(&source.lists(&released, K, 0).unwrap())
        };
        let (learned, plain) = (ratio(&Learned), (ratio(plain), plain.name()));
        assert!(learned > plain.0 + gain, "learned {learned:.3}, {} {:.3}", plain.1, plain.0);
    }
}
