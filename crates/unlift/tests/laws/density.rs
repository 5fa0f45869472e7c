//! Properties of attacks on the records alone, in addition to those of degenerate maps.

use unlift::neighbors::{Neighborhoods, geometric};
use unlift::obfuscate::{Entry, scheme};
use unlift::recover::{Builtin, RecoverOptions, Recovered, Status};
use unlift::released::{Lines, Obfuscation, Released};
use unlift::seed::{Draws, Stage};

use crate::degenerate::statuses;
use crate::maps::*;

const ALONE: [Builtin; 2] = [Builtin::Density, Builtin::Tomography];

fn empty_lists<const D: usize>(released: &Released<D>) -> Neighborhoods {
    let rows = vec![Vec::new(); released.n_slots()];
    lists_of(&rows, released.n_records(), released.slots_per_record())
}

fn alone<const D: usize>(released: &Released<D>, solver: Builtin) -> Recovered<D> {
    solve(released, &empty_lists(released), (solver, RecoverOptions::default()))
}

/// Returns a furnished room, denser than in other property tests, because these attacks depend on
/// density.
fn furnished(n: usize) -> Vec<[f64; 3]> {
    unlift::synthetic::room(1, n).points
}

/// Returns the percentage of points within `reach`. The two positions of a paired line are compared
/// as a set.
fn percent_within(hidden: &Hidden<3>, recovered: &Recovered<3>, reach: f64) -> f64 {
    let off = |at: usize, slot: usize| {
        let point = hidden.original.reveal().positions()[hidden.secret.hidden()[slot].index()];
        recovered
            .position(at)
            .map_or(f64::INFINITY, |x| norm(&std::array::from_fn::<f64, 3, _>(|c| x[c] - point[c])))
    };
    let per = hidden.released.slots_per_record();
    let mut within = 0;
    for record in 0..hidden.released.n_records() {
        let hits = |order: &[usize]| {
            let slots = (0..per).map(|slot| off(record * per + order[slot], record * per + slot));
            slots.filter(|&off| off <= reach).count()
        };
        within += if per == 2 { hits(&[0, 1]).max(hits(&[1, 0])) } else { hits(&[0]) };
    }
    100.0 * within as f64 / hidden.released.n_slots() as f64
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
        let hidden = hide(scheme(name).unwrap(), &points, 1);
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
        let scheme = scheme(name).unwrap();
        let (one, other) = (hide(scheme, &points, 1), hide(scheme, &scaled, 1));
        for solver in ALONE {
            let one = percent_within(&one, &alone(&one.released, solver), 0.25);
            let other = percent_within(&other, &alone(&other.released, solver), 7.3 * 0.25);
            // Records are rounded to `f32` after scaling, so a sample on the border of two voxels
            // may change sides. The tolerance is two of 1,500 points; measured: 0.
            assert!((one - other).abs() <= 0.14, "{name}, {solver:?}: {one} and {other}");
        }
    }
}

/// Records in another order give the same positions in that order.
#[test]
fn permuted_records_give_permuted_positions() {
    let released = hide::<3>(scheme("olc").unwrap(), &furnished(1000), 1).released;
    let Obfuscation::Lines(lines) = released.obfuscation() else { panic!("lines") };
    let order = Draws::new(1, Stage::Shuffle, 9).permutation(lines.len());
    let rows = |of: &[[f32; 3]]| -> Vec<[f64; 3]> {
        order.iter().map(|&row| of[row as usize].map(f64::from)).collect()
    };
    let permuted = Lines::through(&rows(lines.foot()), &rows(lines.direction())).unwrap();
    let (origin, unit) = (released.origin(), released.unit());
    let permuted = Released::try_new(Obfuscation::Lines(permuted), 1, origin, unit, None).unwrap();
    for solver in ALONE {
        let (one, other) = (alone(&released, solver), alone(&permuted, solver));
        let bits = |x: [f32; 3]| x.map(f32::to_bits);
        let same = |(at, &row): (usize, &u32)| {
            bits(one.positions()[row as usize]) == bits(other.positions()[at])
        };
        assert!(order.iter().enumerate().all(same), "{solver:?}");
    }
}

/// Lists contain far more neighbors than by chance, are full, and exclude rays of the same center.
#[test]
fn geometric_lists_hold_neighbors() {
    let points = furnished(3000);
    for (name, least) in [("olc", 0.42), ("ppl", 0.37), ("ray", 0.14), ("cp", 0.112)] {
        let hidden = hide(scheme(name).unwrap(), &points, 1);
        let lists = geometric(&hidden.released, 20).unwrap();
        let ratio = hidden.near(20).measured_inlier_ratio(&lists);
        assert!(ratio >= least, "{name}: {ratio}, {} by chance", 20.0 / 3000.0);
        let full = (0..lists.n_slots()).filter(|&slot| lists.of(slot).len() == 20).count();
        assert!(full as f64 >= 0.95 * lists.n_slots() as f64, "{name}: {full} full lists");
        if let Obfuscation::Rays(rays) = hidden.released.obfuscation() {
            for slot in 0..lists.n_slots() {
                let own = rays.center()[slot];
                assert!(lists.of(slot).iter().all(|r| rays.center()[r.index()] != own));
            }
        }
    }
}

/// Maps that determine little or nothing: a status, never a NaN, never a panic.
fn odd_maps_are_answered<const D: usize>(name: &str, scheme: &Entry) {
    let far = [vec![[1e6; D]; 3], uniform(1, 60)].concat();
    let maps = [piles(3, 1, 40, 0.0), piles(3, 2, 40, 1e-7), uniform(3, 2), uniform(3, 9), far];
    for points in maps {
        let Ok(hidden) = try_hide::<D>(scheme, &points, 0.5, 1) else { continue };
        let options = ALONE.map(|solver| (solver, RecoverOptions::default()));
        statuses(name, &hidden.released, &empty_lists(&hidden.released), &options);
        if let Ok(lists) = geometric(&hidden.released, 5) {
            assert_eq!(lists.n_slots(), hidden.released.n_slots(), "{name}");
        }
    }
}

#[test]
fn density_of_odd_maps() {
    over_schemes!(odd_maps_are_answered);
    let parallel = Lines::through(&uniform::<3>(1, 50), &[[0.0, 0.6, 0.8]; 50]).unwrap();
    for lines in [parallel, Lines::through(&[], &[]).unwrap()] {
        let family = Obfuscation::Lines(lines);
        let released = Released::try_new(family, 1, [0.0; 3], unlift::Unit::Meter, None).unwrap();
        for solver in ALONE {
            alone(&released, solver);
        }
        assert!(geometric(&released, 5).unwrap().records().is_empty());
    }
}

#[test]
fn where_records_alone_tell_nothing_the_error_says_so() {
    let message = |name: &str| {
        let released = hide(scheme(name).unwrap(), &furnished(200), 1).released;
        geometric(&released, 5).unwrap_err().to_string()
    };
    assert_eq!(
        message("plane"),
        "geometric neighborhoods: expected lines, rays or axis candidates, found planes"
    );
    let flat = hide::<2>(scheme("lines2d").unwrap(), &room(1, 100), 1).released;
    assert_eq!(
        geometric(&flat, 5).unwrap_err().to_string(),
        "geometric neighborhoods: expected a map in three dimensions, found 2"
    );
    let planes = hide(scheme("plane").unwrap(), &furnished(200), 1).released;
    for solver in ALONE {
        assert!(alone(&planes, solver).status().iter().all(|&s| s == Status::NoSupport));
    }
}
