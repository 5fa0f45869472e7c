//! Attacks that need neither neighborhoods nor descriptors: the records alone tell where points are.
//!
//! Every record is a line (a half-line, one of three lines) known to hold a hidden point, and points
//! crowd on surfaces. [`tomography`] uses that: records are to the density of hidden points what coincidence lines are to the
//! activity in positron emission tomography, so the density that makes all records likeliest is found
//! by the same rounds (maximum likelihood by expectation maximization, Shepp and Vardi 1982, with
//! smoothing, Silverman et al. 1990), and each point lies where its record meets most of it. The published
//! attacks read the same [`feasible`] lines (`recover/baselines/density`).
//!
//! This stage stands between `released` and its two users: `neighbors` lists records that end up close,
//! `recover` takes the positions as they are. It is for three dimensions: in the plane all
//! lines meet, and meeting tells nothing.

pub(crate) mod feasible;
mod grid;
mod peaks;
mod spread;
mod tomography;

pub(crate) use tomography::tomography;

/// What an attack says about one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// About the released origin.
    pub(crate) position: [f32; 3],
    /// The axis the position was found along (axis candidates; else 0).
    pub(crate) axis: u8,
    /// How many times likelier the position is than one drawn blindly from the record, in nats.
    pub(crate) evidence: f32,
}

/// The answer of an attack: one entry per slot, `None` where it has nothing to say. Which of a paired
/// line's two peaks belongs to which of its slots is not known; the order is that along the line.
#[derive(Clone, Debug)]
pub(crate) struct Peaks {
    pub(crate) of: Vec<Option<Peak>>,
    /// The length below which positions are not told apart, in the unit of the map; 0 without peaks.
    pub(crate) resolution: f64,
}

impl Peaks {
    /// No answer for any of `n_slots`.
    pub(crate) fn none(n_slots: usize) -> Self {
        Self { of: vec![None; n_slots], resolution: 0.0 }
    }
}
