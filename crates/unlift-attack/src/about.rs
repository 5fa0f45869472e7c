//! What lists and positions are about: which released map, and what their rows are counted by.
//!
//! Both travel with the data, from a source of neighborhoods to the evaluation, so that nothing can be compared
//! with the truth of another map or in another order.

use std::fmt;

use crate::Error;

/// A released map, told by its content alone: whoever has the map can compute it, and it says nothing that the
/// map does not. Made by [`Released::fingerprint`](crate::released::Released::fingerprint).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Fingerprint(pub [u8; 16]);

impl Fingerprint {
    /// Reads 32 hexadecimal digits; `None` when `text` is anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits: Vec<u8> =
            text.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
        let bytes: Vec<u8> =
            digits.chunks(2).map(|pair| pair[0] << 4 | pair[pair.len() - 1]).collect();
        if digits.len() != 32 {
            return None;
        }
        bytes.try_into().ok().map(Self)
    }

    /// Refuses what is about another map than this one. What does not say is taken.
    ///
    /// # Errors
    /// When `found` is another map.
    pub fn expect(self, found: Option<Self>) -> Result<(), Error> {
        match found.filter(|found| *found != self) {
            None => Ok(()),
            Some(other) => {
                let expected = format!("{self}, that of the released map");
                Err(Error::new("fingerprint", expected, other.to_string()))
            }
        }
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// What rows are counted by. Only records that hide two points (paired lines) tell these apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RowOrder {
    /// Row `s` is slot `s` of the secret: the oracle, and lists that an owner gives by point.
    Slots,
    /// Row `s` is descriptor row `s`: lists made by comparing descriptors.
    DescriptorRows,
    /// The two rows of a record are its two points, and nobody can tell which is whose: lists made from records
    /// alone.
    Either,
    /// A file of somebody else that does not say.
    #[default]
    Unstated,
}

impl RowOrder {
    /// The orders that a file can state.
    pub const STATED: [RowOrder; 3] = [Self::Slots, Self::DescriptorRows, Self::Either];

    /// The name used in files; `None` for what is not stated.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Slots => Some("slots"),
            Self::DescriptorRows => Some("descriptor_rows"),
            Self::Either => Some("either"),
            Self::Unstated => None,
        }
    }

    /// The order called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::STATED.into_iter().find(|order| order.name() == Some(name))
    }
}

/// Who made lists, as far as that tells how they err.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ListsBy {
    /// The oracle: true neighbors, and wrong ones that were drawn.
    Oracle,
    /// Anybody else, or a file that does not say.
    #[default]
    Unstated,
}

impl ListsBy {
    /// The name used in files; `None` for what is not stated.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Oracle => Some("oracle"),
            Self::Unstated => None,
        }
    }
}

/// What rows of lists, or of positions made from them, are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct About {
    /// The released map; `None` where it is not known.
    pub map: Option<Fingerprint>,
    /// What rows are counted by.
    pub order: RowOrder,
    /// Who made the lists.
    pub lists_by: ListsBy,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for order in RowOrder::STATED {
            assert_eq!(order.name().and_then(RowOrder::from_name), Some(order));
        }
        let print = Fingerprint(std::array::from_fn(|at| 17 * at as u8));
        assert_eq!(Fingerprint::from_hex(&print.to_string()), Some(print));
        for wrong in ["", "0", &"0".repeat(31), &"0".repeat(33), &"g".repeat(32), &"é".repeat(16)]
        {
            assert_eq!(Fingerprint::from_hex(wrong), None, "{wrong}");
        }
    }
}
