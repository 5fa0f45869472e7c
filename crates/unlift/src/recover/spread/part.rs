//! What whoever has the edges of some slots does in a round.

use std::ops::Range;

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::recover::checks::{check_anchors, check_lists};
use crate::recover::consensus::Consensus;
use crate::recover::joint::{News, Standing};
use crate::recover::learned::Model;
use crate::recover::map::edge_rule::EdgeRule;
use crate::recover::map::family::Family;
use crate::recover::map::graph::EdgeRows;
use crate::recover::map::lists::Listed;
use crate::recover::map::part_edges::{Edges, NamedBy};
use crate::recover::map::pieces::Pieces;
use crate::recover::map::with_pieces::WithPieces;
use crate::recover::options::Solver;
use crate::recover::pairs_of_descriptors::descriptor_rows;
use crate::recover::parts::Part;
use crate::recover::solve::{Moved, Solve};
use crate::released::Released;

impl<const D: usize> Model<D> {
    /// Who lists whom about `slots`, from `lists` with those of these slots, made by
    /// [`Neighborhoods::of_slots`], and from the entries of any lists that name their records.
    ///
    /// # Errors
    /// When the model is of another map or solver, `slots` end within a record or are not there, somebody names a record of other
    /// slots, or the model was made of lists with scores and these have none.
    pub fn edges(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        slots: Range<usize>,
        named_by: NamedBy<'_>,
    ) -> Result<Edges, Error> {
        let rule = self.rule_of_rounds(released)?;
        check_lists(released, lists)?;
        released.fingerprint().expect(lists.about().map)?;
        let per_record = released.slots_per_record();
        check_records(&slots, (released.n_records(), per_record))?;
        let has_scores = [lists.scores().is_some(), named_by.scores.is_some()];
        if rule.has_scores() && has_scores != [true; 2] {
            return Err(Error::new("scores", "some, as the model's lists have", "none"));
        }
        Edges::of_lists(lists, slots, named_by, rule, per_record)
    }

    /// Where the slots of `edges` are before the first round: what [`Task::solve`](crate::recover::Task::solve) says of them, and whose
    /// descriptor is whose.
    ///
    /// # Errors
    /// When the model or the edges are of another map or solver, or these end within a record.
    pub fn start_part(&self, released: &Released<D>, edges: &Edges) -> Result<Part<D>, Error> {
        let family = self.family_of_part(released, edges)?;
        let per_record = released.slots_per_record();
        let (slots, delta) = (edges.slots(), self.delta as f32);
        check_records(&slots, edges.map())?;
        let lists = edges.lists()?;
        let lists = Listed::Here(&lists);
        let records = slots.start / per_record..slots.end / per_record;
        let estimates = Consensus { family: &family, lists, delta }.solve(slots)?;
        Ok(Part { estimates, descriptor_row: descriptor_rows(released, lists, records)? })
    }

    /// Where those slots go whose turn it is and that have `edges` (others stay where they are): `standing` is what the lead [said](crate::recover::Lead::standing).
    ///
    /// # Errors
    /// When it is of another map, or the model or the edges are.
    pub fn move_part(
        &self,
        released: &Released<D>,
        edges: &Edges,
        standing: &[u8],
    ) -> Result<Vec<Moved<D>>, Error> {
        let standing = Standing::from_bytes(standing, released.n_slots())?;
        let family = self.family_of_part(released, edges)?;
        let delta = self.delta as f32;
        let rows = edges.rows();
        let moves = |&slot: &usize| standing.is_turn_of(slot) && !rows.of(slot).0.is_empty();
        let slots = edges.slots().filter(moves);
        let mut moved: Vec<Moved<D>> = slots.map(|slot| standing.unmoved(slot as u32)).collect();
        family.with_pieces(delta, Move { standing: &standing, rows, delta, moved: &mut moved });
        Ok(moved)
    }

    /// Whom the jumps of slots of `edges` concern, and how many: `news` is what the lead had to tell.
    ///
    /// # Errors
    /// When it is of another map, or the model or the edges are.
    pub fn tell_part(
        &self,
        released: &Released<D>,
        edges: &Edges,
        news: &[u8],
    ) -> Result<Vec<(u32, u32)>, Error> {
        let news = News::from_bytes(news, released.n_slots())?;
        let family = self.family_of_part(released, edges)?;
        Ok(family.with_pieces(self.delta as f32, Tell { news: &news, edges }))
    }

    /// The records of `released`, if the model is for rounds over them and the edges are of a map like it.
    fn family_of_part<'a>(
        &self,
        released: &'a Released<D>,
        edges: &Edges,
    ) -> Result<Family<'a, D>, Error> {
        let map = (released.n_records(), released.slots_per_record());
        if edges.map() != map {
            let found = format!("{:?}", edges.map());
            return Err(Error::new("edges: records, and slots of each", format!("{map:?}"), found));
        }
        self.family_of_rounds(released)
    }

    /// The records of `released`, if the model is for rounds over them.
    pub(super) fn family_of_rounds<'a>(
        &self,
        released: &'a Released<D>,
    ) -> Result<Family<'a, D>, Error> {
        self.rule_of_rounds(released)?;
        match self.chance.clone() {
            Some(chance) => Family::with_chance(released, chance),
            None => Err(Error::new("model", "one of a map with lists", "another")),
        }
    }

    fn rule_of_rounds(&self, released: &Released<D>) -> Result<&EdgeRule, Error> {
        let map = released.fingerprint();
        map.expect(Some(self.map)).map_err(|error| error.within("model"))?;
        check_anchors(released)?;
        let solver = self.options.solver;
        let rule = self.rule.as_ref().filter(|_| solver == Solver::Joint);
        rule.ok_or_else(|| Error::new("solver of rounds", Solver::Joint.name(), solver.name()))
    }
}

/// Refuses slots that end within a record, or are not there.
fn check_records(
    slots: &Range<usize>,
    (n_records, per_record): (usize, usize),
) -> Result<(), Error> {
    let is_there = slots.start <= slots.end && slots.end <= n_records * per_record;
    if is_there && slots.start % per_record + slots.end % per_record == 0 {
        return Ok(());
    }
    let expected = format!("a range of whole records, {per_record} slots each");
    Err(Error::new("slots", expected, format!("{slots:?}")))
}

struct Move<'a, const D: usize> {
    standing: &'a Standing<D>,
    rows: EdgeRows<'a>,
    delta: f32,
    moved: &'a mut [Moved<D>],
}

impl<const D: usize> WithPieces<D> for Move<'_, D> {
    type Output = ();

    fn run<P: Pieces<D>>(self, pieces: &P) {
        self.standing.solve((pieces, &self.rows), self.delta * self.delta, self.moved);
    }
}

struct Tell<'a, const D: usize> {
    news: &'a News<D>,
    edges: &'a Edges,
}

impl<const D: usize> WithPieces<D> for Tell<'_, D> {
    type Output = Vec<(u32, u32)>;

    fn run<P: Pieces<D>>(self, pieces: &P) -> Self::Output {
        self.news.told(pieces, (self.edges.slots(), &self.edges.rows()))
    }
}
