//! What recovery says about one slot: a position or a reason.

/// What became of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Status {
    /// Recovered.
    Ok = 0,
    /// Fewer than two neighbors are listed that could say anything.
    TooFewNeighbors = 1,
    /// The neighbors do not fix a point (parallel lines, a missing axis).
    Degenerate = 2,
    /// No position agrees with any neighbor.
    NoSupport = 3,
}

impl Status {
    /// Every status.
    pub const ALL: [Status; 4] =
        [Self::Ok, Self::TooFewNeighbors, Self::Degenerate, Self::NoSupport];

    /// The name used in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::TooFewNeighbors => "too_few_neighbors",
            Self::Degenerate => "degenerate",
            Self::NoSupport => "no_support",
        }
    }

    /// The status called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }
}

/// What recovery says about one slot, before it is put in columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const D: usize> {
    /// Position about the released origin; NaN unless `status` is `Ok`.
    pub position: [f32; D],
    /// What became of the slot.
    pub status: Status,
    /// Listed records that the position was made of: within delta of it before the last refit (planes:
    /// within 1.5 delta, summed over the free axes). Joint recovery: records listed by the slot or by
    /// whose slots its own is, with an estimate near. Counts beyond 65,535 stay there.
    pub support: u16,
    /// The axis on which the hidden coordinate lies (axis candidates only, else 0).
    pub axis: u8,
    /// Improbability of the support by chance, in nats (0 or more).
    pub evidence: f32,
}

/// A count as it is stored.
pub(crate) fn stored_support(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

impl<const D: usize> Estimate<D> {
    /// A slot that could not be recovered.
    pub fn lost(status: Status) -> Self {
        Self { position: [f32::NAN; D], status, support: 0, axis: 0, evidence: 0.0 }
    }
}
