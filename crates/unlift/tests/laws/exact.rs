//! Properties of exact constraints: fixed coordinates are correct, and no others move.

use unlift::obfuscate::scheme;
use unlift::recover::{Builtin, RecoverOptions, Recovered};
use unlift::released::Obfuscation;

use crate::maps::{Hidden, Options, hide, norm, recovered_bytes, room, solve};

const N: usize = 4000;
const K: usize = 20;

fn hidden(name: &str, scale: f64) -> Hidden<3> {
    let points: Vec<[f64; 3]> = room(5, N).iter().map(|p| p.map(|x| x * scale)).collect();
    let scheme = scheme(name).unwrap();
    crate::maps::try_hide(scheme, &points, 0.5 * scale, 5).unwrap()
}

fn options(exact_constraints: bool) -> Options {
    let options = RecoverOptions { exact_constraints, seed: 1, ..Default::default() };
    (Builtin::Joint, options)
}

/// Returns the share of slots within `most` of ground truth.
fn share(hidden: &Hidden<3>, recovered: &Recovered<3>, most: f64) -> f64 {
    let n = hidden.released.n_slots();
    let off = |slot: usize| {
        let (x, local) = (recovered.positions()[slot], hidden.local(slot));
        norm(&std::array::from_fn::<f64, 3, _>(|c| f64::from(x[c]) - local[c]))
    };
    (0..n).filter(|&slot| off(slot) <= most).count() as f64 / n as f64
}

#[test]
fn exchanged_coordinates_come_back_exactly_and_none_is_lost() {
    let hidden = hidden("cp", 1.0);
    let lists = hidden.lists(K, 1.0, 2);
    let with = solve(&hidden.released, &lists, options(true));
    let without = solve(&hidden.released, &lists, options(false));
    let exact = [share(&hidden, &without, 1e-3), share(&hidden, &with, 1e-3)];
    assert!(exact[1] > exact[0] + 0.04, "{exact:?}");
    for within in [0.1, 0.25] {
        let shares = [share(&hidden, &without, within), share(&hidden, &with, within)];
        assert!(shares[1] > shares[0] - 0.004, "within {within}: {shares:?}");
    }
    assert_eq!(with.status(), without.status());
    assert_eq!(with.axis(), without.axis());
}

/// If a slot takes a coordinate that another slot publishes on that axis, the other slot takes the
/// coordinate of this one.
#[test]
fn who_takes_a_coordinate_gives_its_own() {
    let hidden = hidden("cp", 1.0);
    let lists = hidden.lists(K, 1.0, 2);
    let with = solve(&hidden.released, &lists, options(true));
    let without = solve(&hidden.released, &lists, options(false));
    let Obfuscation::AxisCandidates(records) = hidden.released.obfuscation() else {
        panic!("cp releases candidates");
    };
    let (axis, n) = (with.axis().unwrap(), hidden.released.n_slots());
    let moved: Vec<usize> =
        (0..n).filter(|&s| with.positions()[s] != without.positions()[s]).collect();
    assert!(moved.len() > n / 20 && moved.len() < n);
    let value = |slot: usize| with.positions()[slot][usize::from(axis[slot])].to_bits();
    let gives = |slot: usize| records.position()[slot][usize::from(axis[slot])].to_bits();
    // All slots count: a slot whose estimate was exact already has not moved.
    let mut given: Vec<_> = (0..n).map(|s| (axis[s], gives(s), value(s))).collect();
    given.sort_unstable();
    let count = |sorted: &[(u8, u32, u32)], x: &(u8, u32, u32)| {
        sorted.partition_point(|y| y <= x) - sorted.partition_point(|y| y < x)
    };
    let mut taken: Vec<_> = moved.iter().map(|&s| (axis[s], value(s), gives(s))).collect();
    taken.retain(|&(_, value, gives)| value != gives);
    taken.sort_unstable();
    assert!(taken.len() > n / 20);
    for one in &taken {
        assert!(count(&taken, one) <= count(&given, one), "{one:?}");
    }
}

/// The grid's start is not published and is found from the estimates. Then no recovered point lies
/// clearly within a voxel of the other center.
#[test]
fn recovered_rays_end_in_voxels_of_their_center() {
    let hidden = hidden("ray-voxel", 1.0);
    let Obfuscation::Rays(rays) = hidden.released.obfuscation() else {
        panic!("ray-voxel releases rays");
    };
    let edge = rays.voxel().unwrap();
    let points = hidden.original.reveal().positions();
    let low: [f64; 3] = std::array::from_fn(|c| {
        let low = points.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min);
        low - hidden.released.origin()[c] - 0.5 * edge
    });
    // Voxel borders are found only as precisely as the estimates. Points within this share of a
    // voxel count as on the border.
    const SLACK: f64 = 0.03;
    let clearly_wrong = |recovered: &Recovered<3>| {
        let wrong = |slot: &usize| {
            let x = recovered.positions()[*slot].map(f64::from);
            let cell: [f64; 3] = std::array::from_fn(|c| (x[c] - low[c]) / edge);
            let inside = cell.iter().all(|t| (t - t.round()).abs() > SLACK);
            let parity = cell.iter().map(|t| t.floor()).sum::<f64>().rem_euclid(2.0);
            inside && parity as u8 != rays.center()[*slot]
        };
        (0..hidden.released.n_slots()).filter(wrong).count()
    };
    let lists = hidden.lists(K, 1.0, 2);
    let with = solve(&hidden.released, &lists, options(true));
    let without = solve(&hidden.released, &lists, options(false));
    assert!(clearly_wrong(&without) > N / 50);
    assert!(clearly_wrong(&with) == 0, "{} wrong", clearly_wrong(&with));
    for within in [0.1, 0.25] {
        let shares = [share(&hidden, &without, within), share(&hidden, &with, within)];
        assert!(shares[1] >= shares[0], "within {within}: {shares:?}");
    }
}

#[test]
fn threads_change_nothing_and_scale_hardly_anything() {
    for name in ["cp", "ray-voxel"] {
        let one = hidden(name, 1.0);
        let lists = one.lists(K, 1.0, 2);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| solve(&one.released, &lists, options(true)))
        };
        let found = run(1);
        assert!(recovered_bytes(&found) == recovered_bytes(&run(3)), "{name}");
        let other = hidden(name, 7.3);
        let scaled = solve(&other.released, &other.lists(K, 1.0, 2), options(true));
        for within in [1e-3, 0.1] {
            let shares = [share(&one, &found, within), share(&other, &scaled, 7.3 * within)];
            assert!((shares[0] - shares[1]).abs() < 0.01, "{name} within {within}: {shares:?}");
        }
    }
}

/// Without voxels there is no rule: rays with randomly chosen centers do not change.
#[test]
fn rays_without_voxels_stay_where_they_are() {
    let hidden = hide::<3>(scheme("ray").unwrap(), &room(5, 500), 5);
    let lists = hidden.lists(K, 1.0, 2);
    let with = solve(&hidden.released, &lists, options(true));
    assert!(
        recovered_bytes(&with) == recovered_bytes(&solve(&hidden.released, &lists, options(false)))
    );
}
