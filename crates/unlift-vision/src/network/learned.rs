//! The source `learned`: a network scores all pairs of descriptors of a set.

use std::sync::{Arc, OnceLock};

use unlift::neighbors::sources::SourceEntry;
use unlift::neighbors::{
    DescriptorKind, KeptPairs, Needs, Neighborhoods, Overlap, Part, Similarity, Source, dense,
    scored,
};
use unlift::released::{Obfuscation, Released};
use unlift::{Descriptors, Error};

use super::{Network, Tensor};

const NAME: &str = "learned";

/// The sources that need a network, in addition to [`unlift::neighbors::sources::SOURCES`].
pub const SOURCES: &[SourceEntry] = &[SourceEntry {
    name: NAME,
    summary: "records that a network trained on photos scores as near; SIFT or ALIKED descriptors",
    in_2d: Some(|| Arc::new(Learned)),
    in_3d: Some(|| Arc::new(Learned)),
}];

/// Lists the `k` records that a network scores highest by their descriptors, directly or over a
/// short walk: [`scored`] with a network of `training/neighbors`. Its inputs include training-free
/// scores: overlap of patches (SIFT) or similarity of descriptors (learned ones).
///
/// The descriptors choose the network: SIFT, 128 floats that are not SIFT (taken for ALIKED), or
/// 256 floats (SuperPoint, whose network users train themselves).
///
/// Source: Sec. 5 and supplement D; pair scores, the loss and the walk are ours.
#[derive(Clone, Copy, Debug)]
pub struct Learned;

/// Weight of cosines of learned descriptors beside the network's scores, which find the nearest
/// twenty but do not order them (docs/decisions/sources.md).
const LIKENESS: f32 = 0.2;

fn network(descriptors: &Descriptors) -> Result<&'static Network, Error> {
    static LOADED: [OnceLock<Result<Network, Error>>; DescriptorKind::ALL.len()] =
        [const { OnceLock::new() }; DescriptorKind::ALL.len()];
    let kind = DescriptorKind::of(descriptors, NAME)?;
    let load = || Network::load(&format!("neighbors-{}", kind.name()));
    let loaded = LOADED[kind as usize].get_or_init(load);
    loaded.as_ref().map_err(Error::clone)
}

impl<const D: usize> Source<D> for Learned {
    fn name(&self) -> &str {
        NAME
    }

    fn needs(&self) -> Needs {
        Needs::DescriptorsAlone
    }

    fn k(&self, released: &Released<D>) -> usize {
        // Images have fewer keypoints, so only the first of a ranking are near. An arrangement of rays needs more edges.
        if D == 2 {
            let is_rays = matches!(released.obfuscation(), Obfuscation::Rays(_));
            return if is_rays { 10 } else { 7 };
        }
        match released.descriptors().map(|some| DescriptorKind::of(some, NAME)) {
            Some(Ok(DescriptorKind::Sift)) | None => Source::<D>::k(&Overlap, released),
            Some(_) => Source::<D>::k(&Similarity, released),
        }
    }

    fn lists(&self, released: &Released<D>, k: usize, seed: u64) -> Result<Neighborhoods, Error> {
        self.lists_keeping(released, k, seed, &mut KeptPairs::default())
    }

    fn lists_keeping(
        &self,
        released: &Released<D>,
        k: usize,
        _: u64,
        kept: &mut KeptPairs,
    ) -> Result<Neighborhoods, Error> {
        scored(released, k, &|part| scores(network(&part.descriptors)?, part), kept)
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        network(descriptors).map(|_| ())
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        // Large maps are split into sets with the training-free source.
        Source::<D>::note(&Overlap, n_slots)
    }
}

fn scores(network: &Network, part: &Part) -> Result<Vec<f32>, Error> {
    let set = &part.descriptors;
    let n = set.len();
    let descriptors = Tensor::try_new(&[n, set.dim()], of_unit_length(set))?;
    let pairs = dense(set, part.usual.as_deref())?;
    let reaches = pairs.len() / (n * n);
    let likeness = if reaches == 1 { pairs.clone() } else { Vec::new() };
    let pairs = Tensor::try_new(&[reaches, n, n], pairs)?;
    let [scores] = network.run(vec![("descriptors", descriptors), ("pairs", pairs)], ["scores"])?;
    if scores.shape() != [n, n] {
        let found = format!("{:?}", scores.shape());
        return Err(Error::new("learned neighbors", format!("scores of shape ({n}, {n})"), found));
    }
    let mut scores = scores.into_values();
    scores.iter_mut().zip(likeness).for_each(|(score, alike)| *score += LIKENESS * alike);
    Ok(scores)
}

fn of_unit_length(descriptors: &Descriptors) -> Vec<f32> {
    let dim = descriptors.dim();
    let mut values = vec![0.0; descriptors.len() * dim];
    for (at, row) in values.chunks_exact_mut(dim).enumerate() {
        descriptors.read_row(at, row);
        let squares = row.iter().map(|&x| f64::from(x) * f64::from(x));
        let norm = squares.sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        row.iter_mut().for_each(|x| *x = (f64::from(*x) / norm) as f32);
    }
    values
}
