//! Solvers: the trait [`Solver`], which you can implement, its options, and the solvers of this crate.

use std::fmt::Debug;
use std::sync::Arc;

use super::result::Recovered;
use crate::neighbors::Neighborhoods;
use crate::released::Released;
use crate::{Error, named};

/// The distance up to which a listed record supports a position, in the unit of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delta {
    /// Chosen automatically, from the released map and the neighborhoods.
    Auto,
    /// A fixed length.
    Fixed(f64),
}

/// Options of recovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecoverOptions {
    /// The distance that decides support.
    pub delta: Delta,
    /// The attacker's random seed, for null samples and random trials.
    pub seed: u64,
    /// Whether to compute the probability that each recovered point is right; it takes a few microseconds per point.
    pub confidence: bool,
}

impl Default for RecoverOptions {
    fn default() -> Self {
        Self { delta: Delta::Auto, seed: 0, confidence: true }
    }
}

impl RecoverOptions {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field out of range.
    pub fn check(&self) -> Result<(), Error> {
        match self.delta {
            Delta::Fixed(delta) if !(delta.is_finite() && delta > 0.0) => {
                Err(Error::new("delta", "a positive length", delta))
            }
            // Solvers compare squared distances in f32.
            Delta::Fixed(delta) if !(delta as f32 * delta as f32).is_normal() => {
                let expected = "a length whose square is in the range of f32";
                Err(Error::new("delta", expected, delta))
            }
            Delta::Fixed(_) | Delta::Auto => Ok(()),
        }
    }
}

/// A recovery method: it turns released records and lists of their neighbors into positions. An audit takes `Arc<dyn Solver<D>>`.
///
/// [`Recovered::from_positions`] makes the return value from positions.
pub trait Solver<const D: usize>: Debug + Send + Sync {
    /// Name in rows and reports: one plain word, different from the names in [`Builtin::ALL`].
    fn name(&self) -> &str;

    /// Recovers the hidden point of every slot of `released`.
    ///
    /// The result depends on the arguments alone, not on the number of threads. Randomness comes from `options.seed`.
    ///
    /// # Errors
    /// When the solver does not support this map or these options.
    fn recover(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Recovered<D>, Error>;

    /// Whether positions depend on the lists. Otherwise the solver attacks the records alone.
    fn reads_lists(&self) -> bool {
        true
    }

    /// Returns this solver if it is one of this crate.
    fn builtin(&self) -> Option<Builtin> {
        None
    }
}

named! {
    /// A solver of this crate, in the order of help texts.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Builtin {
        /// Our strongest attack: consensus with lists in both directions, then all slots together from the estimates of their neighbors,
        /// last the positions under which the whole lists are likeliest, also by what they do not name, or several weighed places.
        Joint = "joint",
        /// On each slot's record, the position whose support is least probable by chance. The search is exact.
        Consensus = "consensus",
        /// The sampling loop of the paper (section 4), for comparison.
        Ransac = "ransac",
        /// The published density attacks on the records alone (Chelani et al. 2021, Lee et al. 2023, Moon et al. 2024), for comparison.
        /// They recover nothing from planes and axis candidates.
        Density = "density",
        /// Our strongest attack on the records alone: the peak on each record of the density that makes records likeliest. Not on planes.
        Tomography = "tomography",
    }
}

impl Builtin {
    /// The solvers that compute positions from lists. Others have no delta, and use lists only to order the points of paired lines.
    pub const FROM_LISTS: [Builtin; 3] = [Self::Joint, Self::Consensus, Self::Ransac];

    /// Returns the solver called `name`. For one version, two former names are read: `ranking`, which is [`Self::Joint`] now, and
    /// `joint-start`, of which [`Self::Consensus`] is left.
    ///
    /// # Errors
    /// When there is none. The message lists all names.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        let name = match name {
            "ranking" => "joint",
            "joint-start" => "consensus",
            name => name,
        };
        Self::named(name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new("solver", format!("one of {names}"), name)
        })
    }

    /// Converts `solvers` to the type that an audit takes.
    pub fn list<const D: usize>(solvers: &[Self]) -> Vec<Arc<dyn Solver<D>>> {
        solvers.iter().map(|&solver| Arc::new(solver) as Arc<dyn Solver<D>>).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Builtin;

    /// Property tests run over this list. A new variant does not compile until it is here.
    #[test]
    fn the_solvers_that_read_lists_are_listed() {
        let reads_lists = |solver: &Builtin| match solver {
            Builtin::Joint | Builtin::Consensus | Builtin::Ransac => true,
            Builtin::Density | Builtin::Tomography => false,
        };
        assert!(Builtin::ALL.into_iter().filter(reads_lists).eq(Builtin::FROM_LISTS));
    }
}
