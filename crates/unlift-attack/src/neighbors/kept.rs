//! Lists for several maps that release the same descriptors, each in its own order.

use super::Neighborhoods;
use super::rows::{Ranked, Rows, by_content};
use crate::descriptors::Values;
use crate::released::Released;
use crate::{About, Descriptors, RecordId};

/// Lists that a source has made from the descriptors of a map alone.
///
/// Schemes with one slot per record release the same descriptors in random order, so such lists are equal up to the numbers of records.
#[derive(Clone, Debug)]
pub struct KeptLists {
    descriptors: Descriptors,
    /// All slots, by the content of their descriptors.
    slots: Vec<u32>,
    lists: Neighborhoods,
}

impl KeptLists {
    /// Keeps the lists of `released`; `None` for records with two slots or without descriptors.
    pub fn new<const D: usize>(released: &Released<D>, lists: &Neighborhoods) -> Option<Self> {
        let descriptors = released.descriptors().filter(|_| released.slots_per_record() == 1)?;
        let (descriptors, slots) = (descriptors.clone(), by_content(descriptors));
        Some(Self { descriptors, slots, lists: lists.clone() })
    }

    /// Returns the lists of another map; `None` if it does not release the same descriptors, one per record.
    pub fn of<const D: usize>(&self, released: &Released<D>) -> Option<Neighborhoods> {
        let descriptors = released.descriptors().filter(|_| released.slots_per_record() == 1)?;
        let slots = by_content(descriptors);
        let pairs = || self.slots.iter().zip(&slots);
        if self.slots.len() != slots.len()
            || !pairs().all(|(&a, &b)| are_equal((&self.descriptors, a), (descriptors, b)))
        {
            return None;
        }
        let (mut from, mut to) = (vec![0; slots.len()], vec![0; slots.len()]);
        for (&a, &b) in pairs() {
            (from[b as usize], to[a as usize]) = (a as usize, b);
        }
        let (mut offsets, mut records) = (vec![0], Vec::new());
        let mut scores = self.lists.scores().map(|_| Vec::new());
        for slot in from {
            records.extend(self.lists.of(slot).iter().map(|id| RecordId(to[id.index()])));
            if let (Some(scores), Some(row)) = (&mut scores, self.lists.scores_of(slot)) {
                scores.extend(row);
            }
            offsets.push(records.len() as u64);
        }
        let lists = Neighborhoods::try_new(offsets, records, scores, slots.len(), 1).ok()?;
        Some(lists.with_about(About { map: Some(released.fingerprint()), ..self.lists.about() }))
    }
}

/// Partners of the rows of a map by its descriptors alone: as if every row were a record.
#[derive(Clone, Debug)]
pub(super) struct Rankings {
    pub(super) descriptors: Descriptors,
    pub(super) slots: Vec<u32>,
    pub(super) n_best: usize,
    /// By untrained scores, in standard deviations.
    pub(super) untrained: Vec<Ranked>,
    /// By the mean log probabilities of both rows.
    pub(super) trained: Vec<Ranked>,
}

impl Rankings {
    pub(super) fn are_of(&self, rows: &Rows<'_>, n_best: usize) -> bool {
        let mut pairs = self.slots.iter().zip(&rows.slots);
        (self.n_best, self.slots.len()) == (n_best, rows.len())
            && pairs.all(|(&a, &b)| are_equal((&self.descriptors, a), (&rows.descriptors, b)))
    }
}

pub(super) fn are_equal((a, i): (&Descriptors, u32), (b, j): (&Descriptors, u32)) -> bool {
    let (i, j) = (a.range(i as usize), b.range(j as usize));
    match (a.values(), b.values()) {
        (Values::U8(a), Values::U8(b)) => a[i] == b[j],
        (Values::F32(a), Values::F32(b)) => a[i] == b[j],
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::KeptLists;
    use crate::descriptors::Values;
    use crate::neighbors::{KeptPairs, Overlap, Similarity, Source, described};
    use crate::released::{AxisPlanes, Obfuscation, Released};
    use crate::seed::{Draws, Stage};
    use crate::{Descriptors, Unit};

    const N: usize = 300;
    const SOURCES: [&dyn Source<3>; 2] = [&Similarity, &Overlap];

    /// Returns a map whose slot `at` has the descriptor `order[at]` of `rows`.
    fn map(rows: &[[u8; 128]], order: &[usize], slots_per_record: usize) -> Released<3> {
        let values = order.iter().flat_map(|&at| rows[at]).collect();
        described(Descriptors::try_new(Values::U8(values), 128).unwrap(), slots_per_record)
    }

    fn random() -> Vec<[u8; 128]> {
        let mut draws = Draws::new(5, Stage::Synthetic, 1);
        let mut rows = vec![[0u8; 128]; N];
        rows.iter_mut().flatten().for_each(|value| *value = draws.below(90) as u8);
        // Equal descriptors are ordered by their slots.
        (rows[7], rows[8]) = (rows[100], rows[100]);
        rows
    }

    #[test]
    fn lists_from_kept_pairs_equal_those_of_the_map_alone() {
        let rows = random();
        let all: Vec<usize> = (0..N).map(|at| at * 77 % N).collect();
        let without = |dropped: &[usize]| -> Vec<usize> {
            all.iter().copied().filter(|at| !dropped.contains(at)).collect()
        };
        for source in SOURCES {
            let mut kept = KeptPairs::default();
            for (order, slots, n_kept) in [
                (without(&[]), 1, N),
                (without(&[41]), 1, N),
                (without(&[8]), 1, N),
                (without(&[]), 2, N),
                (without(&[7, 200]), 2, N),
                (without(&(50..64).collect::<Vec<_>>()), 2, N),
                // Too many are absent: compared anew, and the whole map stays kept.
                (without(&(0..30).collect::<Vec<_>>()), 2, N),
                (without(&[]), 1, N),
            ] {
                let map = map(&rows, &order, slots);
                let lists = source.lists_keeping(&map, 12, 0, &mut kept).unwrap();
                assert_eq!(lists, source.lists(&map, 12, 0).unwrap(), "{} {n_kept}", source.name());
                assert_eq!(kept.compared[0].slots.len(), n_kept);
            }
        }
    }

    #[test]
    fn kept_lists_equal_those_of_the_map_alone() {
        let mut rows = random();
        let identity: Vec<usize> = (0..N).collect();
        let shuffled: Vec<usize> = (0..N).map(|at| at * 77 % N).collect();
        let [a, b] = [&identity, &shuffled].map(|order| map(&rows, order, 1));
        // Another family.
        let planes = Obfuscation::AxisPlanes(AxisPlanes::try_new(vec![0; N], &[1.0; N]).unwrap());
        let descriptors = b.descriptors().cloned();
        let b = Released::try_new(planes, 1, [0.0; 3], Unit::Meter, descriptors).unwrap();
        for source in SOURCES {
            let kept = KeptLists::new(&a, &source.lists(&a, 12, 0).unwrap()).unwrap();
            assert_eq!(kept.of(&b).unwrap(), source.lists(&b, 12, 0).unwrap(), "{}", source.name());
        }
        rows[3][5] += 1;
        let kept = KeptLists::new(&a, &Similarity.lists(&a, 12, 0).unwrap()).unwrap();
        assert_eq!(kept.of(&map(&rows, &shuffled, 1)), None);
    }
}
