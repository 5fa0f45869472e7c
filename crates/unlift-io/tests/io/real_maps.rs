//! Tests real maps, if they are present: sums by pycolmap and NumPy, and neighborhoods from
//! descriptors.

use std::path::PathBuf;

use unlift::descriptors::Values;
use unlift::evaluate::{Reliability, evaluate, reliability};
use unlift::geometry::vector::median;
use unlift::neighbors::oracle;
use unlift::neighbors::sources::Named;
use unlift::obfuscate::{SCHEMES, SchemeOptions, obfuscate, scheme};
use unlift::recover::{Builtin, RecoverOptions, recover};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{PointSet, Unit};
use unlift_io::read;

use super::{close, shared, total};

fn dataset(name: &str) -> Option<PathBuf> {
    shared(&format!("data/{name}"))
}

/// Points, cameras, sums of ids, of points, of centers, and of bytes of descriptors.
type Totals = (usize, usize, u64, [f64; 3], [f64; 3], u64);

#[test]
fn real_maps_are_read_as_pycolmap_reads_them() {
    let kitchen: Totals = (
        21_149,
        114,
        457_420_110,
        [-14724.929303410438, -6123.789441610717, 51644.81699450455],
        [-43.05353627242874, -31.937187957432283, 90.64668314637804],
        88_317_746,
    );
    let castle: Totals = (
        6_224,
        11,
        19_826_437,
        [-19920.427404514652, 2174.7605237991306, 63821.610508611295],
        [-2.9480235564438795, 0.6448085497825612, 3.522803738595307],
        27_924_921,
    );
    for (name, (n, n_cameras, ids, positions, centers, bytes)) in
        [("redkitchen", kitchen), ("castle", castle)]
    {
        let Some(path) = dataset(name) else { continue };
        let input = read::open(&path).unwrap();
        assert_eq!((input.positions.len(), input.cameras.len()), (n, n_cameras));
        assert_eq!(input.ids.iter().sum::<u64>(), ids);
        // Sums of 10^4 doubles of size 10 in another order differ in the last bits only.
        close(total(&input.positions), positions, 1e-6);
        close(total(&input.cameras), centers, 1e-9);
        let descriptors = read::descriptors(&path.join("descriptors.bin"), &input).unwrap();
        assert_eq!((descriptors.len(), descriptors.dim()), (n, 128));
        let Values::U8(values) = descriptors.values() else { panic!("bytes expected") };
        assert_eq!(values.iter().map(|&byte| u64::from(byte)).sum::<u64>(), bytes);
    }
}

#[test]
fn descriptors_of_real_maps_are_read_and_name_neighbors() {
    let options = SchemeOptions { voxel: 1.0 };
    for (name, scheme_name, by, at_least) in [
        ("redkitchen-aliked", "olc", "similarity", 0.3),
        // Measured on olc: 5.1 % and 14.5 %. On pairs, the list of a slot is that of its descriptor
        // row.
        ("castle", "olc", "similarity", 0.045),
        ("castle", "olc", "overlap", 0.14),
        ("castle", "ppl", "overlap", 0.13),
    ] {
        let Some(path) = dataset(name) else { continue };
        let input = read::open(&path).unwrap();
        let descriptors = read::descriptors(&path.join("descriptors.bin"), &input).unwrap();
        let original = Original::new(PointSet::try_new(input.positions, Unit::Meter).unwrap());
        let search = oracle::search(&original).unwrap();
        let scheme = scheme(scheme_name).unwrap().of_dimension::<3>(&options).unwrap();
        let key = Key::from_seed(0);
        let (released, secret) = obfuscate(&*scheme, &original, Some(&descriptors), &key).unwrap();
        let rows = secret.by_descriptor_row();
        let near = oracle::TrueNeighbors::new(&search, &rows, 50).unwrap();
        let source = Named::parse(by).unwrap().with_k(20).of_dimension::<3>().unwrap();
        let lists = source.lists(&released, 20, 0).unwrap();
        let ratio = near.measured_inlier_ratio(&lists);
        assert!(ratio >= at_least, "{by} on {scheme_name} of {name}: {ratio}");
    }
}

#[test]
fn what_is_said_about_a_real_map_comes_true() {
    for (name, meters) in [("redkitchen", Some(0.10)), ("castle", None)] {
        let Some(path) = dataset(name) else { continue };
        let points = PointSet::try_new(read::open(&path).unwrap().positions, Unit::Meter).unwrap();
        let original = Original::new(points);
        let search = oracle::search(&original).unwrap();
        let typical = median(&mut search.kth_distances(50));
        let threshold = meters.unwrap_or(typical);
        let mut found: Option<Reliability> = None;
        let options = SchemeOptions { voxel: 5.0 * typical };
        // Probabilities under `ray-voxel` are known to be too high (docs/decisions/attack.md).
        let fitted = SCHEMES.iter().filter(|entry| entry.name != "ray-voxel");
        for scheme in fitted.filter_map(|entry| entry.of_dimension::<3>(&options)) {
            let (released, secret) =
                obfuscate(&*scheme, &original, None, &Key::from_seed(0)).unwrap();
            let near = oracle::TrueNeighbors::new(&search, &secret, 50).unwrap();
            for ratio in [0.5, 0.1] {
                let lists = near.at_inlier_ratio(ratio, 0).unwrap();
                let options = RecoverOptions::default();
                let recovered = recover(&released, &lists, &Builtin::Joint, &options).unwrap();
                let accuracy = evaluate(&recovered, &original, &secret).unwrap();
                let one = reliability(&recovered, &accuracy, threshold).unwrap();
                match &mut found {
                    Some(all) => all.merge(&one),
                    None => found = Some(one),
                }
            }
        }
        let found = found.unwrap();
        let (mut off, mut points) = (0.0, 0.0);
        for bin in &found.bins {
            let (said, was) = (bin.predicted().unwrap(), bin.observed().unwrap());
            off += bin.n as f64 * (said - was).abs();
            points += bin.n as f64;
            // From 0.8 on, where most points are, stated probabilities are too low (measured: by 0.029 to 0.117). Below, they are too
            // high by 0.064 at most and too low by 0.159.
            let bounds = if said > 0.8 { 0.0..=0.13 } else { -0.07..=0.17 };
            assert!(bounds.contains(&(was - said)), "{name}: said {said:.3}, was {was:.3}");
        }
        // Measured: 0.063 and 0.054.
        assert!(off / points <= 0.07, "{name}: off by {:.3} in the mean", off / points);
    }
}
