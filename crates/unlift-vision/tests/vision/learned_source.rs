//! The source `learned` with the embedded networks.

use unlift::descriptors::Values;
use unlift::neighbors::Source;
use unlift::obfuscate::olc::Olc;
use unlift::obfuscate::ppl::Ppl;
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{Descriptors, PointSet, Unit};
use unlift_testkit::{described_map, source_laws};
use unlift_vision::network::Learned;

#[test]
fn the_laws_hold() {
    for released in [described_map(&Olc, 300).1, described_map(&Ppl, 300).1] {
        source_laws(&Learned::default(), &released);
    }
}

/// A map large enough to be split into sets.
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

/// Descriptors of `dim` floats that change slowly along a line of points.
fn floats(n: usize, dim: usize) -> Descriptors {
    let value =
        |at: usize, c: usize| libm::sin(at as f64 / 40.0 * (1 + c % 7) as f64 + c as f64) as f32;
    let values = (0..n).flat_map(|at| (0..dim).map(move |c| value(at, c))).collect();
    Descriptors::try_new(Values::F32(values), dim).unwrap()
}

#[test]
fn the_laws_hold_of_learned_descriptors_too() {
    let points: Vec<[f64; 3]> = (0..300).map(|at| [at as f64, (at % 7) as f64, 0.0]).collect();
    let original = Original::new(PointSet::try_new(points, Unit::Meter).unwrap());
    let hide = |scheme: &dyn Scheme<3>| {
        obfuscate(scheme, &original, Some(&floats(300, 128)), &Key::from_seed(1)).unwrap().0
    };
    for released in [hide(&Olc), hide(&Ppl)] {
        source_laws(&Learned::default(), &released);
    }
}

#[test]
fn descriptors_without_a_network_are_refused() {
    let takes = |descriptors: &Descriptors| {
        let taken = Source::<3>::takes(&Learned::default(), descriptors);
        taken.map_err(|error| error.to_string())
    };
    assert_eq!(
        takes(&floats(5, 64)),
        Err("learned: expected descriptors of SIFT (128 values, none negative), ALIKED (128 floats) or SuperPoint \
             (256 floats), found 64 floats"
            .to_owned())
    );
    let message = takes(&floats(5, 256)).unwrap_err();
    assert!(message.starts_with("neighbors-superpoint.onnx: expected"), "{message}");
    assert_eq!(takes(&floats(5, 128)), Ok(()));
}
