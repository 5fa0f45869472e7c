//! The source `descriptors`: the best method for the given descriptors that needs no training.

use super::overlap::{Overlap, check, overlap};
use super::similarity::{Similarity, similarity};
use super::source::{Needs, Source};
use super::{Neighborhoods, compare};
use crate::released::Released;
use crate::{Descriptors, Error};

/// Uses [`overlap`] for SIFT descriptors and [`similarity`] for others.
#[derive(Clone, Copy, Debug)]
pub struct ByDescriptors;

/// Whether these are SIFT descriptors, whose patches can be compared.
fn are_patches<const D: usize>(released: &Released<D>) -> bool {
    released.descriptors().is_some_and(|descriptors| check(descriptors).is_ok())
}

impl<const D: usize> Source<D> for ByDescriptors {
    fn name(&self) -> &str {
        "descriptors"
    }

    fn needs(&self) -> Needs {
        Needs::Descriptors
    }

    fn k(&self, released: &Released<D>) -> usize {
        if are_patches(released) { Overlap.k(released) } else { Similarity.k(released) }
    }

    fn lists(&self, released: &Released<D>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        if are_patches(released) { overlap(released, k) } else { similarity(released, k) }
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        Source::<D>::takes(&Similarity, descriptors)
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        compare::note("descriptors", n_slots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unit;
    use crate::descriptors::Values;
    use crate::released::{Lines, Obfuscation};
    use crate::seed::{Draws, Stage};

    fn map(values: Values) -> Released<3> {
        let n = 200;
        let points: Vec<[f64; 3]> = (0..n).map(|i| [i as f64, 0.0, 0.0]).collect();
        let lines = Lines::through(&points, &vec![[0.0, 1.0, 0.5]; n]).unwrap();
        let descriptors = Descriptors::try_new(values, 128).unwrap();
        let obfuscation = Obfuscation::Lines(lines);
        Released::try_new(obfuscation, 1, [0.0; 3], Unit::Meter, Some(descriptors)).unwrap()
    }

    #[test]
    fn it_is_what_the_descriptors_allow() {
        let mut draws = Draws::new(5, Stage::Synthetic, 0);
        let sift: Vec<u8> = (0..200 * 128).map(|_| draws.below(90) as u8).collect();
        let signed = sift.iter().map(|&x| f32::from(x) - 45.0).collect();
        let (sift, learned) = (map(Values::U8(sift)), map(Values::F32(signed)));
        let lists = |map: &Released<3>| ByDescriptors.lists(map, 10, 0).unwrap();
        assert_eq!(lists(&sift), overlap(&sift, 10).unwrap());
        assert_eq!(lists(&learned), similarity(&learned, 10).unwrap());
        assert_ne!(lists(&sift), similarity(&sift, 10).unwrap());
        assert_eq!(ByDescriptors.k(&sift), Overlap.k(&sift));
        assert_eq!(ByDescriptors.k(&learned), Similarity.k(&learned));
    }
}
