//! Why nobody can say how sure the attacker is.

/// Why a recovered map has no [`Confidence`](super::probability::Confidence). Better none than one that does not come true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// It was not asked for.
    NotAsked,
    /// The positions come from elsewhere, without it.
    NotGiven,
    /// The model was fitted on maps: in images nobody has compared it with what comes true.
    OfImages,
    /// The solver is not `joint`: nothing was fitted for others.
    OtherSolver,
    /// The lists have scores, as sources that rank give them: nothing was fitted on how those err.
    RankedLists,
    /// Nobody says that the oracle made the lists: others err in ways on which nothing was fitted.
    GivenLists,
    /// What came back is flat or thin: records cross everywhere in a plane, and every crossing looks like a point.
    Flat,
    /// Lists have more entries per hidden point than in any map that the model was fitted on.
    SmallMap,
}

impl Unknown {
    /// The reason in plain words, as half a sentence after "not known here: ".
    pub fn reason(self) -> &'static str {
        match self {
            Self::NotAsked => "it was not asked for",
            Self::NotGiven => "the recovered points come without it",
            Self::OfImages => {
                "it was fitted on maps and never compared with what comes true in images"
            }
            Self::OtherSolver => "nothing was fitted for solvers other than joint",
            Self::RankedLists => "nothing was fitted on how lists err that a source ranked",
            Self::GivenLists => "nothing was fitted on how lists err that the oracle did not make",
            Self::Flat => "nothing was fitted on flat or thin maps, where records cross everywhere",
            Self::SmallMap => {
                "lists have more entries than a hundredth of all points, more than in any map that it was fitted on"
            }
        }
    }
}
