//! The edges of some slots alone, as whoever holds a part of a map makes and keeps them.

use std::borrow::Cow;
use std::ops::Range;

use super::edge_rule::EdgeRule;
use super::edges::{Side, check_edge, record_of, side};
use super::graph::EdgeRows;
use super::merge::Rows;
use crate::neighbors::Neighborhoods;
use crate::{Error, RecordId};

/// Who lists whom about consecutive slots, in both directions: what a part of a map is solved by in rounds.
///
/// In columns, as an engine keeps them: per slot the other ends of its edges, ascending, and beside each a class (who
/// of the two names the other, and how high a source scores it).
#[derive(Clone, Debug, PartialEq)]
pub struct Edges {
    slots: Range<usize>,
    /// Records of the map, and slots of each.
    map: (usize, usize),
    /// Where the edges of each slot start; one more entry than there are slots.
    offsets: Vec<u64>,
    ends: Vec<u32>,
    class: Vec<u8>,
}

/// Entries of any lists that name records of a part: columns of equal length, in any order.
#[derive(Clone, Copy, Debug)]
pub struct NamedBy<'a> {
    /// The record that is named.
    pub records: &'a [u32],
    /// The slot whose list names it.
    pub slots: &'a [u32],
    /// How high, where lists have scores.
    pub scores: Option<&'a [f32]>,
}

impl Edges {
    /// Those of `slots`, from columns.
    ///
    /// # Errors
    /// When columns are not as long as each other or `offsets` say, rows are not ascending, or an end or a class is none in a map
    /// of so many records and slots per record.
    pub fn try_new(
        slots: Range<usize>,
        offsets: Vec<u64>,
        ends: Vec<u32>,
        class: Vec<u8>,
        map: (usize, usize),
    ) -> Result<Self, Error> {
        let wrong = |what: &str, expected: String, found: String| {
            Err(Error::new(format!("edges: {what}"), expected, found))
        };
        let n_slots = map.0.saturating_mul(map.1);
        if slots.start > slots.end || slots.end > n_slots || offsets.len() != slots.len() + 1 {
            let expected = format!("{} offsets within {n_slots} slots", slots.len() + 1);
            return wrong("slots", expected, format!("{slots:?}, {} offsets", offsets.len()));
        }
        let n = offsets[slots.len()];
        if offsets[0] != 0 || !offsets.is_sorted() || [ends.len(), class.len()] != [n as usize; 2] {
            let expected = format!("{n} ends and classes");
            return wrong("offsets", expected, format!("{} and {}", ends.len(), class.len()));
        }
        let mut all = ends.iter().copied().zip(class.iter().copied());
        all.try_for_each(|edge| check_edge(edge, map)).map_err(|error| error.within("edges"))?;
        let edges = Self { slots, map, offsets, ends, class };
        let ascends = |slot: usize| edges.rows().of(slot).0.windows(2).all(|w| w[0] < w[1]);
        match edges.slots.clone().find(|&slot| !ascends(slot)) {
            Some(slot) => wrong("ends", "ascending slots".into(), format!("others, slot {slot}")),
            None => Ok(edges),
        }
    }

    /// Those of `slots` (whole records) with these `lists` of theirs, and whoever names their records in `named_by`.
    ///
    /// # Errors
    /// When somebody names a record that is not of these slots, or twice, or is no slot.
    pub(crate) fn of_lists(
        lists: &Neighborhoods,
        slots: Range<usize>,
        named_by: NamedBy<'_>,
        rule: &EdgeRule,
        slots_per_record: usize,
    ) -> Result<Self, Error> {
        let records = slots.start / slots_per_record..slots.end / slots_per_record;
        let naming = Naming::new(named_by, records, lists.n_slots(), rule)?;
        let n_own = lists.offsets()[slots.end] - lists.offsets()[slots.start];
        let room = n_own as usize + slots_per_record * naming.by.len();
        let (mut ends, mut class) = (vec![0; room], vec![0; room]);
        let mut rows = Rows { ends: &mut ends, class: &mut class, n: 0 };
        let mut offsets = Vec::with_capacity(slots.len() + 1);
        offsets.push(0);
        for slot in slots.clone() {
            let scores = lists.scores_of(slot);
            let class = |at| rule.class_at(scores, at);
            let all = naming.of(record_of(slot, slots_per_record));
            rows.add(lists.of(slot), all, slots_per_record, rule.most, class);
            offsets.push(rows.n as u64);
        }
        let n = rows.n;
        ends.truncate(n);
        class.truncate(n);
        let map = (lists.n_slots() / slots_per_record, slots_per_record);
        Ok(Self { slots, map, offsets, ends, class })
    }

    /// The slots whose edges these are.
    pub fn slots(&self) -> Range<usize> {
        self.slots.clone()
    }

    /// Records of the map that they are of, and slots of each.
    pub fn map(&self) -> (usize, usize) {
        self.map
    }

    /// Where the edges of each slot start; one more entry than there are slots.
    pub fn offsets(&self) -> &[u64] {
        &self.offsets
    }

    /// The other ends, row by row.
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// The class of each.
    pub fn class(&self) -> &[u8] {
        &self.class
    }

    /// The rows as rounds read them.
    pub(crate) fn rows(&self) -> EdgeRows<'_> {
        EdgeRows::new(
            self.slots.start,
            &self.offsets,
            Cow::Borrowed(&self.ends),
            Cow::Borrowed(&self.class),
        )
    }

    /// The lists that joint recovery starts from: of both directions where records have one slot, else as they were given.
    ///
    /// # Errors
    /// When an end is no record.
    pub(crate) fn lists(&self) -> Result<Neighborhoods, Error> {
        let slots_per_record = self.map.1;
        let stays = |class: u8| slots_per_record == 1 || side(class) != Side::Reverse;
        let mut records = Vec::with_capacity(self.ends.len());
        let mut offsets = Vec::with_capacity(self.offsets.len());
        offsets.push(0);
        let rows = self.rows();
        for slot in self.slots() {
            let (ends, class) = rows.of(slot);
            let kept = ends.iter().zip(class).filter(|(_, class)| stays(**class));
            records.extend(
                kept.map(|(&end, _)| {
                    RecordId::from_index(record_of(end as usize, slots_per_record))
                }),
            );
            offsets.push(records.len() as u64);
        }
        Neighborhoods::of_slots(self.slots.start, &offsets, records, None, self.map)
    }
}

/// Who names each of some records.
struct Naming {
    records: Range<usize>,
    /// Where those that name each start; one more entry than there are records.
    starts: Vec<usize>,
    /// The slot that names it, and the class of its score; ascending for each record.
    by: Vec<(u32, u8)>,
}

impl Naming {
    fn new(
        NamedBy { records: named, slots, scores }: NamedBy<'_>,
        records: Range<usize>,
        n_slots: usize,
        rule: &EdgeRule,
    ) -> Result<Self, Error> {
        let lengths = [slots.len(), scores.map_or(slots.len(), <[f32]>::len)];
        if lengths != [named.len(); 2] {
            let expected = format!("columns of {}", named.len());
            return Err(Error::new("named by", expected, format!("{lengths:?}")));
        }
        if let Some(record) = named.iter().find(|&&record| !records.contains(&(record as usize))) {
            return Err(Error::new("named by", format!("records {records:?}"), record.to_string()));
        }
        if let Some(slot) = slots.iter().find(|&&slot| slot as usize >= n_slots) {
            return Err(Error::new("named by", format!("slots below {n_slots}"), slot.to_string()));
        }
        let mut starts = vec![0; records.len() + 1];
        named.iter().for_each(|&record| starts[record as usize - records.start + 1] += 1);
        for at in 1..starts.len() {
            starts[at] += starts[at - 1];
        }
        let mut next = starts.clone();
        let mut by = vec![(0, 0); named.len()];
        for (at, (&record, &slot)) in named.iter().zip(slots).enumerate() {
            let next = &mut next[record as usize - records.start];
            by[*next] = (slot, rule.class_at(scores, at));
            *next += 1;
        }
        for (record, row) in records.clone().zip(starts.windows(2)) {
            let by = &mut by[row[0]..row[1]];
            by.sort_unstable();
            if let Some(twice) = by.windows(2).find(|two| two[0].0 == two[1].0) {
                let found = format!("slot {} twice", twice[0].0);
                return Err(Error::new(
                    format!("named by: record {record}"),
                    "each slot once",
                    found,
                ));
            }
        }
        Ok(Self { records, starts, by })
    }

    /// Who names `record`, which is among them.
    fn of(&self, record: usize) -> &[(u32, u8)] {
        let at = record - self.records.start;
        &self.by[self.starts[at]..self.starts[at + 1]]
    }
}
