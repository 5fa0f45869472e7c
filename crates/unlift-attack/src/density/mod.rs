//! Attacks on the records alone, without neighborhoods and descriptors.
//!
//! Every record is a line (a half-line, one of three lines) that contains a hidden point, and points are dense on surfaces.
//! [`tomography`] uses that. Records relate to the density of hidden points as coincidence lines to the activity in positron emission
//! tomography. So the same iterations find the density that makes all records likeliest: maximum likelihood by expectation maximization
//! (Shepp and Vardi 1982) with smoothing (Silverman et al. 1990). Each point is placed where its record meets most of the
//! density. The published attacks read the same [`feasible`] lines (`recover/baselines/density.rs`).
//!
//! Two modules use the result: `neighbors` lists records whose points are close, and `recover` takes the positions as they are.
//! It works in three dimensions only: in a plane all lines meet.

pub(crate) mod feasible;
mod grid;
mod peaks;
mod spread;
mod tomography;

pub(crate) use tomography::tomography;

/// The estimate of an attack for one slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    /// Position relative to the released origin.
    pub(crate) position: [f32; 3],
    /// Axis along which the position was found (axis candidates; else 0).
    pub(crate) axis: u8,
    /// Logarithm of the likelihood ratio of the position to a uniformly random one on the record, in nats.
    pub(crate) evidence: f32,
}

/// The result of an attack: one entry per slot, `None` without an estimate. The two peaks of a paired line are in order along the line,
/// because it is unknown which slot each belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Peaks {
    pub(crate) of: Vec<Option<Peak>>,
    /// Smallest distance at which positions differ, in the unit of the map; 0 without peaks.
    pub(crate) resolution: f64,
}

impl Peaks {
    /// Creates a result without estimates.
    pub(crate) fn none(n_slots: usize) -> Self {
        Self { of: vec![None; n_slots], resolution: 0.0 }
    }
}
