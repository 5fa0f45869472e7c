//! How hidden points are recovered from lists: the trait that anybody may implement, and the solvers of this crate.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use super::options::RecoverOptions;
use super::result::Recovered;
use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::Released;

/// A recovery method: from released records and the lists of their neighbors to positions. Anybody may write one; an audit takes
/// `Arc<dyn Solver<D>>`.
///
/// [`Recovered::from_positions`] turns positions into what a solver returns.
pub trait Solver<const D: usize>: Any + Debug + Send + Sync {
    /// The name in rows and reports: one plain word, which no solver of this crate has.
    fn name(&self) -> &str;

    /// Places the hidden point of every slot of `released`, or says why it cannot.
    ///
    /// The result depends on the arguments alone, not on threads; chance comes from `options.seed`.
    ///
    /// # Errors
    /// When the solver cannot work on this map or with these options.
    fn recover(
        &self,
        released: &Released<D>,
        lists: &Neighborhoods,
        options: &RecoverOptions,
    ) -> Result<Recovered<D>, Error>;

    /// Whether positions depend on the lists. Without them, only the records are attacked.
    fn reads_lists(&self) -> bool {
        true
    }
}

/// A solver of this crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builtin {
    /// The position that agrees with the listed records least probably by chance: exact, no
    /// sampling, the same cost at every inlier ratio.
    Consensus,
    /// Consensus, then iterations in which the estimates of listed neighbors vote too.
    Joint,
    /// The consensus pass that joint recovery starts from, and no iteration more. It is not [`Self::Consensus`]:
    /// with one point a record it reads every list in both directions (who lists, and who is listed by),
    /// and its delta is a narrower one, so that estimates are sharp.
    JointStart,
    /// The paper's sampling loop (section 4), for comparison.
    Ransac,
    /// The published density attacks on the records alone (Chelani et al. 2021, Lee et al. 2023, Moon et
    /// al. 2024), for comparison; recovers nothing from planes and axis candidates.
    Density,
    /// The density of points that makes the records likeliest, and the points where they meet it: our
    /// strongest attack without neighborhoods. Recovers nothing from planes.
    Tomography,
}

impl Builtin {
    /// Every solver, in the order of help texts.
    pub const ALL: [Builtin; 6] = [
        Self::Joint,
        Self::JointStart,
        Self::Consensus,
        Self::Ransac,
        Self::Density,
        Self::Tomography,
    ];

    /// The solvers that place points by their listed records. The others read the lists only to tell the
    /// two slots of a paired line apart, and take no delta.
    pub const FROM_LISTS: [Builtin; 4] =
        [Self::Joint, Self::JointStart, Self::Consensus, Self::Ransac];

    /// The name users know it by.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Consensus => "consensus",
            Self::Joint => "joint",
            Self::JointStart => "joint-start",
            Self::Ransac => "ransac",
            Self::Density => "density",
            Self::Tomography => "tomography",
        }
    }

    /// The solver called `name`.
    ///
    /// # Errors
    /// When there is none; the message lists all.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|solver| solver.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(|solver| solver.name()).join(", ");
            Error::new("solver", format!("one of {names}"), name)
        })
    }

    /// `solvers` as an audit takes them.
    pub fn list<const D: usize>(solvers: &[Self]) -> Vec<Arc<dyn Solver<D>>> {
        solvers.iter().map(|&solver| Arc::new(solver) as Arc<dyn Solver<D>>).collect()
    }

    /// The builtin solver that `solver` is, if it is one.
    pub fn of<const D: usize>(solver: &dyn Solver<D>) -> Option<Self> {
        let any: &dyn Any = solver;
        any.downcast_ref().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::Builtin;

    /// The next of all solvers: a new one does not compile here until it has a place.
    fn next(solver: Builtin) -> Option<Builtin> {
        match solver {
            Builtin::Joint => Some(Builtin::JointStart),
            Builtin::JointStart => Some(Builtin::Consensus),
            Builtin::Consensus => Some(Builtin::Ransac),
            Builtin::Ransac => Some(Builtin::Density),
            Builtin::Density => Some(Builtin::Tomography),
            Builtin::Tomography => None,
        }
    }

    /// Whether it places points by their listed records.
    fn reads_lists(solver: Builtin) -> bool {
        match solver {
            Builtin::Joint | Builtin::JointStart | Builtin::Consensus | Builtin::Ransac => true,
            Builtin::Density | Builtin::Tomography => false,
        }
    }

    /// What is in no list is run by no law.
    #[test]
    fn lists_hold_every_solver() {
        let all: Vec<Builtin> =
            std::iter::successors(Some(Builtin::Joint), |&one| next(one)).collect();
        assert_eq!(all, Builtin::ALL);
        let from_lists: Vec<Builtin> = all.into_iter().filter(|&one| reads_lists(one)).collect();
        assert_eq!(from_lists, Builtin::FROM_LISTS);
    }
}
