//! Property tests of all built-in implementations, and of some with bugs.

use std::sync::Arc;

use unlift::descriptors::Values;
use unlift::guard::caught;
use unlift::neighbors::oracle::{Outliers, TrueNeighbors, search};
use unlift::neighbors::sources::SOURCES;
use unlift::neighbors::{Needs, Neighborhoods, Source};
use unlift::obfuscate::{
    Change, Changed, Entry, Lifted, LocalPoints, Protection, SCHEMES, Scheme, all, cp, olc, ppl,
    ray,
};
use unlift::recover::{Builtin, RecoverOptions, Recovered, Solver};
use unlift::released::{Lines, Obfuscation, Released};
use unlift::seed::{Draws, Key, Stage};
use unlift::{Descriptors, Error};
use unlift_testkit::{described_map, hide, room, scheme_laws, solver_laws, source_laws};

#[test]
fn our_schemes() {
    for entry in all() {
        match entry.dimensions() {
            2 => scheme_laws::<2>(entry),
            _ => scheme_laws::<3>(entry),
        }
    }
}

#[test]
fn our_sources() {
    let mut draws = Draws::new(1, Stage::Shapes, 0);
    let bytes = (0..200 * 128).map(|_| draws.below(120) as u8).collect();
    let public = Descriptors::try_new(Values::U8(bytes), 128).unwrap();
    let check = |(_, released, _): (_, Released<3>, _)| {
        let sources = SOURCES.iter().filter_map(|entry| entry.of_dimension::<3>());
        sources.for_each(|source| source_laws(&*source, &released));
    };
    [olc::ENTRY, ppl::ENTRY, ray::ENTRY, cp::ENTRY]
        .iter()
        .for_each(|of| check(described_map(of, 200)));
    for text in ["subspace:2:random", "subspace:4", "subspace:2:adversarial", "ldp:16,2,6"] {
        let protection = Protection::parse(text).unwrap().with_public(&public).unwrap();
        let scheme = Changed::new(Arc::new(olc::ENTRY), Change::Protection(protection));
        scheme_laws(&scheme);
        check(described_map(&scheme, 200));
    }
}

fn solvers_keep_the_laws<const D: usize>(scheme: &Entry) {
    let (original, released, secret) = hide::<D>(scheme, &room(11, 300), 1.0, 1).unwrap();
    let near = TrueNeighbors::new(&search(&original).unwrap(), &secret, 12).unwrap();
    let lists = near.lists(0.5, &Outliers::Uniform, 1).unwrap();
    Builtin::ALL.iter().for_each(|solver| solver_laws(solver, &released, &lists));
}

#[test]
fn our_solvers() {
    for entry in SCHEMES {
        match entry.dimensions() {
            2 => solvers_keep_the_laws::<2>(entry),
            _ => solvers_keep_the_laws::<3>(entry),
        }
    }
}

/// A solver, a scheme and a source with a bug each.
#[derive(Debug)]
struct Wrong;

impl Solver<3> for Wrong {
    fn name(&self) -> &str {
        "half"
    }

    fn recover(
        &self,
        released: &Released<3>,
        lists: &Neighborhoods,
        _: &RecoverOptions,
    ) -> Result<Recovered<3>, Error> {
        Recovered::from_positions(released, lists, &vec![[0.0; 3]; released.n_slots() / 2])
    }
}

impl Scheme<3> for Wrong {
    fn name(&self) -> &str {
        "beside"
    }

    fn lift(&self, points: &LocalPoints<'_, 3>, _: &Key) -> Result<Lifted<3>, Error> {
        let beside: Vec<_> = points.positions.iter().map(|&[x, y, z]| [x, y, z + 0.1]).collect();
        let lines = Lines::through(&beside, &vec![[1.0, 0.0, 0.0]; beside.len()])?;
        Ok(Lifted::one_each(Obfuscation::Lines(lines)))
    }
}

impl Source<3> for Wrong {
    fn name(&self) -> &str {
        "nameless"
    }

    fn needs(&self) -> Needs {
        Needs::Nothing
    }

    fn k(&self, _: &Released<3>) -> usize {
        1
    }

    fn lists(&self, released: &Released<3>, _: usize, _: u64) -> Result<Neighborhoods, Error> {
        Ok(Neighborhoods::empty(released.n_slots()))
    }
}

#[test]
fn bugs_are_found_out() {
    let (_, released, _) = described_map(&olc::ENTRY, 50);
    let lists = Neighborhoods::empty(50);
    for (found, bug) in [
        (caught(|| solver_laws(&Wrong, &released, &lists)), "expected 50, one per slot, found 25"),
        (caught(|| scheme_laws(&Wrong)), "off its record"),
        (caught(|| source_laws(&Wrong, &released)), "wrong map"),
    ] {
        assert!(found.is_err_and(|message| message.contains(bug)), "{bug}");
    }
}
