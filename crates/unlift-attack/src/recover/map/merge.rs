//! Rows of edges: the list of a slot and those who name its record, merged.

use super::edges::{SCORE_CLASSES, Side};
use crate::RecordId;

/// The rows of one block, in a place that has room for all of them.
pub(super) struct Rows<'a> {
    pub(super) ends: &'a mut [u32],
    pub(super) class: &'a mut [u8],
    /// Edges so far.
    pub(super) n: usize,
}

impl Rows<'_> {
    /// Merges the `list` of a slot with `all` who name its record, of whom so many count at `most`; both are in ascending order. The
    /// entry at a place of the list has a class of scores.
    pub(super) fn add(
        &mut self,
        list: &[RecordId],
        all: &[(u32, u8)],
        slots_per_record: usize,
        most: usize,
        score_class: impl Fn(usize) -> u8,
    ) {
        // Slots are in random order: every so many of them are as good as any.
        let every = all.len().div_ceil(most).max(1);
        let n_reverse = all.len().div_ceil(every);
        let class = |side: Side, of_score: u8| (side as usize * SCORE_CLASSES) as u8 + of_score;
        let own = slots_per_record as u32;
        let room = self.n..self.n + list.len() + n_reverse;
        let (ends, classes) = (&mut self.ends[room.clone()], &mut self.class[room]);
        let mut to = 0;
        let mut put = |end: u32, class: u8, stays: bool| {
            (ends[to], classes[to]) = (end, class);
            to += usize::from(stays);
        };
        // Which of two lists goes on is anyone's guess: steps are added, not branched on.
        let (mut at, mut reverse, mut mutual) = (0, 0, u32::MAX);
        while at < list.len() && reverse < n_reverse {
            let (mine, (by, of_score)) = (list[at].0, all[reverse * every]);
            // One or two slots make a record.
            let theirs = by >> (own - 1);
            let (is_mine, is_theirs) = (mine <= theirs, theirs <= mine);
            let side = if is_theirs { Side::Mutual } else { Side::Forward };
            let of_mine = class(side, score_class(at));
            let of_theirs = class(Side::Reverse, of_score);
            let end = if is_mine { mine * own } else { by };
            // The other slot of a record that is mutual already says nothing new.
            put(end, if is_mine { of_mine } else { of_theirs }, is_mine | (theirs != mutual));
            mutual = if is_mine & is_theirs { theirs } else { mutual };
            at += usize::from(is_mine);
            reverse += usize::from(is_theirs);
        }
        for (at, record) in list.iter().enumerate().skip(at) {
            put(record.0 * own, class(Side::Forward, score_class(at)), true);
        }
        for &(by, of_score) in all.iter().step_by(every).skip(reverse) {
            put(by, class(Side::Reverse, of_score), by >> (own - 1) != mutual);
        }
        self.n += to;
    }
}
