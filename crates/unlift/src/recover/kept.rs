//! Where rounds stand, kept for whoever goes on after a run that was stopped.

use std::io;

use sha2::{Digest, Sha256};

use super::learned::Model;
use crate::Error;

/// How they begin; a hash of the model follows.
const MAGIC: [u8; 8] = *b"unliftR1";
/// Bytes before the rounds.
const HEAD: usize = MAGIC.len() + 32;

/// A place for where the rounds of one recovery stand: of one map, its lists and options.
pub trait Kept {
    /// What was kept last; `None` where nothing was.
    fn recall(&mut self) -> Option<Vec<u8>>;

    /// A round is over, and `write` writes where all stands: kept in place of what was before, or not, as whoever keeps it likes.
    fn keep(&mut self, write: &dyn Fn(&mut dyn io::Write) -> io::Result<()>);
}

/// Nothing is kept.
#[derive(Clone, Copy, Debug)]
pub struct Nowhere;

impl Kept for Nowhere {
    fn recall(&mut self) -> Option<Vec<u8>> {
        None
    }

    fn keep(&mut self, _write: &dyn Fn(&mut dyn io::Write) -> io::Result<()>) {}
}

/// Before rounds: what tells of which map and model they are. Their edges they tell themselves.
pub(super) struct Headed<'a> {
    kept: &'a mut dyn Kept,
    head: [u8; HEAD],
}

impl<'a> Headed<'a> {
    /// Those of `model`.
    pub(super) fn new<const D: usize>(kept: &'a mut dyn Kept, model: &Model<D>) -> Self {
        let mut head = [0; HEAD];
        head[..MAGIC.len()].copy_from_slice(&MAGIC);
        head[MAGIC.len()..].copy_from_slice(&Sha256::digest(model.to_bytes()));
        Self { kept, head }
    }

    /// What was kept last, with its head.
    pub(super) fn recall(&mut self) -> Option<Vec<u8>> {
        self.kept.recall()
    }

    /// The rounds behind the head of what was recalled.
    ///
    /// # Errors
    /// When it has another one.
    pub(super) fn rounds_of<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], Error> {
        bytes.strip_prefix(&self.head).ok_or_else(|| {
            let expected = "rounds of this version, map and options";
            Error::new("kept rounds", expected, "others")
        })
    }

    /// Keeps rounds that `write` writes, behind the head.
    pub(super) fn keep(&mut self, write: &dyn Fn(&mut dyn io::Write) -> io::Result<()>) {
        let head = self.head;
        self.kept.keep(&|to| {
            to.write_all(&head)?;
            write(to)
        });
    }
}
