//! What a round is made of, as bytes for whoever holds a part of the edges.

use std::io::Write;

use super::jumps::Jumps;
use super::neighbor_law::Law;
use super::standing::Standing;
use crate::Error;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::crowding::Density;
use crate::recover::map::graph::EdgeRows;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::{FAR, Places};
use crate::recover::result::estimate::{Estimate, Status};

/// How they begin.
const STANDING: [u8; 8] = *b"unliftS1";
const NEWS: [u8; 8] = *b"unliftJ1";

impl<const D: usize> Standing<D> {
    /// Where the round stands, some 30 bytes a slot, and as many again where the density is fine.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut to = Writer::default();
        self.write(&mut to);
        to.into_bytes()
    }

    /// Appends these bytes.
    pub(crate) fn write<W: Write>(&self, to: &mut Writer<W>) {
        to.bytes(&STANDING);
        to.bytes(&[D as u8, u8::from(self.done), self.turns as u8, self.turn as u8]);
        to.u64(self.next.len() as u64);
        write_estimates(&self.next, to);
        to.f32s(&self.ahead);
        let told: Vec<(u32, u32)> = self.jumps.told().collect();
        to.u64(told.len() as u64);
        for (slot, jumps) in told {
            to.u32(slot);
            to.u32(jumps);
        }
        self.density.write(to);
        self.law.write(to);
    }

    /// What [`to_bytes`](Self::to_bytes) gave, of a map with so many slots.
    ///
    /// # Errors
    /// When `bytes` are anything else.
    pub(crate) fn from_bytes(bytes: &[u8], n_slots: usize) -> Result<Self, Error> {
        let mut from = Reader::new("round", bytes);
        let [dimensions, done, turns, turn] = head(&mut from, STANDING, n_slots)?;
        if usize::from(dimensions) != D {
            return Err(from.wrong(format!("one in {D} dimensions"), dimensions.to_string()));
        }
        // The turn of a sweep that is over is the one after the last.
        if turns == 0 || turn > turns || (turn == turns && done == 0) {
            return Err(from.wrong(format!("a turn below {turns}"), turn.to_string()));
        }
        let next = read_estimates(&mut from, n_slots)?;
        let ahead = from.f32s(n_slots)?;
        let mut jumps = Jumps::new(n_slots);
        let mut first = 0;
        for _ in 0..from.count(n_slots)? {
            let slot = ascending(&mut from, &mut first, n_slots)?;
            jumps.add(slot as usize, from.u32()?);
        }
        let density = Density::read(&mut from, n_slots)?;
        let law = Law::read(&mut from)?;
        from.end()?;
        let (turns, turn, done) = (turns.into(), turn.into(), done != 0);
        let places = Places::new(&next);
        Ok(Self { next, places, density, law, ahead, jumps, turns, turn, done })
    }
}

/// Who jumped in a round, and what must be known to tell those whom it concerns.
pub(crate) struct News<const D: usize> {
    reach: f32,
    /// Per slot whether its place is ahead of others, so that jumps are of interest.
    is_ahead: Vec<bool>,
    /// In order of slots.
    jumps: Vec<(u32, [f32; D], [f32; D])>,
}

impl<const D: usize> News<D> {
    /// That of a round that `standing` is of, whose slots are `after`wards there; `jumpers` in any order.
    pub(crate) fn new(standing: &Standing<D>, mut jumpers: Vec<u32>, after: &Places<D>) -> Self {
        jumpers.sort_unstable();
        let jump = |slot: u32| (slot, standing.places.of(slot as usize), after.of(slot as usize));
        Self {
            reach: standing.reach(),
            is_ahead: standing.ahead.iter().map(|&ahead| ahead > 0.0).collect(),
            jumps: jumpers.into_iter().map(jump).collect(),
        }
    }

    /// Whether nothing is to be told.
    pub(crate) fn is_empty(&self) -> bool {
        self.jumps.is_empty() || !self.is_ahead.contains(&true)
    }

    /// The news as bytes.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut to = Writer::default();
        to.bytes(&NEWS);
        to.bytes(&[D as u8, 0, 0, 0]);
        to.u64(self.is_ahead.len() as u64);
        to.f32s(&[self.reach]);
        let bits = |ahead: &[bool]| ahead.iter().rev().fold(0, |all, &is| all << 1 | u8::from(is));
        self.is_ahead.chunks(8).for_each(|ahead| to.bytes(&[bits(ahead)]));
        to.u64(self.jumps.len() as u64);
        for (slot, before, after) in &self.jumps {
            to.u32(*slot);
            to.f32s(before);
            to.f32s(after);
        }
        to.into_bytes()
    }

    /// What [`to_bytes`](Self::to_bytes) gave, of a map with so many slots.
    ///
    /// # Errors
    /// When `bytes` are anything else.
    pub(crate) fn from_bytes(bytes: &[u8], n_slots: usize) -> Result<Self, Error> {
        let mut from = Reader::new("news", bytes);
        let [dimensions, ..] = head(&mut from, NEWS, n_slots)?;
        if usize::from(dimensions) != D {
            return Err(from.wrong(format!("some in {D} dimensions"), dimensions.to_string()));
        }
        let reach = from.f32()?;
        let bits = from.bytes(n_slots.div_ceil(8))?;
        let is_ahead = (0..n_slots).map(|slot| bits[slot / 8] >> (slot % 8) & 1 == 1).collect();
        let n = from.count(n_slots)?;
        let mut jumps = Vec::with_capacity(n);
        let mut first = 0;
        for _ in 0..n {
            let slot = ascending(&mut from, &mut first, n_slots)?;
            let mut places = [[0.0; D]; 2];
            for x in places.as_flattened_mut() {
                *x = from.f32()?;
            }
            jumps.push((slot, places[0], places[1]));
        }
        from.end()?;
        Ok(Self { reach, is_ahead, jumps })
    }

    /// How many jumps concern whom, of those slots whose edges are given.
    pub(crate) fn told<P: Pieces<D>>(
        &self,
        pieces: &P,
        (slots, edges): (std::ops::Range<usize>, &EdgeRows<'_>),
    ) -> Vec<(u32, u32)> {
        let at = |slot: usize| self.jumps.partition_point(|jump| (jump.0 as usize) < slot);
        let jumps = Jumps::new(self.is_ahead.len());
        let jumpers = &self.jumps[at(slots.start)..at(slots.end)];
        let is_ahead = |slot: usize| self.is_ahead[slot];
        jumps.tell((pieces, edges), jumpers, |jump| *jump, self.reach, is_ahead);
        jumps.told().collect()
    }
}

/// The first bytes: what they are, four more, and how many slots.
fn head(from: &mut Reader<'_>, magic: [u8; 8], n_slots: usize) -> Result<[u8; 4], Error> {
    if from.array()? != magic {
        return Err(from.wrong("bytes of this version", "others"));
    }
    let four = from.array()?;
    match from.u64()? {
        n if n == n_slots as u64 => Ok(four),
        n => Err(from.wrong(format!("those of {n_slots} slots"), n.to_string())),
    }
}

/// Appends estimates, but not how many there are.
pub(crate) fn write_estimates<const D: usize, W: Write>(
    estimates: &[Estimate<D>],
    to: &mut Writer<W>,
) {
    for estimate in estimates {
        to.f32s(&estimate.position);
        to.bytes(&estimate.support.to_le_bytes());
        to.bytes(&[estimate.status as u8, estimate.axis]);
        to.f32s(&[estimate.evidence]);
    }
}

/// Refuses what nobody can have found of a slot.
pub(crate) fn check_estimates<'a, const D: usize>(
    mut estimates: impl Iterator<Item = &'a Estimate<D>>,
) -> Result<(), Error> {
    let can_be = |one: &&Estimate<D>| {
        let is_place = one.position.iter().all(|x| x.abs() < FAR);
        usize::from(one.axis) < D && is_place == (one.status == Status::Ok)
    };
    match estimates.find(|one| !can_be(one)) {
        None => Ok(()),
        Some(one) => {
            Err(Error::new("estimate", "a place if and only if it is ok", format!("{one:?}")))
        }
    }
}

/// So many estimates.
///
/// # Errors
/// When they are not there, or one cannot be.
pub(crate) fn read_estimates<const D: usize>(
    from: &mut Reader<'_>,
    n: usize,
) -> Result<Vec<Estimate<D>>, Error> {
    (0..n).map(|_| estimate(from)).collect()
}

fn estimate<const D: usize>(from: &mut Reader<'_>) -> Result<Estimate<D>, Error> {
    let mut position = [0.0; D];
    for x in &mut position {
        *x = from.f32()?;
    }
    let support = u16::from_le_bytes(from.array()?);
    let [status, axis] = from.array()?;
    let status = *Status::ALL
        .get(usize::from(status))
        .ok_or_else(|| from.wrong("a status", status.to_string()))?;
    if usize::from(axis) >= D {
        return Err(from.wrong(format!("an axis below {D}"), axis.to_string()));
    }
    Ok(Estimate { position, status, support, axis, evidence: from.f32()? })
}

/// The next slot, not before `first`, which becomes the one after it.
fn ascending(from: &mut Reader<'_>, first: &mut u32, n_slots: usize) -> Result<u32, Error> {
    let slot = from.below(n_slots)?;
    if slot < *first {
        return Err(from.wrong("ascending slots", format!("{slot} after {}", *first - 1)));
    }
    *first = slot + 1;
    Ok(slot)
}
