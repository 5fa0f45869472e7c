//! Properties of attacks on the records alone, in addition to those of degenerate maps. Rooms are furnished, because these attacks
//! depend on density.

use unlift::neighbors::geometric;

use crate::maps::*;

const ALONE: [Builtin; 2] = [Builtin::Density, Builtin::Tomography];

fn alone<const D: usize>(released: &Released<D>, solver: Builtin) -> Recovered<D> {
    let lists = Neighborhoods::empty(released.n_slots());
    solve(released, &lists, (solver, RecoverOptions::default()))
}

/// Floors are shares within 25 cm, at most two points below the measured ones.
#[test]
fn a_room_comes_back_from_its_records() {
    use Builtin::{Density, Tomography};
    let points = synthetic::room(1, 4000).points;
    for (name, solver, least) in [
        ("olc", Density, 59.8),
        ("olc", Tomography, 70.6),
        ("ppl", Density, 58.0),
        ("ppl", Tomography, 65.5),
        ("ray", Density, 32.0),
        ("ray", Tomography, 37.7),
        ("cp", Tomography, 29.2),
    ] {
        let hidden = hide(entry(name), &points, 1);
        let percent = hidden.percent_within(&alone(&hidden.released, solver), 0.25);
        assert!(percent >= least, "{name}, {solver:?}: {percent}");
    }
}

/// A map in other units has the same shares.
#[test]
fn a_scaled_map_has_the_same_shares() {
    let points = synthetic::room(1, 1500).points;
    let scaled: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| 7.3 * x)).collect();
    for name in ["olc", "ppl", "ray", "cp"] {
        for solver in ALONE {
            let percent = |points: &[[f64; 3]], scale: f64| {
                let hidden = hide(entry(name), points, 1);
                hidden.percent_within(&alone(&hidden.released, solver), 0.25 * scale)
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
    let released = hide::<3>(entry("olc"), &synthetic::room(1, 1000).points, 1).released;
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
    let points = synthetic::room(1, 3000).points;
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
    let planes = hide::<3>(entry("plane"), &synthetic::room(1, 200).points, 1).released;
    let flat = hide::<2>(entry("lines2d"), &room(1, 100), 1).released;
    for (error, line) in [
        (geometric(&planes, 5).unwrap_err(), "lines, rays or axis candidates, found planes"),
        (geometric(&flat, 5).unwrap_err(), "a map in three dimensions, found 2"),
    ] {
        assert_eq!(error.to_string(), format!("geometric neighborhoods: expected {line}"));
    }
    let candidates = hide::<3>(entry("cp"), &synthetic::room(1, 200).points, 1).released;
    let [density, tomography] = ALONE;
    for (map, solver) in [(&planes, density), (&planes, tomography), (&candidates, density)] {
        assert!(alone(map, solver).status().iter().all(|&s| s == Status::NoSupport));
    }
}
