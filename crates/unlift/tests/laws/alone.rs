//! Properties of attacks on the records alone, in addition to those of degenerate maps.

use unlift::neighbors::geometric;

use crate::maps::*;

const ALONE: [Builtin; 2] = [Builtin::Density, Builtin::Tomography];

fn alone<const D: usize>(released: &Released<D>, solver: Builtin) -> Recovered<D> {
    let lists = Neighborhoods::empty(released.n_slots());
    solve(released, &lists, (solver, RecoverOptions::default()))
}

/// Returns a furnished room, denser than in other property tests, because these attacks depend on
/// density.
fn furnished(n: usize) -> Vec<[f64; 3]> {
    synthetic::room(1, n).points
}

/// Returns the percentage of points within `reach`. The two positions of a paired line are compared
/// as a set.
fn percent_within(hidden: &Hidden<3>, recovered: &Recovered<3>, reach: f64) -> f64 {
    let about = About { order: RowOrder::Slots, ..recovered.about() };
    let (recovered, per) = (recovered.clone().with_about(about), hidden.secret.slots_per_record());
    let hits = |secret: &Secret| -> Vec<usize> {
        let accuracy = evaluate(&recovered, &hidden.original, secret).unwrap();
        let hits = |of: &[f64]| of.iter().filter(|error| **error <= reach).count();
        accuracy.errors().chunks(per).map(hits).collect()
    };
    let crossed = hits(&hidden.secret.exchanged(|_| per == 2));
    let best = hits(&hidden.secret).into_iter().zip(crossed).map(|(a, b)| a.max(b));
    100.0 * best.sum::<usize>() as f64 / hidden.secret.n_slots() as f64
}

/// Floors are shares within 25 cm, at most two points below the measured ones. No attack on
/// candidates is published, so none is tested.
#[test]
fn a_room_comes_back_from_its_records() {
    let floors = [
        ("olc", Some(59.8), 70.6),
        ("ppl", Some(55.4), 65.5),
        ("ray", Some(32.0), 37.7),
        ("cp", None, 29.2),
    ];
    let points = furnished(4000);
    for (name, published, ours) in floors {
        let hidden = hide(entry(name), &points, 1);
        for (solver, least) in [(Builtin::Density, published), (Builtin::Tomography, Some(ours))] {
            let recovered = alone(&hidden.released, solver);
            let Some(least) = least else {
                let lost = recovered.status().iter().all(|&status| status == Status::NoSupport);
                assert!(lost, "{name}, {solver:?}: a position from nowhere");
                continue;
            };
            let percent = percent_within(&hidden, &recovered, 0.25);
            assert!(percent >= least, "{name}, {solver:?}: {percent}");
        }
    }
}

/// A map in other units has the same shares.
#[test]
fn a_scaled_map_has_the_same_shares() {
    let points = furnished(1500);
    let scaled: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| 7.3 * x)).collect();
    for name in ["olc", "ppl", "ray", "cp"] {
        for solver in ALONE {
            let percent = |points: &[[f64; 3]], scale: f64| {
                let hidden = hide(entry(name), points, 1);
                percent_within(&hidden, &alone(&hidden.released, solver), 0.25 * scale)
            };
            let (here, there) = (percent(&points, 1.0), percent(&scaled, 7.3));
            // Records are rounded to `f32` after scaling, so a sample on the border of two voxels
            // may change sides. The tolerance is two of 1,500 points; measured: 0.
            assert!((here - there).abs() <= 0.14, "{name}, {solver:?}: {here} and {there}");
        }
    }
}

/// Records in another order give the same positions in that order.
#[test]
fn permuted_records_give_permuted_positions() {
    let released = hide::<3>(entry("olc"), &furnished(1000), 1).released;
    let order = Draws::new(1, Stage::Shuffle, 9).permutation(1000);
    let permuted = released_of(&released, released.obfuscation().select(&order));
    for solver in ALONE {
        let bits = |recovered: Recovered<3>| -> Vec<[u32; 3]> {
            recovered.positions().iter().map(|x| x.map(f32::to_bits)).collect()
        };
        let [plain, permuted] = [&released, &permuted].map(|map| bits(alone(map, solver)));
        assert!(order.iter().map(|&row| plain[row as usize]).eq(permuted), "{solver:?}");
    }
}

/// Lists contain far more neighbors than by chance, are full, and exclude rays of the same center.
#[test]
fn geometric_lists_hold_neighbors() {
    let points = furnished(3000);
    for (name, least) in [("olc", 0.42), ("ppl", 0.37), ("ray", 0.14), ("cp", 0.112)] {
        let hidden = hide(entry(name), &points, 1);
        let lists = geometric(&hidden.released, 20).unwrap();
        let ratio = hidden.near(20).measured_inlier_ratio(&lists);
        assert!(ratio >= least, "{name}: {ratio}, {} by chance", 20.0 / 3000.0);
        let full = (0..lists.n_slots()).filter(|&slot| lists.of(slot).len() == 20).count();
        assert!(full as f64 >= 0.95 * lists.n_slots() as f64, "{name}: {full} full lists");
        if let Obfuscation::Rays(rays) = hidden.released.obfuscation() {
            let center = rays.center();
            let other =
                |slot: usize| lists.of(slot).iter().all(|r| center[r.index()] != center[slot]);
            assert!((0..lists.n_slots()).all(other));
        }
    }
}

#[test]
fn where_records_alone_tell_nothing_the_error_says_so() {
    let planes = hide::<3>(entry("plane"), &furnished(200), 1).released;
    let flat = hide::<2>(entry("lines2d"), &room(1, 100), 1).released;
    for (error, line) in [
        (geometric(&planes, 5).unwrap_err(), "lines, rays or axis candidates, found planes"),
        (geometric(&flat, 5).unwrap_err(), "a map in three dimensions, found 2"),
    ] {
        assert_eq!(error.to_string(), format!("geometric neighborhoods: expected {line}"));
    }
    for solver in ALONE {
        assert!(alone(&planes, solver).status().iter().all(|&s| s == Status::NoSupport));
    }
}
