//! The source `learned`, from the network that the program carries.

use unlift::descriptors::Values;
use unlift::neighbors::Source;
use unlift::obfuscate::obfuscate;
use unlift::obfuscate::olc::Olc;
use unlift::obfuscate::ppl::Ppl;
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_nn::Learned;
use unlift_testkit::{described_map, source_laws};

#[test]
fn the_laws_hold() {
    for released in [described_map(&Olc, 300).1, described_map(&Ppl, 300).1] {
        source_laws(&Learned::default(), &released);
    }
}

/// A map that is cut into sets.
#[test]
fn a_blank_descriptor_is_near_none_and_spoils_nothing() {
    let n = 3200;
    let points: Vec<[f64; 3]> = (0..n).map(|at| [at as f64, (at % 7) as f64, 0.0]).collect();
    let byte = |at: usize, bin: usize| match at {
        5 => 0,
        _ => (60.0 + 50.0 * libm::sin(at as f64 / 90.0 * (1 + bin % 9) as f64 + bin as f64)) as u8,
    };
    let bytes = (0..n).flat_map(|at| (0..128).map(move |bin| byte(at, bin))).collect();
    let descriptors = Descriptors::try_new(Values::U8(bytes), 128).unwrap();
    let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
    let key = Key::from_seed(1);
    let (released, _) = obfuscate(&Olc, &original, Some(&descriptors), &key).unwrap();
    let lists = Learned::default().lists(&released, 5, 0).unwrap();
    assert_eq!(lists.longest(), 5);
}
