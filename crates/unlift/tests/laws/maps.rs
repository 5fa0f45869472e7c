//! Maps, lists and bytes for property tests.

use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;
use unlift::geometry::frame::Bounds;
use unlift::neighbors::Neighborhoods;
use unlift::neighbors::oracle::{self, TrueNeighbors};
use unlift::obfuscate::{Entry, SchemeOptions, obfuscate};
use unlift::recover::{Builtin, Delta, RecoverOptions, Recovered, recover};
use unlift::released::{Obfuscation, Released};
use unlift::seed::{Draws, Key, Stage};
use unlift::truth::{Original, Secret};
use unlift::{About, Error, PointSet, RecordId, RowOrder, Unit};
pub use unlift_testkit::{distance_to_record, dot, norm, piles, room, uniform};

const SEED: u64 = 25;

/// Returns the configuration of property tests: `n` cases, equal in every run.
///
/// With `UNLIFT_RANDOM_TESTS=1` cases differ in every run; `PROPTEST_CASES` sets their number and
/// `PROPTEST_RNG_SEED` their seed. A failure prints its arguments and writes no file.
pub fn cases(n: u32) -> ProptestConfig {
    let asked = ProptestConfig::default();
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let of_asked = is_set("UNLIFT_RANDOM_TESTS") || is_set("PROPTEST_RNG_SEED");
    ProptestConfig {
        cases: if is_set("PROPTEST_CASES") { asked.cases } else { n },
        rng_seed: if of_asked { asked.rng_seed } else { RngSeed::Fixed(SEED) },
        failure_persistence: None,
        max_shrink_iters: 0,
        ..asked
    }
}

/// A released map with its ground truth.
pub struct Hidden<const D: usize> {
    pub original: Original<D>,
    pub released: Released<D>,
    pub secret: Secret,
}

/// Returns image bounds around `points`, in whole voxels.
fn image<const D: usize>(points: &[[f64; D]], voxel: f64) -> Bounds<D> {
    let column = |c: usize| points.iter().map(move |p| p[c]);
    let low = |c: usize| column(c).fold(f64::INFINITY, f64::min).min(f64::MAX);
    let high = |c: usize| column(c).fold(f64::NEG_INFINITY, f64::max).max(f64::MIN);
    if points.is_empty() {
        return Bounds { low: [0.0; D], high: [voxel; D] };
    }
    Bounds {
        low: std::array::from_fn(|c| ((low(c) / voxel).floor() - 1.0) * voxel),
        high: std::array::from_fn(|c| ((high(c) / voxel).ceil() + 1.0) * voxel),
    }
}

/// Hides `points` with voxels of size `voxel`. In 2D they are keypoints of an image.
pub fn try_hide<const D: usize>(
    scheme: &Entry,
    points: &[[f64; D]],
    voxel: f64,
    seed: u64,
) -> Result<Hidden<D>, Error> {
    let set = PointSet::try_new(points.to_vec(), Unit::Meter)?;
    let original = match D {
        2 => Original::within(set, image(points, voxel))?,
        _ => Original::new(set),
    };
    let scheme = scheme.of_dimension(&SchemeOptions { voxel }).expect("defined there");
    let (released, secret) = obfuscate(&*scheme, &original, None, &Key::from_seed(seed))?;
    Ok(Hidden { original, released, secret })
}

/// Calls [`try_hide`] with half-meter voxels.
pub fn hide<const D: usize>(scheme: &Entry, points: &[[f64; D]], seed: u64) -> Hidden<D> {
    try_hide(scheme, points, 0.5, seed).unwrap()
}

impl<const D: usize> Hidden<D> {
    /// Returns the original of `slot`, relative to the released origin.
    pub fn local(&self, slot: usize) -> [f64; D] {
        let point = self.original.reveal().positions()[self.secret.hidden()[slot].index()];
        std::array::from_fn(|c| point[c] - self.released.origin()[c])
    }

    /// Returns the true neighborhoods of size `k`.
    pub fn near(&self, k: usize) -> TrueNeighbors {
        let search = oracle::search(&self.original).unwrap();
        TrueNeighbors::new(&search, &self.secret, self.released.slots_per_record(), k).unwrap()
    }

    /// Returns lists of the oracle.
    pub fn lists(&self, k: usize, inlier_ratio: f64, seed: u64) -> Neighborhoods {
        self.near(k).at_inlier_ratio(inlier_ratio, seed).unwrap()
    }

    /// Returns the given lists, row by row.
    pub fn lists_of(&self, rows: &[Vec<u32>]) -> Neighborhoods {
        lists_of(rows, self.released.n_records(), self.released.slots_per_record())
    }

    /// Returns the distance of `point` (relative to the origin) to the feasible set of `record`.
    pub fn distance(&self, record: usize, point: &[f64; D]) -> f64 {
        distance_to_record(self.released.obfuscation(), record, point)
    }
}

/// Returns the given lists, row by row, in any order.
pub fn lists_of(rows: &[Vec<u32>], n_records: usize, slots_per_record: usize) -> Neighborhoods {
    let mut offsets = vec![0];
    let mut records = Vec::new();
    for row in rows {
        records.extend(row.iter().map(|&record| RecordId(record)));
        offsets.push(records.len() as u64);
    }
    let lists = Neighborhoods::try_new(offsets, records, None, n_records, slots_per_record);
    lists.unwrap().with_about(About { map: None, order: RowOrder::Slots, ..About::default() })
}

/// Returns uniformly random lists of `k` records.
pub fn random_lists<const D: usize>(hidden: &Hidden<D>, k: usize, seed: u64) -> Neighborhoods {
    let (n, per) = (hidden.released.n_records(), hidden.released.slots_per_record());
    let row = |slot: usize| {
        let mut draws = Draws::new(seed, Stage::Synthetic, slot as u64);
        let mut row: Vec<u32> = Vec::new();
        while row.len() < k {
            let record = draws.below(n as u64) as u32;
            if record as usize != slot / per && !row.contains(&record) {
                row.push(record);
            }
        }
        row
    };
    hidden.lists_of(&(0..hidden.released.n_slots()).map(row).collect::<Vec<_>>())
}

/// A solver with its options.
pub type Options = (Builtin, RecoverOptions);

/// Returns joint recovery with default options.
pub fn joint() -> Options {
    (Builtin::Joint, RecoverOptions::default())
}

/// Returns the solvers that read lists, with automatic and fixed delta.
pub fn all_options() -> Vec<Options> {
    let mut options = Vec::new();
    for solver in Builtin::FROM_LISTS {
        for delta in [Delta::Fixed(0.1), Delta::Auto] {
            options.push((solver, RecoverOptions { delta, seed: 3, ..RecoverOptions::default() }));
        }
    }
    options
}

/// Runs recovery, which must not fail.
pub fn solve<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    (solver, options): Options,
) -> Recovered<D> {
    recover(released, lists, &solver, &options).unwrap()
}

fn push_rows<const D: usize>(bytes: &mut Vec<u8>, rows: &[[f32; D]]) {
    bytes.extend(rows.as_flattened().iter().flat_map(|x| x.to_bits().to_le_bytes()));
}

/// Returns every stored bit of a family of records.
pub fn record_bytes<const D: usize>(obfuscation: &Obfuscation<D>) -> Vec<u8> {
    let mut bytes = Vec::new();
    match obfuscation {
        Obfuscation::Lines(lines) => {
            push_rows(&mut bytes, lines.foot());
            push_rows(&mut bytes, lines.direction());
        }
        Obfuscation::Rays(rays) => {
            push_rows(&mut bytes, rays.centers());
            bytes.extend(rays.center());
            push_rows(&mut bytes, rays.direction());
        }
        Obfuscation::AxisPlanes(planes) => {
            bytes.extend(planes.axis());
            bytes.extend(planes.offset().iter().flat_map(|x| x.to_bits().to_le_bytes()));
        }
        Obfuscation::AxisCandidates(candidates) => push_rows(&mut bytes, candidates.position()),
    }
    bytes
}

/// Returns every bit of a released map, without descriptors.
pub fn released_bytes<const D: usize>(released: &Released<D>) -> Vec<u8> {
    let mut bytes = record_bytes(released.obfuscation());
    bytes.extend(released.origin().iter().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.push(released.slots_per_record() as u8);
    bytes
}

/// Returns every bit of a recovered map.
pub fn recovered_bytes<const D: usize>(recovered: &Recovered<D>) -> Vec<u8> {
    let mut bytes = recovered.delta().to_bits().to_le_bytes().to_vec();
    push_rows(&mut bytes, recovered.positions());
    bytes.extend(recovered.status().iter().map(|&status| status as u8));
    bytes.extend(recovered.support().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(recovered.evidence().iter().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.extend(recovered.axis().unwrap_or_default());
    bytes
}
