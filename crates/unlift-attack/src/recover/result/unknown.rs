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
    /// Most points fall together, so that their records agree at wrong places, too.
    Coincident,
    /// Lists have more entries per hidden point than in any map that the model was fitted on.
    SmallMap,
}

impl Unknown {
    /// All reasons.
    pub const ALL: [Self; 9] = [
        Self::NotAsked,
        Self::NotGiven,
        Self::OfImages,
        Self::OtherSolver,
        Self::RankedLists,
        Self::GivenLists,
        Self::Flat,
        Self::Coincident,
        Self::SmallMap,
    ];

    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotAsked => "not_asked",
            Self::NotGiven => "not_given",
            Self::OfImages => "images",
            Self::OtherSolver => "other_solver",
            Self::RankedLists => "ranked_lists",
            Self::GivenLists => "given_lists",
            Self::Flat => "flat",
            Self::Coincident => "coincident",
            Self::SmallMap => "small_map",
        }
    }

    /// The reason called so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|why| why.name() == name)
    }

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
            Self::Coincident => "nothing was fitted on maps of which most points fall together",
            Self::SmallMap => {
                "lists have more entries than a hundredth of all points, more than in any map that it was fitted on"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Unknown;

    #[test]
    fn names_are_read_back() {
        for (at, why) in Unknown::ALL.into_iter().enumerate() {
            assert_eq!(Unknown::from_name(why.name()), Some(why));
            assert_eq!(why as usize, at, "in the order of the type, none left out");
        }
        assert_eq!(Unknown::from_name("unknown"), None);
    }
}
