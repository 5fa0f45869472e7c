//! Properties of released maps: normal form, keys, decoys, and which truth belongs to a map. Others are in
//! `unlift_testkit::scheme_laws`.

use crate::maps::*;

fn normal_form_is_idempotent<const D: usize>(name: &str, scheme: &Entry, n: usize, seed: u64) {
    let released = hide::<D>(scheme, &room(seed, n), seed).released;
    let again = released_of(&released, again(released.obfuscation(), None));
    assert_eq!(released.fingerprint(), again.fingerprint(), "{name}: normal form is not stable");
}

#[test]
fn normal_form() {
    for (seed, n) in seeds(6).into_iter().zip([2, 30, 400, 900, 1400, 2000].into_iter().cycle()) {
        over_schemes!(normal_form_is_idempotent, n, seed);
    }
}

#[test]
fn a_truth_belongs_to_its_map_alone() {
    // Points in one place are equally near to all records up to rounding.
    let (points, together) = (room::<3>(64, 200), vec![[1.3, 0.7, 2.1]; 200]);
    let turned = original(points.iter().map(|p| [p[1], p[2], p[0]]).collect());
    for name in ["olc", "ppl", "ray", "plane", "cp"] {
        let hidden = hide(entry(name), &points, 6);
        let truth = hidden.truth();
        assert!(truth.belongs().is_ok(), "{name}");
        assert!(Truth { original: &turned, ..truth }.belongs().is_err(), "{name}");
        let inner = Bounds::try_new([0.0; 3], [1.0; 3]).unwrap();
        let cut = hidden.released.clone().with_bounds(Some(inner));
        let of_cut = hidden.secret.clone().with_map(Some(cut.fingerprint()));
        let error = Truth { released: &cut, secret: &of_cut, ..truth }.belongs().unwrap_err();
        let expected = "bounds: expected a box of all hidden points";
        assert!(error.to_string().starts_with(expected), "{error}");
        if !["ppl", "ray"].contains(&name) {
            assert!(hide(entry(name), &together, 6).truth().belongs().is_ok(), "{name}");
        }
    }
}

#[test]
fn true_neighbors_tell_decoys() {
    let points = synthetic::room(1, 600).points;
    let figures = |scheme: &str| {
        let hidden = hide(entry(scheme), &points, 0);
        hidden.truth().bearings(&hidden.lists(12, 1.0, 0))
    };
    let of_sphere = figures("sphere");
    let of = |name: &str| of_sphere.iter().find(|(known, _)| known == name).unwrap().1;
    assert!((of("real_bearings_percent") - 100.0 / 3.0).abs() < 0.2);
    // Twelve neighbors among 600 points cover a wider angle than the attack expects.
    assert!(of("decoys_area") > 0.75, "{of_sphere:?}");
    assert!(of("decoys_precision_percent") > 80.0, "{of_sphere:?}");
    assert!(of("decoys_recall_percent") > 60.0, "{of_sphere:?}");
    // Lines are no bearings.
    assert_eq!(figures("olc"), []);
}

/// Guesses integer keys, which the first line confirms. Returns the file row of every record.
fn undone(released: &Released<3>, guesses: u64) -> Option<Vec<u32>> {
    let Obfuscation::Lines(lines) = released.obfuscation() else { panic!("olc gives lines") };
    // Lines have no orientation, and released numbers are rounded to `f32`.
    let is_released = |direction: [f64; 3]| {
        let off = |d, sense| distance(&widen(d), &direction.map(|x| sense * x));
        lines.direction().iter().any(|d| off(d, 1.0).min(off(d, -1.0)) < 1e-6)
    };
    let key = (0..guesses)
        .map(Key::from_seed)
        .find(|key| is_released(key.draws(Stage::Scheme, 0).direction()))?;
    Some(key.draws(Stage::Shuffle, 0).permutation(released.n_records()))
}

#[test]
fn a_small_integer_is_guessed_and_a_fresh_key_is_not() {
    let olc = |key: &Key| {
        obfuscate(&unlift::obfuscate::olc::ENTRY, &original(room(4, 500)), None, key).unwrap()
    };
    let (released, secret) = olc(&Key::from_seed(321));
    let rows = undone(&released, 400).expect("the integer is among the guesses");
    assert!(secret.hidden().iter().map(|id| id.0).eq(rows));
    assert!(undone(&olc(&Key::fresh().unwrap()).0, 400).is_none());
}
