//! Maps, lists, plans and bytes for all tests, and the names that most of them use.

pub use std::sync::Arc;

pub use unlift::audit::{Item, Outcome, Plan, Row, Silent, run, run_many};
pub use unlift::descriptors::Values;
pub use unlift::evaluate::{Truth, distance_to_record, evaluate};
pub use unlift::geometry::frame::Bounds;
pub use unlift::geometry::knn::Knn;
pub use unlift::geometry::vector::{along, distance, dot, median, sub, widen};
pub use unlift::neighbors::Neighborhoods;
pub use unlift::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
pub use unlift::obfuscate::{Entry, Scheme, SchemeOptions, obfuscate};
pub use unlift::recover::{
    Builtin, Delta, RecoverOptions, Recovered, Solver, Status, Unknown, recover,
};
pub use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
pub use unlift::seed::{Draws, Key, Stage};
pub use unlift::truth::{Original, Secret};
pub use unlift::{
    About, Descriptors, Error, Fingerprint, PointSet, RecordId, RowOrder, Unit, synthetic,
};
pub use unlift_testkit::{on_threads, piles, room, uniform};

/// Returns `n` seeds, the same in every run. With `UNLIFT_RANDOM_TESTS=50`, 50 seeds that differ in every run; a failure prints them.
pub fn seeds(n: usize) -> Vec<u64> {
    let asked = std::env::var("UNLIFT_RANDOM_TESTS").ok().and_then(|n| n.parse().ok());
    let now = std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64;
    let mut draws = Draws::new(if asked.is_some() { now } else { 25 }, Stage::Synthetic, 0);
    let seeds = (0..asked.unwrap_or(n)).map(|_| draws.bits()).collect();
    println!("seeds {seeds:?}");
    seeds
}

/// A released map with its ground truth.
pub struct Hidden<const D: usize> {
    pub original: Original<D>,
    pub released: Released<D>,
    pub secret: Secret,
}

/// Returns points in meters.
pub fn original<const D: usize>(points: Vec<[f64; D]>) -> Original<D> {
    Original::new(PointSet::try_new(points, Unit::Meter).unwrap())
}

/// Returns the entry of a scheme.
pub fn entry(name: &str) -> &'static Entry {
    unlift::obfuscate::scheme(name).unwrap()
}

/// Returns a source of the registry.
pub fn source<const D: usize>(name: &str) -> Arc<dyn unlift::neighbors::Source<D>> {
    unlift::neighbors::sources::Named::parse(name).unwrap().of_dimension().unwrap()
}

/// Hides `points` with voxels of size `voxel`. In 2D they are keypoints of an image.
pub fn try_hide<const D: usize>(
    scheme: &Entry,
    points: &[[f64; D]],
    voxel: f64,
    seed: u64,
) -> Result<Hidden<D>, Error> {
    let scheme = scheme.of_dimension(&SchemeOptions { voxel }).expect("defined there");
    let (original, released, secret) = unlift_testkit::hide(&*scheme, points, voxel, seed)?;
    Ok(Hidden { original, released, secret })
}

/// Calls [`try_hide`] with half-meter voxels.
pub fn hide<const D: usize>(scheme: &Entry, points: &[[f64; D]], seed: u64) -> Hidden<D> {
    try_hide(scheme, points, 0.5, seed).unwrap()
}

impl<const D: usize> Hidden<D> {
    pub fn truth(&self) -> Truth<'_, D> {
        Truth { original: &self.original, released: &self.released, secret: &self.secret }
    }

    /// Returns the original of `slot`, relative to the released origin.
    pub fn local(&self, slot: usize) -> [f64; D] {
        let point = self.original.reveal().positions()[self.secret.hidden()[slot].index()];
        sub(&point, &self.released.origin())
    }

    /// Returns the true neighborhoods of size `k`.
    pub fn near(&self, k: usize) -> TrueNeighbors {
        let search = oracle::search(&self.original).unwrap();
        TrueNeighbors::new(&search, &self.secret, k).unwrap()
    }

    /// Returns lists of the oracle.
    pub fn lists(&self, k: usize, inlier_ratio: f64, seed: u64) -> Neighborhoods {
        self.near(k).lists(inlier_ratio, &Outliers::Uniform, seed).unwrap()
    }

    /// Returns lists of the oracle with outliers of a noise model.
    pub fn noisy_lists(
        &self,
        k: usize,
        (noise, inlier_ratio): (Noise, f64),
        seed: u64,
    ) -> Result<Neighborhoods, Error> {
        let (near, search) = (self.near(k), oracle::search(&self.original)?);
        let outliers = Outliers::new(noise, &near, &search, &self.secret, seed)?;
        near.lists(inlier_ratio, &outliers, seed)
    }

    /// Returns the given lists, row by row.
    pub fn lists_of(&self, rows: &[Vec<u32>]) -> Neighborhoods {
        lists_of(rows, self.released.n_records(), self.released.slots_per_record())
    }

    /// Returns lists of all records that hide at the place of a slot, if it has one.
    pub fn lists_by_place(&self, place: impl Fn(usize) -> Option<usize>) -> Vec<Vec<u32>> {
        let (n, per) = (self.released.n_slots(), self.released.slots_per_record());
        let place = |slot: usize| place(self.secret.hidden()[slot].index());
        let row = |slot: usize| {
            let same = |&s: &usize| place(slot).is_some() && place(s) == place(slot);
            let mut row: Vec<u32> = (0..n).filter(same).map(|s| (s / per) as u32).collect();
            row.retain(|&record| record as usize != slot / per);
            row.dedup();
            row
        };
        (0..n).map(row).collect()
    }

    /// Returns the distance of the position of `slot` to its original; NaN if it is lost.
    pub fn error(&self, recovered: &Recovered<D>, slot: usize) -> f64 {
        distance(&widen(&recovered.positions()[slot]), &self.local(slot))
    }

    /// Returns the percentage of slots that `recovered` places within `most`.
    pub fn percent_within(&self, recovered: &Recovered<D>, most: f64) -> f64 {
        evaluate(recovered, &self.original, &self.secret).unwrap().percent_within(most)
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

/// Returns lists in which every record lists all others.
pub fn everyone(n_records: usize, slots_per_record: usize) -> Neighborhoods {
    let others = |slot: usize| {
        (0..n_records as u32).filter(|&r| r as usize != slot / slots_per_record).collect()
    };
    let rows: Vec<_> = (0..n_records * slots_per_record).map(others).collect();
    lists_of(&rows, n_records, slots_per_record)
}

/// Returns uniformly random lists of `k` records.
pub fn random_lists<const D: usize>(hidden: &Hidden<D>, k: usize, seed: u64) -> Neighborhoods {
    let (n, per) = (hidden.released.n_records(), hidden.released.slots_per_record());
    let row = |slot: usize| {
        let order = Draws::new(seed, Stage::Synthetic, slot as u64).permutation(n);
        order.into_iter().filter(|&record| record as usize != slot / per).take(k).collect()
    };
    hidden.lists_of(&(0..hidden.released.n_slots()).map(row).collect::<Vec<_>>())
}

/// Returns a plan for these schemes (or all) and solvers, without attacks on records alone.
pub fn plan<const D: usize>(
    unit: Unit,
    schemes: &[&str],
    ratios: &[f64],
    solvers: &[Builtin],
) -> Plan<D> {
    let mut plan = Plan::new(unit);
    plan.schemes.retain(|scheme| schemes.is_empty() || schemes.contains(&scheme.name()));
    (plan.inlier_ratios, plan.records_alone) = (ratios.to_vec(), false);
    plan.solvers = Builtin::list(solvers);
    plan
}

/// Returns an image with keypoints, without descriptors.
pub fn image(name: &str, points: Vec<[f64; 2]>, size: [f64; 2]) -> Item<2> {
    let points = PointSet::try_new(points, Unit::Pixel).unwrap();
    let original = Original::within(points, Bounds::try_new([0.0; 2], size).unwrap()).unwrap();
    Item { name: name.to_owned(), original, descriptors: None }
}

/// Audits a map.
pub fn audit(original: &Original<3>, plan: &Plan<3>) -> Outcome {
    run(original, None, plan, &mut Silent).unwrap()
}

/// A solver with its options.
pub type Options = (Builtin, RecoverOptions);

/// Returns joint recovery with default options.
pub fn joint() -> Options {
    (Builtin::Joint, RecoverOptions::default())
}

/// Returns the solvers that read lists with each of these deltas.
pub fn options_with(deltas: &[Delta]) -> Vec<Options> {
    let of = |&solver| {
        let with = move |&delta| RecoverOptions { delta, seed: 3, ..RecoverOptions::default() };
        deltas.iter().map(move |delta| (solver, with(delta)))
    };
    Builtin::FROM_LISTS.iter().flat_map(of).collect()
}

/// Returns the solvers that read lists, with automatic and fixed delta.
pub fn all_options() -> Vec<Options> {
    options_with(&[Delta::Fixed(0.1), Delta::Auto])
}

/// Returns the attacks on the records alone.
pub fn alone_options() -> [Options; 2] {
    [Builtin::Density, Builtin::Tomography].map(|solver| (solver, RecoverOptions::default()))
}

/// Runs recovery, which must not fail.
pub fn solve<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    (solver, options): Options,
) -> Recovered<D> {
    recover(released, lists, &solver, &options).unwrap()
}

/// Returns random descriptors of `dim` values between -1 and 1.
pub fn random_descriptors(seed: u64, n: usize, dim: usize) -> Descriptors {
    let mut draws = Draws::new(seed, Stage::Synthetic, 0);
    let values = (0..n * dim).map(|_| draws.between(-1.0, 1.0) as f32).collect();
    Descriptors::try_new(Values::F32(values), dim).unwrap()
}

/// Returns the records, brought to normal form again; with draws, from another form of lines and another order of centers.
pub fn again<const D: usize>(
    records: &Obfuscation<D>,
    mut draws: Option<&mut Draws>,
) -> Obfuscation<D> {
    let rows = |of: &[[f32; D]]| of.iter().map(widen).collect::<Vec<_>>();
    match records {
        Obfuscation::Lines(lines) => {
            let (mut points, mut directions) = (rows(lines.foot()), rows(lines.direction()));
            for (point, direction) in points.iter_mut().zip(&mut directions) {
                let Some(draws) = &mut draws else { break };
                *point = along(point, draws.between(-3.0, 3.0), direction);
                let is_turned = draws.below(2) == 0;
                *direction = direction.map(|x| if is_turned { -x } else { x });
            }
            Obfuscation::Lines(Lines::through(&points, &directions).unwrap())
        }
        Obfuscation::Rays(rays) => {
            let (mut centers, mut center) = (rows(rays.centers()), rays.center().to_vec());
            let mut regions = rays.regions().map(<[_]>::to_vec);
            if draws.is_some() {
                centers.reverse();
                regions.iter_mut().for_each(|regions| regions.reverse());
                center.iter_mut().for_each(|at| *at = centers.len() as u8 - 1 - *at);
            }
            let again = Rays::try_new(&centers, center, &rows(rays.direction())).unwrap();
            Obfuscation::Rays(match regions {
                Some(regions) => again.with_regions(regions).unwrap(),
                None => again,
            })
        }
        Obfuscation::AxisPlanes(planes) => {
            let offset: Vec<f64> = planes.offset().iter().copied().map(f64::from).collect();
            let again = AxisPlanes::try_new(planes.axis().to_vec(), &offset);
            Obfuscation::AxisPlanes(again.unwrap())
        }
        Obfuscation::AxisCandidates(points) => {
            Obfuscation::AxisCandidates(AxisCandidates::try_new(&rows(points.position())).unwrap())
        }
    }
}

/// Returns the map of other records with the same frame.
pub fn released_of<const D: usize>(like: &Released<D>, records: Obfuscation<D>) -> Released<D> {
    let (per, origin, unit) = (like.slots_per_record(), like.origin(), like.unit());
    Released::try_new(records, per, origin, unit, None).unwrap().with_bounds(like.bounds())
}

/// Returns the fingerprint of records, which depends on every stored bit.
pub fn fingerprint<const D: usize>(records: Obfuscation<D>) -> Fingerprint {
    Released::try_new(records, 1, [0.0; D], Unit::Meter, None).unwrap().fingerprint()
}

/// Returns every bit of a recovered map.
pub fn recovered_bytes<const D: usize>(recovered: &Recovered<D>) -> Vec<u8> {
    let bits = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let mut bytes = recovered.delta().to_le_bytes().to_vec();
    bytes.extend(bits(recovered.positions().as_flattened()));
    bytes.extend(recovered.status().iter().map(|&status| status as u8));
    bytes.extend(recovered.support().iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(bits(recovered.evidence()));
    bytes.extend(recovered.axis().unwrap_or_default());
    bytes
}
