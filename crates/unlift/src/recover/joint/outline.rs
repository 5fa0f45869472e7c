//! What is known of the edges of a map to whoever leads its rounds without them.

use super::agreement::Judges;
use super::course::Digest;
use super::look::Sample;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::graph::Graph;
use crate::{Error, Fingerprint};

/// How it begins.
const MAGIC: [u8; 8] = *b"unliftO1";

/// How many edges each slot of a map has, how often each record is at the other end of one, and a sample of them: 8 bytes a slot and
/// a few megabytes. What [`prepare_rounds`](crate::recover::prepare_rounds) learns for a [`Lead`](crate::recover::Lead).
pub struct Outline {
    map: Fingerprint,
    pub(crate) slots_per_record: usize,
    pub(crate) lengths: Vec<u32>,
    pub(crate) digest: Digest,
}

impl Outline {
    /// That of `graph`, which is of `map`.
    ///
    /// # Errors
    /// When edges cannot be read.
    pub(crate) fn new(map: Fingerprint, graph: &Graph, seed: u64) -> Result<Self, Error> {
        let lengths = graph.offsets().windows(2).map(|row| (row[1] - row[0]) as u32).collect();
        let slots_per_record = graph.slots_per_record();
        Ok(Self { map, slots_per_record, lengths, digest: Digest::new(graph, seed)? })
    }

    /// The released map that it is about.
    pub fn map(&self) -> Fingerprint {
        self.map
    }

    /// The outline as bytes, the same on every machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut to = Writer::default();
        to.bytes(&MAGIC);
        to.bytes(&self.map.0);
        to.bytes(&[self.slots_per_record as u8]);
        to.u32s(&self.lengths);
        self.digest.write(&mut to);
        to.into_bytes()
    }

    /// The outline that [`to_bytes`](Self::to_bytes) gave.
    ///
    /// # Errors
    /// When `bytes` are anything else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let mut from = Reader::new("outline", bytes);
        if from.array()? != MAGIC {
            return Err(from.wrong("an outline of this version", "other bytes"));
        }
        let map = Fingerprint(from.array()?);
        let slots_per_record = usize::from(from.array::<1>()?[0]);
        let lengths = from.u32s(u32::MAX as usize)?;
        let listed = from.u32s(lengths.len())?;
        if !(1..=2).contains(&slots_per_record) || lengths.len() != slots_per_record * listed.len()
        {
            let expected = format!("{} records", lengths.len() / slots_per_record.max(1));
            return Err(from.wrong(expected, listed.len().to_string()));
        }
        let sample = Sample::read(&mut from, (listed.len(), slots_per_record))?;
        let judges = Judges::read(&mut from, lengths.len())?;
        from.end()?;
        Ok(Self { map, slots_per_record, lengths, digest: Digest { listed, sample, judges } })
    }
}

impl std::fmt::Debug for Outline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Outline").field("n_slots", &self.lengths.len()).finish_non_exhaustive()
    }
}
