//! The source `learned`: a network scores all pairs of descriptors of a set.

use std::sync::{Arc, OnceLock};

use unlift::descriptors::Values;
use unlift::neighbors::sources::SourceEntry;
use unlift::neighbors::{
    Needs, Neighborhoods, Overlap, Part, REACHES, Source, dense_among, scored,
};
use unlift::released::Released;
use unlift::{Descriptors, Error};

use crate::network::Network;
use crate::tensor::Tensor;

/// The model that is used unless another one is given.
const MODEL: &str = "neighbors-sift";

/// Sources that need a network, as users choose them: beside [`unlift::neighbors::sources::SOURCES`].
pub const SOURCES: &[SourceEntry] = &[SourceEntry {
    name: "learned",
    summary: "records that a network, trained on photos, takes for near ones; SIFT descriptors",
    in_2d: Some(|| Arc::new(Learned::default())),
    in_3d: Some(|| Arc::new(Learned::default())),
}];

/// The `k` records that a network finds nearest by their SIFT descriptors, or that a short walk over such records
/// reaches: [`scored`] by what `training/neighbors` trains. It is fed how well patches overlap, too.
///
/// Source: Sec. 5 and supplement E, where positions are not known either; pair scores, the loss and the walk are ours.
#[derive(Clone, Debug, Default)]
pub struct Learned {
    network: Option<Arc<Network>>,
}

impl Learned {
    /// With another network than the one that the program carries: inputs `descriptors` (n, 128) of unit length and
    /// `pairs` (3, n, n) of [`dense_among`], output `scores` (n, n).
    pub fn with(network: Arc<Network>) -> Self {
        Self { network: Some(network) }
    }

    fn network(&self) -> Result<&Network, Error> {
        static CARRIED: OnceLock<Result<Network, Error>> = OnceLock::new();
        match &self.network {
            Some(network) => Ok(network),
            None => CARRIED.get_or_init(|| Network::load(MODEL)).as_ref().map_err(Error::clone),
        }
    }
}

impl<const D: usize> Source<D> for Learned {
    fn name(&self) -> &str {
        "learned"
    }

    fn needs(&self) -> Needs {
        Needs::Descriptors
    }

    fn k(&self, _: &Released<D>) -> usize {
        // As of `overlap`: of an image's fewer keypoints only the first of a ranking are near.
        if D == 2 { 10 } else { 35 }
    }

    fn lists(&self, released: &Released<D>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        let network = self.network()?;
        scored(released, k, &|part| scores(network, part))
    }

    fn takes(&self, descriptors: &Descriptors) -> Result<(), Error> {
        Source::<D>::takes(&Overlap, descriptors)?;
        self.network().map(|_| ())
    }

    fn note(&self, n_slots: usize) -> Option<String> {
        // Sets are made of what `overlap` finds.
        Source::<D>::note(&Overlap, n_slots)
    }
}

fn scores(network: &Network, part: &Part) -> Result<Vec<f32>, Error> {
    let set = &part.descriptors;
    let n = set.len();
    let descriptors = Tensor::try_new(&[n, set.dim()], of_unit_length(set))?;
    let pairs =
        Tensor::try_new(&[REACHES, n, n], dense_among(set, part.usual.as_deref())?.into_scores())?;
    let [scores] = network.run(vec![("descriptors", descriptors), ("pairs", pairs)], ["scores"])?;
    Ok(scores.into_values())
}

fn of_unit_length(descriptors: &Descriptors) -> Vec<f32> {
    let mut values = match descriptors.values() {
        Values::U8(values) => values.iter().map(|&x| f32::from(x)).collect(),
        Values::F32(values) => values.clone(),
    };
    for row in values.chunks_exact_mut(descriptors.dim()) {
        let squares = row.iter().map(|&x| f64::from(x) * f64::from(x));
        let norm = squares.sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        row.iter_mut().for_each(|x| *x = (f64::from(*x) / norm) as f32);
    }
    values
}
