//! What a user may choose about recovery.

use crate::Error;

/// A recovery method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
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

impl Solver {
    /// Every solver, in the order of help texts.
    pub const ALL: [Solver; 6] = [
        Self::Joint,
        Self::JointStart,
        Self::Consensus,
        Self::Ransac,
        Self::Density,
        Self::Tomography,
    ];

    /// The solvers that place points by their listed records. The others read the lists only to tell the
    /// two slots of a paired line apart, and take no delta.
    pub const FROM_LISTS: [Solver; 4] =
        [Self::Joint, Self::JointStart, Self::Consensus, Self::Ransac];

    /// The name users know it by.
    pub fn name(self) -> &'static str {
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
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new("solver", format!("one of {names}"), name)
        })
    }
}

/// The distance up to which a listed record supports a position, in the unit of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Delta {
    /// Chosen from the released map and the neighborhoods alone.
    Auto,
    /// Given.
    Fixed(f64),
}

/// Options of recovery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecoverOptions {
    /// The method.
    pub solver: Solver,
    /// The distance that decides support.
    pub delta: Delta,
    /// The attacker's own seed: null samples and random trials.
    pub seed: u64,
    /// Whether rules that tie records together are used where they fix coordinates: `cp` exchanges
    /// values that are still in the map, `ray-voxel` leaves every other voxel along a ray.
    pub exact_constraints: bool,
    /// Whether every recovered point gets the probability that it is right; a few microseconds each.
    pub confidence: bool,
}

impl Default for RecoverOptions {
    fn default() -> Self {
        Self {
            solver: Solver::Joint,
            delta: Delta::Auto,
            seed: 0,
            exact_constraints: true,
            confidence: true,
        }
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
                Err(Error::new("delta", "a positive length", delta.to_string()))
            }
            // Solvers compare squared distances in f32.
            Delta::Fixed(delta) if !(delta as f32 * delta as f32).is_normal() => {
                let expected = "a length whose square is in the range of f32";
                Err(Error::new("delta", expected, delta.to_string()))
            }
            Delta::Fixed(_) | Delta::Auto => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Solver;

    /// The next of all solvers: a new one does not compile here until it has a place.
    fn next(solver: Solver) -> Option<Solver> {
        match solver {
            Solver::Joint => Some(Solver::JointStart),
            Solver::JointStart => Some(Solver::Consensus),
            Solver::Consensus => Some(Solver::Ransac),
            Solver::Ransac => Some(Solver::Density),
            Solver::Density => Some(Solver::Tomography),
            Solver::Tomography => None,
        }
    }

    /// Whether it places points by their listed records.
    fn reads_lists(solver: Solver) -> bool {
        match solver {
            Solver::Joint | Solver::JointStart | Solver::Consensus | Solver::Ransac => true,
            Solver::Density | Solver::Tomography => false,
        }
    }

    /// What is in no list is run by no law.
    #[test]
    fn lists_hold_every_solver() {
        let all: Vec<Solver> =
            std::iter::successors(Some(Solver::Joint), |&one| next(one)).collect();
        assert_eq!(all, Solver::ALL);
        let from_lists: Vec<Solver> = all.into_iter().filter(|&one| reads_lists(one)).collect();
        assert_eq!(from_lists, Solver::FROM_LISTS);
    }
}
