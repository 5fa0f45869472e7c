//! Released maps reveal nothing about their key, unless the key comes from an integer.

use unlift::obfuscate::obfuscate;
use unlift::obfuscate::olc::Olc;
use unlift::released::{Obfuscation, Released};
use unlift::seed::{Key, Stage};
use unlift::truth::{Original, Secret};
use unlift::{PointSet, Unit};

use crate::maps::*;

fn olc(key: &Key, n: usize) -> (Released<3>, Secret) {
    let points = PointSet::try_new(room(4, n), Unit::Meter).unwrap();
    obfuscate(&Olc, &Original::new(points), None, key).unwrap()
}

/// Guesses integer keys: the line of the first file row confirms a guess, which reveals the order
/// of the records. Returns the file row of every record.
fn undone(released: &Released<3>, guesses: u64) -> Option<Vec<u32>> {
    let Obfuscation::Lines(lines) = released.obfuscation() else { panic!("olc gives lines") };
    let is_released = |direction: [f64; 3]| {
        // Lines have no orientation, and released numbers are rounded to `f32`.
        let off = |d: &[f32; 3], sense: f64| {
            (0..3).map(|c| (f64::from(d[c]) - sense * direction[c]).abs()).fold(0.0, f64::max)
        };
        lines.direction().iter().any(|d| off(d, 1.0).min(off(d, -1.0)) < 1e-6)
    };
    let key = (0..guesses)
        .map(Key::from_seed)
        .find(|key| is_released(key.draws(Stage::Scheme, 0).direction()))?;
    Some(key.draws(Stage::Shuffle, 0).permutation(released.n_records()))
}

#[test]
fn a_small_integer_is_guessed_and_a_fresh_key_is_not() {
    let (released, secret) = olc(&Key::from_seed(321), 500);
    let rows = undone(&released, 400).expect("the integer is among the guesses");
    assert!(secret.hidden().iter().map(|id| id.0).eq(rows));
    let (released, _) = olc(&Key::fresh().unwrap(), 500);
    assert!(undone(&released, 400).is_none());
}
